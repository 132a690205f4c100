//! Rigid tools, and what they touch of the bodies.

use glam::DVec3;
use phyxel_discretize::{Solid, boundary_triangles, edge_bulges, nodal_surface_areas};
use phyxel_integrate::{Pose, RigidTool};
use serde::{Deserialize, Serialize};

use crate::error::BodyProblem;
use crate::scene::Scene;
use crate::shape::Sampled;

/// The contact of one tool with one body.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct ToolContact {
    /// Index of the scene's tool.
    pub(crate) tool: usize,
    /// The tool as this body has it.
    pub(crate) rigid: RigidTool,
    /// Surface triangles that cuts had torn when its surface was made.
    pub(crate) torn: usize,
}

/// Forces on a tool at the end of the last step, of all bodies together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct ToolForce {
    /// Where the tool is.
    pub pose: Pose,
    /// Force on the tool (N).
    pub force: DVec3,
    /// Torque on the tool about its origin (N m).
    pub torque: DVec3,
    /// Deepest penetration (m).
    pub penetration: f64,
    /// Area of contact at rest (m²).
    pub area: f64,
    /// Work of the bodies on the tool so far (J).
    pub work: f64,
}

impl ToolContact {
    /// Whether it can be one of a body of so many nodes instead of another.
    pub(crate) fn is_sound(&self, node_count: usize, built: &Self) -> bool {
        self.tool == built.tool && self.rigid.is_sound(node_count)
    }

    /// Adds this body's share of the forces; where the tool is, if it goes its own way.
    pub(crate) fn add_to(&self, sum: &mut ToolForce) {
        if self.rigid.is_released() {
            sum.pose = self.rigid.pose;
        }
        let found = self.rigid.load_about(sum.pose.position);
        sum.force += found.force;
        sum.torque += found.torque;
        sum.penetration = sum.penetration.max(found.penetration);
        sum.area += found.area;
        sum.work += self.rigid.contact_work;
    }
}

/// What tools touch of an uncut body.
#[derive(Debug, Clone)]
pub(crate) enum ToolSurface {
    /// Triangles of the outside, and how far (m) it stands in front of their edges' middles; none in a scene without tools.
    Triangles(Vec<[u32; 3]>, Vec<[f64; 3]>),
    /// Nodes on the surface, each with the area (m²) nearest to it, where there are no tetrahedra.
    Nodes(Vec<u32>, Vec<f64>),
}

impl ToolSurface {
    pub(crate) fn of(
        scene: &Scene,
        solid: &Solid,
        sampled: &Sampled,
        spacing: f64,
    ) -> Result<Self, BodyProblem> {
        if scene.tools.is_empty() {
            return Ok(Self::Triangles(Vec::new(), Vec::new()));
        }
        if !sampled.tetrahedra.is_empty() {
            let triangles = boundary_triangles(&sampled.tetrahedra, |_| true);
            let bulges = edge_bulges(solid, &sampled.positions, &triangles);
            return Ok(Self::Triangles(triangles, bulges));
        }
        let outer = sampled.outer.iter().copied();
        let places = outer.clone().map(|node| sampled.positions[node as usize]);
        let areas = nodal_surface_areas(solid, &places.collect::<Vec<_>>(), spacing)?;
        let covered = outer.zip(areas).filter(|&(_, area)| area > 0.0);
        let (nodes, areas) = covered.unzip();
        Ok(Self::Nodes(nodes, areas))
    }

    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Triangles(triangles, bulges) => {
                size_of_val(&**triangles) + size_of_val(&**bulges)
            }
            Self::Nodes(nodes, areas) => size_of_val(&**nodes) + size_of_val(&**areas),
        }
    }

    pub(crate) fn triangles(&self) -> &[[u32; 3]] {
        match self {
            Self::Triangles(triangles, _) => triangles,
            Self::Nodes(..) => &[],
        }
    }
}
