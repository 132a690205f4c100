//! Hard cases of cutting.

use glam::DVec3;
use phyxel::World;
use phyxel_scene::{Override, embedded};
use testkit::cloud::Random;
use testkit::tol::assert_below;

use super::stage::*;

#[test]
fn slivers_part_a_block_as_one_cut_does() {
    let at = |heights: &[f64]| {
        let strokes = heights.iter().enumerate();
        let strokes: Vec<String> = strokes
            .map(|(k, z)| {
                let begin = 0.01 + 0.03 * k as f64;
                across(&k.to_string(), *z, [begin, begin + 0.02])
            })
            .collect();
        let mut world = cut(BLOCK, &strokes);
        play(&mut world, 0.15).expect("it runs");
        world
    };
    let (one, three) = (at(&[1e-3]), at(&[1e-3, 1.01e-3, 1.02e-3]));
    assert_eq!(pieces(&one).len(), 2);
    assert_eq!(pieces(&one), pieces(&three));
    assert_eq!(severed(&one), severed(&three));
    audit_closes(&three, 0.02);
}

/// A blade stops in the middle of a block that pulls apart: of little toughness it tears off; of more, or none given, it
/// hangs on.
#[test]
fn a_block_tears_from_where_the_blade_stopped() {
    let torn = |toughness: &str| {
        let body = BLOCK.replace(
            "youngs_modulus: 2e4",
            &format!("youngs_modulus: 2e3{toughness}"),
        );
        let (from, to) = (DVec3::X * -0.03, DVec3::X * -0.004);
        let edge = DVec3::Y * 0.08;
        let mut world = cut(&body, &[stroke("half", edge, from, to, [0.05, 0.15])]);
        play(&mut world, 0.4).expect("it runs");
        audit_closes(&world, 0.01);
        (pieces(&world), severed(&world))
    };
    let [given, tough, weak] = ["", ", toughness: 100", ", toughness: 1"].map(torn);
    assert_eq!((given.0.len(), &tough), (1, &given));
    let sizes = weak.0;
    assert!(sizes.len() == 2 && sizes[1] > 150, "{sizes:?}");
    assert!(weak.1 > given.1, "{} and {} pairs", weak.1, given.1);
}

/// A soft block that hangs stretched twofold narrows while it is cut, so that the blade's edge leaves it at its sides: nothing is left
/// there when it tears.
#[test]
fn a_block_that_narrows_tears_at_its_sides_too() {
    let changes = [
        "bodies[0].material.youngs_modulus=2000",
        "bodies[0].material.toughness=10",
        "pictures=None",
    ];
    let changes = changes.map(|change| Override::parse(change).expect("it is one"));
    let mut scene = embedded("block", &changes).expect("it is there");
    scene.cuts.truncate(1);
    scene.integration.duration = 0.9;
    let mut world = World::new(scene).expect("it is valid");
    world.play(0.9, |_| {}).expect("it runs");
    let sizes = pieces(&world);
    assert!(sizes.len() == 2 && sizes[1] > 300, "{sizes:?}");
}

#[test]
fn dice_fall_freely() {
    let mut strokes = Vec::new();
    for (axis, third) in [(0, 0.0067), (1, 0.0067), (2, 0.0101)] {
        for side in [-1.0, 1.0] {
            let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
            let middle = DVec3::AXES[axis] * (side * third);
            let begin = 0.005 * strokes.len() as f64;
            let (from, to) = (middle - v * 0.06, middle + v * 0.06);
            let (name, times) = (strokes.len().to_string(), [begin, begin + 0.004]);
            strokes.push(stroke(&name, u * 0.12, from, to, times));
        }
    }
    let mut world = cut(&BLOCK.replace("damping: 4", "damping: 0"), &strokes);
    play(&mut world, 0.032).expect("it runs");
    let sizes = pieces(&world);
    assert!(sizes.len() >= 27, "{} pieces: {sizes:?}", sizes.len());
    let next = sizes[27..].iter().max().unwrap_or(&0);
    assert!(sizes[26] > 2 * next, "{sizes:?}");
    // 18 of them fall: their momentum grows by their weight.
    let falling = |world: &World| {
        let body = &world.bodies()[0];
        let free = (0..body.rest.len()).filter(|&node| body.rest[node].z < 0.0101);
        free.fold((0.0, DVec3::ZERO), |(mass, momentum), node| {
            let m = body.masses[node];
            (mass + m, momentum + body.motion().velocities()[node] * m)
        })
    };
    let ((mass, before), start) = (falling(&world), world.time());
    play(&mut world, 0.06).expect("it runs");
    let gained = falling(&world).1 - before;
    let expected = DVec3::Z * (-9.81 * mass * (world.time() - start));
    let most = 1e-9 * expected.length();
    assert_below("momentum", gained.distance(expected), most);
}

