//! Files and meshes that cannot be used.

use super::{Case, given, strings};

/// A body with skin from a file of points.
const SCANNED: &str = "(version: 1, bodies: [(shape: Box(size: (1, 1, 1)), sampling: (target: Nodes(100)), \
     surfels: (points: (file: \"scan.xyz\")))], pictures: ())";

/// A body that asks for more surfels than memory has place for.
const DENSE: &str = "(version: 1, bodies: [(shape: Box(size: (1, 1, 1)), sampling: (target: Nodes(100)), \
     surfels: (target: Density(1e10)))], pictures: ())";

pub(super) fn file_cases() -> Vec<Case> {
    vec![
        given("unknown embedded scene", &[], &["run", "livr"]),
        given(
            "unknown embedded scene to print",
            &[],
            &["scenes", "kidney"],
        ),
        given(
            "surfels beyond number",
            &[("scene.ron", DENSE)],
            &["run", "scene.ron", "--out", "results/here"],
        ),
        given(
            "skin of cuts beyond number",
            &[(
                "scene.ron",
                &DENSE
                    .replace("target: Density", "cut_density: 1e11, target: Density")
                    .replace("(1e10)", "(1e3)"),
            )],
            &["check", "scene.ron"],
        ),
        given(
            "a number whose square is none",
            &[(
                "scene.ron",
                &DENSE.replace("size: (1, 1, 1)", "size: (1, 1e308, 1)"),
            )],
            &["check", "scene.ron"],
        ),
        given(
            "a change that fits nothing, of a mesh that is none",
            &[("organ.obj", "v 0 0")],
            &["check", "organ.obj", "--set", "bodies[0].nonsense=1"],
        ),
        given("missing scene", &[], &["run", "scene.ron"]),
        given(
            "neither scene nor mesh",
            &[("organ.txt", "")],
            &["run", "organ.txt"],
        ),
        given("folder", &[("organ/part.obj", "")], &["run", "organ"]),
        given(
            "missing mesh of a scene",
            &[(
                "deep/scene.ron",
                "(version: 1, bodies: [(shape: Mesh(file: \"meshes/organ.obj\"))])",
            )],
            &["check", "deep/scene.ron"],
        ),
        given(
            "missing image of a scene",
            &[(
                "deep/scene.ron",
                "(version: 1, bodies: [(shape: Box(size: (1, 1, 1)), surfels: (image: (file: \"skin.png\", \
                 size: 0.1)))])",
            )],
            &["check", "deep/scene.ron"],
        ),
        given(
            "missing points of a surface",
            &[(
                "scene.ron",
                "(version: 1, bodies: [(shape: Box(size: (1, 1, 1)), surfels: (points: (file: \"scan.xyz\")))], \
                 pictures: ())",
            )],
            &["run", "scene.ron", "--out", "results/here"],
        ),
        given(
            "points without normals",
            &[("scene.ron", SCANNED), ("scan.xyz", "# x y z\n0.5 0 0\n")],
            &["run", "scene.ron", "--out", "results/here"],
        ),
        given(
            "points of another body",
            &[
                ("scene.ron", SCANNED),
                ("scan.xyz", "500 0 0 1 0 0\n-500 0 0 -1 0 0\n"),
            ],
            &["run", "scene.ron", "--out", "results/here"],
        ),
        given(
            "points of no size",
            &[
                (
                    "scene.ron",
                    "(version: 1, bodies: [(shape: Box(size: (1, 1, 1)),\n surfels: (points: (file: \"scan.xyz\", \
                     scale: 0)))])",
                ),
                ("scan.xyz", "0.5 0 0 1 0 0\n"),
            ],
            &["run", "scene.ron", "--out", "results/here"],
        ),
        given(
            "image of another kind",
            &[
                ("skin.png", "GIF89a"),
                (
                    "scene.ron",
                    "(version: 1, bodies: [(shape: Box(size: (1, 1, 1)), sampling: (target: Nodes(60)), \
                     surfels: (cut_image: (file: \"skin.png\", size: 0.1)))], pictures: ())",
                ),
            ],
            &["run", "scene.ron", "--out", "results/here"],
        ),
        given(
            "file in the way of the output",
            &[("results", "mine")],
            &["run", "liver", "--out", "results"],
        ),
        given(
            "file in the way of a folder above the output",
            &[("results", "mine")],
            &["run", "liver", "--out", "results/deeper/still"],
        ),
    ]
}

/// A tetrahedron as OBJ; `vertex` stands for its first vertex and `face` for its last face.
fn tetrahedron(vertex: &str, face: &str) -> String {
    format!("v {vertex}\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n{face}\n")
}

/// Bad meshes.
pub(super) fn mesh_cases() -> Vec<Case> {
    let mut cases = Vec::new();
    let meshes = [
        ("empty mesh", String::new()),
        ("mesh without faces", "v 0 0 0\nv 1 0 0\n".to_owned()),
        ("open mesh", tetrahedron("0 0 0", "")),
        ("vertex is no number", tetrahedron("nan 0 0", "f 2 3 4")),
        ("missing vertex", tetrahedron("0 0 0", "f 2 3 5")),
        ("truncated mesh", tetrahedron("0 0 0", "f 2 3")),
        (
            "flat mesh",
            tetrahedron("0 0 0", "f 2 3 4").replace("0 0 1", "1 1 0"),
        ),
    ];
    for (name, mesh) in meshes {
        cases.push(given(
            name,
            &[("organ.obj", &mesh)],
            &["run", "organ.obj", "--out", "results/here"],
        ));
        cases.push(given(
            &format!("{name} of a scene"),
            &[
                ("organ.obj", &mesh),
                (
                    "scene.ron",
                    "(version: 1, bodies: [(name: \"organ\", shape: Mesh(file: \"organ.obj\"))])",
                ),
            ],
            &["run", "scene.ron", "--out", "results/here"],
        ));
    }
    let mut stl = vec![0_u8; 80];
    stl.extend(1000_u32.to_le_bytes());
    stl.extend([0_u8; 70]);
    cases.push(Case {
        name: "truncated binary mesh".to_owned(),
        files: vec![("organ.stl".to_owned(), stl)],
        arguments: strings(&["run", "organ.stl", "--out", "results/here"]),
    });
    cases.push(given("missing mesh", &[], &["run", "organ.obj"]));
    cases.push(given(
        "misspelt key beside an open mesh",
        &[("organ.obj", &tetrahedron("0 0 0", ""))],
        &["check", "organ.obj", "--set", "gravty=None"],
    ));
    let whole = tetrahedron("0 0 0", "f 2 3 4");
    let sample = |name: &str, mesh: &str, more: &[&str]| {
        let arguments = [&["sample", "organ.obj"], more].concat();
        given(name, &[("organ.obj", mesh)], &arguments)
    };
    cases.extend([
        sample("sample: unknown ending", &whole, &["--out", "nodes.txt"]),
        sample("sample: no scale", &whole, &["--scale", "0"]),
        sample("sample: no spacing", &whole, &["--spacing", "0"]),
        sample("sample: too fine", &whole, &["--spacing", "1e-5"]),
        sample("sample: open mesh", &tetrahedron("0 0 0", ""), &[]),
        sample("sample: empty mesh", "", &[]),
    ]);
    cases
}
