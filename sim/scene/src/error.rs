//! What can be wrong with a scene, said with the place and the remedy.

use phyxel_text::{DidYouMean, OverrideError, TextError};

/// A scene that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
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
    /// The text or an override is not as it must be.
    #[error(transparent)]
    Text(#[from] TextError),
}

impl From<OverrideError> for SceneError {
    fn from(error: OverrideError) -> Self {
        Self::Text(error.into())
    }
}

impl SceneError {
    /// The error without line and column, for a text that the reader does not have.
    #[must_use]
    pub fn without_position(self) -> Self {
        match self {
            Self::Text(error) => Self::Text(error.without_position()),
            other => other,
        }
    }
}
