//! The same checkpoints to the byte on any number of ranks as from one process.
#![allow(clippy::unwrap_used, reason = "a test that fails says where")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use phyxel::scene::Scene;
use phyxel_cli::output::read_checkpoint;
use phyxel_cli::run::{CHECKPOINT, RunOptions, RunState, run};
use phyxel_scene::Override;

fn mpirun(ranks: usize, arguments: &[&str], changes: &[&str], out: &Path) -> Command {
    let mut command = Command::new("mpirun");
    command
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .args(["--oversubscribe", "-n", &ranks.to_string()])
        .arg(env!("CARGO_BIN_EXE_phyxel-ranks"));
    command.args(arguments).args(["--quiet", "--out"]).arg(out);
    for change in changes {
        command.args(["--set", change]);
    }
    command
}

fn job(ranks: usize, arguments: &[&str], changes: &[&str], out: &Path) -> Output {
    mpirun(ranks, arguments, changes, out).output().unwrap()
}

fn done(output: &Output) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}

/// Runs a scene in this process.
fn serial(scene: &str, changes: &[&str], out: &Path) {
    let changes: Vec<Override> = changes
        .iter()
        .map(|c| Override::parse(c).unwrap())
        .collect();
    let scene = phyxel_scene::embedded(scene, &changes).unwrap();
    let options = RunOptions::quiet(out, 1);
    run(&scene, &options).unwrap();
}

/// The checkpoint of a folder.
fn state(folder: &Path) -> Vec<u8> {
    std::fs::read(folder.join(CHECKPOINT)).unwrap()
}

fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

fn same(one: &Path, other: &Path, what: &str) {
    let (a, b) = (state(one), state(other));
    if a != b {
        let at = a.iter().zip(&b).position(|(a, b)| a != b);
        panic!(
            "{what}: states differ, from byte {at:?} of {} and {}",
            a.len(),
            b.len()
        );
    }
    assert_eq!(
        text(one, "history.csv"),
        text(other, "history.csv"),
        "{what}"
    );
}

/// The serial run and those on ranks.
fn compare(scene: &str, changes: &[&str], ranks: &[usize]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("serial");
    serial(scene, changes, &whole);
    for &ranks in ranks {
        let out = folder.path().join(format!("ranks-{ranks}"));
        done(&job(ranks, &[scene], changes, &out));
        same(&whole, &out, &format!("{scene} on {ranks} ranks"));
    }
    (folder, whole)
}

/// Gravity that grows, supports and damping of both kinds.
#[test]
fn a_hanging_block() {
    let changes = [
        "bodies[0].sampling.target=Nodes(7600)",
        "bodies[0].damping_ratio=0.02",
        "gravity.ramp=0.03",
        "cuts=[]",
        "pictures=None",
        "integration.settle=None",
        "integration.duration=0.08",
    ];
    let (_folder, whole) = compare("block", &changes, &[1, 2, 3, 4, 7]);
    assert!(text(&whole, "history.csv").lines().count() > 3);
}

/// A tool presses and slides, with friction.
#[test]
fn a_pressed_liver() {
    let changes = [
        "bodies[0].sampling.target=Nodes(4500)",
        "pictures=None",
        "integration.settle=None",
        "integration.duration=0.45",
        "tools[0].path[0].position=(-0.035, -0.07, 0)",
    ];
    let (_folder, whole) = compare("press", &changes, &[1, 3, 7]);
    assert!(last(&whole, "tools.csv", 14) != 0.0, "the probe does work");
}

/// Two cuts, the second of which takes a piece off.
#[test]
fn a_cut_liver() {
    let changes = [
        "bodies[0].sampling.target=Nodes(2500)",
        "gravity.ramp=0.05",
        "cuts[0].path[0].time=0.02",
        "cuts[0].path[1].time=0.2",
        "cuts[1].path[0].time=0.22",
        "cuts[1].path[1].time=0.4",
        "pictures=None",
        "integration.settle=None",
        "integration.duration=0.5",
    ];
    let (_folder, whole) = compare("liver", &changes, &[2, 3, 4, 7]);
    assert!(last(&whole, "history.csv", 13) > 100.0, "the blades cut");
}

/// The top of a block is shaken and its bottom turned while a blade cuts and a tool presses. What drives nodes, rank 0
/// alone knows: their velocities have to be in every state that is brought, kept or written.
#[test]
fn a_driven_block() {
    let changes = [
        "bodies[0].sampling.target=Nodes(3500)",
        "bodies[0].damping_ratio=0.02",
        "supports=[(region: HalfSpace(point: (0, 0, 0.1045), normal: (0, 0, 1)), motion: Driven(path: [\
         (time: 0), (time: 0.1, position: (0.01, 0, 0.005)), (time: 0.2)])), \
         (region: HalfSpace(point: (0, 0, -0.1045), normal: (0, 0, -1)), motion: Driven(path: [\
         (time: 0), (time: 0.2, rotation: (0, 0, 20))]))]",
        "gravity.ramp=0.05",
        "cuts=[(edge: [(0, -0.06, 0), (0, 0.06, 0)], path: [(time: 0.02, position: (-0.06, 0, 0.02)), \
         (time: 0.1, position: (0, 0, 0.02))])]",
        "tools=[(name: \"ball\", shape: Sphere(radius: 0.01), path: [(time: 0, position: (0.05, 0, -0.04)), \
         (time: 0.15, position: (0.035, 0, -0.04))])]",
        "pictures=None",
        "integration.settle=(speed: 0.1, limit: 1, damping: 30)",
        "integration.duration=0.18",
        "observe.checkpoint=0.05",
    ];
    let (_folder, whole) = compare("block", &changes, &[1, 2, 3]);
    cuts_and_works(&whole);
}

