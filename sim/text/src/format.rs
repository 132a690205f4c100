//! How a settings file is written: RON or JSON.

use std::path::Path;

use ron::extensions::Extensions;

use crate::locate::Node;

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
    #[must_use]
    pub fn tree(self, text: &str) -> Option<Node> {
        match self {
            Self::Ron => Node::read(text),
            Self::Json => Node::read_json(text),
        }
    }
}

/// The dialect of RON that settings files are written in.
#[must_use]
pub fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}
