//! A row of cracks in the three modes, measured by the work of the loads.

use std::f64::consts::PI;

use glam::DVec3;

use super::cut_body::{CutBody, Form};
use super::problems::{slab, upright};
use super::{POISSON, YOUNG};
use crate::study::StudyError;

/// How the faces of a crack move against each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Apart (I).
    Opening,
    /// Along the plane across the front (II).
    Sliding,
    /// Along the front (III).
    Tearing,
}

impl Mode {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Opening, Self::Sliding, Self::Tearing];
}

/// A row of equal cracks, half length 0.4 and period 2, in a body loaded with 1 Pa far away: what the
/// cracks add to the work of the load, over its exact value `2 ΔU`,
/// `ΔU = −(8/(π E')) ln cos(π a/2)` from `K = σ sqrt(2 tan(π a/2))` in all modes (Tada, Paris, Irwin),
/// `E' = E/(1 − ν²)` and, for [`Mode::Tearing`], `2 μ`.
///
/// One cell of the row, 2 wide and 4 high, with `cells` nodes' distances across; its sides are planes
/// of symmetry. `shift` moves the crack by shares of a spacing. `None` if the form refuses.
///
/// # Errors
/// [`StudyError`] if the displacements are not found.
pub fn crack_row(
    cells: u32,
    jitter: f64,
    shift: [f64; 2],
    mode: Mode,
    form: Form,
) -> Result<Option<f64>, StudyError> {
    let body = slab([cells, 2 * cells], [-1.0, -2.0], [1.0, 2.0], jitter)?;
    let dx = body.spacing;
    let a = 0.4;
    let middle = DVec3::new(shift[0] * dx, shift[1] * dx, 0.5 * dx);
    let (cuts, blades) = upright(&body, middle - a * DVec3::X, middle + a * DVec3::X)?;
    let Some(cut) = CutBody::new(&body, &cuts, &blades, form)? else {
        return Ok(None);
    };
    let side = |p: DVec3| p.x.abs() > 1.0 - 1e-9;
    let free_in_plane = DVec3::new(1.0, 1.0, 0.0);
    let shear = YOUNG / (2.0 * (1.0 + POISSON));
    let lateral = YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
    let plane = YOUNG / (1.0 - POISSON * POISSON);
    let (traction, modulus, crack) = match mode {
        Mode::Opening => (DVec3::Y, lateral, plane),
        Mode::Sliding => (DVec3::X, shear, plane),
        Mode::Tearing => (DVec3::Z, shear, 2.0 * shear),
    };
    let mask = |p: DVec3| match mode {
        Mode::Opening if side(p) => DVec3::Y,
        Mode::Sliding if side(p) => DVec3::X,
        Mode::Opening | Mode::Sliding => free_in_plane,
        Mode::Tearing => DVec3::Z,
    };
    let forces = body.loads(DVec3::Y, traction);
    let u = cut.solve(&forces, mask)?;
    let work: f64 = forces.iter().zip(&u).map(|(f, u)| f.dot(*u)).sum();
    let added = work / dx - 8.0 / modulus;
    let exact = -16.0 / (PI * crack) * (0.5 * PI * a).cos().ln();
    Ok(Some(added / exact))
}