/// A number in the last row of a table.
fn last(whole: &Path, file: &str, column: usize) -> f64 {
    let table = text(whole, file);
    let mut fields = table.lines().last().unwrap().split(',');
    fields.nth(column).unwrap().parse().unwrap()
}

/// The blade severs and the tool does work.
fn cuts_and_works(whole: &Path) {
    assert!(last(whole, "history.csv", 13) > 30.0, "the blade cuts");
    assert!(last(whole, "tools.csv", 14) != 0.0, "the tool does work");
}

/// A cut where a tool touches: what the tool may touch changes with it.
#[test]
fn a_cut_under_a_tool() {
    let changes = [
        "bodies[0].sampling.target=Nodes(3500)",
        "pictures=None",
        "integration.settle=None",
        "integration.duration=0.3",
        "gravity.ramp=0",
        "tools[0].path[0].position=(-0.035, -0.06, 0)",
        "cuts=[(edge: [(-0.03, 0, -0.06), (-0.03, 0, 0.08)], path: [(time: 0.05, position: (0, -0.09, 0)), \
         (time: 0.2, position: (0, -0.02, 0))])]",
    ];
    let (_folder, whole) = compare("press", &changes, &[2, 5]);
    cuts_and_works(&whole);
}

/// What a number of ranks or the serial program has begun, any other resumes, in mid-cut; and a rank that dies
/// ends the job.
#[test]
fn a_killed_job_is_gone_on_with() {
    let changes = [
        "bodies[0].sampling.target=Nodes(3500)",
        "gravity.ramp=0",
        "cuts=[(edge: [(0, -0.06, 0), (0, 0.06, 0)], path: [(time: 0, position: (-0.06, 0, 0.02)), \
         (time: 0.1, position: (0, 0, 0.02))])]",
        "pictures=None",
        "integration.settle=None",
        "integration.duration=0.3",
        "observe.checkpoint=0.05",
    ];
    let (folder, whole) = compare("block", &changes, &[2]);
    let out = folder.path().join("killed");
    let mut command = mpirun(3, &["block"], &changes, &out);
    let mut running = command.stderr(Stdio::piped()).spawn().unwrap();
    let until = Instant::now() + Duration::from_secs(120);
    while !out.join(CHECKPOINT).exists() {
        assert!(Instant::now() < until, "no checkpoint");
        assert!(running.try_wait().unwrap().is_none(), "it ended before");
        std::thread::sleep(Duration::from_millis(2));
    }
    let victim = ranks_of(running.id()).pop().expect("a rank that runs");
    let killed = Command::new("kill")
        .args(["-9", &victim.to_string()])
        .status();
    assert!(killed.unwrap().success());
    let output = running.wait_with_output().unwrap();
    assert!(!output.status.success(), "the job continues without a rank");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("signal 9"), "{said}");
    assert!(!out.join("summary.json").exists(), "it did not end");

    let kept = out.join(CHECKPOINT);
    let resume = ["--resume", kept.to_str().unwrap()];
    let again = folder.path().join("again");
    done(&job(4, &resume, &[], &again));
    same(&whole, &again, "begun by 3 ranks, ended by 4");
    let (scene, state): (Scene, RunState) = read_checkpoint(&kept, &[]).unwrap();
    let alone = folder.path().join("alone");
    let options = RunOptions::quiet(&alone, 1);
    phyxel_cli::run::resume(&scene, state, &options).unwrap();
    same(&whole, &alone, "begun by 3 ranks, ended by one process");
}

/// Processes that a job has started here.
fn ranks_of(job: u32) -> Vec<u32> {
    let listed = Command::new("ps")
        .args(["-eo", "pid,ppid,comm"])
        .output()
        .unwrap();
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    let rows = listed.lines().filter_map(|line| {
        let mut words = line.split_whitespace();
        let id: u32 = words.next()?.parse().ok()?;
        let parent: u32 = words.next()?.parse().ok()?;
        (parent == job && words.next()?.starts_with("phyxel")).then_some(id)
    });
    rows.collect()
}

#[test]
fn what_is_not_shared_out_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let small = "bodies[0].sampling.target=Nodes(300)";
    let cases = [
        ("integration.scheme=BackwardEuler(step: 1e-3)", "implicit"),
        (
            "bodies[0].material.viscosity=[(ratio: 0.5, time: 0.01)]",
            "viscous",
        ),
        ("bodies[0].material.dilatation=Mean", "mean dilatation"),
    ];
    for (change, word) in cases {
        let output = job(
            2,
            &["block"],
            &[small, "integration.settle=None", change],
            folder.path(),
        );
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{change}");
        assert!(said.contains(word) && said.contains("phyxel run"), "{said}");
    }
    let output = job(2, &["nowhere"], &[], folder.path());
    assert!(!output.status.success());
}

/// Every rank writes its nodes, and the index names them all.
#[test]
fn pieces_hold_every_node_once() {
    let folder = tempfile::tempdir().unwrap();
    let changes = [
        "bodies[0].sampling.target=Nodes(2500)",
        "cuts=[]",
        "pictures=None",
        "integration.settle=None",
        "integration.duration=0.01",
    ];
    done(&job(3, &["block", "--vtu"], &changes, folder.path()));
    let index = text(folder.path(), "nodes.pvtu");
    let mut points = 0;
    for rank in 0..3 {
        let name = format!("nodes-{rank:04}.vtu");
        assert!(index.contains(&name), "{index}");
        let piece = text(folder.path(), &name);
        let (_, after) = piece.split_once("NumberOfPoints=\"").unwrap();
        points += after.split('"').next().unwrap().parse::<usize>().unwrap();
    }
    let summary = text(folder.path(), "summary.json");
    assert!(
        summary.contains(&format!("\"nodes\": {points},")),
        "{points}"
    );
}
