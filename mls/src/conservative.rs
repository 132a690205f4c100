//! Gradient stencils that are conservative and consistent at once.
//!
//! With `X_ij = X_j − X_i`, weights `w_ij` and volumes `V_i` the moving-least-squares stencil is
//! `g0_ij = w_ij A_i⁻¹ X_ij`, `A_i = Σ_j w_ij X_ij X_ijᵀ` (Aras 2014, eqs. (25)–(27)). It is
//! consistent (`Σ_j X_ij g0_ijᵀ = I`) but not conservative. Minimising `Σ |g − g0|² / w` under
//! consistency and `Σ_i V_i g_ij = b_j` (self terms included) gives
//!
//! `g_ij = g0_ij + V_i w_ij e_ij(μ)`, `e_ij(μ) = (μ_j − μ_i) − H_i X_ij`,
//! `H_i = Σ_k (μ_k − μ_i) g0_ikᵀ`,
//!
//! with μ from one symmetric positive semidefinite system per cloud, see [`operator`].

mod coarse;
mod iteration;
mod operator;
mod pieces;
mod solve;
mod stroke;
#[cfg(test)]
mod tests;

use glam::{DMat3, DVec3};

use crate::error::StencilError;
use crate::neighborhoods::Neighborhoods;
use crate::stencil::{
    Row, StencilMemory, StencilRank, allocated, build_rows, invert_moment, moment, rounded,
    take_factors, validate,
};
use crate::symmetric::outer;
pub use stroke::{StrokeReport, normal_projector};

/// How the stencils are built.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ConservativeSettings {
    /// Eigenvalues of a moment matrix below `rank_tolerance · λ_max` count as zero.
    pub rank_tolerance: f64,
    /// The solve ends when `|Σ_i V_i g_ij − b_j|` is below `tolerance` times the largest `|b_j|`
    /// (of a node's face, `V^(2/3)`, where all b are zero) for every node.
    pub tolerance: f64,
    /// Most iterations of one solve.
    pub iteration_limit: usize,
    /// Whether a coarse space of splines speeds the solve up. Without it the iterations grow with
    /// the square of the nodes per side; the result is the same within the tolerance.
    pub coarse_space: bool,
    /// Pieces with fewer nodes than this are left out of [`ConservativeStencils::finish_stroke`].
    pub smallest_piece: usize,
}

impl Default for ConservativeSettings {
    /// Rank tolerance 1e-3, tolerance 1e-11, 5,000 iterations, coarse space, pieces from 30 nodes.
    fn default() -> Self {
        Self {
            rank_tolerance: 1e-3,
            tolerance: 1e-11,
            iteration_limit: 5000,
            coarse_space: true,
            smallest_piece: 30,
        }
    }
}

impl ConservativeSettings {
    /// For bodies that will be cut: rank tolerance 0.03. A direction that a node's neighbours span this
    /// much less than the widest (squared lengths) counts as not seen: a cut leaves surface nodes with
    /// three or four neighbours almost in a plane, whose gradients across it would be twenty times too
    /// large.
    #[must_use]
    pub fn for_cutting() -> Self {
        Self {
            rank_tolerance: 0.03,
            ..Self::default()
        }
    }
}

/// Outcome of the solve for μ.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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

/// Conservative and consistent gradient stencils at the nodes of a symmetric neighbourhood.
///
/// The gradient of a nodal field is `∇u_i = Σ_j (u_j − u_i) ⊗ g_ij = u_i ⊗ g_ii + Σ_j u_j ⊗ g_ij`.
/// In factored form, with one number per pair, `g_ij = w_ij [B_i X_ij + s_i (μ_j − μ_i)]`.
/// Arrays on pairs follow the pairs of the [`Neighborhoods`] that built them. They are read freely;
/// changing them by hand breaks what [`ConservativeStencils::update_rows`] relies on.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ConservativeStencils {
    /// `g_ij` (1/m), shape `(pairs)`; empty after [`ConservativeStencils::forget_pair_gradients`].
    pub pair_gradients: Vec<DVec3>,
    /// `g_ii = −Σ_j g_ij` (1/m), shape `(n)`.
    pub self_gradients: Vec<DVec3>,
    /// Current weights `w_ij = f_ij · w0_ij`, to the digits of an f32, shape `(pairs)`.
    pub weights: Vec<f64>,
    /// `A_i⁻¹`, truncated where the rank is below 3, shape `(n)`.
    pub moment_inverses: Vec<DMat3>,
    /// `B_i = A_i⁻¹ − s_i H_i` of the factored form, shape `(n)`.
    pub matrices: Vec<DMat3>,
    /// `s_i`: the volume `V_i` on rows of rank 3, 0 on others, shape `(n)`.
    pub scales: Vec<f64>,
    /// Rank, condition and axis of every node, shape `(n)`.
    pub ranks: Vec<StencilRank>,
    /// `μ_i` (1/m⁴ times the unit of 1/w), shape `(n)`.
    pub multipliers: Vec<DVec3>,
    /// Boundary area vectors enforced by the last solve (m²), shape `(n)`.
    pub boundary_vectors: Vec<DVec3>,
    /// Nodal volumes (m³), shape `(n)`, as given.
    pub volumes: Vec<f64>,
    /// Outcome of the set-up solve, or of the last finished stroke.
    pub report: SolveReport,
    base_weights: Vec<f64>,
    reverse: Vec<u32>,
    settings: ConservativeSettings,
    /// `max_i q_i` at set-up (1/m²), see [`ConservativeStencils::finish_stroke`].
    uncut_stiffness: f64,
}

