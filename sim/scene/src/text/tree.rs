//! The tree of a text in RON or JSON: which value is written where.
//!
//! Values are read from it, and errors, checks and overrides find the position of a *key path* such as
//! `bodies[0].material.density` in it. It judges nothing but brackets and separators.

use std::ops::Range;
use std::path::Path;

use ron::extensions::Extensions;

use super::key_path::{KeyPath, Segment, is_identifier};

/// How a settings file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Syntax {
    /// Rusty Object Notation.
    Ron,
    /// JSON.
    Json,
}

impl Syntax {
    /// JSON for the extension `json`.
    #[must_use]
    pub fn of(file: &Path) -> Self {
        let json = |extension: &std::ffi::OsStr| extension.eq_ignore_ascii_case("json");
        if file.extension().is_some_and(json) {
            Self::Json
        } else {
            Self::Ron
        }
    }

    /// Where values stand; nothing where brackets or separators do not fit.
    pub(crate) fn tree(self, text: &str) -> Option<Node> {
        match self {
            Self::Ron => Node::read(text),
            Self::Json => Node::read_json(text),
        }
    }
}

/// The dialect of RON that settings files are written in.
pub(crate) fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}

/// A value in the text.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    /// Bytes of the whole value, its name included.
    pub(crate) span: Range<usize>,
    /// What it is made of.
    pub(crate) content: Content,
}

/// What a value is made of.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Content {
    /// `Name(key: value, ..)`, in JSON `{"key": value, ..}` with `quoted` keys; `open` is the byte after the
    /// bracket.
    Struct {
        open: usize,
        quoted: bool,
        /// Keys, where they stand, and their values.
        fields: Vec<(String, Range<usize>, Node)>,
    },
    /// `Name(value, ..)`, or `(value, ..)` if it is not `named`.
    Tuple { named: bool, items: Vec<Node> },
    /// `[value, ..]`
    List(Vec<Node>),
    /// A number, string, unit or anything else.
    Leaf,
}

impl Node {
    /// The tree of a text in RON; nothing where brackets or separators do not fit.
    pub(crate) fn read(text: &str) -> Option<Self> {
        let mut reader = TreeReader::new(text, false);
        while reader.rest().starts_with("#!") {
            reader.at += reader.rest().find(']')? + 1;
            reader.skip();
        }
        reader.whole()
    }

    /// The same of a text in JSON.
    pub(crate) fn read_json(text: &str) -> Option<Self> {
        TreeReader::new(text, true).whole()
    }

    /// The value seen through `Some(..)` and other names around a single value, `{"Name": ..}` in JSON.
    pub(crate) fn inner(&self) -> &Self {
        match &self.content {
            Content::Tuple { named: true, items } if items.len() == 1 => items[0].inner(),
            Content::Struct {
                quoted: true,
                fields,
                ..
            } => match fields.as_slice() {
                [(name, _, value)] if name.starts_with(|c: char| c.is_ascii_uppercase()) => {
                    value.inner()
                }
                _ => self,
            },
            _ => self,
        }
    }

    /// The value one step down.
    pub(crate) fn child(&self, segment: &Segment) -> Option<&Self> {
        match (&self.inner().content, segment) {
            (Content::Struct { fields, .. }, Segment::Key(key)) => fields
                .iter()
                .find(|(name, ..)| name == key)
                .map(|(.., node)| node),
            (Content::List(items) | Content::Tuple { items, .. }, Segment::Index(index)) => {
                items.get(*index)
            }
            _ => None,
        }
    }

    /// Byte at which the value of `path` starts; that of the nearest value above it which is
    /// written out where it is not.
    pub(crate) fn place_of(&self, path: &KeyPath) -> usize {
        let mut node = self;
        for segment in &path.0 {
            match node.child(segment) {
                Some(child) => node = child,
                None => break,
            }
        }
        node.span.start
    }
}

/// Line and column, both from 1 and the column in characters, of a byte of `text`.
///
/// # Panics
/// If the text has no character that begins there.
pub(crate) fn line_column(text: &str, byte: usize) -> (usize, usize) {
    let before = &text[..byte];
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    (
        before.matches('\n').count() + 1,
        before[line_start..].chars().count() + 1,
    )
}

/// Deepest nesting that is followed; the deserializer stops at as much.
const DEEPEST: usize = 128;

struct TreeReader<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    /// Braces hold keys in quotes.
    json: bool,
}

