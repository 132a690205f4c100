//! From text to a validated scene.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use ron::extensions::Extensions;
use serde::de::DeserializeOwned;

use super::embedded::{self, EMBEDDED};
use super::error::{FormatProblem, OverrideProblem, Place, SceneError};
use super::locate::{Content, KeyPath, Node, Segment, byte_at, line_column};
use super::suggest::nearest;
use super::validate::{Fault, validate};
#[cfg(feature = "cli")]
use super::wanted::wanted_at;
use super::{Scene, Shape};

/// A change of one value of a scene: `path.to.key=value`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Override {
    path: KeyPath,
    value: String,
}

impl Override {
    /// Reads `path.to.key=value`; the value is RON.
    ///
    /// # Errors
    /// [`SceneError::Override`] if there is no `=`, no key path before it or no single RON value
    /// after it.
    pub fn parse(text: &str) -> Result<Self, SceneError> {
        let error = |problem| SceneError::Override {
            text: shortened(text),
            problem,
        };
        let (path, value) = text
            .split_once('=')
            .ok_or_else(|| error(OverrideProblem::NoEquals))?;
        let (path, value) = (path.trim(), value.trim());
        let path = KeyPath::parse(path).ok_or_else(|| {
            error(OverrideProblem::NoPath {
                path: shortened(path),
            })
        })?;
        if Node::read(value).is_none() {
            return Err(error(OverrideProblem::NoValue {
                value: shortened(value),
            }));
        }
        Ok(Self {
            path,
            value: value.to_owned(),
        })
    }

    #[cfg(feature = "cli")]
    /// The path.
    pub(crate) fn path(&self) -> &KeyPath {
        &self.path
    }

    /// The scene's key at which the path begins.
    #[must_use]
    pub fn section(&self) -> &str {
        match self.path.0.first() {
            Some(Segment::Key(key)) => key,
            _ => "",
        }
    }

    /// The number that the last of `overrides` gives the value at `path`, if one does.
    pub(crate) fn number(overrides: &[Self], path: &str) -> Option<f64> {
        let path = KeyPath::parse(path)?;
        let change = overrides.iter().rev().find(|change| change.path == path)?;
        change.value.parse().ok()
    }

    /// The text with the value in place of what stands at the path, or added where nothing does.
    fn apply(&self, text: &str) -> Result<String, OverrideProblem> {
        let tree = Node::read(text).ok_or(OverrideProblem::NoPart {
            path: "the scene".to_owned(),
        })?;
        let mut node = tree.inner();
        for (depth, segment) in self.path.0.iter().enumerate() {
            if let Some(child) = node.child(segment) {
                let last = depth + 1 == self.path.0.len();
                node = if last { child } else { child.inner() };
                continue;
            }
            let above = KeyPath(self.path.0[..depth].to_vec()).to_string();
            let (at, end, before, after) = match (&node.content, segment) {
                (Content::Struct { open, .. }, Segment::Key(_)) => (*open, *open, "", ", "),
                (Content::Tuple { items, .. }, Segment::Key(_)) if items.is_empty() => {
                    (node.span.start, node.span.end, "(", ")")
                }
                (Content::Leaf, Segment::Key(_)) if &text[node.span.clone()] == "None" => {
                    (node.span.start, node.span.end, "(", ")")
                }
                (Content::List(items) | Content::Tuple { items, .. }, Segment::Index(index)) => {
                    return Err(OverrideProblem::NoEntry {
                        path: above,
                        length: items.len(),
                        index: *index,
                    });
                }
                _ => return Err(OverrideProblem::NoPart { path: above }),
            };
            let added = self.nested(depth, &above)?;
            return Ok(format!(
                "{}{before}{added}{after}{}",
                &text[..at],
                &text[end..]
            ));
        }
        Ok(format!(
            "{}{}{}",
            &text[..node.span.start],
            self.value,
            &text[node.span.end..]
        ))
    }

