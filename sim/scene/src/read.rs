//! From text to a validated scene.

use std::path::{Path, PathBuf};

use phyxel_text::{
    Departure, Departures, Fault, Node, Override, OverrideError, OverrideProblem, Place, Syntax,
    TextError, nearest, options, overriding, place_of, read_text, shortened,
};

use super::embedded::{self, EMBEDDED};
use super::error::SceneError;
use super::validate::validate;
use super::{Scene, Shape};

/// What messages call a scene's text.
const WHOLE: &str = "the scene";

impl Scene {
    /// Reads the scene file `file`, in RON or, with the extension `json`, in JSON, applies `overrides` in order and validates the result.
    ///
    /// Relative paths in the scene start at the file's folder.
    ///
    /// # Errors
    /// A [`SceneError`] that names the place: the file cannot be read, is not RON, has an unknown
    /// key or a value out of range, or an override does not fit.
    pub fn load(file: &Path, overrides: &[Override]) -> Result<Self, SceneError> {
        let text = read_text(file).map_err(|source| TextError::Read {
            file: file.to_owned(),
            whole: WHOLE,
            source,
        })?;
        let folder = file.parent().map(Path::to_owned).unwrap_or_default();
        let origin = file.display().to_string();
        Self::finished((&text, Syntax::of(file)), &origin, &folder, overrides)
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
        Self::finished((text, Syntax::Ron), origin, folder, overrides)
    }

    /// Reads a text, applies overrides to it, resolves its paths and validates it.
    pub(super) fn finished(
        (text, format): (&str, Syntax),
        origin: &str,
        folder: &Path,
        overrides: &[Override],
    ) -> Result<Self, SceneError> {
        let mut scene = match format.parse::<Self>(text, WHOLE) {
            Ok(scene) => scene,
            Err(first) => {
                let departures = departures((text, format), first);
                let text = (text, format);
                return Err(told(departures, text, origin, folder, overrides).into());
            }
        };
        for change in overrides {
            let error = |problem| OverrideError {
                text: shortened(&change.to_string()),
                problem,
            };
            // With all defaults written out, whatever can be set is there to be replaced.
            let changed = change.apply(&scene.to_ron()).map_err(error)?;
            scene = Syntax::Ron.parse(&changed, WHOLE).map_err(|first| {
                let mut all = departures((&changed, Syntax::Ron), first);
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
        Err(TextError::of(faults.into_iter().map(located).collect()).into())
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
    /// [`Scene::load`] and its like have done so.
    ///
    /// # Errors
    /// [`TextError::Value`] with the key path of the value that is not as it must be,
    /// [`TextError::Several`] for several.
    pub fn validate(&self) -> Result<(), SceneError> {
        let faults = validate(self, &[]);
        if faults.is_empty() {
            return Ok(());
        }
        let place = Place {
            origin: format!("scene '{}'", self.name),
            position: None,
        };
        let told = faults.into_iter().map(|fault| fault.at(place.clone()));
        Err(TextError::of(told.collect()).into())
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

/// All that a text departs from the format in; without the format's schema (feature `schemars`) the first.
fn departures(text: (&str, Syntax), first: Departure) -> Departures<Scene> {
    #[cfg(feature = "schemars")]
    let schema = Some(&*super::keys::SCHEMA);
    #[cfg(not(feature = "schemars"))]
    let schema = None;
    Departures::of(text, first, schema, WHOLE)
}

/// What a text departs from the format in and the values that are not as they must be; overrides may set these right.
fn told(
    departures: Departures<Scene>,
    (text, format): (&str, Syntax),
    origin: &str,
    folder: &Path,
    overrides: &[Override],
) -> TextError {
    let tell = |(position, problem)| TextError::Format {
        place: Place {
            origin: origin.to_owned(),
            position: Some(position),
        },
        problem: Box::new(problem),
    };
    let mut errors: Vec<TextError> = departures.problems.into_iter().map(tell).collect();
    if let Some((mut scene, paths)) = departures.mended {
        scene.resolve(folder);
        let tree = format.tree(text);
        let faults = validate(&scene, &paths).into_iter();
        let kept = faults.filter(|fault| overriding(&fault.path, overrides).is_none());
        errors.extend(kept.map(|fault| located(fault, (text, tree.as_ref()), origin, &[])));
    }
    TextError::of(errors)
}

/// The fault with the place where its value was written: an override or the text.
fn located(
    fault: Fault,
    text: (&str, Option<&Node>),
    origin: &str,
    overrides: &[Override],
) -> TextError {
    let place = place_of(&fault.path, text, origin, overrides);
    fault.at(place)
}

/// Where a scene's body was written; an origin without a text has no position.
#[must_use]
pub fn place_of_body(
    index: usize,
    text: Option<(&str, Syntax)>,
    origin: &str,
    overrides: &[Override],
) -> Place {
    let tree = text.and_then(|(text, format)| format.tree(text));
    let text = text.map_or("", |(text, _)| text);
    let path = format!("bodies[{index}]");
    place_of(&path, (text, tree.as_ref()), origin, overrides)
}
