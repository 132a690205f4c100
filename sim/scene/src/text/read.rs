//! From text to a validated scene, and back.

use std::path::Path;

use super::embedded::EMBEDDED;
use super::error::{OverrideError, TextError};
use super::file::read_text;
use super::overrides::{Override, place_of, shortened};
use super::tree::{Syntax, options};
use super::values::parse;
use crate::Scene;

/// What messages call a scene's text.
const WHOLE: &str = "the scene";

/// Reads the file of a text that messages call `whole`.
///
/// # Errors
/// [`TextError::Read`].
pub fn read_settings(file: &Path, whole: &'static str) -> Result<String, TextError> {
    read_text(file).map_err(|source| TextError::Read {
        file: file.to_owned(),
        whole,
        source,
    })
}

/// Reads the scene file `file`, in RON or, with the extension `json`, in JSON, applies `overrides` in order and
/// validates the result.
///
/// Relative paths in the scene start at the file's folder.
///
/// # Errors
/// A [`TextError`] that names the position: the file cannot be read, is not RON, has an unknown key or a value out of
/// range, or an override does not fit.
pub fn load(file: impl AsRef<Path>, overrides: &[Override]) -> Result<Scene, TextError> {
    let file = file.as_ref();
    let text = read_settings(file, WHOLE)?;
    let folder = file.parent().map(Path::to_owned).unwrap_or_default();
    let origin = file.display().to_string();
    finished(&text, Syntax::of(file), &origin, &folder, overrides)
}

/// The embedded scene `name` with `overrides`, validated.
///
/// # Errors
/// [`TextError::NoSuchScene`], or what [`load`] says of overrides.
pub fn embedded(name: &str, overrides: &[Override]) -> Result<Scene, TextError> {
    let scene = EMBEDDED.iter().find(|scene| scene.name == name);
    let scene = scene.ok_or_else(|| TextError::NoSuchScene {
        name: name.to_owned(),
    })?;
    let origin = format!("scene '{}'", scene.name);
    from_text(scene.text, &origin, "", overrides)
}

/// Reads a scene in RON, applies `overrides` in order and validates the result.
///
/// `origin` names the text in messages; relative paths in the scene start at `folder`.
///
/// # Errors
/// As [`load`].
pub fn from_text(
    text: &str,
    origin: &str,
    folder: impl AsRef<Path>,
    overrides: &[Override],
) -> Result<Scene, TextError> {
    finished(text, Syntax::Ron, origin, folder.as_ref(), overrides)
}

/// Reads a text, applies overrides to it, resolves its paths and validates it.
pub(crate) fn finished(
    text: &str,
    syntax: Syntax,
    origin: &str,
    folder: &Path,
    overrides: &[Override],
) -> Result<Scene, TextError> {
    let mut scene: Scene = parse(text, syntax, origin, WHOLE)?;
    for change in overrides {
        let error = |problem| OverrideError {
            text: shortened(&change.to_string()),
            problem,
        };
        // With all defaults written out, whatever can be set is there to be replaced.
        let changed = change.apply(&to_ron(&scene)).map_err(error)?;
        scene = parse(&changed, Syntax::Ron, origin, WHOLE).map_err(|wrong| match wrong {
            TextError::At { problem, .. } => error(problem),
            wrong => error(wrong.to_string()),
        })?;
    }
    // As seen from the working folder, absolute where the system can say how.
    for file in scene.files_mut() {
        let joined = folder.join(&*file);
        *file = std::path::absolute(&joined).unwrap_or(joined);
    }
    scene.validate().map_err(|fault| TextError::At {
        place: place_of(&fault.path, text, syntax, origin, overrides),
        problem: fault.to_string(),
        path: fault.path,
    })?;
    Ok(scene)
}

/// The scene as RON, all defaults written out; [`load`] reads it back as it was.
///
/// # Panics
/// Never for a scene that was read: it holds nothing that RON cannot say.
#[must_use]
pub fn to_ron(scene: &Scene) -> String {
    let config = ron::ser::PrettyConfig::new()
        .indentor("    ".to_owned())
        .compact_arrays(false);
    let mut text = options()
        .to_string_pretty(scene, config)
        .expect("a scene is made of numbers, strings, lists and structs");
    text.push('\n');
    text
}
