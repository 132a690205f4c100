//! The checks of single values, each with the path of the value and what it must be.

use std::fmt::Display;

use glam::DVec3;

use crate::error::{Place, TextError};

/// A value that is not as it must be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Key path of the value.
    pub path: String,
    /// The value.
    pub found: String,
    /// What it must be, or what to do.
    pub must: String,
    /// Key paths of the other values that it is so with; none where the value alone says so.
    pub with: Vec<String>,
}

impl Fault {
    /// The error that it is at a place.
    #[must_use]
    pub fn at(self, place: Place) -> TextError {
        TextError::Value {
            place,
            path: self.path,
            found: self.found,
            must: self.must,
        }
    }
}

/// Most faults that are gathered: nobody reads more, and a list of a million values may be all wrong.
const MOST_FAULTS: usize = 1000;

/// What has been found so far.
#[derive(Debug, Default)]
pub struct Checks {
    faults: Vec<Fault>,
}

impl Checks {
    /// What a value must be by itself.
    pub fn require(
        &mut self,
        holds: bool,
        path: impl Display,
        found: impl Display,
        must: impl Display,
    ) {
        self.agree(holds, path, found, must, &[]);
    }

    /// How a value must go with those at the paths `with`.
    pub fn agree(
        &mut self,
        holds: bool,
        path: impl Display,
        found: impl Display,
        must: impl Display,
        with: &[&str],
    ) {
        if !holds && self.faults.len() < MOST_FAULTS {
            self.faults.push(Fault {
                path: path.to_string(),
                found: found.to_string(),
                must: must.to_string(),
                with: with.iter().map(|&path| path.to_owned()).collect(),
            });
        }
    }

    /// What a group of settings at the key path `place` finds at fault in itself: `path` and those in `with` run
    /// from the group on; an empty one is the group.
    pub fn within(&mut self, place: &str, path: &str, found: String, must: String, with: &[&str]) {
        let at = |path: &str| match path {
            "" => place.to_owned(),
            path => format!("{place}.{path}"),
        };
        let with: Vec<String> = with.iter().map(|path| at(path)).collect();
        let with: Vec<&str> = with.iter().map(String::as_str).collect();
        self.agree(false, at(path), found, must, &with);
    }

    /// All but what is told of another value already: each value is told of once, and none is compared with
    /// one that is at fault or among the `misread`.
    #[must_use]
    pub fn told(self, misread: &[String]) -> Vec<Fault> {
        let (own, compared): (Vec<_>, Vec<_>) = self
            .faults
            .into_iter()
            .partition(|fault| fault.with.is_empty());
        let mut told: Vec<Fault> = Vec::new();
        for fault in own.into_iter().chain(compared) {
            let taken = misread
                .iter()
                .any(|path| lies_in(&fault.path, path) || lies_in(path, &fault.path));
            let known = told.iter().any(|other| other.path == fault.path);
            let unsure = |with: &String| {
                let mut others = told.iter().map(|other| &other.path).chain(misread);
                others.any(|other| lies_in(with, other) || lies_in(other, with))
            };
            if !taken && !known && !fault.with.iter().any(unsure) {
                told.push(fault);
            }
        }
        told
    }

    /// A finite number above zero.
    pub fn positive(&mut self, path: impl Display, value: f64, hint: &str) {
        self.require(
            value.is_finite() && value > 0.0,
            path,
            value,
            format_args!("it must be finite and above 0{hint}"),
        );
    }

    /// A finite number of zero or more.
    pub fn not_negative(&mut self, path: impl Display, value: f64, hint: &str) {
        self.require(
            value.is_finite() && value >= 0.0,
            path,
            value,
            format_args!("it must be finite and not below 0{hint}"),
        );
    }

    /// A colour (sRGB).
    pub fn color(&mut self, path: &str, color: [f64; 3]) {
        for (index, value) in color.into_iter().enumerate() {
            self.require(
                (0.0..=1.0).contains(&value),
                format_args!("{path}[{index}]"),
                value,
                "colours are three numbers from 0 to 1",
            );
        }
    }

    /// A point or vector of finite numbers.
    pub fn finite(&mut self, path: impl Display, value: DVec3) {
        self.require(
            value.is_finite(),
            path,
            triple(value),
            "each of its three numbers must be finite",
        );
    }
}

/// A point or direction as a text has it.
#[must_use]
pub fn triple(value: DVec3) -> String {
    format!("({}, {}, {})", value.x, value.y, value.z)
}

/// Whether the value at `path` is the one at `group` or a part of it.
fn lies_in(path: &str, group: &str) -> bool {
    path.strip_prefix(group)
        .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
}
