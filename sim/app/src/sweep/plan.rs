//! Plans: what a sweep changes and what it keeps of each run.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::SweepError;
use phyxel_scene::{
    Checks, Fault, KeyPath, Override, OverrideError, Place, Raw, Syntax, TextError, parse,
    place_of, read_settings, shortened,
};

/// The version of plans that this program reads.
const VERSION: u32 = 1;
/// What messages call a plan's text.
const WHOLE: &str = "the plan";
/// Most cases of one plan: beyond it a list of them is no longer handy.
const MOST_CASES: usize = 100_000;
/// Columns that every table has beside those of keys and results.
const RESERVED: [&str; 5] = ["case", "ended", "healthy", "warnings", "error"];

/// What a sweep runs.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Version of the format.
    version: u32,
    /// Embedded scene, scene file or mesh; relative to the plan's folder.
    pub scene: PathBuf,
    /// Changes that all cases share.
    #[serde(default)]
    pub set: Vec<Override>,
    /// How the values of the keys are combined.
    pub design: Design,
    /// What changes from case to case, at least one.
    pub keys: Vec<SweptKey>,
    /// What is kept of each run.
    #[serde(default = "ResultColumn::usual")]
    pub results: Vec<ResultColumn>,
    /// The plan's file and its text, for messages.
    #[serde(skip)]
    pub(crate) source: Source,
}

/// Where a plan was written.
#[derive(Debug, Clone, Default)]
pub(crate) struct Source {
    file: PathBuf,
    text: String,
}

/// How the values of the keys are combined into cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Design {
    /// The first case takes the first value of each key, the second the second, and so on.
    List,
    /// Every combination; the last key changes fastest.
    Grid,
    /// A Latin hypercube (`McKay` 1979): each key's range is cut into as many parts of
    /// equal probability as there are cases, and each part is used once.
    LatinHypercube {
        /// Cases.
        cases: u32,
        /// Same seed, same cases.
        #[serde(default)]
        seed: u64,
    },
}

/// Something that changes from case to case.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, rename = "Key")]
pub struct SweptKey {
    /// Key path in the scene, as `--set` takes it.
    pub key: String,
    /// More paths that take the same text.
    #[serde(default)]
    pub also: Vec<String>,
    /// Column in tables; the path where not given.
    #[serde(default)]
    pub name: Option<String>,
    /// What is written at the path, with the value instead of `{}`.
    #[serde(default = "SweptKey::default_write")]
    pub write: String,
    /// Whether values of a range are rounded to whole numbers.
    #[serde(default)]
    pub whole: bool,
    /// The values.
    pub values: Values,
}

impl SweptKey {
    fn default_write() -> String {
        "{}".to_owned()
    }

    /// Column in tables.
    pub(crate) fn name(&self) -> &str {
        self.name.as_deref().unwrap_or(&self.key)
    }

    /// The changes that give the scene this value.
    pub(crate) fn overrides(&self, value: &str) -> Result<Vec<Override>, OverrideError> {
        let written = self.write.replace("{}", value);
        let paths = std::iter::once(&self.key).chain(&self.also);
        paths
            .map(|path| Override::parse(&format!("{path}={written}")))
            .collect()
    }
}

/// The values of a key.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Values {
    /// These, whatever the scene takes there.
    Of(Vec<Raw>),
    /// A number from the first to the second, each as likely.
    Uniform(f64, f64),
    /// A number from the first to the second, its logarithm uniform.
    LogUniform(f64, f64),
}

impl Values {
    /// Those that are listed; none of a range.
    pub(super) fn listed(&self) -> &[Raw] {
        match self {
            Self::Of(list) => list,
            Self::Uniform(..) | Self::LogUniform(..) => &[],
        }
    }
}

