//! Moving-least-squares gradient stencils at the nodes, plain or conservative.

use std::ops::Range;

use glam::{DMat3, DVec3};

use crate::parallel::{ROWS_PER_TASK, fill_rows, map, to_u32};
use crate::symmetric::{SymmetricEigen, outer};
use crate::{Neighborhoods, StencilError, inverse_square_weights};

/// What the neighbours of a node span.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct StencilRank {
    /// Number of independent directions: 3 full, 2 coplanar, 1 collinear, 0 no usable neighbour.
    pub rank: u8,
    /// `λ_max / λ_min` of the moment matrix, infinite if the smallest is not positive.
    pub condition: f64,
    /// Rank 2: unit normal of the plane. Rank 1: unit direction of the line. Otherwise zero.
    pub axis: DVec3,
}

/// Outcome of the solve for μ.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SolveReport {
    /// Iterations made.
    pub iterations: usize,
    /// `max_j |Σ_i V_i g_ij − b_j| / max_j |b_j|` with the `b` enforced.
    pub residual: f64,
    /// `max_j |b_j − b_j given| / max_j |b_j|`: how far the boundary vectors had to move so that
    /// every connected piece meets `Σ b = 0` and `Σ b ⊗ X = Σ V I` as far as its stencils can.
    pub boundary_shift: f64,
    /// Whether the residual reached the tolerance.
    pub converged: bool,
}

/// Gradient stencils at the nodes of a cloud in factored form, one number per pair:
/// `g_ij = w_ij [B_i X_ij + s_i (μ_j − μ_i)]`, and `∇u_i = Σ_j (u_j − u_i) ⊗ g_ij`.
///
/// [`GradientStencils::conservative`] makes stencils for mechanics; a nodal method built on them passes
/// the patch test. [`GradientStencils::plain`] makes those of Aras (2014), with `B_i = A_i⁻¹` and without
/// scales and multipliers; they also take neighbourhoods that are not symmetric.
///
/// Arrays on pairs follow the pairs of the [`Neighborhoods`] that built them. They are read freely;
/// changing them by hand breaks what [`GradientStencils::update_rows`] relies on.
#[derive(Debug, Clone, PartialEq)]
pub struct GradientStencils {
    /// Current weights `w_ij = f_ij · w0_ij`, to the digits of an f32, shape `(pairs)`.
    pub weights: Vec<f64>,
    /// `B_i = A_i⁻¹ − s_i H_i` (see [`GradientStencils::conservative`]), truncated where the rank is
    /// below 3, shape `(n)`.
    pub matrices: Vec<DMat3>,
    /// `s_i`: the volume `V_i` on rows of rank 3, 0 on others, shape `(n)`; empty for plain stencils.
    pub scales: Vec<f64>,
    /// `μ_i` (1/m⁴ times the unit of 1/w), shape `(n)`; empty for plain stencils.
    pub multipliers: Vec<DVec3>,
    /// Rank, condition and axis of every node, shape `(n)`.
    pub ranks: Vec<StencilRank>,
    /// Nodal volumes (m³) as given, shape `(n)`; empty for plain stencils.
    pub volumes: Vec<f64>,
    /// Boundary area vectors that the solve enforced (m²), shape `(n)`; empty for plain stencils.
    pub boundary_vectors: Vec<DVec3>,
    /// Outcome of the set-up solve; none for plain stencils.
    pub report: Option<SolveReport>,
    pub(crate) base_weights: Vec<f64>,
    pub(crate) rank_tolerance: f64,
}

impl GradientStencils {
    /// Moving least squares through the node's own value: `g_ij = w_ij A_i⁻¹ X_ij`,
    /// `A_i = Σ_j w_ij X_ij X_ijᵀ` (Aras 2014, eqs. (22)–(27)).
    ///
    /// Not conservative: `Σ_i V_i g_ij` differs from the boundary vectors, so a nodal method built on
    /// these stencils fails the patch test.
    ///
    /// # Arguments
    /// * `positions` -- rest positions X (m), shape `(n)`.
    /// * `weights` -- `w_ij ≥ 0`, shape `(pairs)`; [`crate::kernel_weights`] for the dissertation's.
    /// * `rank_tolerance` -- eigenvalues of a moment matrix below this fraction of the largest count
    ///   as zero; 1e-3 is the value used elsewhere.
    ///
    /// # Errors
    /// [`StencilError`] for a list of the wrong length and for the first position or weight that is not
    /// finite or negative.
    ///
    /// # Numerics
    /// Linear fields are exact to about `condition · ε` on rows of rank 3, in the span on others.
    pub fn plain(
        positions: &[DVec3],
        neighborhoods: &Neighborhoods,
        weights: Vec<f64>,
        rank_tolerance: f64,
    ) -> Result<Self, StencilError> {
        let weights = checked_weights(positions, neighborhoods, weights)?;
        let (matrices, ranks) = moments(positions, neighborhoods, &weights, rank_tolerance);
        Ok(Self {
            base_weights: weights.clone(),
            weights,
            matrices,
            scales: Vec::new(),
            multipliers: Vec::new(),
            ranks,
            volumes: Vec::new(),
            boundary_vectors: Vec::new(),
            report: None,
            rank_tolerance,
        })
    }

