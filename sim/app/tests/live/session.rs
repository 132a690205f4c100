//! Strokes, presses and grips by a seeded script, without a page.

use std::path::Path;

use glam::DVec3;
use phyxel::Input;
use phyxel::scene::{Pose, Scene};
use phyxel_cli::live::{LiveOptions, Session, SessionError, Sources, serve};
use phyxel_cli::output::{OutputError, OutputFolder, read_input};
use phyxel_cli::run::{RunOptions, replay};
use phyxel_live::Server;
use phyxel_scene::Override;
use tempfile::tempdir;
use testkit::cloud::Random;

/// A small liver, without the tray.
pub(crate) fn liver(nodes: u32, surfels: u32) -> Scene {
    let changes = [
        format!("bodies[0].sampling.target=Nodes({nodes})"),
        format!("bodies[0].surfels.target=Count({surfels})"),
        "pictures.samples=1".to_owned(),
        "tools=[]".to_owned(),
    ];
    let changes = changes.map(|text| Override::parse(&text).unwrap());
    phyxel_scene::embedded("liver", &changes).unwrap()
}

/// A point (m) of the box between two corners (m).
fn within(random: &mut Random, low: DVec3, high: DVec3) -> DVec3 {
    low + (high - low) * DVec3::from_array([0, 1, 2].map(|_| random.unit()))
}

fn settle(session: &mut Session) {
    while session.is_settling() {
        session.step().unwrap();
    }
}

fn steps(session: &mut Session, count: usize) {
    for _ in 0..count {
        session.step().unwrap();
    }
}

/// A session with a small liver that has come to rest.
fn at_rest() -> Session {
    let mut session = Session::new(&liver(300, 1_000)).unwrap();
    settle(&mut session);
    session
}

/// Corners (m) of the box around its body.
fn corners(session: &Session) -> [DVec3; 2] {
    let bounds = session.world().bodies()[0].solid.bounds();
    [bounds.min, bounds.max]
}

fn bits(place: &DVec3) -> [u64; 3] {
    place.to_array().map(f64::to_bits)
}

fn positions(session: &Session) -> Vec<[u64; 3]> {
    let body = &session.world().bodies()[0];
    body.motion().positions().iter().map(bits).collect()
}

/// Simulated time (s) of the scripted session; `PHYXEL_LIVE_SECONDS` makes it longer.
fn seconds() -> f64 {
    let asked = std::env::var("PHYXEL_LIVE_SECONDS").ok();
    asked.and_then(|text| text.parse().ok()).unwrap_or(4.0)
}

/// What a hand does next: it grips, pulls, lets go, presses or cuts, at random points of a box up to a height (m).
fn act(session: &mut Session, number: u32, point: &mut impl FnMut() -> DVec3, height: f64) {
    match number % 5 {
        0 => session.grip(point(), 0.02),
        1 => {
            session.pull(point());
            session.let_go();
            session.put_tool(0, Some(Pose::at(point().with_z(height + 0.03))));
        }
        2 => session.lead_tool(0, Pose::at(point())),
        _ => {
            session.put_tool(0, None);
            // From above, to somewhere inside.
            let (a, b) = (point(), point());
            let edge = |p: DVec3| vec![p.with_z(height + 0.01), p];
            assert!(session.begin_stroke(edge(a)));
            let way = (b - a).clamp_length_max(0.04);
            for k in 1..=4 {
                session.lead_stroke(&edge(a + way * 0.25 * f64::from(k)));
            }
            session.end_stroke();
        }
    }
}

