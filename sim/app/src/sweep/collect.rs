//! From the folders of cases to a table in that of the sweep, and its quantiles.

use std::fs;
use std::path::{Path, PathBuf};

use phyxel_scene::{Fault, KeyPath, Segment};
use serde_json::{Number, Value};

use super::SweepError;
use super::case::Case;
use super::plan::{Plan, ResultColumn, quoted};
use super::statistics::{SHARES, quantiles};
use crate::output::OutputFolder;
use crate::run::csv_row;

/// What one finished case gives.
struct Row<'a> {
    case: &'a Case,
    /// Why it failed; `None` if it came to its end.
    error: Option<String>,
    /// Folder with its `summary.json` and its tables.
    folder: PathBuf,
    healthy: bool,
    warnings: Option<usize>,
    /// One text per result of the plan; empty where the run has none.
    results: Vec<String>,
}

/// Writes `results.csv` (a row per finished case) and `quantiles.csv` (a row per result that is a number) into the
/// sweep's folder; what became of the cases, in words. What is written depends on the cases and their results alone.
///
/// # Errors
/// [`SweepError`] if nothing is finished, if no run has a result that the plan asks for, or if a file
/// cannot be written.
pub(crate) fn collect(
    plan: &Plan,
    cases: &[Case],
    folder: &OutputFolder,
) -> Result<String, SweepError> {
    let rows = cases.iter().flat_map(|case| row(plan, case, folder.path()));
    let rows: Vec<Row<'_>> = rows.collect();
    if rows.is_empty() {
        return Err(SweepError::Nothing(folder.path().to_owned()));
    }
    demand(plan, &rows)?;
    folder.write("results.csv", results(plan, &rows).as_bytes())?;
    folder.write("quantiles.csv", quantile_table(plan, &rows).as_bytes())?;
    let ended = rows.iter().filter(|row| row.error.is_none()).count();
    let healthy = rows.iter().filter(|row| row.healthy).count();
    Ok(format!(
        "{} cases: {ended} ended, {healthy} of them without a warning, {} failed, {} not run yet; {}: results.csv, quantiles.csv",
        cases.len(),
        rows.len() - ended,
        cases.len() - rows.len(),
        folder.path().display()
    ))
}

/// The row of a case, if it is finished.
fn row<'a>(plan: &Plan, case: &'a Case, sweep: &Path) -> Option<Row<'a>> {
    let error = case.outcome(sweep)?.error;
    let folder = case.folder(sweep);
    let summary = fs::read(folder.join("summary.json")).ok();
    let summary = summary.filter(|_| error.is_none());
    let summary: Option<Value> = summary.and_then(|text| serde_json::from_slice(&text).ok());
    let warnings = summary.as_ref().map(|summary| {
        let warnings = summary.get("warnings").and_then(Value::as_array);
        warnings.map_or(0, Vec::len)
    });
    let result = |measure: &ResultColumn| match measure {
        ResultColumn::Summary { path, .. } => {
            let value = summary.as_ref().map(|summary| at_path(summary, path));
            value.and_then(Result::ok).map_or(String::new(), text_of)
        }
        ResultColumn::Largest {
            column, file, of, ..
        } => extreme(&folder.join(file), column, of.as_deref(), f64::max),
        ResultColumn::Smallest {
            column, file, of, ..
        } => extreme(&folder.join(file), column, of.as_deref(), f64::min),
    };
    Some(Row {
        case,
        healthy: error.is_none() && warnings == Some(0),
        warnings,
        results: plan.results.iter().map(result).collect(),
        error,
        folder,
    })
}

/// The value at a path, or the path of the last value on it that is there.
fn at_path<'a>(value: &'a Value, path: &str) -> Result<&'a Value, KeyPath> {
    let mut value = value;
    let path = KeyPath::parse(path).unwrap_or(KeyPath(Vec::new()));
    for (depth, segment) in path.0.iter().enumerate() {
        let next = match segment {
            Segment::Key(key) => value.get(key),
            Segment::Index(index) => value.get(*index),
        };
        value = next.ok_or_else(|| KeyPath(path.0[..depth].to_vec()))?;
    }
    Ok(value)
}

fn text_of(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::Bool(whether) => u8::from(*whether).to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => text.clone(),
        Value::Array(list) => list.len().to_string(),
        Value::Object(_) => value.to_string(),
    }
}

/// Shortest text that gives the number back.
fn number(value: f64) -> String {
    Number::from_f64(value).map_or(String::new(), |number| number.to_string())
}

