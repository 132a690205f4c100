//! From the tree of a text to values: what does not fit is named with its position and the remedy.
//!
//! RON and JSON are read by the same code, so that both have the same messages: a deserializer that walks the tree
//! knows at each value where it was written and which key path leads to it.

use std::fmt::{self, Display};
use std::ops::Range;

use serde::de::value::StrDeserializer;
use serde::de::{
    self, DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, Expected, IgnoredAny,
    MapAccess, SeqAccess, Unexpected, VariantAccess, Visitor,
};
use serde::{Deserialize, forward_to_deserialize_any};

use super::error::{Place, TextError};
use super::key_path::{KeyPath, Segment};
use super::overrides::shortened;
use super::tree::{Content, Node, Syntax, line_column, options};
use crate::{DidYouMean, nearest};

/// Name of the newtype that takes a value's text instead of the value.
const RAW: &str = "phyxel_scene::Raw";

/// A value as it is written.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(rename = "phyxel_scene::Raw")]
pub struct Raw(pub String);

/// Reads settings from a text in RON (`Some` may be left out) or JSON. Messages name it `origin` and call it `whole`.
///
/// # Errors
/// [`TextError::At`]: where the text departs from the format first.
pub fn parse<T: DeserializeOwned>(
    text: &str,
    syntax: Syntax,
    origin: &str,
    whole: &str,
) -> Result<T, TextError> {
    let at = |position: (usize, usize), path: String, problem: String| TextError::At {
        place: Place {
            origin: origin.to_owned(),
            position: Some(position),
        },
        path,
        problem,
    };
    let sound = syntax != Syntax::Json || serde_json::from_str::<IgnoredAny>(text).is_ok();
    let Some(tree) = syntax.tree(text).filter(|_| sound) else {
        let (position, problem) = unreadable(text, syntax);
        return Err(at(position, String::new(), problem));
    };
    let value = Value {
        text,
        syntax,
        node: &tree,
    };
    T::deserialize(value).map_err(|error| {
        let (byte, path, problem) = error.told(text, whole);
        at(line_column(text, byte), path, problem)
    })
}

/// What the language's own reader says of a text that has no tree, and the line and the column.
fn unreadable(text: &str, syntax: Syntax) -> ((usize, usize), String) {
    let found = match syntax {
        Syntax::Ron => options().from_str::<IgnoredAny>(text).err().map(|error| {
            let (start, mut told) = (error.span.start, error.code.to_string());
            if let Some(first) = told.get_mut(..1) {
                first.make_ascii_lowercase();
            }
            ((start.line, start.col), told)
        }),
        Syntax::Json => serde_json::from_str::<IgnoredAny>(text).err().map(|error| {
            let told = error.to_string();
            // The position comes before the problem.
            let told = (told.rsplit_once(" at line ")).map_or(&*told, |(told, _)| told);
            ((error.line(), error.column()), told.to_owned())
        }),
    };
    let unseen = || ((1, 1), "brackets or separators do not fit".to_owned());
    let ((line, column), problem) = found.unwrap_or_else(unseen);
    ((line.max(1), column.max(1)), problem)
}

/// What is wrong, and where once it is known.
#[derive(Debug)]
struct ValueError {
    span: Option<Range<usize>>,
    /// Innermost first.
    path: Vec<Segment>,
    problem: ValueProblem,
}

#[derive(Debug)]
enum ValueProblem {
    Unknown {
        what: &'static str,
        found: String,
        known: &'static [&'static str],
    },
    Missing(&'static str),
    Twice(String),
    Type(String),
    Said(String),
}

impl ValueError {
    fn new(problem: ValueProblem) -> Self {
        Self {
            span: None,
            path: Vec::new(),
            problem,
        }
    }

