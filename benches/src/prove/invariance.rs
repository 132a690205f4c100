//! What a cut releases does not depend on where the scene lies, how it is turned or mirrored, and in which units it is given; and
//! little on samples of blades, steps and nodes.

use glam::{DMat3, DQuat, DVec3};
use phyxel::scene::{
    Body, Capture, Cut, Gravity, Key, Region, Rest, Scene, Settle, Shape, Support, Target,
};
use phyxel::{Cutting, World};

use super::Proof;

/// How a scene is given: lengths times `scale`, then `turn`, which may mirror, then `shift` (m); node spacings between samples of the
/// blade, fraction of the stable step, nodes.
#[derive(Clone, Copy)]
struct Given {
    turn: DMat3,
    shift: DVec3,
    scale: f64,
    capture: f64,
    step: f64,
    nodes: u32,
}

const PLAIN: Given = Given {
    turn: DMat3::IDENTITY,
    shift: DVec3::ZERO,
    scale: 1.0,
    capture: 0.15,
    step: 0.6,
    nodes: 400,
};

/// Scene time (s) at which the block hangs still again.
const REST: f64 = 1.2;

impl Given {
    /// A block that hangs by its top and is cut half through. Lengths s times as large at the same times: g is s times, E is s
    /// squared times as large.
    fn scene(&self) -> Scene {
        let Self {
            turn, shift, scale, ..
        } = *self;
        let along = |way: DVec3| turn * (way * scale);
        let size = DVec3::new(0.06, 0.05, 0.12) * scale;
        let mut body = Body::new(Shape::Box { size });
        body.position = shift;
        // The nodes are those of the block that is not mirrored.
        if turn.determinant() > 0.0 {
            let (axis, angle) = DQuat::from_mat3(&turn).to_axis_angle();
            body.rotation = axis * angle.to_degrees();
        }
        body.sampling.target = Target::Nodes(self.nodes);
        body.material.youngs_modulus = 1e4 * scale * scale;
        body.material.poissons_ratio = 0.4;
        body.damping = 12.0;
        let mut scene = Scene::new("invariance", vec![body]);
        scene.supports.push(Support::fixed(Region::HalfSpace {
            point: along(DVec3::Z * 0.0599) + shift,
            normal: turn * DVec3::Z,
        }));
        scene.gravity = Some(Gravity {
            acceleration: along(DVec3::NEG_Z * 9.81),
            ..Gravity::default()
        });
        let key = |time: f64, x: f64, z: f64| Key::new(time, along(DVec3::new(x, 0.0, z)) + shift);
        let edge = [-0.04, 0.04].map(|y| along(DVec3::Y * y));
        let path = vec![key(0.02, -0.05, 0.0153), key(0.5, 0.0021, 0.0112)];
        scene.cuts.push(Cut {
            capture: Capture::Spacing(self.capture),
            ..Cut::new(edge.to_vec(), path)
        });
        scene.integration.step_factor = self.step;
        scene.integration.duration = REST;
        scene.integration.settle = Some(Settle {
            rest: Rest::Equilibrium,
            ..Settle::default()
        });
        scene
    }

    /// Energy that the cut released or that was damped (J, at the plain scale), and severed pairs.
    fn released(&self) -> (f64, usize) {
        let mut world = World::new(self.scene()).expect("it can be built");
        world.play(REST, |_| ()).expect("it ends");
        let body = &world.bodies()[0];
        let audit = body.motion().audit();
        let energy = audit.taken() - audit.energy_correction;
        let severed = body.cutting.as_ref().map_or(0, Cutting::severed_pairs);
        (energy / self.scale.powi(5), severed)
    }
}

/// What a case differs in, how it is given, and the most by which it may release more or less than the first.
type Case = (&'static str, Given, f64);

/// Each severs as many pairs as the first, but where nodes are others.
fn compare(proof: &mut Proof, first: Given, others: &[Case]) {
    let (energy, severed) = first.released();
    for (name, other, allowed) in others {
        let (found, pairs) = other.released();
        let what = format!(
            "{} nodes, {name}: released over that of {}",
            other.nodes, first.nodes
        );
        proof.within(what, found / energy, 1.0, *allowed);
        if other.nodes == first.nodes {
            let more = (pairs as f64 - severed as f64) / severed as f64;
            proof.within(
                format!("severed pairs over {severed}, less 1"),
                more,
                0.0,
                0.02,
            );
        }
    }
}

/// Samples and steps decide how the tissue lies when the blade comes, and so where in it the cut ends.
pub(super) fn invariance(proof: &mut Proof) {
    let slant = DVec3::new(0.6, 0.0, 0.8);
    for nodes in [400, 500, 1600, 3000, 12_000] {
        let plain = Given { nodes, ..PLAIN };
        let turned = |axis: DVec3, degrees: f64| Given {
            turn: DMat3::from_axis_angle(axis, degrees.to_radians()),
            ..plain
        };
        let mirrored = |axis: DVec3| Given {
            turn: DMat3::from_diagonal(1.0 - 2.0 * axis),
            ..plain
        };
        let far = Given {
            shift: DVec3::new(1000.0, -700.0, 400.0),
            ..plain
        };
        let millimetres = Given {
            scale: 1e3,
            ..plain
        };
        let capture = |capture: f64| Given { capture, ..plain };
        let step = |step: f64| Given { step, ..plain };
        let mut others = vec![("1 km away", far, 5e-3)];
        if nodes == 500 {
            others.push(("capture 0.05", capture(0.05), 0.05));
            others.push(("capture 0.1", capture(0.1), 0.05));
        } else {
            others.push(("capture 0.3", capture(0.3), 0.05));
        }
        if nodes == 1600 {
            others.push(("capture 0.2", capture(0.2), 0.05));
        }
        if nodes == 400 || nodes == 3000 {
            others.extend([
                ("17 degrees at a slant", turned(slant, 17.0), 5e-3),
                ("mirrored along z", mirrored(DVec3::Z), 5e-3),
            ]);
        }
        if nodes == 400 {
            others.extend([
                ("90 degrees about x", turned(DVec3::X, 90.0), 5e-3),
                ("90 degrees about z", turned(DVec3::Z, 90.0), 5e-3),
                ("mirrored along x", mirrored(DVec3::X), 5e-3),
                ("millimetres", millimetres, 5e-3),
                ("capture 0.05", capture(0.05), 0.05),
                ("step factor 0.1", step(0.1), 0.05),
                ("step factor 0.8", step(0.8), 0.01),
            ]);
        }
        compare(proof, plain, &others);
    }
    let of = |nodes: u32| Given { nodes, ..PLAIN };
    let finer = [1600, 3000].map(|nodes| ("more", of(nodes), 0.05));
    compare(proof, of(800), &finer);
}