    /// The value wrapped in the keys from `depth` on.
    fn nested(&self, depth: usize, above: &str) -> Result<String, OverrideProblem> {
        let mut text = self.value.clone();
        for (from_end, segment) in self.path.0[depth..].iter().rev().enumerate() {
            let Segment::Key(key) = segment else {
                return Err(OverrideProblem::NoPart {
                    path: above.to_owned(),
                });
            };
            text = if from_end == 0 {
                format!("{key}: {text}")
            } else {
                format!("{key}: ({text})")
            };
        }
        Ok(text)
    }
}

impl fmt::Display for Override {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.path, self.value)
    }
}

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
        if file
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("json"))
        {
            let scene = parse_json(&text);
            // Places of values are known in RON only.
            return Self::finished(scene, "", &origin, &folder, overrides);
        }
        Self::from_text(&text, &origin, &folder, overrides)
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
        Self::finished(parse(text), text, origin, folder, overrides)
    }

    /// Applies overrides to what was read, resolves its paths and validates it.
    fn finished(
        read: Result<Self, Misread>,
        text: &str,
        origin: &str,
        folder: &Path,
        overrides: &[Override],
    ) -> Result<Self, SceneError> {
        let mut scene = read.map_err(|first| {
            let misread = |(position, problem)| SceneError::Format {
                place: Place {
                    origin: origin.to_owned(),
                    position: Some(position),
                },
                problem: Box::new(problem),
            };
            let mut errors: Vec<SceneError> =
                all_misread(text, first).into_iter().map(misread).collect();
            if errors.len() == 1 {
                errors.remove(0)
            } else {
                SceneError::Values(errors)
            }
        })?;
        for change in overrides {
            let error = |problem| SceneError::Override {
                text: shortened(&change.to_string()),
                problem,
            };
            // With all defaults written out, whatever can be set is there to be replaced.
            let changed = change.apply(&scene.to_ron()).map_err(error)?;
            scene = parse(&changed).map_err(|(_, problem)| {
                error(OverrideProblem::Format {
                    problem: Box::new(problem),
                })
            })?;
        }
        for body in &mut scene.bodies {
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
        let faults = validate(&scene);
        told(faults, |fault| located(fault, text, origin, overrides))?;
        Ok(scene)
    }

    /// Checks every value of a scene that a program made or changed.
    ///
    /// [`Scene::load`] and its like have done so, and [`crate::world::World::new`] does.
    ///
    /// # Errors
    /// [`SceneError::Value`] with the key path of the value that is not as it must be,
    /// [`SceneError::Values`] for several.
    pub fn validate(&self) -> Result<(), SceneError> {
        told(validate(self), |fault| SceneError::Value {
            place: Place {
                origin: format!("scene '{}'", self.name),
                position: None,
            },
            path: fault.path,
            found: fault.found,
            must: fault.must,
        })
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

fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}

/// Line and column at which a text departs from the format, and how.
type Misread = ((usize, usize), FormatProblem);

/// All faults as one error.
fn told(faults: Vec<Fault>, tell: impl FnMut(Fault) -> SceneError) -> Result<(), SceneError> {
    let mut errors: Vec<SceneError> = faults.into_iter().map(tell).collect();
    match (errors.pop(), errors.is_empty()) {
        (None, _) => Ok(()),
        (Some(error), true) => Err(error),
        (Some(error), false) => {
            errors.push(error);
            Err(SceneError::Values(errors))
        }
    }
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

/// Reads a scene without validating it; the error has line and column.
fn parse(text: &str) -> Result<Scene, Misread> {
    parse_ron(text, "the scene")
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
            error => typed(text, tree.as_ref(), start).unwrap_or_else(|| {
                let owner = owner.unwrap_or_default();
                (start, FormatProblem::Ron { error, owner })
            }),
        };
        (line_column(text, byte), problem)
    })
}

/// Most departures from the format that are told of at once.
const MOST_MISREAD: usize = 20;