    fn unknown(what: &'static str, found: &str, known: &'static [&'static str]) -> Self {
        let found = found.to_owned();
        Self::new(ValueProblem::Unknown { what, found, known })
    }

    fn at(mut self, span: &Range<usize>) -> Self {
        self.span.get_or_insert_with(|| span.clone());
        self
    }

    fn under(mut self, segment: Segment) -> Self {
        self.path.push(segment);
        self
    }

    /// The byte where it is, the key path and the message.
    fn told(mut self, text: &str, whole: &str) -> (usize, String, String) {
        self.path.reverse();
        let path = KeyPath(self.path).to_string();
        let owner = if path.is_empty() { whole } else { &path };
        let span = self.span.unwrap_or(0..0);
        let problem = match self.problem {
            ValueProblem::Unknown { what, found, known } => format!(
                "unknown {what} '{}' in {owner}{}; {what}s are {}",
                shortened(&found),
                DidYouMean(nearest(&found, known.iter().copied())),
                known.join(", ")
            ),
            ValueProblem::Missing(key) => format!("key '{key}' is missing in {owner}"),
            ValueProblem::Twice(key) => format!("key '{key}' stands twice in {owner}"),
            ValueProblem::Type(must) => {
                let found = shortened(&text[span.clone()]);
                format!("{owner} is {found}; it must be {must}")
            }
            ValueProblem::Said(said) => format!("{owner}: {said}"),
        };
        (span.start, path, problem)
    }
}

impl Display for ValueError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.problem)
    }
}

impl std::error::Error for ValueError {}

impl de::Error for ValueError {
    fn custom<T: Display>(said: T) -> Self {
        Self::new(ValueProblem::Said(said.to_string()))
    }

    fn invalid_type(_: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::new(ValueProblem::Type(must_be(&expected.to_string())))
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        let must = match (found, &*expected.to_string()) {
            (Unexpected::Unsigned(_), "u32") => format!("{} at most", u32::MAX),
            (_, expected) => must_be(expected),
        };
        Self::new(ValueProblem::Type(must))
    }

    fn invalid_length(_: usize, expected: &dyn Expected) -> Self {
        Self::new(ValueProblem::Type(must_be(&expected.to_string())))
    }

    fn unknown_field(found: &str, known: &'static [&'static str]) -> Self {
        Self::unknown("key", found, known)
    }

    fn unknown_variant(found: &str, known: &'static [&'static str]) -> Self {
        Self::unknown("choice", found, known)
    }

    fn missing_field(key: &'static str) -> Self {
        Self::new(ValueProblem::Missing(key))
    }
}

/// What a value must be, in the format's words for those of its types.
fn must_be(expected: &str) -> String {
    let words = match expected {
        "f64" | "f32" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number of 0 or more",
        "i32" | "i64" => "a whole number",
        "a boolean" => "true or false",
        "a string" | "path string" => "a text in quotes, \"like this\"",
        "a sequence" => "a list such as [a, b]",
        "an array of length 3" | "a sequence of 3 f64 values" => {
            "three numbers such as (0, 0, 1), in JSON [0, 0, 1]"
        }
        other if other.starts_with("struct ") => "a group such as (key: value)",
        other => other,
    };
    words.to_owned()
}

/// A value in the text.
#[derive(Clone, Copy)]
struct Value<'a> {
    text: &'a str,
    syntax: Syntax,
    node: &'a Node,
}

impl<'a> Value<'a> {
    fn of(self, node: &'a Node) -> Self {
        Self { node, ..self }
    }

