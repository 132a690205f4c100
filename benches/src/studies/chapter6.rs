//! The dissertation's chapter 6: its bodies, models and states, as the program's scenes have them.

use phyxel_scene::Override;

use crate::StudyError;

/// Bodies of chapter 6: their scenes, and the frames per second that Aras 2014 reports.
pub(crate) const BODIES: [(&str, f64); 3] = [
    ("block-1408", 80.0),
    ("block-436", 125.0),
    ("liver-181", 120.0),
];

/// Models: what is added to a scene's name.
pub(crate) const MODELS: [(&str, &str); 2] = [("", "default"), ("-dissertation", "dissertation")];

/// States, and the scene times (s) at which the scenes' blades are between two strokes.
pub(crate) const STATES: [(&str, f64); 3] =
    [("hanging", 0.1), ("cut once", 1.0), ("cut through", 1.9)];

/// Changes of scenes from their text.
pub(crate) fn overrides(changes: &[&str]) -> Result<Vec<Override>, StudyError> {
    let parsed = changes.iter().map(|change| Override::parse(change));
    Ok(parsed.collect::<Result<_, _>>()?)
}