#[test]
fn a_scripted_session_holds_and_its_recording_repeats_it_to_the_bit() {
    let mut session = at_rest();
    let [low, high] = corners(&session);
    let (mut random, mut lost) = (Random::new(1), 0);
    let (mut passed, mut next, mut done) = (0.0, 0.0, 0);
    let mut point = || within(&mut random, low, high);
    while passed < seconds() {
        if passed >= next {
            next += 0.3;
            done += 1;
            // A body of shreds is none: a long session begins anew every half minute.
            if done % 97 == 0 {
                session.reset();
            }
            act(&mut session, done, &mut point, high.z);
        }
        let before = session.world().time();
        if let Err(error) = session.step() {
            eprintln!("{passed:.3} s: {error}");
            session.recover();
            lost += 1;
            assert!(lost < 10, "too many steps are lost");
        }
        passed += (session.world().time() - before).max(0.0);
        // As the server does.
        session.grow().unwrap();
    }
    let world = session.world();
    let body = &world.bodies()[0];
    assert!(body.motion().positions().iter().all(|x| x.is_finite()));
    let audit = body.motion().audit();
    let balance = audit.energy_error() / audit.scale();
    let (strokes, _) = session.strokes();
    eprintln!(
        "{passed:.1} s, {strokes} strokes, {} pairs severed, {:?} surfels, {lost} steps lost, {} stretches taken again, \
         balance {balance:.1e}, {} inputs",
        session.severed_pairs(),
        session.painter().surfel_counts(),
        world.retaken().stretches,
        session.record().len(),
    );
    assert!(strokes > 0 && session.severed_pairs() > 0);
    // Velocity Verlet's own swing, and an allowance for stretches whose energy stays off.
    assert!(balance.abs() < 0.02, "balance {balance}");

    // The recording, as `phyxel run scene.ron --replay input.csv` runs it.
    assert_eq!(run_of_saved(&session), steps_and_energies(&session));
}

/// A stroke across the middle from above, until it is done.
fn cut_middle(session: &mut Session) {
    let [low, high] = corners(session);
    let middle = low.midpoint(high);
    let edge = |x: f64| {
        let y = middle.y;
        vec![DVec3::new(x, y, high.z + 0.02), DVec3::new(x, y, low.z)]
    };
    assert!(session.begin_stroke(edge(low.x - 0.01)));
    session.lead_stroke(&edge(middle.x));
    session.end_stroke();
    while !session.blade().is_empty() {
        session.step().unwrap();
    }
    assert!(session.severed_pairs() > 0);
}

/// The steps and the energies of all nodes (J, bits) at the end of a run of what a session saves.
fn run_of_saved(session: &Session) -> (u64, [u64; 3]) {
    let folder = tempdir().unwrap();
    let output = OutputFolder::create(folder.path()).unwrap();
    let files = session.save(&output).unwrap();
    assert!(files.iter().all(|name| folder.path().join(name).exists()));
    let (steps, energies, inputs) = run_of_files(folder.path());
    assert_eq!(inputs, session.record());
    (steps, energies.map(f64::to_bits))
}

/// The steps and the energies of all nodes (J: kinetic, elastic, dissipated) at the end of a run of what is saved in a
/// folder, and its inputs.
pub(crate) fn run_of_files(folder: &Path) -> (u64, [f64; 3], Vec<Input>) {
    let mut scene = phyxel_scene::load(folder.join("scene.ron"), &[]).unwrap();
    // Pictures have no part in the motion.
    scene.pictures = None;
    let inputs = read_input(&folder.join("input.csv"), &scene).unwrap();
    let options = RunOptions::quiet(folder.join("again"), 1);
    let summary = replay(&scene, inputs.clone(), &options).unwrap();
    let energy = &summary.bodies[0].energy;
    let energies = [energy.kinetic, energy.elastic, energy.dissipated];
    (summary.stepping.steps, energies, inputs)
}

/// As [`run_of_saved`], of the session as it is.
fn steps_and_energies(session: &Session) -> (u64, [u64; 3]) {
    let audit = session.world().bodies()[0].motion().audit();
    let energies = [audit.kinetic, audit.elastic, audit.dissipated];
    (session.world().steps(), energies.map(f64::to_bits))
}

