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

/// The world at the end, with the sphere on a path and let go or not.
fn played(nodes: u32, path: &str, release: &str) -> Result<World, StudyError> {
    let sides = ["1, 0, 0", "-1, 0, 0", "0, 1, 0", "0, -1, 0", "0, 0, -1"].map(|normal| {
        let point = normal.replace('1', "0.999999");
        format!("(region: HalfSpace(point: ({point}), normal: ({normal})))")
    });
    let supports = sides.join(", ");
    let text = format!(
        "(version: 1, bodies: [(name: \"block\", shape: Box(size: (2, 2, 2)), \
         sampling: (target: Nodes({nodes})), \
         material: (youngs_modulus: {MODULUS}, poissons_ratio: 0.3, density: 1000), damping: 4)], \
         supports: [{supports}], gravity: None, integration: (settle: None), \
         tools: [(shape: Sphere(radius: 1), path: [{path}], {release})])"
    );
    let scene = phyxel_scene::from_text(&text, "hertz study", "", &[])?;
    let mut world = World::new(scene)?;
    world.play(END, |_| ())?;
    Ok(world)
}

/// Depths and forces.
pub(super) fn table(effort: Effort, reference: &mut Reference) -> Result<Table, StudyError> {
    let nodes = effort.choose(5_000, 1_000);
    let push = MODULUS * reference.press(1.0, DEPTH)?.force;
    let release = format!("release: Some((mass: {MASS}, force: (0, 0, -{push})))");
    let released = played(nodes, "(time: 0, position: (0, 0, 2))", &release)?;
    let tool = released.tool_forces()[0];
    let depth = 2.0 - tool.pose.position.z;
    // Led slowly to where the other lies, and held.
    let down = 2.0 - depth;
    let path = format!("(time: 0, position: (0, 0, 2)), (time: 2, position: (0, 0, {down}))");
    let led = played(nodes, &path, "")?;
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
