//! How a scene is written: RON or JSON.

use std::path::Path;

use ron::extensions::Extensions;

use super::locate::Node;

/// How a scene is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    Ron,
    Json,
}

impl Format {
    /// JSON for the extension `json`.
    pub(crate) fn of(file: &Path) -> Self {
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

/// The dialect of RON that scenes are written in.
pub(super) fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}
