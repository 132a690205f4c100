//! The reference page of all scene keys, made from the types.

use std::fmt::Write;

use serde_json::{Map, Value};

use super::Scene;

/// The reference of all keys of a scene as Markdown: types, defaults and meaning, in the order in
/// which a scene is written.
///
/// Made from the types that read the scene, so it cannot say what they do not.
#[must_use]
pub fn key_reference() -> String {
    let schema = schema();
    let empty = Map::new();
    let definitions = schema
        .get("$defs")
        .and_then(Value::as_object)
        .unwrap_or(&empty);
    let mut page = String::from(INTRODUCTION);
    rows_of(&mut page, &EVERYDAY, definitions);
    page.push_str(ALL);
    let mut told = vec!["Scene".to_owned()];
    section(&mut page, "Scene", &schema);
    let mut named = Vec::new();
    references("Scene", &schema, &mut named);
    sections(&mut page, named, &mut told, definitions);
    page.push_str(COMPARED);
    rows_of(&mut page, &COMPARISON, definitions);
    let mut named = Vec::new();
    for (_, name, key) in COMPARISON {
        references("", &definitions[name]["properties"][key], &mut named);
    }
    sections(&mut page, named, &mut told, definitions);
    page
}

/// Sections of the types that are `named`, each followed by those that it is the first to name.
fn sections(
    page: &mut String,
    mut named: Vec<String>,
    told: &mut Vec<String>,
    definitions: &Map<String, Value>,
) {
    named.reverse();
    while let Some(name) = named.pop() {
        if told.contains(&name) {
            continue;
        }
        let definition = &definitions[&name];
        section(page, &name, definition);
        told.push(name.clone());
        let mut next = Vec::new();
        references(&name, definition, &mut next);
        named.extend(next.into_iter().rev());
    }
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

/// What most scenes are made of: where a key stands, and the type that has it.
const EVERYDAY: [(&str, &str, &str); 25] = [
    ("bodies[]", "Body", "name"),
    ("bodies[]", "Body", "shape"),
    ("bodies[]", "Body", "position"),
    ("bodies[].sampling", "Sampling", "target"),
    ("bodies[].material", "Material", "youngs_modulus"),
    ("bodies[].material", "Material", "poissons_ratio"),
    ("bodies[].material", "Material", "density"),
    ("bodies[]", "Body", "damping"),
    ("bodies[].surfels", "Surfels", "color"),
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
const COMPARISON: [(&str, &str, &str); 7] = [
    ("bodies[]", "Body", "method"),
    ("bodies[]", "Body", "cut_rule"),
    ("bodies[].material", "Material", "volume_constant"),
    ("bodies[].surfels", "Surfels", "weights"),
    ("bodies[].surfels", "Surfels", "radius"),
    ("bodies[].surfels", "Surfels", "inside"),
    ("pictures", "Pictures", "mode"),
];

fn is_compared(name: &str, key: &str) -> bool {
    COMPARISON
        .iter()
        .any(|(_, owner, one)| (*owner, *one) == (name, key))
}

/// Rows of keys with the places where they stand.
fn rows_of(page: &mut String, rows: &[(&str, &str, &str)], definitions: &Map<String, Value>) {
    for (place, name, key) in rows {
        let definition = &definitions[*name];
        let content = &definition["properties"][*key];
        key_row(page, definition, key, content, &format!("{place}."));
    }
}

fn section(page: &mut String, name: &str, definition: &Value) {
    let mut paragraphs = text(definition).split("\n\n");
    let title = if name == "Scene" {
        "Scene (the whole file)"
    } else {
        name
    };
    push(page, format_args!("\n### {title}\n"));
    for paragraph in paragraphs.by_ref() {
        push(page, format_args!("\n{}\n", paragraph.replace('\n', " ")));
    }
    if let Some(choices) = definition.get("oneOf").and_then(Value::as_array) {
        push(
            page,
            "\n| choice | value | default | meaning |\n|---|---|---|---|\n",
        );
        for choice in choices {
            choice_rows(page, choice);
        }
    } else if definition.get("const").is_some() {
        push(
            page,
            "\n| choice | value | default | meaning |\n|---|---|---|---|\n",
        );
        choice_rows(page, definition);
    } else {
        push(
            page,
            "\n| key | value | default | meaning |\n|---|---|---|---|\n",
        );
        key_rows(page, definition, name, "");
        let compared = properties(definition).filter(|(key, _)| is_compared(name, key));
        let compared: Vec<String> = compared.map(|(key, _)| format!("`{key}`")).collect();
        if !compared.is_empty() {
            let keys = compared.join(", ");
            let see = "[to compare with](#keys-to-compare-with)";
            push(page, format_args!("\nAnd {see}: {keys}.\n"));
        }
    }
}

/// Rows of one choice of an enum and of its keys.
fn choice_rows(page: &mut String, choice: &Value) {
    if let Some(name) = choice.get("const").and_then(Value::as_str) {
        push(
            page,
            format_args!("| `{name}` | | | {} |\n", one_line(choice)),
        );
        return;
    }
    for (name, content) in properties(choice) {
        if content.get("properties").is_some() {
            push(
                page,
                format_args!("| `{name}(..)` | | | {} |\n", one_line(choice)),
            );
            key_rows(page, content, "", "· ");
        } else {
            push(
                page,
                format_args!(
                    "| `{name}(..)` | {} | | {} |\n",
                    value_of(content),
                    one_line(choice)
                ),
            );
        }
    }
}

fn key_rows(page: &mut String, definition: &Value, name: &str, indent: &str) {
    for (key, content) in properties(definition).filter(|(key, _)| !is_compared(name, key)) {
        key_row(page, definition, key, content, indent);
    }
}

/// The row of a key; `before` stands before it, in its quotes where it is a path.
fn key_row(page: &mut String, definition: &Value, key: &str, content: &Value, before: &str) {
    let required = definition.get("required").and_then(Value::as_array);
    let default = if required.is_some_and(|keys| keys.iter().any(|one| one == key)) {
        "required".to_owned()
    } else {
        default_of(content)
    };
    let shown = match before.strip_suffix('.') {
        Some(path) => format!("`{path}.{key}`"),
        None => format!("{before}`{key}`"),
    };
    push(
        page,
        format_args!(
            "| {shown} | {} | {default} | {} |\n",
            value_of(content),
            one_line(content)
        ),
    );
}

fn properties(definition: &Value) -> impl Iterator<Item = (&String, &Value)> {
    definition
        .get("properties")
        .and_then(Value::as_object)
        .into_iter()
        .flatten()
}

fn text(definition: &Value) -> &str {
    definition
        .get("description")
        .and_then(Value::as_str)
        .unwrap_or_default()
}

fn one_line(definition: &Value) -> String {
    text(definition).replace('\n', " ").replace('|', "\\|")
}

/// Name of the type that `definition` refers to.
fn reference(definition: &Value) -> Option<&str> {
    definition
        .get("$ref")
        .and_then(Value::as_str)
        .and_then(|path| path.rsplit('/').next())
}

/// What may stand as the value.
fn value_of(definition: &Value) -> String {
    if let Some(name) = reference(definition) {
        return format!("[{name}](#{})", name.to_lowercase());
    }
    if let Some(options) = definition.get("anyOf").and_then(Value::as_array) {
        let names: Vec<String> = options.iter().map(value_of).collect();
        return names.join(" or ");
    }
    match definition.get("type") {
        Some(Value::Array(kinds)) => {
            let names: Vec<String> = kinds
                .iter()
                .filter_map(Value::as_str)
                .map(|kind| simple(kind, definition))
                .collect();
            names.join(" or ")
        }
        Some(Value::String(kind)) => simple(kind, definition),
        _ => String::new(),
    }
}

fn simple(kind: &str, definition: &Value) -> String {
    match kind {
        "number" => "number".to_owned(),
        "integer" => "whole number".to_owned(),
        "string" => "text".to_owned(),
        "boolean" => "`true` or `false`".to_owned(),
        "null" => "`None`".to_owned(),
        "array" => {
            let first = definition.get("prefixItems").and_then(|items| items.get(0));
            let item = definition.get("items").or(first);
            let item = item.map(value_of).unwrap_or_default();
            match definition.get("minItems").and_then(Value::as_u64) {
                Some(length) => format!("{length} {item}s"),
                None if item.ends_with("numbers") => format!("list of ({item})"),
                None => format!("list of {item}"),
            }
        }
        other => other.to_owned(),
    }
}

/// The default as it would be written in a scene; a group's defaults stand in its own table.
fn default_of(definition: &Value) -> String {
    let Some(default) = definition.get("default") else {
        return String::new();
    };
    match default {
        Value::Object(keys) if keys.keys().all(|key| !is_choice(key)) => {
            "its own defaults".to_owned()
        }
        default => format!("`{}`", ron_of(default)),
    }
}

fn is_choice(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_uppercase())
}

fn ron_of(value: &Value) -> String {
    match value {
        Value::Null => "None".to_owned(),
        Value::String(name) if is_choice(name) => name.clone(),
        Value::Array(items) if items.is_empty() => "[]".to_owned(),
        Value::Array(items) => {
            let items: Vec<String> = items.iter().map(ron_of).collect();
            format!("({})", items.join(", "))
        }
        Value::Object(keys) => {
            let parts: Vec<String> = keys
                .iter()
                .map(|(key, value)| match value {
                    Value::Object(_) if is_choice(key) => format!("{key}{}", ron_of(value)),
                    _ if is_choice(key) => format!("{key}({})", ron_of(value)),
                    _ => format!("{key}: {}", ron_of(value)),
                })
                .collect();
            let text = parts.join(", ");
            if keys.keys().all(|key| is_choice(key)) {
                text
            } else {
                format!("({text})")
            }
        }
        other => other.to_string(),
    }
}

/// The types that `definition`, that of the type `owner`, names, in order; those of keys to compare with are
/// left out.
fn references(owner: &str, definition: &Value, found: &mut Vec<String>) {
    if let Some(name) = reference(definition) {
        found.push(name.to_owned());
    }
    match definition {
        Value::Object(keys) => keys
            .iter()
            .filter(|(key, _)| *key != "$defs" && *key != "default" && !is_compared(owner, key))
            .for_each(|(_, value)| references(owner, value, found)),
        Value::Array(items) => items.iter().for_each(|item| references(owner, item, found)),
        _ => {}
    }
}

fn push(page: &mut String, part: impl std::fmt::Display) {
    write!(page, "{part}").expect("a string takes all that is written to it");
}
