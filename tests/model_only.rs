//! A scene pays only for what it needs: each part is added to a scene that has none, and taken from one
//! that has all, and nothing else changes.

use glam::DVec3;
use phyxel::Phase;
use phyxel_cli::picture::Painter;

const BARE: &str =
    "version: 1, bodies: [(shape: Box(size: (0.04, 0.03, 0.05)), surfels: (target: Count(500)),
        sampling: (target: Nodes(400)))],
    integration: (settle: None, step_factor: 0.4),";

struct Played {
    bytes: Vec<(&'static str, usize)>,
    positions: Vec<DVec3>,
    contact_calls: u64,
    cut_calls: u64,
}

fn play(text: &str) -> Played {
    let mut world = crate::world(&format!("({text})"));
    if let Some(pictures) = &world.scene().pictures {
        let mut painter = Painter::new(&world, pictures).expect("it can be drawn");
        painter.carry(&world);
        assert!(painter.bytes() > 0, "surfels take memory");
    }
    for _ in 0..60 {
        world.step().expect("it runs");
    }
    let parts = world.parts();
    let parts = parts.iter();
    Played {
        bytes: parts.map(|part| (part.name, part.bytes)).collect(),
        positions: world.bodies()[0].motion().positions().to_vec(),
        contact_calls: world.phases().of(Phase::Contact).calls,
        cut_calls: world.phases().of(Phase::Cut).calls,
    }
}

/// Parts whose memory differs between two scenes.
fn changed(a: &Played, b: &Played) -> Vec<&'static str> {
    let pairs = a.bytes.iter().zip(&b.bytes);
    pairs.filter(|(a, b)| a != b).map(|(a, _)| a.0).collect()
}

#[test]
fn each_part_adds_its_own_memory_and_no_other() {
    let bare = play(&format!("{BARE} gravity: None"));
    let off = "viscosity, supports, gravity, viscous damping, contact, cuts";
    for (name, bytes) in &bare.bytes {
        let is_off = off.split(", ").any(|part| part == *name);
        assert_eq!(*bytes == 0, is_off, "{name} takes {bytes} bytes");
    }
    assert_eq!((bare.contact_calls, bare.cut_calls), (0, 0));
    // Far from the body, or of no effect on one at rest: the motion must not know of them either.
    let held = "supports: [(region: HalfSpace(point: (0, 0, 0.0249), normal: (0, 0, 1)))],";
    let tool = "tools: [(shape: Sphere(radius: 0.01), path: [(time: 0, position: (0, 0, 9))])],";
    let cut = |time: f64| {
        format!(
            "cuts: [(capture: Rate(60), edge: [(0, -1, 0), (0, 1, 0)], path: [
                (time: {time}, position: (-1, 0, 0)), (time: {}, position: (1, 0, 0))])],",
            time + 1e-3
        )
    };
    let pictures = "pictures: (width: 64, height: 64),".to_owned();
    for (part, more, calls) in [
        ("supports", held.to_owned(), (0, 0)),
        ("contact", tool.to_owned(), (60, 0)),
        ("contact", "contact: (),".to_owned(), (60, 0)),
        ("cuts", cut(1e-3), (0, 2)),
        ("", cut(3.0), (0, 0)),
        ("", pictures, (0, 0)),
    ] {
        let with = play(&format!("{BARE} {more} gravity: None"));
        let expected: Vec<&str> = (!part.is_empty()).then_some(part).into_iter().collect();
        // A cut also changes rows of the model, whose memory it leaves as it is.
        assert_eq!(changed(&bare, &with), expected, "{more}");
        assert_eq!((with.contact_calls, with.cut_calls), calls, "{more}");
        if part != "cuts" {
            assert_eq!(bare.positions, with.positions, "{more}");
        }
    }
    let damped = BARE.replace("Nodes(400))", "Nodes(400)), damping_ratio: 0.1");
    let with = play(&format!("{damped} gravity: None"));
    assert_eq!(changed(&bare, &with), ["viscous damping"]);
    let heavy = "gravity: (acceleration: (0, 0, -9.81), ramp: 0)";
    let with = play(&format!("{BARE} {heavy}"));
    assert_eq!(changed(&bare, &with), ["gravity"]);
}