/// The extreme number of a column of a table; empty where there is none.
fn extreme(file: &Path, column: &str, of: Option<&str>, choose: fn(f64, f64) -> f64) -> String {
    let Ok(mut reader) = csv::Reader::from_path(file) else {
        return String::new();
    };
    let Ok(header) = reader.headers().cloned() else {
        return String::new();
    };
    let place = |name: &str| header.iter().position(|column| column == name);
    let (at, owner) = (place(column), place("body").or_else(|| place("tool")));
    let records = reader.records().filter_map(Result::ok);
    let rows =
        records.filter(|row| of.is_none_or(|of| owner.and_then(|at| row.get(at)) == Some(of)));
    let numbers = rows.filter_map(|row| row.get(at?)?.parse::<f64>().ok());
    let numbers = numbers.filter(|value| value.is_finite());
    numbers.reduce(choose).map_or(String::new(), number)
}

/// Every result must be somewhere, or it is misspelt.
fn demand(plan: &Plan, rows: &[Row<'_>]) -> Result<(), SweepError> {
    let Some(ended) = rows.iter().find(|row| row.error.is_none()) else {
        return Ok(());
    };
    let folder = &ended.folder;
    for (index, measure) in plan.results.iter().enumerate() {
        if rows.iter().any(|row| !row.results[index].is_empty()) {
            continue;
        }
        let (key, found, must) = match measure {
            ResultColumn::Summary { path, .. } => {
                let text = fs::read(folder.join("summary.json")).unwrap_or_default();
                let summary: Value = serde_json::from_slice(&text).unwrap_or_default();
                let above = at_path(&summary, path).err().unwrap_or(KeyPath(Vec::new()));
                let owner = at_path(&summary, &above.to_string()).unwrap_or(&summary);
                let keys = owner.as_object().into_iter().flat_map(|owner| owner.keys());
                let keys: Vec<&str> = keys.map(String::as_str).collect();
                let owner = match &above.0[..] {
                    [] => "summary.json".to_owned(),
                    _ => format!("{above} in summary.json"),
                };
                let must = format!("no run has a value there; {owner} has {}", keys.join(", "));
                ("path", path.clone(), must)
            }
            ResultColumn::Largest { column, file, .. }
            | ResultColumn::Smallest { column, file, .. } => {
                let text = fs::read_to_string(folder.join(file)).unwrap_or_default();
                let header = text.lines().next().unwrap_or("nothing").replace(',', ", ");
                let must = format!("no run has a number there; {file} has {header}");
                ("column", column.clone(), must)
            }
        };
        return Err(plan.source.at(Fault {
            path: format!("results[{index}].{key}"),
            found: quoted(&found),
            must,
        }));
    }
    Ok(())
}

fn results(plan: &Plan, rows: &[Row<'_>]) -> String {
    let mut header = vec!["case".to_owned()];
    header.extend(plan.keys.iter().map(|key| key.name().to_owned()));
    header.extend(["ended", "healthy", "warnings"].map(str::to_owned));
    header.extend(plan.results.iter().map(ResultColumn::name));
    header.push("error".to_owned());
    let mut text = csv_row(&header);
    for row in rows {
        let flag = |holds: bool| u8::from(holds).to_string();
        let warnings = row
            .warnings
            .map_or(String::new(), |count| count.to_string());
        let mut fields = vec![row.case.number.to_string()];
        fields.extend_from_slice(&row.case.values);
        fields.extend([flag(row.error.is_none()), flag(row.healthy), warnings]);
        fields.extend_from_slice(&row.results);
        fields.push(row.error.clone().unwrap_or_default());
        text.push_str(&csv_row(&fields));
    }
    text
}

/// Every result that is a number, whether the case is healthy first.
fn quantile_table(plan: &Plan, rows: &[Row<'_>]) -> String {
    let mut header = ["result", "cases", "mean", "deviation"]
        .map(str::to_owned)
        .to_vec();
    header.extend(SHARES.map(|share| format!("{:.0} %", 100.0 * share)));
    let healthy = rows.iter().map(|row| f64::from(u8::from(row.healthy)));
    let mut columns = vec![("healthy".to_owned(), healthy.collect::<Vec<f64>>())];
    for (index, measure) in plan.results.iter().enumerate() {
        let numbers = rows
            .iter()
            .flat_map(|row| row.results[index].parse::<f64>());
        let numbers = numbers.filter(|value| value.is_finite());
        columns.push((measure.name(), numbers.collect()));
    }
    let mut text = csv_row(&header);
    for (name, values) in &columns {
        let Some((moments, at)) = quantiles(values) else {
            continue;
        };
        let mut fields = vec![name.clone(), values.len().to_string()];
        fields.extend(moments.into_iter().chain(at).map(number));
        text.push_str(&csv_row(&fields));
    }
    text
}
