//! Surfaces as files of every format.

use std::fmt::Write;

use crate::shapes::Surface;
use testkit::cloud::Random;

/// A file's content and ending.
pub(crate) fn written(surface: &Surface, random: &mut Random) -> (Vec<u8>, &'static str) {
    match random.below(8) {
        0 => (obj(surface, random), "obj"),
        1 => (off(surface, random), "off"),
        2 => (stl_text(surface), "stl"),
        3 => (stl(surface), "stl"),
        4 => (ply_text(surface, random), "ply"),
        5 => (ply_binary(surface, random), "ply"),
        6 => (vtk(surface), "vtk"),
        _ => (gmsh(surface), "msh"),
    }
}

fn numbers(items: impl IntoIterator<Item = usize>) -> String {
    let words: Vec<String> = items.into_iter().map(|item| item.to_string()).collect();
    words.join(" ")
}

fn vertices(out: &mut String, surface: &Surface, prefix: &str) {
    for v in &surface.vertices {
        writeln!(out, "{prefix}{:?} {:?} {:?}", v.x, v.y, v.z).unwrap();
    }
}

fn faces(out: &mut String, surface: &Surface) {
    for face in &surface.faces {
        writeln!(out, "{} {}", face.len(), numbers(face.iter().copied())).unwrap();
    }
}

fn obj(surface: &Surface, random: &mut Random) -> Vec<u8> {
    let mut out = String::from("# a body\n");
    vertices(&mut out, surface, "v ");
    let break_lines = random.chance(0.2);
    for face in &surface.faces {
        let text = numbers(face.iter().map(|v| v + 1));
        let text = text.replace(' ', if break_lines { " \\\n " } else { " " });
        writeln!(out, "f {text}").unwrap();
    }
    out.into_bytes()
}

fn off(surface: &Surface, random: &mut Random) -> Vec<u8> {
    let keyword = if random.chance(0.8) { "OFF\n" } else { "" };
    let counts = (surface.vertices.len(), surface.faces.len());
    let mut out = format!("{keyword}{} {} 0\n", counts.0, counts.1);
    vertices(&mut out, surface, "");
    faces(&mut out, surface);
    out.into_bytes()
}

/// The triangles of fans; concave faces have theirs from a corner that sees the others.
fn triangles(surface: &Surface) -> Vec<[usize; 3]> {
    let fans = surface.faces.iter().flat_map(|face| {
        let n = face.len();
        let at = |k: usize| surface.vertices[face[k % n]];
        let normal = |first: usize, k: usize| {
            (at(first + k) - at(first)).cross(at(first + k + 1) - at(first))
        };
        let whole: glam::DVec3 = (1..n.saturating_sub(1)).map(|k| normal(0, k)).sum();
        let good =
            |first: &usize| (1..n.saturating_sub(1)).all(|k| normal(*first, k).dot(whole) >= 0.0);
        let first = (0..n).find(good).unwrap_or(0);
        (1..n.saturating_sub(1))
            .map(move |k| [first, first + k, first + k + 1].map(|k| face[k % n]))
    });
    fans.collect()
}

/// Whether fans cover the faces: a star with many points has no corner that sees all others.
pub(crate) fn is_covered_by_fans(surface: &Surface) -> bool {
    let fanned = Surface {
        vertices: surface.vertices.clone(),
        faces: triangles(surface).iter().map(|t| t.to_vec()).collect(),
    };
    (fanned.volume() / surface.volume() - 1.0).abs() < 1e-9
        && surface.faces.iter().all(|f| f.len() < 7)
}

fn stl_text(surface: &Surface) -> Vec<u8> {
    let mut out = String::from("solid body\n");
    for triangle in triangles(surface) {
        out.push_str("facet normal 0 0 0\nouter loop\n");
        for v in triangle {
            let p = surface.vertices[v];
            writeln!(out, "vertex {:?} {:?} {:?}", p.x, p.y, p.z).unwrap();
        }
        out.push_str("endloop\nendfacet\n");
    }
    out.push_str("endsolid body\n");
    out.into_bytes()
}

fn stl(surface: &Surface) -> Vec<u8> {
    let triangles = triangles(surface);
    let mut out = vec![b' '; 80];
    out.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        out.extend([0; 12]);
        for v in triangle {
            let p = surface.vertices[v].as_vec3();
            out.extend(p.to_array().iter().flat_map(|x| x.to_le_bytes()));
        }
        out.extend([0; 2]);
    }
    out
}

fn ply_header(surface: &Surface, format: &str, first: bool) -> String {
    let vertex = format!(
        "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n",
        surface.vertices.len()
    );
    let face = format!(
        "element face {}\nproperty list uchar int vertex_indices\n",
        surface.faces.len()
    );
    let elements = if first {
        vertex + &face
    } else {
        face + &vertex
    };
    format!("ply\nformat {format} 1.0\n{elements}end_header\n")
}

fn ply_text(surface: &Surface, random: &mut Random) -> Vec<u8> {
    let first = random.chance(0.7);
    let mut out = ply_header(surface, "ascii", first);
    if first {
        vertices(&mut out, surface, "");
        faces(&mut out, surface);
    } else {
        faces(&mut out, surface);
        vertices(&mut out, surface, "");
    }
    out.into_bytes()
}

fn ply_binary(surface: &Surface, random: &mut Random) -> Vec<u8> {
    let (first, big) = (random.chance(0.7), random.chance(0.5));
    let format = if big {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    };
    let places = surface.vertices.iter().flat_map(|v| v.to_array());
    let places = places.flat_map(|x| {
        if big {
            x.to_be_bytes()
        } else {
            x.to_le_bytes()
        }
    });
    let corners = surface.faces.iter().flat_map(|face| {
        let corners = face.iter().flat_map(move |v| {
            let v = i32::try_from(*v).expect("few vertices");
            if big {
                v.to_be_bytes()
            } else {
                v.to_le_bytes()
            }
        });
        std::iter::once(face.len() as u8).chain(corners)
    });
    let mut out = ply_header(surface, format, first).into_bytes();
    if first {
        out.extend(places.chain(corners));
    } else {
        out.extend(corners.chain(places));
    }
    out
}

fn vtk(surface: &Surface) -> Vec<u8> {
    let size: usize = surface.faces.iter().map(|face| face.len() + 1).sum();
    let mut out = format!(
        "# vtk DataFile Version 3.0\nbody\nASCII\nDATASET POLYDATA\nPOINTS {} double\n",
        surface.vertices.len()
    );
    vertices(&mut out, surface, "");
    writeln!(out, "POLYGONS {} {size}", surface.faces.len()).unwrap();
    faces(&mut out, surface);
    out.into_bytes()
}

fn gmsh(surface: &Surface) -> Vec<u8> {
    let triangles = triangles(surface);
    let mut out = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n");
    writeln!(out, "{}", surface.vertices.len()).unwrap();
    for (k, v) in surface.vertices.iter().enumerate() {
        writeln!(out, "{} {:?} {:?} {:?}", k + 1, v.x, v.y, v.z).unwrap();
    }
    writeln!(out, "$EndNodes\n$Elements\n{}", triangles.len()).unwrap();
    for (k, triangle) in triangles.iter().enumerate() {
        let corners = numbers(triangle.map(|v| v + 1));
        writeln!(out, "{} 2 2 0 1 {corners}", k + 1).unwrap();
    }
    out.push_str("$EndElements\n");
    out.into_bytes()
}
