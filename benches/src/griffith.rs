//! Griffith's identity: what a cut along a double cantilever with fixed grips releases, per area, is
//! the energy release rate.

use glam::DVec3;
use phyxel::World;
use phyxel::scene::{Body, Cut, Key, Region, Scene, Shape, Support, Target};
use phyxel_elastic::CrackFront;
use serde::Serialize;

use crate::row::Row;
use crate::watch::{Options, run_with};

/// Half height of the beam, height of an arm (m).
const ARM: f64 = 0.03;
/// Length of the beam (m).
const LENGTH: f64 = 0.3;
/// Width (m).
const WIDTH: f64 = 0.01;
/// Young's modulus (Pa); Poisson's ratio is 0, so that plane stress and plane strain are one.
const MODULUS: f64 = 1e5;
/// How far (m) the grips are drawn apart.
const OPENING: f64 = 0.1 * ARM;
/// Crack lengths (m) from the grips before and after.
const CRACK: [f64; 2] = [4.0 * ARM, 6.0 * ARM];
/// Scene times (s): the grips have opened, the cut continues, the cut ends, all is at rest.
const OPENED: f64 = 0.6;
const BEGINS: f64 = 1.0;
const ENDS: f64 = 1.8;
const REST: f64 = 2.4;
/// Damping (1/s) under which the arms, of some 25 rad/s, come to rest soonest: nearly critical.
const DAMPING: f64 = 30.0;
/// `K = √12 P h^-3/2 (a/h + 0.673)`: the length by which an arm's root acts longer, in its heights
/// (Foote and Buchwald 1985).
const ROOT: f64 = 0.673;
/// Radius (spacings) around the cut's end in which its energy release rate is taken, as scenes do where tissue tears.
const FRONT: f64 = 4.0;
/// Largest deviation of the energy released per area from the energy release rate.
pub const DEVIATION: f64 = 0.05;
/// The same of what the stress around the cut's end says, and of where a tear ends.
const BY_DOMAIN: f64 = 0.2;

/// What was found at one fineness.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Spacings across an arm.
    pub spacings: f64,
    /// Energy (J) stored before the cut over that of the closed form.
    pub stored: f64,
    /// Energy lost by the cut, over area and mean of the energy release rate `G = 3 P δ / (2 b A)` that
    /// the measured load `P = 2 U / δ` has: that of the body as it is.
    pub ratio: f64,
    /// The same over the energy release rate of the closed form, which also has the load.
    pub ratio_of_closed_form: f64,
    /// Fraction of that loss that the updates themselves took; the rest went into motion and was damped.
    pub by_updates: f64,
    /// Energy release rate at the cut's end by the stress around it, over that of the load.
    pub by_domain: f64,
    /// A cut that tears by itself until its energy release rate is the toughness: that of the load where it ends, over it.
    pub torn: f64,
    /// The run's figures.
    #[serde(skip)]
    pub row: Row,
}

/// Energy (J) of both arms, cut to `a` (m) from grips that hold their ends upright and `OPENING` apart.
///
/// With the force `P` and the moment `M` of a grip the energy release rate is
/// `G = 12 (P A + M)² / (E b² h³)`, `A = a + 0.673 h`; an end that does not turn asks for
/// `M = -P A/2`, and so `U = E b h³ δ² / (4 A³)`.
fn energy(crack: f64) -> f64 {
    let long = crack + ROOT * ARM;
    MODULUS * WIDTH * ARM.powi(3) * OPENING.powi(2) / (4.0 * long.powi(3))
}

/// The double cantilever with `spacings` across an arm.
pub fn scene(spacings: f64) -> Scene {
    let size = DVec3::new(LENGTH, WIDTH, 2.0 * ARM);
    let mut body = Body::new(Shape::Box { size });
    body.sampling.target = Target::Spacing(ARM / spacings);
    body.material.youngs_modulus = MODULUS;
    body.material.poissons_ratio = 0.0;
    body.material.density = 1000.0;
    body.damping = DAMPING;
    let mut scene = Scene::new("griffith", vec![body]);
    scene.gravity = None;
    scene.integration.settle = None;
    scene.integration.duration = REST;
    let left = -0.5 * LENGTH;
    for side in [1.0, -1.0] {
        let corner = DVec3::new(left, side * WIDTH, side * 0.25 * ARM / spacings);
        let other = DVec3::new(left + 1e-6, -side * WIDTH, side * 2.0 * ARM);
        let region = Region::Box {
            min: corner.min(other) - DVec3::X * 1e-6,
            max: corner.max(other),
        };
        let opened = DVec3::Z * (0.5 * side * OPENING);
        let path = vec![Key::new(0.2, DVec3::ZERO), Key::new(OPENED, opened)];
        scene.supports.push(Support::driven(region, path));
    }
    let [short, long] = CRACK.map(|crack| left + crack);
    for (name, path) in [
        ("first", [(0.0, left - 0.01), (0.15, short)]),
        ("middle", [(BEGINS, short), (ENDS, long)]),
    ] {
        let path = path.map(|(time, x)| Key::new(time, DVec3::X * x));
        let edge = vec![DVec3::Y * -WIDTH, DVec3::Y * WIDTH];
        scene.cuts.push(Cut {
            name: name.to_owned(),
            ..Cut::new(edge, path.to_vec())
        });
    }
    scene
}

