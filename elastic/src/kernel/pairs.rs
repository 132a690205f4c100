//! The graph with its weights, in the order in which the two passes read them.

use crate::error::ElasticError;
use crate::input::Stencils;
use crate::kernel::storage::bytes_of;

/// A neighbour and the weight of its pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    pub(crate) to: u32,
    pub(crate) weight: f32,
}

/// A weight as it is stored. Subnormal numbers become zero: they cost a hundred times a normal one.
#[allow(
    clippy::cast_possible_truncation,
    reason = "weights have the digits of f32"
)]
fn rounded(weight: f64) -> f32 {
    let tiny = weight.abs() < f64::from(f32::MIN_POSITIVE);
    if tiny { 0.0 } else { weight as f32 }
}

/// Rows of the graph and, unless they are the same, the rows of its transpose.
#[derive(Debug, Clone)]
pub(crate) struct Pairs {
    outgoing: Rows,
    /// `w_ji` at the position of incoming pair (i, j); `None` where graph and weights are symmetric.
    incoming: Option<Rows>,
}

#[derive(Debug, Clone)]
struct Rows {
    offsets: Vec<u32>,
    pairs: Vec<Pair>,
}

fn range(offsets: &[u32], node: usize) -> std::ops::Range<usize> {
    offsets[node] as usize..offsets[node + 1] as usize
}

impl Rows {
    #[inline(always)]
    fn row(&self, node: usize) -> &[Pair] {
        &self.pairs[range(&self.offsets, node)]
    }

    fn find(&self, node: usize, to: usize) -> Option<usize> {
        let at = range(&self.offsets, node);
        let start = at.start;
        let found = self.pairs[at].binary_search_by(|pair| (pair.to as usize).cmp(&to));
        found.ok().map(|k| start + k)
    }

    fn same_pattern(&self, other: &Self) -> bool {
        let ends = |rows: &Self| rows.pairs.iter().map(|pair| pair.to).collect::<Vec<_>>();
        self.offsets == other.offsets && ends(self) == ends(other)
    }

    fn bytes(&self) -> usize {
        bytes_of(&self.offsets) + bytes_of(&self.pairs)
    }
}

impl Pairs {
    /// `symmetric` asks for pairs both ways, `equal` for equal weights as well.
    pub(crate) fn new(
        stencils: &Stencils<'_>,
        symmetric: bool,
        equal: bool,
    ) -> Result<Self, ElasticError> {
        let node_count = stencils.offsets.len() - 1;
        for node in 0..node_count {
            let mut before = None;
            for p in range(stencils.offsets, node) {
                let j = stencils.indices[p] as usize;
                if j >= node_count || j == node || before.is_some_and(|b| b >= j) {
                    return Err(ElasticError::BadRow { node, neighbor: j });
                }
                before = Some(j);
                stored_weight(stencils, node, p)?;
            }
        }
        let pair = |(&to, &weight): (&u32, &f64)| {
            let weight = rounded(weight);
            Pair { to, weight }
        };
        let ends = stencils.indices.iter().zip(stencils.weights);
        let outgoing = Rows {
            offsets: stencils.offsets.to_vec(),
            pairs: ends.map(pair).collect(),
        };
        let turned = transpose(&outgoing);
        let incoming = if turned.pairs == outgoing.pairs && turned.offsets == outgoing.offsets {
            None
        } else {
            if equal || (symmetric && !turned.same_pattern(&outgoing)) {
                return Err(first_unequal_pair(&outgoing, &turned, equal));
            }
            Some(turned)
        };
        Ok(Self { outgoing, incoming })
    }

    pub(crate) fn node_count(&self) -> usize {
        self.outgoing.offsets.len() - 1
    }

    pub(crate) fn pair_count(&self) -> usize {
        self.outgoing.pairs.len()
    }

    /// Starts of the rows.
    pub(crate) fn offsets(&self) -> &[u32] {
        &self.outgoing.offsets
    }

    /// Positions of a node's pairs.
    pub(crate) fn range(&self, node: usize) -> std::ops::Range<usize> {
        range(&self.outgoing.offsets, node)
    }

    /// Whether graph and weights are the same both ways.
    pub(crate) fn is_symmetric(&self) -> bool {
        self.incoming.is_none()
    }