#[test]
fn a_hundred_cuts() {
    let mut random = Random::new(9);
    let mut point = |size: f64| random.vector(0.5 * size);
    let strokes: Vec<String> = (0..100_u32)
        .map(|k| {
            let begin = 1e-3 * f64::from(k);
            let from = point(0.04);
            let to = from + point(0.03);
            stroke(&k.to_string(), point(0.03), from, to, [begin, begin + 5e-5])
        })
        .collect();
    let mut world = cut(&BLOCK.replace("Nodes(500)", "Nodes(150)"), &strokes);
    let mut before = 0;
    for k in 1..=6 {
        play(&mut world, 0.02 * f64::from(k)).expect("it runs");
        assert!(severed(&world) >= before, "severed pairs came back");
        before = severed(&world);
    }
    let captures = world.capture_count();
    assert_eq!(cutting(&world).counts().0, captures, "each is taken up");
    assert!(before > 10, "{before} pairs severed");
    audit_closes(&world, 0.02);
}

#[test]
fn a_block_is_cut_while_compressed_to_half() {
    // Flat, so that it bulges and does not buckle.
    let flat = BLOCK.replace("(0.04, 0.04, 0.06)", "(0.06, 0.06, 0.03)");
    let supports = "supports: [
        (region: HalfSpace(point: (0, 0, 0.0149), normal: (0, 0, 1)), motion: Driven(path: [
            (time: 0, position: (0, 0, 0)), (time: 0.15, position: (0, 0, -0.015))])),
        (region: HalfSpace(point: (0, 0, -0.0149), normal: (0, 0, -1)))],";
    let at = |y: f64| DVec3::new(0.002, y, -0.0075);
    let cut = stroke("cut", DVec3::Z * 0.05, at(-0.08), at(0.08), [0.2, 0.3]);
    let rest = format!("cuts: [{cut}], {supports} integration: (settle: None), gravity: None,");
    let mut world = world(&flat, &rest);
    play(&mut world, 0.19).expect("it runs");
    let body = &world.bodies()[0];
    let pressed = body.motion().audit().elastic;
    let heights = body.motion().positions().iter().map(|x| x.z);
    let lowest = heights.clone().fold(f64::INFINITY, f64::min);
    let highest = heights.fold(f64::NEG_INFINITY, f64::max);
    // 2.3 mm more than the plates are apart under the stable law; which nodes was not looked into.
    let height = highest - lowest;
    assert!((0.0149..0.018).contains(&height), "{height} m");
    play(&mut world, 0.4).expect("it runs");
    assert_eq!(pieces(&world).len(), 2, "{:?}", pieces(&world));
    let body = &world.bodies()[0];
    let audit = body.motion().audit();
    assert!(audit.elastic < pressed, "{audit:?} of {pressed} J");
    audit_closes(&world, 0.02);
}

#[test]
fn a_single_node_falls_like_a_point_mass() {
    // Three planes about the corner node at (20, 20, -30) mm; its neighbours are 6 mm away.
    let corner = DVec3::new(0.0185, 0.0185, -0.0285);
    let strokes = [0, 1, 2].map(|axis| {
        let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
        let begin = 0.002 * axis as f64;
        let (name, times) = (axis.to_string(), [begin, begin + 1e-3]);
        stroke(&name, u * 0.02, corner - v * 0.01, corner + v * 0.01, times)
    });
    let mut world = cut(&BLOCK.replace("damping: 4", "damping: 0"), &strokes);
    play(&mut world, 0.01).expect("it runs");
    assert_eq!(pieces(&world)[1..], [1], "one node is cut off");
    let body = &world.bodies()[0];
    let corner = DVec3::new(0.02, 0.02, -0.03);
    let lone = body.rest.iter().position(|x| x.distance(corner) < 1e-6);
    let lone = lone.expect("a box has nodes at its corners");
    let (motion, start) = (body.motion(), world.time());
    let (x, v) = (motion.positions()[lone], motion.velocities()[lone]);
    play(&mut world, 0.05).expect("it runs");
    let t = world.time() - start;
    let expected = x + v * t + DVec3::Z * (-0.5 * 9.81 * t * t);
    let there = world.bodies()[0].motion().positions()[lone];
    assert_below("off a parabola", there.distance(expected), 1e-12);
}

