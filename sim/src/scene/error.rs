//! What can be wrong with a scene, said with the place and the remedy.

use std::fmt;
use std::io;
use std::path::PathBuf;

use phyxel_text::{DidYouMean, FormatProblem, OverrideError, Place};

/// A scene that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The scene file cannot be read.
    #[error("{}: cannot read the scene: {source}", file.display())]
    Read {
        /// The file as it was named.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// No embedded scene has this name.
    #[error(
        "no embedded scene is called '{name}'{}; there is {}",
        DidYouMean(*.nearest),
        embedded.join(", ")
    )]
    NoSuchScene {
        /// The name asked for.
        name: String,
        /// The name most like it.
        nearest: Option<&'static str>,
        /// Every name.
        embedded: Vec<&'static str>,
    },
    /// The text is not RON, or not what the format asks for.
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
    Several(Vec<SceneError>),
    /// An override cannot be applied.
    #[error(transparent)]
    Override(#[from] OverrideError),
}

impl SceneError {
    /// The error without line and column, for a text that the reader does not have.
    pub(crate) fn without_position(mut self) -> Self {
        match &mut self {
            Self::Format { place, .. } | Self::Value { place, .. } => place.position = None,
            Self::Several(faults) => {
                let all = std::mem::take(faults).into_iter();
                faults.extend(all.map(Self::without_position));
            }
            _ => {}
        }
        self
    }
}

/// Most errors that are shown at once.
const MOST_SHOWN: usize = 100;

struct Lines<'a>(&'a [SceneError]);

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
