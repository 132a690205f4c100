//! Texture coordinates of OBJ and PLY files, and where a point of the surface lies in their images.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec2, DVec3};
use phyxel_discretize::{Hierarchy, TexturedMesh, read_mesh, read_textured_mesh};
use proptest::prelude::*;
use tempfile::TempDir;
use testkit::strategies;

/// Corners (m) of a bent strip: two squares, and an L of six corners whose fan from the first does not cover it.
const CORNERS: [[f64; 3]; 10] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [2.0, 0.0, 0.5],
    [2.0, 1.0, 0.5],
    [3.0, 1.0, 1.0],
    [2.5, 1.0, 0.75],
    [2.5, 0.5, 0.75],
    [3.0, 0.0, 1.0],
];
const FACES: [&[usize]; 3] = [&[0, 1, 2, 3], &[1, 4, 5, 2], &[8, 7, 5, 4, 9]];

/// Texture coordinates, linear in the place, so that they are known everywhere.
fn linear(p: DVec3) -> DVec2 {
    DVec2::new(0.1 + 0.2 * p.x + 0.05 * p.z, 0.9 - 0.3 * p.y + 0.02 * p.x)
}

fn corner(k: usize) -> DVec3 {
    CORNERS[k].into()
}

/// The strip as an OBJ file: coordinates in another order than vertices, negative numbers in the last face.
fn obj(named: bool) -> String {
    let mut text = String::from("mtllib my own.mtl\n");
    for k in 0..CORNERS.len() {
        let p = corner(k);
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for k in (0..CORNERS.len()).rev() {
        let at = linear(corner(k));
        text += &format!("vt {} {} 0\n", at.x, at.y);
    }
    let count = i64::try_from(CORNERS.len()).unwrap();
    for (number, face) in FACES.iter().enumerate() {
        if named {
            text += ["usemtl skin\n", "usemtl other one\n", "usemtl skin\n"][number];
        }
        text += "f";
        for &k in *face {
            let k = i64::try_from(k).unwrap();
            let at = if number == 2 { -1 - k } else { count - k };
            text += &format!(" {}/{at}/1", k + 1);
        }
        text += "\n";
    }
    text
}

const LIBRARY: &str = "# ours\nnewmtl skin\nKd 1 0 0\nmap_Kd -clamp on -s 1 1 1 skin.png\nnewmtl other one\n\
                       map_Kd other skin.png\nnewmtl plain\n";

/// The strip as a PLY file: coordinates by vertex or by face, text or binary.
fn ply(by_face: bool, binary: bool) -> Vec<u8> {
    let format = if binary {
        "binary_little_endian"
    } else {
        "ascii"
    };
    let mut text = format!("ply\nformat {format} 1.0\ncomment TextureFile skin.png\n");
    text += "comment TextureFile other skin.png\n";
    text += &format!("element vertex {}\n", CORNERS.len());
    text += "property double x\nproperty double y\nproperty double z\n";
    if !by_face {
        text += "property double s\nproperty double t\n";
    }
    text += &format!(
        "element face {}\nproperty list uchar int vertex_indices\n",
        FACES.len()
    );
    if by_face {
        text += "property list uchar double texcoord\n";
    }
    text += "property int texnumber\nend_header\n";
    let mut out = text.into_bytes();
    let float = |x: f64, out: &mut Vec<u8>| {
        if binary {
            out.extend(x.to_le_bytes());
        } else {
            out.extend(format!("{x} ").bytes());
        }
    };
    let integer = |x: usize, size: usize, out: &mut Vec<u8>| {
        if binary {
            out.extend(&x.to_le_bytes()[..size]);
        } else {
            out.extend(format!("{x} ").bytes());
        }
    };
    let end = |out: &mut Vec<u8>| {
        if !binary {
            out.push(b'\n');
        }
    };
    for k in 0..CORNERS.len() {
        let p = corner(k);
        p.to_array().into_iter().for_each(|x| float(x, &mut out));
        if !by_face {
            linear(p)
                .to_array()
                .into_iter()
                .for_each(|x| float(x, &mut out));
        }
        end(&mut out);
    }
    for (number, face) in FACES.iter().enumerate() {
        integer(face.len(), 1, &mut out);
        face.iter().for_each(|&k| integer(k, 4, &mut out));
        if by_face {
            integer(2 * face.len(), 1, &mut out);
            for &k in *face {
                linear(corner(k))
                    .to_array()
                    .into_iter()
                    .for_each(|x| float(x, &mut out));
            }
        }
        integer(number % 2, 4, &mut out);
        end(&mut out);
    }
    out
}

fn read(folder: &Path, name: &str, bytes: &[u8]) -> TexturedMesh {
    let file = folder.join(name);
    fs::write(&file, bytes).unwrap();
    let textured = read_textured_mesh(&file).unwrap_or_else(|error| panic!("{error}"));
    let plain = read_mesh(&file).unwrap().mesh;
    assert_eq!(textured.mesh, plain, "{name}: the surface is the same");
    textured
}

/// The strip from each kind of file.
fn strips() -> (TempDir, Vec<(&'static str, TexturedMesh)>) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("my own.mtl"), LIBRARY).unwrap();
    let files = [
        ("strip.obj", obj(true).into_bytes()),
        ("vertices.ply", ply(false, false)),
        ("vertices-binary.ply", ply(false, true)),
        ("faces.ply", ply(true, false)),
        ("faces-binary.ply", ply(true, true)),
    ];
    let all = files.map(|(name, bytes)| (name, read(folder.path(), name, &bytes)));
    (folder, all.into())
}

#[test]
fn faces_get_their_images_whatever_the_file() {
    let (folder, strips) = strips();
    for (name, strip) in &strips {
        let images = ["skin.png", "other skin.png"].map(|image| folder.path().join(image));
        assert_eq!(strip.images, images, "{name}");
        // Two triangles, two triangles, and a polygon of five corners.
        let expected = [0, 0, 1, 1, 0, 0, 0].map(Some);
        assert_eq!(strip.image, expected, "{name}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Coordinates that are linear in the place come out so at every point, with their slopes, and however
    /// the mesh is turned, scaled and moved.
    #[test]
    fn places_of_linear_coordinates_are_exact(
        turn in strategies::rotation(),
        shift in strategies::vector(10.0),
        scale in 1e-3..1e3_f64,
        shares in prop::array::uniform2(0.01..0.99_f64),
    ) {
        let (_folder, strips) = strips();
        let turn = DMat3::from_quat(turn);
        for (name, mut strip) in strips {
            let flat = strip.mesh.clone();
            for v in &mut strip.mesh.vertices {
                *v = turn * *v * scale + shift;
            }
            let hierarchy = Hierarchy::new(&strip.mesh);
            for triangle in 0..flat.triangles.len() {
                let [a, b, c] = flat.corners(triangle);
                let [mut s, mut t] = shares;
                if s + t > 1.0 {
                    [s, t] = [1.0 - s, 1.0 - t];
                }
                let p = a + (b - a) * s + (c - a) * t;
                // Of slopes only those in the surface mean anything.
                let along = [(b - a).normalize(), (c - a).normalize()];
                let x = turn * p * scale + shift;
                let place = strip.place(&hierarchy, x, along.map(|d| turn * d)).unwrap();
                let off = place.at.distance(linear(p));
                prop_assert!(off < 1e-9, "{name}: off by {off:e} at {p}");
                for (d, found) in along.into_iter().zip(place.along) {
                    let exact = (linear(p + d) - linear(p)) / scale;
                    let off = found.distance(exact) * scale;
                    prop_assert!(off < 1e-9, "{name}: slope off by {off:e}");
                }
                prop_assert_eq!(place.image, [0, 0, 1, 1, 0, 0, 0][triangle]);
            }
        }
    }
}

#[test]
fn bad_textures_are_told_in_one_line_with_file_and_place() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| -> PathBuf { folder.path().join(name) };
    fs::write(at("my own.mtl"), LIBRARY).unwrap();
    fs::write(at("moved.mtl"), "newmtl skin\nmap_Kd -s 2 2 1 skin.png\n").unwrap();
    fs::write(at("bare.mtl"), "newmtl skin\nmap_Kd\n").unwrap();
    let strip = obj(true);
    let with = |from: &str, to: &str| strip.replacen(from, to, 1).into_bytes();
    let library = |name: &str| with("my own.mtl", name);
    let plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let ply = |from: &str, to: &str| {
        let text = String::from_utf8(ply(true, false)).unwrap();
        text.replacen(from, to, 1).into_bytes()
    };
    for (bytes, expected) in [
        (plain.into(), "a.mesh: the file has no texture coordinates"),
        (
            obj(false).into(),
            "a.mesh: the file has no image for its texture coordinates",
        ),
        (library("none.mtl"), "none.mtl: cannot read the file"),
        (
            library("moved.mtl"),
            "moved.mtl: line 2: images that are moved or stretched",
        ),
        (
            library("bare.mtl"),
            "bare.mtl: line 2: the file ends where the name of an image",
        ),
        (
            with("usemtl other one", "usemtl third"),
            "a.mesh: line 1: material `third` is in none of the material libraries",
        ),
        (
            with("f 1/10", "f 1/11"),
            "a.mesh: line 23: texture coordinates 11 do not exist, the file has 10",
        ),
        (
            with("5/-5", "5/-11"),
            "a.mesh: line 27: texture coordinates -11 do not exist, the file has 10",
        ),
        (
            with("f 1/10", "f 1/0"),
            "expected a number of texture coordinates from 1, found `0`",
        ),
        (
            with("f 1/10", "f 1/x"),
            "expected the number of texture coordinates, found `x`",
        ),
        (
            ply(" 8 0.1", " 6 0.1"),
            "expected two texture coordinates for each corner, found `6`",
        ),
        (
            ply("comment TextureFile other skin.png\n", ""),
            "expected the number of a TextureFile, from 0, found `1`",
        ),
        (
            b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n".into(),
            "save the mesh as OBJ or PLY",
        ),
    ] {
        let bytes: Vec<u8> = bytes;
        fs::write(at("a.mesh"), &bytes).unwrap();
        let error = read_textured_mesh(&at("a.mesh"))
            .expect_err(expected)
            .to_string();
        assert!(error.contains(expected), "{error}\nwithout: {expected}");
        assert!(!error.contains('\n'), "{error}");
    }
}
