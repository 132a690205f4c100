//! How nodes are coupled.

use super::Checks;
use crate::{Body, Dilatation, Method};

/// Neighbours that a gradient in space needs at least.
const FEWEST_NEIGHBORS: u32 = 4;
/// Most neighbours of a node.
const MOST_NEIGHBORS: u32 = 1000;

pub(super) fn method(checks: &mut Checks, path: &str, body: &Body) {
    let Method::Dissertation {
        nearest,
        support_scale,
        neighbor_limit,
    } = body.method
    else {
        return;
    };
    let place = format!("{path}.method");
    for (name, count) in [
        ("nearest", Some(nearest)),
        ("neighbor_limit", neighbor_limit),
    ] {
        let Some(count) = count else { continue };
        checks.require(
            (FEWEST_NEIGHBORS..=MOST_NEIGHBORS).contains(&count),
            format_args!("{place}.{name}"),
            count,
            format_args!("it must be from {FEWEST_NEIGHBORS} to {MOST_NEIGHBORS}"),
        );
    }
    checks.require(
        (0.5..=10.0).contains(&support_scale),
        format_args!("{place}.support_scale"),
        support_scale,
        "it must be from 0.5 to 10, such as 1.5",
    );
    let material = &body.material;
    checks.require(
        material.stabilization == 0.0,
        format_args!("{path}.material.stabilization"),
        material.stabilization,
        "the method Dissertation has no hourglass stabilization; set it to 0",
    );
    checks.require(
        material.dilatation == Dilatation::Local,
        format_args!("{path}.material.dilatation"),
        "Mean",
        "the method Dissertation has Local only",
    );
}
