//! Bodies: shape, sampling, motion and looks.

use glam::DVec3;
use phyxel_discretize::{estimate_point_nodes, estimate_tetrahedra_nodes};
use phyxel_elastic::BadSetting;

use super::file::{UNIT, existing_file};
use super::shapes::{refinement, region, shape};
use super::{Checks, SCALE};
use crate::{
    Body, CutRule, Dilatation, Form, Inclusion, Method, RadiusRule, Sampling, Shape,
    SurfelSettings, SurfelSpacing, SurfelTarget, Target,
};

pub(super) fn body(checks: &mut Checks, body: &Body) {
    checks.group("shape", |checks| shape(checks, &body.shape));
    checks.finite("position", body.position);
    checks.finite("rotation", body.rotation);
    checks.positive("scale", body.scale, SCALE);
    checks.group("sampling", |checks| sampling(checks, body));
    checks.group("material", |checks| told(checks, body.material.check()));
    checks.each("inclusions", &body.inclusions, |checks, part| {
        inclusion(checks, part, body);
    });
    method(checks, body);
    checks.group("cut_rule", |checks| cut_rule(checks, body.cut_rule));
    let must = "it must lie between 0 (none) and 1 (critical damping of the stiffest mode)";
    checks.within("damping_ratio", body.damping_ratio, 0.0..=1.0, must);
    checks.finite("velocity", body.velocity);
    checks.not_negative("damping", body.damping, " (1/s)");
    checks.group("surfels", |checks| {
        surfels(checks, &body.surfels, &body.shape);
    });
}

/// A body needs so many nodes at least.
const FEWEST_NODES: u32 = 4;

fn sampling(checks: &mut Checks, body: &Body) {
    let sampling = &body.sampling;
    let limit = sampling.limit;
    let must = format_args!("a body needs {FEWEST_NODES} nodes at least");
    checks.require(limit >= FEWEST_NODES, "limit", limit, must);
    let must = "it must be from 1 (the same everywhere) to 32";
    checks.within("coarsest", sampling.coarsest, 1.0..=32.0, must);
    checks.each("refine", &sampling.refine, refinement);
    let most = checks.path("limit");
    match sampling.target {
        Target::Nodes(count) => {
            let fits = (FEWEST_NODES..=limit).contains(&count);
            let found = format_args!("Nodes({count})");
            let must = format_args!(
                "it must be from {FEWEST_NODES} to {limit} nodes; for more raise {most}"
            );
            checks.require(fits, "target", found, must);
        }
        Target::Lattice(x, y, z) => {
            let found = format!("Lattice({x}, {y}, {z})");
            let plain = sampling.form == Form::Tetrahedra
                && sampling.coarsest <= 1.0
                && sampling.refine.is_empty();
            let plain = plain && matches!(body.shape, Shape::Box { .. });
            let fits = plain && body.rotation == DVec3::ZERO;
            let must = "a lattice is of a Box that is not turned, of form Tetrahedra, with coarsest 1 and nothing to refine";
            checks.require(fits, "target", &found, must);
            let nodes = sampling.estimated_nodes(0.0);
            let fits = x.min(y).min(z) >= 2 && nodes <= f64::from(limit);
            let must = format_args!(
                "it must have 2 nodes or more along each axis, and {limit} at most in all; for more raise {most}"
            );
            checks.require(fits, "target", found, must);
        }
        Target::Spacing(spacing) => {
            let such_as = " (m), such as 0.006 for an organ";
            checks.above_zero("target", "Spacing", spacing, such_as);
            if let Some(volume) = body.rough_volume() {
                sampling.check_spacing(checks, volume);
            }
        }
    }
}

impl Sampling {
    /// About how many nodes it makes in a volume (m³).
    #[must_use]
    pub fn estimated_nodes(&self, volume: f64) -> f64 {
        match (self.target, self.form) {
            (Target::Nodes(count), _) => f64::from(count),
            (Target::Lattice(x, y, z), _) => [x, y, z].map(f64::from).iter().product(),
            (Target::Spacing(h), Form::Tetrahedra) => estimate_tetrahedra_nodes(volume, h),
            (Target::Spacing(h), Form::Points) => estimate_point_nodes(volume, h),
        }
    }

    /// Checks that a spacing makes no more nodes in a volume (m³) than the limit; key paths start here.
    pub fn check_spacing(&self, checks: &mut Checks, volume: f64) {
        let Target::Spacing(spacing) = self.target else {
            return;
        };
        let (nodes, limit) = (self.estimated_nodes(volume), f64::from(self.limit));
        let one = Self {
            target: Target::Spacing(1.0),
            ..self.clone()
        };
        let wider = 1.05 * (one.estimated_nodes(volume) / limit).cbrt();
        let (found, most) = (format_args!("Spacing({spacing:?})"), checks.path("limit"));
        let must = format_args!(
            "it would make about {nodes:.2e} nodes and {most} is {limit}; use {wider:.2e} m or more, or raise the limit"
        );
        checks.require(nodes <= limit, "target", found, must);
    }
}