/// A cut while the body comes to rest is one as any other: undone, taken away by a reset once the body rests, and
/// saved so that a run repeats it.
#[test]
fn a_cut_before_the_body_rests_can_be_undone_reset_and_saved() {
    let mut scene = liver(300, 1_000);
    if let Some(settle) = &mut scene.integration.settle {
        (settle.speed, settle.limit) = (1e-9, 1.0);
    }
    let mut session = Session::new(&scene).unwrap();
    for _ in 0..20 {
        session.step().unwrap();
    }
    let before = positions(&session);
    cut_middle(&mut session);
    assert!(session.is_settling());
    assert_eq!(run_of_saved(&session), steps_and_energies(&session));

    settle(&mut session);
    session.reset();
    assert_eq!(session.severed_pairs(), 0, "the start has no cut");
    while session.world().steps() < 20 {
        session.step().unwrap();
    }
    assert_eq!(positions(&session), before);
    cut_middle(&mut session);
    settle(&mut session);
    // Shorter than the path of the blade, which nothing follows.
    session.step().unwrap();
    assert_eq!(run_of_saved(&session), steps_and_energies(&session));
    // One stroke after it came to rest, one before: the start of both is the one that settles.
    let rested = (positions(&session), session.severed_pairs());
    cut_middle(&mut session);
    assert!(session.undo().unwrap());
    assert_eq!((positions(&session), session.severed_pairs()), rested);
    assert!(!session.is_settling());
    assert!(session.undo().unwrap());
    assert_eq!((positions(&session), session.severed_pairs()), (before, 0));
}

/// A stroke through air ends at once, and no more strokes wait than a hand may have drawn in a while.
#[test]
fn strokes_that_wait_or_miss_hold_nothing_up() {
    let mut session = Session::new(&liver(300, 1_000)).unwrap();
    let air = |x: f64| vec![DVec3::new(x, 5.0, 0.0), DVec3::new(x, 5.0, 0.1)];
    assert!(session.begin_stroke(air(0.0)));
    // 50 m of air would take a blade 83 s.
    session.lead_stroke(&air(50.0));
    session.end_stroke();
    session.step().unwrap();
    assert!(session.blade().is_empty());
    assert_eq!(session.strokes(), (0, 0));
    let taken = (0..100).filter(|_| session.begin_stroke(air(0.0)));
    assert!((2..20).contains(&taken.count()));
    session.reset();
    cut_middle(&mut session);
}

#[test]
fn a_folder_has_one_server_at_a_time() {
    let folder = tempdir().unwrap();
    let _held = OutputFolder::claim(folder.path()).unwrap();
    let scene = liver(300, 1_000);
    let sources = Sources::new(&scene, None, Box::new(|_, _| Err(String::new())));
    let options = LiveOptions {
        out: folder.path().to_owned(),
        interrupt: None,
    };
    let server = Server::start(0, "phyxel under test").unwrap();
    let refused = serve(server, &scene, sources, &options);
    let in_use = |error| matches!(error, SessionError::Output(OutputError::InUse { .. }));
    assert!(refused.is_err_and(in_use));
}

/// The bits come back after each of several strokes, and taking steps again from there gives the bits that
/// they gave before; as many strokes as are kept, and no more.
#[test]
fn strokes_are_undone_one_by_one() {
    let mut session = at_rest();
    let [low, high] = corners(&session);
    let (mut before, mut after) = (Vec::new(), Vec::new());
    let state = |session: &Session| {
        let tissue = &session.painter().skins()[0].tissue;
        let surfels = tissue.surfels().iter().enumerate().map(|(k, surfel)| {
            let (nodes, weights) = tissue.binding().row(k);
            let weights: Vec<u64> = weights.iter().map(|weight| weight.to_bits()).collect();
            (
                bits(&surfel.position),
                surfel.radius.to_bits(),
                nodes.to_vec(),
                weights,
            )
        });
        let surfels: Vec<_> = surfels.collect();
        let (steps, severed) = (session.world().steps(), session.severed_pairs());
        (
            steps,
            positions(session),
            severed,
            session.record().to_vec(),
            surfels,
        )
    };
    let mut helpings = 0;
    let mut stroke = |session: &mut Session, k: i32| {
        let x = low.x + (0.2 + 0.025 * f64::from(k)) * (high.x - low.x);
        let edge = |y: f64| vec![DVec3::new(x, y, high.z + 0.02), DVec3::new(x, y, low.z)];
        assert!(session.begin_stroke(edge(low.y - 0.01)));
        session.lead_stroke(&edge(low.y + 0.03));
        session.end_stroke();
        for _ in 0..120 {
            session.step().unwrap();
            helpings += usize::from(!session.grow().unwrap().is_empty());
        }
    };
    for k in 0..26 {
        if k == 9 {
            session.set_damping(20.0);
            session.set_gravity(DVec3::NEG_Z * 5.0);
            session.step().unwrap();
        }
        before.push(state(&session));
        stroke(&mut session, k);
        after.push(state(&session));
    }
    assert!(session.severed_pairs() > 0 && session.painter().surfel_counts().1 > 0);
    assert_eq!(session.strokes(), (26, 24));
    for k in (2..26_usize).rev() {
        assert!(session.undo().unwrap());
        assert!(state(&session) == before[k], "before stroke {k}");
        if k % 5 == 2 {
            stroke(&mut session, i32::try_from(k).unwrap());
            assert!(state(&session) == after[k], "stroke {k} again");
            assert!(session.undo().unwrap());
        }
    }
    assert!(!session.undo().unwrap(), "older ones have given way");
    assert!(
        helpings > 2 * 26,
        "surfaces grow by some triangles at a time"
    );
    session.reset();
    assert!(state(&session) == before[0], "the start");
}

