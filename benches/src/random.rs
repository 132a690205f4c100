//! Scenes from a seeded generator: what nobody tuned for.

use glam::DVec3;
use phyxel::scene::{Body, Cut, Gravity, Key, Region, Scene, Shape, Support, Target};
use testkit::cloud::Random;

use crate::batch::Case;
use crate::combined::{self, between_log, direction};
use crate::error::StudyError;
use crate::row::Row;

/// Bounds of the generator: nodes, E (Pa), ν, gravity (m/s²), speed of a blade (m/s).
const NODES: [f64; 2] = [400.0, 2000.0];
const MODULUS: [f64; 2] = [500.0, 1e6];
const RATIO: [f64; 2] = [0.3, 0.49];
const GRAVITY: [f64; 2] = [0.0, 20.0];
const SPEED: [f64; 2] = [0.1, 1.0];
/// Nodes of scenes that may say all: contact and viscosity take several times as long as elasticity.
const NODES_OF_ALL: [f64; 2] = [400.0, 1200.0];
/// Largest turn (degrees) of a blade from its first key to its last.
const TURN: f64 = 60.0;
/// Strokes of a scene.
const STROKES: u32 = 3;
/// Loads `ρ g L / E` that bound the classes of the summary.
pub const CLASSES: [f64; 3] = [0.1, 0.5, f64::INFINITY];
/// Least fraction of the scenes of each class that ends.
pub const ENDING: [f64; 3] = [1.0, 0.98, 0.0];
/// Most energy that the updates of a stroke may add, over what is stored.
pub const ADDED_BY_STROKE: f64 = 0.01;

/// Most energy that the audit may leave unexplained at the end, over what is stored or was damped.
pub const UNEXPLAINED: f64 = 0.01;

/// `count` scenes of a seed. A scene depends on the seed and on its own number alone, and on the folder of meshes if it
/// may say `all` that scenes can say.
///
/// # Errors
/// If the generator makes a scene that is not valid; those of meshes.
pub fn cases(seed: u64, count: u32, all: bool) -> Result<Vec<Case>, StudyError> {
    let numbers = 0..count;
    numbers
        .map(|number| {
            let mut random = Random::new(Random::new(seed).bits() ^ u64::from(number));
            let kind = if all { "all" } else { "random" };
            let name = format!("{kind}-{seed}-{number:03}");
            let mut scene = scene(&mut random, all)?;
            scene.name.clone_from(&name);
            // Read back, so that what is run is valid.
            let scene = phyxel_scene::from_text(&phyxel_scene::to_ron(&scene), &name, "", &[])?;
            Ok(Case { name, scene })
        })
        .collect()
}

fn scene(random: &mut Random, all: bool) -> Result<Scene, StudyError> {
    let (mut body, half, region) = if all && random.unit() < 0.6 {
        combined::body(random)?
    } else if random.unit() < 0.5 {
        block(random)
    } else {
        liver(random)
    };
    let nodes = between_log(random, if all { NODES_OF_ALL } else { NODES }) as u32;
    body.sampling.target = match body.shape {
        // Not every number has a lattice. A body-centred one, with its faces, has some 2.1 nodes for each cube of a spacing.
        Shape::Box { size } if all => {
            Target::Spacing((2.1 * size.element_product() / f64::from(nodes)).cbrt())
        }
        _ => Target::Nodes(nodes),
    };
    body.material.youngs_modulus = between_log(random, MODULUS);
    body.material.poissons_ratio = random.range(RATIO[0], RATIO[1]);
    let mut scene = Scene::new("random", vec![body]);
    scene.supports.push(Support::fixed(region));
    scene.gravity = Some(Gravity {
        acceleration: direction(random) * random.range(GRAVITY[0], GRAVITY[1]),
        ..Gravity::default()
    });
    let mut time = 0.1;
    for number in 0..STROKES {
        let cut = stroke(random, number, half, time);
        time = cut.end() + 0.1;
        scene.cuts.push(cut);
    }
    scene.integration.duration = time + 0.3;
    if all {
        combined::combine(random, half, &mut scene);
        let sampling = &mut scene.bodies[0].sampling;
        if sampling.coarsest >= 2.0 || !sampling.refine.is_empty() {
            sampling.target = Target::Nodes(nodes);
        }
    }
    Ok(scene)
}

