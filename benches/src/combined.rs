//! What scenes can say beside blocks and livers, their stiffness and their cuts: shapes, samplings, laws, supports that
//! move, tools, contact, schemes.

use std::f64::consts::TAU;

use glam::DVec3;
use phyxel::scene::{
    Body, BodyContact, Capture, Cut, Form, Inclusion, Key, Refinement, Region, Release, Rest,
    Scene, Scheme, Shape, SupportMotion, Tool, ToolShape,
};
use phyxel_elastic::{Dilatation, Fiber, Model, PronyTerm};
use testkit::cloud::Random;

use crate::error::StudyError;
use crate::organs::{folder, meshes, tissue};

/// Largest load `ρ g L / E`: beyond, weight crushes what it stands on, whatever else a scene says.
const LOAD: f64 = 0.5;

/// A mesh that is refused with fewer than 20,000 nodes: its wall is thinner than they are apart.
const THIN: &str = "small_intestine_100k.vtk";

pub(crate) fn between_log(random: &mut Random, [low, high]: [f64; 2]) -> f64 {
    random.range(low.ln(), high.ln()).exp()
}

/// Uniform on the unit sphere.
pub(crate) fn direction(random: &mut Random) -> DVec3 {
    let z = random.range(-1.0, 1.0);
    let (angle, r) = (random.range(0.0, TAU), (1.0 - z * z).sqrt());
    DVec3::new(r * angle.cos(), r * angle.sin(), z)
}

/// A body about the origin, held at one of its ends: half extents (m) and fixed region beside it.
pub(crate) fn body(random: &mut Random) -> Result<(Body, DVec3, Region), StudyError> {
    let half = DVec3::from_array([0.0; 3].map(|_: f64| random.range(0.03, 0.08)));
    let (from, to) = (DVec3::Z * -half.z, DVec3::Z * half.z);
    let radius = half.x.min(half.y);
    let mut position = DVec3::ZERO;
    let round = DVec3::new(radius, radius, half.z);
    let mut files = folder().map_or(Ok(Vec::new()), |folder| meshes(&folder))?;
    files.retain(|file| !file.ends_with(THIN));
    let (shape, half) = match (random.bits() % 4, files.as_slice()) {
        (0, _) | (3, []) => (Shape::Ellipsoid { radii: half }, half),
        (1, _) => {
            let half = round + DVec3::Z * radius;
            (Shape::Capsule { from, to, radius }, half)
        }
        (2, _) => {
            let inner_radius = radius * random.range(0.3, 0.6);
            let tube = Shape::Tube {
                from,
                to,
                inner_radius,
                outer_radius: radius,
            };
            (tube, round)
        }
        (_, files) => {
            let (mut shape, bounds) = tissue(&files[random.below(files.len())])?;
            let by = random.range(0.08, 0.16) / bounds.size().max_element();
            if let Shape::Mesh { scale, .. } = &mut shape {
                *scale *= by;
            }
            position = -by * bounds.center();
            (shape, 0.5 * by * bounds.size())
        }
    };
    let mut body = Body::new(shape);
    body.position = position;
    let region = Region::HalfSpace {
        point: DVec3::Z * (0.75 * half.z),
        normal: DVec3::Z,
    };
    Ok((body, half, region))
}

/// All else that a scene with one body of such half extents (m) can say.
pub(crate) fn combine(random: &mut Random, half: DVec3, scene: &mut Scene) {
    law(random, half, &mut scene.bodies[0]);
    sampling(random, half, &mut scene.bodies[0]);
    blades(random, scene);
    let end = scene.integration.duration;
    if random.chance(0.25) {
        let path = there_and_back(random, end, 0.15 * half.min_element(), 15.0, DVec3::ZERO);
        scene.supports[0].motion = SupportMotion::Driven { path };
    }
    let step = between_log(random, [1e-3, 2e-2]);
    let tolerance = Scheme::default_tolerance();
    scene.integration.scheme = match random.bits() % 10 {
        0..6 => Scheme::VelocityVerlet,
        6 => Scheme::SymplecticEuler,
        7 => Scheme::BackwardEuler { step, tolerance },
        _ => Scheme::EnergyMomentum { step, tolerance },
    };
    let explicit = scene.integration.scheme.step().is_none();
    if !explicit {
        // A second of theirs takes several times as long, and a scene has 300 s of processor time.
        scene.cuts.truncate(1);
        scene.integration.duration = scene.cuts.last().map_or(0.5, Cut::end) + 0.4;
    }
    let end = scene.integration.duration;
    if random.chance(0.3) {
        scene.integration.step_factor = random.range(0.3, 0.8);
    }
    if explicit && random.chance(0.2) {
        scene.bodies[0].damping_ratio = random.range(0.05, 0.5);
    }
    scene.bodies[0].damping = between_log(random, [0.2, 10.0]);
    if random.chance(0.35) {
        scene.tools.push(tool(random, half, end, explicit));
    }
    match &mut scene.integration.settle {
        settle if random.chance(0.15) => *settle = None,
        Some(settle) if scene.tools.is_empty() && random.chance(0.25) => {
            settle.rest = Rest::Equilibrium;
        }
        _ => {}
    }
    if explicit && random.chance(0.25) {
        scene.contact = Some(BodyContact {
            friction: random.range(0.0, 0.8),
            ..BodyContact::default()
        });
    }
    let body = &scene.bodies[0];
    if let Some(gravity) = &mut scene.gravity {
        let weight =
            body.material.density * 2.0 * half.max_element() / body.material.youngs_modulus;
        gravity.acceleration = gravity.acceleration.clamp_length_max(LOAD / weight);
        gravity.ramp = random.range(0.0, 0.3);
    }
}