impl<'a> TreeReader<'a> {
    /// At the first value of a text.
    fn new(text: &'a str, json: bool) -> Self {
        let mut reader = Self {
            text,
            at: 0,
            depth: 0,
            json,
        };
        reader.skip();
        reader
    }

    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    /// The one value that the rest of the text is.
    fn whole(mut self) -> Option<Node> {
        let node = self.value()?;
        self.skip();
        self.rest().is_empty().then_some(node)
    }

    /// Skips white space and comments (block comments nest).
    fn skip(&mut self) {
        loop {
            let rest = self.rest();
            let trimmed = rest.trim_start();
            self.at += rest.len() - trimmed.len();
            if trimmed.starts_with("//") {
                self.at += trimmed.find('\n').unwrap_or(trimmed.len());
            } else if trimmed.starts_with("/*") {
                let (mut depth, mut bytes) = (0_usize, trimmed.as_bytes());
                loop {
                    (depth, bytes) = match bytes {
                        [b'/', b'*', rest @ ..] => (depth + 1, rest),
                        [b'*', b'/', rest @ ..] => (depth - 1, rest),
                        [_, rest @ ..] => (depth, rest),
                        [] => break,
                    };
                    if depth == 0 {
                        break;
                    }
                }
                self.at = self.text.len() - bytes.len();
            } else {
                return;
            }
        }
    }

    fn take(&mut self, token: char) -> bool {
        let found = self.rest().starts_with(token);
        if found {
            self.at += token.len_utf8();
        }
        found
    }

    fn identifier(&mut self) -> Option<(String, Range<usize>)> {
        let rest = self.rest();
        let length = rest
            .find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
            .unwrap_or(rest.len());
        let word = &rest[..length];
        is_identifier(word).then(|| {
            let span = self.at..self.at + length;
            self.at = span.end;
            (word.to_owned(), span)
        })
    }

    fn value(&mut self) -> Option<Node> {
        if self.depth == DEEPEST {
            return None;
        }
        self.depth += 1;
        let node = self.shallow_value();
        self.depth -= 1;
        node
    }

    fn shallow_value(&mut self) -> Option<Node> {
        let start = self.at;
        let named = self.identifier().is_some();
        let after_name = self.at;
        self.skip();
        let content = if self.take('(') {
            self.parenthesized(named)?
        } else if named {
            self.at = after_name;
            if self.rest().starts_with(['"', '#']) {
                self.at = start;
                self.string()?;
            }
            Content::Leaf
        } else if self.take('[') {
            Content::List(self.items(']')?)
        } else if self.json && self.take('{') {
            self.fields('}')?
        } else if self.take('{') {
            while !self.take('}') {
                self.value()?;
                self.skip();
                if !self.take(':') && !self.take(',') && !self.rest().starts_with('}') {
                    return None;
                }
                self.skip();
            }
            Content::Leaf
        } else if self.rest().starts_with(['"', '\'']) {
            self.string()?;
            Content::Leaf
        } else {
            let rest = self.rest();
            let length = rest
                .find(|c: char| c.is_whitespace() || ",:()[]{}\"'/".contains(c))
                .unwrap_or(rest.len());
            if length == 0 {
                return None;
            }
            self.at += length;
            Content::Leaf
        };
        Some(Node {
            span: start..self.at,
            content,
        })
    }

    fn parenthesized(&mut self, named: bool) -> Option<Content> {
        let open = self.at;
        self.skip();
        let before = self.at;
        let is_struct = self.identifier().is_some() && {
            self.skip();
            self.rest().starts_with(':')
        };
        self.at = before;
        if !is_struct {
            return Some(Content::Tuple {
                named,
                items: self.items(')')?,
            });
        }
        self.at = open;
        self.fields(')')
    }

    /// Keys with their values up to the closing bracket.
    fn fields(&mut self, close: char) -> Option<Content> {
        let (open, quoted) = (self.at, self.json);
        let mut fields = Vec::new();
        loop {
            self.skip();
            if self.take(close) {
                return Some(Content::Struct {
                    open,
                    quoted,
                    fields,
                });
            }
            let (name, key) = if quoted {
                self.quoted_key()?
            } else {
                self.identifier()?
            };
            self.skip();
            self.take(':').then_some(())?;
            self.skip();
            fields.push((name, key, self.value()?));
            self.skip();
            self.separator(close)?;
        }
    }

    /// A comma, or the bracket that closes.
    fn separator(&mut self, close: char) -> Option<()> {
        (self.take(',') || self.rest().starts_with(close)).then_some(())
    }