/// The second method to cut: the rays of the view through a line across the picture, from before the body to
/// behind it. Nothing loads the body, so that all its energies are round-off.
#[test]
fn a_line_across_an_organ_without_load_severs_it() {
    let mut scene = liver(300, 1_000);
    scene.integration.settle = None;
    scene.gravity = None;
    let mut session = Session::new(&scene).unwrap();
    settle(&mut session);
    let [low, high] = corners(&session);
    let beyond = 0.3 * low.distance(high);
    let edge = |share: f64| -> Vec<DVec3> {
        let y = low.y + share * (high.y - low.y);
        let z = |k: u32| low.z - beyond + f64::from(k) / 3.0 * (high.z - low.z + 2.0 * beyond);
        let points = (0..4).map(|k| DVec3::new(0.5 * (low.x + high.x), y, z(k)));
        points.collect()
    };
    assert!(session.begin_stroke(edge(-0.1)));
    for k in 1..=8 {
        session.lead_stroke(&edge(-0.1 + 0.15 * f64::from(k)));
    }
    session.end_stroke();
    let start = session.world().time();
    while session.world().time() < start + 1.0 {
        session.step().unwrap();
    }
    assert!(session.blade().is_empty(), "the stroke has ended");
    assert!(session.severed_pairs() > 100, "{}", session.severed_pairs());
    assert_eq!(session.world().retaken().stretches, 0, "nothing went wrong");
    let cutting = session.world().bodies()[0].cutting.as_ref().unwrap();
    assert!(cutting.energy.largest_addition < 0.01, "of nothing");
}

#[test]
fn a_grip_pulls_with_the_force_that_the_body_pulls_back() {
    let mut session = at_rest();
    let places = |session: &Session| {
        let body = &session.world().bodies()[0];
        body.motion().positions().to_vec()
    };
    let at_rest = places(&session);
    // The tip of the left lobe, up by 1 cm.
    let tip = *at_rest.iter().max_by(|a, b| a.x.total_cmp(&b.x)).unwrap();
    session.grip(tip, 0.02);
    session.pull(tip + DVec3::Z * 0.01);
    for _ in 0..600 {
        session.step().unwrap();
    }
    let force = session.world().grip_force().unwrap();
    let now = places(&session);
    let moved = now
        .iter()
        .zip(&at_rest)
        .map(|(now, before)| now.z - before.z);
    let moved = moved.fold(0.0, f64::max);
    // A hold on few nodes is soft (see `LARGEST_PHASE`); what hangs from it pulls down.
    assert!((0.004..0.0105).contains(&moved), "moved {moved} m");
    assert!(force.z < -0.02, "{force} N");
    let audit = session.world().bodies()[0].motion().audit();
    assert!(audit.applied_work > 0.0);
    assert!(audit.energy_error().abs() < 0.01 * audit.scale());
    session.let_go();
    session.step().unwrap();
    session.step().unwrap();
    assert_eq!(session.world().grip_force(), None);
}

