//! What a body occupies, and the nodes in it.

use glam::DVec3;
use phyxel_discretize::{
    Bounds, Grading, MeshReport, Refinement, RepairSettings, SampleSettings, Sampling, Solid,
    Target, estimate_point_nodes, estimate_tetrahedra_nodes, read_mesh, repair, sample_lattice,
    sample_points, sample_tetrahedra,
};

use super::error::{BodyProblem, WorldError};
use crate::scene::{self, Form, Shape};

/// The body's solid in the world's rest frame.
pub(super) fn solid_of(body: &scene::Body) -> Result<(Solid, Option<MeshReport>), BodyProblem> {
    let (at, size, turned) = (body.position, body.scale, body.turn());
    if let Shape::Mesh {
        file,
        scale,
        up,
        largest_hole,
    } = &body.shape
    {
        let mut mesh = read_mesh(file)?.mesh;
        let (turn, scale) = (turned * up.rotation(), size * *scale);
        for vertex in &mut mesh.vertices {
            *vertex = turn * (*vertex * scale) + at;
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
        return Ok((Solid::from_mesh(mesh), Some(report)));
    }
    if let Shape::Box { size: edges } = &body.shape
        && body.rotation == DVec3::ZERO
    {
        // Cells that fit it are for boxes along the axes.
        let half_extents = *edges * size * 0.5;
        let (min, max) = (at - half_extents, at + half_extents);
        return Ok((Solid::from(Bounds { min, max }), None));
    }
    let primitive = body.shape.primitive();
    let (primitive, turn, scale, shift) = primitive.expect("all but a mesh are primitives");
    let shift = turned * (size * shift) + at;
    let solid = Solid::placed(primitive, turned * turn, size * scale, shift);
    Ok((solid, None))
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
        .or_else(|| body.rough_volume())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Body;

    /// A body that is scaled, turned and moved has the distances of its shape, times the scale, at the places
    /// taken back into the shape's frame; a turn by hand says what the rotation vector means.
    #[test]
    fn a_placed_body_is_its_shape_elsewhere() {
        let at = DVec3::new;
        let shapes = [
            Shape::Liver { width: 0.2 },
            Shape::Box {
                size: at(0.1, 0.06, 0.04),
            },
            Shape::Ellipsoid {
                radii: at(0.06, 0.03, 0.02),
            },
            Shape::Capsule {
                from: at(0.01, 0.0, 0.0),
                to: at(0.05, 0.02, 0.0),
                radius: 0.02,
            },
            Shape::Tube {
                from: at(0.0, 0.0, -0.03),
                to: at(0.01, 0.02, 0.03),
                inner_radius: 0.01,
                outer_radius: 0.02,
            },
        ];
        for shape in shapes {
            let plain = Body::new(shape.clone());
            let mut placed = Body::new(shape);
            // A quarter turn about z, twice the size.
            (placed.rotation, placed.scale) = (DVec3::Z * 90.0, 2.0);
            placed.position = at(0.3, -0.2, 0.1);
            let (solid, _) = solid_of(&plain).expect("a solid");
            let (moved, _) = solid_of(&placed).expect("a solid");
            let (mut inside, mut outside) = (0, 0);
            for k in 0..729 {
                let pick = |k: i32| f64::from(k % 9 - 4) * 0.011;
                let p = at(pick(k), pick(k / 9), pick(k / 81));
                let there = 2.0 * at(-p.y, p.x, p.z) + placed.position;
                let (a, b) = (solid.signed_distance(p), moved.signed_distance(there));
                assert!(
                    (2.0 * a - b).abs() < 1e-15 + 1e-12 * a.abs(),
                    "{:?} at {p}: {a} {b}",
                    placed.shape
                );
                assert_eq!(
                    solid.contains(p),
                    moved.contains(there),
                    "{:?} at {p}",
                    placed.shape
                );
                if a < 0.0 { inside += 1 } else { outside += 1 }
            }
            assert!(
                inside > 20 && outside > 20,
                "{:?}: {inside} inside, {outside} outside",
                placed.shape
            );
            let ratio = placed
                .rough_volume()
                .zip(plain.rough_volume())
                .map(|(a, b)| a / b);
            assert!(
                ratio.is_some_and(|ratio| (ratio - 8.0).abs() < 1e-12),
                "{ratio:?}"
            );
        }
    }
}
