//! Meshes that cannot be used.

use super::{Case, NOTHING, given};

/// A tetrahedron as OBJ; `vertex` stands for its first vertex and `face` for its last face.
fn tetrahedron(vertex: &str, face: &str) -> String {
    format!("v {vertex}\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n{face}\n")
}

/// A scene of a mesh.
const OF_A_MESH: &str =
    "(version: 1, bodies: [(name: \"organ\", shape: Mesh(file: \"organ.obj\"))])";

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
            "run organ.obj --out results/here",
        ));
        cases.push(given(
            &format!("{name} of a scene"),
            &[("organ.obj", mesh.as_str()), ("scene.ron", OF_A_MESH)],
            "run scene.ron --out results/here",
        ));
    }
    let mut stl = vec![0_u8; 80];
    stl.extend(1000_u32.to_le_bytes());
    stl.extend([0_u8; 70]);
    cases.push(given(
        "truncated binary mesh",
        &[("organ.stl", stl)],
        "run organ.stl --out results/here",
    ));
    cases.push(given("missing mesh", NOTHING, "run organ.obj"));
    cases.push(given(
        "misspelt key beside an open mesh",
        &[("organ.obj", &tetrahedron("0 0 0", ""))],
        "check organ.obj --set gravty=None",
    ));
    let whole = tetrahedron("0 0 0", "f 2 3 4");
    let sample = |name: &str, mesh: &str, more: &str| {
        let line = format!("sample organ.obj {more}");
        given(name, &[("organ.obj", mesh)], &line)
    };
    cases.extend([
        sample("sample: unknown ending", &whole, "--out nodes.txt"),
        sample("sample: no scale", &whole, "--scale 0"),
        sample("sample: no spacing", &whole, "--spacing 0"),
        sample("sample: too fine", &whole, "--spacing 1e-5"),
        sample("sample: open mesh", &tetrahedron("0 0 0", ""), ""),
        sample("sample: empty mesh", "", ""),
    ]);
    cases
}
