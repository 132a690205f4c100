//! From the folders of cases to one table, what it says, and a drawing per result.

use std::fs;
use std::path::PathBuf;

use phyxel_text::{KeyPath, Segment};
use serde_json::{Number, Value};

use crate::chart::{Panel, chart};
use crate::plan::{Plan, PlanError, ResultColumn, Values};
use crate::statistics::{SHARES, quantiles, sensitivity};

/// A case that is finished.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FinishedCase {
    /// Number, from 1.
    pub number: usize,
    /// Value of each key, in the order of the plan's keys.
    pub values: Vec<String>,
    /// Why it failed; `None` if it came to its end.
    pub error: Option<String>,
    /// Folder with its `summary.json` and its tables.
    pub folder: PathBuf,
}

/// What the results of finished cases say.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tables {
    /// Cases that came to their end.
    pub ended: usize,
    /// Those of them that warn of nothing.
    pub healthy: usize,
    /// Names and contents of files: `results.csv` (a row per case), `quantiles.csv`, `sensitivity.csv` and a
    /// drawing `result-*.svg` per result.
    pub files: Vec<(String, String)>,
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
pub fn tables(plan: &Plan, cases: &[FinishedCase]) -> Result<Tables, PlanError> {
    let rows: Vec<Row<'_>> = cases.iter().map(|case| row(plan, case)).collect();
    demand(plan, &rows)?;
    let columns = columns(plan, &rows);
    let mut files = vec![
        ("results.csv".to_owned(), results(plan, &rows)),
        ("quantiles.csv".to_owned(), quantile_table(&columns)),
        (
            "sensitivity.csv".to_owned(),
            sensitivity_table(plan, &rows, &columns),
        ),
    ];
    for (number, column) in columns.iter().enumerate() {
        let panels: Vec<Panel<'_>> = panels(plan, &rows, column);
        let name: String = column
            .name
            .replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        let name = format!("result-{number:02}-{name}.svg");
        files.push((name, chart(&column.name, &panels)));
    }
    Ok(Tables {
        ended: cases.iter().filter(|case| case.error.is_none()).count(),
        healthy: rows.iter().filter(|row| row.healthy).count(),
        files,
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

/// A result as numbers, with the rows that have it.
struct Column {
    name: String,
    rows: Vec<usize>,
    values: Vec<f64>,
}

/// Every result that is a number, whether the case is healthy first.
fn columns(plan: &Plan, rows: &[Row<'_>]) -> Vec<Column> {
    let mut columns = vec![Column {
        name: "healthy".to_owned(),
        rows: (0..rows.len()).collect(),
        values: rows
            .iter()
            .map(|row| f64::from(u8::from(row.healthy)))
            .collect(),
    }];
    for (index, measure) in plan.results.iter().enumerate() {
        let numbers = rows.iter().enumerate().filter_map(|(at, row)| {
            let value: f64 = row.results[index].parse().ok()?;
            value.is_finite().then_some((at, value))
        });
        let (rows, values): (Vec<usize>, Vec<f64>) = numbers.unzip();
        if !values.is_empty() {
            let name = measure.name();
            columns.push(Column { name, rows, values });
        }
    }
    columns
}

fn quantile_table(columns: &[Column]) -> String {
    let mut header = ["result", "cases", "mean", "deviation"]
        .map(str::to_owned)
        .to_vec();
    header.extend(SHARES.map(|share| format!("{:.0} %", 100.0 * share)));
    let rows = columns.iter().filter_map(|column| {
        let found = quantiles(&column.values)?;
        let mut fields = vec![column.name.clone(), found.count.to_string()];
        fields.extend([found.mean, found.deviation].map(number));
        fields.extend(found.at.map(number));
        Some(fields)
    });
    csv_of(&header, rows)
}

/// A key's values of some rows as numbers: words are numbered in the order of their first use.
fn inputs(rows: &[Row<'_>], key: usize, chosen: &[usize]) -> Vec<f64> {
    let all = rows.iter().map(|row| row.case.values[key].as_str());
    let words: Vec<&str> = all.clone().collect();
    let numbers: Option<Vec<f64>> = all.map(|text| text.parse().ok()).collect();
    let numbers = numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite()));
    #[allow(clippy::cast_precision_loss, reason = "at most 1e5 cases")]
    let numbered = |row: usize| {
        let mut seen: Vec<&str> = Vec::new();
        for word in &words {
            if !seen.contains(word) {
                seen.push(word);
            }
        }
        seen.iter()
            .position(|word| *word == words[row])
            .unwrap_or(0) as f64
    };
    chosen
        .iter()
        .map(|&row| {
            numbers
                .as_ref()
                .map_or_else(|| numbered(row), |numbers| numbers[row])
        })
        .collect()
}

fn sensitivity_table(plan: &Plan, rows: &[Row<'_>], columns: &[Column]) -> String {
    let header = ["result", "key", "first_order", "noise", "bins", "cases"].map(str::to_owned);
    let mut lines = Vec::new();
    for column in columns {
        for (index, key) in plan.keys.iter().enumerate() {
            let x = inputs(rows, index, &column.rows);
            if let Some(found) = sensitivity(&x, &column.values) {
                lines.push(vec![
                    column.name.clone(),
                    key.name().to_owned(),
                    number(found.index),
                    number(found.noise),
                    found.bins.to_string(),
                    x.len().to_string(),
                ]);
            }
        }
    }
    csv_of(&header, lines.into_iter())
}

fn panels<'a>(plan: &'a Plan, rows: &[Row<'_>], column: &Column) -> Vec<Panel<'a>> {
    let keys = plan.keys.iter().enumerate();
    keys.map(|(index, key)| {
        let x = inputs(rows, index, &column.rows);
        Panel {
            key: key.name(),
            logarithmic: matches!(key.values, Values::LogUniform(..)),
            points: x.into_iter().zip(column.values.iter().copied()).collect(),
        }
    })
    .collect()
}