impl ConservativeStencils {
    /// The stencils if their solve reached its tolerance.
    ///
    /// # Errors
    /// [`StencilError::NotConverged`] if it stopped short: `Σ_i V_i g_ij = b_j` then holds to the
    /// residual only.
    pub fn converged(self) -> Result<Self, StencilError> {
        let SolveReport {
            iterations,
            residual,
            converged,
            ..
        } = self.report;
        if converged {
            return Ok(self);
        }
        Err(StencilError::NotConverged {
            iterations,
            residual,
        })
    }

    /// Builds the stencils of a cloud: moment matrices, then one matrix-free solve.
    ///
    /// # Arguments
    /// * `positions` -- rest positions X (m), shape `(n)`.
    /// * `volumes` -- nodal volumes V (m³), shape `(n)`, positive.
    /// * `boundary_vectors` -- boundary area vectors b (m²), shape `(n)`, outward; zero inside.
    ///   A closed surface gives `Σ b = 0` and `Σ b ⊗ X = (Σ V) I`, which is what a solution needs;
    ///   what is missing is spread evenly and reported as [`SolveReport::boundary_shift`].
    /// * `neighborhoods` -- symmetric graph.
    /// * `weights` -- `w_ij ≥ 0`, shape `(pairs)`; [`crate::inverse_square_weights`] for graphs.
    ///
    /// # Errors
    /// [`StencilError`] naming the first bad position, volume, boundary vector, weight, or pair
    /// without counterpart.
    ///
    /// # Panics
    /// If a slice does not have its stated length.
    ///
    /// # Numerics
    /// Linear fields are exact to about `condition · ε` on rows of rank 3. Rows of lower rank keep
    /// `g0` on their span (see [`crate::deformation_gradient`] for the rest) and take no part in
    /// the correction. A solve that stops short is an error of [`ConservativeStencils::converged`] only.
    /// The result does not depend on the number of threads.
    pub fn new(
        positions: &[DVec3],
        volumes: &[f64],
        boundary_vectors: &[DVec3],
        neighborhoods: &Neighborhoods,
        weights: Vec<f64>,
        settings: &ConservativeSettings,
    ) -> Result<Self, StencilError> {
        let count = neighborhoods.node_count();
        let pairs = neighborhoods.pair_count();
        assert_eq!(positions.len(), count, "one position per node");
        assert_eq!(volumes.len(), count, "one volume per node");
        assert_eq!(
            boundary_vectors.len(),
            count,
            "one boundary vector per node"
        );
        assert_eq!(weights.len(), pairs, "one weight per pair");
        let weights: Vec<f64> = weights.into_iter().map(rounded).collect();
        validate(positions, &weights)?;
        validate_nodes(volumes, boundary_vectors)?;
        let mut stencils = Self {
            pair_gradients: vec![DVec3::ZERO; pairs],
            self_gradients: vec![DVec3::ZERO; count],
            base_weights: weights.clone(),
            weights,
            moment_inverses: vec![DMat3::ZERO; count],
            matrices: vec![DMat3::ZERO; count],
            scales: vec![0.0; count],
            ranks: vec![NO_RANK; count],
            multipliers: vec![DVec3::ZERO; count],
            boundary_vectors: boundary_vectors.to_vec(),
            volumes: volumes.to_vec(),
            report: SolveReport {
                iterations: 0,
                residual: 0.0,
                boundary_shift: 0.0,
                converged: true,
            },
            reverse: neighborhoods.reverse_pairs()?,
            settings: *settings,
            uncut_stiffness: 0.0,
        };
        stencils.rebuild_all(positions, neighborhoods);
        let (everywhere, smallest) = (vec![true; count], 0);
        stencils.enforce(positions, neighborhoods, &everywhere, smallest);
        stencils.uncut_stiffness = stencils.stiffest(neighborhoods);
        Ok(stencils)
    }

