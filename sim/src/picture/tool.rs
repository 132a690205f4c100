//! Tools and blades as pictures show them.

use glam::DVec3;
use phyxel_splat::DrawnMesh;

use super::rigid::posed;
use crate::scene::Cut;
use crate::world::World;

/// Time (s) for which a blade is shown before and after its stroke.
const SHOWN: f64 = 0.15;
/// Edge length of the piece of a plane that is shown, over the bodies' largest extent.
const PLANE_SIZE: f64 = 1.6;

/// Meshes of all tools, and of the blades that are shown now; `looks` take the place of tools' shapes.
pub(super) fn meshes(world: &World, looks: &[Option<DrawnMesh>]) -> Vec<DrawnMesh> {
    let tools = world.scene().tools.iter().zip(world.tool_forces());
    let extent = world.members().iter().map(|member| {
        let bounds = member.body.solid.bounds();
        bounds.size().max_element()
    });
    let extent = PLANE_SIZE * extent.fold(0.0, f64::max);
    let mut meshes: Vec<DrawnMesh> = tools
        .zip(looks)
        .map(|((tool, now), looks)| match looks {
            Some(looks) => posed(looks, &now.pose),
            None => tool.solid().drawn(&now.pose, extent),
        })
        .collect();
    meshes.extend(blades(world));
    meshes
}

fn blades(world: &World) -> Vec<DrawnMesh> {
    let Some(time) = world.scene_time() else {
        return Vec::new();
    };
    world
        .scene()
        .cuts
        .iter()
        .filter(|cut| (cut.start() - SHOWN..=cut.end() + SHOWN).contains(&time))
        .flat_map(|cut| DrawnMesh::knife(&cut.edge_at(time), edge_motion(cut, time)))
        .collect()
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
