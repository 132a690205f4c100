//! Meshes that are valid and unusual, and meshes that only look valid: their volume is right or they are
//! named.

use crate::common::{binary_stl, cube, join, repaired, soup};
use glam::DVec3;
use phyxel_discretize::{
    Mesh, Primitive, ReadErrorKind, RepairError, RepairSettings, SampleError, SampleSettings,
    SampleTarget, Solid, TextPlace, parse_mesh, repair, sample_points, sample_tetrahedra,
    surface_mesh,
};
use testkit::assert_matches;
use testkit::tol::assert_relative;

fn volume_of(bytes: &[u8]) -> f64 {
    let file = parse_mesh(bytes).unwrap();
    repaired(&file.mesh).1.volume
}

/// An L of three squares of side 2, one thick, with concave floor and ceiling.
const FLOOR: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [4.0, 0.0],
    [4.0, 2.0],
    [2.0, 2.0],
    [2.0, 4.0],
    [0.0, 4.0],
];

/// Its faces, the floor beginning at any corner.
fn faces(first: usize) -> Vec<Vec<usize>> {
    let mut faces = vec![
        (0..6).map(|k| (first + 6 - k) % 6).collect(),
        (0..6).map(|k| 6 + (first + k) % 6).collect(),
    ];
    faces.extend((0..6).map(|k| vec![k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k]));
    faces
}

fn rows(items: impl IntoIterator<Item = String>) -> String {
    items.into_iter().map(|item| item + "\n").collect()
}

fn vertex_rows(prefix: &str) -> String {
    rows(
        [0.0, 1.0]
            .into_iter()
            .flat_map(|z| FLOOR.map(|[x, y]| format!("{prefix}{x} {y} {z}"))),
    )
}

fn face_rows(first: usize, prefix: &str, base: usize, counted: bool, glue: &str) -> String {
    rows(faces(first).into_iter().map(|face| {
        let count = if counted {
            format!("{} ", face.len())
        } else {
            String::new()
        };
        let corners: Vec<String> = face.iter().map(|v| (v + base).to_string()).collect();
        format!("{prefix}{count}{}", corners.join(glue))
    }))
}

#[test]
fn concave_faces_have_their_own_area() {
    for first in 0..6 {
        let obj = vertex_rows("v ") + &face_rows(first, "f ", 1, false, " ");
        let continued = vertex_rows("v ") + &face_rows(first, "f ", 1, false, " \\\n ");
        let windows = continued.replace('\n', "\r\n");
        let off =
            "OFF\n12 8 0\n".to_owned() + &vertex_rows("") + &face_rows(first, "", 0, true, " ");
        let bare = off.replace("OFF\n", "# counts come first\n");
        for text in [&obj, &continued, &windows, &off, &bare] {
            assert_relative("volume", volume_of(text.as_bytes()), 12.0, 0.0, 1e-12);
            let mesh = parse_mesh(text.as_bytes()).unwrap().mesh;
            assert_relative("area", mesh.area(), 24.0 + 16.0, 0.0, 1e-12);
        }
    }
    // The line that is named is the one that the file has.
    let broken = "v 0 0 0\nv 1 0 \\\n0\nv 0 1 x\n";
    let error = parse_mesh(broken.as_bytes()).unwrap_err();
    assert!(error.to_string().starts_with("line 4"), "{error}");
}

#[test]
fn faces_may_come_before_their_vertices() {
    let faces = "element face 8\nproperty list uchar int vertex_indices\n";
    let vertices = "element vertex 12\nproperty float x\nproperty float y\nproperty float z\n";
    let text = format!(
        "ply\nformat ascii 1.0\n{faces}{vertices}end_header\n{}{}",
        face_rows(0, "", 0, true, " "),
        vertex_rows("")
    );
    assert_relative("volume", volume_of(text.as_bytes()), 12.0, 0.0, 1e-12);
    let wild = text.replace("\n6 0", "\n6 12");
    let error = parse_mesh(wild.as_bytes()).unwrap_err().to_string();
    assert!(
        error.ends_with("vertex 12 does not exist, the file has 12"),
        "{error}"
    );
}

