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

/// Keeps the first fault that is found. Key paths start at the group that is checked.
#[derive(Debug, Default)]
pub struct Checks {
    group: String,
    fault: Option<Fault>,
}

impl Checks {
    /// Checks the group of values at a key path.
    pub fn group(&mut self, path: impl Display, check: impl FnOnce(&mut Self)) {
        let length = self.group.len();
        self.group = self.path(path);
        check(self);
        self.group.truncate(length);
    }

    /// Checks each entry of a list.
    pub fn each<T>(&mut self, path: &str, all: &[T], mut check: impl FnMut(&mut Self, &T)) {
        for (index, one) in all.iter().enumerate() {
            self.group(format_args!("{path}[{index}]"), |checks| check(checks, one));
        }
    }

    /// The key path from the top of a key of the group; that of the group where the key is empty.
    #[must_use]
    pub fn path(&self, key: impl Display) -> String {
        let path = format!("{}.{key}", self.group);
        path.trim_matches('.').to_owned()
    }

    /// What the value at a key path must be.
    pub fn require(
        &mut self,
        holds: bool,
        path: impl Display,
        found: impl Display,
        must: impl Display,
    ) {
        if !holds && self.fault.is_none() {
            self.fault = Some(Fault {
                path: self.path(path),
                found: found.to_string(),
                must: must.to_string(),
            });
        }
    }

    /// A number of a range.
    pub(super) fn within<T: PartialOrd + Display>(
        &mut self,
        path: &str,
        value: T,
        range: RangeInclusive<T>,
        must: impl Display,
    ) {
        self.require(range.contains(&value), path, value, must);
    }

    /// Nothing where all is as it must be.
    ///
    /// # Errors
    /// The first fault.
    pub fn first(self) -> Result<(), Fault> {
        self.fault.map_or(Ok(()), Err)
    }

    fn bounded(&mut self, path: &str, size: f64) {
        let found = format_args!("{size:e} in size");
        let must = format_args!("numbers reach to {LARGEST:e}");
        self.require(size <= LARGEST, path, found, must);
    }

    /// A finite number above zero, if one is given.
    pub(super) fn positive(&mut self, path: &str, value: impl Into<Option<f64>>, hint: &str) {
        let Some(value) = value.into() else { return };
        let must = format_args!("it must be finite and above 0{hint}");
        self.require(value.is_finite() && value > 0.0, path, value, must);
        self.bounded(path, value);
    }

    /// A finite number of zero or more, if one is given.
    pub(super) fn not_negative(&mut self, path: &str, value: impl Into<Option<f64>>, hint: &str) {
        let Some(value) = value.into() else { return };
        let must = format_args!("it must be finite and not below 0{hint}");
        self.require(value.is_finite() && value >= 0.0, path, value, must);
        self.bounded(path, value);
    }

    /// A number above zero that a choice holds.
    pub(super) fn above_zero(&mut self, path: &str, choice: &str, value: f64, such_as: &str) {
        let found = format_args!("{choice}({value:?})");
        let must = format_args!("it must be above 0{such_as}");
        self.require(value.is_finite() && value > 0.0, path, found, must);
    }

    /// A colour (sRGB).
    pub(super) fn color(&mut self, path: &str, color: [f64; 3]) {
        let must = "colours are three numbers from 0 to 1";
        self.each(path, &color, |checks, &value| {
            checks.within("", value, 0.0..=1.0, must);
        });
    }

    /// A direction of any length above zero.
    pub(super) fn direction(&mut self, path: &str, value: DVec3) {
        let (fits, must) = (value.length() > 0.0, "it must be finite and longer than 0");
        self.require(value.is_finite() && fits, path, triple(value), must);
        self.bounded(path, value.abs().max_element());
    }

    /// Three lengths above zero (m).
    pub(super) fn lengths(&mut self, path: &str, value: DVec3) {
        self.each(path, &value.to_array(), |checks, &length| {
            checks.positive("", length, " (m)");
        });
    }

    /// A point or vector of finite numbers.
    pub(super) fn finite(&mut self, path: &str, value: DVec3) {
        let must = "each of its three numbers must be finite";
        self.require(value.is_finite(), path, triple(value), must);
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
