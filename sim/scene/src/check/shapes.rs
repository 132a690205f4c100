//! Shapes of bodies and tools, and parts of space.

use super::file::{existing_file, scale};
use super::{Checks, triple};
use crate::{Refinement, Region, Shape, ToolShape};

pub(super) fn shape(checks: &mut Checks, path: &str, shape: &Shape) {
    let of = |field: &str| format!("{path}.{field}");
    match shape {
        Shape::Liver { width } => {
            checks.positive(of("width"), *width, " (m), such as 0.166 for 1.2 litres");
        }
        Shape::Box { size } => checks.lengths(&of("size"), *size),
        Shape::Ellipsoid { radii } => checks.lengths(&of("radii"), *radii),
        Shape::Capsule { from, to, radius } => {
            checks.finite(of("from"), *from);
            checks.finite(of("to"), *to);
            checks.positive(of("radius"), *radius, " (m)");
        }
        Shape::Tube {
            from,
            to,
            inner_radius,
            outer_radius,
        } => {
            checks.finite(of("from"), *from);
            checks.finite(of("to"), *to);
            let must = "it must differ from 'from', the other end of the axis";
            checks.require(from != to, of("to"), triple(*to), must);
            checks.positive(of("inner_radius"), *inner_radius, " (m)");
            let fits = outer_radius.is_finite() && outer_radius > inner_radius;
            let must = format_args!("it must be above the inner radius, {inner_radius} m");
            checks.require(fits, of("outer_radius"), outer_radius, must);
        }
        Shape::Mesh {
            file,
            scale: unit,
            largest_hole,
            ..
        } => {
            scale(checks, &of("scale"), *unit);
            let hint = " (a fraction of the box's diagonal)";
            checks.not_negative(of("largest_hole"), *largest_hole, hint);
            existing_file(checks, &of("file"), file, "a mesh file");
        }
    }
}

pub(super) fn refinement(checks: &mut Checks, path: &str, refined: &Refinement) {
    let of = |field: &str| format!("{path}.{field}");
    checks.finite(of("from"), refined.from);
    checks.finite(of("to"), refined.to);
    checks.not_negative(of("radius"), refined.radius, " (m)");
    let must = "it must be from 1/32 to 1, such as 0.5 for half the distance";
    checks.within(of("factor"), refined.factor, 1.0 / 32.0..=1.0, must);
}

pub(super) fn tool_shape(checks: &mut Checks, path: &str, shape: &ToolShape) {
    let of = |field: &str| format!("{path}.{field}");
    match *shape {
        ToolShape::Sphere { radius } => checks.positive(of("radius"), radius, " (m)"),
        ToolShape::Plane { normal } => checks.direction(of("normal"), normal),
        ToolShape::Capsule { from, to, radius } => {
            checks.finite(of("from"), from);
            checks.finite(of("to"), to);
            checks.positive(of("radius"), radius, " (m)");
        }
        ToolShape::Box { size } => checks.lengths(&of("size"), size),
    }
}

pub(super) fn region(checks: &mut Checks, path: &str, region: &Region) {
    let of = |field: &str| format!("{path}.{field}");
    match *region {
        Region::HalfSpace { point, normal } => {
            checks.finite(of("point"), point);
            checks.direction(of("normal"), normal);
        }
        Region::Box { min, max } => {
            checks.finite(of("min"), min);
            checks.finite(of("max"), max);
            let (fits, low) = (min.cmple(max).all(), triple(min));
            let must = format_args!("each of its numbers must be at least that of min, {low}");
            checks.require(fits, of("max"), triple(max), must);
        }
        Region::Sphere { center, radius } => {
            checks.finite(of("center"), center);
            checks.positive(of("radius"), radius, " (m)");
        }
    }
}
