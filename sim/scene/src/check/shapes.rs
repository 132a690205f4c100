//! Shapes of bodies and tools, and parts of space.

use super::file::{UNIT, existing_file};
use super::{Checks, triple};
use crate::{Refinement, Region, Shape, ToolShape};

pub(super) fn shape(checks: &mut Checks, shape: &Shape) {
    match shape {
        Shape::Liver { width } => {
            checks.positive("width", *width, " (m), such as 0.166 for 1.2 litres");
        }
        Shape::Box { size } => checks.lengths("size", *size),
        Shape::Ellipsoid { radii } => checks.lengths("radii", *radii),
        Shape::Capsule { from, to, radius } => {
            checks.finite("from", *from);
            checks.finite("to", *to);
            checks.positive("radius", *radius, " (m)");
        }
        Shape::Tube {
            from,
            to,
            inner_radius,
            outer_radius,
        } => {
            checks.finite("from", *from);
            checks.finite("to", *to);
            let must = "it must differ from 'from', the other end of the axis";
            checks.require(from != to, "to", triple(*to), must);
            checks.positive("inner_radius", *inner_radius, " (m)");
            let fits = outer_radius.is_finite() && outer_radius > inner_radius;
            let must = format_args!("it must be above the inner radius, {inner_radius} m");
            checks.require(fits, "outer_radius", outer_radius, must);
        }
        Shape::Mesh {
            file,
            scale,
            largest_hole,
            ..
        } => {
            checks.positive("scale", *scale, UNIT);
            let hint = " (a fraction of the box's diagonal)";
            checks.not_negative("largest_hole", *largest_hole, hint);
            existing_file(checks, file, "a mesh file");
        }
    }
}

pub(super) fn refinement(checks: &mut Checks, refined: &Refinement) {
    checks.finite("from", refined.from);
    checks.finite("to", refined.to);
    checks.not_negative("radius", refined.radius, " (m)");
    let must = "it must be from 1/32 to 1, such as 0.5 for half the distance";
    checks.within("factor", refined.factor, 1.0 / 32.0..=1.0, must);
}

pub(super) fn tool_shape(checks: &mut Checks, shape: &ToolShape) {
    match *shape {
        ToolShape::Sphere { radius } => checks.positive("radius", radius, " (m)"),
        ToolShape::Plane { normal } => checks.direction("normal", normal),
        ToolShape::Capsule { from, to, radius } => {
            checks.finite("from", from);
            checks.finite("to", to);
            checks.positive("radius", radius, " (m)");
        }
        ToolShape::Box { size } => checks.lengths("size", size),
    }
}

pub(super) fn region(checks: &mut Checks, region: &Region) {
    match *region {
        Region::HalfSpace { point, normal } => {
            checks.finite("point", point);
            checks.direction("normal", normal);
        }
        Region::Box { min, max } => {
            checks.finite("min", min);
            checks.finite("max", max);
            let (fits, low) = (min.cmple(max).all(), triple(min));
            let must = format_args!("each of its numbers must be at least that of min, {low}");
            checks.require(fits, "max", triple(max), must);
        }
        Region::Sphere { center, radius } => {
            checks.finite("center", center);
            checks.positive("radius", radius, " (m)");
        }
    }
}
