//! Pair data in the order in which the two passes read them.

use glam::{DMat3, DVec3};
use pulp::Arch;

use crate::error::ElasticError;
use crate::kernel::{Lanes, Real, Row};
use crate::law::outer;
use crate::model::Stencils;

/// Largest relative `g_ii + sum_j g_ij`.
const CONSISTENCY_TOLERANCE: f64 = 1e-8;

/// Stencil rows and their reversed copy.
///
/// Pass one reads row i of `pairs`, pass two row i of `incoming`, both front to back: looking
/// `g_ji` up by pair index instead costs two to three times as much.
#[derive(Debug, Clone)]
pub(crate) struct Rows<L: Lanes> {
    graph: Graph,
    /// `g_ij` and `w_ij`.
    pairs: Vec<L::Pair>,
    /// `g_ji` and `w_ji` at the place of incoming pair (i, j).
    incoming: Vec<L::Pair>,
    /// What the processor offers to the loops.
    pub(crate) arch: Arch,
}

/// The graph and, if it is not symmetric, its transpose.
#[derive(Debug, Clone)]
pub(crate) struct Graph {
    offsets: Vec<u32>,
    indices: Vec<u32>,
    transpose: Option<(Vec<u32>, Vec<u32>)>,
}

/// What a row gives its node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowSums {
    /// `sum_j X_ij g_ij^T`.
    pub(crate) consistency: DMat3,
    /// `A = sum_j y_ij X_ij^T`, `y_ij = w_ij X_ij`; zero without control.
    pub(crate) moment: DMat3,
    /// `sum_j y_ij`; zero without control.
    pub(crate) offset: DVec3,
    /// `g_ii = -sum_j g_ij` of the stored gradients.
    pub(crate) self_gradient: DVec3,
}

fn range(offsets: &[u32], node: usize) -> std::ops::Range<usize> {
    offsets[node] as usize..offsets[node + 1] as usize
}

impl Graph {
    pub(crate) fn new(stencils: &Stencils<'_>, symmetric: bool) -> Result<Self, ElasticError> {
        let node_count = stencils.self_gradients.len();
        for node in 0..node_count {
            let mut before = None;
            for &j in &stencils.indices[range(stencils.offsets, node)] {
                let j = j as usize;
                if j >= node_count || j == node || before.is_some_and(|b| b >= j) {
                    return Err(ElasticError::BadRow { node, neighbor: j });
                }
                before = Some(j);
            }
        }
        let turned = transpose(stencils.offsets, stencils.indices);
        let transpose = if turned.0 == stencils.offsets && turned.1 == stencils.indices {
            None
        } else if symmetric {
            return Err(first_one_way_pair(stencils, &turned));
        } else {
            Some(turned)
        };
        Ok(Self {
            offsets: stencils.offsets.to_vec(),
            indices: stencils.indices.to_vec(),
            transpose,
        })
    }

    pub(crate) fn pair_count(&self) -> usize {
        self.indices.len()
    }

    fn incoming(&self) -> (&[u32], &[u32]) {
        match &self.transpose {
            None => (&self.offsets, &self.indices),
            Some((offsets, indices)) => (offsets, indices),
        }
    }

    fn find_incoming(&self, node: usize, from: usize) -> Option<usize> {
        let (offsets, indices) = self.incoming();
        let at = range(offsets, node);
        let start = at.start;
        let found = indices[at].binary_search_by(|&j| (j as usize).cmp(&from));
        found.ok().map(|k| start + k)
    }

    fn bytes(&self) -> usize {
        let words = |v: &Vec<u32>| v.capacity() * size_of::<u32>();
        let transpose = self.transpose.as_ref();
        words(&self.offsets)
            + words(&self.indices)
            + transpose.map_or(0, |(a, b)| words(a) + words(b))
    }
}

impl<L: Lanes> Rows<L> {
    pub(crate) fn new(graph: Graph) -> Self {
        let count = graph.pair_count();
        Self {
            graph,
            pairs: vec![L::pair(DVec3::ZERO, 0.0); count],
            incoming: vec![L::pair(DVec3::ZERO, 0.0); count],
            arch: Arch::new(),
        }
    }

    pub(crate) fn pair_count(&self) -> usize {
        self.graph.pair_count()
    }

