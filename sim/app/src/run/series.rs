//! Rows over time, as CSV.

use serde::{Deserialize, Serialize};

use phyxel::World;

/// A table in the making, some 200 bytes a row.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Series {
    text: String,
    /// Number, at its rate, of the row that is due next.
    next: f64,
}

impl Series {
    /// With names of columns, a comma between two.
    pub(super) fn new(header: &str) -> Self {
        Self {
            text: format!("{header}\n"),
            next: 0.0,
        }
    }

    /// Whether a row is due at a time (s), at `rate` rows a second (1/s).
    pub(super) fn is_due(&self, time: f64, rate: f64) -> bool {
        // Steps may end at a row up to round-off.
        time * (1.0 + 1e-12) >= self.next / rate
    }

    /// The row that was due is written.
    pub(super) fn done(&mut self, time: f64, rate: f64) {
        self.next = (time * rate * (1.0 + 1e-12)).floor() + 1.0;
    }

    /// A row: times, names, numbers and more.
    pub(super) fn row(&mut self, world: &World, names: &[&str], numbers: &[f64], more: &[String]) {
        let scene_time = world.scene_time().map_or(String::new(), |t| t.to_string());
        let mut fields = vec![world.time().to_string(), scene_time];
        fields.extend(names.iter().map(|name| (*name).to_owned()));
        fields.extend(numbers.iter().map(|number| format!("{number:e}")));
        fields.extend_from_slice(more);
        self.text.push_str(&csv_row(&fields));
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }
}

/// A line of CSV (RFC 4180), its end included.
pub(crate) fn csv_row(fields: &[impl AsRef<[u8]>]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    // Writing into memory cannot fail, and what is valid UTF-8 stays so.
    let _ = writer.write_record(fields);
    String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
}
