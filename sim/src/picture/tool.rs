//! Tools and blades as pictures show them.

use glam::{DQuat, DVec3, Vec3};
use phyxel_splat::Mesh;

use super::rigid::posed;
use crate::scene::{Cut, Pose, ToolShape};
use crate::world::World;

/// Time (s) for which a blade is shown before and after its stroke.
const SHOWN: f64 = 0.15;
/// Width of a blade over its edge's length, and its largest value (m).
const WIDTH: f64 = 0.16;
const LARGEST_WIDTH: f64 = 0.011;
/// Half the thickness of the spine over the width.
const HALF_THICKNESS: f64 = 0.05;

/// Edge length of the piece of a plane that is shown, over the bodies' largest extent.
const PLANE_SIZE: f64 = 1.6;

/// Meshes of all tools, and of the blades that are shown now; `looks` take the place of tools' shapes.
pub(super) fn meshes(world: &World, looks: &[Option<Mesh>]) -> Vec<Mesh> {
    let tools = world.scene().tools.iter().zip(world.tool_forces());
    let extent = world.members().iter().map(|member| {
        let bounds = member.body.solid.bounds();
        bounds.size().max_element()
    });
    let extent = PLANE_SIZE * extent.fold(0.0, f64::max);
    let mut meshes: Vec<Mesh> = tools
        .zip(looks)
        .map(|((tool, now), looks)| match looks {
            Some(looks) => posed(looks, &now.pose),
            None => rigid(&tool.solid(), &now.pose, extent),
        })
        .collect();
    meshes.extend(blades(world));
    meshes
}

/// What a tool occupies; of a plane a square piece of edge length `extent` (m).
fn rigid(shape: &ToolShape, pose: &Pose, extent: f64) -> Mesh {
    match *shape {
        ToolShape::Sphere { radius } => Mesh::capsule(pose.position, pose.position, radius),
        ToolShape::Capsule { from, to, radius } => {
            Mesh::capsule(pose.apply(from), pose.apply(to), radius)
        }
        ToolShape::Box { size } => block(pose, size * 0.5, DVec3::ZERO),
        ToolShape::Plane { normal } => {
            let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize_or(DVec3::Z));
            let slab = Pose {
                rotation: pose.rotation * turn,
                position: pose.position,
            };
            let half = DVec3::new(0.5, 0.5, 0.01) * extent;
            block(&slab, half, DVec3::Z * -half.z)
        }
    }
}

/// A box of half edge lengths `half` (m) about a point of a pose's frame.
fn block(pose: &Pose, half: DVec3, center: DVec3) -> Mesh {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
            let first = u32::try_from(vertices.len()).unwrap_or(0);
            // Counter-clockwise seen from outside; every face has its own corners and normals.
            for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                let corner = DVec3::AXES[axis] * side + u * (a * side) + v * b;
                vertices.push(pose.apply(center + corner * half));
            }
            triangles.extend([[0, 1, 2], [0, 2, 3]].map(|face| face.map(|k| first + k)));
        }
    }
    Mesh::metal(vertices, triangles)
}

fn blades(world: &World) -> Vec<Mesh> {
    let Some(time) = world.scene_time() else {
        return Vec::new();
    };
    world
        .scene()
        .cuts
        .iter()
        .filter(|cut| (cut.start() - SHOWN..=cut.end() + SHOWN).contains(&time))
        .flat_map(|cut| blade(cut, time))
        .collect()
}

/// A knife along the edge of `cut`: a wedge behind the cutting edge and a handle at its last point.
fn blade(cut: &Cut, time: f64) -> Vec<Mesh> {
    let edge = cut.edge_at(time);
    let (Some(&tip), Some(&heel)) = (edge.first(), edge.last()) else {
        return Vec::new();
    };
    let length = tip.distance(heel);
    let along = (heel - tip).normalize_or(DVec3::Z);
    let ahead = edge_motion(cut, time);
    let back = -(ahead - along * ahead.dot(along))
        .try_normalize()
        .unwrap_or_else(|| along.any_orthonormal_vector());
    let side = along.cross(back);
    let width = (WIDTH * length).min(LARGEST_WIDTH);
    let half = HALF_THICKNESS * width;
    // Cross-section at each point of the edge: sharp in front, thick at the spine; the tip slants.
    let mut vertices = Vec::new();
    for (index, &point) in edge.iter().enumerate() {
        let slant = if index == 0 {
            along * width
        } else {
            DVec3::ZERO
        };
        let spine = point + back * width + slant;
        vertices.extend([point, spine + side * half, spine - side * half]);
    }
    let mut triangles = Vec::new();
    let rows = u32::try_from(edge.len()).unwrap_or(0);
    for row in 0..rows.saturating_sub(1) {
        for k in 0..3 {
            let (a, b) = (3 * row + k, 3 * row + (k + 1) % 3);
            triangles.extend([[a, b, a + 3], [b, b + 3, a + 3]]);
        }
    }
    triangles.push([0, 1, 2]);
    if rows > 0 {
        let last = 3 * (rows - 1);
        triangles.push([last, last + 2, last + 1]);
    }
    let grip = heel + back * (0.5 * width);
    let radius = 0.42 * width;
    let mut handle = Mesh::capsule(grip + along * radius, grip + along * (9.0 * width), radius);
    handle.color = Vec3::new(0.03, 0.035, 0.04);
    vec![Mesh::metal(vertices, triangles), handle]
}

/// Way of the edge's middle over a short time about now, from where it was to where it goes.
fn edge_motion(cut: &Cut, time: f64) -> DVec3 {
    let half = 0.01 * (cut.end() - cut.start());
    let time = time.clamp(cut.start() + half, cut.end() - half);
    let middle = |time: f64| {
        let edge = cut.edge_at(time);
        edge.iter().sum::<DVec3>() / f64::from(u32::try_from(edge.len()).unwrap_or(1))
    };
    middle(time + half) - middle(time - half)
}
