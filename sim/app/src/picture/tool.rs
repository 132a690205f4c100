//! Tools, blades and rigid meshes from files as pictures show them.

use glam::{DQuat, DVec3};
use phyxel::World;
use phyxel::scene::{Cut, Pose, RigidMesh, ToolShape};
use phyxel_discretize::{ReadError, read_mesh};
use phyxel_splat::{DrawnMesh, linear_color};

use super::knife::knife;

/// Time (s) for which a blade is shown before and after its stroke.
const SHOWN: f64 = 0.15;
/// Edge length of the piece of a plane that is shown, over the bodies' largest extent.
const PLANE_SIZE: f64 = 1.6;
/// Gloss of dry surfaces, as that of a surface that says nothing of it.
const SPECULAR: f32 = 0.35;

/// Meshes of all tools, and of the blades that are shown now; `looks` replace tools' shapes.
pub(super) fn meshes(world: &World, looks: &[Option<DrawnMesh>]) -> Vec<DrawnMesh> {
    let tools = world.scene().tools.iter().zip(world.tool_forces());
    let extent = world.bodies().iter().map(|body| {
        let bounds = body.solid.bounds();
        bounds.size().max_element()
    });
    let extent = PLANE_SIZE * extent.fold(0.0, f64::max);
    let mut meshes: Vec<DrawnMesh> = tools
        .zip(looks)
        .map(|((tool, now), looks)| match looks {
            Some(looks) => posed(looks, &now.pose),
            None => drawn(tool.solid(), &now.pose, extent),
        })
        .collect();
    meshes.extend(blades(world));
    meshes
}

/// What is drawn of a tool at a pose; of a plane a square piece of edge length `extent` (m).
fn drawn(shape: ToolShape, pose: &Pose, extent: f64) -> DrawnMesh {
    match shape {
        ToolShape::Sphere { radius } => DrawnMesh::capsule(pose.position, pose.position, radius),
        ToolShape::Capsule { from, to, radius } => {
            DrawnMesh::capsule(pose.apply(from), pose.apply(to), radius)
        }
        ToolShape::Box { size } => DrawnMesh::cuboid(pose.position, pose.rotation, size * 0.5),
        ToolShape::Plane { normal } => {
            let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize_or(DVec3::Z));
            let rotation = pose.rotation * turn;
            let half = DVec3::new(0.5, 0.5, 0.01) * extent;
            DrawnMesh::cuboid(pose.position - rotation * DVec3::Z * half.z, rotation, half)
        }
    }
}

fn blades(world: &World) -> Vec<DrawnMesh> {
    let Some(time) = world.scene_time() else {
        return Vec::new();
    };
    let is_shown = |cut: &&Cut| (cut.start() - SHOWN..=cut.end() + SHOWN).contains(&time);
    let cuts = world.scene().cuts.iter().filter(is_shown);
    cuts.flat_map(|cut| knife(&cut.edge_at(time), edge_motion(cut, time)))
        .collect()
}

/// Path of the edge's middle over a short time about now, from where it was to where it goes.
fn edge_motion(cut: &Cut, time: f64) -> DVec3 {
    let half = 0.01 * (cut.end() - cut.start());
    let time = time.clamp(cut.start() + half, cut.end() - half);
    let middle = |time: f64| {
        let edge = cut.edge_at(time);
        edge.iter().sum::<DVec3>() / f64::from(u32::try_from(edge.len()).unwrap_or(1))
    };
    middle(time + half) - middle(time - half)
}

/// The mesh of a file, placed, at a scale, and coloured.
pub(super) fn read_rigid(spec: &RigidMesh, scale: f64) -> Result<DrawnMesh, ReadError> {
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
fn posed(mesh: &DrawnMesh, pose: &Pose) -> DrawnMesh {
    DrawnMesh {
        vertices: mesh.vertices.iter().map(|&v| pose.apply(v)).collect(),
        ..mesh.clone()
    }
}
