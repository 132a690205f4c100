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
    let mut cases = text_cases();
    cases.extend(many_cases());
    cases.extend(value_cases());
    cases.extend(model_cases());
    cases.extend(override_cases());
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
            &[("a.checkpoint", "phyxel checkpoint 6\n\u{5}\0\0")],
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
        set("too coarse inside", "bodies[0].sampling.coarsest=40"),
        set(
            "lattice of a liver",
            "bodies[0].sampling.target=Lattice(8, 8, 22)",
        ),
        set("picture of splats of no size", "pictures.splat_scale=0"),
        set(
            "refined to nothing",
            "bodies[0].sampling.refine=[(from: (0, 0, 0), to: (0, 0, 0), radius: 0.01, factor: 0)]",
        ),
        set("too much mass moved", "bodies[0].moved_mass=0.5"),
        set("too much damping", "bodies[0].damping_ratio=1.5"),
        set("no time between checkpoints", "observe.checkpoint=Some(0)"),
    ]
}

fn text_cases() -> Vec<Case> {
    vec![
        changed("misspelt key", "youngs_modulus", "young_modulus"),
        changed("key of nothing", "density:", "colour: 3, density:"),
        changed("misspelt top key", "bodies:", "bodys:"),
        changed("misspelt shape", "Liver(", "Livre("),
        changed("misspelt capture", "Rate(60)", "Rat(60)"),
        changed("missing key", "shape: Liver(width: 0.166),", ""),
        changed("missing version", "version: 1,", ""),
        changed("key twice", "density:", "density: 1, density:"),
        changed(
            "text for a number",
            "poissons_ratio: 0.45",
            "poissons_ratio: \"0.45\"",
        ),
        changed(
            "missing comma",
            "poissons_ratio: 0.45,",
            "poissons_ratio: 0.45",
        ),
        changed("fraction of a node", "Nodes(6000)", "Nodes(6000.5)"),
        changed("negative number of nodes", "Nodes(6000)", "Nodes(-6000)"),
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
        changed("later version", "version: 1", "version: 2"),
    ]
}

fn value_cases() -> Vec<Case> {
    vec![
        changed(
            "negative modulus",
            "youngs_modulus: 5e3",
            "youngs_modulus: -5e3",
        ),
        changed(
            "modulus is no number",
            "youngs_modulus: 5e3",
            "youngs_modulus: NaN",
        ),
        changed(
            "incompressible",
            "poissons_ratio: 0.45",
            "poissons_ratio: 0.5",
        ),
        changed("no density", "density: 1060", "density: 0"),
        changed("zero spacing", "Nodes(6000)", "Spacing(0)"),
        changed("too fine", "Nodes(6000)", "Spacing(0.0001)"),
        changed("too many nodes", "Nodes(6000)", "Nodes(6000000)"),
        changed("no width", "width: 0.166", "width: -0.166"),
        given(
            "no body",
            &[("scene.ron", "(version: 1, bodies: [])")],
            &["check", "scene.ron"],
        ),
        changed(
            "zero normal",
            "Box(min: (-0.05, 0.025, -1), max: (0.03, 1, 1))",
            "HalfSpace(point: (0, 0, 0), normal: (0, 0, 0))",
        ),
        changed("inverted box", "max: (0.03, 1, 1)", "max: (0.03, 1, -2)"),
        changed("keys out of order", "time: 1.5", "time: 0.1"),
        changed("time before the start", "time: 0.1", "time: -0.1"),
        changed("cut after the end", "time: 2.8", "time: 28"),
        changed(
            "blade of one point",
            "edge: [(0, 0, 0), (0, 0, 0.12)]",
            "edge: [(0, 0, 0)]",
        ),
        changed("no capture rate", "Rate(60)", "Rate(0)"),
        changed("captures without end", "Rate(60)", "Distance(1e-9)"),
        tool("tool of another body", "", "body: \"livre\","),
        tool("rough tool", "", "friction: -0.1,"),
        tool("tool without size", "radius: 0.01", "radius: 0"),
        tool(
            "released tool on a path",
            "(time: 0)]",
            "(time: 0), (time: 1)], release: (mass: 1)",
        ),
        tool("released tool without mass", "", "release: (mass: 0),"),
        tool("misspelt tool shape", "Sphere", "Spere"),
        given(
            "too many rows of forces",
            &[],
            &[
                "run",
                "press",
                "--out",
                "results/here",
                "--set",
                "observe.force_rate=1e9",
            ],
        ),
        changed(
            "misspelt body",
            "name: \"incision\"",
            "name: \"incision\", body: \"livr\"",
        ),
        changed(
            "two cuts of a name",
            "name: \"resection\"",
            "name: \"incision\"",
        ),
        changed(
            "step beyond stability",
            "step_factor: 0.5",
            "step_factor: 1.5",
        ),
        changed("endless run", "duration: 3.3", "duration: inf"),
        changed("frames without end", "rate: 25", "rate: 1e9"),
        changed("no picture", "width: 960", "width: 0"),
        changed("huge picture", "width: 960", "width: 4000000"),
        changed("zoom to nothing", "zoom: 1.1", "zoom: 0"),
        changed(
            "name that is a path",
            "name: \"liver\"",
            "name: \"../liver\"",
        ),
    ]
}

