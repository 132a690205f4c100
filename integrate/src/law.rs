//! What implicit solvers need to know of forces.

use crate::coupling::Coupling;
use glam::{DMat3, DVec3};

/// Forces with their tangent, for solvers that need `K v`.
pub trait ForceLaw {
    /// Writes the forces `f = −dE/dx` (N) at `positions` (m) and returns the energy `E` (J). Positions
    /// without a finite answer (an inverted node) give a result that is not finite.
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64;

    /// Writes `K v` with `K = d²E/dx²` (N/m, symmetric), at the positions of the last
    /// [`ForceLaw::forces_into`].
    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]);

    /// Writes the diagonal blocks of `K` (N/m), or of a near one such as that at rest, and returns
    /// `true`; `false` if there are none. They only speed up the solve.
    fn tangent_blocks_into(&mut self, _blocks: &mut [DMat3]) -> bool {
        false
    }

    /// Which nodes the tangent couples; needed to factor it ([`crate::Preconditioner`]). Entries of the
    /// tangent outside are neglected in the factor, never in the solution.
    fn coupling(&self) -> Option<&Coupling> {
        None
    }
}

impl<L: ForceLaw + ?Sized> ForceLaw for &mut L {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        (**self).forces_into(positions, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        (**self).tangent_product_into(vector, product);
    }

    fn tangent_blocks_into(&mut self, blocks: &mut [DMat3]) -> bool {
        (**self).tangent_blocks_into(blocks)
    }

    fn coupling(&self) -> Option<&Coupling> {
        (**self).coupling()
    }
}
