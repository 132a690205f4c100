//! The reference page of all scene keys, made from the types.

use serde_json::Value;

use super::key_page::{KeyPage, KeyRow, WHOLE};
use crate::Scene;

/// The reference of all keys of a scene as Markdown: types, defaults and meaning, in the order in
/// which a scene is written.
///
/// Made from the types that read the scene, so it cannot say what they do not.
#[must_use]
pub fn key_reference() -> String {
    let schema = schema();
    let mut page = KeyPage {
        page: INTRODUCTION.to_owned(),
        told: Vec::new(),
        schema: &schema,
    };
    page.rows(&EVERYDAY);
    page.push(ALL);
    page.sections(vec![WHOLE.to_owned()]);
    page.push(LIMITS);
    page.page
}

/// The JSON Schema of a scene: what editors complete the keys of a `.json` scene from.
#[must_use]
pub fn schema() -> Value {
    schemars::schema_for!(Scene).to_value()
}

const INTRODUCTION: &str = include_str!("keys/introduction.md");

const ALL: &str = "
## All keys
";

const LIMITS: &str = include_str!("keys/limits.md");

/// What most scenes are made of: where keys stand, and the type that has them.
const EVERYDAY: [KeyRow; 13] = [
    ("bodies[]", "Body", &["name", "shape", "position"]),
    ("bodies[].sampling", "Sampling", &["target"]),
    (
        "bodies[].material",
        "Material",
        &["youngs_modulus", "poissons_ratio", "density"],
    ),
    ("bodies[]", "Body", &["damping"]),
    ("bodies[].surfels", "SurfelSettings", &["color"]),
    ("supports[]", "Support", &["region", "motion"]),
    ("gravity", "Gravity", &["acceleration"]),
    ("tools[]", "Tool", &["shape", "path", "friction"]),
    ("cuts[]", "Cut", &["edge", "path"]),
    ("path[]", "Key", &["time", "position", "rotation"]),
    ("integration", "Integration", &["duration", "settle"]),
    ("observe", "Observe", &["state_rate"]),
    ("pictures", "Pictures", &["view", "color"]),
];
