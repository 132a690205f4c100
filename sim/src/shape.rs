//! The nodes in a body.

use glam::DVec3;
use phyxel_discretize::{
    Grading, SampleSettings, SampleTarget, SampledNodes, Solid, estimate_point_nodes,
    estimate_tetrahedra_nodes, sample_lattice, sample_points, sample_tetrahedra,
};

use crate::error::BodyProblem;
use crate::memory::{NODE, ask_memory};
use crate::scene::{self, Form};

/// Nodes of a body before they know each other.
pub(crate) struct Sampled {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) volumes: Vec<f64>,
    pub(crate) boundary_vectors: Vec<DVec3>,
    /// None where nodes are mere points.
    pub(crate) tetrahedra: Vec<[u32; 4]>,
    /// Nodes on the surface where nodes are mere points; with tetrahedra these tell.
    pub(crate) outer: Vec<u32>,
    pub(crate) volume_error: Option<f64>,
    /// Fraction of a mesh's vertices that lie where it is too thin for its nodes.
    pub(crate) missed: f64,
}

impl Sampled {
    fn of(found: SampledNodes) -> Self {
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

pub(crate) fn sample(solid: &Solid, body: &scene::Body) -> Result<Sampled, BodyProblem> {
    let spec = &body.sampling;
    let target = match spec.target {
        scene::Target::Lattice(x, y, z) => {
            ask_memory(NODE * [x, y, z].map(f64::from).iter().product::<f64>())?;
            return Ok(Sampled::of(sample_lattice(solid.bounds(), [x, y, z])?));
        }
        scene::Target::Spacing(spacing) => {
            check_count(solid, spacing, body)?;
            SampleTarget::Spacing(spacing)
        }
        scene::Target::Nodes(count) => {
            ask_memory(NODE * f64::from(count))?;
            SampleTarget::NodeCount(count as usize)
        }
    };
    let settings = SampleSettings {
        target,
        grading: Grading {
            coarsest: spec.coarsest,
            refinements: spec.refine.clone(),
            ..Grading::default()
        },
        ..SampleSettings::default()
    };
    Ok(match spec.form {
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
                volume_error: found.report.volume_error,
                missed: 0.0,
            }
        }
    })
}

/// Refuses a spacing that would make more nodes than the limit, before memory is taken.
fn check_count(solid: &Solid, spacing: f64, body: &scene::Body) -> Result<(), BodyProblem> {
    let spec = &body.sampling;
    let volume = solid.volume().unwrap_or(0.0);
    let estimate = match spec.form {
        Form::Tetrahedra => estimate_tetrahedra_nodes(volume, spacing),
        Form::Points => estimate_point_nodes(volume, spacing),
    };
    let limit = spec.limit;
    if estimate > f64::from(limit) {
        return Err(BodyProblem::TooManyNodes {
            spacing,
            estimate,
            limit,
            advice: spacing * (estimate / f64::from(limit)).cbrt(),
        });
    }
    Ok(ask_memory(NODE * estimate)?)
}
