//! All that a text says and its format does not know: keys, choices and types, by the format's own schema.
//!
//! The deserializer stops at the first. The text's tree is compared with the schema instead, and written anew
//! in RON with a value that fits in the place of each that does not, so that all others can be checked too.

use std::collections::HashSet;

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::error::FormatProblem;
use crate::format::{Syntax, options};
use crate::key_path::{KeyPath, Segment};
use crate::kind::{Kind, name_of, names_of, renamed, required};
use crate::locate::{Content, Node};
use crate::suggest::nearest;

/// Most problems that are gathered: nobody reads more, and a list of a million values may be all wrong.
pub(crate) const MOST_PROBLEMS: usize = 1000;

/// What a text says and the format does not know.
#[derive(Debug)]
pub(crate) struct Misread {
    /// Bytes at which they begin, in the order of the text.
    pub(crate) problems: Vec<(usize, FormatProblem)>,
    /// Key paths of the values that stand for others in `mended`.
    pub(crate) paths: Vec<String>,
    /// The text in RON with these values.
    pub(crate) mended: String,
}

/// Compares a text, called `whole` in messages, with the schema of its format.
pub(crate) fn misread(
    (text, format, tree): (&str, Syntax, &Node),
    root: &'static Value,
    whole: &str,
) -> Misread {
    let mut reader = Reader {
        root,
        whole,
        text,
        format,
        path: Vec::new(),
        found: Misread {
            problems: Vec::new(),
            paths: Vec::new(),
            mended: String::new(),
        },
    };
    let mended = reader.value(tree, root);
    let mut found = reader.found;
    found.mended = mended;
    found.problems.sort_by_key(|(byte, _)| *byte);
    found
}

struct Reader<'a> {
    /// The format's schema.
    root: &'static Value,
    /// What the text is called.
    whole: &'a str,
    text: &'a str,
    format: Syntax,
    path: Vec<Segment>,
    found: Misread,
}

