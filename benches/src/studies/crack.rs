//! What rules for weakening pairs do to the mechanics: stress intensity and mouth of an edge crack.

use crate::problems::cracks::{Form, PLACES, Ratios, edge_crack};
use crate::report::{Cell, Plot, Report, Table, add_point, plots, row};
use crate::{Effort, StudyError};

/// Mean and standard deviation.
fn spread(runs: &[Ratios], of: impl Fn(&Ratios) -> f64) -> (f64, f64) {
    let n = runs.len() as f64;
    let mean = runs.iter().map(&of).sum::<f64>() / n;
    let square = runs.iter().map(|run| (of(run) - mean).powi(2)).sum::<f64>();
    (mean, (square / n).sqrt())
}

fn milliseconds(runs: &[Ratios], which: usize) -> f64 {
    1e3 * spread(runs, |run| run.seconds[which]).0
}

/// A row of the table: a form on a body of some cells, at all places.
fn entries(form: Form, cells: u32, runs: &[Ratios]) -> Vec<Cell> {
    let mut row = row![form.name(), 0.4 * f64::from(cells)];
    let Some(first_run) = runs.first() else {
        row.push(Cell::Word("refused".to_owned()));
        row.resize(11, Cell::Nothing);
        return row;
    };
    row.push(first_run.nodes.into());
    let figures: [fn(&Ratios) -> f64; 2] = [|run| run.first, |run| run.second];
    for of in figures {
        let (mean, scatter) = spread(runs, of);
        row.extend(row![100.0 * (mean - 1.0), 100.0 * scatter]);
    }
    row.push((100.0 * off(runs)).into());
    row.extend([0, 1, 2].map(|which| Cell::Number(milliseconds(runs, which))));
    row
}

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    // Cells over a width of 1: the crack is 0.4 of them long.
    let (sizes, places): (&[u32], &[[f64; 2]]) = effort.choose(
        (&[10, 20, 40], &PLACES),
        (&[10, 16], &[PLACES[1], PLACES[6]]),
    );
    let mut rows = Vec::new();
    for (form, &cells) in Form::ALL
        .into_iter()
        .flat_map(|form| sizes.iter().map(move |cells| (form, cells)))
    {
        let mut runs = Vec::new();
        for &place in places {
            runs.extend(edge_crack(cells, 0.0, place, 0.0, form)?);
        }
        rows.push(entries(form, cells, &runs));
    }
    let table = Table::new(
        "edge",
        "Edge crack under tension: errors against Tada, Paris and Irwin, cost of the cut",
        "form; length (spacings); nodes (1); K_I (%); K_I scatter (%); mouth (%); \
         mouth scatter (%); both, RMS (%); set-up (ms); factors (ms); rows (ms)",
        rows,
    );
    let plots = plots(&table);
    let words = format!(
        "A strip of width 1 and height 3 in plane strain (E 1 kPa, nu 0.3) with a crack of 0.4 \
         from its edge, pulled with 1 Pa; references by Tada, Paris and Irwin (about 0.5 %). \
         Means, scatter and root mean squares are over {} places of the crack relative to the \
         nodes. K_I by an interaction integral over six spacings.",
        places.len(),
    );
    Ok(Report::new(&[&words, OF_TIMES], vec![table], plots))
}

const OF_TIMES: &str = "Times: set-up once per body, then factors and rows of the whole cut. The one-sided grid is refused \
     where its weights differ between the two directions of a pair.";

/// Errors of the table's forms over length and time.
fn plots(table: &Table) -> Vec<Plot> {
    let lines = |point: fn(&[f64]) -> (f64, f64)| {
        let mut lines = Vec::new();
        for row in &table.rows {
            let numbers: Vec<f64> = row.iter().filter_map(Cell::number).collect();
            if numbers.len() == 10 {
                add_point(&mut lines, row[0].word(), point(&numbers));
            }
        }
        lines
    };
    // Of a mean and its scatter the root mean square is the hypotenuse.
    plots![
        "intensity" "Edge crack: error of the stress intensity",
            log "length of the crack (spacings)",
            log "RMS error of K_I (%)" => lines(|row| (row[0], row[2].hypot(row[3])));
        "mouth" "Edge crack: error of the mouth's opening",
            log "length of the crack (spacings)",
            log "RMS error of the mouth (%)" => lines(|row| (row[0], row[4].hypot(row[5])));
        "time" "Edge crack: error against the time of the cut",
            log "factors and rows of the whole cut (ms)",
            log "RMS error of K_I and mouth (%)" => lines(|row| (row[8] + row[9], row[6]));
    ]
}

/// Root of the mean square error of a ratio.
fn root(runs: &[Ratios], of: impl Fn(&Ratios) -> f64) -> f64 {
    spread(runs, |run| (of(run) - 1.0).powi(2)).0.sqrt()
}

/// Root of the mean square error of both ratios.
fn off(runs: &[Ratios]) -> f64 {
    (0.5 * (root(runs, |run| run.first).powi(2) + root(runs, |run| run.second).powi(2))).sqrt()
}