/// Materials, methods and schemes that do not go together, for the embedded liver.
fn model_cases() -> Vec<Case> {
    vec![
        changed(
            "misspelt model",
            "density: 1060",
            "density: 1060, model: NeoHokean",
        ),
        changed(
            "too much of the second coefficient",
            "density: 1060",
            "density: 1060, model: MooneyRivlin(share: 1.5)",
        ),
        changed(
            "fibres without direction",
            "density: 1060",
            "density: 1060, fiber: (direction: (0, 0, 0), stiffness: 1e4)",
        ),
        changed(
            "fibres spread too far",
            "density: 1060",
            "density: 1060, fiber: (direction: (1, 0, 0), stiffness: 1e4, dispersion: 0.5)",
        ),
        changed(
            "five terms of viscosity",
            "density: 1060",
            "density: 1060, viscosity: [(ratio: 1, time: 1), (ratio: 1, time: 1), (ratio: 1, time: 1), \
             (ratio: 1, time: 1), (ratio: 1, time: 1)]",
        ),
        changed(
            "viscosity without time",
            "density: 1060",
            "density: 1060, viscosity: [(ratio: 1, time: 0)]",
        ),
        changed(
            "negative volume constant",
            "density: 1060",
            "density: 1060, volume_constant: -1",
        ),
        changed(
            "mean dilatation of another model",
            "density: 1060",
            "density: 1060, model: SaintVenantKirchhoff, dilatation: Mean",
        ),
        changed(
            "inclusion without stiffness",
            "damping: 3",
            "inclusions: [(region: Sphere(center: (0, 0, 0), radius: 0.01), youngs_modulus: 0)], damping: 3",
        ),
        changed(
            "inclusion without size",
            "damping: 3",
            "inclusions: [(region: Sphere(center: (0, 0, 0), radius: 0))], damping: 3",
        ),
        set(
            "dissertation's method with control",
            "bodies[0].method=Dissertation()",
        ),
        set(
            "too few neighbours",
            "bodies[0].method=Dissertation(neighbor_limit: 3)",
        ),
        set(
            "support of nothing",
            "bodies[0].method=Dissertation(support_scale: 0)",
        ),
        set(
            "no influence radius",
            "bodies[0].cut_rule=Diffraction(influence_radius: 0)",
        ),
        set(
            "former name of a rule",
            "bodies[0].cut_rule=Detour(reach: 2)",
        ),
        set(
            "former name of a rule's key",
            "bodies[0].cut_rule=Diffraction(reach: 2)",
        ),
        set("misspelt rule", "bodies[0].cut_rule=Difraction()"),
        set(
            "grid without spacing",
            "bodies[0].cut_rule=Grid(spacing: 0)",
        ),
        set(
            "grid without cells",
            "bodies[0].cut_rule=Grid(cells: (8, 0, 8))",
        ),
        set("precision", "bodies[0].precision=Single"),
        set(
            "implicit scheme with viscous damping",
            "integration.scheme=EnergyMomentum()",
        )
        .with(&["--set", "bodies[0].damping_ratio=0.1"]),
        set(
            "implicit scheme without step",
            "integration.scheme=BackwardEuler(step: 0)",
        ),
        set(
            "implicit scheme without tolerance",
            "integration.scheme=BackwardEuler(tolerance: 1)",
        ),
        tool(
            "implicit scheme with a released tool",
            "",
            "release: (mass: 1),",
        )
        .with(&["--set", "integration.scheme=EnergyMomentum()"]),
        tool("equilibrium with a tool", "", "")
            .with(&["--set", "integration.settle.rest=Equilibrium"]),
        set("surfels on no node", "bodies[0].surfels.nodes=0"),
        set("cut closed beyond itself", "bodies[0].surfels.opening=-1"),
        set(
            "surfels of no radius",
            "bodies[0].surfels.radius=Constant(0)",
        ),
        set(
            "surfels smaller than the smallest",
            "bodies[0].surfels.radius=Mapped(measure: Density, least: 0.01, most: 0.001)",
        ),
        set("misspelt mode", "pictures.mode=Disk"),
        set(
            "rigid surface without its file",
            "pictures.meshes=[(file: \"bones.obj\")]",
        ),
        set("texture without a mesh", "bodies[0].surfels.textured=true"),
        tool(
            "looks without their file",
            "",
            "looks: (file: \"bones.obj\"),",
        ),
    ]
}

fn override_cases() -> Vec<Case> {
    vec![
        set(
            "override: misspelt key",
            "bodies[0].material.youngs_modulsu=3e3",
        ),
        set(
            "override: negative modulus",
            "bodies[0].material.youngs_modulus=-3e3",
        ),
        set(
            "override: no number",
            "bodies[0].material.youngs_modulus=soft",
        ),
        set("override: no such body", "bodies[1].damping=1"),
        set("override: part of a number", "bodies[0].damping.x=1"),
        set("override: no value", "bodies[0].damping"),
        set("override: no path", "bodies[0]..damping=1"),
        set("override: two values", "bodies[0].damping=1, name: 2"),
        set(
            "override: too fine",
            "bodies[0].sampling.target=Spacing(1e-4)",
        ),
        set(
            "override: missing mesh",
            "bodies[0].shape=Mesh(file: \"organ.obj\")",
        ),
    ]
}
