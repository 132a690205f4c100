//! A page of all keys that a format has, made from its schema.

use std::fmt::{self, Write};

use serde_json::Value;

/// Where keys stand, the type that has them, and their names.
pub(crate) type KeyRow = (&'static str, &'static str, &'static [&'static str]);

/// The type of the whole format.
pub(crate) const WHOLE: &str = "Scene";

/// A reference of keys as Markdown: types, defaults and meaning.
///
/// Made from the schema of the types that read a text, so it cannot say what they do not.
#[derive(Debug)]
pub(crate) struct KeyPage<'a> {
    pub(crate) page: String,
    /// Types that have a section already.
    pub(crate) told: Vec<String>,
    pub(crate) schema: &'a Value,
}

impl<'a> KeyPage<'a> {
    /// Adds rows of a table, one for each key, with the positions where they stand.
    pub(crate) fn rows(&mut self, rows: &[KeyRow]) {
        for (place, name, keys) in rows {
            let definition = self.definition(name);
            for key in *keys {
                let content = definition["properties"].get(*key);
                let content = content.expect("the type has such a key");
                self.key_row(definition, key, content, &format!("{place}."));
            }
        }
    }

    /// Sections of the types that are `named`, each followed by those that it is the first to name.
    pub(crate) fn sections(&mut self, mut named: Vec<String>) {
        named.reverse();
        while let Some(name) = named.pop() {
            if self.told.contains(&name) {
                continue;
            }
            let definition = self.definition(&name);
            self.section(&name, definition);
            let mut next = Vec::new();
            references(definition, &mut next);
            self.told.push(name);
            named.extend(next.into_iter().rev());
        }
    }

    fn definition(&self, name: &str) -> &'a Value {
        match name {
            WHOLE => self.schema,
            _ => &self.schema["$defs"][name],
        }
    }

    fn section(&mut self, name: &str, definition: &Value) {
        let whole = if name == WHOLE {
            " (the whole file)"
        } else {
            ""
        };
        let mut paragraphs = text(definition).split("\n\n");
        self.push(format_args!("\n### {name}{whole}\n"));
        for paragraph in paragraphs.by_ref() {
            self.push(format_args!("\n{}\n", paragraph.replace('\n', " ")));
        }
        let choices = match definition.get("oneOf").and_then(Value::as_array) {
            Some(choices) => &choices[..],
            None if definition.get("const").is_some() => std::slice::from_ref(definition),
            None => &[],
        };
        if !choices.is_empty() {
            self.push("\n| choice | value | default | meaning |\n|---|---|---|---|\n");
            choices.iter().for_each(|choice| self.choice_rows(choice));
        } else {
            self.push("\n| key | value | default | meaning |\n|---|---|---|---|\n");
            self.key_rows(definition, "");
        }
    }

    /// Rows of one choice of an enum and of its keys.
    fn choice_rows(&mut self, choice: &Value) {
        let meaning = one_line(choice);
        if let Some(name) = str_of(choice, "const") {
            self.push(format_args!("| `{name}` | | | {meaning} |\n"));
            return;
        }
        for (name, content) in properties(choice) {
            if content.get("properties").is_some() {
                self.push(format_args!("| `{name}(..)` | | | {meaning} |\n"));
                self.key_rows(content, "· ");
            } else {
                let value = value_of(content);
                self.push(format_args!("| `{name}(..)` | {value} | | {meaning} |\n"));
            }
        }
    }

    fn key_rows(&mut self, definition: &Value, indent: &str) {
        for (key, content) in properties(definition) {
            self.key_row(definition, key, content, indent);
        }
    }

    /// The row of a key; `before` stands before it, in its quotes where it is a path.
    fn key_row(&mut self, definition: &Value, key: &str, content: &Value, before: &str) {
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
        let (value, meaning) = (value_of(content), one_line(content));
        self.push(format_args!(
            "| {shown} | {value} | {default} | {meaning} |\n"
        ));
    }

    pub(crate) fn push(&mut self, part: impl fmt::Display) {
        write!(self.page, "{part}").expect("a string takes all that is written to it");
    }
}

/// The types that `definition` names, in order.
fn references(definition: &Value, found: &mut Vec<String>) {
    found.extend(reference(definition).map(str::to_owned));
    match definition {
        Value::Object(keys) => {
            let is_part = |key: &str| !["$defs", "default"].contains(&key);
            let parts = keys.iter().filter(|(key, _)| is_part(key));
            parts.for_each(|(_, part)| references(part, found));
        }
        Value::Array(items) => items.iter().for_each(|item| references(item, found)),
        _ => {}
    }
}

fn properties(definition: &Value) -> impl Iterator<Item = (&String, &Value)> {
    let properties = definition.get("properties").and_then(Value::as_object);
    properties.into_iter().flatten()
}

fn str_of<'a>(definition: &'a Value, key: &str) -> Option<&'a str> {
    definition.get(key).and_then(Value::as_str)
}

fn text(definition: &Value) -> &str {
    str_of(definition, "description").unwrap_or_default()
}

fn one_line(definition: &Value) -> String {
    text(definition).replace('\n', " ").replace('|', "\\|")
}

/// Name of the type that `definition` refers to.
fn reference(definition: &Value) -> Option<&str> {
    str_of(definition, "$ref").and_then(|path| path.rsplit('/').next())
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
            let kinds = kinds.iter().filter_map(Value::as_str);
            let names = kinds.map(|kind| simple(kind, definition));
            names.collect::<Vec<_>>().join(" or ")
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
