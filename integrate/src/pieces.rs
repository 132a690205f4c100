//! Connected pieces of a body, and rigid fields over them.

use glam::{DMat3, DVec3};

/// Connected pieces, as far as they were named.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct NamedPieces {
    /// Piece of each node; empty where none were named.
    pub(crate) of_node: Vec<u32>,
    /// Those that no support holds, with their nodes, ascending within each.
    pub(crate) free: Vec<(u32, Vec<u32>)>,
    /// How many pieces there are.
    pub(crate) count: usize,
}

/// A field `a + b × (x - center)`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RigidField {
    center: DVec3,
    a: DVec3,
    b: DVec3,
}

impl RigidField {
    pub(crate) const ZERO: Self = Self {
        center: DVec3::ZERO,
        a: DVec3::ZERO,
        b: DVec3::ZERO,
    };

    pub(crate) fn at(&self, x: DVec3) -> DVec3 {
        self.a + self.b.cross(x - self.center)
    }

    /// The field whose mass-weighted sum and moment are those of `weighted(i)` (mass times field) over
    /// some nodes.
    pub(crate) fn with_moments_of(
        nodes: impl Iterator<Item = usize> + Clone,
        masses: &[f64],
        positions: &[DVec3],
        weighted: impl Fn(usize) -> DVec3,
    ) -> Self {
        Inertia::of(nodes.clone(), masses, positions).motion(nodes, masses, positions, weighted)
    }
}

/// Mass, center and inertia of some nodes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inertia {
    pub(crate) mass: f64,
    pub(crate) center: DVec3,
    tensor: DMat3,
}

impl Inertia {
    pub(crate) fn of(
        nodes: impl Iterator<Item = usize> + Clone,
        masses: &[f64],
        positions: &[DVec3],
    ) -> Self {
        let (mut mass, mut first) = (0.0, DVec3::ZERO);
        for node in nodes.clone() {
            mass += masses[node];
            first += positions[node] * masses[node];
        }
        let (center, mut tensor) = (first / mass, DMat3::ZERO);
        for node in nodes {
            let arm = positions[node] - center;
            let square = DMat3::from_diagonal(DVec3::splat(arm.length_squared()));
            let outer = DMat3::from_cols(arm * arm.x, arm * arm.y, arm * arm.z);
            tensor += (square - outer) * masses[node];
        }
        Self {
            mass,
            center,
            tensor,
        }
    }

    /// The field that has the sum of `weighted` over the nodes and its moment about their center of mass.
    pub(crate) fn motion(
        &self,
        nodes: impl Iterator<Item = usize> + Clone,
        masses: &[f64],
        positions: &[DVec3],
        weighted: impl Fn(usize) -> DVec3,
    ) -> RigidField {
        let sum: DVec3 = nodes.clone().map(&weighted).sum();
        let (a, mut moment) = (sum / self.mass, DVec3::ZERO);
        for node in nodes {
            let arm = positions[node] - self.center;
            // Without the mean: arms that are round-off, as of a single node, would make a spin of it.
            moment += arm.cross(weighted(node) - a * masses[node]);
        }
        self.field(sum, moment)
    }

    /// The field of a mass-weighted sum and a moment about the center.
    pub(crate) fn field(&self, sum: DVec3, moment: DVec3) -> RigidField {
        RigidField {
            center: self.center,
            a: sum / self.mass,
            // One node, or nodes on a line, cannot turn in every way: those ways are left out.
            b: solve_semidefinite(self.tensor, moment),
        }
    }
}

/// Nodes as indices.
pub(crate) fn all(nodes: &[u32]) -> impl Iterator<Item = usize> + Clone {
    nodes.iter().map(|node| *node as usize)
}

/// `A⁻¹ b` of a symmetric positive semidefinite matrix on the span where it is not singular.
fn solve_semidefinite(a: DMat3, b: DVec3) -> DVec3 {
    let trace = a.x_axis.x + a.y_axis.y + a.z_axis.z;
    if trace <= 0.0 {
        return DVec3::ZERO;
    }
    let scaled = a * trace.recip();
    if scaled.determinant() > 1e-9 {
        return scaled.inverse() * (b / trace);
    }
    // Nearly singular: a ridge of 1e-6 of the trace leaves the free ways as they are.
    let ridge = DMat3::from_diagonal(DVec3::splat(1e-6));
    (scaled + ridge).inverse() * (b / trace)
}