#[test]
fn what_follows_a_mesh_is_read_or_refused() {
    let (one, two) = (cube(DVec3::ZERO), cube(DVec3::splat(3.0)));
    let mut both = binary_stl(&one);
    assert_relative("one", volume_of(&both), 1.0, 0.0, 1e-6);
    both.extend(binary_stl(&two));
    assert_relative("two", volume_of(&both), 2.0, 0.0, 1e-6);
    both.extend([0, b'\n']);
    assert_relative("padded", volume_of(&both), 2.0, 0.0, 1e-6);
    both.extend(b"and something else");
    let whole = both.len() - 20;
    let error = parse_mesh(&both).unwrap_err();
    assert_eq!(error.kind, ReadErrorKind::Trailing { bytes: 20 }, "{error}");
    assert_eq!(error.place, TextPlace::Byte(whole), "{error}");
    let off = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
    let volume = volume_of(off.as_bytes());
    assert_relative("tetrahedron", volume, 1.0 / 6.0, 0.0, 1e-12);
    assert!(parse_mesh((off.to_owned() + "# the end\n\n").as_bytes()).is_ok());
    let error = parse_mesh((off.to_owned() + off).as_bytes()).unwrap_err();
    assert_matches!(error.kind, ReadErrorKind::Trailing { .. });
    let ply = phyxel_discretize::ply_mesh(&one);
    let error = parse_mesh(&[&ply[..], &ply[..]].concat()).unwrap_err();
    assert_matches!(error.kind, ReadErrorKind::Trailing { .. });
    let ascii = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
                 endloop\nendfacet\n";
    assert!(parse_mesh((ascii.to_owned() + "endsolid a\n").as_bytes()).is_ok());
    let error = parse_mesh(ascii.as_bytes()).unwrap_err();
    assert_matches!(error.kind, ReadErrorKind::Truncated { .. });
    let error = parse_mesh((ascii.to_owned() + "\u{1}\u{2}\n").as_bytes()).unwrap_err();
    assert_matches!(error.kind, ReadErrorKind::Unexpected { .. });
}

