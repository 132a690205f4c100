//! The reference page of all scene keys, made from the types.

use serde_json::Value;

use super::key_page::{KeyPage, KeyRow};
use crate::Scene;

/// The reference of all keys of a scene as Markdown: types, defaults and meaning, in the order in
/// which a scene is written.
///
/// Made from the types that read the scene, so it cannot say what they do not.
#[must_use]
pub fn key_reference() -> String {
    let schema = schema();
    let mut page = KeyPage::new(&schema, &COMPARISON);
    page.text(INTRODUCTION);
    page.rows(&EVERYDAY);
    page.text(ALL);
    page.whole("Scene", "Scene (the whole file)", &schema);
    page.text(COMPARED);
    page.rows(&COMPARISON);
    page.types_of(&COMPARISON);
    page.text(LIMITS);
    page.finish()
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

const COMPARED: &str = "
## Keys to compare with

Their defaults are what is tested; the other choices are the dissertation's, or simpler, and are there to be compared with.

| key | value | default | meaning |
|---|---|---|---|
";

const LIMITS: &str = include_str!("keys/limits.md");

/// What most scenes are made of: where a key stands, and the type that has it.
const EVERYDAY: [KeyRow; 25] = [
    ("bodies[]", "Body", "name"),
    ("bodies[]", "Body", "shape"),
    ("bodies[]", "Body", "position"),
    ("bodies[].sampling", "Sampling", "target"),
    ("bodies[].material", "Material", "youngs_modulus"),
    ("bodies[].material", "Material", "poissons_ratio"),
    ("bodies[].material", "Material", "density"),
    ("bodies[]", "Body", "damping"),
    ("bodies[].surfels", "SurfelSettings", "color"),
    ("supports[]", "Support", "region"),
    ("supports[]", "Support", "motion"),
    ("gravity", "Gravity", "acceleration"),
    ("tools[]", "Tool", "shape"),
    ("tools[]", "Tool", "path"),
    ("tools[]", "Tool", "friction"),
    ("cuts[]", "Cut", "edge"),
    ("cuts[]", "Cut", "path"),
    ("path[]", "Key", "time"),
    ("path[]", "Key", "position"),
    ("path[]", "Key", "rotation"),
    ("integration", "Integration", "duration"),
    ("integration", "Integration", "settle"),
    ("observe", "Observe", "state_rate"),
    ("pictures", "Pictures", "view"),
    ("pictures", "Pictures", "color"),
];

/// Keys whose other choices are there to compare with, as above.
const COMPARISON: [KeyRow; 7] = [
    ("bodies[]", "Body", "method"),
    ("bodies[]", "Body", "cut_rule"),
    ("bodies[].material", "Material", "volume_constant"),
    ("bodies[].surfels", "SurfelSettings", "weights"),
    ("bodies[].surfels", "SurfelSettings", "radius"),
    ("bodies[].surfels", "SurfelSettings", "inside"),
    ("pictures", "Pictures", "mode"),
];
