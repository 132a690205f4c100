//! Ways to go wrong.

/// One of them.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) files: Vec<(String, Vec<u8>)>,
    pub(crate) arguments: Vec<String>,
}

const SCENE: &str = include_str!("base.ron");
const PLAN: &str = include_str!("cases/plan.ron");
/// The header of a recording.
const RECORDED: &str = "step,kind,name,phase,point,x_m,y_m,z_m,qx,qy,qz,qw\n";

/// All of them, in the order of `messages.txt`: a row each.
pub(crate) fn cases() -> Vec<Case> {
    let tables = concat!(
        include_str!("cases/rows.txt"),
        include_str!("cases/files.txt"),
        include_str!("cases/resumed.txt"),
    );
    let is_case = |row: &&str| !row.is_empty() && !row.starts_with('#');
    tables.lines().filter(is_case).map(case).collect()
}

fn case(row: &str) -> Case {
    let fields: Vec<&str> = row.split('|').map(str::trim).collect();
    let case = match fields[..] {
        ["changed", name, ref edits @ ..] => changed(name, edits),
        ["tool", name, from, to, ..] => tool(name, from, to),
        // The embedded scene with one override.
        ["set", name, change, ..] => given(name, &[], "run liver --out results/here").with(change),
        ["plan", name, from, to] => {
            let plan = edited(PLAN, name, &[from, to]);
            let (name, line) = (format!("plan: {name}"), "sweep plan.ron --out results/here");
            given(&name, &[("plan.ron", plan)], line)
        }
        ["given", name, line, ref files @ ..] => {
            let files = files.chunks(2).map(|file| (file[0], content(file[1])));
            given(name, &files.collect::<Vec<_>>(), line)
        }
        ["replay", name, rows] => {
            let rows = [RECORDED.as_bytes(), &content(rows)].concat();
            let line = "run block --out results/here --replay in.csv";
            given(name, &[("in.csv", rows)], line)
        }
        _ => panic!("what is '{row}'?"),
    };
    match (fields[0], fields.get(4)) {
        ("tool" | "set", Some(change)) => case.with(change),
        _ => case,
    }
}

impl Case {
    /// The same with an override.
    fn with(mut self, change: &str) -> Self {
        self.arguments.extend(["--set", change].map(str::to_owned));
        self
    }
}

/// Some files, and the words of a line.
fn given(name: &str, files: &[(&str, Vec<u8>)], line: &str) -> Case {
    let files = files.iter().cloned();
    Case {
        name: name.to_owned(),
        files: files
            .map(|(name, content)| (name.to_owned(), content))
            .collect(),
        arguments: line.split_whitespace().map(str::to_owned).collect(),
    }
}

/// A text with each other of some texts replaced by the next.
fn edited(text: &str, name: &str, edits: &[&str]) -> Vec<u8> {
    let mut text = text.to_owned();
    for edit in edits.chunks(2) {
        assert!(text.contains(edit[0]), "{name}: there is no '{}'", edit[0]);
        text = text.replacen(edit[0], edit[1], 1);
    }
    text.into_bytes()
}

/// The valid scene edited, in a file that is run.
fn changed(name: &str, edits: &[&str]) -> Case {
    let scene = edited(SCENE, name, edits);
    let line = "run scene.ron --out results/here";
    given(name, &[("scene.ron", scene)], line)
}

/// The same with a tool, of which `from` is replaced; more keys where that is empty.
fn tool(name: &str, from: &str, to: &str) -> Case {
    let tool = "tools: [(shape: Sphere(radius: 0.01), path: [(time: 0)])], ";
    let tool = if from.is_empty() {
        tool.replacen("tools: [(", &format!("tools: [({to} "), 1)
    } else {
        String::from_utf8(edited(tool, name, &[from, to])).unwrap()
    };
    changed(name, &["cuts: [", &format!("{tool}cuts: [")])
}

/// What a field says of a file: its text, or the file beside the tables that has it.
fn content(field: &str) -> Vec<u8> {
    if let Some(name) = field.strip_prefix('@') {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cli/cases");
        return std::fs::read(std::path::Path::new(folder).join(name)).unwrap();
    }
    let magic = std::str::from_utf8(phyxel_cli::output::CHECKPOINT_MAGIC).unwrap();
    let escapes = [
        ("\\n", "\n"),
        ("\\0", "\0"),
        ("\\5", "\u{5}"),
        ("\\M", magic),
    ];
    let text = (escapes.iter()).fold(field.to_owned(), |text, (escape, is)| {
        text.replace(escape, is)
    });
    text.into_bytes()
}
