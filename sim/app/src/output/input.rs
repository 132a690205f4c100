//! `input.csv`: what tools, blades and users did, step by step; written by a run, read by a replay.
//!
//! A tool's row has its position and its rotation as a quaternion at the end of the step; an edge has a
//! row per point. A grip has its point and its radius as the value, a pull its way, gravity its
//! acceleration (m/s²) instead of a point, damping its rate (1/s) as the value. Numbers are written so that reading gives bitwise identical values.

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use phyxel::scene::{DidYouMean, Pose, Scene, nearest};
use phyxel::{Action, Input, StrokePhase};
use phyxel_scene::read_file;

/// A recorded input that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputFileError {
    /// The file cannot be read, or a row is not as it must be.
    #[error("{}: {source}; such a file is written by a run with observe.input", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the reader said, with the line.
        source: csv::Error,
    },
    /// A row says something that cannot be.
    #[error("{}: line {line}: {problem}", file.display())]
    Row {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: u64,
        /// What is wrong.
        problem: String,
    },
}

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct Row {
    step: u64,
    kind: Kind,
    name: String,
    phase: Option<StrokePhase>,
    point: usize,
    x_m: f64,
    y_m: f64,
    z_m: f64,
    qx: Option<f64>,
    qy: Option<f64>,
    qz: Option<f64>,
    qw: Option<f64>,
    #[serde(default)]
    value: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    #[default]
    Tool,
    Blade,
    Grip,
    Pull,
    LetGo,
    Gravity,
    Damping,
}

/// The rows of `inputs`.
pub(crate) fn input_csv(scene: &Scene, inputs: &[Input]) -> Vec<u8> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in inputs.iter().flat_map(|input| rows(scene, input)) {
        // Writing into memory cannot fail.
        let _ = writer.serialize(row);
    }
    writer.into_inner().unwrap_or_default()
}

fn rows(scene: &Scene, Input { step, action }: &Input) -> Vec<Row> {
    let row = |kind, name: &str, point, place: DVec3, value| Row {
        step: *step,
        kind,
        name: name.to_owned(),
        point,
        x_m: place.x,
        y_m: place.y,
        z_m: place.z,
        value,
        ..Row::default()
    };
    match action {
        Action::Tool { tool, pose } => {
            let (turn, name) = (pose.rotation, &scene.tools[*tool].name);
            vec![Row {
                qx: Some(turn.x),
                qy: Some(turn.y),
                qz: Some(turn.z),
                qw: Some(turn.w),
                ..row(Kind::Tool, name, 0, pose.position, None)
            }]
        }
        Action::Blade { cut, phase, edge } => {
            let name = &scene.cuts[*cut].name;
            let points = edge.iter().enumerate();
            let rows = points.map(|(point, &place)| Row {
                phase: Some(*phase),
                ..row(Kind::Blade, name, point, place, None)
            });
            rows.collect()
        }
        Action::Grip { point, radius } => vec![row(Kind::Grip, "", 0, *point, Some(*radius))],
        Action::Pull { by } => vec![row(Kind::Pull, "", 0, *by, None)],
        Action::LetGo => vec![row(Kind::LetGo, "", 0, DVec3::ZERO, None)],
        Action::Gravity { acceleration } => vec![row(Kind::Gravity, "", 0, *acceleration, None)],
        Action::Damping { rate } => vec![row(Kind::Damping, "", 0, DVec3::ZERO, Some(*rate))],
    }
}

