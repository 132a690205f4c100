//! From text to a validated scene.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use super::embedded::{self, EMBEDDED};
use super::error::{FormatProblem, OverrideProblem, Place, SceneError};
use super::format::{Format, options};
use super::key_path::KeyPath;
use super::locate::{Node, byte_at, line_column};
#[cfg(feature = "cli")]
use super::misread::{MOST_PROBLEMS, misread};
use super::overrides::{Override, overriding, shortened};
use super::suggest::nearest;
use super::validate::{Fault, validate};
use super::{Scene, Shape};

impl Scene {
    /// Reads the scene file `file`, in RON or, with the extension `json`, in JSON, applies `overrides` in order and validates the result.
    ///
    /// Relative paths in the scene start at the file's folder.
    ///
    /// # Errors
    /// A [`SceneError`] that names the place: the file cannot be read, is not RON, has an unknown
    /// key or a value out of range, or an override does not fit.
    pub fn load(file: &Path, overrides: &[Override]) -> Result<Self, SceneError> {
        let text = read_text(file).map_err(|source| SceneError::Read {
            file: file.to_owned(),
            source,
        })?;
        let folder = file.parent().map(Path::to_owned).unwrap_or_default();
        let origin = file.display().to_string();
        Self::finished((&text, Format::of(file)), &origin, &folder, overrides)
    }

    /// The embedded scene `name` with `overrides`, validated.
    ///
    /// # Errors
    /// [`SceneError::NoSuchScene`], or what [`Scene::load`] says of overrides.
    pub fn embedded(name: &str, overrides: &[Override]) -> Result<Self, SceneError> {
        let scene = embedded::find(name).ok_or_else(|| SceneError::NoSuchScene {
            name: name.to_owned(),
            nearest: nearest(name, EMBEDDED.iter().map(|scene| scene.name)),
            embedded: EMBEDDED.iter().map(|scene| scene.name).collect(),
        })?;
        let origin = format!("scene '{}'", scene.name);
        Self::from_text(scene.text, &origin, Path::new(""), overrides)
    }

    /// Reads `text`, applies `overrides` in order and validates the result.
    ///
    /// `origin` names the text in messages; relative paths in the scene start at `folder`.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn from_text(
        text: &str,
        origin: &str,
        folder: &Path,
        overrides: &[Override],
    ) -> Result<Self, SceneError> {
        Self::finished((text, Format::Ron), origin, folder, overrides)
    }

    /// Reads a text, applies overrides to it, resolves its paths and validates it.
    pub(super) fn finished(
        (text, format): (&str, Format),
        origin: &str,
        folder: &Path,
        overrides: &[Override],
    ) -> Result<Self, SceneError> {
        let mut scene = match format.parse(text) {
            Ok(scene) => scene,
            Err(first) => {
                let departures = Departures::of((text, format), first);
                return Err(departures.told((text, format), origin, folder, overrides));
            }
        };
        for change in overrides {
            let error = |problem| SceneError::Override {
                text: shortened(&change.to_string()),
                problem,
            };
            // With all defaults written out, whatever can be set is there to be replaced.
            let changed = change.apply(&scene.to_ron()).map_err(error)?;
            scene = Format::Ron.parse(&changed).map_err(|first| {
                let mut all = Departures::of((&changed, Format::Ron), first);
                let (_, problem) = all.problems.swap_remove(0);
                error(OverrideProblem::Format {
                    problem: Box::new(problem),
                })
            })?;
        }
        scene.resolve(folder);
        let faults = validate(&scene, &[]);
        if faults.is_empty() {
            return Ok(scene);
        }
        let tree = format.tree(text);
        let located = |fault| located(fault, (text, tree.as_ref()), origin, overrides);
        Err(several(faults.into_iter().map(located).collect()))
    }

    /// Paths of files as seen from the working folder.
    fn resolve(&mut self, folder: &Path) {
        for body in &mut self.bodies {
            if let Shape::Mesh { file, .. } = &mut body.shape {
                *file = resolve(folder, file);
            }
            let images = [&mut body.surfels.image, &mut body.surfels.cut_image];
            for image in images.into_iter().flatten() {
                image.file = resolve(folder, &image.file);
            }
            if let Some(points) = &mut body.surfels.points {
                points.file = resolve(folder, &points.file);
            }
        }
        let looks = self.tools.iter_mut().filter_map(|tool| tool.looks.as_mut());
        let drawn = self
            .pictures
            .iter_mut()
            .flat_map(|pictures| &mut pictures.meshes);
        for mesh in looks.chain(drawn) {
            mesh.file = resolve(folder, &mesh.file);
        }
    }

    /// Checks every value of a scene that a program made or changed.
    ///
    /// [`Scene::load`] and its like have done so, and [`crate::world::World::new`] does.
    ///
    /// # Errors
    /// [`SceneError::Value`] with the key path of the value that is not as it must be,
    /// [`SceneError::Several`] for several.
    pub fn validate(&self) -> Result<(), SceneError> {
        let faults = validate(self, &[]);
        if faults.is_empty() {
            return Ok(());
        }
        let tell = |fault: Fault| SceneError::Value {
            place: Place {
                origin: format!("scene '{}'", self.name),
                position: None,
            },
            path: fault.path,
            found: fault.found,
            must: fault.must,
        };
        Err(several(faults.into_iter().map(tell).collect()))
    }

    /// The scene as RON, all defaults written out; [`Scene::load`] reads it back as it was.
    ///
    /// # Panics
    /// Never for a scene that was read: it holds nothing that RON cannot say.
    #[must_use]
    pub fn to_ron(&self) -> String {
        let config = ron::ser::PrettyConfig::new()
            .indentor("    ".to_owned())
            .compact_arrays(false);
        let mut text = options()
            .to_string_pretty(self, config)
            .expect("a scene is made of numbers, strings, lists and structs");
        text.push('\n');
        text
    }
}

