//! What a value should have been, in the words of the format, where the deserializer speaks of types.

use serde_json::Value;

use super::keys::schema;
use super::locate::{Content, KeyPath, Node, Segment};

/// A value of another type than its key asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Wanted {
    /// Byte at which the value starts.
    pub(super) start: usize,
    pub(super) path: String,
    pub(super) found: String,
    pub(super) must: String,
}

/// The value round `byte` if it is not of the type that its key asks for; nothing where it is, or where
/// the text does not tell.
pub(super) fn wanted_at(text: &str, tree: &Node, byte: usize) -> Option<Wanted> {
    // The deserializer stops before the white space in front of a value.
    let after = &text[byte..];
    let byte = byte + after.len() - after.trim_start().len();
    let schema = schema();
    let mut path = Vec::new();
    let mut node = tree;
    let mut kind = &schema;
    loop {
        kind = resolved(&schema, kind);
        let next = match &node.content {
            Content::Leaf => None,
            Content::List(items)
            | Content::Tuple {
                named: false,
                items,
            } => {
                let item = kind.get("items");
                let held = items.iter().position(|item| holds(item, byte));
                item.zip(held)
                    .map(|(item, at)| (Some(Segment::Index(at)), &items[at], item))
            }
            Content::Tuple { named: true, items } => {
                let inner = match name_of(text, node) {
                    "Some" => Some(kind),
                    name => choice(kind, name),
                };
                let [item] = items.as_slice() else {
                    return None;
                };
                inner.map(|inner| (None, item, inner))
            }
            Content::Struct { fields, .. } => {
                let owner = match name_of(text, node) {
                    "" => Some(kind),
                    name => choice(kind, name).or(Some(kind)),
                };
                let held = fields.iter().find(|(.., value)| holds(value, byte));
                owner.zip(held).and_then(|(owner, (key, _, value))| {
                    let inner = resolved(&schema, owner).get("properties")?.get(key)?;
                    Some((Some(Segment::Key(key.clone())), value, inner))
                })
            }
        };
        let Some((segment, child, inner)) = next else {
            break;
        };
        path.extend(segment);
        (node, kind) = (child, inner);
    }
    let found = &text[node.span.clone()];
    let must = must_be(kind).filter(|_| !fits(kind, found))?;
    Some(Wanted {
        start: node.span.start,
        path: KeyPath(path).to_string(),
        found: shortened(found),
        must,
    })
}

/// A value's beginning: what stands on one line, of 40 characters at most.
fn shortened(found: &str) -> String {
    const SHOWN: usize = 40;
    let line = found.lines().next().unwrap_or_default();
    let end = line
        .char_indices()
        .nth(SHOWN)
        .map_or(line.len(), |(at, _)| at);
    if end == found.len() {
        found.to_owned()
    } else {
        format!("{}..", &line[..end])
    }
}

/// The byte lies in the value or just behind it, where a number ends too soon.
fn holds(node: &Node, byte: usize) -> bool {
    node.span.contains(&byte) || node.span.end == byte
}

/// The name before a bracket, empty where there is none.
fn name_of<'a>(text: &'a str, node: &Node) -> &'a str {
    let value = &text[node.span.clone()];
    value[..value.find('(').unwrap_or(0)].trim()
}

/// The type itself behind a reference or an option.
fn resolved<'a>(schema: &'a Value, kind: &'a Value) -> &'a Value {
    if let Some(path) = kind.get("$ref").and_then(Value::as_str) {
        let name = path.rsplit('/').next().unwrap_or_default();
        return schema
            .get("$defs")
            .and_then(|all| all.get(name))
            .unwrap_or(kind);
    }
    let options = kind.get("anyOf").and_then(Value::as_array);
    let given = options.and_then(|all| all.iter().find(|one| one["type"] != "null"));
    given.map_or(kind, |given| resolved(schema, given))
}

/// What stands in the brackets of a choice.
fn choice<'a>(kind: &'a Value, name: &str) -> Option<&'a Value> {
    let all = kind.get("oneOf")?.as_array()?;
    all.iter().find_map(|one| one.get("properties")?.get(name))
}

/// The simple type of a value, and whether it may be left out.
fn simple(kind: &Value) -> Option<&str> {
    match kind.get("type")? {
        Value::String(name) => Some(name),
        Value::Array(names) => names
            .iter()
            .filter_map(Value::as_str)
            .find(|n| *n != "null"),
        _ => None,
    }
}

/// Whether the text of a value is of a type, as far as its looks tell.
fn fits(kind: &Value, found: &str) -> bool {
    let whole = |text: &str| text.parse::<i64>().ok();
    match simple(kind) {
        Some("number") => found.parse::<f64>().is_ok(),
        Some("integer") => {
            let least = kind.get("minimum").and_then(Value::as_f64);
            #[allow(clippy::cast_precision_loss, reason = "only the sign counts")]
            whole(found).is_some_and(|n| least.is_none_or(|least| n as f64 >= least))
        }
        Some("boolean") => found == "true" || found == "false",
        Some("string") if kind.get("const").is_none() => found.starts_with(['"', 'r']),
        Some("array") => found.starts_with(['[', '(']),
        Some("object") => found.ends_with(')'),
        _ => true,
    }
}

/// What a value must be; nothing for types that have messages of their own.
fn must_be(kind: &Value) -> Option<String> {
    let text = match simple(kind)? {
        "number" => "a number".to_owned(),
        "integer" => match kind.get("minimum").and_then(Value::as_f64) {
            Some(least) => format!("a whole number of {least} or more"),
            None => "a whole number".to_owned(),
        },
        "boolean" => "true or false".to_owned(),
        "string" => "a text in quotes, \"like this\"".to_owned(),
        "array" => match kind.get("minItems").and_then(Value::as_u64) {
            Some(3) => "three numbers such as (0, 0, 1)".to_owned(),
            Some(count) => format!("a list of {count} values"),
            None => "a list such as [a, b]".to_owned(),
        },
        "object" => "a group such as (key: value)".to_owned(),
        _ => return None,
    };
    Some(text)
}
