//! Parts of space.

use crate::scene::Region;
use phyxel_text::{Checks, triple};

/// A part of space.
pub(super) fn region(checks: &mut Checks, path: &str, region: Region) {
    match region {
        Region::HalfSpace { point, normal } => {
            checks.finite(format_args!("{path}.point"), point);
            checks.direction(format_args!("{path}.normal"), normal);
        }
        Region::Box { min, max } => {
            checks.finite(format_args!("{path}.min"), min);
            checks.finite(format_args!("{path}.max"), max);
            checks.agree(
                min.cmple(max).all(),
                format_args!("{path}.max"),
                triple(max),
                format_args!(
                    "each of its numbers must be at least that of min, {}",
                    triple(min)
                ),
                &[&format!("{path}.min")],
            );
        }
        Region::Sphere { center, radius } => {
            checks.finite(format_args!("{path}.center"), center);
            checks.positive(format_args!("{path}.radius"), radius, " (m)");
        }
    }
}
