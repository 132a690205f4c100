//! Writing surfaces, surfels and samplings for ParaView and other programs.

use glam::DVec3;

use crate::mesh::{Mesh, SurfaceSamples, index};

/// Values at nodes for [`vtk_tetrahedra`].
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Field<'a> {
    /// One number per node.
    Scalars(&'a [f64]),
    /// One vector per node.
    Vectors(&'a [DVec3]),
}

/// A surface as binary little-endian PLY with double coordinates.
#[must_use]
pub fn ply_mesh(mesh: &Mesh) -> Vec<u8> {
    let faces = mesh.triangles.len();
    let faces = format!("element face {faces}\nproperty list uchar uint vertex_indices\n");
    let mut out = ply_header(mesh.vertices.len(), "x y z", &faces);
    for x in mesh.vertices.iter().flat_map(|p| p.to_array()) {
        out.extend(x.to_le_bytes());
    }
    for t in &mesh.triangles {
        out.push(3);
        t.iter().for_each(|v| out.extend(v.to_le_bytes()));
    }
    out
}

/// The header of vertices with properties, words of a text, and of what follows them.
fn ply_header(vertices: usize, properties: &str, rest: &str) -> Vec<u8> {
    let properties = properties.split(' ');
    let properties: String = properties
        .map(|p| format!("property double {p}\n"))
        .collect();
    let head = format!("ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n");
    (head + &properties + rest + "end_header\n").into_bytes()
}

/// Surfels as binary little-endian PLY: position, normal, area.
#[must_use]
pub fn ply_surfels(surfels: &SurfaceSamples) -> Vec<u8> {
    let mut out = ply_header(surfels.positions.len(), "x y z nx ny nz area", "");
    let vectors = surfels.positions.iter().zip(&surfels.normals);
    for ((p, n), a) in vectors.zip(&surfels.areas) {
        let values = p.to_array().into_iter().chain(n.to_array()).chain([*a]);
        values.for_each(|x| out.extend(x.to_le_bytes()));
    }
    out
}

/// Tetrahedra with fields at their nodes as binary legacy VTK (unstructured grid). Spaces in field
/// names become underscores.
///
/// # Panics
/// If a field has not one value per node.
#[must_use]
pub fn vtk_tetrahedra(
    positions: &[DVec3],
    tetrahedra: &[[u32; 4]],
    fields: &[(&str, Field<'_>)],
) -> Vec<u8> {
    vtk_cells(positions, tetrahedra, 10, fields)
}

/// Points with fields as binary legacy VTK (unstructured grid of vertices). Spaces in field names
/// become underscores.
///
/// # Panics
/// If a field has not one value per node.
#[must_use]
pub fn vtk_points(positions: &[DVec3], fields: &[(&str, Field<'_>)]) -> Vec<u8> {
    let cells: Vec<[u32; 1]> = (0..positions.len()).map(|v| [index(v)]).collect();
    vtk_cells(positions, &cells, 1, fields)
}

/// Cells of one VTK type.
fn vtk_cells<const N: usize>(
    positions: &[DVec3],
    cells: &[[u32; N]],
    kind: u32,
    fields: &[(&str, Field<'_>)],
) -> Vec<u8> {
    let mut out = format!(
        "# vtk DataFile Version 3.0\nphyxel nodes\nBINARY\nDATASET UNSTRUCTURED_GRID\n\
         POINTS {} double\n",
        positions.len()
    )
    .into_bytes();
    let vectors = |out: &mut Vec<u8>, values: &[DVec3]| {
        for x in values.iter().flat_map(|v| v.to_array()) {
            out.extend(x.to_be_bytes());
        }
        out.push(b'\n');
    };
    vectors(&mut out, positions);
    let count = cells.len();
    out.extend(format!("CELLS {count} {}\n", (N + 1) * count).bytes());
    for cell in cells {
        out.extend(index(N).to_be_bytes());
        cell.iter().for_each(|v| out.extend(v.to_be_bytes()));
    }
    out.extend(format!("\nCELL_TYPES {count}\n").bytes());
    for _ in 0..count {
        out.extend(kind.to_be_bytes());
    }
    out.extend(format!("\nPOINT_DATA {}\n", positions.len()).bytes());
    for (name, field) in fields {
        let name = name.replace(char::is_whitespace, "_");
        match field {
            Field::Scalars(values) => {
                assert_eq!(values.len(), positions.len(), "{name}: one value per node");
                out.extend(format!("SCALARS {name} double 1\nLOOKUP_TABLE default\n").bytes());
                values.iter().for_each(|x| out.extend(x.to_be_bytes()));
                out.push(b'\n');
            }
            Field::Vectors(values) => {
                assert_eq!(values.len(), positions.len(), "{name}: one vector per node");
                out.extend(format!("VECTORS {name} double\n").bytes());
                vectors(&mut out, values);
            }
        }
    }
    out
}
