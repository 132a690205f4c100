//! Cases: the plan made explicit.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use serde::Serialize;
use serde_json::{Map, Value};

use phyxel_sweep::{Plan, cases};
use phyxel_text::{KeyPath, OverrideError, Place, TextError};

use crate::output::{OutputError, OutputFolder};
use crate::scene::{Scene, SceneError, Shape};

/// The list of cases, one a line.
const LIST: &str = "cases.jsonl";

/// One run of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Number, from 1.
    pub number: usize,
    /// Value of each key, as RON; the order is that of the plan's keys.
    pub values: Vec<String>,
    /// The scene, validated.
    pub scene: Scene,
    /// Of the scene as resolved, of the files that it names and of the program's version.
    pub hash: String,
}

/// A line of the list.
#[derive(Serialize)]
struct Line<'a> {
    case: usize,
    keys: Map<String, Value>,
    hash: &'a str,
}

/// A case with a value that the scene does not take.
#[derive(Debug, thiserror::Error)]
#[error("{place}: case {case}: {source}")]
pub struct RefusedCase {
    /// Where the plan has the value.
    pub place: Place,
    /// Number of the case.
    pub case: usize,
    /// What is wrong with the scene.
    pub source: Box<SceneError>,
}

/// Where a plan says what is wrong with its scene: at one of the changes that all cases share, or where it
/// names the scene.
#[must_use]
pub fn place_of(plan: &Plan, error: &SceneError) -> Place {
    plan.place_of_change(match error {
        SceneError::Text(TextError::Override(OverrideError { text, .. })) => text,
        SceneError::Text(TextError::Value { place, .. }) => {
            place.origin.strip_prefix("--set ").unwrap_or_default()
        }
        _ => "",
    })
}

impl Case {
    /// Every case of a plan; `base` is its scene with the changes that all share.
    ///
    /// # Errors
    /// [`RefusedCase`] if a case has a value that the scene does not take.
    pub fn all(plan: &Plan, base: &Scene) -> Result<Vec<Self>, RefusedCase> {
        let text = base.to_ron();
        let mut files = FileHashes::default();
        let rows = cases(plan).into_iter().zip(1..);
        rows.map(|(values, number)| Self::of(plan, &text, number, values, &mut files))
            .collect()
    }

    /// The case of a number alone; nothing where the plan has fewer.
    ///
    /// # Errors
    /// As [`Case::all`].
    pub fn one(plan: &Plan, base: &Scene, number: usize) -> Result<Option<Self>, RefusedCase> {
        let index = number.checked_sub(1);
        let values = index.and_then(|index| cases(plan).into_iter().nth(index));
        let base = base.to_ron();
        let case =
            values.map(|values| Self::of(plan, &base, number, values, &mut FileHashes::default()));
        case.transpose()
    }

    fn of(
        plan: &Plan,
        base: &str,
        number: usize,
        values: Vec<String>,
        files: &mut FileHashes,
    ) -> Result<Self, RefusedCase> {
        let scene = scene(plan, base, number, &values)?;
        let hash = hash(&scene, files);
        Ok(Self {
            number,
            values,
            scene,
            hash,
        })
    }

    /// Its line of the list.
    fn line(&self, plan: &Plan) -> String {
        let names = plan.keys.iter().map(|key| key.name().to_owned());
        let values = self.values.iter().cloned().map(Value::String);
        let line = Line {
            case: self.number,
            keys: names.zip(values).collect(),
            hash: &self.hash,
        };
        // Strings and a number: there is nothing that JSON cannot say.
        serde_json::to_string(&line).unwrap_or_default()
    }

    /// Whether the list in a folder has this case as it is.
    #[must_use]
    pub fn is_listed(&self, plan: &Plan, folder: &Path) -> bool {
        std::fs::read_to_string(folder.join(LIST))
            .is_ok_and(|list| list.lines().nth(self.number - 1) == Some(&self.line(plan)))
    }
}

