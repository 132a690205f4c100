//! Pair data in the order in which the two passes read them.

use glam::{DMat3, DVec3};

use crate::completion::outer;
use crate::error::ElasticError;
use crate::kernel::PairRow;
use crate::model::Stencils;

/// Stencil rows and their reversed copy.
///
/// Pass one reads row i of `pairs`, pass two row i of `reversed`, both front to back: looking
/// `g_ji` up by pair index instead costs two to three times as much.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    offsets: Vec<u32>,
    indices: Vec<u32>,
    /// `z_ij`.
    pairs: Vec<PairRow>,
    /// For each node the pairs that end in it; `None` if the pattern is symmetric.
    incoming: Option<(Vec<u32>, Vec<u32>)>,
    /// `z_ji` at the place of incoming pair (i, j).
    reversed: Vec<PairRow>,
    /// `w_ij`, symmetric where zero-energy control is on, else empty of meaning (zeros).
    weights: Vec<f64>,
}

/// What a row gives its node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowSums {
    /// `z_ii = (g_ii, -sum_j y_ij)`.
    pub(crate) own_pair: PairRow,
    /// `sum_j X_ij g_ij^T`.
    pub(crate) consistency: DMat3,
    /// `A = sum_j w_ij X_ij X_ij^T`.
    pub(crate) moment: DMat3,
}

pub(crate) fn range(offsets: &[u32], node: usize) -> std::ops::Range<usize> {
    offsets[node] as usize..offsets[node + 1] as usize
}

impl Rows {
    pub(crate) fn new(stencils: &Stencils<'_>, symmetric: bool) -> Result<Self, ElasticError> {
        let node_count = stencils.self_gradients.len();
        let pair_count = stencils.indices.len();
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
        let incoming = transpose(stencils.offsets, stencils.indices);
        let incoming = if incoming.0 == stencils.offsets && incoming.1 == stencils.indices {
            None
        } else if symmetric {
            return Err(first_one_way_pair(stencils, &incoming));
        } else {
            Some(incoming)
        };
        let blank = PairRow([0.0; 6]);
        Ok(Self {
            offsets: stencils.offsets.to_vec(),
            indices: stencils.indices.to_vec(),
            pairs: vec![blank; pair_count],
            incoming,
            reversed: vec![blank; pair_count],
            weights: vec![0.0; pair_count],
        })
    }

    pub(crate) fn pair_count(&self) -> usize {
        self.indices.len()
    }

    /// Neighbours and `z_ij` of a node.
    #[inline]
    pub(crate) fn row(&self, node: usize) -> (&[u32], &[PairRow]) {
        let at = range(&self.offsets, node);
        (&self.indices[at.clone()], &self.pairs[at])
    }

    /// Nodes in whose rows `node` appears, `z_ji` and `w_ij`.
    #[inline]
    pub(crate) fn incoming(&self, node: usize) -> (&[u32], &[PairRow], &[f64]) {
        let (offsets, indices) = match &self.incoming {
            None => (&self.offsets, &self.indices),
            Some((offsets, indices)) => (offsets, indices),
        };
        let at = range(offsets, node);
        (
            &indices[at.clone()],
            &self.reversed[at.clone()],
            &self.weights[at],
        )
    }

    fn find_incoming(&self, node: usize, from: usize) -> Option<usize> {
        let (offsets, indices) = match &self.incoming {
            None => (&self.offsets, &self.indices),
            Some((offsets, indices)) => (offsets, indices),
        };
        let at = range(offsets, node);
        let start = at.start;
        let found = indices[at].binary_search_by(|&j| (j as usize).cmp(&from));
        found.ok().map(|k| start + k)
    }

    /// Copies one row in, with its reversed copies, and sums what its node needs.
    pub(crate) fn set_row(
        &mut self,
        node: usize,
        stencils: &Stencils<'_>,
        rest: &[DVec3],
        controlled: bool,
    ) -> Result<RowSums, ElasticError> {
        let not_finite = |what| ElasticError::NotFinite { what, node };
        let own_gradient = stencils.self_gradients[node];
        if !own_gradient.is_finite() {
            return Err(not_finite("self gradient"));
        }
        let mut away = DVec3::ZERO;
        let mut consistency = DMat3::ZERO;
        let mut moment = DMat3::ZERO;
        for p in range(&self.offsets, node) {
            let j = self.indices[p] as usize;
            let g = stencils.gradients[p];
            let w = if controlled { stencils.weights[p] } else { 0.0 };
            if !g.is_finite() {
                return Err(not_finite("gradient"));
            }
            if !w.is_finite() || w < 0.0 {
                return Err(not_finite("weight"));
            }
            let x = rest[j] - rest[node];
            let y = x * w;
            away += y;
            consistency += outer(x, g);
            moment += outer(y, x);
            let z = PairRow([g.x, g.y, g.z, y.x, y.y, y.z]);
            self.pairs[p] = z;
            // Every pair (i, j) is an incoming pair of j: the lists are transposes.
            if let Some(at) = self.find_incoming(j, node) {
                self.reversed[at] = z;
                self.weights[at] = w;
            }
        }
        Ok(RowSums {
            own_pair: PairRow([
                own_gradient.x,
                own_gradient.y,
                own_gradient.z,
                -away.x,
                -away.y,
                -away.z,
            ]),
            consistency,
            moment,
        })
    }

    /// Checks that the weights of a node's pairs are the same both ways.
    pub(crate) fn check_symmetry(&self, node: usize) -> Result<(), ElasticError> {
        for p in range(&self.offsets, node) {
            let neighbor = self.indices[p] as usize;
            let back = self.find_incoming(neighbor, node);
            let same = back.is_some_and(|q| {
                let (a, b) = (self.weights[p], self.weights[q]);
                (a - b).abs() <= 1e-12 * a.max(b)
            });
            if !same {
                return Err(ElasticError::AsymmetricPair { node, neighbor });
            }
        }
        Ok(())
    }

    /// Heap bytes held.
    pub(crate) fn bytes(&self) -> usize {
        let words = |v: &Vec<u32>| v.capacity() * size_of::<u32>();
        words(&self.offsets)
            + words(&self.indices)
            + (self.pairs.capacity() + self.reversed.capacity()) * size_of::<PairRow>()
            + self.weights.capacity() * size_of::<f64>()
            + self
                .incoming
                .as_ref()
                .map_or(0, |(a, b)| words(a) + words(b))
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

fn first_one_way_pair(stencils: &Stencils<'_>, incoming: &(Vec<u32>, Vec<u32>)) -> ElasticError {
    for node in 0..incoming.0.len() - 1 {
        let out = &stencils.indices[range(stencils.offsets, node)];
        let back = &incoming.1[range(&incoming.0, node)];
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
