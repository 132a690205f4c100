//! Bodies: shape, sampling, motion and looks.

use glam::DVec3;
use phyxel_elastic::BadSetting;

use super::file::{existing_file, scale};
use super::shapes::{refinement, region, shape};
use super::{Checks, SCALE};
use crate::{
    Body, CutRule, Dilatation, Form, Method, RadiusRule, Shape, SurfelSettings, SurfelSpacing,
    SurfelTarget, Target,
};

pub(super) fn body(checks: &mut Checks, path: &str, body: &Body) {
    let of = |field: &str| format!("{path}.{field}");
    shape(checks, &of("shape"), &body.shape);
    checks.finite(of("position"), body.position);
    checks.finite(of("rotation"), body.rotation);
    checks.positive(of("scale"), body.scale, SCALE);
    sampling(checks, path, body);
    material(checks, path, body);
    method(checks, path, body);
    cut_rule(checks, &of("cut_rule"), body.cut_rule);
    let must = "it must lie between 0 (none) and 1 (critical damping of the stiffest mode)";
    checks.within(of("damping_ratio"), body.damping_ratio, 0.0..=1.0, must);
    let must = "it must lie between 0 (none) and 0.1 (a tenth of the mass); 0.003 lengthens steps by a third";
    checks.within(of("moved_mass"), body.moved_mass, 0.0..=0.1, must);
    checks.finite(of("velocity"), body.velocity);
    checks.not_negative(of("damping"), body.damping, " (1/s)");
    surfels(checks, &of("surfels"), &body.surfels, &body.shape);
}

/// A body needs so many nodes at least.
const FEWEST_NODES: u32 = 4;

fn sampling(checks: &mut Checks, path: &str, body: &Body) {
    let path = &format!("{path}.sampling");
    let of = |field: &str| format!("{path}.{field}");
    let sampling = &body.sampling;
    let limit = sampling.limit;
    let must = format_args!("a body needs {FEWEST_NODES} nodes at least");
    checks.require(limit >= FEWEST_NODES, of("limit"), limit, must);
    let must = "it must be from 1 (the same everywhere) to 32";
    checks.within(of("coarsest"), sampling.coarsest, 1.0..=32.0, must);
    for (index, refined) in sampling.refine.iter().enumerate() {
        refinement(checks, &format!("{path}.refine[{index}]"), refined);
    }
    target(checks, path, body);
}

fn target(checks: &mut Checks, path: &str, body: &Body) {
    let (sampling, target) = (&body.sampling, format!("{path}.target"));
    let limit = sampling.limit;
    match sampling.target {
        Target::Nodes(count) => {
            let fits = (FEWEST_NODES..=limit).contains(&count);
            let found = format_args!("Nodes({count})");
            let must = format_args!(
                "it must be from {FEWEST_NODES} to {limit} nodes; for more raise {path}.limit"
            );
            checks.require(fits, target, found, must);
        }
        Target::Lattice(x, y, z) => {
            let found = format!("Lattice({x}, {y}, {z})");
            let plain = sampling.form == Form::Tetrahedra
                && sampling.coarsest <= 1.0
                && sampling.refine.is_empty();
            let plain = plain && matches!(body.shape, Shape::Box { .. });
            let fits = plain && body.rotation == DVec3::ZERO;
            let must = "a lattice is of a Box that is not turned, of form Tetrahedra, with coarsest 1 and nothing to refine";
            checks.require(fits, &target, &found, must);
            let nodes: f64 = [x, y, z].into_iter().map(f64::from).product();
            let fits = x.min(y).min(z) >= 2 && nodes <= f64::from(limit);
            let must = format_args!(
                "it must have 2 nodes or more along each axis, and {limit} at most in all; for more raise \
                 {path}.limit"
            );
            checks.require(fits, target, found, must);
        }
        Target::Spacing(spacing) => {
            let found = format!("Spacing({spacing:?})");
            let fits = spacing.is_finite() && spacing > 0.0;
            let must = "it must be above 0 (m), such as 0.006 for an organ";
            checks.require(fits, &target, &found, must);
            let Some(volume) = body.rough_volume() else {
                return;
            };
            let nodes = volume / (spacing * spacing * spacing);
            let wider = 1.05 * (volume / f64::from(limit)).cbrt();
            let must = format_args!(
                "it would make about {nodes:.2e} nodes and {path}.limit is {limit}; use \
                 {wider:.2e} m or more, or raise the limit"
            );
            checks.require(nodes <= f64::from(limit), &target, found, must);
        }
    }
}

