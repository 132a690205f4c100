//! Settings that are out of their bounds.

use std::fmt::Display;

use glam::DVec3;

/// A field of settings that is not as it must be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field} is {found}; {must}")]
#[non_exhaustive]
pub struct BadSetting {
    /// Path of the field from its settings on, such as `fiber.exponent`.
    pub field: String,
    /// Its value.
    pub found: String,
    /// What it must be, or what to do.
    pub must: String,
    /// Fields that it does not go with; none where its value alone is out of bounds.
    pub with: &'static [&'static str],
}

/// What was found so far.
#[derive(Default)]
pub(crate) struct SettingChecks(pub(crate) Vec<BadSetting>);

impl SettingChecks {
    /// Field, value, whether it is as it must be, and what that is.
    pub(crate) fn require(
        &mut self,
        field: impl Display,
        found: impl Display,
        holds: bool,
        must: impl Display,
        with: &'static [&'static str],
    ) {
        if !holds {
            self.0.push(BadSetting {
                field: field.to_string(),
                found: found.to_string(),
                must: must.to_string(),
                with,
            });
        }
    }

    pub(crate) fn positive(&mut self, field: impl Display, value: f64, hint: &str) {
        let must = format_args!("it must be finite and above 0{hint}");
        self.require(field, value, value.is_finite() && value > 0.0, must, &[]);
    }

    pub(crate) fn not_negative(&mut self, field: impl Display, value: f64, hint: &str) {
        let must = format_args!("it must be finite and not below 0{hint}");
        self.require(field, value, value.is_finite() && value >= 0.0, must, &[]);
    }

    pub(crate) fn direction(&mut self, field: impl Display, value: DVec3) {
        let holds = value.is_finite() && value.length() > 0.0;
        let must = "it must be finite and longer than 0";
        let found = format_args!("({}, {}, {})", value.x, value.y, value.z);
        self.require(field, found, holds, must, &[]);
    }
}