/// A box held by one of its faces: body, half extents (m), fixed region.
fn block(random: &mut Random) -> (Body, DVec3, Region) {
    let half = DVec3::from_array([0.0; 3].map(|_: f64| random.range(0.02, 0.1)));
    let axis = (random.bits() % 3) as usize;
    let side = if random.unit() < 0.5 { 1.0 } else { -1.0 };
    let mut normal = DVec3::ZERO;
    normal[axis] = side;
    let region = Region::HalfSpace {
        point: normal * (0.995 * half[axis]),
        normal,
    };
    (Body::new(Shape::Box { size: 2.0 * half }), half, region)
}

/// The liver held as in the embedded scene.
fn liver(random: &mut Random) -> (Body, DVec3, Region) {
    let width = random.range(0.1, 0.2);
    let scale = width / 0.166;
    let region = Region::Box {
        min: DVec3::new(-1.0, 0.02 * scale, -1.0),
        max: DVec3::new(0.035 * scale, 1.0, 1.0),
    };
    // Half of the organ's box.
    let half = DVec3::new(0.5, 0.35, 0.4) * width;
    (Body::new(Shape::Liver { width }), half, region)
}

/// A stroke that begins outside, passes a position in the body and ends inside or beyond it, while the
/// blade turns.
fn stroke(random: &mut Random, number: u32, half: DVec3, start: f64) -> Cut {
    let radius = half.length();
    let through = half * random.vector(0.7);
    let along = direction(random);
    let across = along
        .cross(direction(random))
        .normalize_or(along.any_orthonormal_vector());
    let reach = radius * random.range(0.3, 1.2);
    let from = through - along * (1.3 * radius);
    let to = through + along * (radius * random.range(0.1, 1.3));
    let speed = between_log(random, SPEED);
    let turn = direction(random) * random.range(0.0, TURN);
    let bent = direction(random) * random.range(0.0, 0.5 * TURN);
    let duration = from.distance(to) / speed;
    let key = |share: f64, rotation: DVec3| Key {
        time: start + share * duration,
        position: from.lerp(to, share),
        rotation,
    };
    let path = vec![key(0.0, DVec3::ZERO), key(0.5, bent), key(1.0, turn)];
    Cut {
        name: format!("stroke {number}"),
        ..Cut::new(vec![across * -reach, across * reach], path)
    }
}

/// What became of the scenes of one class of load.
#[derive(Debug)]
pub struct Class {
    /// Loads `ρ g L / E` below this.
    below: f64,
    scenes: usize,
    ended: usize,
    /// All that is known of them, in words; worst are those that ended, calm those of them in which no stroke added more
    /// than it may.
    pub words: String,
}

/// Rows by class of load.
pub fn summary(rows: &[Row]) -> Vec<Class> {
    let mut from = 0.0;
    let classes = CLASSES.iter().map(|&below| {
        let of_class = |row: &&Row| row.load >= from && row.load < below;
        let rows: Vec<&Row> = rows.iter().filter(of_class).collect();
        from = below;
        let all: Vec<&Row> = rows.iter().filter(|row| row.ended).copied().collect();
        let (scenes, ended) = (rows.len(), all.len());
        let calm = all.iter().filter(|row| is_calm(row)).count();
        let worst = |of: fn(&Row) -> f64| all.iter().map(|row| of(row)).fold(0.0, f64::max);
        let words = format!(
            "rho g L / E below {below:<4} {scenes:>3} scenes, {ended:>3} end, {calm:>3} of them calm; worst added by a \
             stroke {:.1e}, energy-balance error {:.1e}, shrink {:.1}",
            worst(|row| row.added_by_stroke),
            worst(|row| row.imbalance),
            worst(|row| row.shrink)
        );
        Class {
            below,
            scenes,
            ended,
            words,
        }
    });
    classes.collect()
}

fn is_calm(row: &Row) -> bool {
    row.ended && row.added_by_stroke <= ADDED_BY_STROKE
}

/// What exceeds a limit, in words.
pub fn breaches(rows: &[Row]) -> Vec<String> {
    let mut found = Vec::new();
    for row in rows {
        let what = if !row.ended {
            row.error.clone()
        } else if !is_calm(row) {
            format!("a stroke adds {:.3} of what is stored", row.added_by_stroke)
        } else if row.imbalance > UNEXPLAINED {
            format!("{:.3} of its energy is unexplained", row.imbalance)
        } else {
            continue;
        };
        found.push(format!("{}: load {:.3}: {what}", row.scene, row.load));
    }
    for (class, least) in summary(rows).iter().zip(ENDING) {
        if (class.ended as f64) < least * class.scenes as f64 {
            found.push(format!(
                "loads below {}: {} of {} end",
                class.below, class.ended, class.scenes
            ));
        }
    }
    found
}