    /// Lets go of `g_ij` and of the counterparts of pairs, 28 bytes a pair, where only the factored form is
    /// read: weights, matrices, scales and multipliers. Rows are updated as before;
    /// [`ConservativeStencils::finish_stroke`] and [`ConservativeStencils::conservation_error`] are not to be
    /// had any more.
    pub fn forget_pair_gradients(&mut self) {
        self.pair_gradients = Vec::new();
        self.reverse = Vec::new();
    }

    /// Panics if a method needs what was let go of.
    fn assert_not_forgotten(&self) {
        assert_eq!(
            self.pair_gradients.len(),
            self.weights.len(),
            "pair gradients that were not forgotten"
        );
    }

    /// For every pair the position of its counterpart, shape `(pairs)`; empty after
    /// [`ConservativeStencils::forget_pair_gradients`].
    #[must_use]
    pub fn reverse_pairs(&self) -> &[u32] {
        &self.reverse
    }

    /// Memory held: 24 + 72 + 72 + 8 + 40 + 24 + 24 + 8 bytes per node, 24 + 8 + 8 + 4 per pair, 8 + 8
    /// per pair after [`ConservativeStencils::forget_pair_gradients`]. The set-up
    /// solve needs about 700 bytes per node and 8 per pair more while it runs.
    #[must_use]
    pub fn memory_bytes(&self) -> StencilMemory {
        StencilMemory {
            per_node: 3 * size_of::<DVec3>()
                + 2 * size_of::<DMat3>()
                + size_of::<StencilRank>()
                + 2 * size_of::<f64>(),
            per_pair: size_of::<DVec3>() + 2 * size_of::<f64>() + size_of::<u32>(),
            total: allocated(&self.pair_gradients)
                + allocated(&self.self_gradients)
                + allocated(&self.weights)
                + allocated(&self.moment_inverses)
                + allocated(&self.matrices)
                + allocated(&self.scales)
                + allocated(&self.ranks)
                + allocated(&self.multipliers)
                + allocated(&self.boundary_vectors)
                + allocated(&self.volumes)
                + allocated(&self.base_weights)
                + allocated(&self.reverse),
        }
    }

    /// Takes new pair factors in and rebuilds the touched rows, and only those: weights
    /// `f_ij · w0_ij`, moment matrix, rank, `g0`, and the correction with the μ of before.
    ///
    /// No solve, and `b` stays: solving again with the old `b` would act as if there were no cut. The time is
    /// proportional to the pairs of the touched rows.
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
    /// If a slice does not have its stated length or a touched node is out of range.
    pub fn update_rows(
        &mut self,
        positions: &[DVec3],
        neighborhoods: &Neighborhoods,
        factor: impl Fn(usize) -> f64,
        touched: &[u32],
    ) -> Result<(), StencilError> {
        assert_eq!(positions.len(), self.volumes.len(), "one position per node");
        assert_eq!(
            neighborhoods.pair_count(),
            self.weights.len(),
            "the graph of the set-up"
        );
        let frame = self.frame(positions, neighborhoods);
        let forgotten = self.pair_gradients.is_empty();
        let mut unread = Vec::new();
        for &node in touched {
            let node = node as usize;
            let pairs = neighborhoods.pairs(node);
            take_factors(
                &mut self.weights,
                &self.base_weights,
                &factor,
                pairs.clone(),
            )?;
            let gradients = if forgotten {
                unread.resize(pairs.len(), DVec3::ZERO);
                &mut unread[..]
            } else {
                &mut self.pair_gradients[pairs.clone()]
            };
            let weights = &self.weights[pairs];
            let volume = self.volumes[node];
            let row = frame.build(node, weights, volume, &self.multipliers, gradients);
            self.store(node, row);
        }
        Ok(())
    }

    fn frame<'a>(&self, positions: &'a [DVec3], neighborhoods: &'a Neighborhoods) -> RowFrame<'a> {
        RowFrame {
            positions,
            neighborhoods,
            rank_tolerance: self.settings.rank_tolerance,
        }
    }

