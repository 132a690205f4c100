//! Moving-least-squares gradient stencils at the nodes, as the dissertation uses them.

use std::ops::Range;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::error::StencilError;
use crate::neighborhoods::Neighborhoods;
use crate::parallel::{ROWS_PER_TASK, to_u32};
use crate::symmetric::{SymmetricEigen, outer};
use crate::weights::inverse_square_weights;

/// What the neighbours of a node span.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StencilRank {
    /// Number of independent directions: 3 full, 2 coplanar, 1 collinear, 0 no usable neighbour.
    pub rank: u8,
    /// `λ_max / λ_min` of the moment matrix, infinite if the smallest is not positive.
    pub condition: f64,
    /// Rank 2: unit normal of the plane. Rank 1: unit direction of the line. Otherwise zero.
    pub axis: DVec3,
}

/// Gradient stencils of moving least squares through the node's own value:
/// `g_ij = w_ij A_i⁻¹ X_ij`, `A_i = Σ_j w_ij X_ij X_ijᵀ` (Aras 2014, eqs. (22)–(27)).
///
/// Exact for linear fields, but not conservative: `Σ_i V_i g_ij` differs from the boundary vectors,
/// so a nodal method built on them fails the patch test. Use
/// [`crate::ConservativeStencils`] unless the dissertation's own form is wanted; these also take
/// neighbourhoods that are not symmetric.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GradientStencils {
    /// `g_ij` (1/m), shape `(pairs)`.
    pub pair_gradients: Vec<DVec3>,
    /// `g_ii = −Σ_j g_ij` (1/m), shape `(n)`.
    pub self_gradients: Vec<DVec3>,
    /// Current weights `w_ij = f_ij · w0_ij`, to the digits of an f32, shape `(pairs)`.
    pub weights: Vec<f64>,
    /// `A_i⁻¹`, truncated where the rank is below 3, shape `(n)`: with the weights the factored form
    /// `g_ij = w_ij A_i⁻¹ X_ij`.
    pub moment_inverses: Vec<DMat3>,
    /// Rank, condition and axis of every node, shape `(n)`.
    pub ranks: Vec<StencilRank>,
    base_weights: Vec<f64>,
    rank_tolerance: f64,
}

/// Memory that stencils hold, without the neighbourhoods (4 bytes per node and per pair).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StencilMemory {
    /// Bytes per node.
    pub per_node: usize,
    /// Bytes per directed pair.
    pub per_pair: usize,
    /// Bytes in all, as allocated.
    pub total: usize,
}

/// Bytes that a vector has allocated.
pub(crate) fn allocated<T>(values: &Vec<T>) -> usize {
    values.capacity() * size_of::<T>()
}

/// One row before it is stored.
pub(crate) struct Row {
    pub(crate) moment_inverse: DMat3,
    /// `B` of the factored form.
    pub(crate) matrix: DMat3,
    pub(crate) rank: StencilRank,
    pub(crate) self_gradient: DVec3,
}

impl GradientStencils {
    /// Builds the stencils of a cloud.
    ///
    /// # Arguments
    /// * `positions` -- rest positions X (m), shape `(n)`.
    /// * `weights` -- `w_ij ≥ 0`, shape `(pairs)`; [`crate::kernel_weights`] for the dissertation's.
    /// * `rank_tolerance` -- eigenvalues of a moment matrix below this share of the largest count
    ///   as zero; 1e-3 is the value used elsewhere.
    ///
    /// # Errors
    /// [`StencilError`] naming the first position or weight that is not finite or negative.
    ///
    /// # Panics
    /// If a slice does not have its stated length.
    ///
    /// # Numerics
    /// Linear fields are exact to about `condition · ε` on rows of rank 3, in the span on others.
    pub fn new(
        positions: &[DVec3],
        neighborhoods: &Neighborhoods,
        weights: Vec<f64>,
        rank_tolerance: f64,
    ) -> Result<Self, StencilError> {
        let count = neighborhoods.node_count();
        assert_eq!(positions.len(), count, "one position per node");
        assert_eq!(
            weights.len(),
            neighborhoods.pair_count(),
            "one weight per pair"
        );
        let weights: Vec<f64> = weights.into_iter().map(rounded).collect();
        validate(positions, &weights)?;
        let mut pair_gradients = vec![DVec3::ZERO; weights.len()];
        let rows = build_rows(neighborhoods, &mut pair_gradients, |node, out| {
            let pairs = neighborhoods.pairs(node);
            build_row(
                positions,
                neighborhoods,
                node,
                &weights[pairs],
                rank_tolerance,
                out,
            )
        });
        let mut stencils = Self {
            pair_gradients,
            self_gradients: Vec::with_capacity(count),
            base_weights: weights.clone(),
            weights,
            moment_inverses: Vec::with_capacity(count),
            ranks: Vec::with_capacity(count),
            rank_tolerance,
        };
        for row in rows.into_iter().flatten() {
            stencils.self_gradients.push(row.self_gradient);
            stencils.moment_inverses.push(row.moment_inverse);
            stencils.ranks.push(row.rank);
        }
        Ok(stencils)
    }

