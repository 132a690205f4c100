//! What a study reports: tables, plots and a few words; how they are written.

mod clock;
mod page;
mod plot;

use std::fmt;

use crate::StudyError;

pub(crate) use clock::{machine, median, median_time};
pub(crate) use page::html;
pub(crate) use plot::{draw, panels};

/// The answer of a study.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// What was done and what it means, a paragraph each.
    pub words: Vec<String>,
    /// The numbers.
    pub tables: Vec<Table>,
    /// The numbers as plots.
    pub plots: Vec<Plot>,
}

impl Report {
    /// A report of some paragraphs.
    pub(crate) fn new(words: &[&str], tables: Vec<Table>, plots: Vec<Plot>) -> Self {
        Self {
            words: words.iter().copied().map(str::to_owned).collect(),
            tables,
            plots,
        }
    }
}

/// A table of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Part of the file name.
    pub name: &'static str,
    /// Title.
    pub title: String,
    /// Headings of the columns: `name (unit)`, `1` as the unit of pure numbers, or `name` where they hold words.
    pub columns: Vec<&'static str>,
    /// Rows, as long as the columns.
    pub rows: Vec<Vec<Cell>>,
}

/// One entry of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A word.
    Word(String),
    /// A count.
    Count(usize),
    /// A measured or computed number.
    Number(f64),
    /// Nothing, where the column does not apply.
    Nothing,
}

macro_rules! cells {
    ($($variant:ident of $from:ty),*) => {
        $(impl From<$from> for Cell {
            fn from(value: $from) -> Self {
                Self::$variant(value.into())
            }
        })*
    };
}
cells![Word of &str, Word of String, Count of usize, Number of f64];

impl<T: Into<Self>> From<Option<T>> for Cell {
    fn from(cell: Option<T>) -> Self {
        cell.map_or(Self::Nothing, Into::into)
    }
}

/// A row of a table, of what can be a [`Cell`] each.
macro_rules! row {
    ($($cell:expr),* $(,)?) => {
        vec![$($crate::report::Cell::from($cell)),*]
    };
}
pub(crate) use row;

/// The plots of a table: name, title, scale and label of both axes, lines.
macro_rules! plots {
    ($($name:literal $title:expr, $x:ident $across:expr, $y:ident $up:expr => $lines:expr;)*) => {
        vec![$($crate::report::Plot {
            name: $name,
            title: $title,
            x: $crate::report::$x($across),
            y: $crate::report::$y($up),
            series: $lines,
        }),*]
    };
}
pub(crate) use plots;

impl Cell {
    /// A number with all its digits, anything else as it is shown.
    fn in_full(&self) -> String {
        match self {
            Self::Number(number) => format!("{number:e}"),
            other => other.to_string(),
        }
    }

    /// The number or count, if it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Count(count) => Some(*count as f64),
            Self::Number(number) => Some(*number),
            Self::Word(_) | Self::Nothing => None,
        }
    }

    /// The word, or nothing if it is none.
    pub fn word(&self) -> &str {
        match self {
            Self::Word(word) => word,
            Self::Count(_) | Self::Number(_) | Self::Nothing => "",
        }
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Word(word) => f.pad(word),
            Self::Count(count) => f.pad(&count.to_string()),
            Self::Number(number) => f.pad(&significant(*number)),
            Self::Nothing => f.pad(""),
        }
    }
}

/// Three significant digits, without an exponent where that is short; `NaN` and `inf` of what is no number.
fn significant(number: f64) -> String {
    let size = number.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&size) {
        let smaller = |least: &&f64| size < **least;
        let decimals = [100.0, 10.0, 1.0, 0.1, 0.01].iter().filter(smaller).count();
        format!("{number:.decimals$}")
    } else {
        format!("{number:.2e}")
    }
}

/// What a row of a CSV file says: each entry after its column's name, numbers with three digits.
pub(crate) fn in_words(row: &impl serde::Serialize) -> Result<String, StudyError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.serialize(row)?;
    let bytes = writer.into_inner().expect("memory takes all");
    let mut reader = csv::Reader::from_reader(&bytes[..]);
    let names = reader.headers()?.clone();
    let entries = reader.records().next().expect("a row was written")?;
    let word = |(name, entry): (&str, &str)| match entry.parse() {
        Ok(number) if entry.parse::<i64>().is_err() => format!("{name} {}", significant(number)),
        _ => format!("{name} {entry}"),
    };
    let words: Vec<String> = names.iter().zip(&entries).map(word).collect();
    Ok(words.join(", "))
}

impl Table {
    /// A table under a `header` of the columns' headings with `; ` between them.
    pub(crate) fn new(
        name: &'static str,
        title: impl Into<String>,
        header: &'static str,
        rows: Vec<Vec<Cell>>,
    ) -> Self {
        Self {
            name,
            title: title.into(),
            columns: header.split("; ").collect(),
            rows,
        }
    }

