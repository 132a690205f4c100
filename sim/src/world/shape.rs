//! What a body occupies, and the nodes in it.

use glam::{DMat3, DVec3};
use phyxel_discretize::{
    Bounds, Grading, MeshReport, Refinement, RepairSettings, SampleSettings, Sampling,
    Shape as Primitive, Solid, Target, estimate_point_nodes, estimate_tetrahedra_nodes, read_mesh,
    repair, sample_lattice, sample_points, sample_tetrahedra,
};

use super::error::{BodyProblem, WorldError};
use crate::scene::{self, Form, Shape};

/// Extent of the built-in liver from right to left (m), as its own function has it.
const LIVER_WIDTH: f64 = 0.166;
/// The body's solid in the world's rest frame.
pub(super) fn solid_of(body: &scene::Body) -> Result<(Solid, Option<MeshReport>), BodyProblem> {
    let at = body.position;
    let placed = |primitive: Primitive, turn: DMat3, scale: f64, shift: DVec3| {
        let inner = primitive.bounds();
        let corners = (0..8).map(|k| {
            let pick = |bit: usize, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
            let corner = DVec3::new(
                pick(0, inner.min.x, inner.max.x),
                pick(1, inner.min.y, inner.max.y),
                pick(2, inner.min.z, inner.max.z),
            );
            turn * corner * scale + shift
        });
        let back = turn.transpose();
        Solid::implicit(Bounds::of(corners), move |p| {
            scale * primitive.value(back * (p - shift) / scale)
        })
    };
    // Rotation that takes +z to the axis of a capsule or tube.
    let along = |axis: DVec3| {
        let z = axis.normalize_or(DVec3::Z);
        let (x, y) = z.any_orthonormal_pair();
        DMat3::from_cols(x, y, z)
    };
    let still = DMat3::IDENTITY;
    Ok(match &body.shape {
        Shape::Liver { width } => {
            // The organ of an upright person: its head end up, its front to -y.
            let turn = DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y);
            let natural = LIVER_WIDTH;
            (placed(Primitive::Liver, turn, width / natural, at), None)
        }
        Shape::Box { size } => {
            let (min, max) = (at - *size * 0.5, at + *size * 0.5);
            (Solid::from(Bounds { min, max }), None)
        }
        Shape::Ellipsoid { radii } => {
            let semi_axes = *radii;
            (
                placed(Primitive::Ellipsoid { semi_axes }, still, 1.0, at),
                None,
            )
        }
        Shape::Capsule { from, to, radius } => {
            let capsule = Primitive::Capsule {
                half_length: 0.5 * from.distance(*to),
                radius: *radius,
            };
            let shift = at + from.midpoint(*to);
            (placed(capsule, along(*to - *from), 1.0, shift), None)
        }
        Shape::Tube {
            from,
            to,
            inner_radius,
            outer_radius,
        } => {
            let tube = Primitive::Tube {
                half_length: 0.5 * from.distance(*to),
                outer_radius: *outer_radius,
                inner_radius: *inner_radius,
            };
            let shift = at + from.midpoint(*to);
            (placed(tube, along(*to - *from), 1.0, shift), None)
        }
        Shape::Mesh {
            file,
            scale,
            up,
            largest_hole,
        } => {
            let mut mesh = read_mesh(file)?.mesh;
            let turn = up.rotation();
            for vertex in &mut mesh.vertices {
                *vertex = turn * (*vertex * *scale) + at;
            }
            let settings = RepairSettings {
                largest_hole: *largest_hole,
                ..RepairSettings::default()
            };
            let repaired = repair(&mesh, &settings);
            let (mesh, report) = repaired.map_err(|problem| BodyProblem::Repair {
                file: file.clone(),
                problem: Box::new(problem),
            })?;
            (Solid::from_mesh(mesh), Some(report))
        }
    })
}

/// Diagonal (m) of the box round all bodies of a scene at rest.
///
/// # Errors
/// [`WorldError`] if a mesh cannot be read or is no solid.
pub fn extent(scene: &scene::Scene) -> Result<f64, WorldError> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for body in &scene.bodies {
        let (solid, _) = solid_of(body).map_err(|problem| WorldError::Body {
            body: body.name.clone(),
            problem,
        })?;
        low = low.min(solid.bounds().min);
        high = high.max(solid.bounds().max);
    }
    Ok(low.distance(high))
}

/// Nodes of a body before they know each other.
pub(super) struct Sampled {
    pub(super) positions: Vec<DVec3>,
    pub(super) volumes: Vec<f64>,
    pub(super) boundary_vectors: Vec<DVec3>,
    /// None where nodes are mere points.
    pub(super) tetrahedra: Vec<[u32; 4]>,
    /// Nodes on the surface where nodes are mere points; with tetrahedra these tell.
    pub(super) outer: Vec<u32>,
    pub(super) volume_error: Option<f64>,
    /// Share of a mesh's vertices that lie where it is too thin for its nodes.
    pub(super) missed: f64,
}

impl Sampled {
    fn of(found: Sampling) -> Self {
        Self {
            positions: found.positions,
            volumes: found.volumes,
            boundary_vectors: found.boundary_vectors,
            tetrahedra: found.tetrahedra,
            outer: Vec::new(),
            volume_error: found.report.volume_error,
            missed: found.report.missed,
        }
    }
}

pub(super) fn sample(solid: &Solid, body: &scene::Body) -> Result<Sampled, BodyProblem> {
    let wish = &body.sampling;
    let target = match wish.target {
        scene::Target::Lattice(x, y, z) => {
            return Ok(Sampled::of(sample_lattice(solid.bounds(), [x, y, z])?));
        }
        scene::Target::Spacing(spacing) => {
            check_count(solid, spacing, body)?;
            Target::Spacing(spacing)
        }
        scene::Target::Nodes(count) => Target::NodeCount(count as usize),
    };
    let refinements = wish.refine.iter().map(|place| Refinement {
        from: place.from,
        to: place.to,
        radius: place.radius,
        factor: place.factor,
    });
    let settings = SampleSettings {
        target,
        grading: Grading {
            coarsest: wish.coarsest,
            refinements: refinements.collect(),
            ..Grading::default()
        },
        ..SampleSettings::default()
    };
    Ok(match wish.form {
        Form::Tetrahedra => Sampled::of(sample_tetrahedra(solid, &settings)?),
        Form::Points => {
            let found = sample_points(solid, &settings, true)?;
            let outer = (0..).zip(&found.on_surface).filter(|(_, on)| **on);
            Sampled {
                outer: outer.map(|(node, _)| node).collect(),
                positions: found.positions,
                volumes: found.volumes,
                boundary_vectors: found.boundary_vectors,
                tetrahedra: Vec::new(),
                volume_error: None,
                missed: 0.0,
            }
        }
    })
}

/// Refuses a spacing that would make more nodes than the limit, before memory is taken.
fn check_count(solid: &Solid, spacing: f64, body: &scene::Body) -> Result<(), BodyProblem> {
    let wish = &body.sampling;
    let volume = solid
        .mesh()
        .map(phyxel_discretize::Mesh::volume)
        .or_else(|| body.shape.rough_volume())
        .unwrap_or(0.0);
    let estimate = match wish.form {
        Form::Tetrahedra => estimate_tetrahedra_nodes(volume, spacing),
        Form::Points => estimate_point_nodes(volume, spacing),
    };
    let limit = wish.limit;
    if estimate > f64::from(limit) {
        return Err(BodyProblem::TooManyNodes {
            spacing,
            estimate,
            limit,
            advice: spacing * (estimate / f64::from(limit)).cbrt(),
        });
    }
    Ok(())
}