/// A number that is kept of each run.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename = "Measure")]
pub enum ResultColumn {
    /// What stands at a path in `summary.json`; of a list its length.
    Summary {
        /// Path, such as `bodies[0].energy.elastic`.
        path: String,
        /// Column in tables; the path where not given.
        #[serde(default)]
        name: Option<String>,
    },
    /// The largest number of a column.
    Largest {
        /// Column of the file.
        column: String,
        /// A table of the run's folder.
        #[serde(default = "ResultColumn::default_file")]
        file: String,
        /// Only rows in which `body` or `tool` is this; all where not given.
        #[serde(default)]
        of: Option<String>,
        /// Column in tables; `largest` and the column where not given.
        #[serde(default)]
        name: Option<String>,
    },
    /// The smallest number of a column.
    Smallest {
        /// Column of the file.
        column: String,
        /// A table of the run's folder.
        #[serde(default = "ResultColumn::default_file")]
        file: String,
        /// Only rows in which `body` or `tool` is this; all where not given.
        #[serde(default)]
        of: Option<String>,
        /// Column in tables; `smallest` and the column where not given.
        #[serde(default)]
        name: Option<String>,
    },
}

impl ResultColumn {
    fn default_file() -> String {
        "history.csv".to_owned()
    }

    /// Column in tables.
    pub(crate) fn name(&self) -> String {
        let (name, usual) = match self {
            Self::Summary { path, name } => (name, path.clone()),
            Self::Largest { column, name, .. } => (name, format!("largest {column}")),
            Self::Smallest { column, name, .. } => (name, format!("smallest {column}")),
        };
        name.clone().unwrap_or(usual)
    }

    /// What is kept where a plan does not say: what distinguishes a healthy run.
    fn usual() -> Vec<Self> {
        let usual = [
            "bodies[0].nodes",
            "bodies[0].pieces",
            "bodies[0].smallest_determinant",
            "bodies[0].energy.imbalance",
            "bodies[0].energy.largest_cut_addition",
            "stepping.steps",
        ];
        usual
            .map(|path| Self::Summary {
                path: path.to_owned(),
                name: None,
            })
            .to_vec()
    }
}

impl Plan {
    /// Reads the plan `file` and validates all of it that does not need the scene.
    pub(crate) fn load(file: &Path) -> Result<Self, SweepError> {
        let text = read_settings(file, WHOLE)?;
        Self::from_text(&text, file)
    }

    /// A plan from a text, validated as far as that needs no scene; `file` names it in messages, and relative paths start
    /// at its folder.
    ///
    /// # Errors
    /// A [`SweepError`] that names the position and what to do.
    pub fn from_text(text: &str, file: &Path) -> Result<Self, SweepError> {
        let source = Source {
            file: file.to_owned(),
            text: text.to_owned(),
        };
        let origin = file.display().to_string();
        let mut plan: Self = parse(text, Syntax::Ron, &origin, WHOLE)?;
        plan.scene = scene_path(&plan.scene, file);
        plan.source = source;
        match plan.validate() {
            Ok(()) => Ok(plan),
            Err(fault) => Err(plan.source.at(fault)),
        }
    }

    /// Name of the plan's file, without folder and ending.
    pub(crate) fn name(&self) -> String {
        let stem = self.source.file.file_stem();
        stem.map_or("sweep".into(), |stem| stem.to_string_lossy())
            .into_owned()
    }