    fn written(self) -> &'a str {
        &self.text[self.node.span.clone()]
    }

    /// The name that RON has before a bracket or alone.
    fn name(self) -> &'a str {
        let text = self.written();
        let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        let name = &text[..end.unwrap_or(text.len())];
        if name.starts_with(|c: char| c.is_ascii_digit())
            || text[name.len()..].starts_with(['"', '#'])
        {
            ""
        } else {
            name
        }
    }

    fn wrong(self, must: impl Into<String>) -> ValueError {
        ValueError::new(ValueProblem::Type(must.into())).at(&self.node.span)
    }

    fn fields<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ValueError> {
        let fields = match &self.node.content {
            Content::Struct { fields, .. } => fields.as_slice(),
            Content::Tuple { items, .. } if items.is_empty() => &[],
            _ => return Err(self.wrong("a group such as (key: value)")),
        };
        visitor.visit_map(Fields {
            value: self,
            fields,
            next: 0,
        })
    }

    fn items<'de, V: Visitor<'de>>(
        self,
        items: &'a [Node],
        visitor: V,
    ) -> Result<V::Value, ValueError> {
        let must = must_be(&(&visitor as &dyn Expected).to_string());
        let mut items = Items {
            value: self,
            items: items.iter().enumerate(),
        };
        let value = visitor.visit_seq(&mut items)?;
        match items.items.next() {
            None => Ok(value),
            Some(_) => Err(self.wrong(must)),
        }
    }

    fn leaf<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ValueError> {
        let text = self.written();
        let digits = text.replace('_', "");
        if text.contains(['"', '\'']) {
            let string = match self.syntax {
                Syntax::Ron => ron::from_str(text).map_err(|error| error.code.to_string()),
                Syntax::Json => serde_json::from_str(text).map_err(|error| error.to_string()),
            };
            let string =
                string.map_err(|said: String| ValueError::new(ValueProblem::Said(said)))?;
            return visitor.visit_string(string);
        }
        match text {
            "true" => visitor.visit_bool(true),
            "false" => visitor.visit_bool(false),
            _ if text.contains(|c: char| c.is_ascii_digit())
                && !text.starts_with(char::is_alphabetic) =>
            {
                if let Ok(whole) = digits.parse() {
                    visitor.visit_u64(whole)
                } else if let Ok(whole) = digits.parse() {
                    visitor.visit_i64(whole)
                } else if let Ok(number) = digits.parse() {
                    visitor.visit_f64(number)
                } else {
                    Err(de::Error::invalid_type(Unexpected::Other(text), &visitor))
                }
            }
            _ => Err(de::Error::invalid_type(Unexpected::Other(text), &visitor)),
        }
    }
}

