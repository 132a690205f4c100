//! Figure 70: the sphere is let go on the block and comes to rest.

use phyxel::World;

use super::MODULUS;
use crate::problems::reference::Reference;
use crate::report::{Table, row};
use crate::{Effort, StudyError};

pub(super) const WORDS: &str = "Released: the same cube as a scene, the sphere let go where it touches and \
     pushed down by the force that the reference needs for 0.05 m. It comes to rest where the same scene's sphere, led \
     to that depth, is carried by that force, if dynamics and statics are one; finite strain, the program's \
     own nodes.";

/// Depth (m) that the push is for.
const DEPTH: f64 = 0.05;
/// Mass (kg) of the sphere.
const MASS: f64 = 60.0;
/// Scene time (s) at which it lies still.
const END: f64 = 12.0;

fn world(nodes: u32, path: &str, release: &str) -> Result<World, StudyError> {
    let side = |point: &str, normal: &str| {
        format!("(region: HalfSpace(point: {point}, normal: {normal})),")
    };
    let edge = 0.999_999;
    let supports: String = [
        side(&format!("({edge}, 0, 0)"), "(1, 0, 0)"),
        side(&format!("(-{edge}, 0, 0)"), "(-1, 0, 0)"),
        side(&format!("(0, {edge}, 0)"), "(0, 1, 0)"),
        side(&format!("(0, -{edge}, 0)"), "(0, -1, 0)"),
        side(&format!("(0, 0, -{edge})"), "(0, 0, -1)"),
    ]
    .concat();
    let text = format!(
        "(version: 1, bodies: [(name: \"block\", shape: Box(size: (2, 2, 2)), \
         sampling: (target: Nodes({nodes})), \
         material: (youngs_modulus: {MODULUS}, poissons_ratio: 0.3, density: 1000), damping: 4)], \
         supports: [{supports}], gravity: None, integration: (settle: None), \
         tools: [(shape: Sphere(radius: 1), path: [{path}], {release})])"
    );
    let scene = phyxel_scene::from_text(&text, "hertz study", "", &[])?;
    Ok(World::new(scene)?)
}

fn play(world: &mut World, end: f64) -> Result<(), StudyError> {
    while world.scene_time().is_none_or(|now| now < end) {
        world.step()?;
    }
    Ok(())
}

/// Depths and forces.
pub(super) fn table(effort: Effort, reference: &mut Reference) -> Result<Table, StudyError> {
    let nodes = effort.choose(5_000, 1_000);
    let push = MODULUS * reference.press(1.0, DEPTH)?.force;
    let mut released = world(
        nodes,
        "(time: 0, position: (0, 0, 2))",
        &format!("release: Some((mass: {MASS}, force: (0, 0, -{push})))"),
    )?;
    play(&mut released, END)?;
    let tool = released.tool_forces()[0];
    let depth = 2.0 - tool.pose.position.z;
    // Led slowly to where the other lies, and held.
    let down = 2.0 - depth;
    let mut led = world(
        nodes,
        &format!("(time: 0, position: (0, 0, 2)), (time: 2, position: (0, 0, {down}))"),
        "",
    )?;
    play(&mut led, END)?;
    let carried = led.tool_forces()[0].force.z;
    let rows = vec![row![
        released.bodies()[0].rest.len(),
        push,
        depth,
        depth / DEPTH,
        tool.force.z / push,
        carried / push
    ]];
    Ok(Table::new(
        "released",
        "The sphere let go on the block (fig. 70)",
        "nodes (1); push (N); depth at rest (m); over the reference's (1); force over push (1); \
         driven there: force over push (1)",
        rows,
    ))
}