    /// All `w_ij`.
    pub(crate) fn weights(&self) -> impl Iterator<Item = f32> + '_ {
        self.outgoing.pairs.iter().map(|pair| pair.weight)
    }

    /// Neighbours and `w_ij` of a node.
    #[inline(always)]
    pub(crate) fn row(&self, node: usize) -> &[Pair] {
        self.outgoing.row(node)
    }

    /// Nodes in whose rows `node` appears, with `w_ji`.
    #[inline(always)]
    pub(crate) fn incoming(&self, node: usize) -> &[Pair] {
        self.incoming.as_ref().unwrap_or(&self.outgoing).row(node)
    }

    /// Takes the weights of a row over.
    pub(crate) fn set_row(
        &mut self,
        node: usize,
        stencils: &Stencils<'_>,
    ) -> Result<(), ElasticError> {
        for p in range(&self.outgoing.offsets, node) {
            let weight = stored_weight(stencils, node, p)?;
            self.outgoing.pairs[p].weight = weight;
            if let Some(incoming) = &mut self.incoming {
                let to = self.outgoing.pairs[p].to as usize;
                // Every pair (i, j) is an incoming pair of j: the lists are transposes.
                if let Some(q) = incoming.find(to, node) {
                    incoming.pairs[q].weight = weight;
                }
            }
        }
        Ok(())
    }

    /// Checks that a node's weights are those of the reversed pairs where the lists are shared.
    pub(crate) fn check_symmetry(&self, node: usize) -> Result<(), ElasticError> {
        if self.incoming.is_some() {
            return Ok(());
        }
        for pair in self.row(node) {
            let neighbor = pair.to as usize;
            let back = self.outgoing.find(neighbor, node);
            let weight = |q: usize| self.outgoing.pairs[q].weight.to_bits();
            if back.is_none_or(|q| weight(q) != pair.weight.to_bits()) {
                return Err(ElasticError::AsymmetricPair { node, neighbor });
            }
        }
        Ok(())
    }

    pub(crate) fn bytes(&self) -> usize {
        self.outgoing.bytes() + self.incoming.as_ref().map_or(0, Rows::bytes)
    }
}

fn stored_weight(stencils: &Stencils<'_>, node: usize, pair: usize) -> Result<f32, ElasticError> {
    let weight = rounded(stencils.weights[pair]);
    if weight.is_finite() && weight >= 0.0 {
        return Ok(weight);
    }
    let what = "weight";
    Err(ElasticError::NotFinite { what, node })
}

/// Transpose of the rows; its rows come out sorted.
fn transpose(rows: &Rows) -> Rows {
    let node_count = rows.offsets.len() - 1;
    let mut offsets = vec![0_u32; node_count + 1];
    for pair in &rows.pairs {
        offsets[pair.to as usize + 1] += 1;
    }
    for node in 0..node_count {
        offsets[node + 1] += offsets[node];
    }
    let mut next = offsets.clone();
    let mut pairs = vec![Pair { to: 0, weight: 0.0 }; rows.pairs.len()];
    for (to, at) in (0_u32..).zip(rows.offsets.windows(2)) {
        for pair in &rows.pairs[at[0] as usize..at[1] as usize] {
            let place = &mut next[pair.to as usize];
            let weight = pair.weight;
            pairs[*place as usize] = Pair { to, weight };
            *place += 1;
        }
    }
    Rows { offsets, pairs }
}

/// The first pair that the reversed rows do not have, or not with the same weight.
fn first_unequal_pair(rows: &Rows, turned: &Rows, equal: bool) -> ElasticError {
    let same = |a: &Pair, other: &Rows, node: usize| {
        let found = other.find(node, a.to as usize);
        found.is_some_and(|q| !equal || other.pairs[q].weight.to_bits() == a.weight.to_bits())
    };
    for node in 0..rows.offsets.len() - 1 {
        let odd = |from: &Rows, to: &Rows| {
            let found = from.row(node).iter().find(|pair| !same(pair, to, node));
            found.map(|pair| pair.to as usize)
        };
        if let Some(neighbor) = odd(rows, turned).or_else(|| odd(turned, rows)) {
            return ElasticError::AsymmetricPair { node, neighbor };
        }
    }
    ElasticError::BadRow {
        node: 0,
        neighbor: 0,
    }
}