    /// A key in quotes, without them; its span holds them.
    fn quoted_key(&mut self) -> Option<(String, Range<usize>)> {
        let start = self.at;
        self.string()?;
        let name = &self.text[start + 1..self.at - 1];
        Some((name.to_owned(), start..self.at))
    }

    fn items(&mut self, close: char) -> Option<Vec<Node>> {
        let mut items = Vec::new();
        loop {
            self.skip();
            if self.take(close) {
                return Some(items);
            }
            items.push(self.value()?);
            self.skip();
            self.separator(close)?;
        }
    }

    /// A string, raw string or character.
    fn string(&mut self) -> Option<()> {
        let rest = self.rest();
        let body = rest.trim_start_matches(|c: char| c.is_ascii_alphabetic());
        let hashes = body.len() - body.trim_start_matches('#').len();
        let prefix = rest.len() - body.len();
        let raw = rest[..prefix].ends_with('r');
        let quoted = &body[hashes..];
        let quote = quoted.chars().next().filter(|c| "\"'".contains(*c))?;
        let inside = &quoted[1..];
        let end = if raw {
            let close = format!("\"{}", "#".repeat(hashes));
            inside.find(&close)? + close.len()
        } else {
            let mut escaped = false;
            inside
                .char_indices()
                .find(|&(_, c)| {
                    let closes = c == quote && !escaped;
                    escaped = c == '\\' && !escaped;
                    closes
                })
                .map(|(at, _)| at + 1)?
        };
        self.at += prefix + hashes + 1 + end;
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::{Content, KeyPath, Node, line_column};

    const TEXT: &str = r##"// a scene (with brackets
Scene(
    name: "a \" (b", /* nested /* ( */ */
    raw: r#"x " ("#,
    bodies: [
        (shape: Box(size: (1.0, 2e-3, -3)), skin: Some((color: (1, 0, 0)))),
        (material: (density: 1.06e3,),),
    ],
    map: { "k": (1, 2), 'c': [] },
    unit: None,
)
"##;

    fn slice(path: &str) -> Option<&'static str> {
        let tree = Node::read(TEXT).expect("the text is well formed");
        let mut node = &tree;
        for segment in &KeyPath::parse(path).expect("a path").0 {
            node = node.child(segment)?;
        }
        Some(&TEXT[node.span.clone()])
    }

    #[test]
    fn finds_values_by_path() {
        assert_eq!(slice("bodies[1].material.density"), Some("1.06e3"));
        assert_eq!(slice("bodies[0].shape.size[2]"), Some("-3"));
        assert_eq!(slice("bodies[0].skin.color[0]"), Some("1"));
        assert_eq!(slice("name"), Some(r#""a \" (b""#));
        assert_eq!(slice("raw"), Some(r##"r#"x " ("#"##));
        assert_eq!(slice("unit"), Some("None"));
        assert_eq!(slice("bodies[2]"), None);
        assert_eq!(slice("bodies[0].color"), None);
    }

    #[test]
    fn places_a_default_at_the_value_above_it() {
        let tree = Node::read(TEXT).expect("the text is well formed");
        let path = KeyPath::parse("bodies[1].material.poissons_ratio").expect("a path");
        let byte = tree.place_of(&path);
        assert!(TEXT[byte..].starts_with("(density"));
    }

    #[test]
    fn refuses_what_it_cannot_follow() {
        for text in ["", "(", "(a: 1", "(a: 1 b: 2)", "[1, 2", "(a: \"x)", "1 2"] {
            assert_eq!(Node::read(text), None, "{text}");
        }
        for (open, close) in [
            ("(", ")"),
            ("[", "]"),
            ("{1: ", "}"),
            ("Some(", ")"),
            ("(a: ", ")"),
        ] {
            let nested = |depth: usize| format!("{}1{}", open.repeat(depth), close.repeat(depth));
            assert!(Node::read(&nested(100)).is_some(), "{open} 100 deep");
            assert_eq!(Node::read(&nested(30_000)), None, "{open} 30,000 deep");
            assert_eq!(Node::read(&open.repeat(30_000)), None, "{open} left open");
        }
        assert!(matches!(
            Node::read("()").map(|node| node.content),
            Some(Content::Tuple { .. })
        ));
    }

    #[test]
    fn columns_count_characters() {
        let text = "aé\nb\n";
        let places = text.char_indices().map(|(byte, _)| line_column(text, byte));
        assert!(places.eq([(1, 1), (1, 2), (1, 3), (2, 1), (2, 2)]));
    }
}