    /// Writes one row's node data.
    fn store(&mut self, node: usize, row: Row) {
        self.moment_inverses[node] = row.moment_inverse;
        self.matrices[node] = row.matrix;
        self.scales[node] = if row.rank.rank == 3 {
            self.volumes[node]
        } else {
            0.0
        };
        self.ranks[node] = row.rank;
        self.self_gradients[node] = row.self_gradient;
    }

    /// Rebuilds every row with the weights and μ at hand, in parallel.
    fn rebuild_all(&mut self, positions: &[DVec3], neighborhoods: &Neighborhoods) {
        let frame = self.frame(positions, neighborhoods);
        let (weights, volumes) = (&self.weights, &self.volumes);
        let multipliers = &self.multipliers;
        let built = build_rows(neighborhoods, &mut self.pair_gradients, |node, out| {
            let weights = &weights[neighborhoods.pairs(node)];
            frame.build(node, weights, volumes[node], multipliers, out)
        });
        for (node, row) in built.into_iter().flatten().enumerate() {
            self.store(node, row);
        }
    }

    /// Takes new μ into every row; weights and moment matrices are those of before.
    fn take_multipliers(
        &mut self,
        multipliers: Vec<DVec3>,
        positions: &[DVec3],
        neighborhoods: &Neighborhoods,
    ) {
        self.multipliers = multipliers;
        let frame = self.frame(positions, neighborhoods);
        let (weights, volumes) = (&self.weights, &self.volumes);
        let (multipliers, ranks) = (&self.multipliers, &self.ranks);
        let inverses = &self.moment_inverses;
        let built = build_rows(neighborhoods, &mut self.pair_gradients, |node, out| {
            let weights = &weights[neighborhoods.pairs(node)];
            let quality = (inverses[node], ranks[node]);
            frame.fill(node, weights, volumes[node], multipliers, quality, out)
        });
        for (node, row) in built.into_iter().flatten().enumerate() {
            self.store(node, row);
        }
    }
}

const NO_RANK: StencilRank = StencilRank {
    rank: 0,
    condition: f64::INFINITY,
    axis: DVec3::ZERO,
};

/// What a row is built from.
struct RowFrame<'a> {
    positions: &'a [DVec3],
    neighborhoods: &'a Neighborhoods,
    rank_tolerance: f64,
}

impl RowFrame<'_> {
    /// Builds `g_ij` of one row into `out` (shape: pairs of the row).
    fn build(
        &self,
        node: usize,
        weights: &[f64],
        volume: f64,
        multipliers: &[DVec3],
        out: &mut [DVec3],
    ) -> Row {
        let moment = moment(self.positions, self.neighborhoods, node, weights);
        let quality = invert_moment(&moment, self.rank_tolerance);
        self.fill(node, weights, volume, multipliers, quality, out)
    }

    /// The same with the inverse and rank of the moment matrix at hand.
    fn fill(
        &self,
        node: usize,
        weights: &[f64],
        volume: f64,
        multipliers: &[DVec3],
        (moment_inverse, rank): (DMat3, StencilRank),
        out: &mut [DVec3],
    ) -> Row {
        let at = self.positions[node];
        let row = self.neighborhoods.row(node);
        let corrected = rank.rank == 3;
        let mut tensor = DMat3::ZERO;
        if corrected {
            for (&j, &w) in row.iter().zip(weights) {
                let x = self.positions[j as usize] - at;
                tensor += outer(multipliers[j as usize] - multipliers[node], x * w);
            }
        }
        let h = tensor * moment_inverse;
        let mut self_gradient = DVec3::ZERO;
        for ((&j, &w), g) in row.iter().zip(weights).zip(out) {
            let x = self.positions[j as usize] - at;
            let mut value = moment_inverse * (x * w);
            if corrected {
                let e = multipliers[j as usize] - multipliers[node] - h * x;
                value += e * (volume * w);
            }
            *g = value;
            self_gradient -= value;
        }
        let matrix = if corrected {
            moment_inverse - h * volume
        } else {
            moment_inverse
        };
        Row {
            moment_inverse,
            matrix,
            rank,
            self_gradient,
        }
    }
}

/// Refuses volumes and boundary vectors that are not finite, and volumes that are not positive.
fn validate_nodes(volumes: &[f64], boundary_vectors: &[DVec3]) -> Result<(), StencilError> {
    if let Some(node) = volumes.iter().position(|&v| !(v > 0.0 && v.is_finite())) {
        let value = volumes[node];
        return Err(StencilError::Volume { node, value });
    }
    if let Some(node) = boundary_vectors.iter().position(|b| !b.is_finite()) {
        return Err(StencilError::BoundaryVector { node });
    }
    Ok(())
}