#[test]
fn gravity_and_damping_are_what_hands_set() {
    let mut session = at_rest();
    session.set_gravity(DVec3::ZERO);
    session.set_damping(20.0);
    let height = |session: &Session| {
        let places = session.world().bodies()[0].motion().positions();
        places.iter().map(|x| x.z).sum::<f64>()
    };
    let before = height(&session);
    for _ in 0..500 {
        session.step().unwrap();
    }
    assert!(height(&session) > before, "without weight it rises");
    assert_eq!(session.world().gravity(), DVec3::ZERO);
    assert!((session.world().damping() - 20.0).abs() < 1e-12);
    let motion = &session.world().bodies()[0].motion();
    assert_eq!(motion.settings().damping.to_bits(), 20.0_f64.to_bits());
}

#[test]
fn every_embedded_scene_can_be_taken_in_hand() {
    for name in ["liver", "block", "press"] {
        let changes = [
            "bodies[0].sampling.target=Nodes(200)",
            "bodies[0].surfels.target=Count(500)",
        ];
        let changes = changes.map(|text| Override::parse(text).unwrap());
        let mut session = Session::new(&phyxel_scene::embedded(name, &changes).unwrap()).unwrap();
        assert_eq!(session.world().scene().cuts.len(), 1);
        let tools = &session.world().scene().tools;
        let names: Vec<&str> = tools.iter().map(|tool| &*tool.name).collect();
        // What stands, stands behind what users drive.
        let expected: &[&str] = if name == "liver" {
            &["probe", "tray"]
        } else {
            &["probe"]
        };
        assert_eq!(names, expected, "{name}");
        let (last, stands) = (tools.len() - 1, tools[tools.len() - 1].position);
        for _ in 0..20 {
            session.step().unwrap();
        }
        let at = session.world().tool_pose(last).position;
        assert!(name != "liver" || at == stands, "{at}");
    }
}

/// Bodies that lie on each other go on as if the stroke had not been.
#[test]
fn a_stroke_through_bodies_that_touch_is_undone() {
    let changes = [0, 1].map(|body| {
        [
            format!("bodies[{body}].sampling.target=Nodes(200)"),
            format!("bodies[{body}].surfels.target=Count(500)"),
        ]
    });
    let changes = changes.as_flattened().iter();
    let changes: Vec<Override> = changes.map(|text| Override::parse(text).unwrap()).collect();
    let scene = phyxel_scene::embedded("stack", &changes).unwrap();
    let begun = || {
        let mut session = Session::new(&scene).unwrap();
        steps(&mut session, 300);
        session
    };
    let all = |session: &Session| [0, 1].map(|body| session.world().positions(body));
    let (mut session, mut other) = (begun(), begun());
    let (between, _) = session.world().body_contact().unwrap();
    assert!(between.iter().any(|sum| sum.normal > 0.0), "they touch");
    cut_middle(&mut session);
    assert_ne!(all(&session), all(&other));
    assert!(session.undo().unwrap());
    for _ in 0..2 {
        assert_eq!(all(&session), all(&other));
        steps(&mut session, 60);
        steps(&mut other, 60);
    }
}

/// A probe that is taken up is there at once: it comes through nothing on its way from where tools wait, far above.
#[test]
fn a_probe_that_is_taken_up_below_a_body_does_not_come_through_it() {
    let mut session = at_rest();
    let [low, high] = corners(&session);
    let below = low.midpoint(high).with_z(low.z - 0.05);
    let before = positions(&session);
    session.put_tool(0, Some(Pose::at(below)));
    session.step().unwrap();
    assert_eq!(session.world().tool_forces()[0].force, DVec3::ZERO);
    let undisturbed = positions(&session);
    let mut other = at_rest();
    assert_eq!(positions(&other), before);
    other.step().unwrap();
    assert_eq!(positions(&other), undisturbed);
}
