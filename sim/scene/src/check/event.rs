//! What acts on the bodies: supports, tools and cuts.

use super::file::rigid;
use super::shapes::{region, tool_shape};
use super::suggest::{DidYouMean, nearest};
use super::{Checks, triple};
use crate::{Body, Capture, Cut, Key, Scene, Support, SupportMotion, Tool};

pub(super) fn support(checks: &mut Checks, path: &str, support: &Support, bodies: &[Body]) {
    body_name(
        checks,
        &format!("{path}.body"),
        support.body.as_deref(),
        bodies,
    );
    region(checks, &format!("{path}.region"), &support.region);
    match &support.motion {
        SupportMotion::Fixed => {}
        SupportMotion::Driven { path: keys } => {
            keys_in_order(checks, &format!("{path}.motion.path"), keys, 1);
        }
    }
}

pub(super) fn tool(checks: &mut Checks, path: &str, tool: &Tool, bodies: &[Body]) {
    body_name(
        checks,
        &format!("{path}.body"),
        tool.body.as_deref(),
        bodies,
    );
    tool_shape(checks, &format!("{path}.shape"), &tool.shape);
    if let Some(looks) = &tool.looks {
        rigid(checks, &format!("{path}.looks"), looks);
    }
    checks.finite(format_args!("{path}.position"), tool.position);
    checks.positive(
        format_args!("{path}.scale"),
        tool.scale,
        ", 1 for the size that the shape says",
    );
    let keys = format!("{path}.path");
    keys_in_order(checks, &keys, &tool.path, 0);
    checks.not_negative(format_args!("{path}.friction"), tool.friction, "");
    if let Some(penalty) = tool.penalty {
        checks.positive(format_args!("{path}.penalty"), penalty, " (N/m^3)");
    }
    let Some(release) = &tool.release else {
        return;
    };
    let place = format!("{path}.release");
    checks.positive(format_args!("{place}.mass"), release.mass, " (kg)");
    checks.finite(format_args!("{place}.force"), release.force);
    checks.not_negative(format_args!("{place}.damping"), release.damping, " (1/s)");
    checks.require(
        tool.path.len() <= 1,
        keys,
        format_args!("{} keys", tool.path.len()),
        "a tool that is released has one key at most, the position where it is released",
    );
    checks.require(
        tool.body.is_some() || bodies.len() == 1,
        &place,
        format_args!("a tool that touches {} bodies", bodies.len()),
        format_args!("a released tool touches one body; name it in {path}.body"),
    );
}

pub(super) fn cut(checks: &mut Checks, path: &str, cut: &Cut, scene: &Scene) {
    body_name(
        checks,
        &format!("{path}.body"),
        cut.body.as_deref(),
        &scene.bodies,
    );
    let edge = format!("{path}.edge");
    checks.require(
        cut.edge.len() >= 2,
        &edge,
        format_args!("{} points", cut.edge.len()),
        "a blade's edge needs two points at least",
    );
    for (index, &point) in cut.edge.iter().enumerate() {
        checks.finite(format_args!("{edge}[{index}]"), point);
    }
    for (index, pair) in cut.edge.windows(2).enumerate() {
        checks.require(
            pair[0] != pair[1],
            format_args!("{edge}[{}]", index + 1),
            triple(pair[1]),
            "it equals the point before it",
        );
    }
    keys_in_order(checks, &format!("{path}.path"), &cut.path, 2);
    let duration = scene.integration.duration;
    let keys = &format!("{path}.path");
    let (first, last) = match cut.path.as_slice() {
        [first, .., last] => (first.time, last.time),
        _ => (0.0, 0.0), // too few, as has been reported
    };
    checks.require(
        // A scene that only settles has no time for any cut: a recording of one that was saved then.
        duration == 0.0 || last <= duration,
        format_args!("{keys}[{}].time", cut.path.len().saturating_sub(1)),
        last,
        format_args!("the scene ends at integration.duration, {duration} s"),
    );
    let capture = format!("{path}.capture");
    let (name, value, such_as, count) = match cut.capture {
        Capture::Rate(rate) => (
            "Rate",
            rate,
            "above 0 (1/s), such as 60",
            rate * (last - first),
        ),
        Capture::Distance(distance) => (
            "Distance",
            distance,
            "above 0 (m), such as 0.002",
            cut.way() / distance,
        ),
        // How many these make is known once the nodes are.
        Capture::Spacing(share) => ("Spacing", share, "above 0, such as 0.15", 0.0),
    };
    checks.require(
        value.is_finite() && value > 0.0,
        &capture,
        format_args!("{name}({value:?})"),
        format_args!("it must be {such_as}"),
    );
    checks.require(
        count <= Capture::MOST,
        &capture,
        format_args!("{name}({value:?})"),
        format_args!(
            "it makes {count:.2e} captures; the limit is {:.0e}",
            Capture::MOST
        ),
    );
    if let Some(tolerance) = cut.weld_tolerance {
        checks.not_negative(format_args!("{path}.weld_tolerance"), tolerance, " (m)");
    }
}

/// A body that is named must be there.
pub(super) fn body_name(checks: &mut Checks, path: &str, name: Option<&str>, bodies: &[Body]) {
    let Some(name) = name else { return };
    let names: Vec<&str> = bodies.iter().map(|body| body.name.as_str()).collect();
    if names.contains(&name) {
        return;
    }
    let hint = DidYouMean(nearest(name, names.iter().copied()));
    checks.require(
        false,
        path,
        format_args!("'{name}'"),
        format_args!(
            "no body has this name{hint}; bodies are {}",
            names.join(", ")
        ),
    );
}

/// Keys of a path, `fewest` at least, must be finite and follow each other.
pub(super) fn keys_in_order(checks: &mut Checks, path: &str, keys: &[Key], fewest: usize) {
    checks.require(
        keys.len() >= fewest,
        path,
        format_args!("{} keys", keys.len()),
        format_args!("it needs {fewest} at least, such as (time: 0, position: (0, 0, 0))"),
    );
    for (index, key) in keys.iter().enumerate() {
        let of = |name: &str| format!("{path}[{index}].{name}");
        checks.not_negative(of("time"), key.time, " (s after settling)");
        checks.finite(of("position"), key.position);
        checks.finite(of("rotation"), key.rotation);
    }
    for (index, pair) in keys.windows(2).enumerate() {
        checks.require(
            pair[0].time < pair[1].time,
            format_args!("{path}[{}].time", index + 1),
            pair[1].time,
            format_args!(
                "it must be later than the key before, at {} s",
                pair[0].time
            ),
        );
    }
}
