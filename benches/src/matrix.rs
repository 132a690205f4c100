//! The matrix: the embedded bodies over node counts, stiffnesses and cuts, all with defaults.

use glam::DVec3;
use phyxel::scene::{Body, Capture, Cut, Integration, Key, MaterialSettings, Scene, Target};

use crate::batch::Case;
use crate::error::StudyError;
use crate::report::median;
use crate::row::{Bars, Row};

/// Node counts of the block; 2,192 are the scene's own, 10 mm apart.
pub const BLOCK_NODES: [u32; 6] = [500, 1408, BLOCK_SHIPPED, 3000, 4000, 5000];
const BLOCK_SHIPPED: u32 = 2192;
/// Node counts of the liver.
pub const LIVER_NODES: [u32; 3] = [1500, 3000, 6000];
/// Young's moduli (Pa) and Poisson's ratios of the second half.
pub const MODULI: [f64; 3] = [2e3, 6e3, 20e3];
/// See [`MODULI`].
pub const RATIOS: [f64; 3] = [0.3, 0.45, 0.49];
/// Share by which the energy released on the block may differ between node counts, from their median.
pub const RELEASED_SPREAD: f64 = 0.15;

/// A dozen scenes that take a minute together. Of those that are not among them, the liver of 6,000 nodes cut down its front and
/// blocks of 2 kPa still exceed limits.
pub const QUICK: [&str; 13] = [
    "block 500 through",
    "block 1408 shipped",
    "block 1408 through",
    "block 2192 through",
    "block 3000 shipped",
    "liver 1500 two",
    "liver 1500 uncut",
    "block 500 through E 6 nu 0.3",
    "block 500 through E 6 nu 0.49",
    "block 500 through E 20 nu 0.3",
    "block 500 through E 20 nu 0.45",
    "block 1408 through E 6 nu 0.49",
    "block 1408 through E 20 nu 0.3",
];

/// A kind of cuts: its name, and what makes them of the embedded scene's.
type Cuts = (&'static str, fn(&mut Scene));

/// Half through from both sides, as the scene has it, or through by the second cut.
const OF_BLOCK: [Cuts; 2] = [("shipped", |_| {}), ("through", through)];
/// The scene's incision and resection, one stroke down the whole front, or none.
const OF_LIVER: [Cuts; 3] = [
    ("two", |_| {}),
    ("front", front),
    ("uncut", |scene| scene.cuts.clear()),
];

/// Takes from a scene's bodies what they say of hourglass stabilization and damping, and pictures.
pub fn as_usual(scene: &mut Scene) {
    for body in &mut scene.bodies {
        let usual = Body::new(body.shape.clone());
        body.material.stabilization = MaterialSettings::default().stabilization;
        body.damping = usual.damping;
        body.damping_ratio = usual.damping_ratio;
    }
    scene.pictures = None;
}

/// The embedded scene `name` with nothing of its own against the defaults: hourglass stabilization, damping, how often
/// blades are captured and the steps' share of the stable limit are those of a scene in which nothing is said of them.
pub fn plain(name: &str) -> Result<Scene, StudyError> {
    let mut scene = phyxel_scene::embedded(name, &[])?;
    as_usual(&mut scene);
    for cut in &mut scene.cuts {
        cut.capture = Capture::default();
    }
    scene.tools.clear();
    scene.integration.step_factor = Integration::default().step_factor;
    Ok(scene)
}

fn through(scene: &mut Scene) {
    if let Some(end) = scene.cuts.last_mut().and_then(|cut| cut.path.last_mut()) {
        end.position.x = -0.07;
    }
}

fn front(scene: &mut Scene) {
    let key = |time: f64, z: f64| Key::new(time, DVec3::new(0.0, -0.02, z));
    // From side to side, 4 cm before the support: the whole front comes off.
    let edge = vec![DVec3::X * -0.15, DVec3::X * 0.15];
    scene.cuts = vec![Cut {
        name: "front".to_owned(),
        ..Cut::new(edge, vec![key(0.1, 0.1), key(1.9, -0.12)])
    }];
    scene.integration.duration = 2.6;
}

/// An embedded body of about `nodes` nodes with cuts of a kind: its case is named after all three.
fn case(body: &str, nodes: u32, (name, cut): Cuts) -> Result<Case, StudyError> {
    let mut scene = plain(body)?;
    if (body, nodes) != ("block", BLOCK_SHIPPED) {
        scene.bodies[0].sampling.target = Target::Nodes(nodes);
    }
    cut(&mut scene);
    let name = format!("{body} {nodes} {name}");
    Ok(Case { name, scene })
}

/// Every scene of the matrix.
pub fn cases() -> Result<Vec<Case>, StudyError> {
    let mut cases = Vec::new();
    let [block, liver] = [(&BLOCK_NODES[..], &OF_BLOCK[..]), (&LIVER_NODES, &OF_LIVER)];
    for (body, (counts, cuts)) in [("block", block), ("liver", liver)] {
        for &nodes in counts {
            for &cuts in cuts {
                cases.push(case(body, nodes, cuts)?);
            }
        }
    }
    for modulus in MODULI {
        for ratio in RATIOS {
            let (through, front) = (OF_BLOCK[1], OF_LIVER[1]);
            let blocks = [("block", 500, through), ("block", 1408, through)];
            for (body, nodes, cuts) in blocks.into_iter().chain([("liver", 1500, front)]) {
                let mut case = case(body, nodes, cuts)?;
                for body in &mut case.scene.bodies {
                    body.material.youngs_modulus = modulus;
                    body.material.poissons_ratio = ratio;
                }
                case.name += &format!(" E {} nu {ratio}", modulus / 1e3);
                cases.push(case);
            }
        }
    }
    Ok(cases)
}

/// What the row of a scene of [`cases`] must hold.
///
/// The step may shrink further, and nodes follow that carry no strain, where the stiffness is not the
/// scene's own; following deficient nodes are bounded in the embedded scenes.
pub fn bars(name: &str) -> Bars {
    let mut bars = Bars::ordinary();
    let of_scene = ["shipped", "two", "uncut"];
    if !of_scene.iter().any(|cuts| name.ends_with(cuts)) {
        bars.followers = 1.0;
    }
    if name.contains(" E ") {
        bars.shrink = f64::INFINITY;
    }
    bars
}

/// Rows of the block with its own stiffness that are cut alike.
fn alike<'a>(rows: &'a [Row], cuts: &str) -> Vec<&'a Row> {
    let of_cut = |row: &&Row| row.scene.starts_with("block") && row.scene.ends_with(cuts);
    rows.iter().filter(of_cut).collect()
}