impl<'a> Reader<'a> {
    fn text_of(&self, node: &Node) -> &'a str {
        &self.text[node.span.clone()]
    }

    fn path(&self) -> String {
        KeyPath(self.path.clone()).to_string()
    }

    /// The group that the reader is in, for messages.
    fn owner(&self) -> String {
        match self.path() {
            path if path.is_empty() => self.whole.to_owned(),
            path => path,
        }
    }

    fn tell(&mut self, byte: usize, problem: FormatProblem) {
        if self.found.problems.len() < MOST_PROBLEMS {
            self.found.problems.push((byte, problem));
        }
    }

    /// A value that does not fit, and one that does.
    fn wrong(&mut self, byte: usize, problem: FormatProblem, kind: &Kind) -> String {
        self.tell(byte, problem);
        let path = self.path();
        self.found.paths.push(path);
        kind.any(self.root)
    }

    fn wrong_type(&mut self, node: &Node, kind: &Kind) -> String {
        let found = self.text_of(node);
        let must = match kind {
            Kind::Whole { most, .. } if found.parse::<i64>().is_ok_and(|n| n > *most) => {
                format!("{most} at most")
            }
            _ => kind.must_be(self.format),
        };
        let problem = FormatProblem::Type {
            path: self.owner(),
            found: shortened(found),
            must,
        };
        self.wrong(node.span.start, problem, kind)
    }

    /// The value in RON, or one that fits in its place.
    fn value(&mut self, node: &Node, schema: &'static Value) -> String {
        let (kind, optional) = Kind::of(self.root, schema);
        let text = self.text_of(node);
        if optional {
            let none = match self.format {
                Syntax::Ron => "None",
                Syntax::Json => "null",
            };
            if text == none {
                return "None".to_owned();
            }
            if let Content::Tuple { named: true, items } = &node.content
                && let [item] = items.as_slice()
                && text.starts_with("Some")
            {
                return self.value(item, schema);
            }
        }
        match (&kind, &node.content) {
            (Kind::Group(schema), Content::Struct { fields, .. }) => {
                self.group(node, fields, schema)
            }
            (Kind::Group(schema), Content::Tuple { items, .. }) if items.is_empty() => {
                self.group(node, &[], schema)
            }
            (Kind::Choice(choices), _) => self.choice(node, choices),
            (Kind::List(item), Content::List(items)) => {
                let items = self.items(items.iter().map(|node| (node, *item)));
                format!("[{items}]")
            }
            (Kind::Tuple(kinds), content) => match self.tuple(content) {
                Some(items) if items.len() == kinds.len() => {
                    let items = self.items(items.iter().zip(kinds.iter().copied()));
                    format!("({items})")
                }
                _ => self.wrong_type(node, &kind),
            },
            (_, Content::Leaf) => self
                .leaf(text, &kind)
                .unwrap_or_else(|| self.wrong_type(node, &kind)),
            _ => self.wrong_type(node, &kind),
        }
    }

    /// Values one after the other.
    fn items<'n>(&mut self, items: impl Iterator<Item = (&'n Node, &'static Value)>) -> String {
        let mut written = String::new();
        for (index, (item, kind)) in items.enumerate() {
            self.path.push(Segment::Index(index));
            written.push_str(&self.value(item, kind));
            written.push_str(", ");
            self.path.pop();
        }
        written
    }

    /// Values of a fixed number, which JSON writes as a list.
    fn tuple<'n>(&self, content: &'n Content) -> Option<&'n [Node]> {
        match (content, self.format) {
            (
                Content::Tuple {
                    named: false,
                    items,
                },
                Syntax::Ron,
            )
            | (Content::List(items), Syntax::Json) => Some(items),
            _ => None,
        }
    }

    /// A number, a text or a truth value in RON; nothing where it is none.
    fn leaf(&self, text: &str, kind: &Kind) -> Option<String> {
        match kind {
            Kind::Number => self.read::<f64>(text).map(|_| text.to_owned()),
            Kind::Whole { least, most } => {
                let number = self.read::<i64>(text)?;
                (*least..=*most)
                    .contains(&number)
                    .then(|| number.to_string())
            }
            Kind::Truth => self.read::<bool>(text).map(|truth| truth.to_string()),
            Kind::Text => self.read::<String>(text).map(|text| format!("{text:?}")),
            _ => None,
        }
    }

    fn read<T: DeserializeOwned>(&self, text: &str) -> Option<T> {
        match self.format {
            Syntax::Ron => options().from_str(text).ok(),
            Syntax::Json => serde_json::from_str(text).ok(),
        }
    }

    fn group(
        &mut self,
        node: &Node,
        fields: &[(String, std::ops::Range<usize>, Node)],
        schema: &'static Value,
    ) -> String {
        let properties = schema.get("properties").and_then(Value::as_object);
        let Some(properties) = properties else {
            return "()".to_owned();
        };
        let mut written = String::from("(");
        let mut given: Vec<&str> = Vec::new();
        let known = fields
            .iter()
            .filter_map(|(name, ..)| properties.get_key_value(name));
        let spelt: HashSet<&str> = known.map(|(key, _)| key.as_str()).collect();
        for (name, place, value) in fields {
            let known = properties.get_key_value(name);
            let alike = match known {
                Some(_) => None,
                None => {
                    let keys = properties.iter().map(|(key, kind)| (key.as_str(), kind));
                    renamed(name, keys.clone()).or_else(|| nearest(name, keys.map(|(key, _)| key)))
                }
            };
            let problem = if known.is_none() {
                Some(FormatProblem::UnknownKey {
                    nearest: alike,
                    owner: self.owner(),
                    expected: properties.keys().map(String::as_str).collect(),
                    found: name.clone(),
                })
            } else if let Some((key, _)) = known.filter(|(key, _)| given.contains(&key.as_str())) {
                Some(FormatProblem::DuplicateKey {
                    key,
                    owner: self.owner(),
                })
            } else {
                None
            };
            if let Some(problem) = problem {
                self.tell(place.start, problem);
            }
            // What is meant by a misspelt key is read as that.
            let meant = alike.filter(|key| !spelt.contains(key) && !given.contains(key));
            let meant = meant.and_then(|key| properties.get_key_value(key));
            let Some((key, kind)) = known.or(meant) else {
                continue;
            };
            self.path.push(Segment::Key(key.clone()));
            if known.is_none() {
                let path = self.path();
                self.found.paths.push(path);
            }
            let value = self.value(value, kind);
            if !given.contains(&key.as_str()) {
                written.push_str(&format!("{key}: {value}, "));
                given.push(key);
            }
            self.path.pop();
        }
        for key in required(schema).filter(|key| !given.contains(key)) {
            let problem = FormatProblem::MissingKey {
                key,
                owner: self.owner(),
            };
            self.path.push(Segment::Key(key.to_owned()));
            let kind = Kind::of(self.root, &properties[key]).0;
            let value = self.wrong(node.span.start, problem, &kind);
            written.push_str(&format!("{key}: {value}, "));
            self.path.pop();
        }
        written.push(')');
        written
    }

    fn choice(&mut self, node: &Node, choices: &'static [Value]) -> String {
        let kind = Kind::Choice(choices);
        let Some((name, byte)) = self.name(node) else {
            return self.wrong_type(node, &kind);
        };
        let known = |name: &str| choices.iter().find(|choice| name_of(choice) == name);
        let renamed = renamed(name, choices.iter().map(|choice| (name_of(choice), choice)));
        let nearest = renamed.or_else(|| nearest(name, names_of(choices)));
        if known(name).is_none() {
            let problem = FormatProblem::UnknownChoice {
                nearest,
                owner: self.owner(),
                expected: names_of(choices),
                found: name.to_owned(),
            };
            self.tell(byte, problem);
            let path = self.path();
            self.found.paths.push(path);
        }
        // What is meant by a misspelt choice is read as that.
        let Some(choice) = known(name).or_else(|| nearest.and_then(known)) else {
            return kind.any(self.root);
        };
        let name = name_of(choice);
        let Some(content) = choice.get("properties") else {
            return match &node.content {
                Content::Leaf => name.to_owned(),
                _ => self.wrong_type(node, &kind),
            };
        };
        let content = &content[name];
        let inner = Kind::of(self.root, content).0;
        let written = match (&inner, &node.content) {
            // In RON the brackets of the name are those of the group, in JSON the group has its own.
            (
                Kind::Group(schema),
                Content::Struct {
                    quoted: false,
                    fields,
                    ..
                },
            ) => self.group(node, fields, schema),
            (Kind::Group(schema), Content::Tuple { items, .. }) if items.is_empty() => {
                self.group(node, &[], schema)
            }
            (Kind::Tuple(kinds), Content::Tuple { items, .. }) if items.len() == kinds.len() => {
                let items = self.items(items.iter().zip(kinds.iter().copied()));
                format!("({items})")
            }
            (
                _,
                Content::Struct {
                    quoted: true,
                    fields,
                    ..
                },
            ) => {
                let value = self.value(&fields[0].2, content);
                match inner {
                    Kind::Group(_) | Kind::Tuple(_) => value,
                    _ => format!("({value})"),
                }
            }
            (Kind::Group(_) | Kind::Tuple(_), _) => return self.wrong_type(node, &kind),
            (_, Content::Tuple { items, .. }) if items.len() == 1 => {
                format!("({})", self.value(&items[0], content))
            }
            _ => return self.wrong_type(node, &kind),
        };
        format!("{name}{written}")
    }

    /// The name of a choice, and where it stands; nothing where the value has none.
    fn name(&self, node: &Node) -> Option<(&'a str, usize)> {
        let text = self.text_of(node);
        let (name, byte) = match (&node.content, self.format) {
            (Content::Leaf, Syntax::Json) => {
                let name = text.strip_prefix('"')?.strip_suffix('"')?;
                (name, node.span.start)
            }
            (Content::Struct { fields, .. }, Syntax::Json) => {
                let [(_, key, _)] = fields.as_slice() else {
                    return None;
                };
                (&self.text[key.start + 1..key.end - 1], key.start)
            }
            (_, Syntax::Json) => return None,
            (Content::Leaf, Syntax::Ron) => (text, node.span.start),
            (_, Syntax::Ron) => (text[..text.find('(')?].trim(), node.span.start),
        };
        name.starts_with(|c: char| c.is_alphabetic())
            .then_some((name, byte))
    }
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