fn surfels(checks: &mut Checks, surfels: &SurfelSettings, shape: &Shape) {
    const MOST_RANGE: f64 = 100.0;
    const MOST_NEIGHBORS: u32 = 64;
    match surfels.target {
        SurfelTarget::Count(count) | SurfelTarget::Shared(count) => {
            let must = format_args!("it must be from 1 to {}", SurfelSettings::MOST);
            checks.within("target", count, 1..=SurfelSettings::MOST, must);
        }
        SurfelTarget::Density(density) => {
            checks.above_zero("target", "Density", density, " (1/m^2), such as 3e5");
        }
    }
    if let Some(points) = &surfels.points {
        checks.group("points", |checks| {
            existing_file(checks, &points.file, "a text file of points");
            checks.positive("scale", points.scale, UNIT);
        });
    }
    if let SurfelSpacing::Curvature { range } = surfels.spacing {
        let must = format_args!("it must be from 1 to {MOST_RANGE}, such as 3");
        checks.within("spacing.range", range, 1.0..=MOST_RANGE, must);
    }
    checks.positive("cut_density", surfels.cut_density, " (1/m^2)");
    let must = format_args!("it must be from 1 to {MOST_NEIGHBORS}");
    checks.within("nodes", surfels.nodes, 1..=MOST_NEIGHBORS, must);
    checks.not_negative("opening", surfels.opening, " (m)");
    radius(checks, surfels.radius);
    checks.color("color", surfels.color);
    checks.color("cut_color", surfels.cut_color);
    if surfels.textured {
        let must = "only a shape from a mesh file comes with a texture";
        let is_mesh = matches!(shape, Shape::Mesh { .. });
        checks.require(is_mesh, "textured", true, must);
        let must = "the surface has the images of its mesh file already; take this or `textured`";
        checks.require(surfels.image.is_none(), "image", "given", must);
    }
    for (name, image) in [("image", &surfels.image), ("cut_image", &surfels.cut_image)] {
        let Some(image) = image else { continue };
        checks.group(name, |checks| {
            existing_file(checks, &image.file, "a PNG file");
            checks.positive("size", image.size, " (m)");
        });
    }
}

fn cut_rule(checks: &mut Checks, rule: CutRule) {
    match rule {
        CutRule::Diffraction { influence_radius } => {
            let hint = ", in mean lengths of pairs, such as 2";
            checks.positive("influence_radius", influence_radius, hint);
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
                checks.require(fits, "cells", found, must);
            }
            checks.positive("spacing", spacing, " (m)");
            checks.positive("inflate", inflate, " (m)");
        }
    }
}

fn radius(checks: &mut Checks, rule: RadiusRule) {
    match rule {
        RadiusRule::Covering => {}
        RadiusRule::Constant(radius) => {
            checks.above_zero("radius", "Constant", radius, " (m), such as 0.002");
        }
        RadiusRule::Mapped {
            neighbors,
            least,
            most,
            ..
        } => {
            let must = "it must be from 3 to 64";
            checks.within("radius.neighbors", neighbors, 3..=64, must);
            checks.positive("radius.least", least, " (m)");
            let fits = most.is_finite() && most >= least;
            let must = format_args!("it must be at least the smallest radius, {least} m");
            checks.require(fits, "radius.most", most, must);
        }
    }
}

/// A part of another material.
fn inclusion(checks: &mut Checks, part: &Inclusion, body: &Body) {
    checks.group("region", |checks| region(checks, &part.region));
    let mut bad = part.within(&body.material).check();
    // What is not given here is the body's, and reported there.
    bad.retain(|bad| match bad.field.as_str() {
        "youngs_modulus" => part.youngs_modulus.is_some(),
        "density" => part.density.is_some(),
        "poissons_ratio" | "model.share" => part.poissons_ratio.is_some(),
        field => part.fiber.is_some() && field.starts_with("fiber."),
    });
    told(checks, bad);
}

/// What a group of settings finds at fault in itself.
fn told(checks: &mut Checks, all: Vec<BadSetting>) {
    for bad in all {
        checks.require(false, bad.field, bad.found, bad.must);
    }
}

/// How nodes are coupled.
fn method(checks: &mut Checks, body: &Body) {
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
    let must = format_args!("it must be from {FEWEST} to {MOST}");
    checks.within("method.nearest", nearest, FEWEST..=MOST, must);
    if let Some(limit) = neighbor_limit {
        checks.within("method.neighbor_limit", limit, FEWEST..=MOST, must);
    }
    let must = "it must be from 0.5 to 10, such as 1.5";
    checks.within("method.support_scale", support_scale, 0.5..=10.0, must);
    let (path, found) = ("material.stabilization", body.material.stabilization);
    let must = "the method Dissertation has no hourglass stabilization; set it to 0";
    checks.require(found == 0.0, path, found, must);
    let is_local = body.material.dilatation == Dilatation::Local;
    let must = "the method Dissertation has Local only";
    checks.require(is_local, "material.dilatation", "Mean", must);
}
