//! Ways to go wrong.

mod meshes;
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

/// No files.
const NOTHING: &[(&str, &str)] = &[];

fn words(line: &str) -> Vec<String> {
    line.split_whitespace().map(str::to_owned).collect()
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
        arguments: words("run scene.ron --out results/here"),
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

/// A case a row of a table.
fn row_cases(table: &str) -> Vec<Case> {
    let rows = table.lines();
    let rows = rows.filter(|row| !row.is_empty() && !row.starts_with('#'));
    let case = |row: &str| {
        let fields: Vec<&str> = row.split('|').map(str::trim).collect();
        let case = match fields[..] {
            ["changed", name, from, to] => changed(name, from, to),
            ["tool", name, from, to, ..] => tool(name, from, to),
            ["set", name, change, ..] => set(name, change),
            ["plan", name, from, to] => plans::changed(name, from, to),
            ["given", name, line, ref files @ ..] => {
                let files = files.chunks(2).map(|file| (file[0], unescaped(file[1])));
                return given(name, &files.collect::<Vec<_>>(), line);
            }
            ["replay", name, rows] => {
                let content = format!("{RECORDED}{}", unescaped(rows));
                let line = "run block --out results/here --replay in.csv";
                return given(name, &[("in.csv", content)], line);
            }
            _ => panic!("what is '{row}'?"),
        };
        match fields.get(4) {
            Some(more) => case.with(&["--set", more]),
            None => case,
        }
    };
    rows.map(case).collect()
}

/// The header of a recording.
const RECORDED: &str = "step,kind,name,phase,point,x_m,y_m,z_m,qx,qy,qz,qw\n";

fn unescaped(content: &str) -> String {
    let escapes = [("\\n", "\n"), ("\\0", "\0"), ("\\5", "\u{5}")];
    let text = content.to_owned();
    (escapes.iter()).fold(text, |text, (escape, is)| text.replace(escape, is))
}

/// The embedded scene with one override.
fn set(name: &str, change: &str) -> Case {
    Case {
        name: name.to_owned(),
        files: Vec::new(),
        arguments: strings(&["run", "liver", "--out", "results/here", "--set", change]),
    }
}

/// Some files, and the words of a line.
fn given(name: &str, files: &[(&str, impl AsRef<[u8]>)], line: &str) -> Case {
    Case {
        name: name.to_owned(),
        files: files
            .iter()
            .map(|(name, content)| ((*name).to_owned(), content.as_ref().to_vec()))
            .collect(),
        arguments: words(line),
    }
}

/// All of them, in the order of `messages.txt`.
pub(crate) fn cases() -> Vec<Case> {
    let mut cases = row_cases(include_str!("cases/rows.txt"));
    cases.extend(text_cases());
    cases.extend(many_cases());
    cases.extend(row_cases(include_str!("cases/files.txt")));
    cases.extend(meshes::mesh_cases());
    cases.extend(row_cases(include_str!("cases/resumed.txt")));
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
    let json = include_str!("cases/many.json");
    let whole = r#"{"version": 1, "bodies": [{"shape": {"Liver": {"width": -1}}}], "name": "/"}"#;
    vec![
        given(
            "many mistakes",
            &[("scene.ron", &broken)],
            "check scene.ron",
        ),
        given(
            "many mistakes in JSON",
            &[("scene.json", json)],
            "check scene.json",
        ),
        given(
            "values in JSON",
            &[("scene.json", whole)],
            "check scene.json",
        ),
    ]
}

fn text_cases() -> Vec<Case> {
    let half = &SCENE[..SCENE.len() / 2];
    let line = "run scene.ron --out results";
    vec![
        given("truncated scene", &[("scene.ron", half)], line),
        given(
            "not text",
            &[("scene.ron", [0xff, 0xfe, 0x00])],
            "check scene.ron",
        ),
    ]
}
