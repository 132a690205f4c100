//! Bodies: shape, sampling, motion and looks.

use glam::DVec3;

use super::Checks;
use super::file::{existing_file, scale};
use super::shapes::{refinement, region, shape};
use crate::{
    Body, CutRule, Dilatation, Form, Method, RadiusRule, Shape, SurfelSettings, SurfelSpacing,
    SurfelTarget, Target,
};

pub(super) fn body(checks: &mut Checks, path: &str, body: &Body) {
    shape(checks, &format!("{path}.shape"), &body.shape);
    checks.finite(format_args!("{path}.position"), body.position);
    checks.finite(format_args!("{path}.rotation"), body.rotation);
    checks.positive(
        format_args!("{path}.scale"),
        body.scale,
        ", 1 for the size that the shape says",
    );
    sampling(checks, path, body);
    material(checks, path, body);
    method(checks, path, body);
    cut_rule(checks, &format!("{path}.cut_rule"), body.cut_rule);
    checks.require(
        (0.0..=1.0).contains(&body.damping_ratio),
        format_args!("{path}.damping_ratio"),
        body.damping_ratio,
        "it must lie between 0 (none) and 1 (critical damping of the stiffest mode)",
    );
    checks.require(
        (0.0..=0.1).contains(&body.moved_mass),
        format_args!("{path}.moved_mass"),
        body.moved_mass,
        "it must lie between 0 (none) and 0.1 (a tenth of the mass); 0.003 lengthens steps by a third",
    );
    checks.finite(format_args!("{path}.velocity"), body.velocity);
    checks.not_negative(format_args!("{path}.damping"), body.damping, " (1/s)");
    surfels(
        checks,
        &format!("{path}.surfels"),
        &body.surfels,
        &body.shape,
    );
}

fn sampling(checks: &mut Checks, of: &str, body: &Body) {
    let path = &format!("{of}.sampling");
    let sampling = &body.sampling;
    const FEWEST_NODES: u32 = 4;
    let limit = sampling.limit;
    checks.require(
        limit >= FEWEST_NODES,
        format_args!("{path}.limit"),
        limit,
        format_args!("a body needs {FEWEST_NODES} nodes at least"),
    );
    checks.require(
        (1.0..=32.0).contains(&sampling.coarsest),
        format_args!("{path}.coarsest"),
        sampling.coarsest,
        "it must be from 1 (the same everywhere) to 32",
    );
    for (index, refined) in sampling.refine.iter().enumerate() {
        refinement(checks, &format!("{path}.refine[{index}]"), refined);
    }
    let target = format!("{path}.target");
    match sampling.target {
        Target::Nodes(count) => checks.require(
            (FEWEST_NODES..=limit).contains(&count),
            target,
            format_args!("Nodes({count})"),
            format_args!(
                "it must be from {FEWEST_NODES} to {limit} nodes; for more raise {path}.limit"
            ),
        ),
        Target::Lattice(x, y, z) => {
            let found = format!("Lattice({x}, {y}, {z})");
            let plain = sampling.form == Form::Tetrahedra
                && sampling.coarsest <= 1.0
                && sampling.refine.is_empty();
            checks.require(
                plain && matches!(body.shape, Shape::Box { .. }) && body.rotation == DVec3::ZERO,
                &target,
                &found,
                "a lattice is of a Box that is not turned, of form Tetrahedra, with coarsest 1 and nothing to refine");
            let nodes: f64 = [x, y, z].into_iter().map(f64::from).product();
            checks.require(
                x.min(y).min(z) >= 2 && nodes <= f64::from(limit),
                target,
                found,
                format_args!(
                    "it must have 2 nodes or more along each axis, and {limit} at most in all; for more raise \
                     {path}.limit"
                ));
        }
        Target::Spacing(spacing) => {
            checks.require(
                spacing.is_finite() && spacing > 0.0,
                &target,
                format_args!("Spacing({spacing:?})"),
                "it must be above 0 (m), such as 0.006 for an organ",
            );
            let Some(volume) = body.rough_volume() else {
                return;
            };
            let nodes = volume / (spacing * spacing * spacing);
            let wider = 1.05 * (volume / f64::from(limit)).cbrt();
            checks.require(
                nodes <= f64::from(limit),
                &target,
                format_args!("Spacing({spacing:?})"),
                format_args!(
                    "it would make about {nodes:.2e} nodes and {path}.limit is {limit}; use \
                     {wider:.2e} m or more, or raise the limit"
                ),
            );
        }
    }
}

