//! Materials and their parts.

use super::Checks;
use super::shapes::region;
use crate::Body;

/// A body's material and its inclusions.
pub(super) fn of(checks: &mut Checks, path: &str, body: &Body) {
    tell!(checks, &format!("{path}.material"), body.material.check());
    for (index, part) in body.inclusions.iter().enumerate() {
        let path = format!("{path}.inclusions[{index}]");
        region(checks, &format!("{path}.region"), &part.region);
        let mut bad = part.within(&body.material).check();
        // What is not given here is the body's, and reported there.
        bad.retain(|bad| match bad.field.as_str() {
            "youngs_modulus" => part.youngs_modulus.is_some(),
            "density" => part.density.is_some(),
            "poissons_ratio" | "model.share" => part.poissons_ratio.is_some(),
            field => part.fiber.is_some() && field.starts_with("fiber."),
        });
        tell!(checks, &path, bad);
    }
}