    /// Memory held: 24 + 72 + 40 bytes per node, 24 + 8 + 8 per pair.
    #[must_use]
    pub fn memory_bytes(&self) -> StencilMemory {
        StencilMemory {
            per_node: size_of::<DVec3>() + size_of::<DMat3>() + size_of::<StencilRank>(),
            per_pair: size_of::<DVec3>() + 2 * size_of::<f64>(),
            total: allocated(&self.pair_gradients)
                + allocated(&self.self_gradients)
                + allocated(&self.weights)
                + allocated(&self.moment_inverses)
                + allocated(&self.ranks)
                + allocated(&self.base_weights),
        }
    }

    /// Rebuilds the touched rows with new pair factors, `w_ij = f_ij · w0_ij`, in time proportional
    /// to their pairs. `factor` is called for the pairs of the touched rows.
    ///
    /// # Errors
    /// [`StencilError::Weight`] if a factor of a touched row is negative or not finite; rows before
    /// it are then rebuilt already.
    ///
    /// # Panics
    /// If positions or graph are not those of the set-up or a touched node is out of range.
    pub fn update_rows(
        &mut self,
        positions: &[DVec3],
        neighborhoods: &Neighborhoods,
        factor: impl Fn(usize) -> f64,
        touched: &[u32],
    ) -> Result<(), StencilError> {
        assert_eq!(positions.len(), self.ranks.len(), "one position per node");
        assert_eq!(
            neighborhoods.pair_count(),
            self.weights.len(),
            "the graph of the set-up"
        );
        for &node in touched {
            let node = node as usize;
            let pairs = neighborhoods.pairs(node);
            take_factors(
                &mut self.weights,
                &self.base_weights,
                &factor,
                pairs.clone(),
            )?;
            let row = build_row(
                positions,
                neighborhoods,
                node,
                &self.weights[pairs.clone()],
                self.rank_tolerance,
                &mut self.pair_gradients[pairs],
            );
            self.moment_inverses[node] = row.moment_inverse;
            self.ranks[node] = row.rank;
            self.self_gradients[node] = row.self_gradient;
        }
        Ok(())
    }
}

/// Gives nodes whose neighbours do not span space their neighbours' neighbours as well, and those who
/// still do not a third ring; all other rows stay. Rank is judged with the weights `1/r²`.
///
/// Returns the graph and the nodes that are deficient in it. For tetrahedra that are flat at the
/// surface this is the difference between a set-up solve that converges and one that cannot.
///
/// # Errors
/// [`StencilError`] for a position that is not finite or a graph that grows too large.
///
/// # Panics
/// If `positions` is not `n` long.
pub fn widen_deficient_rows(
    positions: &[DVec3],
    neighborhoods: &Neighborhoods,
    rank_tolerance: f64,
) -> Result<(Neighborhoods, Vec<u32>), StencilError> {
    let mut graph = neighborhoods.clone();
    let mut rounds = 0;
    loop {
        let weights = inverse_square_weights(positions, &graph);
        validate(positions, &weights)?;
        let deficient: Vec<u32> = (0..positions.len())
            .into_par_iter()
            .with_min_len(ROWS_PER_TASK)
            .filter(|&node| {
                let moment = moment(positions, &graph, node, &weights[graph.pairs(node)]);
                invert_moment(&moment, rank_tolerance).1.rank < 3
            })
            .map(to_u32)
            .collect();
        if deficient.is_empty() || rounds == 2 {
            return Ok((graph, deficient));
        }
        graph = graph.with_second_ring(&deficient)?;
        rounds += 1;
    }
}

/// `A_i = Σ_j w_ij X_ij X_ijᵀ`.
pub(crate) fn moment(
    positions: &[DVec3],
    neighborhoods: &Neighborhoods,
    node: usize,
    weights: &[f64],
) -> DMat3 {
    let mut moment = DMat3::ZERO;
    for (&j, &w) in neighborhoods.row(node).iter().zip(weights) {
        let x = positions[j as usize] - positions[node];
        moment += outer(x * w, x);
    }
    moment
}

