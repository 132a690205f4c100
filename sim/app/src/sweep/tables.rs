//! From the folders of cases to one table and its quantiles.

use std::fs;
use std::path::PathBuf;

use phyxel_scene::{KeyPath, Segment};
use serde_json::{Number, Value};

use super::plan::{Plan, PlanError, ResultColumn};
use super::statistics::{SHARES, quantiles};

/// A case that is finished.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct FinishedCase {
    /// Number, from 1.
    pub(super) number: usize,
    /// Value of each key, in the order of the plan's keys.
    pub(super) values: Vec<String>,
    /// Why it failed; `None` if it came to its end.
    pub(super) error: Option<String>,
    /// Folder with its `summary.json` and its tables.
    pub(super) folder: PathBuf,
}

/// What the results of finished cases say.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Tables {
    /// Cases that came to their end.
    pub(super) ended: usize,
    /// Those of them that warn of nothing.
    pub(super) healthy: usize,
    /// `results.csv`: a row per case.
    pub(super) results: String,
    /// `quantiles.csv`: a row per result that is a number.
    pub(super) quantiles: String,
}

/// What one finished case gives.
struct Row<'a> {
    case: &'a FinishedCase,
    healthy: bool,
    warnings: Option<usize>,
    /// One text per result of the plan; empty where the run has none.
    results: Vec<String>,
}

/// Puts the results of finished cases, of which there is one at least, into tables. They depend on the cases and
/// their results alone.
///
/// # Errors
/// [`PlanError`] if no run has a result that the plan asks for.
pub(super) fn tables(plan: &Plan, cases: &[FinishedCase]) -> Result<Tables, PlanError> {
    let rows: Vec<Row<'_>> = cases.iter().map(|case| row(plan, case)).collect();
    demand(plan, &rows)?;
    Ok(Tables {
        ended: cases.iter().filter(|case| case.error.is_none()).count(),
        healthy: rows.iter().filter(|row| row.healthy).count(),
        results: results(plan, &rows),
        quantiles: quantile_table(plan, &rows),
    })
}

fn row<'a>(plan: &Plan, case: &'a FinishedCase) -> Row<'a> {
    let folder = &case.folder;
    let summary = fs::read(folder.join("summary.json")).ok();
    let summary = summary.filter(|_| case.error.is_none());
    let summary: Option<Value> = summary.and_then(|text| serde_json::from_slice(&text).ok());
    let warnings = summary.as_ref().map(|summary| {
        let warnings = summary.get("warnings").and_then(Value::as_array);
        warnings.map_or(0, Vec::len)
    });
    let result = |measure: &ResultColumn| match measure {
        ResultColumn::Summary { path, .. } => summary
            .as_ref()
            .and_then(|summary| at_path(summary, path).ok())
            .map_or(String::new(), text_of),
        ResultColumn::Largest {
            column, file, of, ..
        } => extreme(&folder.join(file), column, of.as_deref(), f64::max),
        ResultColumn::Smallest {
            column, file, of, ..
        } => extreme(&folder.join(file), column, of.as_deref(), f64::min),
    };
    Row {
        healthy: case.error.is_none() && warnings == Some(0),
        warnings,
        results: plan.results.iter().map(result).collect(),
        case,
    }
}

/// The value at a path, or the path of the last value on the way that is there.
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
fn extreme(
    file: &std::path::Path,
    column: &str,
    of: Option<&str>,
    choose: fn(f64, f64) -> f64,
) -> String {
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
    numbers
        .filter(|value| value.is_finite())
        .reduce(choose)
        .map_or(String::new(), number)
}

/// Every result must be somewhere, or it is misspelt.
fn demand(plan: &Plan, rows: &[Row<'_>]) -> Result<(), PlanError> {
    let Some(ended) = rows.iter().find(|row| row.case.error.is_none()) else {
        return Ok(());
    };
    let folder = &ended.case.folder;
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
                let keys: Vec<&str> = owner.as_object().map_or(Vec::new(), |object| {
                    object.keys().map(String::as_str).collect()
                });
                let owner = if above.0.is_empty() {
                    "summary.json".to_owned()
                } else {
                    format!("{above} in summary.json")
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
        let path = format!("results[{index}].{key}");
        plan.source
            .require(false, &path, &format!("'{found}'"), &must)?;
    }
    Ok(())
}

fn csv_of(header: &[String], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    // Writing into memory cannot fail, and what is valid UTF-8 stays so.
    let _ = writer.write_record(header);
    for row in rows {
        let _ = writer.write_record(row);
    }
    String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
}

fn results(plan: &Plan, rows: &[Row<'_>]) -> String {
    let mut header = vec!["case".to_owned()];
    header.extend(plan.keys.iter().map(|key| key.name().to_owned()));
    header.extend(["ended", "healthy", "warnings"].map(str::to_owned));
    header.extend(plan.results.iter().map(ResultColumn::name));
    header.push("error".to_owned());
    let rows = rows.iter().map(|row| {
        let mut fields = vec![row.case.number.to_string()];
        fields.extend(row.case.values.iter().cloned());
        fields.push(u8::from(row.case.error.is_none()).to_string());
        fields.push(u8::from(row.healthy).to_string());
        fields.push(
            row.warnings
                .map_or(String::new(), |count| count.to_string()),
        );
        fields.extend(row.results.iter().cloned());
        fields.push(row.case.error.clone().unwrap_or_default());
        fields
    });
    csv_of(&header, rows)
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
            .filter_map(|row| row.results[index].parse().ok());
        let numbers = numbers.filter(|value: &f64| value.is_finite());
        columns.push((measure.name(), numbers.collect()));
    }
    let rows = columns.iter().filter_map(|(name, values)| {
        let found = quantiles(values)?;
        let mut fields = vec![name.clone(), found.count.to_string()];
        fields.extend([found.mean, found.deviation].map(number));
        fields.extend(found.at.map(number));
        Some(fields)
    });
    csv_of(&header, rows)
}