/// Cuts the double cantilever with `spacings` across an arm.
pub fn measure(spacings: f64) -> Finding {
    let mut before = (0.0, 0.0);
    let mut by_domain = 0.0;
    let name = format!("double cantilever, {spacings} across an arm");
    let row = run_with(&name, scene(spacings), Options::default(), |world| {
        if world.scene_time().is_some_and(|time| time < BEGINS) {
            let audit = world.bodies()[0].motion().audit();
            before = (audit.elastic, audit.energy_correction);
        }
        if world.is_over() {
            by_domain = rate(world, CRACK[1]);
        }
    });
    let [first, last] = CRACK.map(energy);
    let lost = before.0 - row.elastic;
    // The integral of G over the area: U falls with the third power of A.
    let of_load = before.0 * (1.0 - last / first);
    Finding {
        spacings,
        by_domain,
        torn: tear(spacings),
        stored: before.0 / first,
        ratio: lost / of_load,
        ratio_of_closed_form: lost / (first - last),
        by_updates: (row.released + before.1) / lost,
        row,
    }
}

/// Tears the double cantilever, whose toughness is the closed form's energy release rate of the longer crack. Returns the load's
/// rate where the tear ends, over the toughness; not a number if the run fails.
fn tear(spacings: f64) -> f64 {
    let mut scene = scene(spacings);
    scene.cuts.truncate(1);
    let long = CRACK[1] + ROOT * ARM;
    let toughness = 3.0 * energy(CRACK[1]) / (WIDTH * long);
    scene.bodies[0].material.toughness = Some(toughness);
    let mut torn = f64::NAN;
    let name = format!("torn cantilever, {spacings} across an arm");
    let row = run_with(&name, scene, Options::default(), |world| {
        let body = &world.bodies()[0];
        let vertices = body
            .cutting
            .iter()
            .flat_map(|cutting| cutting.cuts.surface().0);
        let end = vertices.map(|at| at.x).fold(f64::NEG_INFINITY, f64::max);
        let long = end + 0.5 * LENGTH + ROOT * ARM;
        torn = 3.0 * body.motion().audit().elastic / (WIDTH * long) / toughness;
    });
    if row.ended { torn } else { f64::NAN }
}

/// Energy release rate at the end of a crack (m) by the stress around it, over that of the load.
fn rate(world: &World, crack: f64) -> f64 {
    let body = &world.bodies()[0];
    let front = CrackFront {
        at: DVec3::X * (crack - 0.5 * LENGTH),
        ahead: DVec3::X,
        along: DVec3::Y,
    };
    let inside = |x| body.solid.contains(x);
    let found = body
        .elastic()
        .energy_release_rate(&front, FRONT * body.spacing, inside);
    // G = 3 P δ / (2 b A), P = 2 U / δ.
    let stored = body.motion().audit().elastic;
    found / (3.0 * stored / (WIDTH * (crack + ROOT * ARM)))
}

/// What exceeds a limit, in words.
pub fn breaches(finding: &Finding) -> Vec<String> {
    let mut found = Vec::new();
    let row = &finding.row;
    if !row.ended {
        found.push(format!("{}: does not end: {}", row.scene, row.error));
    }
    if finding.ratio.is_nan() || (finding.ratio - 1.0).abs() > DEVIATION {
        found.push(format!(
            "{}: releases {:.3} of the energy release rate",
            row.scene, finding.ratio
        ));
    }
    for (what, ratio) in [
        ("the stress there says", finding.by_domain),
        ("a tear ends at", finding.torn),
    ] {
        if ratio.is_nan() || (ratio - 1.0).abs() > BY_DOMAIN {
            found.push(format!(
                "{}: {what} {ratio:.3} of the energy release rate",
                row.scene
            ));
        }
    }
    // Round-off of sums over the body.
    if row.added > 1e-9 {
        found.push(format!(
            "{}: an update adds {:.1e} of what is stored, at step {} of {}",
            row.scene, row.added, row.added_at, row.steps
        ));
    }
    found
}