/// What cuts of the block release per area (J/m²) over its node counts, in words: what updates and the decay of what they
/// carried over took, and that with what damping took of the motion since the first of them.
///
/// The first is a fraction of the second that depends on how fast the decay is, which follows the stiffest period.
pub fn set_free(rows: &[Row]) -> Vec<String> {
    let mut found = Vec::new();
    for cuts in ["shipped", "through"] {
        let rows = alike(rows, cuts);
        for (what, damping) in [("released", 0.0), ("released and damped", 1.0)] {
            let per_area = |row: &&Row| (row.released + damping * row.damped) / row.area;
            let per_area: Vec<f64> = rows.iter().map(per_area).collect();
            if let Some(median) = median(&per_area) {
                let off = |value: &f64| 1e2 * (value / median - 1.0);
                let words = per_area.iter();
                let words = words.map(|value| format!("{value:.1} ({:+.0} %)", off(value)));
                let words = words.collect::<Vec<_>>().join(", ");
                found.push(format!("block {cuts}: {what} per area (J/m2): {words}"));
            }
        }
    }
    found
}

/// What exceeds a limit, row by row and over the node counts of the block, in words.
pub fn breaches(rows: &[Row]) -> Vec<String> {
    let mut found = Row::all_breaches(rows, |row| bars(&row.scene));
    found.extend(spreads(rows, "releases", |row| row.released));
    // With what is or was damped: what updates and decay release is a fraction of it.
    let per_area = |row: &Row| (row.released + row.damped) / row.area;
    found.extend(spreads(rows, "released per area", per_area));
    found
}

/// Blocks farther than [`RELEASED_SPREAD`] from the median of those that are cut alike.
fn spreads(rows: &[Row], what: &str, energy: impl Fn(&Row) -> f64) -> Vec<String> {
    let mut found = Vec::new();
    for cuts in ["shipped", "through"] {
        let rows = alike(rows, cuts);
        let energies: Vec<f64> = rows.iter().map(|row| energy(row)).collect();
        let Some(median) = median(&energies) else {
            continue;
        };
        for (row, energy) in rows.iter().zip(energies) {
            let off = energy / median - 1.0;
            if off.is_nan() || off.abs() > RELEASED_SPREAD {
                let off = format!("{:+.0} % off the median {median:.3e}", 1e2 * off);
                found.push(format!("{}: {what} {off} of its node counts", row.scene));
            }
        }
    }
    found
}