fn law(random: &mut Random, half: DVec3, body: &mut Body) {
    let material = &mut body.material;
    let (modulus, ratio) = (material.youngs_modulus, material.poissons_ratio);
    material.model = match random.bits() % 8 {
        0 => Model::NeoHookean,
        1 => Model::SaintVenantKirchhoff,
        2 => Model::MooneyRivlin {
            share: random.range(0.0, (ratio / (1.0 - 2.0 * ratio)).min(0.5)),
        },
        _ => Model::StableNeoHookean,
    };
    if random.chance(0.2) && material.model != Model::SaintVenantKirchhoff {
        material.dilatation = Dilatation::Mean;
    }
    if random.chance(0.1) {
        material.volume_constant = modulus * between_log(random, [0.1, 10.0]);
    }
    if random.chance(0.25) {
        material.fiber = Some(Fiber {
            direction: direction(random),
            stiffness: modulus * between_log(random, [0.1, 3.0]),
            exponent: random.range(0.5, 4.0),
            dispersion: random.range(0.0, 0.3),
        });
    }
    let terms = random.chance(0.3).then(|| 1 + random.bits() % 2);
    for _ in 0..terms.unwrap_or(0) {
        material.viscosity.push(PronyTerm {
            ratio: between_log(random, [0.05, 2.0]),
            relaxation_time: between_log(random, [1e-3, 10.0]),
        });
    }
    if random.chance(0.2) {
        material.toughness = Some(between_log(random, [1.0, 300.0]));
    }
    if random.chance(0.25) {
        let center = half * random.vector(0.5);
        let radius = half.min_element() * random.range(0.4, 0.9);
        body.inclusions.push(Inclusion {
            region: Region::Sphere { center, radius },
            youngs_modulus: Some(modulus * between_log(random, [0.1, 10.0])),
            poissons_ratio: random.chance(0.5).then(|| random.range(0.3, 0.49)),
            density: random.chance(0.3).then(|| random.range(900.0, 1300.0)),
            fiber: None,
        });
    }
}

fn sampling(random: &mut Random, half: DVec3, body: &mut Body) {
    let sampling = &mut body.sampling;
    if random.chance(0.1) {
        sampling.form = Form::Points;
    }
    if random.chance(0.2) {
        sampling.coarsest = random.range(1.5, 4.0);
    }
    if random.chance(0.2) {
        let from = half * random.vector(0.6);
        sampling.refine.push(Refinement {
            from,
            to: from + 0.5 * half * direction(random),
            radius: random.range(0.2, 0.5) * half.min_element(),
            factor: random.range(0.25, 0.9),
        });
    }
}

/// Bends the blades' edges and captures them more or less often; some scenes have none.
fn blades(random: &mut Random, scene: &mut Scene) {
    if random.chance(0.1) {
        scene.cuts.clear();
    }
    for cut in &mut scene.cuts {
        if random.chance(0.4) {
            let way = cut.edge[0].distance(cut.edge[1]);
            let bend = direction(random) * (way * random.range(0.0, 0.2));
            cut.edge.insert(1, cut.edge[0].midpoint(cut.edge[1]) + bend);
        }
        if random.chance(0.3) {
            cut.capture = Capture::Spacing(between_log(random, [0.05, 0.3]));
        }
    }
}

/// Keys of a way (m) and turn (degrees) from a place and back, in a time (s).
fn there_and_back(random: &mut Random, end: f64, way: f64, turn: f64, from: DVec3) -> Vec<Key> {
    let to = from + direction(random) * random.range(0.0, way);
    let rotation = direction(random) * random.range(0.0, turn);
    let key = |time, position, rotation| Key {
        time,
        position,
        rotation,
    };
    let middle = end * random.range(0.4, 0.6);
    vec![
        key(0.0, from, DVec3::ZERO),
        key(middle, to, rotation),
        key(end, from, DVec3::ZERO),
    ]
}

/// A ball or rod that is pushed into the body from below and drawn out again, or one that is let go beside it.
fn tool(random: &mut Random, half: DVec3, end: f64, released: bool) -> Tool {
    let radius = half.min_element() * random.range(0.2, 0.5);
    let shape = if random.chance(0.5) {
        ToolShape::Sphere { radius }
    } else {
        let along = DVec3::Y * (0.5 * half.y);
        ToolShape::Capsule {
            from: -along,
            to: along,
            radius,
        }
    };
    // Clear of the body at first; its box reaches as far as its half extents.
    let side = -direction(random).abs();
    let outside = side * (half.length() + radius);
    if released && random.chance(0.3) {
        let mut tool = Tool::new(shape, vec![Key::new(0.0, outside)]);
        tool.friction = random.range(0.0, 0.8);
        tool.release = Some(Release {
            mass: between_log(random, [0.01, 0.2]),
            force: -side * random.range(0.0, 0.5),
            damping: random.range(0.0, 5.0),
        });
        return tool;
    }
    let mut path = there_and_back(random, end, 0.0, 0.0, outside);
    path[1].position = side * (half.min_element() + radius) * random.range(0.8, 1.1);
    let mut tool = Tool::new(shape, path);
    tool.friction = random.range(0.0, 0.8);
    tool.scale = random.range(0.8, 1.2);
    tool
}
