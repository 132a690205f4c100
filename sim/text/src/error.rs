//! How a text departs from its format, said with the place and the remedy.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// How a text departs from the format.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FormatProblem {
    /// A key that the format does not have.
    #[error("unknown key '{found}' in {owner}{}; keys are {}", DidYouMean(*.nearest), List(.expected))]
    UnknownKey {
        /// The key.
        found: String,
        /// Path or type that it stands in.
        owner: String,
        /// The key most like it.
        nearest: Option<&'static str>,
        /// Every key that may stand there.
        expected: Vec<&'static str>,
    },
    /// A choice that the format does not have.
    #[error("unknown choice '{found}' in {owner}{}; choices are {}", DidYouMean(*.nearest), List(.expected))]
    UnknownChoice {
        /// The choice.
        found: String,
        /// Path or type that it stands in.
        owner: String,
        /// The choice most like it.
        nearest: Option<&'static str>,
        /// Every choice that may stand there.
        expected: Vec<&'static str>,
    },
    /// A key without a default is not there.
    #[error("key '{key}' is missing in {owner}")]
    MissingKey {
        /// The key.
        key: &'static str,
        /// Path or type that lacks it.
        owner: String,
    },
    /// A key stands twice.
    #[error("key '{key}' stands twice in {owner}")]
    DuplicateKey {
        /// The key.
        key: &'static str,
        /// Path or type that has it twice.
        owner: String,
    },
    /// A value of another type.
    #[error("{path} is {found}; it must be {must}")]
    Type {
        /// Key path of the value.
        path: String,
        /// The value.
        found: String,
        /// What it must be.
        must: String,
    },
    /// Not JSON, or not what the format asks for; JSON's reader tells it in its own words.
    #[error("{problem}")]
    Json {
        /// What it said.
        problem: String,
    },
    /// Not RON, or a value of another type.
    #[error("{}{}", lower_first(&error.to_string()), In(.owner))]
    Ron {
        /// What the deserializer said.
        error: ron::Error,
        /// Path that the place lies in, where known.
        owner: String,
    },
}

/// A text that cannot be used: what is wrong with it, where, and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TextError {
    /// The file cannot be read.
    #[error("{}: cannot read {whole}: {source}", file.display())]
    Read {
        /// The file as it was named.
        file: PathBuf,
        /// What messages call the text.
        whole: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// The text is not RON or JSON, or not what the format asks for.
    #[error("{place}: {problem}")]
    Format {
        /// Where.
        place: Place,
        /// What.
        problem: Box<FormatProblem>,
    },
    /// A value is out of range or does not fit the rest.
    #[error("{place}: {path} is {found}; {must}")]
    Value {
        /// Where.
        place: Place,
        /// Key path of the value.
        path: String,
        /// The value.
        found: String,
        /// What it must be, or what to do.
        must: String,
    },
    /// All of these, in the order of the text, each on a line of its own.
    #[error("{}", Lines(.0))]
    Several(Vec<TextError>),
    /// An override cannot be applied.
    #[error(transparent)]
    Override(#[from] OverrideError),
}

impl TextError {
    /// One of `errors`, or [`TextError::Several`] in the order of the text.
    #[must_use]
    pub fn of(mut errors: Vec<Self>) -> Self {
        if errors.len() == 1 {
            return errors.swap_remove(0);
        }
        errors.sort_by_key(|error| match error {
            Self::Format { place, .. } | Self::Value { place, .. } => {
                place.position.unwrap_or((usize::MAX, 0))
            }
            _ => (usize::MAX, 0),
        });
        Self::Several(errors)
    }

    /// The error without line and column, for a text that the reader does not have.
    #[must_use]
    pub fn without_position(mut self) -> Self {
        match &mut self {
            Self::Format { place, .. } | Self::Value { place, .. } => place.position = None,
            Self::Several(errors) => {
                let all = std::mem::take(errors).into_iter();
                errors.extend(all.map(Self::without_position));
            }
            _ => {}
        }
        self
    }
}

/// An override that cannot be applied.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("--set {text}: {problem}")]
pub struct OverrideError {
    /// The override as given.
    pub text: String,
    /// What is wrong with it.
    pub problem: OverrideProblem,
}

/// Why an override cannot be applied.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OverrideProblem {
    /// There is no `=`.
    #[error("write it as path.to.key=value, such as bodies[0].material.density=1000")]
    NoEquals,
    /// The left side is no key path.
    #[error("'{path}' is not a key path such as bodies[0].material.density")]
    NoPath {
        /// The left side.
        path: String,
    },
    /// The right side is no RON value.
    #[error("'{value}' is not one RON value")]
    NoValue {
        /// The right side.
        value: String,
    },
    /// The list is shorter.
    #[error("{path}[{index}] is not there: {path} has {length}, counted from 0")]
    NoEntry {
        /// Path of the list.
        path: String,
        /// Its length.
        length: usize,
        /// The index asked for.
        index: usize,
    },
    /// A value without parts lies on the way.
    #[error("{path} has no such part to set")]
    NoPart {
        /// Path of the value.
        path: String,
    },
    /// The text with the override no longer fits the format.
    #[error("{problem}")]
    Format {
        /// What is wrong.
        problem: Box<FormatProblem>,
    },
}

/// Where something is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// File, other text or override.
    pub origin: String,
    /// Line and column, both from 1, where the text is at hand.
    pub position: Option<(usize, usize)>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.origin)?;
        if let Some((line, column)) = self.position {
            write!(f, ":{line}:{column}")?;
        }
        Ok(())
    }
}

/// Most errors that are shown at once.
const MOST_SHOWN: usize = 100;

struct Lines<'a>(&'a [TextError]);

impl fmt::Display for Lines<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, error) in self.0.iter().take(MOST_SHOWN).enumerate() {
            let before = if at == 0 { "" } else { "\n" };
            write!(f, "{before}{error}")?;
        }
        match self.0.len().checked_sub(MOST_SHOWN) {
            None | Some(0) => Ok(()),
            Some(more) => write!(f, "\nand {more} more"),
        }
    }
}

/// A name that may have been meant, for messages; nothing where there is none.
#[derive(Debug, Clone, Copy)]
pub struct DidYouMean<'a>(pub Option<&'a str>);

impl fmt::Display for DidYouMean<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0
            .map_or(Ok(()), |name| write!(f, " (did you mean '{name}'?)"))
    }
}

struct List<'a>(&'a [&'static str]);

impl fmt::Display for List<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join(", "))
    }
}

struct In<'a>(&'a str);

impl fmt::Display for In<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            Ok(())
        } else {
            write!(f, " (in {})", self.0)
        }
    }
}

fn lower_first(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| {
        first.to_lowercase().chain(chars).collect()
    })
}
