//! Bodies that move from the start, which no scene can say.

use glam::DVec3;
use phyxel::{World, WorldState};
use serde_json::{Value, json};

use crate::error::StudyError;

/// Gives the first body of a new world velocities (m/s) by position (m), through its snapshot; takes one
/// step at rest before, after which all of that is finite and can be written.
pub(crate) fn with_velocities(
    world: &mut World,
    velocity: impl Fn(DVec3) -> DVec3,
) -> Result<(), StudyError> {
    world.step()?;
    let motion = &world.members()[0].body.motion;
    let supports = motion.supports();
    let mut velocities: Vec<DVec3> = motion.positions().iter().map(|&x| velocity(x)).collect();
    supports.project(&mut velocities);
    let nodes = motion.masses().iter().zip(&velocities);
    let kinetic: f64 = nodes.map(|(m, v)| 0.5 * m * v.length_squared()).sum();
    let mut kept = serde_json::to_value(world.state()).map_err(StudyError::State)?;
    // A step that is rolled back must not end at rest.
    if let Some(whole) = kept.as_object_mut() {
        whole.insert("kept".to_owned(), Value::Null);
    }
    let motion = kept
        .pointer_mut("/bodies/0/motion")
        .and_then(Value::as_object_mut);
    if let Some(motion) = motion {
        motion.insert("velocities".to_owned(), json!(velocities));
        if let Some(audit) = motion.get_mut("audit").and_then(Value::as_object_mut) {
            audit.insert("kinetic".to_owned(), json!(kinetic));
            audit.insert("initial".to_owned(), json!(kinetic));
        }
    }
    let state: WorldState = serde_json::from_value(kept).map_err(StudyError::State)?;
    world.restore(state, |_, _| ())?;
    Ok(())
}