/// `file` as seen from the working folder, made absolute where the system can say how.
fn resolve(folder: &Path, file: &Path) -> PathBuf {
    let joined = folder.join(file);
    std::path::absolute(&joined).unwrap_or(joined)
}

/// Line and column at which a text departs from the format, and how.
type Misread = ((usize, usize), FormatProblem);

impl Format {
    /// Reads a scene without validating it.
    fn parse(self, text: &str) -> Result<Scene, Misread> {
        match self {
            Self::Ron => parse_ron(text, "the scene"),
            Self::Json => parse_json(text),
        }
    }
}

/// All that a text departs from the format in, as far as it can be followed.
struct Departures {
    /// In the order of the text, one at least.
    problems: Vec<Misread>,
    /// The scene with values that fit in the place of those that do not, and their key paths.
    mended: Option<(Scene, Vec<String>)>,
}

impl Departures {
    /// `first` is what the deserializer said, which stops there; without the format's schema (feature `cli`) it
    /// is all.
    #[cfg(feature = "cli")]
    fn of((text, format): (&str, Format), first: Misread) -> Self {
        let Some(tree) = format.tree(text) else {
            return Self {
                problems: vec![first],
                mended: None,
            };
        };
        let found = misread(text, format, &tree);
        let place = |(byte, problem)| (line_column(text, byte), problem);
        let mut problems: Vec<Misread> = found.problems.into_iter().map(place).collect();
        let followed = problems.len() < MOST_PROBLEMS;
        let mended = followed.then(|| Format::Ron.parse(&found.mended));
        let mended = mended.and_then(Result::ok);
        // What the schema does not know of, the deserializer does.
        if problems.is_empty() || mended.is_none() && problems.iter().all(|one| one.0 != first.0) {
            problems.push(first);
            problems.sort_by_key(|(position, _)| *position);
        }
        Self {
            problems,
            mended: mended.map(|scene| (scene, found.paths)),
        }
    }

    #[cfg(not(feature = "cli"))]
    fn of(_: (&str, Format), first: Misread) -> Self {
        Self {
            problems: vec![first],
            mended: None,
        }
    }

