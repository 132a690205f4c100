//! Cracks in plane strain. All ratios are to the reference named beside them.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use glam::DVec3;
use phyxel_enrich::Cuts;

use super::cut_body::{CutBody, Form};
use super::field::{plane_modulus, stress_intensities};
use super::plate::Plate;
use crate::StudyError;

/// Results relative to their references, and the times (s) of set-up, factors and rows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ratios {
    /// The first quantity over its reference.
    pub first: f64,
    /// The second quantity over its reference.
    pub second: f64,
    /// See [`CutBody::seconds`].
    pub seconds: [f64; 3],
    /// Nodes of the body.
    pub nodes: usize,
}

/// Held in the plane.
const IN_PLANE: DVec3 = DVec3::new(1.0, 1.0, 0.0);

/// A slab of one cell, held in its plane: plane strain.
fn slab(cells: [u32; 2], low: [f64; 2], high: [f64; 2], jitter: f64) -> Result<Plate, StudyError> {
    let dx = (high[0] - low[0]) / f64::from(cells[0]);
    Plate::new(
        [cells[0], cells[1], 1],
        DVec3::new(low[0], low[1], 0.0),
        DVec3::new(high[0], high[1], dx),
        jitter,
    )
}

/// An upright cut along a line of the plane, in pieces of about a spacing, and its captures.
///
/// # Errors
/// [`StudyError`] if the line is no cut.
pub fn upright(
    body: &Plate,
    from: DVec3,
    to: DVec3,
) -> Result<(Cuts, Vec<[DVec3; 2]>), StudyError> {
    let count = (from.distance(to) / body.spacing).ceil();
    let reach = 4.0 * body.spacing * DVec3::Z;
    let mut blades = Vec::new();
    let mut k = 0.0;
    while k <= count {
        let p = from.lerp(to, k / count);
        blades.push([p - reach, p + reach]);
        k += 1.0;
    }
    let mut cuts = body.cuts();
    let stroke = cuts.start(&blades[0])?;
    for blade in &blades[1..] {
        cuts.append(stroke, blade)?;
    }
    cuts.end(stroke)?;
    Ok((cuts, blades))
}

/// Edge crack in a strip under tension, W 1, H 3 (Tada, Paris, Irwin: F and V of a single edge notch):
/// `K_I` and mouth opening. `shift` moves the tip and the cut's line by fractions of a spacing. `None` if
/// the form refuses.
///
/// # Errors
/// [`StudyError`] if the displacements are not found.
pub fn edge_crack(
    cells: u32,
    jitter: f64,
    shift: [f64; 2],
    form: Form,
) -> Result<Option<Ratios>, StudyError> {
    let body = slab([cells, 3 * cells], [0.0, 0.0], [1.0, 3.0], jitter)?;
    let dx = body.spacing;
    let (a, y) = (0.4 + shift[0] * dx, 1.5 + shift[1] * dx);
    let tip = DVec3::new(a, y, 0.5 * dx);
    let (cuts, blades) = upright(&body, DVec3::new(-2.0 * dx, y, 0.5 * dx), tip)?;
    let Some(cut) = CutBody::new(&body, &cuts, &blades, form)? else {
        return Ok(None);
    };
    let u = cut.solve(&body.tension(DVec3::Y), |_| IN_PLANE)?;
    let gradients = cut.gradients(&u);
    let k = stress_intensities(&cut, &gradients, tip, DVec3::X, 6.0_f64.min(0.3 / dx) * dx);
    let shape = 1.12 - 0.231 * a + 10.55 * a.powi(2) - 21.72 * a.powi(3) + 30.39 * a.powi(4);
    let opening_shape = (1.46 + 3.42 * (1.0 - (0.5 * PI * a).cos())) / (0.5 * PI * a).cos().powi(2);
    let at = DVec3::new(0.0, y, 0.5 * dx);
    let mouth = cut.opening(&cuts, &u, &gradients, at, DVec3::Y);
    Ok(Some(Ratios {
        first: k[0] / (shape * (PI * a).sqrt()),
        second: mouth / (4.0 * a * opening_shape / plane_modulus()),
        seconds: cut.seconds,
        nodes: u.len(),
    }))
}

