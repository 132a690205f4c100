//! Ways to go wrong.

mod files;
mod plans;

/// One of them.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) files: Vec<(String, Vec<u8>)>,
    pub(crate) arguments: Vec<String>,
}

const SCENE: &str = include_str!("base.ron");

fn strings(items: &[&str]) -> Vec<String> {
    items.iter().map(|&item| item.to_owned()).collect()
}

/// The valid scene with `from` replaced, in a file that is run.
fn changed(name: &str, from: &str, to: &str) -> Case {
    assert!(SCENE.contains(from), "{name}: the scene has no '{from}'");
    Case {
        name: name.to_owned(),
        files: vec![(
            "scene.ron".to_owned(),
            SCENE.replacen(from, to, 1).into_bytes(),
        )],
        arguments: strings(&["run", "scene.ron", "--out", "results/here"]),
    }
}

impl Case {
    /// The same with more arguments.
    fn with(mut self, arguments: &[&str]) -> Self {
        self.arguments.extend(strings(arguments));
        self
    }
}

/// The same with a tool, of which `from` is replaced; more keys where that is empty.
fn tool(name: &str, from: &str, to: &str) -> Case {
    let tool = "tools: [(shape: Sphere(radius: 0.01), path: [(time: 0)])], ";
    let tool = if from.is_empty() {
        tool.replacen("tools: [(", &format!("tools: [({to} "), 1)
    } else {
        assert!(tool.contains(from), "{name}: the tool has no '{from}'");
        tool.replacen(from, to, 1)
    };
    changed(name, "cuts: [", &format!("{tool}cuts: ["))
}

/// A case a row of `rows.txt`.
fn row_cases() -> Vec<Case> {
    let rows = include_str!("cases/rows.txt").lines();
    let rows = rows.filter(|row| !row.is_empty() && !row.starts_with('#'));
    let case = |row: &str| {
        let fields: Vec<&str> = row.split('|').map(str::trim).collect();
        let case = match fields[..] {
            ["changed", name, from, to] => changed(name, from, to),
            ["tool", name, from, to, ..] => tool(name, from, to),
            ["set", name, change, ..] => set(name, change),
            ["plan", name, from, to] => plans::changed(name, from, to),
            _ => panic!("what is '{row}'?"),
        };
        match fields.get(4) {
            Some(more) => case.with(&["--set", more]),
            None => case,
        }
    };
    rows.map(case).collect()
}

/// The embedded scene with one override.
fn set(name: &str, change: &str) -> Case {
    Case {
        name: name.to_owned(),
        files: Vec::new(),
        arguments: strings(&["run", "liver", "--out", "results/here", "--set", change]),
    }
}

fn given(name: &str, files: &[(&str, &str)], arguments: &[&str]) -> Case {
    Case {
        name: name.to_owned(),
        files: files
            .iter()
            .map(|&(name, content)| (name.to_owned(), content.as_bytes().to_vec()))
            .collect(),
        arguments: strings(arguments),
    }
}

/// All of them, in the order of `messages.txt`.
pub(crate) fn cases() -> Vec<Case> {
    let mut cases = row_cases();
    cases.extend(text_cases());
    cases.extend(many_cases());
    cases.extend(files::file_cases());
    cases.extend(files::mesh_cases());
    cases.extend(resume_cases());
    cases.extend(replay_cases());
    cases.extend(plans::plan_cases());
    cases
}

/// Several mistakes in one scene.
fn many_cases() -> Vec<Case> {
    let edits = [
        ("description: ", "descripton: "),
        ("Liver(width: 0.166)", "Liver(width: -0.166)"),
        ("Nodes(6000)", "Nodes(6000.5)"),
        ("youngs_modulus: 5e3", "youngs_modulus: NaN"),
        ("damping: 3", "damping: \"much\""),
        ("region: Box(min: ", "region: Bix(min: "),
        ("gravity: (", "colour: 3, gravity: ("),
        (
            "edge: [(0, 0, 0), (0, 0, 0.12)]",
            "edge: [(0, 0), (0, 0, 0.12)]",
        ),
        ("step_factor: 0.5", "step_factor: 5"),
    ];
    let broken = edits.iter().fold(SCENE.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "the scene has no '{from}'");
        text.replacen(from, to, 1)
    });
    let json = r#"{
  "version": 1,
  "bodies": [
    {"name": "a", "shape": {"Liver": {"width": -1}}, "dampin": 3},
    {"name": "b", "shape": {"Bix": {"size": [1, 2, "3"]}}, "scale": true}
  ],
  "gravity": {"acceleration": [0, 0]},
  "supports": [{}],
  "integration": {"scheme": "Verlet", "duration": -2}
}
"#;
    let whole = r#"{"version": 1, "bodies": [{"shape": {"Liver": {"width": -1}}}], "name": "/"}"#;
    vec![
        given(
            "many mistakes",
            &[("scene.ron", &broken)],
            &["check", "scene.ron"],
        ),
        given(
            "many mistakes in JSON",
            &[("scene.json", json)],
            &["check", "scene.json"],
        ),
        given(
            "values in JSON",
            &[("scene.json", whole)],
            &["check", "scene.json"],
        ),
    ]
}

