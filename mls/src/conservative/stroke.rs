//! Restoring the conservation constraint on the faces of a finished cut.

use glam::{DMat3, DVec3};

use super::{ConservativeStencils, SolveReport};
use crate::neighborhoods::Neighborhoods;
use crate::symmetric::{SymmetricEigen, outer};

/// Share of the largest eigenvalue from which a direction counts as spanned by cut normals; two
/// normals 10° apart span a plane, numerical noise does not.
const SPAN_TOLERANCE: f64 = 1e-3;

/// Most that the stiffest row may be, over that of the uncut body. An explicit step is chosen from the
/// uncut body; at half the critical one it bears an eigenvalue of 4 times. Twice leaves half of that to
/// what rows do not show: contact, the pair penalty, and the eigenvalue itself, measured to grow by 0.65
/// to 1.3 times what the stiffest row does. Of 48 cuts of four jittered blocks, those between nodes end at
/// 1.2 to 1.6 (the cut alone, without the finish, at the same), those through nodes at 1.7 to 4.0, oblique
/// ones at 1.6 to 5.8, and those finished without the ring of neighbours at 31 and more. The test
/// `accepted_finishes_keep_the_eigenvalue` follows 16 of them.
const LARGEST_STIFFENING: f64 = 2.0;

/// Outcome of [`ConservativeStencils::finish_stroke`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrokeReport {
    /// Whether the new rows were taken; if not, nothing has changed.
    pub accepted: bool,
    /// Stiffness of the stiffest row with the new rows, over that of the uncut body.
    pub stiffening: f64,
    /// The same with the old rows.
    pub stiffening_before: f64,
    /// Nodes whose boundary vector the cut's normals moved.
    pub moved: usize,
    /// The solve that followed, also if its result was not taken.
    pub solve: SolveReport,
}

impl ConservativeStencils {
    /// Restores `Σ_i V_i g_ij = b_j` after a cut, with new boundary vectors on the cut faces.
    ///
    /// [`ConservativeStencils::update_rows`] leaves `c_j = Σ_i V_i g_ij` different from `b_j` along
    /// the cut: the difference is the area of the new face as the stencils see it, plus an error.
    /// Here `b_j += N_j (c_j − b_j)`, where `N_j` projects on the span of the normals of the cut
    /// faces near node j; each piece's remainder is made attainable, and μ is solved for from where
    /// it stands. Uniform stress parallel to the cut is then exact again.
    ///
    /// Meant for the end of a stroke, not for every update. The new rows are taken only if they worsen
    /// nothing: the solve must converge, and no row may become stiffer than the stiffest row before or twice
    /// the stiffest row of the uncut body, `q_i = V_i Σ_j |g_ij|² / V_j` with `j = i` included, which the
    /// largest eigenvalue follows where masses follow volumes. Otherwise all stays as [`ConservativeStencils::update_rows`] left it,
    /// bit for bit, [`SolveReport`] in the stencils included: one call is safe on any cut. What a body's
    /// elastic energy does at its present state is for the caller to see.
    ///
    /// # Arguments
    /// * `nodes` -- nodes of pairs that a cut crosses and their neighbours, of all cuts so far: the solve
    ///   enforces b everywhere; a cut whose nodes still have the b of before would act as closed.
    /// * `projectors` -- `N_j`, shape of `nodes`; see [`normal_projector`].
    ///
    /// # Panics
    /// If slices do not have their stated lengths, a node is out of range or the pair gradients were
    /// forgotten.
    ///
    /// # Numerics
    /// Pieces with fewer nodes than the settings' `smallest_piece` keep their stencils: small debris
    /// has no stable solution. A through cut of irregular nodes stays inexact by a few per cent near
    /// the cut, because volumes are not clipped.
    pub fn finish_stroke(
        &mut self,
        positions: &[DVec3],
        neighborhoods: &Neighborhoods,
        nodes: &[u32],
        projectors: &[DMat3],
    ) -> StrokeReport {
        assert_eq!(positions.len(), self.volumes.len(), "one position per node");
        assert_eq!(
            neighborhoods.pair_count(),
            self.weights.len(),
            "the graph of the set-up"
        );
        assert_eq!(nodes.len(), projectors.len(), "one projector per node");
        self.assert_not_forgotten();
        let before = self.clone();
        let defect = self.defect(neighborhoods);
        let scale = self
            .boundary_vectors
            .iter()
            .fold(0.0_f64, |most, b| most.max(b.length()));
        let mut spread = vec![false; positions.len()];
        let mut moved = 0;
        for (&node, projector) in nodes.iter().zip(projectors) {
            let j = node as usize;
            if spread[j] || defect[j].length() <= self.settings.tolerance * scale {
                continue;
            }
            // c − b is minus the defect.
            self.boundary_vectors[j] -= *projector * defect[j];
            spread[j] = true;
            moved += 1;
        }
        let smallest = self.settings.smallest_piece;
        self.enforce(positions, neighborhoods, &spread, smallest);
        let solve = self.report;
        let stiffening = self.stiffest(neighborhoods) / self.uncut_stiffness;
        let stiffening_before = before.stiffest(neighborhoods) / self.uncut_stiffness;
        let bound = stiffening_before.max(LARGEST_STIFFENING);
        let accepted = solve.converged && stiffening <= bound;
        if !accepted {
            *self = before;
        }
        StrokeReport {
            accepted,
            stiffening,
            stiffening_before,
            moved,
            solve,
        }
    }

    /// `max_i V_i Σ_j |g_ij|² / V_j` with `j = i` included (1/m²).
    pub(super) fn stiffest(&self, neighborhoods: &Neighborhoods) -> f64 {
        let row = |i: usize| {
            let own = self.self_gradients[i].length_squared();
            let pairs = neighborhoods.pairs(i);
            let others = neighborhoods.row(i).iter().zip(&self.pair_gradients[pairs]);
            let sum: f64 = others
                .map(|(&j, g)| g.length_squared() / self.volumes[j as usize])
                .sum();
            own + self.volumes[i] * sum
        };
        (0..self.volumes.len()).map(row).fold(0.0, f64::max)
    }
}

/// Projector `N` on the span of some normals (any length, any sign); zero for none.
///
/// Directions that the normals contain only weakly (their share below 1e-3 of the strongest) do not
/// count.
#[must_use]
pub fn normal_projector(normals: &[DVec3]) -> DMat3 {
    let mut sum = DMat3::ZERO;
    for normal in normals {
        let unit = normal.normalize_or_zero();
        sum += outer(unit, unit);
    }
    let eigen = SymmetricEigen::new(&sum);
    let mut projector = DMat3::ZERO;
    for k in 0..eigen.rank(SPAN_TOLERANCE) {
        projector += outer(eigen.vectors[k], eigen.vectors[k]);
    }
    projector
}