    /// The stencils if their solve reached its tolerance.
    ///
    /// # Errors
    /// [`StencilError::NotConverged`] if it stopped short: `Σ_i V_i g_ij = b_j` then holds to the
    /// residual only.
    pub fn converged(self) -> Result<Self, StencilError> {
        match self.report {
            Some(SolveReport {
                iterations,
                residual,
                converged: false,
                ..
            }) => Err(StencilError::NotConverged {
                iterations,
                residual,
            }),
            _ => Ok(self),
        }
    }

    /// `g_ij` (1/m) written out, shape `(pairs)`; `g_ii = −Σ_j g_ij`.
    ///
    /// # Panics
    /// If positions or graph are not those of the set-up.
    #[must_use]
    pub fn pair_gradients(&self, positions: &[DVec3], neighborhoods: &Neighborhoods) -> Vec<DVec3> {
        self.assert_same(positions, neighborhoods);
        let mut gradients = vec![DVec3::ZERO; self.weights.len()];
        fill_rows(neighborhoods, &mut gradients, |node, out| {
            for (g, (pair, j)) in out.iter_mut().zip(neighborhoods.entries(node)) {
                let mut factor = self.matrices[node] * (positions[j] - positions[node]);
                if !self.multipliers.is_empty() {
                    let apart = self.multipliers[j] - self.multipliers[node];
                    factor += apart * self.scales[node];
                }
                *g = factor * self.weights[pair];
            }
        });
        gradients
    }