/// Recordings that do not fit, for the embedded block.
fn replay_cases() -> Vec<Case> {
    const HEADER: &str = "step,kind,name,phase,point,x_m,y_m,z_m,qx,qy,qz,qw\n";
    let replay = |name: &str, rows: &str| {
        let content = format!("{HEADER}{rows}");
        let arguments = [
            "run",
            "block",
            "--out",
            "results/here",
            "--replay",
            "in.csv",
        ];
        given(name, &[("in.csv", content.as_str())], &arguments)
    };
    let fine = "1,blade,from the left,Start,0,0,0,0,,,,\n";
    vec![
        given(
            "recording that is not there",
            &[],
            &["run", "block", "--replay", "in.csv"],
        ),
        replay(
            "recording of another cut",
            "1,blade,from the leftt,Start,0,0,0,0,,,,\n",
        ),
        replay(
            "recording without a phase",
            "1,blade,from the left,,0,0,0,0,,,,\n",
        ),
        replay("recording of a tool", "1,tool,probe,,0,0,0,0,0,0,0,1\n"),
        replay("recording with a gap", &fine.replace("Start,0", "Start,1")),
        replay("recording of half an edge", fine),
        replay(
            "recording with a word",
            &fine.replace(",0,0,0,,", ",0,x,0,,"),
        ),
        replay(
            "recording out of order",
            &format!("{fine}{}", fine.replace("1,b", "0,b")),
        ),
        replay(
            "recording of nowhere",
            &fine.replace(",0,0,0,,", ",0,0,NaN,,"),
        ),
        replay("recording cut short", &fine[..20]),
    ]
}

fn resume_cases() -> Vec<Case> {
    let resume = ["run", "--resume", "a.checkpoint"];
    vec![
        given("checkpoint that is not there", &[], &resume),
        given(
            "checkpoint of something else",
            &[("a.checkpoint", "a text")],
            &resume,
        ),
        given(
            "checkpoint cut short",
            &[("a.checkpoint", "phyxel checkpoint 9\n\u{5}\0\0")],
            &resume,
        ),
        given(
            "checkpoint of another format",
            &[("a.checkpoint", "phyxel checkpoint 1\n\u{5}\0\0")],
            &resume,
        ),
        given(
            "checkpoint with a scene",
            &[],
            &["run", "liver", "--resume", "a.checkpoint"],
        ),
        given(
            "checkpoint with another body",
            &[],
            &[
                "run",
                "--resume",
                "a.checkpoint",
                "--set",
                "bodies[0].damping=1",
            ],
        ),
    ]
}

fn text_cases() -> Vec<Case> {
    vec![
        given(
            "truncated scene",
            &[("scene.ron", &SCENE[..SCENE.len() / 2])],
            &["run", "scene.ron", "--out", "results"],
        ),
        given(
            "empty scene",
            &[("scene.ron", "")],
            &["run", "scene.ron", "--out", "results"],
        ),
        given(
            "something else",
            &[("scene.ron", "# YAML\nbodies:\n  - liver\n")],
            &["check", "scene.ron"],
        ),
        Case {
            name: "not text".to_owned(),
            files: vec![("scene.ron".to_owned(), vec![0xff, 0xfe, 0x00])],
            arguments: strings(&["check", "scene.ron"]),
        },
        given(
            "no body",
            &[("scene.ron", "(version: 1, bodies: [])")],
            &["check", "scene.ron"],
        ),
        given(
            "too many rows of forces",
            &[],
            &["check", "press", "--set", "observe.force_rate=1e9"],
        ),
    ]
}