    /// The table as CSV with a header of `name (unit)`; numbers in full.
    ///
    /// # Panics
    /// If a row is not as long as the columns.
    pub fn to_csv(&self) -> Vec<u8> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let headings = self.columns.iter().map(|&heading| heading.to_owned());
        let rows = self
            .rows
            .iter()
            .map(|row| row.iter().map(Cell::in_full).collect());
        for record in std::iter::once(headings.collect::<Vec<_>>()).chain(rows) {
            let written = writer.write_record(record);
            written.expect("rows are as long as the columns, and memory takes all");
        }
        writer.into_inner().expect("memory takes all")
    }

    /// Lines of a plot, one for each word of the column `by`: numbers of the column `x`, sizes of those of `y`. Rows
    /// that lack one of them have no point.
    pub(crate) fn lines(&self, by: &str, x: &str, y: &str) -> Vec<Series> {
        let [by, x, y] = [by, x, y].map(|name| self.column(name));
        let mut lines = Vec::new();
        for row in &self.rows {
            if let (Some(x), Some(y)) = (row[x].number(), row[y].number()) {
                add_point(&mut lines, row[by].word(), (x, y.abs()));
            }
        }
        lines
    }

    /// The position of the column called `name`.
    ///
    /// # Panics
    /// If there is no such column.
    pub fn column(&self, name: &str) -> usize {
        let is_name = |heading: &&str| {
            let both = heading.strip_suffix(')').and_then(|h| h.rsplit_once(" ("));
            both.map_or(*heading, |(name, _)| name) == name
        };
        let at = self.columns.iter().position(is_name);
        at.unwrap_or_else(|| panic!("table '{}' has no column '{name}'", self.name))
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = |(at, heading): (usize, &&str)| {
            let cells = self.rows.iter().map(|row| row[at].to_string());
            let widest = cells.map(|cell| cell.chars().count()).max();
            widest.unwrap_or(0).max(heading.chars().count())
        };
        let widths: Vec<usize> = self.columns.iter().enumerate().map(width).collect();
        writeln!(f, "{}", self.title)?;
        for (heading, &width) in self.columns.iter().zip(&widths) {
            write!(f, "  {heading:>width$}")?;
        }
        writeln!(f)?;
        for row in &self.rows {
            for (cell, &width) in row.iter().zip(&widths) {
                write!(f, "  {cell:>width$}")?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}

/// A plot of lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Part of the file name.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Lines.
    pub series: Vec<Series>,
}

/// An axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: &'static str,
    /// Whether it is divided by powers of ten, not evenly.
    pub is_log: bool,
}

/// An axis that is divided by powers of ten.
pub(crate) fn log(label: &'static str) -> Axis {
    let is_log = true;
    Axis { label, is_log }
}

/// An axis that is divided evenly.
pub(crate) fn linear(label: &'static str) -> Axis {
    let is_log = false;
    Axis { label, is_log }
}

/// A line of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Whether its points are shown without a line through them.
    pub dots: bool,
    /// Name in the legend.
    pub name: String,
    /// Points.
    pub points: Vec<(f64, f64)>,
}

impl Series {
    /// A line through points.
    pub fn line(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self {
            dots: false,
            name: name.into(),
            points,
        }
    }

    /// Points without a line.
    pub fn dots(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self {
            dots: true,
            ..Self::line(name, points)
        }
    }
}

/// Adds a point to the line of a name, which begins with it if there is none.
pub(crate) fn add_point(lines: &mut Vec<Series>, name: &str, point: (f64, f64)) {
    match lines.iter_mut().find(|line| line.name == name) {
        Some(line) => line.points.push(point),
        None => lines.push(Series::line(name, vec![point])),
    }
}

pub(crate) mod checks {
    use super::*;

    pub(crate) fn tables_line_up_and_keep_all_digits_in_csv() {
        let rows = vec![row!["a, b", 0.1 + 0.2], row!["c", Cell::Nothing]];
        let table = Table::new("t", "T", "method; error (1)", rows);
        assert_eq!(
            String::from_utf8(table.to_csv()).unwrap(),
            "method,error (1)\n\"a, b\",3.0000000000000004e-1\nc,\n"
        );
        let lines: Vec<String> = table.to_string().lines().map(str::to_owned).collect();
        assert_eq!(lines[1].len(), lines[2].len(), "{lines:?}");
        assert_eq!(lines[2], "    a, b      0.300");
    }

    pub(crate) fn numbers_keep_three_digits() {
        for (number, text) in [
            (0.0, "0"),
            (f64::NAN, "NaN"),
            (1.234e-7, "1.23e-7"),
            (0.001_234, "0.00123"),
            (0.0123, "0.0123"),
            (0.5, "0.500"),
            (12.34, "12.3"),
            (1234.4, "1234"),
            (-3.0, "-3.00"),
            (2.5e6, "2.50e6"),
        ] {
            assert_eq!(significant(number), text);
        }
    }
}