    /// Neighbours, `g_ij` and `w_ij` of a node.
    #[inline]
    pub(crate) fn row(&self, node: usize) -> Row<'_, L::Pair> {
        let at = range(&self.graph.offsets, node);
        Row {
            node,
            indices: &self.graph.indices[at.clone()],
            pairs: &self.pairs[at],
        }
    }

    /// The pairs of a node's row.
    pub(crate) fn pair_range(&self, node: usize) -> std::ops::Range<usize> {
        range(&self.graph.offsets, node)
    }

    /// Nodes in whose rows `node` appears, with `g_ji` and `w_ji`.
    #[inline]
    pub(crate) fn incoming(&self, node: usize) -> Row<'_, L::Pair> {
        let (offsets, indices) = self.graph.incoming();
        let at = range(offsets, node);
        Row {
            node,
            indices: &indices[at.clone()],
            pairs: &self.incoming[at],
        }
    }

    /// Checks one row and copies it in, with its reversed copies.
    pub(crate) fn set_row(
        &mut self,
        node: usize,
        stencils: &Stencils<'_>,
        rest: &[DVec3],
    ) -> Result<RowSums, ElasticError> {
        let not_finite = |what| ElasticError::NotFinite { what, node };
        let mut sums = RowSums {
            consistency: DMat3::ZERO,
            moment: DMat3::ZERO,
            offset: DVec3::ZERO,
            self_gradient: DVec3::ZERO,
        };
        if !stencils.self_gradients[node].is_finite() {
            return Err(not_finite("self gradient"));
        }
        let at = range(&self.graph.offsets, node);
        let weight = |p: usize| stencils.weights.get(p).copied().unwrap_or(1.0);
        let mut size = stencils.self_gradients[node].length();
        let mut left = stencils.self_gradients[node];
        for p in at.clone() {
            let (g, w) = (stencils.gradients[p], weight(p));
            if !g.is_finite() {
                return Err(not_finite("gradient"));
            }
            if !w.is_finite() || w < 0.0 {
                return Err(not_finite("weight"));
            }
            let x = rest[self.graph.indices[p] as usize] - rest[node];
            sums.consistency += outer(x, g);
            size += g.length();
            left += g;
        }
        if left.length() > CONSISTENCY_TOLERANCE * size {
            let residual = left.length() / size;
            return Err(ElasticError::InconsistentRow { node, residual });
        }
        for p in at {
            let j = self.graph.indices[p] as usize;
            let pair = L::pair(stencils.gradients[p], weight(p));
            let x = rest[j] - rest[node];
            let y = L::offset(&pair, x);
            sums.offset += y;
            sums.moment += outer(y, x);
            sums.self_gradient -= L::gradient(&pair);
            self.pairs[p] = pair;
            // Every pair (i, j) is an incoming pair of j: the lists are transposes.
            if let Some(at) = self.graph.find_incoming(j, node) {
                self.incoming[at] = pair;
            }
        }
        Ok(sums)
    }

    /// Checks that the weights of a node's pairs are the same both ways.
    pub(crate) fn check_symmetry(&self, node: usize) -> Result<(), ElasticError> {
        for p in range(&self.graph.offsets, node) {
            let neighbor = self.graph.indices[p] as usize;
            let back = self.graph.find_incoming(neighbor, node);
            let same = back.is_some_and(|q| {
                let [a, b] = [p, q].map(|at| L::weight(&self.incoming[at]));
                (a - b).abs() <= L::Number::WEIGHT_TOLERANCE * a.max(b)
            });
            if !same {
                return Err(ElasticError::AsymmetricPair { node, neighbor });
            }
        }
        Ok(())
    }

    /// Heap bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.graph.bytes()
            + self.pairs.capacity() * size_of::<L::Pair>()
            + self.incoming.capacity() * size_of::<L::Pair>()
    }
}

/// Transpose of a CSR pattern; rows come out sorted.
fn transpose(offsets: &[u32], indices: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let node_count = offsets.len() - 1;
    let mut starts = vec![0_u32; node_count + 1];
    for &j in indices {
        starts[j as usize + 1] += 1;
    }
    for node in 0..node_count {
        starts[node + 1] += starts[node];
    }
    let mut next = starts.clone();
    let mut sources = vec![0_u32; indices.len()];
    for (node, row) in (0_u32..).zip(offsets.windows(2)) {
        for &j in &indices[row[0] as usize..row[1] as usize] {
            let at = &mut next[j as usize];
            sources[*at as usize] = node;
            *at += 1;
        }
    }
    (starts, sources)
}

fn first_one_way_pair(stencils: &Stencils<'_>, turned: &(Vec<u32>, Vec<u32>)) -> ElasticError {
    for node in 0..turned.0.len() - 1 {
        let out = &stencils.indices[range(stencils.offsets, node)];
        let back = &turned.1[range(&turned.0, node)];
        let one_way = |from: &[u32], to: &[u32]| {
            from.iter()
                .find(|&j| to.binary_search(j).is_err())
                .map(|&j| j as usize)
        };
        if let Some(neighbor) = one_way(out, back).or_else(|| one_way(back, out)) {
            return ElasticError::AsymmetricPair { node, neighbor };
        }
    }
    ElasticError::BadRow {
        node: 0,
        neighbor: 0,
    }
}
