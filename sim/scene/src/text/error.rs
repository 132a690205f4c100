//! What can be wrong with a text, said with the position and the remedy.

use std::fmt;
use std::io;
use std::path::PathBuf;

use super::embedded::EMBEDDED;
use crate::{DidYouMean, nearest};

/// A text that cannot be used: what is wrong with it, where, and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TextError {
    /// No embedded scene has this name.
    #[error(
        "no embedded scene is called '{name}'{}; there is {}",
        DidYouMean(nearest(.name, EMBEDDED.iter().map(|scene| scene.name))),
        EMBEDDED.iter().map(|scene| scene.name).collect::<Vec<_>>().join(", ")
    )]
    NoSuchScene {
        /// The name asked for.
        name: String,
    },
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
    /// The text is not RON or JSON, or a value in it is not as it must be.
    #[error("{place}: {problem}")]
    At {
        /// Where.
        place: Place,
        /// Key path of the value.
        path: String,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// An override cannot be applied.
    #[error(transparent)]
    Override(#[from] OverrideError),
}

impl TextError {
    /// The error without line and column, for a text that the reader does not have.
    #[must_use]
    pub fn without_position(mut self) -> Self {
        if let Self::At { place, .. } = &mut self {
            place.position = None;
        }
        self
    }
}

/// An override that cannot be applied.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("--set {text}: {problem}")]
pub struct OverrideError {
    /// The override as given.
    pub text: String,
    /// What is wrong with it.
    pub problem: String,
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