impl<'de> Deserializer<'de> for Value<'_> {
    type Error = ValueError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ValueError> {
        let value = match &self.node.content {
            Content::Struct { .. } => self.fields(visitor),
            Content::Tuple {
                named: false,
                items,
            }
            | Content::List(items) => self.items(items, visitor),
            Content::Leaf => self.leaf(visitor),
            Content::Tuple { .. } => Err(de::Error::invalid_type(
                Unexpected::Other("a choice"),
                &visitor,
            )),
        };
        value.map_err(|error| error.at(&self.node.span))
    }

    /// All that Rust reads as a number, `inf` and `NaN` too, which checks refuse with a remedy.
    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ValueError> {
        match self.written().replace('_', "").parse() {
            Ok(number) if matches!(self.node.content, Content::Leaf) => visitor.visit_f64(number),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ValueError> {
        let none = match self.syntax {
            Syntax::Ron => "None",
            Syntax::Json => "null",
        };
        match &self.node.content {
            Content::Leaf if self.written() == none => visitor.visit_none(),
            Content::Tuple { named: true, items } if items.len() == 1 && self.name() == "Some" => {
                visitor.visit_some(self.of(&items[0]))
            }
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, ValueError> {
        if name == RAW {
            let text = StrDeserializer::new(self.written());
            return visitor.visit_newtype_struct(text);
        }
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ValueError> {
        if !["", name].contains(&self.name()) {
            return Err(self.wrong("a group such as (key: value)"));
        }
        self.fields(visitor)
            .map_err(|error| error.at(&self.node.span))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        choices: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ValueError> {
        let start = self.node.span.start;
        let choice = match (self.syntax, &self.node.content) {
            (Syntax::Ron, content) if !self.name().is_empty() => {
                let values = (!matches!(content, Content::Leaf)).then_some(self);
                Some((self.name().to_owned(), start, values))
            }
            (Syntax::Json, Content::Leaf) => {
                let name = serde_json::from_str(self.written());
                name.ok().map(|name| (name, start, None))
            }
            (Syntax::Json, Content::Struct { fields, .. }) => match fields.as_slice() {
                [(name, key, value)] => Some((name.clone(), key.start, Some(self.of(value)))),
                _ => None,
            },
            _ => None,
        };
        let Some((name, start, content)) = choice else {
            return Err(self.wrong(format!("one of {}", choices.join(", "))));
        };
        let choice = Choice {
            span: start..start + name.len(),
            name,
            whole: self,
            content,
        };
        visitor
            .visit_enum(choice)
            .map_err(|error| error.at(&self.node.span))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map identifier ignored_any
    }
}

/// The keys of a group.
struct Fields<'a> {
    value: Value<'a>,
    fields: &'a [(String, Range<usize>, Node)],
    next: usize,
}

impl<'de> MapAccess<'de> for Fields<'_> {
    type Error = ValueError;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, ValueError> {
        let Some((name, span, _)) = self.fields.get(self.next) else {
            return Ok(None);
        };
        let before = &self.fields[..self.next];
        if before.iter().any(|(other, ..)| other == name) {
            return Err(ValueError::new(ValueProblem::Twice(name.clone())).at(span));
        }
        let key = StrDeserializer::<ValueError>::new(name);
        seed.deserialize(key)
            .map(Some)
            .map_err(|error| error.at(span))
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<T::Value, ValueError> {
        let (name, _, node) = &self.fields[self.next];
        self.next += 1;
        let value = seed.deserialize(self.value.of(node));
        value.map_err(|error| error.at(&node.span).under(Segment::Key(name.clone())))
    }
}

/// The values of a list.
struct Items<'a> {
    value: Value<'a>,
    items: std::iter::Enumerate<std::slice::Iter<'a, Node>>,
}

impl<'de> SeqAccess<'de> for &mut Items<'_> {
    type Error = ValueError;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, ValueError> {
        let Some((index, node)) = self.items.next() else {
            return Ok(None);
        };
        let value = seed.deserialize(self.value.of(node)).map(Some);
        value.map_err(|error| error.at(&node.span).under(Segment::Index(index)))
    }
}

/// The choice of an enum; `content` is what holds its values, in RON the choice itself.
struct Choice<'a> {
    name: String,
    span: Range<usize>,
    whole: Value<'a>,
    content: Option<Value<'a>>,
}

impl<'de, 'a> EnumAccess<'de> for Choice<'a> {
    type Error = ValueError;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(
        self,
        seed: V,
    ) -> Result<(V::Value, Self), ValueError> {
        let name = StrDeserializer::<ValueError>::new(&self.name);
        let choice = seed
            .deserialize(name)
            .map_err(|error| error.at(&self.span))?;
        Ok((choice, self))
    }
}

impl<'a> Choice<'a> {
    fn wrong(&self, must: &str) -> ValueError {
        self.whole.wrong(must.replace("{}", &self.name))
    }
}

impl<'de> VariantAccess<'de> for Choice<'_> {
    type Error = ValueError;

    fn unit_variant(self) -> Result<(), ValueError> {
        match self.content {
            None => Ok(()),
            Some(_) => Err(self.wrong("{} alone")),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(
        self,
        seed: T,
    ) -> Result<T::Value, ValueError> {
        let inner = self
            .content
            .and_then(|content| match &content.node.content {
                _ if content.syntax == Syntax::Json => Some(content),
                Content::Tuple { items, .. } if items.len() == 1 => Some(content.of(&items[0])),
                _ => None,
            });
        let Some(inner) = inner else {
            return Err(self.wrong("{}(..) with one value"));
        };
        let value = seed.deserialize(inner);
        value.map_err(|error| error.at(&inner.node.span))
    }

    fn tuple_variant<V: Visitor<'de>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, ValueError> {
        let content = self.content.map(|content| (content, &content.node.content));
        match content {
            Some((content, Content::Tuple { items, .. } | Content::List(items)))
                if items.len() == length =>
            {
                content.items(items, visitor)
            }
            _ => Err(self.wrong(&format!("{{}}(..) with {length} values"))),
        }
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ValueError> {
        match self.content {
            Some(content) => content
                .fields(visitor)
                .map_err(|error| error.at(&content.node.span)),
            None => Err(self.wrong("a group such as {}(key: value)")),
        }
    }
}