/// Reads the inputs of a run of `scene`.
///
/// # Errors
/// [`InputFileError`] with the file and the line.
pub fn read_input(file: &Path, scene: &Scene) -> Result<Vec<Input>, InputFileError> {
    let failed = |source| InputFileError::Read {
        file: file.to_owned(),
        source,
    };
    let content = read_file(file).map_err(|error| failed(error.into()))?;
    let mut reader = csv::Reader::from_reader(&content[..]);
    let headers = reader.headers().map_err(failed)?.clone();
    let fault = |line, problem| InputFileError::Row {
        file: file.to_owned(),
        line,
        problem,
    };
    let mut inputs: Vec<Input> = Vec::new();
    let mut lines = Vec::new();
    for record in reader.records() {
        let record = record.map_err(failed)?;
        let line = record.position().map_or(0, csv::Position::line);
        let row: Row = record.deserialize(Some(&headers)).map_err(failed)?;
        add(scene, &mut inputs, row).map_err(|problem| fault(line, problem))?;
        lines.resize(inputs.len(), line);
    }
    for (input, line) in inputs.iter().zip(lines) {
        if matches!(&input.action, Action::Blade { edge, .. } if edge.len() < 2) {
            let problem = "a blade's edge needs two points, a row each, at least".to_owned();
            return Err(fault(line, problem));
        }
    }
    Ok(inputs)
}

fn add(scene: &Scene, inputs: &mut Vec<Input>, row: Row) -> Result<(), String> {
    let place = DVec3::new(row.x_m, row.y_m, row.z_m);
    if !place.is_finite() {
        return Err("x_m, y_m and z_m must be finite".to_owned());
    }
    let step = row.step;
    if let Some(last) = inputs.last().filter(|last| last.step > step) {
        return Err(format!("step {step} comes after step {}", last.step));
    }
    let action = match row.kind {
        Kind::Tool => tool_action(scene, &row, place)?,
        Kind::Blade => {
            let cut = index_of("cut", &row.name, scene.cuts.iter().map(|c| &*c.name))?;
            let Some(phase) = row.phase else {
                return Err("a blade needs a phase: Start, Update or End".to_owned());
            };
            let point = row.point;
            let last = inputs.last_mut().filter(|last| last.step == step);
            match last.map(|last| &mut last.action) {
                Some(Action::Blade {
                    cut: same, edge, ..
                }) if *same == cut && edge.len() == point => {
                    edge.push(place);
                    return Ok(());
                }
                _ if point == 0 => {
                    let edge = vec![place];
                    Action::Blade { cut, phase, edge }
                }
                _ => {
                    let must = "must follow the point before it";
                    return Err(format!("point {point} of an edge {must}"));
                }
            }
        }
        kind => {
            let value = row.value.filter(|value| value.is_finite() && *value >= 0.0);
            let (point, acceleration) = (place, place);
            match (kind, value) {
                (Kind::Grip, Some(radius)) => Action::Grip { point, radius },
                (Kind::Damping, Some(rate)) => Action::Damping { rate },
                (Kind::Grip | Kind::Damping, None) => {
                    return Err("this needs a value that is not negative".to_owned());
                }
                (Kind::Pull, _) => Action::Pull { by: place },
                (Kind::Gravity, _) => Action::Gravity { acceleration },
                _ => Action::LetGo,
            }
        }
    };
    inputs.push(Input { step, action });
    Ok(())
}

fn tool_action(scene: &Scene, row: &Row, position: DVec3) -> Result<Action, String> {
    let tool = index_of("tool", &row.name, scene.tools.iter().map(|t| &*t.name))?;
    let (Some(x), Some(y), Some(z), Some(w)) = (row.qx, row.qy, row.qz, row.qw) else {
        return Err("a tool needs its rotation: qx, qy, qz and qw".to_owned());
    };
    let rotation = DQuat::from_xyzw(x, y, z, w);
    if (rotation.length() - 1.0).abs() > 1e-6 {
        return Err("qx, qy, qz and qw must be of unit length together".to_owned());
    }
    let pose = Pose { rotation, position };
    Ok(Action::Tool { tool, pose })
}

fn index_of<'a>(
    what: &str,
    name: &str,
    names: impl Iterator<Item = &'a str> + Clone,
) -> Result<usize, String> {
    names
        .clone()
        .position(|candidate| candidate == name)
        .ok_or_else(|| {
            let hint = DidYouMean(nearest(name, names));
            format!("the scene has no {what} '{name}'{hint}")
        })
}
