//! What a cut releases does not depend on where the scene lies, how it is turned or mirrored, and in which units it is given.

use glam::{DMat3, DQuat, DVec3};
use phyxel::scene::{Body, Cut, Gravity, Key, Region, Rest, Scene, Settle, Shape, Support, Target};
use phyxel::{Cutting, World};

/// How a scene is given: lengths times `scale`, then `turn`, which may mirror, then `shift` (m).
struct Given {
    turn: DMat3,
    shift: DVec3,
    scale: f64,
}

/// Scene time (s) at which the block hangs still again.
const REST: f64 = 1.2;

impl Given {
    /// A block that hangs by its top and is cut half through. Lengths s times as large at the same times: g is s times, E is s
    /// squared times as large.
    fn scene(&self) -> Scene {
        let Self { turn, shift, scale } = *self;
        let along = |way: DVec3| turn * (way * scale);
        let size = DVec3::new(0.06, 0.05, 0.12) * scale;
        let mut body = Body::new(Shape::Box { size });
        body.position = shift;
        // The nodes are those of the block that is not mirrored.
        if turn.determinant() > 0.0 {
            let (axis, angle) = DQuat::from_mat3(&turn).to_axis_angle();
            body.rotation = axis * angle.to_degrees();
        }
        body.sampling.target = Target::Nodes(400);
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
        scene.cuts.push(Cut::new(edge.to_vec(), path));
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
        let audit = body.motion.audit();
        let energy = audit.taken() - audit.energy_correction;
        let severed = body.cutting.as_ref().map_or(0, Cutting::severed_pairs);
        (energy / self.scale.powi(5), severed)
    }
}

/// The most seen is 0.0022, of 1 km and of what is mirrored along z, and no pair.
#[test]
fn what_a_cut_releases_does_not_depend_on_how_a_scene_is_given() {
    let about = |axis: DVec3, degrees: f64| DMat3::from_axis_angle(axis, degrees.to_radians());
    let mirror = |axis: DVec3| DMat3::from_diagonal(1.0 - 2.0 * axis);
    let plain = (DMat3::IDENTITY, DVec3::ZERO, 1.0);
    let given = |(turn, shift, scale)| Given { turn, shift, scale }.released();
    let (energy, severed) = given(plain);
    let (_, shift, scale) = plain;
    for (name, other) in [
        ("90 degrees about x", (about(DVec3::X, 90.0), shift, scale)),
        ("90 degrees about z", (about(DVec3::Z, 90.0), shift, scale)),
        (
            "17 degrees about an axis at a slant",
            (about(DVec3::new(0.6, 0.0, 0.8), 17.0), shift, scale),
        ),
        ("mirrored along x", (mirror(DVec3::X), shift, scale)),
        ("mirrored along z", (mirror(DVec3::Z), shift, scale)),
        (
            "1 km away",
            (plain.0, DVec3::new(1000.0, -700.0, 400.0), scale),
        ),
        ("in millimetres", (plain.0, shift, 1e3)),
    ] {
        let (found, pairs) = given(other);
        assert_eq!(pairs, severed, "{name}: pairs");
        let off = found / energy - 1.0;
        assert!(off.abs() < 0.01, "{name}: released {off:+.4} more");
    }
}
