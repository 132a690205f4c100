//! The chart of a file of rows: error over processor time of a simulated second.

use std::path::Path;

use serde::Deserialize;

use crate::StudyError;
use crate::error::of_file;
use crate::report::{Series, add_point, panels, plots};

/// Poisson's ratio of the chart.
const RATIO: f64 = 0.45;

/// What the chart needs of a row, phyxel's or a peer's.
#[derive(Debug, Deserialize)]
struct Row {
    task: String,
    poissons_ratio: f64,
    method: String,
    error: Option<f64>,
    norm: Option<f64>,
    step: Option<f64>,
    seconds: Option<f64>,
}

/// Draws `mechanics.svg` of the file `rows` into `folder`: each method a line in every panel, over what explicit steps cost where
/// a peer has both kinds.
///
/// # Errors
/// If the file is not read or the picture not written.
pub fn chart(rows: &Path, folder: &Path) -> Result<(), StudyError> {
    let reader = csv::Reader::from_path(rows).map_err(of_file(rows));
    let rows: Result<Vec<Row>, _> = reader?.deserialize().collect();
    let mut rows = rows?;
    rows.retain(|row| {
        (row.poissons_ratio - RATIO).abs() < 1e-9 && !row.method.ends_with("discrete")
    });
    let mut empty: Vec<Series> = Vec::new();
    for row in rows.iter().filter(|row| row.seconds.is_some()) {
        if !empty.iter().any(|line| line.name == row.method) {
            empty.push(Series::line(&*row.method, Vec::new()));
        }
    }
    let lines = |task: &str, error: fn(&Row) -> Option<f64>| {
        let mut lines = empty.clone();
        for row in rows.iter().filter(|row| row.task == task) {
            if let (Some(error), Some(step), Some(seconds)) = (error(row), row.step, row.seconds) {
                add_point(&mut lines, &row.method, (seconds / step, error.abs()));
            }
        }
        lines
    };
    let plots = plots![
        "beam" "Cantilever: deflection of the end",
            log "processor time of a simulated second (s)", log "|error| (%)" => lines("beam", |row| row.error);
        "block" "Hanging block: mean sag",
            log "processor time of a simulated second (s)", log "|error| (%)" => lines("block", |row| row.error);
        "force" "Sphere on a cube: force",
            log "processor time of a simulated second (s)", log "|error| (%)" => lines("sphere", |row| row.error);
        "norm" "Sphere on a cube: norm of displacements",
            log "processor time of a simulated second (s)", log "error (%)" => lines("sphere", |row| row.norm);
    ];
    let path = folder.join("mechanics.svg");
    let drawn = panels(&plots, 2, (1000, 860))?;
    std::fs::write(&path, drawn).map_err(of_file(&path))
}
