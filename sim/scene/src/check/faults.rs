//! The checks of single values, each with the path of the value and what it must be.

use std::fmt::Display;
use std::ops::RangeInclusive;

use glam::DVec3;

/// A value that is not as it must be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path} is {found}; {must}")]
pub struct Fault {
    /// Key path of the value.
    pub path: String,
    /// The value.
    pub found: String,
    /// What it must be, or what to do.
    pub must: String,
}

/// Numbers reach so far: their squares and cubes are numbers, too.
const LARGEST: f64 = 1e100;

/// Keeps the first fault that is found.
#[derive(Debug, Default)]
pub(super) struct Checks(Option<Fault>);

impl Checks {
    /// What the value at a key path must be.
    pub(super) fn require(
        &mut self,
        holds: bool,
        path: impl Display,
        found: impl Display,
        must: impl Display,
    ) {
        if !holds {
            self.0.get_or_insert_with(|| Fault {
                path: path.to_string(),
                found: found.to_string(),
                must: must.to_string(),
            });
        }
    }

    /// A number of a range.
    pub(super) fn within<T: PartialOrd + Display>(
        &mut self,
        path: impl Display,
        value: T,
        range: RangeInclusive<T>,
        must: impl Display,
    ) {
        self.require(range.contains(&value), path, value, must);
    }

    /// The first fault.
    pub(super) fn first(self) -> Result<(), Fault> {
        self.0.map_or(Ok(()), Err)
    }

    fn bounded(&mut self, path: impl Display, size: f64) {
        let found = format_args!("{size:e} in size");
        let must = format_args!("numbers reach to {LARGEST:e}");
        self.require(size <= LARGEST, path, found, must);
    }

    /// A finite number above zero.
    pub(super) fn positive(&mut self, path: impl Display, value: f64, hint: &str) {
        let must = format_args!("it must be finite and above 0{hint}");
        self.require(value.is_finite() && value > 0.0, &path, value, must);
        self.bounded(path, value);
    }

    /// A finite number of zero or more.
    pub(super) fn not_negative(&mut self, path: impl Display, value: f64, hint: &str) {
        let must = format_args!("it must be finite and not below 0{hint}");
        self.require(value.is_finite() && value >= 0.0, &path, value, must);
        self.bounded(path, value);
    }

    /// A colour (sRGB).
    pub(super) fn color(&mut self, path: &str, color: [f64; 3]) {
        let must = "colours are three numbers from 0 to 1";
        for (index, value) in color.into_iter().enumerate() {
            self.within(format_args!("{path}[{index}]"), value, 0.0..=1.0, must);
        }
    }

    /// A direction of any length above zero.
    pub(super) fn direction(&mut self, path: impl Display, value: DVec3) {
        let (fits, must) = (value.length() > 0.0, "it must be finite and longer than 0");
        self.require(value.is_finite() && fits, &path, triple(value), must);
        self.bounded(path, value.abs().max_element());
    }

    /// Three lengths above zero (m).
    pub(super) fn lengths(&mut self, path: &str, value: DVec3) {
        for (index, length) in value.to_array().into_iter().enumerate() {
            self.positive(format_args!("{path}[{index}]"), length, " (m)");
        }
    }

    /// A point or vector of finite numbers.
    pub(super) fn finite(&mut self, path: impl Display, value: DVec3) {
        let must = "each of its three numbers must be finite";
        self.require(value.is_finite(), &path, triple(value), must);
        self.bounded(path, value.abs().max_element());
    }
}

/// A point or direction as a text has it.
pub(super) fn triple(value: DVec3) -> String {
    let [x, y, z] = value.to_array().map(|x| match x.abs() {
        ..1e16 => x.to_string(),
        _ => format!("{x:e}"),
    });
    format!("({x}, {y}, {z})")
}
