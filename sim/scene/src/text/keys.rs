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

const INTRODUCTION: &str = "\
# Scene files

A scene is a RON file (or, named `.json`, a JSON file with the same keys, whose schema
`phyxel scenes --schema` prints for editors): `(key: value, ..)` for a group, `[a, b]` for a list, `Name(..)` for a choice,
`//` for a comment. Units are SI: metres, seconds, kilograms, pascals; angles are degrees; points and
directions are `(x, y, z)` with z up. Unknown keys are refused. A key with a default may be left out; a
key that may be `None` is switched off by it. Relative paths start at the scene file's folder. Any value
can be set on the command line, such as `--set 'bodies[0].material.density=1000'`.

The embedded scenes are written to be started from: `phyxel scenes minimal > my.ron`.
This page is what `phyxel scenes --keys` prints, in three parts: the keys of every day; all keys, group by
group, for those who know why; and keys whose other choices are there to compare with.

## Keys of every day

| key | value | default | meaning |
|---|---|---|---|
";

const ALL: &str = "
## All keys
";

const COMPARED: &str = "
## Keys to compare with

Their defaults are what is tested; the other choices are the dissertation's, or simpler, and are there to be compared with.

| key | value | default | meaning |
|---|---|---|---|
";

const LIMITS: &str = "
## Limits

What goes beyond them is refused with the key and a remedy, before memory is taken.

| what | limit |
|---|---|
| numbers | up to 1e100 in size |
| bodies | 32,767 |
| nodes of a body | 4 to `sampling.limit`; about 6 kB of memory each |
| `sampling.coarsest`, `.refine[].factor` | 1 to 32, 1/32 to 1 |
| surfels of a body, and by `cut_density` on the area of its surface | 4,000,000; 1 kB each |
| `surfels.nodes`, `.spacing` range | 1 to 64, 1 to 100 |
| captures of a cut | 100,000 |
| rows of `history.csv`, of `tools.csv` and `contacts.csv` for a tool or two bodies | 10,000,000 each |
| frames, states | 100,000 each |
| a frame | 16 pixels a side to 67,108,864 in all; 32 bytes for each of its samples |
| name of a scene | 100 bytes, as a folder may have it |
| a tool's path | half a spacing between contacts, for up to 1,000 of them a step |
| steps | a run ends at a millionth of the first, or after 10,000 in a row below a hundredth |
| cases of a sweep | 100,000 |
| `live` | 8 clients, messages of 1 MiB, meshes of 64 MiB, 64 points of a blade |
";

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
