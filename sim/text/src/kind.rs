//! What the format's schema says of a value.

use serde_json::Value;

use crate::format::Syntax;

/// What the schema says of a value.
pub(crate) enum Kind {
    Group(&'static Value),
    Choice(&'static [Value]),
    List(&'static Value),
    /// As many values as there are kinds.
    Tuple(Vec<&'static Value>),
    Number,
    Whole {
        least: i64,
        most: i64,
    },
    Truth,
    Text,
}

impl Kind {
    /// The kind by a part of the schema `root`, and whether the value may be `None`.
    pub(crate) fn of(root: &'static Value, mut schema: &'static Value) -> (Self, bool) {
        let mut optional = false;
        loop {
            if let Some(path) = schema.get("$ref").and_then(Value::as_str) {
                let name = path.rsplit('/').next().unwrap_or_default();
                schema = &root["$defs"][name];
            } else if let Some(all) = schema.get("anyOf").and_then(Value::as_array) {
                let is_null = |one: &Value| one["type"] == "null";
                optional |= all.iter().any(is_null);
                schema = all.iter().find(|one| !is_null(one)).unwrap_or(&Value::Null);
            } else {
                break;
            }
        }
        if let Some(all) = schema.get("oneOf").and_then(Value::as_array) {
            return (Self::Choice(all), optional);
        }
        let name = match &schema["type"] {
            Value::Array(names) => {
                optional |= names.iter().any(|name| name == "null");
                names.iter().find(|name| *name != "null")
            }
            name => Some(name),
        };
        let kind = match name.and_then(Value::as_str).unwrap_or_default() {
            "object" => Self::Group(schema),
            "array" => match (schema.get("prefixItems"), schema["minItems"].as_u64()) {
                (Some(Value::Array(kinds)), _) => Self::Tuple(kinds.iter().collect()),
                (_, Some(count)) => Self::Tuple((0..count).map(|_| &schema["items"]).collect()),
                _ => Self::List(&schema["items"]),
            },
            "number" => Self::Number,
            "integer" => Self::Whole {
                least: schema["minimum"].as_i64().unwrap_or(i64::MIN),
                most: match schema["format"].as_str() {
                    Some("uint32") => i64::from(u32::MAX),
                    _ => i64::MAX,
                },
            },
            "boolean" => Self::Truth,
            _ => Self::Text,
        };
        (kind, optional)
    }

    /// What a value must be.
    pub(crate) fn must_be(&self, format: Syntax) -> String {
        let json = format == Syntax::Json;
        match self {
            Self::Group(_) if json => "a group such as {\"key\": value}".to_owned(),
            Self::Group(_) => "a group such as (key: value)".to_owned(),
            Self::Choice(choices) => format!("one of {}", names_of(choices).join(", ")),
            Self::List(_) => "a list such as [a, b]".to_owned(),
            Self::Tuple(kinds) if kinds.len() == 3 && json => {
                "three numbers such as [0, 0, 1]".to_owned()
            }
            Self::Tuple(kinds) if kinds.len() == 3 => "three numbers such as (0, 0, 1)".to_owned(),
            Self::Tuple(kinds) => format!("a list of {} values", kinds.len()),
            Self::Number => "a number".to_owned(),
            Self::Whole { least, .. } if *least == i64::MIN => "a whole number".to_owned(),
            Self::Whole { least, .. } => format!("a whole number of {least} or more"),
            Self::Truth => "true or false".to_owned(),
            Self::Text => "a text in quotes, \"like this\"".to_owned(),
        }
    }

    /// A value that fits, in RON.
    pub(crate) fn any(&self, root: &'static Value) -> String {
        match self {
            Self::Group(schema) => {
                let keys = required(schema).map(|key| {
                    let kind = Self::of(root, &schema["properties"][key]).0;
                    format!("{key}: {}", kind.any(root))
                });
                format!("({})", keys.collect::<Vec<_>>().join(", "))
            }
            Self::Choice(choices) => {
                let choice = &choices[0];
                let name = name_of(choice);
                match choice.get("properties") {
                    None => name.to_owned(),
                    Some(content) => match Self::of(root, &content[name]).0 {
                        kind @ (Self::Group(_) | Self::Tuple(_)) => {
                            format!("{name}{}", kind.any(root))
                        }
                        kind => format!("{name}({})", kind.any(root)),
                    },
                }
            }
            Self::List(_) => "[]".to_owned(),
            Self::Tuple(kinds) => {
                let items: Vec<String> = kinds
                    .iter()
                    .map(|kind| Self::of(root, kind).0.any(root))
                    .collect();
                format!("({})", items.join(", "))
            }
            Self::Number => "1.0".to_owned(),
            Self::Whole { .. } => "1".to_owned(),
            Self::Truth => "false".to_owned(),
            Self::Text => "\"\"".to_owned(),
        }
    }
}

/// The name of one choice.
pub(crate) fn name_of(choice: &'static Value) -> &'static str {
    let group = || choice["properties"].as_object()?.keys().next();
    let name = choice["const"].as_str();
    name.or_else(|| group().map(String::as_str))
        .unwrap_or_default()
}

/// The names of all choices.
pub(crate) fn names_of(choices: &'static [Value]) -> Vec<&'static str> {
    choices.iter().map(name_of).collect()
}

/// The key or choice, each with its schema, that had this name before: `x-former` says so.
pub(crate) fn renamed<'a>(
    found: &str,
    mut known: impl Iterator<Item = (&'a str, &'static Value)>,
) -> Option<&'a str> {
    let now = known.find(|(_, schema)| schema["x-former"] == found);
    now.map(|(name, _)| name)
}

/// Keys that a group must have.
pub(crate) fn required(group: &'static Value) -> impl Iterator<Item = &'static str> {
    let keys = group.get("required").and_then(Value::as_array);
    keys.into_iter().flatten().filter_map(Value::as_str)
}