/// Keys that choose between models: what they change is the part they choose.
#[test]
fn a_choice_of_model_changes_its_own_part() {
    let bare = play(&format!("{BARE} gravity: None"));
    let body = |keys: &str| BARE.replace("Nodes(400))", &format!("Nodes(400)), {keys}"));
    let fiber = "material: (fiber: (direction: (0, 0, 1), stiffness: 1e4))";
    let viscosity = "material: (viscosity: [(ratio: 0.5, time: 0.1)])";
    let inclusion =
        "inclusions: [(region: Sphere(center: (0, 0, 0), radius: 0.01), youngs_modulus: 1e5)]";
    for (keys, expected) in [
        ("material: (model: SaintVenantKirchhoff)", &[][..]),
        ("material: (model: MooneyRivlin(share: 0.5))", &[]),
        ("material: (volume_constant: 1e4)", &[]),
        (fiber, &[]),
        (viscosity, &["viscosity"]),
        ("material: (stabilization: 0)", &["elasticity"]),
        ("material: (dilatation: Mean)", &["elasticity"]),
        ("material: (toughness: 100)", &[]),
        ("cut_rule: Grid()", &[]),
        (inclusion, &["elasticity"]),
    ] {
        let with = play(&format!("{} gravity: None", body(keys)));
        assert_eq!(changed(&bare, &with), expected, "{keys}");
        assert_eq!((with.contact_calls, with.cut_calls), (0, 0), "{keys}");
    }
    for scheme in ["SymplecticEuler", "Newmark()", "BackwardEuler()"] {
        let text = BARE.replace("settle: None", &format!("settle: None, scheme: {scheme}"));
        let with = play(&format!("{text} gravity: None"));
        // Only explicit steps watch the stiffness.
        let expected: &[&str] = match scheme {
            "SymplecticEuler" => &[],
            _ => &["motion"],
        };
        assert_eq!(changed(&bare, &with), expected, "{scheme}");
    }
}

#[test]
fn each_part_takes_its_own_memory_away_and_no_other() {
    let held = "supports: [(region: HalfSpace(point: (0, 0, 0.0249), normal: (0, 0, 1)))],";
    let tool = "tools: [(shape: Sphere(radius: 0.01), path: [(time: 0, position: (0, 0, 9))])],";
    // Inside, so that it leaves the surface whole that the tool may touch, before anything moves, and off the lattice.
    let cut = "cuts: [(capture: Rate(60), edge: [(0, -5e-3, 0), (0, 5e-3, 0)], path: [
        (time: 0, position: (1e-3, 4e-4, -8e-3)), (time: 1e-7, position: (1e-3, 4e-4, 8e-3))])],";
    let heavy = "gravity: (acceleration: (0, 0, -9.81), ramp: 0),";
    let all = [held, tool, cut, heavy];
    let inner = "material: (viscosity: [(ratio: 0.5, time: 0.1)]), damping_ratio: 0.1";
    let scene = |inner: &str, rest: &[&str]| {
        let body = BARE.replace("Nodes(400))", &format!("Nodes(400)), {inner}"));
        play(&format!("{body} {}", rest.join(" ")))
    };
    let full = scene(inner, &all);
    let taken = full.bytes.iter().all(|(_, bytes)| *bytes > 0);
    assert!(taken, "{:?}", full.bytes);
    let cuts = full.cut_calls;
    // Without strain rebuilt rows have no offsets to keep.
    for (k, parts, calls) in [
        (0, &["supports"][..], (60, cuts)),
        (1, &["contact"], (0, cuts)),
        (2, &["cuts"], (60, 0)),
        (3, &["gravity", "cuts"], (60, cuts)),
    ] {
        let mut rest = all;
        rest[k] = if k == 3 { "gravity: None" } else { "" };
        let without = scene(inner, &rest);
        assert_eq!(changed(&full, &without), parts);
        let found = (without.contact_calls, without.cut_calls);
        assert_eq!(found, calls, "{parts:?}");
        let left = without.bytes.iter().find(|(name, _)| *name == parts[0]);
        assert_eq!(left, Some(&(parts[0], 0)));
    }
    let calm = scene(&inner.replace(", damping_ratio: 0.1", ""), &all);
    assert_eq!(changed(&full, &calm), ["viscous damping"]);
    let dry = scene("damping_ratio: 0.1", &all);
    assert_eq!(changed(&full, &dry), ["viscosity"]);
}