/// Centre crack, half width 1, half height 1.5, a 0.4 (Tada, Paris, Irwin): `K_I`, mean of both tips,
/// and opening at the middle. `None` if the form refuses.
///
/// # Errors
/// [`StudyError`] if the displacements are not found.
pub fn centre_crack(cells: u32, shift: [f64; 2], form: Form) -> Result<Option<Ratios>, StudyError> {
    let body = slab([cells, 3 * cells / 2], [-1.0, -1.5], [1.0, 1.5], 0.0)?;
    let dx = body.spacing;
    let a = 0.4;
    let middle = DVec3::new(shift[0] * dx, shift[1] * dx, 0.5 * dx);
    let tip = middle + a * DVec3::X;
    let (cuts, blades) = upright(&body, middle - a * DVec3::X, tip)?;
    let Some(cut) = CutBody::new(&body, &cuts, &blades, form)? else {
        return Ok(None);
    };
    let u = cut.solve(&body.tension(DVec3::Y), |_| IN_PLANE)?;
    let gradients = cut.gradients(&u);
    let k: f64 = [DVec3::X, -DVec3::X]
        .map(|along| stress_intensities(&cut, &gradients, middle + a * along, along, 5.0 * dx)[0])
        .iter()
        .sum();
    let reference = (PI * a).sqrt()
        * (0.5 * PI * a).cos().recip().sqrt()
        * (1.0 - 0.025 * a * a + 0.06 * a.powi(4));
    let shape = -0.071 - 0.535 * a + 0.169 * a * a + 0.020 * a.powi(3) - 1.071 * (1.0 - a).ln() / a;
    let opening = cut.opening(&cuts, &u, &gradients, middle, DVec3::Y);
    Ok(Some(Ratios {
        first: 0.5 * k / reference,
        second: opening / (4.0 * a * shape / plane_modulus()),
        seconds: cut.seconds,
        nodes: u.len(),
    }))
}

/// Inner crack at 45 degrees, half width 1, half height 2, a 0.2: `K_I` and `K_II` against
/// `σ sqrt(π a) / 2`, means of both tips. The finite width adds 1 or 2 % to the reference. `None` if
/// the form refuses.
///
/// # Errors
/// [`StudyError`] if the displacements are not found.
pub fn inclined_crack(cells: u32, jitter: f64, form: Form) -> Result<Option<Ratios>, StudyError> {
    let body = slab([cells, 2 * cells], [-1.0, -2.0], [1.0, 2.0], jitter)?;
    let dx = body.spacing;
    let a = 0.2;
    let middle = DVec3::new(0.11 * dx, 0.37 * dx, 0.5 * dx);
    let along = DVec3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
    let (cuts, blades) = upright(&body, middle - a * along, middle + a * along)?;
    let Some(cut) = CutBody::new(&body, &cuts, &blades, form)? else {
        return Ok(None);
    };
    let u = cut.solve(&body.tension(DVec3::Y), |_| IN_PLANE)?;
    let gradients = cut.gradients(&u);
    let reference = 0.5 * (PI * a).sqrt();
    let mut means = [0.0; 2];
    for d in [along, -along] {
        let k = stress_intensities(&cut, &gradients, middle + a * d, d, 5.0 * dx);
        means[0] += 0.5 * k[0] / reference;
        means[1] += 0.5 * k[1].abs() / reference;
    }
    Ok(Some(Ratios {
        first: means[0],
        second: means[1],
        seconds: cut.seconds,
        nodes: u.len(),
    }))
}

/// Beam 2 × 0.5 with clamped ends under its own weight, slit from below at the middle to half its
/// height: growth of the sag by the slit, and mouth, against finite elements (240 × 60, real slit).
/// `None` if the form refuses.
///
/// # Errors
/// [`StudyError`] if the displacements are not found.
pub fn gravity_slit(cells: u32, form: Form) -> Result<Option<Ratios>, StudyError> {
    let body = slab([cells, cells / 4], [0.0, 0.0], [2.0, 0.5], 0.0)?;
    let dx = body.spacing;
    let x = 1.0 - 0.5 * dx;
    let from = DVec3::new(x, -2.0 * dx, 0.5 * dx);
    let (cuts, blades) = upright(&body, from, DVec3::new(x, 0.25, 0.5 * dx))?;
    let whole = CutBody::new(&body, &body.cuts(), &[], Form::DIFFRACTION)?;
    let cut = CutBody::new(&body, &cuts, &blades, form)?;
    let (Some(whole), Some(cut)) = (whole, cut) else {
        return Ok(None);
    };
    let forces = body.block.weight(-DVec3::Y);
    let hold = |p: DVec3| {
        if p.x < 1e-9 || p.x > 2.0 - 1e-9 {
            DVec3::ZERO
        } else {
            IN_PLANE
        }
    };
    let (uncut, u) = (whole.solve(&forces, hold)?, cut.solve(&forces, hold)?);
    let to_top = |x: DVec3| x.distance_squared(DVec3::new(1.0, 0.5, 0.0));
    let rest = body.block.rest.iter().enumerate();
    let top = rest.min_by(|a, b| to_top(*a.1).total_cmp(&to_top(*b.1)));
    let top = top.map_or(0, |(node, _)| node);
    let gradients = cut.gradients(&u);
    let at = DVec3::new(x, 0.0, 0.5 * dx);
    let mouth = cut.opening(&cuts, &u, &gradients, at, DVec3::X);
    Ok(Some(Ratios {
        first: (u[top].y / uncut[top].y) / (0.004_234_3 / 0.003_216_9),
        second: mouth / 0.002_247_7,
        seconds: cut.seconds,
        nodes: u.len(),
    }))
}
