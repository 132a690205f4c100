//! A column that is thrown into a twist and swings back: rotations of more than a full turn without
//! energy lost or won.
//!
//! The column of Bonet 2015: 1 m × 1 m × 6 m, its foot fixed,
//! `v = ω sin(π z / 12) ẑ × x`. There is no closed form; what is asked for is the energy, upright
//! nodes, and the same twist from two node counts.

use std::f64::consts::PI;

use glam::DVec3;
use phyxel::World;
use phyxel::scene::{Body, Region, Sampling, Scene, Shape, Support, SupportMotion, Target};
use serde::Serialize;

use crate::error::StudyError;
use crate::motion::with_velocities;

const HEIGHT: f64 = 6.0;
/// Rate of twist (rad/s).
const RATE: f64 = 105.0;
const END: f64 = 0.25;
/// Largest fraction of the energy that the audit may leave unexplained.
pub const IMBALANCE: f64 = 0.01;

/// What was found at one fineness.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Nodes.
    pub nodes: usize,
    /// Largest twist of the top (degrees), from the first to the first return.
    pub twist: f64,
    /// Time (s) of it.
    pub at: f64,
    /// Smallest det F over every step.
    pub smallest_determinant: f64,
    /// Largest fraction of the energy that the audit left unexplained.
    pub imbalance: f64,
}

fn scene(nodes: u32) -> Result<Scene, StudyError> {
    let mut body = Body::new(Shape::Box {
        size: DVec3::new(1.0, 1.0, HEIGHT),
    });
    body.position = DVec3::Z * (0.5 * HEIGHT);
    body.sampling = Sampling {
        target: Target::Nodes(nodes),
        ..Sampling::default()
    };
    body.material.youngs_modulus = 17e6;
    body.material.poissons_ratio = 0.45;
    body.material.density = 1100.0;
    body.damping = 0.0;
    let mut scene = Scene::new("column", vec![body]);
    scene.gravity = None;
    scene.integration.settle = None;
    scene.integration.duration = END;
    scene.supports.push(Support {
        body: None,
        region: Region::HalfSpace {
            point: DVec3::Z * 1e-6,
            normal: -DVec3::Z,
        },
        motion: SupportMotion::Fixed,
    });
    Ok(phyxel_scene::from_text(
        &phyxel_scene::to_ron(&scene),
        "column",
        "",
        &[],
    )?)
}

/// Twists the column of about `nodes` nodes.
///
/// # Errors
/// [`StudyError::World`] if a step fails.
pub fn measure(nodes: u32) -> Result<Finding, StudyError> {
    let mut world = World::new(scene(nodes)?)?;
    with_velocities(&mut world, |x| {
        (DVec3::Z * (RATE * (PI * x.z / (2.0 * HEIGHT)).sin())).cross(x)
    })?;
    let rest = world.members()[0].body.rest.clone();
    let top: Vec<usize> = (0..rest.len())
        .filter(|&i| rest[i].z > HEIGHT - 1e-6 && rest[i].truncate().length() > 0.3)
        .collect();
    let initial = world.members()[0].body.motion.audit().initial;
    let (mut twist, mut last, mut turned) = ((0.0, 0.0), 0.0, 0.0);
    let (mut smallest, mut imbalance) = (f64::INFINITY, 0.0_f64);
    while world.scene_time().is_some_and(|time| time < END) {
        world.step()?;
        let body = &world.members()[0].body;
        let now = mean_turn(&top, &rest, body.motion.positions());
        // The smallest of the angles that differ by whole turns.
        turned += (now - last + PI).rem_euclid(2.0 * PI) - PI;
        last = now;
        if turned > twist.0 {
            twist = (turned, world.time());
        }
        let gradients = body.elastic.deformation_gradients().into_iter();
        smallest = gradients.map(|f| f.determinant()).fold(smallest, f64::min);
        imbalance = imbalance.max(body.motion.audit().energy_error().abs() / initial);
    }
    Ok(Finding {
        nodes: rest.len(),
        twist: twist.0.to_degrees(),
        at: twist.1,
        smallest_determinant: smallest,
        imbalance,
    })
}

/// Angle (rad) by which some nodes have turned about z, that of their summed moments.
fn mean_turn(nodes: &[usize], rest: &[DVec3], positions: &[DVec3]) -> f64 {
    let (mut sin, mut cos) = (0.0, 0.0);
    for &node in nodes {
        let (a, b) = (rest[node].truncate(), positions[node].truncate());
        sin += a.perp_dot(b);
        cos += a.dot(b);
    }
    sin.atan2(cos)
}

/// What exceeds a limit, in words.
#[must_use]
pub fn breaches(finding: &Finding) -> Vec<String> {
    let mut found = Vec::new();
    if finding.imbalance.is_nan() || finding.imbalance > IMBALANCE {
        found.push(format!(
            "column: {:.1e} of the energy unexplained",
            finding.imbalance
        ));
    }
    if finding.smallest_determinant.is_nan() || finding.smallest_determinant <= 0.0 {
        found.push(format!(
            "column: det F falls to {:.3}",
            finding.smallest_determinant
        ));
    }
    found
}