/// A weight to the digits of an f32, in which whoever takes the factored form over may keep it: what is
/// solved for and inverted then belongs to the very weights that are used.
#[allow(
    clippy::cast_possible_truncation,
    reason = "rounding to f32 is the purpose"
)]
pub(crate) fn rounded(weight: f64) -> f64 {
    (weight as f32).into()
}

/// `w = f · w0`, rounded, on some pairs.
pub(crate) fn take_factors(
    weights: &mut [f64],
    base: &[f64],
    factor: impl Fn(usize) -> f64,
    pairs: Range<usize>,
) -> Result<(), StencilError> {
    for pair in pairs {
        let value = rounded(factor(pair) * base[pair]);
        if !(value >= 0.0 && value.is_finite()) {
            return Err(StencilError::Weight { pair, value });
        }
        weights[pair] = value;
    }
    Ok(())
}

/// Builds `g0_ij` of one row into `out` (shape: pairs of the row).
fn build_row(
    positions: &[DVec3],
    neighborhoods: &Neighborhoods,
    node: usize,
    weights: &[f64],
    rank_tolerance: f64,
    out: &mut [DVec3],
) -> Row {
    let at = positions[node];
    let row = neighborhoods.row(node);
    let moment = moment(positions, neighborhoods, node, weights);
    let (moment_inverse, rank) = invert_moment(&moment, rank_tolerance);
    let mut self_gradient = DVec3::ZERO;
    for ((&j, &w), g) in row.iter().zip(weights).zip(out) {
        *g = moment_inverse * ((positions[j as usize] - at) * w);
        self_gradient -= *g;
    }
    Row {
        moment_inverse,
        matrix: moment_inverse,
        rank,
        self_gradient,
    }
}

/// Runs `build(node, slots of its pairs)` for all nodes in parallel; rows come back in order.
pub(crate) fn build_rows<T: Send>(
    neighborhoods: &Neighborhoods,
    slots: &mut [T],
    build: impl Fn(usize, &mut [T]) -> Row + Sync,
) -> Vec<Vec<Row>> {
    split_rows(neighborhoods, slots)
        .into_par_iter()
        .map(|(nodes, out)| {
            let first = neighborhoods.pairs(nodes.start).start;
            let mut rows = Vec::with_capacity(nodes.len());
            for node in nodes {
                let pairs = neighborhoods.pairs(node);
                rows.push(build(
                    node,
                    &mut out[pairs.start - first..pairs.end - first],
                ));
            }
            rows
        })
        .collect()
}

/// Splits the slots of all pairs into blocks of whole rows.
pub(crate) fn split_rows<'a, T>(
    neighborhoods: &Neighborhoods,
    mut slots: &'a mut [T],
) -> Vec<(Range<usize>, &'a mut [T])> {
    let count = neighborhoods.node_count();
    let mut tasks = Vec::with_capacity(count.div_ceil(ROWS_PER_TASK));
    for first in (0..count).step_by(ROWS_PER_TASK) {
        let last = (first + ROWS_PER_TASK).min(count);
        let pairs = neighborhoods.pairs(last - 1).end - neighborhoods.pairs(first).start;
        let (head, tail) = slots.split_at_mut(pairs);
        tasks.push((first..last, head));
        slots = tail;
    }
    tasks
}

/// Truncated inverse of a moment matrix with its rank, condition and axis.
pub(crate) fn invert_moment(moment: &DMat3, tolerance: f64) -> (DMat3, StencilRank) {
    let eigen = SymmetricEigen::new(moment);
    let rank = eigen.rank(tolerance);
    let (count, axis) = match rank {
        3 => (3, DVec3::ZERO),
        2 => (2, eigen.vectors[2]),
        1 => (1, eigen.vectors[0]),
        _ => (0, DVec3::ZERO),
    };
    let quality = StencilRank {
        rank: count,
        condition: eigen.condition(),
        axis,
    };
    (eigen.truncated_inverse(rank), quality)
}

/// Refuses positions and weights that are not finite, and negative weights.
pub(crate) fn validate(positions: &[DVec3], weights: &[f64]) -> Result<(), StencilError> {
    if let Some(node) = positions.iter().position(|x| !x.is_finite()) {
        return Err(StencilError::Position { node });
    }
    if let Some(pair) = weights.iter().position(|&w| !(w >= 0.0 && w.is_finite())) {
        return Err(StencilError::Weight {
            pair,
            value: weights[pair],
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