    /// Heap bytes: conservative stencils hold 176 per node, plain ones 112, both 16 per pair.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.weights)
            + size_of_val(&*self.matrices)
            + size_of_val(&*self.scales)
            + size_of_val(&*self.multipliers)
            + size_of_val(&*self.ranks)
            + size_of_val(&*self.volumes)
            + size_of_val(&*self.boundary_vectors)
            + size_of_val(&*self.base_weights)
    }

    /// Takes new pair factors and rebuilds the touched rows, and only those: weights `f_ij · w0_ij`,
    /// moment matrix, rank, and the correction with the μ of before.
    ///
    /// No solve, and `b` stays: solving again with the old `b` would act as if there were no cut. The time
    /// is proportional to the pairs of the touched rows.
    ///
    /// # Arguments
    /// * `factor` -- `f_ij` in 0..=1 of a pair, 1 uncut, 0 severed; asked for the pairs of the touched
    ///   rows.
    /// * `touched` -- every node with a changed factor in its row; repeats do no harm.
    ///
    /// # Errors
    /// [`StencilError::Weight`] if a factor of a touched row is negative or not finite; rows before
    /// it are then rebuilt already, the others are as before.
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
        self.assert_same(positions, neighborhoods);
        for &node in touched {
            let node = node as usize;
            self.take_factors(&factor, neighborhoods.pairs(node))?;
            let row = Row::new(positions, neighborhoods, &self.weights, node);
            let (inverse, rank) = invert_moment(&row.moment(), self.rank_tolerance);
            self.ranks[node] = rank;
            self.matrices[node] = inverse;
            if self.multipliers.is_empty() {
                continue;
            }
            self.scales[node] = 0.0;
            if rank.rank == 3 {
                let h = row.correction(&self.multipliers, &inverse);
                self.scales[node] = self.volumes[node];
                self.matrices[node] -= h * self.volumes[node];
            }
        }
        Ok(())
    }

    /// Area vector (m²) that cuts have opened at a node, outward: `a_j = Σ_i V_i g_ij − b_j`, of its pairs alone; 0 for plain stencils.
    ///
    /// A uniform stress P pulls at node j with `−P Σ_i V_i g_ij`, which is 0 inside an uncut body by its conservation. A pressure on the flanks
    /// of a cut balances such a stress if it is shared out by `a_j`. Over a piece that is cut off `Σ (a_j + b_j) = 0` and
    /// `Σ (a_j + b_j) ⊗ X_j = (Σ V) I`, where its rows have full rank.
    ///
    /// # Panics
    /// If positions or graph are not those of the set-up or the node is out of range.
    #[must_use]
    pub fn opened_area(
        &self,
        positions: &[DVec3],
        neighborhoods: &Neighborhoods,
        node: usize,
    ) -> DVec3 {
        self.assert_same(positions, neighborhoods);
        let Some(&boundary) = self.boundary_vectors.get(node) else {
            return DVec3::ZERO;
        };
        let row = Row::new(positions, neighborhoods, &self.weights, node);
        row.pairs().fold(-boundary, |sum, (other, x, w)| {
            let jump = self.multipliers[other] - self.multipliers[node];
            let of = |row: usize| self.matrices[row] * x + jump * self.scales[row];
            sum - (of(other) * self.volumes[other] + of(node) * self.volumes[node]) * w
        })
    }

    fn assert_same(&self, positions: &[DVec3], neighborhoods: &Neighborhoods) {
        assert_eq!(positions.len(), self.ranks.len(), "one position per node");
        let pairs = neighborhoods.pair_count();
        assert_eq!(pairs, self.weights.len(), "the graph of the set-up");
    }

    /// `w = f · w0`, rounded, on some pairs.
    fn take_factors(
        &mut self,
        factor: impl Fn(usize) -> f64,
        pairs: Range<usize>,
    ) -> Result<(), StencilError> {
        for pair in pairs {
            let value = rounded(factor(pair) * self.base_weights[pair]);
            if !(value >= 0.0 && value.is_finite()) {
                return Err(StencilError::Weight { pair, value });
            }
            self.weights[pair] = value;
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
/// [`StencilError`] for a position that is not finite, positions of another number than the nodes, or a
/// graph that grows too large.
pub fn widen_deficient_rows(
    positions: &[DVec3],
    neighborhoods: &Neighborhoods,
    rank_tolerance: f64,
) -> Result<(Neighborhoods, Vec<u32>), StencilError> {
    neighborhoods.check_nodes("positions", positions.len())?;
    let mut graph = neighborhoods.clone();
    let mut rounds = 0;
    loop {
        let weights = inverse_square_weights(positions, &graph);
        validate(positions, &weights)?;
        let ranks = moments(positions, &graph, &weights, rank_tolerance).1;
        let deficient: Vec<u32> = (0..positions.len())
            .filter(|&node| ranks[node].rank < 3)
            .map(to_u32)
            .collect();
        if deficient.is_empty() || rounds == 2 {
            return Ok((graph, deficient));
        }
        graph = graph.with_second_ring(&deficient)?;
        rounds += 1;
    }
}

/// Truncated inverses of all moment matrices, and the ranks.
pub(crate) fn moments(
    positions: &[DVec3],
    neighborhoods: &Neighborhoods,
    weights: &[f64],
    rank_tolerance: f64,
) -> (Vec<DMat3>, Vec<StencilRank>) {
    let found = map(positions.len(), ROWS_PER_TASK, |node| {
        let row = Row::new(positions, neighborhoods, weights, node);
        invert_moment(&row.moment(), rank_tolerance)
    });
    found.into_iter().unzip()
}

/// A node with the neighbours that it sees.
pub(crate) struct Row<'a> {
    positions: &'a [DVec3],
    node: usize,
    neighbors: &'a [u32],
    weights: &'a [f64],
}

impl<'a> Row<'a> {
    /// The row of a node; weights are those of all pairs.
    pub(crate) fn new(
        positions: &'a [DVec3],
        neighborhoods: &'a Neighborhoods,
        weights: &'a [f64],
        node: usize,
    ) -> Self {
        Self {
            positions,
            node,
            neighbors: neighborhoods.row(node),
            weights: &weights[neighborhoods.pairs(node)],
        }
    }

    /// j, `X_ij` and `w_ij` of every neighbour.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (usize, DVec3, f64)> + '_ {
        let neighbors = self.neighbors.iter().map(|&j| j as usize);
        neighbors.zip(self.weights).map(|(j, &w)| {
            let x = self.positions[j] - self.positions[self.node];
            (j, x, w)
        })
    }

    /// `A_i = Σ_j w_ij X_ij X_ijᵀ`.
    fn moment(&self) -> DMat3 {
        let mut moment = DMat3::ZERO;
        for (_, x, w) in self.pairs() {
            moment += outer(x * w, x);
        }
        moment
    }

    /// `H_i = Σ_k (μ_k − μ_i) g0_ikᵀ` of a row of rank 3.
    pub(crate) fn correction(&self, multipliers: &[DVec3], moment_inverse: &DMat3) -> DMat3 {
        let mut tensor = DMat3::ZERO;
        for (j, x, w) in self.pairs() {
            tensor += outer(multipliers[j] - multipliers[self.node], x * w);
        }
        tensor * *moment_inverse
    }
}

/// A weight to the digits of an f32, so that the factored form may be stored in one: what is solved for
/// and inverted then belongs to the very weights that are used.
#[allow(
    clippy::cast_possible_truncation,
    reason = "rounding to f32 is the purpose"
)]
fn rounded(weight: f64) -> f64 {
    (weight as f32).into()
}

/// Truncated inverse of a moment matrix with its rank, condition and axis.
fn invert_moment(moment: &DMat3, tolerance: f64) -> (DMat3, StencilRank) {
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

/// Weights rounded as they are stored, if they and the positions are fit.
pub(crate) fn checked_weights(
    positions: &[DVec3],
    neighborhoods: &Neighborhoods,
    weights: Vec<f64>,
) -> Result<Vec<f64>, StencilError> {
    neighborhoods.check_nodes("positions", positions.len())?;
    neighborhoods.check_pairs("weights", weights.len())?;
    let weights: Vec<f64> = weights.into_iter().map(rounded).collect();
    validate(positions, &weights)?;
    Ok(weights)
}

/// Refuses positions and weights that are not finite, and negative weights.
fn validate(positions: &[DVec3], weights: &[f64]) -> Result<(), StencilError> {
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