/// The scene of a case.
fn scene(plan: &Plan, base: &str, number: usize, values: &[String]) -> Result<Scene, RefusedCase> {
    let refused = |index: Option<usize>, error: SceneError| RefusedCase {
        place: plan.place_of_key(index),
        case: number,
        source: Box::new(error.without_position()),
    };
    let mut changes = Vec::new();
    for (index, (key, value)) in plan.keys.iter().zip(values).enumerate() {
        let parsed = key.overrides(value);
        let parsed = parsed.map_err(|error| refused(Some(index), error.into()))?;
        changes.extend(parsed.into_iter().map(|change| (index, change)));
    }
    let all: Vec<_> = changes.iter().map(|(_, change)| change.clone()).collect();
    Scene::from_text(base, "the scene", Path::new(""), &all).map_err(|error| {
        // The key whose change is at fault, if one alone is.
        let index = changes.iter().find(|(_, change)| match &error {
            SceneError::Text(TextError::Override(OverrideError { text, .. })) => {
                *text == change.to_string()
            }
            SceneError::Text(TextError::Value { path, .. }) => {
                KeyPath::parse(path).is_some_and(|path| change.path().contains(&path))
            }
            _ => false,
        });
        refused(index.map(|(index, _)| *index), error)
    })
}

/// Writes the list of cases.
///
/// # Errors
/// [`OutputError`] if it cannot be written.
pub fn write_cases(plan: &Plan, cases: &[Case], folder: &OutputFolder) -> Result<(), OutputError> {
    let mut text = String::new();
    for case in cases {
        text.push_str(&case.line(plan));
        text.push('\n');
    }
    // Many may begin at once; what is there already is left in peace.
    if std::fs::read(folder.path().join(LIST)).is_ok_and(|there| there == text.as_bytes()) {
        return Ok(());
    }
    folder.write(LIST, text.as_bytes())
}

/// Hashes of files, each read once.
#[derive(Default)]
struct FileHashes(Vec<(std::path::PathBuf, u64)>);

impl FileHashes {
    fn of(&mut self, file: &Path) -> u64 {
        if let Some((_, hash)) = self.0.iter().find(|(known, _)| known == file) {
            return *hash;
        }
        let mut hash = Fnv::default();
        // A file that cannot be read is an error of the run, not of its hash.
        let _ = hash.read(file);
        self.0.push((file.to_owned(), hash.0));
        hash.0
    }
}

fn hash(scene: &Scene, files: &mut FileHashes) -> String {
    let mut hash = Fnv::default();
    hash.add(env!("CARGO_PKG_VERSION").as_bytes());
    hash.add(scene.to_ron().as_bytes());
    for body in &scene.bodies {
        let surfels = &body.surfels;
        let mesh = match &body.shape {
            Shape::Mesh { file, .. } => Some(file),
            _ => None,
        };
        let images = [&surfels.image, &surfels.cut_image];
        let images = images.into_iter().flatten().map(|image| &image.file);
        let points = surfels.points.as_ref().map(|points| &points.file);
        for file in mesh.into_iter().chain(images).chain(points) {
            hash.add(&files.of(file).to_le_bytes());
        }
    }
    format!("{:016x}", hash.0)
}

/// The hash of Fowler, Noll and Vo, FNV-1a with 64 bits: a change that it overlooks is one in 2^64, and no
/// one gains by making one.
struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn read(&mut self, file: &Path) -> io::Result<()> {
        let mut file = File::open(file)?;
        let mut buffer = [0; 1 << 16];
        loop {
            match file.read(&mut buffer)? {
                0 => return Ok(()),
                count => self.add(&buffer[..count]),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Fnv;

    #[test]
    fn hashes_are_those_of_the_published_vectors() {
        // draft-eastlake-fnv, appendix C.
        for (text, expected) in [
            ("", 0xcbf2_9ce4_8422_2325),
            ("a", 0xaf63_dc4c_8601_ec8c),
            ("foobar", 0x8594_4171_f739_67e8),
        ] {
            let mut hash = Fnv::default();
            hash.add(text.as_bytes());
            assert_eq!(hash.0, expected, "{text}");
        }
    }
}