fn surfels(checks: &mut Checks, path: &str, surfels: &SurfelSettings, shape: &Shape) {
    const MOST_RANGE: f64 = 100.0;
    let target = format!("{path}.target");
    match surfels.target {
        SurfelTarget::Count(count) | SurfelTarget::Shared(count) => checks.require(
            (1..=SurfelSettings::MOST).contains(&count),
            target,
            count,
            format_args!("it must be from 1 to {}", SurfelSettings::MOST),
        ),
        SurfelTarget::Density(density) => checks.require(
            density.is_finite() && density > 0.0,
            target,
            format_args!("Density({density:?})"),
            "it must be above 0 (1/m^2), such as 3e5",
        ),
    }
    if let Some(points) = &surfels.points {
        existing_file(
            checks,
            &format!("{path}.points.file"),
            &points.file,
            "a text file of points",
        );
        scale(checks, &format!("{path}.points.scale"), points.scale);
    }
    if let SurfelSpacing::Curvature { range } = surfels.spacing {
        checks.require(
            (1.0..=MOST_RANGE).contains(&range),
            format_args!("{path}.spacing.range"),
            range,
            format_args!("it must be from 1 to {MOST_RANGE}, such as 3"),
        );
    }
    if let Some(density) = surfels.cut_density {
        checks.positive(format_args!("{path}.cut_density"), density, " (1/m^2)");
    }
    const MOST_NEIGHBORS: u32 = 64;
    checks.require(
        (1..=MOST_NEIGHBORS).contains(&surfels.nodes),
        format_args!("{path}.nodes"),
        surfels.nodes,
        format_args!("it must be from 1 to {MOST_NEIGHBORS}"),
    );
    checks.not_negative(format_args!("{path}.opening"), surfels.opening, " (m)");
    radius(checks, &format!("{path}.radius"), surfels.radius);
    checks.color(&format!("{path}.color"), surfels.color);
    checks.color(&format!("{path}.cut_color"), surfels.cut_color);
    checks.require(
        !surfels.textured || matches!(shape, Shape::Mesh { .. }),
        format_args!("{path}.textured"),
        surfels.textured,
        "only a shape from a mesh file comes with a texture",
    );
    checks.require(
        !surfels.textured || surfels.image.is_none(),
        format_args!("{path}.image"),
        "given",
        "the surface has the images of its mesh file already; take this or `textured`",
    );
    for (name, image) in [("image", &surfels.image), ("cut_image", &surfels.cut_image)] {
        if let Some(image) = image {
            existing_file(
                checks,
                &format!("{path}.{name}.file"),
                &image.file,
                "a PNG file",
            );
            checks.positive(format_args!("{path}.{name}.size"), image.size, " (m)");
        }
    }
}

fn cut_rule(checks: &mut Checks, path: &str, rule: CutRule) {
    match rule {
        CutRule::Diffraction { influence_radius } => checks.positive(
            format_args!("{path}.influence_radius"),
            influence_radius,
            ", in mean lengths of pairs, such as 2",
        ),
        CutRule::Visibility => {}
        CutRule::Grid {
            spacing,
            inflate,
            cells,
        } => {
            if let Some(cells) = cells {
                let fits = <[u32; 3]>::from(cells).iter().all(|count| *count > 0);
                checks.require(
                    fits && spacing.is_none(),
                    format_args!("{path}.cells"),
                    format_args!("{cells:?}"),
                    "give one cell or more along each axis, and no spacing beside them",
                );
            }
            for (name, length) in [("spacing", spacing), ("inflate", inflate)] {
                if let Some(length) = length {
                    checks.positive(format_args!("{path}.{name}"), length, " (m)");
                }
            }
        }
    }
}

fn radius(checks: &mut Checks, path: &str, rule: RadiusRule) {
    match rule {
        RadiusRule::Covering => {}
        RadiusRule::Constant(radius) => checks.require(
            radius.is_finite() && radius > 0.0,
            path,
            format_args!("Constant({radius:?})"),
            "it must be above 0 (m), such as 0.002",
        ),
        RadiusRule::Mapped {
            neighbors,
            least,
            most,
            ..
        } => {
            checks.require(
                (3..=64).contains(&neighbors),
                format_args!("{path}.neighbors"),
                neighbors,
                "it must be from 3 to 64",
            );
            checks.positive(format_args!("{path}.least"), least, " (m)");
            checks.require(
                most.is_finite() && most >= least,
                format_args!("{path}.most"),
                most,
                format_args!("it must be at least the smallest radius, {least} m"),
            );
        }
    }
}

/// A body's material and its inclusions.
fn material(checks: &mut Checks, path: &str, body: &Body) {
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

/// How nodes are coupled.
fn method(checks: &mut Checks, path: &str, body: &Body) {
    let Method::Dissertation {
        nearest,
        support_scale,
        neighbor_limit,
    } = body.method
    else {
        return;
    };
    // A gradient in space needs so many neighbours at least.
    const FEWEST: u32 = 4;
    const MOST: u32 = 1000;
    let place = format!("{path}.method");
    for (name, count) in [
        ("nearest", Some(nearest)),
        ("neighbor_limit", neighbor_limit),
    ] {
        let Some(count) = count else { continue };
        checks.require(
            (FEWEST..=MOST).contains(&count),
            format_args!("{place}.{name}"),
            count,
            format_args!("it must be from {FEWEST} to {MOST}"),
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
