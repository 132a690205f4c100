//! Materials and their parts.

use super::check::{Check, direction, not_negative, positive, require};
use super::event::region;
use crate::scene::body::Body;
use crate::scene::material::{Dilatation, Fiber, Material, Model};

/// Most terms of a Prony series.
const MOST_TERMS: usize = phyxel_elastic::MAX_PRONY_TERMS;

/// A body's material and its inclusions.
pub(super) fn of(path: &str, body: &Body) -> Check {
    material(&format!("{path}.material"), &body.material)?;
    for (index, part) in body.inclusions.iter().enumerate() {
        let path = format!("{path}.inclusions[{index}]");
        region(&format!("{path}.region"), part.region)?;
        moduli(&path, &body.material.within(part))?;
        if let Some(fibers) = &part.fiber {
            fiber(&format!("{path}.fiber"), fibers)?;
        }
    }
    Ok(())
}

fn material(path: &str, material: &Material) -> Check {
    moduli(path, material)?;
    not_negative(
        format_args!("{path}.volume_constant"),
        material.volume_constant,
        " (Pa)",
    )?;
    if let Some(fibers) = &material.fiber {
        fiber(&format!("{path}.fiber"), fibers)?;
    }
    require(
        material.viscosity.len() <= MOST_TERMS,
        format_args!("{path}.viscosity"),
        format_args!("a list of {} terms", material.viscosity.len()),
        format_args!("it may have {MOST_TERMS} terms"),
    )?;
    for (index, term) in material.viscosity.iter().enumerate() {
        let path = format!("{path}.viscosity[{index}]");
        not_negative(
            format_args!("{path}.ratio"),
            term.ratio,
            ", such as 0.5 for half the long-term stiffness more",
        )?;
        positive(format_args!("{path}.time"), term.time, " (s)")?;
    }
    require(
        material.dilatation == Dilatation::Local || material.model != Model::SaintVenantKirchhoff,
        format_args!("{path}.dilatation"),
        "Mean",
        "the model SaintVenantKirchhoff has no part of its own for changes of volume; take Local or \
         another model",
    )?;
    not_negative(
        format_args!("{path}.stabilization"),
        material.stabilization,
        ", 0.1 is the measured choice",
    )
}

/// What inclusions may have of their own.
fn moduli(path: &str, material: &Material) -> Check {
    positive(
        format_args!("{path}.youngs_modulus"),
        material.youngs_modulus,
        " (Pa), such as 5e3 for liver",
    )?;
    let ratio = material.poissons_ratio;
    require(
        ratio > -1.0 && ratio < 0.5,
        format_args!("{path}.poissons_ratio"),
        ratio,
        "it must be above -1 and below 0.5, such as 0.45 for soft tissue",
    )?;
    positive(
        format_args!("{path}.density"),
        material.density,
        " (kg/m^3), such as 1060 for soft tissue",
    )?;
    let Model::MooneyRivlin { share } = material.model else {
        return Ok(());
    };
    // lambda >= 4 c01 keeps the energy's minimum at rest.
    let most = (ratio / (1.0 - 2.0 * ratio)).clamp(0.0, 1.0);
    require(
        (0.0..=most).contains(&share),
        format_args!("{path}.model.share"),
        share,
        format_args!("it must be from 0 to {most:.3}, the most for a Poisson's ratio of {ratio}"),
    )
}

fn fiber(path: &str, fiber: &Fiber) -> Check {
    direction(format_args!("{path}.direction"), fiber.direction)?;
    not_negative(format_args!("{path}.stiffness"), fiber.stiffness, " (Pa)")?;
    positive(format_args!("{path}.exponent"), fiber.exponent, "")?;
    require(
        (0.0..=1.0 / 3.0).contains(&fiber.dispersion),
        format_args!("{path}.dispersion"),
        fiber.dispersion,
        "it must be from 0 (all parallel) to 1/3 (every direction alike)",
    )
}
