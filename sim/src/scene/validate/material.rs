//! Materials and their parts.

use super::region::region;
use crate::scene::body::Body;
use crate::scene::{Dilatation, Fiber, MaterialSettings, Model};
use phyxel_text::Checks;

/// Most terms of a Prony series.
const MOST_TERMS: usize = phyxel_elastic::MAX_PRONY_TERMS;

/// A body's material and its inclusions.
pub(super) fn of(checks: &mut Checks, path: &str, body: &Body) {
    material(checks, &format!("{path}.material"), &body.material);
    for (index, part) in body.inclusions.iter().enumerate() {
        let path = format!("{path}.inclusions[{index}]");
        region(checks, &format!("{path}.region"), part.region);
        let given = [part.youngs_modulus, part.poissons_ratio, part.density];
        let given = given.map(|value| value.is_some());
        moduli(checks, &path, &part.within(&body.material), given);
        if let Some(fibers) = &part.fiber {
            fiber(checks, &format!("{path}.fiber"), fibers);
        }
    }
}

fn material(checks: &mut Checks, path: &str, material: &MaterialSettings) {
    moduli(checks, path, material, [true; 3]);
    checks.not_negative(
        format_args!("{path}.volume_constant"),
        material.volume_constant,
        " (Pa)",
    );
    if let Some(fibers) = &material.fiber {
        fiber(checks, &format!("{path}.fiber"), fibers);
    }
    checks.require(
        material.viscosity.len() <= MOST_TERMS,
        format_args!("{path}.viscosity"),
        format_args!("a list of {} terms", material.viscosity.len()),
        format_args!("it may have {MOST_TERMS} terms"),
    );
    for (index, term) in material.viscosity.iter().enumerate() {
        let path = format!("{path}.viscosity[{index}]");
        checks.not_negative(
            format_args!("{path}.ratio"),
            term.ratio,
            ", such as 0.5 for half the long-term stiffness more",
        );
        checks.positive(format_args!("{path}.time"), term.relaxation_time, " (s)");
    }
    checks.agree(
        material.dilatation == Dilatation::Local || material.model != Model::SaintVenantKirchhoff,
        format_args!("{path}.dilatation"),
        "Mean",
        "the model SaintVenantKirchhoff has no part of its own for changes of volume; take Local or \
         another model",
        &[&format!("{path}.model")],
    );
    checks.not_negative(
        format_args!("{path}.stabilization"),
        material.stabilization,
        ", 0.1 is the measured choice",
    );
}

/// What inclusions may have of their own; what is not `given` there is the body's, and told of there.
fn moduli(checks: &mut Checks, path: &str, material: &MaterialSettings, given: [bool; 3]) {
    let [modulus_given, ratio_given, density_given] = given;
    if modulus_given {
        checks.positive(
            format_args!("{path}.youngs_modulus"),
            material.youngs_modulus,
            " (Pa), such as 5e3 for liver",
        );
    }
    if density_given {
        checks.positive(
            format_args!("{path}.density"),
            material.density,
            " (kg/m^3), such as 1060 for soft tissue",
        );
    }
    if !ratio_given {
        return;
    }
    let ratio = material.poissons_ratio;
    checks.require(
        ratio > -1.0 && ratio < 0.5,
        format_args!("{path}.poissons_ratio"),
        ratio,
        "it must be above -1 and below 0.5, such as 0.45 for soft tissue",
    );
    let Model::MooneyRivlin { share } = material.model else {
        return;
    };
    // lambda >= 4 c01 keeps the energy's minimum at rest.
    let most = (ratio / (1.0 - 2.0 * ratio)).clamp(0.0, 1.0);
    checks.agree(
        (0.0..=most).contains(&share),
        format_args!("{path}.model.share"),
        share,
        format_args!("it must be from 0 to {most:.3}, the most for a Poisson's ratio of {ratio}"),
        &[&format!("{path}.poissons_ratio")],
    );
}

fn fiber(checks: &mut Checks, path: &str, fiber: &Fiber) {
    checks.direction(format_args!("{path}.direction"), fiber.direction);
    checks.not_negative(format_args!("{path}.stiffness"), fiber.stiffness, " (Pa)");
    checks.positive(format_args!("{path}.exponent"), fiber.exponent, "");
    checks.require(
        (0.0..=1.0 / 3.0).contains(&fiber.dispersion),
        format_args!("{path}.dispersion"),
        fiber.dispersion,
        "it must be from 0 (all parallel) to 1/3 (every direction alike)",
    );
}
