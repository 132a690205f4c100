//! Worlds that a program makes and plays, without files.

use glam::DVec3;
use phyxel::scene::{
    Body, Cut, Key, Region, Rest, Scene, Settle, Shape, Support, Target, Tool, ToolShape,
};
use phyxel::{World, WorldError};

/// A small block that hangs from its top.
fn hanging(limit: f64) -> Scene {
    let mut body = Body::new(Shape::Box {
        size: DVec3::new(0.03, 0.03, 0.06),
    });
    body.sampling.target = Target::Nodes(200);
    body.material.youngs_modulus = 2e4;
    let mut scene = Scene::new("hanging", vec![body]);
    scene.supports.push(Support::fixed(Region::HalfSpace {
        point: DVec3::Z * 0.0299,
        normal: DVec3::Z,
    }));
    scene.integration.settle = Some(Settle {
        limit,
        ..Settle::default()
    });
    scene
}

fn lowest(world: &World) -> f64 {
    let positions = world.bodies()[0].motion().positions();
    positions.iter().map(|x| x.z).fold(f64::INFINITY, f64::min)
}

/// A world that is stepped and never started used to continue for ever without its cuts.
#[test]
fn a_scene_that_nobody_starts_is_an_error() {
    let mut world = World::new(hanging(0.02)).expect("it can be built");
    let error = loop {
        if let Err(error) = world.step() {
            break error;
        }
        assert!(world.time() < 0.1, "it settles for ever");
    };
    assert!(matches!(error, WorldError::NeverStarted { limit } if (limit - 0.02).abs() < 1e-12));
    assert!(error.to_string().contains("World::settle"), "{error}");
    assert!(
        !world.settle().expect("it starts"),
        "it had no time to come to rest"
    );
    world.step().expect("it plays");
    assert!(world.scene_time().is_some_and(|time| time > 0.0));
}

#[test]
fn play_settles_once_and_shows_every_step_of_the_scene() {
    let mut world = World::new(hanging(2.0)).expect("it can be built");
    let mut times = Vec::new();
    let mut see = |world: &World| times.push(world.scene_time().expect("it has started"));
    world.play(0.05, &mut see).expect("it plays");
    let settled = world.time();
    world.play(0.1, &mut see).expect("it continues");
    assert!(world.time() - settled < 0.06, "it settled twice");
    assert!(times.is_sorted() && times[0] > 0.0 && times.len() > 20);
    assert!(*times.last().expect("steps") >= 0.1);
    // rho g L^2 / 2 E = 0.94 mm for a slender bar.
    let sunk = -0.03 - lowest(&world);
    assert!((0.6e-3..1.2e-3).contains(&sunk), "{sunk}");
    assert!(world.settle().expect("nothing is left to do"));
}

#[test]
fn settling_by_equilibrium_and_by_motion_end_alike() {
    let mut at_once = hanging(2.0);
    at_once.integration.settle = Some(Settle {
        rest: Rest::Equilibrium,
        ..Settle::default()
    });
    let ends = [at_once, hanging(2.0)].map(|scene| {
        let mut world = World::new(scene).expect("it can be built");
        assert!(world.settle().expect("it settles"), "it comes to rest");
        lowest(&world)
    });
    assert!((ends[0] - ends[1]).abs() < 0.1e-3, "{ends:?}");
}

/// What a program writes is checked as a file is, all of it at once.
#[test]
fn a_world_refuses_a_scene_that_is_not_valid() {
    let mut scene = hanging(1.0);
    scene.bodies[0].material.density = -1.0;
    scene.cuts.push(Cut::new(vec![DVec3::ZERO], vec![]));
    let path = vec![Key::new(0.0, DVec3::NAN)];
    scene
        .tools
        .push(Tool::new(ToolShape::Sphere { radius: 0.01 }, path));
    type Mend = (&'static str, fn(&mut Scene));
    let mends: [Mend; 4] = [
        ("bodies[0].material.density", |scene| {
            scene.bodies[0].material.density = 1000.0;
        }),
        ("tools[0].path[0].position", |scene| scene.tools.clear()),
        ("cuts[0].edge", |scene| scene.cuts[0].edge.push(DVec3::X)),
        ("cuts[0].path", |scene| scene.cuts.clear()),
    ];
    for (path, mend) in mends {
        let Err(WorldError::Scene { fault, .. }) = World::new(scene.clone()) else {
            panic!("it is refused as a scene");
        };
        assert_eq!(fault.path, path, "{fault}");
        mend(&mut scene);
    }
    scene.validate().expect("nothing is left");
}