    /// They and the values that are not as they must be; overrides may set these right.
    fn told(
        self,
        (text, format): (&str, Format),
        origin: &str,
        folder: &Path,
        overrides: &[Override],
    ) -> SceneError {
        let tell = |(position, problem)| SceneError::Format {
            place: Place {
                origin: origin.to_owned(),
                position: Some(position),
            },
            problem: Box::new(problem),
        };
        let mut errors: Vec<SceneError> = self.problems.into_iter().map(tell).collect();
        if let Some((mut scene, paths)) = self.mended {
            scene.resolve(folder);
            let tree = format.tree(text);
            let faults = validate(&scene, &paths).into_iter();
            let kept = faults.filter(|fault| overriding(&fault.path, overrides).is_none());
            errors.extend(kept.map(|fault| located(fault, (text, tree.as_ref()), origin, &[])));
        }
        several(errors)
    }
}

/// Errors, of which there is one at least, as one, in the order of the text.
fn several(mut errors: Vec<SceneError>) -> SceneError {
    if errors.len() == 1 {
        return errors.swap_remove(0);
    }
    errors.sort_by_key(|error| match error {
        SceneError::Format { place, .. } | SceneError::Value { place, .. } => {
            place.position.unwrap_or((usize::MAX, 0))
        }
        _ => (usize::MAX, 0),
    });
    SceneError::Several(errors)
}

/// Reads a scene in JSON without validating it.
fn parse_json(text: &str) -> Result<Scene, Misread> {
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

/// Reads a text in the dialect of scenes; the error has line and column, and calls the text `whole`.
pub(crate) fn parse_ron<T: DeserializeOwned>(text: &str, whole: &str) -> Result<T, Misread> {
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

/// The fault with the place where its value was written: an override or the text.
fn located(
    fault: Fault,
    text: (&str, Option<&Node>),
    origin: &str,
    overrides: &[Override],
) -> SceneError {
    SceneError::Value {
        place: place_of(&fault.path, text, origin, overrides),
        path: fault.path,
        found: fault.found,
        must: fault.must,
    }
}

/// Where the value of a key path was written: in an override or in the text, of which the tree is.
fn place_of(
    path: &str,
    (text, tree): (&str, Option<&Node>),
    origin: &str,
    overrides: &[Override],
) -> Place {
    if let Some(change) = overriding(path, overrides) {
        return Place {
            origin: format!("--set {}", shortened(&change.to_string())),
            position: None,
        };
    }
    let byte = tree.and_then(|tree| Some(tree.place_of(&KeyPath::parse(path)?).0));
    Place {
        origin: origin.to_owned(),
        position: byte.map(|byte| line_column(text, byte)),
    }
}

#[cfg(feature = "cli")]
/// Where a scene's body was written; an origin without a text has no position.
pub(crate) fn place_of_body(
    index: usize,
    text: Option<(&str, Format)>,
    origin: &str,
    overrides: &[Override],
) -> Place {
    let tree = text.and_then(|(text, format)| format.tree(text));
    let text = text.map_or("", |(text, _)| text);
    let path = format!("bodies[{index}]");
    place_of(&path, (text, tree.as_ref()), origin, overrides)
}

/// The text of a scene file, without a byte-order mark.
pub(crate) fn read_text(file: &Path) -> io::Result<String> {
    let bytes = read_file(file)?;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let problem = match bytes {
        [] => "it is empty",
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "it is in UTF-16; save it as UTF-8",
        [0x1f, 0x8b, ..] => "it is packed by gzip; unpack it first",
        [b'P', b'K', 3, 4, ..] => "it is a zip archive; unpack it first",
        _ => {
            return String::from_utf8(bytes.to_vec())
                .map_err(|error| invalid(error.utf8_error().to_string()));
        }
    };
    Err(invalid(problem.to_owned()))
}

/// The content of a regular file: a pipe or a device may never end.
///
/// # Errors
/// What the system says, and an error of kind `InvalidInput` for anything but a file.
pub(crate) fn read_file(file: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(file)?.is_file() {
        let problem = "not a regular file; write it into a file first";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    fs::read(file)
}

fn invalid(problem: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, problem)
}