/// What else of a scene's text departs from the format: a key that is misread is taken out, and the rest read
/// again. A key that is missed for having been taken out ends it.
fn all_misread(text: &str, first: Misread) -> Vec<Misread> {
    let mut text = text.to_owned();
    let mut taken = Vec::new();
    let mut all = vec![first];
    while let Some(((line, column), _)) = all.last()
        && all.len() < MOST_MISREAD
    {
        let byte = byte_at(&text, *line, *column);
        let Some((key, span)) = Node::read(&text).and_then(|tree| tree.entry_around(byte)) else {
            break;
        };
        let rest = text[span.end..].trim_start();
        let end = if rest.starts_with(',') {
            text.len() - rest.len() + 1
        } else {
            span.end
        };
        // A space for each character: the places of all others stay.
        let blank = |c: char| if c == '\n' { '\n' } else { ' ' };
        let blanks: String = text[span.start..end].chars().map(blank).collect();
        text.replace_range(span.start..end, &blanks);
        taken.push(key);
        match parse(&text) {
            Err((_, FormatProblem::MissingKey { key, .. })) if taken.iter().any(|k| k == key) => {
                break;
            }
            Err(next) => all.push(next),
            Ok(_) => break,
        }
    }
    all
}

/// What the value at a byte should have been, where the format tells; without the format's schema
/// (feature `cli`) nothing does.
#[cfg(feature = "cli")]
fn typed(text: &str, tree: Option<&Node>, start: usize) -> Option<(usize, FormatProblem)> {
    let wanted = wanted_at(text, tree?, start)?;
    let problem = FormatProblem::Type {
        path: wanted.path,
        found: wanted.found,
        must: wanted.must,
    };
    Some((wanted.start, problem))
}

#[cfg(not(feature = "cli"))]
fn typed(_: &str, _: Option<&Node>, _: usize) -> Option<(usize, FormatProblem)> {
    None
}

/// Where the word that the deserializer just read starts: its last occurrence before the cursor.
fn word_start(text: &str, word: &str, start: usize, end: usize) -> usize {
    text[..end].rfind(word).unwrap_or(start)
}

/// The fault with the place where its value was written: an override or the text.
fn located(fault: Fault, text: &str, origin: &str, overrides: &[Override]) -> SceneError {
    let place = place_of(&fault.path, text, origin, overrides);
    SceneError::Value {
        place,
        path: fault.path,
        found: fault.found,
        must: fault.must,
    }
}

/// Where the value of a key path was written: in an override or in the text.
fn place_of(path: &str, text: &str, origin: &str, overrides: &[Override]) -> Place {
    let path = KeyPath::parse(path);
    let by_override = path.as_ref().and_then(|path| {
        let mut changes = overrides.iter().rev();
        changes.find(|change| change.path.contains(path))
    });
    match (by_override, path, Node::read(text)) {
        (Some(change), ..) => Place {
            origin: format!("--set {}", shortened(&change.to_string())),
            position: None,
        },
        (None, Some(path), Some(tree)) => Place {
            origin: origin.to_owned(),
            position: Some(line_column(text, tree.place_of(&path).0)),
        },
        _ => Place {
            origin: origin.to_owned(),
            position: None,
        },
    }
}

#[cfg(feature = "cli")]
/// Where a scene's body was written; an origin without a text has no position.
pub(crate) fn place_of_body(
    index: usize,
    text: Option<&str>,
    origin: &str,
    overrides: &[Override],
) -> Place {
    match text {
        Some(text) => place_of(&format!("bodies[{index}]"), text, origin, overrides),
        None => Place {
            origin: origin.to_owned(),
            position: None,
        },
    }
}

/// A long text's beginning, for messages of one line.
fn shortened(text: &str) -> String {
    const SHOWN: usize = 200;
    match text.char_indices().nth(SHOWN) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}.. ({} bytes)", &text[..end], text.len()),
    }
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
