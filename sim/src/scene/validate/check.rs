//! The checks of single values, each with the path of the value and what it must be.

use std::fmt::Display;

use glam::DVec3;

use crate::scene::Body;
use crate::scene::path::Key;
use crate::scene::suggest::nearest;

/// The first value that is not as it must be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::scene) struct Fault {
    pub(in crate::scene) path: String,
    pub(in crate::scene) found: String,
    pub(in crate::scene) must: String,
}

pub(super) type Check = Result<(), Fault>;

pub(super) fn fault(path: impl Display, found: impl Display, must: impl Display) -> Fault {
    Fault {
        path: path.to_string(),
        found: found.to_string(),
        must: must.to_string(),
    }
}

pub(super) fn require(
    holds: bool,
    path: impl Display,
    found: impl Display,
    must: impl Display,
) -> Check {
    if holds {
        Ok(())
    } else {
        Err(fault(path, found, must))
    }
}

/// A point or direction as a scene writes it.
pub(super) fn triple(value: DVec3) -> String {
    format!("({}, {}, {})", value.x, value.y, value.z)
}

/// A finite number above zero.
pub(super) fn positive(path: impl Display, value: f64, hint: &str) -> Check {
    require(
        value.is_finite() && value > 0.0,
        path,
        value,
        format_args!("it must be finite and above 0{hint}"),
    )
}

/// A finite number of zero or more.
pub(super) fn not_negative(path: impl Display, value: f64, hint: &str) -> Check {
    require(
        value.is_finite() && value >= 0.0,
        path,
        value,
        format_args!("it must be finite and not below 0{hint}"),
    )
}

/// A colour (sRGB).
pub(super) fn color(path: &str, color: [f64; 3]) -> Check {
    for (index, value) in color.into_iter().enumerate() {
        require(
            (0.0..=1.0).contains(&value),
            format_args!("{path}[{index}]"),
            value,
            "colours are three numbers from 0 to 1",
        )?;
    }
    Ok(())
}

pub(super) fn finite(path: impl Display, value: DVec3) -> Check {
    require(
        value.is_finite(),
        path,
        triple(value),
        "each of its three numbers must be finite",
    )
}

pub(super) fn direction(path: impl Display, value: DVec3) -> Check {
    let length = value.length();
    require(
        length.is_finite() && length > 0.0,
        path,
        triple(value),
        "it must be finite and longer than 0",
    )
}

pub(super) fn body_name(path: &str, name: Option<&str>, bodies: &[Body]) -> Check {
    let Some(name) = name else { return Ok(()) };
    let names: Vec<&str> = bodies.iter().map(|body| body.name.as_str()).collect();
    let hint = nearest(name, names.iter().copied())
        .map_or_else(String::new, |name| format!(" (did you mean '{name}'?)"));
    require(
        names.contains(&name),
        path,
        format_args!("'{name}'"),
        format_args!(
            "no body has this name{hint}; bodies are {}",
            names.join(", ")
        ),
    )
}

pub(super) fn keys_in_order(path: &str, keys: &[Key], fewest: usize) -> Check {
    require(
        keys.len() >= fewest,
        path,
        format_args!("{} keys", keys.len()),
        format_args!("it needs {fewest} at least, such as (time: 0, position: (0, 0, 0))"),
    )?;
    for (index, key) in keys.iter().enumerate() {
        not_negative(
            format_args!("{path}[{index}].time"),
            key.time,
            " (s after settling)",
        )?;
        finite(format_args!("{path}[{index}].position"), key.position)?;
        finite(format_args!("{path}[{index}].rotation"), key.rotation)?;
    }
    for (index, pair) in keys.windows(2).enumerate() {
        require(
            pair[0].time < pair[1].time,
            format_args!("{path}[{}].time", index + 1),
            pair[1].time,
            format_args!(
                "it must be later than the key before, at {} s",
                pair[0].time
            ),
        )?;
    }
    Ok(())
}

pub(super) fn positive_components(path: &str, value: DVec3) -> Check {
    for (index, component) in value.to_array().into_iter().enumerate() {
        positive(format_args!("{path}[{index}]"), component, " (m)")?;
    }
    Ok(())
}
