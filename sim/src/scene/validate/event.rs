//! What acts on the bodies: supports, tools and cuts.

use super::check::{
    Check, body_name, direction, finite, keys_in_order, not_negative, positive,
    positive_components, require, triple,
};
use crate::scene::event::{Capture, Cut, Motion, Region, Support};
use crate::scene::tool::{Tool, ToolShape};
use crate::scene::{Body, Scene};

/// Most captures of one stroke.
const MOST_CAPTURES: f64 = 1e5;

/// A part of space.
pub(super) fn region(path: &str, region: Region) -> Check {
    match region {
        Region::HalfSpace { point, normal } => {
            finite(format_args!("{path}.point"), point)?;
            direction(format_args!("{path}.normal"), normal)
        }
        Region::Box { min, max } => {
            finite(format_args!("{path}.min"), min)?;
            finite(format_args!("{path}.max"), max)?;
            require(
                min.cmple(max).all(),
                format_args!("{path}.max"),
                triple(max),
                format_args!(
                    "each of its numbers must be at least that of min, {}",
                    triple(min)
                ),
            )
        }
        Region::Sphere { center, radius } => {
            finite(format_args!("{path}.center"), center)?;
            positive(format_args!("{path}.radius"), radius, " (m)")
        }
    }
}

pub(super) fn support(path: &str, support: &Support, bodies: &[Body]) -> Check {
    body_name(&format!("{path}.body"), support.body.as_deref(), bodies)?;
    region(&format!("{path}.region"), support.region)?;
    match &support.motion {
        Motion::Fixed => Ok(()),
        Motion::Driven { path: keys } => keys_in_order(&format!("{path}.motion.path"), keys, 1),
    }
}

pub(super) fn tool(path: &str, tool: &Tool, bodies: &[Body]) -> Check {
    body_name(&format!("{path}.body"), tool.body.as_deref(), bodies)?;
    match tool.shape {
        ToolShape::Sphere { radius } => {
            positive(format_args!("{path}.shape.radius"), radius, " (m)")?;
        }
        ToolShape::Plane { normal } => direction(format_args!("{path}.shape.normal"), normal)?,
        ToolShape::Capsule { from, to, radius } => {
            finite(format_args!("{path}.shape.from"), from)?;
            finite(format_args!("{path}.shape.to"), to)?;
            positive(format_args!("{path}.shape.radius"), radius, " (m)")?;
        }
        ToolShape::Box { size } => positive_components(&format!("{path}.shape.size"), size)?,
    }
    finite(format_args!("{path}.position"), tool.position)?;
    positive(
        format_args!("{path}.scale"),
        tool.scale,
        ", 1 for the size that the shape says",
    )?;
    let keys = format!("{path}.path");
    keys_in_order(&keys, &tool.path, 1)?;
    not_negative(format_args!("{path}.friction"), tool.friction, "")?;
    if let Some(penalty) = tool.penalty {
        positive(format_args!("{path}.penalty"), penalty, " (N/m^3)")?;
    }
    let Some(release) = &tool.release else {
        return Ok(());
    };
    let place = format!("{path}.release");
    positive(format_args!("{place}.mass"), release.mass, " (kg)")?;
    finite(format_args!("{place}.force"), release.force)?;
    not_negative(format_args!("{place}.damping"), release.damping, " (1/s)")?;
    require(
        tool.path.len() == 1,
        keys,
        format_args!("{} keys", tool.path.len()),
        "a tool that is released needs one key, the place where it is let go",
    )?;
    require(
        tool.body.is_some() || bodies.len() == 1,
        &place,
        format_args!("a tool that touches {} bodies", bodies.len()),
        format_args!("a released tool touches one body; name it in {path}.body"),
    )
}

pub(super) fn cut(path: &str, cut: &Cut, scene: &Scene) -> Check {
    body_name(&format!("{path}.body"), cut.body.as_deref(), &scene.bodies)?;
    let edge = format!("{path}.edge");
    require(
        cut.edge.len() >= 2,
        &edge,
        format_args!("{} points", cut.edge.len()),
        "a blade's edge needs two points at least",
    )?;
    for (index, &point) in cut.edge.iter().enumerate() {
        finite(format_args!("{edge}[{index}]"), point)?;
    }
    for (index, pair) in cut.edge.windows(2).enumerate() {
        require(
            pair[0] != pair[1],
            format_args!("{edge}[{}]", index + 1),
            triple(pair[1]),
            "it equals the point before it",
        )?;
    }
    keys_in_order(&format!("{path}.path"), &cut.path, 2)?;
    let duration = scene.integration.duration;
    let last = cut.path.len() - 1;
    require(
        cut.path[last].time <= duration,
        format_args!("{path}.path[{last}].time"),
        cut.path[last].time,
        format_args!("the scene ends at integration.duration, {duration} s"),
    )?;
    let capture = format!("{path}.capture");
    match cut.capture {
        Capture::Rate(rate) => {
            require(
                rate.is_finite() && rate > 0.0,
                &capture,
                format_args!("Rate({rate:?})"),
                "it must be above 0 (1/s), such as 60",
            )?;
            let count = rate * (cut.path[last].time - cut.path[0].time);
            require(
                count <= MOST_CAPTURES,
                &capture,
                format_args!("Rate({rate:?})"),
                format_args!("it makes {count:.2e} captures; the limit is {MOST_CAPTURES:.0e}"),
            )?;
        }
        Capture::Distance(distance) => {
            require(
                distance.is_finite() && distance > 0.0,
                &capture,
                format_args!("Distance({distance:?})"),
                "it must be above 0 (m), such as 0.002",
            )?;
            let count = cut.way() / distance;
            require(
                count <= MOST_CAPTURES,
                &capture,
                format_args!("Distance({distance:?})"),
                format_args!("it makes {count:.2e} captures; the limit is {MOST_CAPTURES:.0e}"),
            )?;
        }
    }
    if let Some(tolerance) = cut.weld_tolerance {
        not_negative(format_args!("{path}.weld_tolerance"), tolerance, " (m)")?;
    }
    Ok(())
}