#[test]
fn a_blade_faster_than_the_body_cuts_as_deep_as_a_slow_one() {
    let cut = |times: [f64; 2]| {
        let cut = across("cut", 1e-3, times).replace("Distance(0.01)", "Rate(60)");
        let rest = format!("cuts: [{cut}], {HELD} gravity: None, integration: (settle: None),");
        let mut world = world(BLOCK, &rest);
        play(&mut world, 0.3).expect("it runs");
        severed(&world)
    };
    let (fast, slow) = (cut([0.01, 0.010_01]), cut([0.01, 0.25]));
    assert!(fast > 30, "{fast} pairs");
    assert_eq!(fast, slow);
}

#[test]
fn a_cut_through_the_support_leaves_both_parts_held() {
    let supports = "supports: [(region: HalfSpace(point: (0, 0, 0.0149), normal: (0, 0, 1)))],";
    let at = |y: f64| DVec3::new(0.001, y, 0.0);
    let cut = stroke("cut", DVec3::Z * 0.1, at(-0.04), at(0.04), [0.02, 0.1]);
    let mut world = world(BLOCK, &format!("cuts: [{cut}], {supports} {AT_ONCE}"));
    play(&mut world, 0.5).expect("it runs");
    assert_eq!(pieces(&world).len(), 2);
    let body = &world.bodies()[0];
    for (x, rest) in body.motion().positions().iter().zip(&body.rest) {
        if rest.z >= 0.0149 {
            assert_eq!(x, rest, "a held node moved");
        } else {
            assert!(x.distance(*rest) < 0.01, "{rest} fell to {x}");
        }
    }
    audit_closes(&world, 0.01);
}

#[test]
fn a_body_at_rest_stays_at_rest_when_cut_without_gravity() {
    let cut = across("cut", 1e-3, [0.01, 0.1]);
    let rest = format!("cuts: [{cut}], gravity: None, integration: (settle: None),");
    let mut world = world(BLOCK, &rest);
    play(&mut world, 0.2).expect("it runs");
    assert_eq!(pieces(&world).len(), 2);
    let body = &world.bodies()[0];
    assert!(largest_way(body) < 1e-12, "it moved");
}

/// A tool strikes a free block off its middle; then nothing from outside acts on it, however it is damped, and blades that
/// pass half and all of it while it turns leave both momenta as they are.
#[test]
fn a_turning_block_keeps_its_momenta_while_it_is_cut() {
    for damping in [(0.0, 0.0), (0.0, 0.1), (2.0, 0.0), (2.0, 0.1)] {
        let damped = format!("damping: {}, damping_ratio: {}", damping.0, damping.1);
        let body = BLOCK.replace("damping: 4", &damped);
        let tool = "tools: [(shape: Sphere(radius: 0.02), path: [(time: 0, position: (-0.045, 0.01, 0.02)),
            (time: 0.05, position: (-0.03, 0.01, 0.02)), (time: 0.1, position: (-0.2, 0.01, 0.02))])],";
        // Across all places where the block may be by then.
        let edge = DVec3::new(0.6, 0.06, 0.0);
        let at = |z: f64| DVec3::new(0.1, 2e-3, z);
        let half = stroke("half", edge, at(-0.2), at(0.0), [0.15, 0.3]);
        let through = stroke("through", edge, at(0.2), at(-0.2), [0.35, 0.5]);
        let rest = format!(
            "cuts: [{half}, {through}], {tool} gravity: None, integration: (settle: None),"
        );
        let mut world = world(&body, &rest);
        play(&mut world, 0.12).expect("it runs");
        let momenta = |world: &World| {
            let motion = world.bodies()[0].motion();
            let nodes = motion.masses().iter().zip(motion.velocities());
            let linear: DVec3 = nodes.map(|(mass, v)| *v * *mass).sum();
            [linear, motion.angular_momentum()]
        };
        let before = momenta(&world);
        let mass = world.bodies()[0].mass;
        let [fast, turning] = before.map(|momentum| momentum.length() / mass);
        assert!(fast > 0.1 && turning > 1e-3, "{fast} m/s, {turning} m²/s");
        while world.time() < 0.6 {
            world.step().expect("it runs");
            for (now, before) in momenta(&world).into_iter().zip(before) {
                let off = now.distance(before) / before.length();
                assert!(off < 1e-10, "{damped}: {off:e} at {} s", world.time());
            }
        }
        assert!(pieces(&world).len() > 1, "it falls apart");
    }
}
