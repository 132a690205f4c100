//! Cracks in plane strain. All ratios are to the reference named beside them.

use glam::DVec3;
use phyxel_enrich::Cuts;

use super::cut_body::{CutBody, Form};
use super::field::stress_intensities;
use super::plate::Plate;
use super::references::{edge_intensity, edge_mouth};
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

/// Cells across a slab: nodes lie within it, as in what is cut. Crack tips between nodes in faces alone are stiffer: of 1, 2, 3
/// and 4 cells `K_I` at 8 spacings is 0.971, 0.976, 0.979 and 0.981, which is 0.987 less 0.016 times the fraction of nodes in faces.
const ACROSS: u32 = 2;

/// An upright cut along a line of the plane, in pieces of about a spacing, and its captures.
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
    add_stroke(&mut cuts, &blades)?;
    Ok((cuts, blades))
}

/// Adds a stroke, blade by blade.
pub fn add_stroke<B: AsRef<[DVec3]>>(cuts: &mut Cuts, blades: &[B]) -> Result<(), StudyError> {
    let stroke = cuts.start(blades[0].as_ref())?;
    for blade in &blades[1..] {
        cuts.append(stroke, blade.as_ref())?;
    }
    Ok(cuts.end(stroke)?)
}

/// Edge crack in a strip under tension, W 1, H 3, held in its plane (Tada, Paris, Irwin: F and V of a single edge notch):
/// `K_I` and mouth opening. `shift` moves the tip and the cut's line by fractions of a spacing. The strip lies at `z` (m) across
/// its plane, on which nothing depends. `None` if the form refuses.
pub fn edge_crack(
    cells: u32,
    jitter: f64,
    shift: [f64; 2],
    z: f64,
    form: Form,
) -> Result<Option<Ratios>, StudyError> {
    let dx = f64::from(cells).recip();
    let half = 0.5 * f64::from(ACROSS) * dx;
    let [low, high] = [
        DVec3::new(0.0, 0.0, z - half),
        DVec3::new(1.0, 3.0, z + half),
    ];
    let body = Plate::new([cells, 3 * cells, ACROSS], low, high, jitter)?;
    let (a, y) = (0.4 + shift[0] * dx, 1.5 + shift[1] * dx);
    let tip = DVec3::new(a, y, z);
    let (cuts, blades) = upright(&body, DVec3::new(-2.0 * dx, y, z), tip)?;
    let Some(cut) = CutBody::new(&body, &cuts, &blades, form)? else {
        return Ok(None);
    };
    let u = cut.solve(&body.tension(DVec3::Y), IN_PLANE)?;
    let gradients = cut.gradients(&u);
    let k = stress_intensities(&cut, &gradients, tip, DVec3::X, 6.0_f64.min(0.3 / dx) * dx);
    let at = DVec3::new(0.0, y, z);
    let mouth = cut.opening(&cuts, &u, &gradients, at, DVec3::Y);
    Ok(Some(Ratios {
        first: k[0] / edge_intensity(a),
        second: mouth / edge_mouth(a),
        seconds: cut.seconds,
        nodes: u.len(),
    }))
}
