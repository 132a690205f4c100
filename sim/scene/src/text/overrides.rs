//! Changes of single values of a settings file: `path.to.key=value`.

use std::fmt;
use std::ops::Range;

use serde::Deserialize;

use super::error::{OverrideError, Place};
use super::key_path::{KeyPath, Segment};
use super::tree::{Content, Node, Syntax, line_column};

/// A change of one value: `path.to.key=value`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct Override {
    path: KeyPath,
    value: String,
}

impl TryFrom<String> for Override {
    type Error = OverrideError;

    fn try_from(text: String) -> Result<Self, OverrideError> {
        Self::parse(&text)
    }
}

impl Override {
    /// Reads `path.to.key=value`; the value is RON.
    ///
    /// # Errors
    /// [`OverrideError`] if there is no `=`, no key path before it or no single RON value
    /// after it.
    pub fn parse(text: &str) -> Result<Self, OverrideError> {
        let error = |problem: String| OverrideError {
            text: shortened(text),
            problem,
        };
        let such_as = "bodies[0].material.density";
        let no_equals = || {
            error(format!(
                "write it as path.to.key=value, such as {such_as}=1000"
            ))
        };
        let (path, value) = text.split_once('=').ok_or_else(no_equals)?;
        let (path, value) = (path.trim(), value.trim());
        let shown = shortened(path);
        let no_path = || error(format!("'{shown}' is not a key path such as {such_as}"));
        let path = KeyPath::parse(path).ok_or_else(no_path)?;
        if Node::read(value).is_none() {
            let shown = shortened(value);
            return Err(error(format!("'{shown}' is not one RON value")));
        }
        Ok(Self {
            path,
            value: value.to_owned(),
        })
    }

    /// The path.
    #[must_use]
    pub fn path(&self) -> &KeyPath {
        &self.path
    }

    /// The first key, at which the path begins.
    #[must_use]
    pub fn section(&self) -> &str {
        match self.path.0.first() {
            Some(Segment::Key(key)) => key,
            _ => "",
        }
    }

    /// The number that the last of `overrides` gives the value at `path`, if one does.
    #[must_use]
    pub fn number(overrides: &[Self], path: &str) -> Option<f64> {
        let path = KeyPath::parse(path)?;
        let change = overrides.iter().rev().find(|change| change.path == path)?;
        change.value.parse().ok()
    }

    /// The text with the value instead of what stands at the path, or added where nothing does.
    ///
    /// # Errors
    /// Words that say why there is nothing to set there.
    pub fn apply(&self, text: &str) -> Result<String, String> {
        let tree = Node::read(text).ok_or_else(|| no_part("the text"))?;
        let changed = |span: Range<usize>, by: &str| {
            let mut text = text.to_owned();
            text.replace_range(span, by);
            text
        };
        let mut node = tree.inner();
        for (depth, segment) in self.path.0.iter().enumerate() {
            if let Some(child) = node.child(segment) {
                let last = depth + 1 == self.path.0.len();
                node = if last { child } else { child.inner() };
                continue;
            }
            let above = KeyPath(self.path.0[..depth].to_vec()).to_string();
            let all = node.span.clone();
            let (span, before, after) = match (&node.content, segment) {
                (Content::Struct { open, .. }, Segment::Key(_)) => (*open..*open, "", ", "),
                (Content::Tuple { items, .. }, Segment::Key(_)) if items.is_empty() => {
                    (all, "(", ")")
                }
                (Content::Leaf, Segment::Key(_)) if &text[all.clone()] == "None" => (all, "(", ")"),
                (Content::List(items) | Content::Tuple { items, .. }, Segment::Index(index)) => {
                    let length = items.len();
                    return Err(format!(
                        "{above}[{index}] is not there: {above} has {length}, counted from 0"
                    ));
                }
                _ => return Err(no_part(&above)),
            };
            let added = self.nested(depth, &above)?;
            return Ok(changed(span, &format!("{before}{added}{after}")));
        }
        Ok(changed(node.span.clone(), &self.value))
    }

    /// The value wrapped in the keys from `depth` on.
    fn nested(&self, depth: usize, above: &str) -> Result<String, String> {
        let mut text = self.value.clone();
        for (from_end, segment) in self.path.0[depth..].iter().rev().enumerate() {
            let Segment::Key(key) = segment else {
                return Err(no_part(above));
            };
            text = if from_end == 0 {
                format!("{key}: {text}")
            } else {
                format!("{key}: ({text})")
            };
        }
        Ok(text)
    }
}

impl fmt::Display for Override {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.path, self.value)
    }
}

/// A value without parts, at this path, lies on the way.
fn no_part(path: &str) -> String {
    format!("{path} has no such part to set")
}

/// A long text's beginning, for messages of one line.
#[must_use]
pub fn shortened(text: &str) -> String {
    const SHOWN: usize = 200;
    match text.char_indices().nth(SHOWN) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}.. ({} bytes)", &text[..end], text.len()),
    }
}

/// Where the value of a key path was written: in an override or in the text, which may be empty.
#[must_use]
pub fn place_of(
    path: &str,
    text: &str,
    syntax: Syntax,
    origin: &str,
    overrides: &[Override],
) -> Place {
    let path = KeyPath::parse(path);
    let mut changes = overrides.iter().rev();
    let sets = |change: &&Override| path.as_ref().is_some_and(|path| change.path.contains(path));
    if let Some(change) = changes.find(sets) {
        return Place {
            origin: format!("--set {}", shortened(&change.to_string())),
            position: None,
        };
    }
    let found = syntax.tree(text).zip(path);
    Place {
        origin: origin.to_owned(),
        position: found.map(|(tree, path)| line_column(text, tree.place_of(&path))),
    }
}
