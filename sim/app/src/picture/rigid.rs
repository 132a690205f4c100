//! Rigid meshes from files among the surfels.

use phyxel_discretize::{ReadError, read_mesh};
use phyxel_splat::{DrawnMesh, linear_color};

use phyxel::scene::{Pose, RigidMesh};

/// Gloss of dry surfaces, as that of a surface that says nothing of it.
const SPECULAR: f32 = 0.35;

/// The mesh of a file, placed, at a scale, and coloured.
pub(super) fn read(spec: &RigidMesh, scale: f64) -> Result<DrawnMesh, ReadError> {
    let mut mesh = read_mesh(&spec.file)?.mesh;
    spec.placement().place(&mut mesh.vertices);
    mesh.vertices.iter_mut().for_each(|vertex| *vertex *= scale);
    Ok(DrawnMesh {
        color: linear_color(spec.color),
        specular: SPECULAR,
        smooth: true,
        ..DrawnMesh::metal(mesh.vertices, mesh.triangles)
    })
}

/// A mesh where a pose has it.
pub(super) fn posed(mesh: &DrawnMesh, pose: &Pose) -> DrawnMesh {
    DrawnMesh {
        vertices: mesh.vertices.iter().map(|&v| pose.apply(v)).collect(),
        ..mesh.clone()
    }
}