#[test]
fn files_of_another_kind_are_named() {
    for (bytes, word) in [
        (&b""[..], "empty"),
        (b"\xff\xfev\0 \0", "UTF-16"),
        (b"\xfe\xff\0v\0 ", "UTF-16"),
        (b"\x1f\x8b\x08\0\0\0", "gzip"),
        (b"PK\x03\x04....", "zip"),
    ] {
        let error = parse_mesh(bytes).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}

/// Shells in shells: each adds to the body where it parts inside from outside.
#[test]
fn shells_that_add_nothing_are_dropped_and_told() {
    let shell = |half: f64| cube(DVec3::splat(-0.5)).scaled(2.0 * half);
    for (shells, volume, buried, cavities) in [
        (&[(1.0, false), (0.5, false)][..], 8.0, 1, 0),
        (&[(1.0, false), (0.5, true)], 7.0, 0, 1),
        (&[(1.0, true), (0.5, true)], 8.0, 1, 0),
        (&[(1.0, true), (0.5, false)], 7.0, 0, 1),
        (
            &[(1.0, false), (0.8, true), (0.5, false)],
            8.0 - 4.096 + 1.0,
            0,
            1,
        ),
        (&[(1.0, false), (0.8, false), (0.5, true)], 8.0, 2, 0),
        (&[(1.0, false), (1.0, false)], 8.0, 0, 0),
    ] {
        let parts = shells.iter().map(|&(half, flip)| (shell(half), flip));
        let (mesh, report) = repaired(&join(&parts.collect::<Vec<_>>()));
        assert_relative("volume", mesh.volume(), volume, 0.0, 1e-12);
        let found = (report.dropped_buried, report.cavities);
        assert_eq!(found, (buried, cavities), "{shells:?}");
    }
}

/// A tube whose section, an eight, turns over on its path around: a Klein bottle of `across` corners to the
/// section. Its sheets pass through each other along a circle, at corners if there is an even number.
fn klein_bottle(across: u32) -> Mesh {
    let around = 40_u32;
    let angle = |k: u32, n: u32| std::f64::consts::TAU * f64::from(k) / f64::from(n);
    let vertices = (0..around).flat_map(|i| {
        (0..across).map(move |j| {
            let (u, w) = (angle(i, around), angle(j, across));
            let (c, s) = ((u / 2.0).cos(), (u / 2.0).sin());
            let radius = 2.0 + c * w.sin() - s * (2.0 * w).sin();
            let height = s * w.sin() + c * (2.0 * w).sin();
            DVec3::new(radius * u.cos(), radius * u.sin(), height)
        })
    });
    let at = |i: u32, j: u32| {
        let j = if i == around { across - j % across } else { j };
        i % around * across + j % across
    };
    let quads = (0..around).flat_map(|i| (0..across).map(move |j| (i, j)));
    let triangles = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    Mesh {
        vertices: vertices.collect(),
        triangles: triangles.collect(),
    }
}

/// Also where every triangle has corners of its own, as in an STL file, and they are welded.
#[test]
fn a_surface_of_one_side_is_named() {
    // Of an even number of corners the sheets are welded where they pass through each other.
    let even = repair(&klein_bottle(20), &RepairSettings::default());
    assert_matches!(even, Err(RepairError::OneSided { .. }));
    let mesh = klein_bottle(21);
    for mesh in [soup(&mesh), mesh] {
        let odd = repair(&mesh, &RepairSettings::default());
        assert_matches!(odd, Err(RepairError::OneSided { .. }));
    }
}

/// A cuboid, turned about two axes.
fn cuboid(size: DVec3, angle: f64) -> Mesh {
    let mut mesh = cube(DVec3::ZERO);
    let turn = glam::DMat3::from_rotation_x(0.7 * angle) * glam::DMat3::from_rotation_y(angle);
    mesh.vertices
        .iter_mut()
        .for_each(|v| *v = turn * (*v * size));
    mesh
}

/// Too few nodes for a plate or a needle are refused with a finer spacing that does; a spike is named by its end.
#[test]
fn the_spacing_that_is_advised_works() {
    let at = |nodes| SampleSettings::nodes(nodes);
    for (size, angle) in [
        (DVec3::new(1.0, 1.0, 0.06), 0.0),
        (DVec3::new(1.0, 0.7, 0.08), 0.9),
        (DVec3::new(1.0, 0.03, 0.03), 0.0),
        (DVec3::new(1.0, 0.05, 0.04), 0.6),
    ] {
        let solid = Solid::from_mesh(cuboid(size, angle));
        let (found, limit) = match sample_tetrahedra(&solid, &at(100)) {
            Err(SampleError::Vanished { advice, .. }) => {
                let target = SampleTarget::Spacing(advice);
                let settings = SampleSettings { target, ..at(100) };
                (sample_tetrahedra(&solid, &settings).unwrap(), 0.15)
            }
            found => (found.unwrap(), 0.5),
        };
        let off = found.report.volume_error.unwrap();
        assert!(off.abs() < limit, "{size} at {angle}: {off} of the volume");
    }
    let thin = Solid::from_mesh(cuboid(DVec3::new(1.0, 1.0, 1e-3), 0.0));
    let tilted = Solid::from_mesh(cuboid(DVec3::new(1.0, 1.0, 1e-4), 0.8));
    for (solid, nodes) in [(&thin, 1000), (&tilted, 1000), (&tilted, 100_000)] {
        let refused = sample_tetrahedra(solid, &at(nodes)).unwrap_err();
        assert_matches!(refused, SampleError::Slender { .. });
    }
    let mut spike = cuboid(DVec3::ONE, 0.3);
    spike.vertices[7] = DVec3::new(1e7, 1e5, 30.0);
    let refused = sample_tetrahedra(&Solid::from_mesh(spike), &at(6000)).unwrap_err();
    assert_matches!(refused, SampleError::Slender { far, .. } if far.x > 0.9e7);
    let many = sample_tetrahedra(&thin, &at(usize::MAX)).unwrap_err();
    assert_matches!(
        many,
        SampleError::TooFine { .. } | SampleError::Slender { .. }
    );
}

/// One body in millimetres, metres and kilometres, and elsewhere, has the same nodes.
#[test]
fn nodes_do_not_depend_on_the_unit() {
    let odd = DVec3::new(1.0, 0.7, 0.53);
    let egg = Solid::from(Primitive::Ellipsoid { semi_axes: odd });
    let egg = surface_mesh(&egg, 0.2).unwrap();
    for (mesh, settings) in [
        (cuboid(odd, 0.0), SampleSettings::nodes(700)),
        (cuboid(odd, 0.4), SampleSettings::nodes(500)),
        (egg, SampleSettings::nodes(600)),
    ] {
        let one = sample_tetrahedra(&Solid::from_mesh(mesh.clone()), &settings).unwrap();
        let bare = sample_points(&Solid::from_mesh(mesh.clone()), &settings, true).unwrap();
        for scale in [1e-6, 0.3, 1e6] {
            let solid = Solid::from_mesh(mesh.clone().scaled(scale));
            let other = sample_tetrahedra(&solid, &settings).unwrap();
            assert_eq!(one.tetrahedra, other.tetrahedra, "{scale}");
            for (a, b) in one.positions.iter().zip(&other.positions) {
                let miss = (*a * scale).distance(*b) / scale;
                assert!(miss < 1e-9, "{a} and {b} at {scale}");
            }
            let points = sample_points(&solid, &settings, true).unwrap();
            assert_eq!(bare.positions.len(), points.positions.len(), "{scale}");
        }
    }
}
