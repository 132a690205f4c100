//! From a text to values, or to all that it departs from its format in.

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::error::FormatProblem;
use crate::format::{Syntax, options};
use crate::key_path::KeyPath;
use crate::locate::{Node, byte_at, line_column};
use crate::misread::{MOST_PROBLEMS, misread};
use crate::suggest::nearest;

/// Line and column at which a text departs from its format, and how.
pub type Departure = ((usize, usize), FormatProblem);

impl Syntax {
    /// Reads a text, called `whole` in messages.
    ///
    /// # Errors
    /// What the deserializer says, where it stops.
    pub fn parse<T: DeserializeOwned>(self, text: &str, whole: &str) -> Result<T, Departure> {
        match self {
            Self::Ron => parse_ron(text, whole),
            Self::Json => parse_json(text),
        }
    }
}

/// All that a text departs from the format in, as far as it can be followed.
#[derive(Debug)]
pub struct Departures<T> {
    /// In the order of the text, one at least.
    pub problems: Vec<Departure>,
    /// What was read with values that fit in the place of those that do not, and their key paths.
    pub mended: Option<(T, Vec<String>)>,
}

impl<T: DeserializeOwned> Departures<T> {
    /// `first` is what the deserializer said, which stops there; without the format's `schema` it is all. Messages
    /// call the text `whole`.
    #[must_use]
    pub fn of(
        (text, format): (&str, Syntax),
        first: Departure,
        schema: Option<&'static Value>,
        whole: &str,
    ) -> Self {
        let (Some(tree), Some(schema)) = (format.tree(text), schema) else {
            return Self {
                problems: vec![first],
                mended: None,
            };
        };
        let found = misread((text, format, &tree), schema, whole);
        let place = |(byte, problem)| (line_column(text, byte), problem);
        let mut problems: Vec<Departure> = found.problems.into_iter().map(place).collect();
        let followed = problems.len() < MOST_PROBLEMS;
        let mended = followed.then(|| Syntax::Ron.parse::<T>(&found.mended, whole));
        let mended = mended.and_then(Result::ok);
        // What the schema does not know of, the deserializer does.
        if problems.is_empty() || mended.is_none() && problems.iter().all(|one| one.0 != first.0) {
            problems.push(first);
            problems.sort_by_key(|(position, _)| *position);
        }
        Self {
            problems,
            mended: mended.map(|read| (read, found.paths)),
        }
    }
}

fn parse_json<T: DeserializeOwned>(text: &str) -> Result<T, Departure> {
    serde_json::from_str(text).map_err(|error| {
        let told = error.to_string();
        // The place is told before the problem.
        let problem = told
            .rsplit_once(" at line ")
            .map_or(&*told, |(problem, _)| problem);
        let problem = problem.to_owned();
        (
            (error.line(), error.column()),
            FormatProblem::Json { problem },
        )
    })
}

/// Reads a text in RON, where `Some` may be left out; the error has line and column, and calls the text `whole`.
///
/// # Errors
/// What the deserializer says, where it stops.
pub fn parse_ron<T: DeserializeOwned>(text: &str, whole: &str) -> Result<T, Departure> {
    options().from_str(text).map_err(|error| {
        let tree = Node::read(text);
        let end = byte_at(text, error.span.end.line, error.span.end.col);
        let start = byte_at(text, error.span.start.line, error.span.start.col);
        let group = tree.as_ref().map(|tree| tree.path_around(start));
        let owner = group.as_ref().map(KeyPath::to_string);
        let place = |word: &str| word_start(text, word, start, end);
        let owner_or = |outer: &Option<String>| match (&owner, outer) {
            (Some(path), _) if !path.is_empty() => path.clone(),
            (None, Some(outer)) => outer.clone(),
            (Some(_), _) | (None, None) => whole.to_owned(),
        };
        let (byte, problem) = match error.code {
            ron::Error::NoSuchStructField {
                expected,
                found,
                outer,
            } => (
                place(&found),
                FormatProblem::UnknownKey {
                    nearest: nearest(&found, expected.iter().copied()),
                    owner: owner_or(&outer),
                    expected: expected.to_vec(),
                    found,
                },
            ),
            ron::Error::NoSuchEnumVariant {
                expected,
                found,
                outer,
            } => (
                place(&found),
                FormatProblem::UnknownChoice {
                    nearest: nearest(&found, expected.iter().copied()),
                    owner: owner_or(&outer),
                    expected: expected.to_vec(),
                    found,
                },
            ),
            ron::Error::MissingStructField { field, outer } => (
                tree.as_ref()
                    .zip(group.as_ref())
                    .map_or(start, |(tree, path)| tree.place_of(path).0),
                FormatProblem::MissingKey {
                    key: field,
                    owner: owner_or(&outer),
                },
            ),
            ron::Error::DuplicateStructField { field, outer } => (
                place(field),
                FormatProblem::DuplicateKey {
                    key: field,
                    owner: owner_or(&outer),
                },
            ),
            error => {
                let owner = owner.unwrap_or_default();
                (start, FormatProblem::Ron { error, owner })
            }
        };
        (line_column(text, byte), problem)
    })
}

/// Where the word that the deserializer just read starts: its last occurrence before the cursor.
fn word_start(text: &str, word: &str, start: usize, end: usize) -> usize {
    text[..end].rfind(word).unwrap_or(start)
}