fn surfels(checks: &mut Checks, path: &str, surfels: &SurfelSettings, shape: &Shape) {
    let of = |field: &str| format!("{path}.{field}");
    const MOST_RANGE: f64 = 100.0;
    const MOST_NEIGHBORS: u32 = 64;
    let target = of("target");
    match surfels.target {
        SurfelTarget::Count(count) | SurfelTarget::Shared(count) => {
            let must = format_args!("it must be from 1 to {}", SurfelSettings::MOST);
            checks.within(target, count, 1..=SurfelSettings::MOST, must);
        }
        SurfelTarget::Density(density) => {
            let fits = density.is_finite() && density > 0.0;
            let must = "it must be above 0 (1/m^2), such as 3e5";
            checks.require(fits, target, format_args!("Density({density:?})"), must);
        }
    }
    if let Some(points) = &surfels.points {
        let what = "a text file of points";
        existing_file(checks, &of("points.file"), &points.file, what);
        scale(checks, &of("points.scale"), points.scale);
    }
    if let SurfelSpacing::Curvature { range } = surfels.spacing {
        let must = format_args!("it must be from 1 to {MOST_RANGE}, such as 3");
        checks.within(of("spacing.range"), range, 1.0..=MOST_RANGE, must);
    }
    if let Some(density) = surfels.cut_density {
        checks.positive(of("cut_density"), density, " (1/m^2)");
    }
    let must = format_args!("it must be from 1 to {MOST_NEIGHBORS}");
    checks.within(of("nodes"), surfels.nodes, 1..=MOST_NEIGHBORS, must);
    checks.not_negative(of("opening"), surfels.opening, " (m)");
    radius(checks, &of("radius"), surfels.radius);
    checks.color(&of("color"), surfels.color);
    checks.color(&of("cut_color"), surfels.cut_color);
    if surfels.textured {
        let must = "only a shape from a mesh file comes with a texture";
        let is_mesh = matches!(shape, Shape::Mesh { .. });
        checks.require(is_mesh, of("textured"), true, must);
        let must = "the surface has the images of its mesh file already; take this or `textured`";
        checks.require(surfels.image.is_none(), of("image"), "given", must);
    }
    for (name, image) in [("image", &surfels.image), ("cut_image", &surfels.cut_image)] {
        if let Some(image) = image {
            let of = |field: &str| format!("{path}.{name}.{field}");
            existing_file(checks, &of("file"), &image.file, "a PNG file");
            checks.positive(of("size"), image.size, " (m)");
        }
    }
}

fn cut_rule(checks: &mut Checks, path: &str, rule: CutRule) {
    let of = |field: &str| format!("{path}.{field}");
    match rule {
        CutRule::Diffraction { influence_radius } => {
            let hint = ", in mean lengths of pairs, such as 2";
            checks.positive(of("influence_radius"), influence_radius, hint);
        }
        CutRule::Visibility => {}
        CutRule::Grid {
            spacing,
            inflate,
            cells,
        } => {
            if let Some(cells) = cells {
                let fits = <[u32; 3]>::from(cells).iter().all(|count| *count > 0);
                let (fits, found) = (fits && spacing.is_none(), format!("{cells:?}"));
                let must = "give one cell or more along each axis, and no spacing beside them";
                checks.require(fits, of("cells"), found, must);
            }
            for (name, length) in [("spacing", spacing), ("inflate", inflate)] {
                if let Some(length) = length {
                    checks.positive(of(name), length, " (m)");
                }
            }
        }
    }
}

fn radius(checks: &mut Checks, path: &str, rule: RadiusRule) {
    let of = |field: &str| format!("{path}.{field}");
    match rule {
        RadiusRule::Covering => {}
        RadiusRule::Constant(radius) => {
            let fits = radius.is_finite() && radius > 0.0;
            let found = format_args!("Constant({radius:?})");
            checks.require(fits, path, found, "it must be above 0 (m), such as 0.002");
        }
        RadiusRule::Mapped {
            neighbors,
            least,
            most,
            ..
        } => {
            let must = "it must be from 3 to 64";
            checks.within(of("neighbors"), neighbors, 3..=64, must);
            checks.positive(of("least"), least, " (m)");
            let must = format_args!("it must be at least the smallest radius, {least} m");
            checks.require(most.is_finite() && most >= least, of("most"), most, must);
        }
    }
}

/// A body's material and its inclusions.
fn material(checks: &mut Checks, path: &str, body: &Body) {
    told(checks, &format!("{path}.material"), body.material.check());
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
        told(checks, &path, bad);
    }
}

/// What a group of settings at a key path finds at fault in itself.
fn told(checks: &mut Checks, group: &str, all: Vec<BadSetting>) {
    for bad in all {
        let path = format_args!("{group}.{}", bad.field);
        checks.require(false, path, bad.found, bad.must);
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
    let of = |field: &str| format!("{path}.{field}");
    // A gradient in space needs so many neighbours at least.
    const FEWEST: u32 = 4;
    const MOST: u32 = 1000;
    let must = format_args!("it must be from {FEWEST} to {MOST}");
    checks.within(of("method.nearest"), nearest, FEWEST..=MOST, must);
    if let Some(limit) = neighbor_limit {
        checks.within(of("method.neighbor_limit"), limit, FEWEST..=MOST, must);
    }
    let must = "it must be from 0.5 to 10, such as 1.5";
    checks.within(of("method.support_scale"), support_scale, 0.5..=10.0, must);
    let (path, found) = (of("material.stabilization"), body.material.stabilization);
    let must = "the method Dissertation has no hourglass stabilization; set it to 0";
    checks.require(found == 0.0, path, found, must);
    let is_local = body.material.dilatation == Dilatation::Local;
    let must = "the method Dissertation has Local only";
    checks.require(is_local, of("material.dilatation"), "Mean", must);
}