    fn validate(&self) -> Result<(), Fault> {
        let mut checks = Checks::default();
        let must = format_args!("this program reads version {VERSION}");
        checks.require(self.version == VERSION, "version", self.version, must);
        let must = "name a key of the scene that changes from case to case";
        checks.require(!self.keys.is_empty(), "keys", "[]", must);
        let mut names: BTreeSet<String> = RESERVED.map(str::to_owned).into();
        let mut column = |checks: &mut Checks, name: &str| {
            let is_new = names.insert(name.to_owned());
            let must = "another column is called so; give each a name of its own";
            checks.require(is_new, "name", quoted(name), must);
        };
        checks.each("keys", &self.keys, |checks, key| {
            self.key(checks, key);
            column(checks, key.name());
        });
        checks.each("results", &self.results, |checks, result| {
            column(checks, &result.name());
            let (fits, key, found, must) = match result {
                ResultColumn::Summary { path, .. } => {
                    let must = "it must be a path such as bodies[0].energy.elastic";
                    (KeyPath::parse(path).is_some(), "path", path, must)
                }
                ResultColumn::Largest { file, .. } | ResultColumn::Smallest { file, .. } => {
                    let fits = file.ends_with(".csv") && !file.contains(['/', '\\']);
                    let must =
                        "it must be a table of a run's folder, such as history.csv or tools.csv";
                    (fits, "file", file, must)
                }
            };
            checks.require(fits, key, quoted(found), must);
        });
        let count = self.case_count();
        let fits = (1..=MOST_CASES).contains(&count);
        let must = format_args!("a sweep has from 1 to {MOST_CASES}");
        checks.require(fits, "design", format_args!("one of {count} cases"), must);
        checks.first()
    }

    fn key(&self, checks: &mut Checks, key: &SweptKey) {
        let mut path = |at: &str, text: &str| {
            let fits = KeyPath::parse(text).is_some();
            let must = "it must be a key path of the scene, such as bodies[0].material.density";
            checks.require(fits, at, quoted(text), must);
        };
        path("key", &key.key);
        for (index, text) in key.also.iter().enumerate() {
            path(&format!("also[{index}]"), text);
        }
        let must = "it must hold {} where the value goes, such as \"Nodes({})\"";
        let fits = key.write.contains("{}");
        checks.require(fits, "write", quoted(&key.write), must);
        match (&key.values, self.design) {
            (Values::Of(list), design) => {
                let count = list.len();
                checks.require(count > 0, "values", "Of([])", "give one value at least");
                let first = self.keys[0].values.listed().len();
                let fits = design != Design::List || count == first;
                let found = format_args!("a list of {count}");
                let must =
                    format_args!("in a List every key has as many values as the first, {first}");
                checks.require(fits, "values", found, must);
            }
            (Values::Uniform(low, high) | Values::LogUniform(low, high), design) => {
                let found = format!("from {low} to {high}");
                let fits = matches!(design, Design::LatinHypercube { .. });
                let must =
                    "only a LatinHypercube draws from ranges; a List and a Grid take Of([..])";
                checks.require(fits, "values", &found, must);
                let log = matches!(key.values, Values::LogUniform(..));
                let fits = low < high && low.is_finite() && high.is_finite();
                let must = if log {
                    "both ends must be above 0, and the first below the second"
                } else {
                    "the first must be below the second"
                };
                checks.require(fits && (!log || *low > 0.0), "values", found, must);
            }
        }
    }

    /// Cases.
    #[must_use]
    pub fn case_count(&self) -> usize {
        let mut lengths = self.keys.iter().map(|key| key.values.listed().len());
        match self.design {
            Design::List => lengths.next().unwrap_or(0),
            Design::Grid => lengths.fold(1, usize::saturating_mul),
            Design::LatinHypercube { cases, .. } => cases as usize,
        }
    }
}

impl Source {
    /// Where the value of a key path of the plan stands.
    pub(crate) fn place(&self, path: &str) -> Place {
        let origin = self.file.display().to_string();
        place_of(path, &self.text, Syntax::Ron, &origin, &[])
    }

    /// A fault of the plan where it stands.
    pub(crate) fn at(&self, fault: Fault) -> SweepError {
        let error = TextError::At {
            place: self.place(&fault.path),
            problem: fault.to_string(),
            path: fault.path,
        };
        error.into()
    }
}

pub(super) fn quoted(text: &str) -> String {
    format!("'{}'", shortened(text))
}

/// The scene as seen from the plan's folder; a name without ending that is no file is an embedded one.
fn scene_path(scene: &Path, plan: &Path) -> PathBuf {
    let beside = plan.with_file_name(scene);
    match scene.extension().is_none() && !beside.exists() {
        true => scene.to_owned(),
        false => beside,
    }
}
