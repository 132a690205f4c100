//! The nodes in a body.

use glam::DVec3;
use phyxel_discretize::{
    Grading, SampleSettings, SampleTarget, SampledNodes, Solid, sample_lattice, sample_points,
    sample_tetrahedra,
};

use crate::error::BodyProblem;
use crate::memory::{NODE, ask_memory};
use crate::scene::{self, Checks, Form};

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
            volume_error: found.report.tetrahedra_error,
            missed: found.report.missed,
        }
    }
}

pub(crate) fn sample(solid: &Solid, body: &scene::Body) -> Result<Sampled, BodyProblem> {
    let spec = &body.sampling;
    let (mut checks, volume) = (Checks::default(), solid.volume().unwrap_or(0.0));
    checks.group("sampling", |checks| spec.check_spacing(checks, volume));
    checks.first()?;
    ask_memory(NODE * spec.estimated_nodes(volume))?;
    let target = match spec.target {
        scene::Target::Lattice(x, y, z) => {
            return Ok(Sampled::of(sample_lattice(solid.bounds(), [x, y, z])?));
        }
        scene::Target::Spacing(spacing) => SampleTarget::Spacing(spacing),
        scene::Target::Nodes(count) => SampleTarget::NodeCount(count as usize),
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
