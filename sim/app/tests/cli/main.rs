//! The program as a user meets it: what it prints, its exit status and what it leaves behind.
#![allow(
    clippy::unwrap_used,
    reason = "a failing test names its line; messages are given where the values are not in sight"
)]

mod cases;
mod program;
mod reports;
mod sweeps;

use program::Sandbox;

/// Every kind of error: exit status, a line on stderr for each mistake as in `messages.txt`, and no output.
#[test]
fn errors_say_what_where_and_how_to_mend_it() {
    let mut said = String::new();
    for case in cases::cases() {
        let sandbox = Sandbox::new(&case.files);
        let before = sandbox.files();
        let result = sandbox.run_with(&case.arguments);
        assert_eq!(result.status, 1, "{}: {result:?}", case.name);
        assert_eq!(result.stdout, "", "{}", case.name);
        assert_eq!(sandbox.files(), before, "{}: something was left", case.name);
        let lines: Vec<&str> = result.stderr.lines().collect();
        assert!(!lines.is_empty(), "{}", case.name);
        for line in &lines {
            assert!(line.starts_with("error: "), "{}: {line}", case.name);
        }
        said.push_str(&format!(
            "{}\n  phyxel {}\n  {}\n\n",
            case.name,
            case.arguments.join(" "),
            lines.join("\n  ")
        ));
    }
    if std::env::var_os("PHYXEL_BLESS").is_some() {
        std::fs::write("tests/cli/messages.txt", &said).unwrap();
        return;
    }
    let agreed = include_str!("messages.txt");
    for (said, agreed) in said.split("\n\n").zip(agreed.split("\n\n")) {
        assert_eq!(said, agreed, "if the new one is better: PHYXEL_BLESS=1");
    }
    assert!(said == agreed, "cases came or went: PHYXEL_BLESS=1");
}

#[test]
fn scenes_lists_prints_and_documents() {
    let sandbox = Sandbox::empty();
    let list = sandbox.run("scenes");
    assert_eq!(list.status, 0, "{list:?}");
    assert!(list.stdout.starts_with("liver "), "{}", list.stdout);
    let printed = sandbox.run("scenes liver");
    let liver = include_str!("../../../scene/scenes/liver.ron");
    assert_eq!(printed.stdout, liver);
    let keys = sandbox.run("scenes --keys");
    assert_eq!(keys.stdout, include_str!("../../../scene/SCENES.md"));
    // What is printed is a scene to start from.
    let sandbox = Sandbox::new(&[("mine.ron", printed.stdout.as_bytes())]);
    let few = "bodies[0].sampling.target=Nodes(300)";
    let check = sandbox.run(&format!("check mine.ron --set {few}"));
    assert_eq!((check.status, check.stderr.as_str()), (0, ""), "{check:?}");
    // All but what was timed is the same.
    let untimed = |text: &str| -> Vec<String> {
        let lines = text.lines().map(|line| line.split(" %").next().unwrap());
        let is_timed = |line: &&str| line.contains("  all ") || line.contains("  time: ");
        let others = lines.filter(|line| !is_timed(line));
        others.map(str::to_owned).collect()
    };
    let embedded = sandbox.run(&format!("check liver --set {few}"));
    assert_eq!(untimed(&check.stdout), untimed(&embedded.stdout));
}

#[test]
fn sample_fills_a_mesh_with_nodes() {
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    let sandbox = Sandbox::new(&[("organ.obj", mesh)]);
    let vtk = sandbox.run("sample organ.obj --spacing 0.1");
    assert_eq!(vtk.status, 0, "{vtk:?}");
    assert!(vtk.stderr.contains("dihedral angles"), "{}", vtk.stderr);
    let ply = sandbox.run("sample organ.obj --nodes 500 --out a/b.ply --quiet");
    assert_eq!((ply.status, ply.stderr.as_str()), (0, ""), "{ply:?}");
    assert_eq!(
        sandbox.files(),
        ["a/", "a/b.ply", "organ.nodes.vtk", "organ.obj"]
    );
    let vtk = std::fs::read(sandbox.path().join("organ.nodes.vtk")).unwrap();
    assert!(vtk.starts_with(b"# vtk DataFile"), "a VTK file");
    let points = "sample organ.obj --spacing 0.1 --points --refine -0.1,0,0,0.3,0.5";
    let points = sandbox.run(points);
    assert_eq!(points.status, 0, "{points:?}");
    let graded = "sample organ.obj --spacing 0.04 --coarsest 4 --out a/c.vtk";
    let graded = sandbox.run(graded);
    assert_eq!(graded.status, 0, "{graded:?}");
    std::fs::remove_file(sandbox.path().join("a/c.vtk")).unwrap();
    // The surface that was written is a mesh that can be sampled again.
    let again = sandbox.run("sample a/b.ply --nodes 200");
    assert_eq!(again.status, 0, "{again:?}");
}

/// Ctrl-C ends a run between two steps, with a checkpoint to resume from; what it had written stays.
#[cfg(unix)]
#[test]
fn an_interrupted_run_can_be_gone_on_with() {
    let sandbox = Sandbox::empty();
    let line = "run block --out here --quiet --set pictures=None --set bodies[0].sampling.target=Nodes(300) --set cuts=[] \
                --set integration.settle=None --set integration.duration=1e3 --set observe=(history_rate:1,checkpoint:None)";
    let mut child = sandbox.start(line);
    // The folder appears before the first step; a little later the run is on its way.
    while !sandbox.path().join("here/scene.ron").exists() {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let killed = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("--resume here/state.checkpoint"), "{said}");
    let left = [
        "here/",
        "here/history.csv",
        "here/scene.ron",
        "here/state.checkpoint",
    ];
    assert_eq!(sandbox.files(), left);
    let again = "run --resume here/state.checkpoint --set integration.duration=1e-3 --quiet --json";
    let resumed = sandbox.run(again);
    assert_eq!((resumed.status, resumed.stderr.as_str()), (0, ""));
    assert!(sandbox.path().join("here/summary.json").exists());
}

#[test]
fn usage_errors_have_their_own_status() {
    let sandbox = Sandbox::empty();
    let lines = "chek liver|check|run liver --threads 0|run liver --thread 2|scenes liver --keys";
    for line in lines.split('|') {
        let result = sandbox.run(line);
        assert_eq!(result.status, 2, "{line}: {result:?}");
        assert!(result.stderr.starts_with("error: "), "{line}");
        assert_eq!(sandbox.files(), Vec::<String>::new(), "{line}");
    }
}
