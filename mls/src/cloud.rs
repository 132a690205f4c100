//! A cloud that can be asked anywhere.

use glam::DVec3;

use crate::parallel::map_with;
use crate::search::{BallTree, check};
use crate::{
    Approximation, Basis, CloudError, Dimension, NearestSettings, Order, ShapeError, ShapeScratch,
    k_nearest,
};

/// Queries given to one task.
const QUERIES_PER_TASK: usize = 64;

/// What a [`Cloud`] approximates with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudSettings {
    /// Functions that come back exactly; their dimension says which coordinates count.
    pub basis: Basis,
    /// Number of nearest nodes whose mean distance sets a node's support radius.
    pub nearest: usize,
    /// What that distance is multiplied with.
    pub scale: f64,
}

impl Default for CloudSettings {
    /// Quadratic polynomials in space.
    fn default() -> Self {
        Self::new(Order::Quadratic, Dimension::Three)
    }
}

impl CloudSettings {
    /// Complete polynomials with supports that hold enough nodes for them.
    ///
    /// `h = 1.8` times the mean distance to the `3 m + 4` nearest, m the number of functions: the
    /// smallest of the pairs tried with which no query inside a box of random points failed, corners
    /// included, in any order and dimension (1.5 fails for constants and in space, `3 m` for
    /// constants). A support then holds 39 nodes on average under the linear basis in space, 78 under
    /// the quadratic one, and the worst condition is 3e6.
    #[must_use]
    pub fn new(order: Order, dimension: Dimension) -> Self {
        let basis = Basis::polynomial(order, dimension);
        Self {
            basis,
            nearest: 3 * basis.size() + 4,
            scale: 1.8,
        }
    }
}

/// A field at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Sample {
    /// `u(x)`.
    pub value: f64,
    /// `∇u(x)` (1/m times the field's unit), the derivative of `value`; 0 along coordinates that the
    /// basis does not span.
    pub gradient: DVec3,
    /// Condition of the scaled moment matrix: digits lost are about its logarithm.
    pub condition: f64,
}

/// Scattered points with supports and a search tree: fields on them can be asked anywhere.
///
/// `u(x) = Σ_j φ_j(x) u_j`, see [`Approximation::shape_functions_into`]. Polynomials of the basis come
/// back exactly, other fields smoothed: the value at a node is not the node's own.
#[derive(Debug, Clone)]
pub struct Cloud {
    points: Vec<DVec3>,
    support_radii: Vec<f64>,
    basis: Basis,
    tree: BallTree,
}

/// Work space of a query.
#[derive(Default)]
struct QueryScratch {
    nodes: Vec<u32>,
    values: Vec<f64>,
    gradients: Vec<DVec3>,
    shape: ShapeScratch,
}

impl Cloud {
    /// Takes points (m), shape `(n)`; coordinates that the basis does not span are dropped.
    ///
    /// # Errors
    /// [`CloudError`] for no points, points that are not finite, too many points, or a setting that is
    /// not positive.
    pub fn new(points: &[DVec3], settings: &CloudSettings) -> Result<Self, CloudError> {
        let flat = flatten(points, settings.basis);
        let supports = NearestSettings {
            nearest: settings.nearest,
            scale: settings.scale,
            limit: Some(1),
        };
        let radii = k_nearest(&flat, &supports)?.support_radii;
        Self::build(flat, radii, settings.basis)
    }

    fn build(
        points: Vec<DVec3>,
        support_radii: Vec<f64>,
        basis: Basis,
    ) -> Result<Self, CloudError> {
        check(&points)?;
        if points.is_empty() {
            return Err(CloudError::Empty);
        }
        Ok(Self {
            tree: BallTree::new(&points, support_radii.iter().copied()),
            points,
            support_radii,
            basis,
        })
    }

    /// `u(x)` of a field given at the nodes, shape `(n)`.
    ///
    /// # Errors
    /// [`ShapeError`] where too few supports hold the point or their nodes do not determine the basis.
    ///
    /// # Panics
    /// If the field does not have one value per node.
    pub fn value(&self, x: DVec3, field: &[f64]) -> Result<f64, ShapeError> {
        self.check_field(field);
        self.value_with(x, field, &mut QueryScratch::default())
    }

    /// [`Cloud::value`] at many points in parallel, an answer for each, shape `(points)`.
    ///
    /// # Panics
    /// As [`Cloud::value`].
    #[must_use]
    pub fn values(&self, points: &[DVec3], field: &[f64]) -> Vec<Result<f64, ShapeError>> {
        self.check_field(field);
        self.each(points, |x, scratch| self.value_with(x, field, scratch))
    }

    /// `u(x)`, `∇u(x)` and the condition of a field given at the nodes, shape `(n)`.
    ///
    /// # Errors
    /// As [`Cloud::value`].
    ///
    /// # Panics
    /// As [`Cloud::value`].
    pub fn sample(&self, x: DVec3, field: &[f64]) -> Result<Sample, ShapeError> {
        self.check_field(field);
        self.sample_with(x, field, &mut QueryScratch::default())
    }

    /// [`Cloud::sample`] at many points in parallel, an answer for each, shape `(points)`.
    ///
    /// # Panics
    /// As [`Cloud::value`].
    #[must_use]
    pub fn samples(&self, points: &[DVec3], field: &[f64]) -> Vec<Result<Sample, ShapeError>> {
        self.check_field(field);
        self.each(points, |x, scratch| self.sample_with(x, field, scratch))
    }

    /// Answers at many points; each point's is its own, so that threads change nothing.
    fn each<T: Send>(
        &self,
        points: &[DVec3],
        answer: impl Fn(DVec3, &mut QueryScratch) -> T + Sync,
    ) -> Vec<T> {
        map_with(points.len(), QUERIES_PER_TASK, |scratch, at| {
            answer(points[at], scratch)
        })
    }

    fn check_field(&self, field: &[f64]) {
        assert_eq!(field.len(), self.points.len(), "one field value per node");
    }

    fn supports_into(&self, x: DVec3, nodes: &mut Vec<u32>) {
        nodes.clear();
        let x = self.basis.dimension().flatten(x);
        if !x.is_finite() {
            return;
        }
        nodes.extend(self.tree.around(x).filter(|&node| {
            let node = node as usize;
            (x - self.points[node]).length() < self.support_radii[node]
        }));
        nodes.sort_unstable();
    }

    fn approximation(&self) -> Approximation<'_> {
        Approximation {
            nodes: &self.points,
            support_radii: &self.support_radii,
            basis: self.basis,
        }
    }

    /// Nodes that count at a point, and work space of their number.
    fn gather(&self, x: DVec3, scratch: &mut QueryScratch) -> Result<(), ShapeError> {
        if !x.is_finite() {
            return Err(ShapeError::NotFinite);
        }
        self.supports_into(x, &mut scratch.nodes);
        scratch.values.resize(scratch.nodes.len(), 0.0);
        Ok(())
    }

    fn value_with(
        &self,
        x: DVec3,
        field: &[f64],
        scratch: &mut QueryScratch,
    ) -> Result<f64, ShapeError> {
        self.gather(x, scratch)?;
        let (nodes, values) = (&scratch.nodes, &mut scratch.values);
        let approximation = self.approximation();
        approximation.shape_values_into(x, nodes, &mut scratch.shape, values)?;
        let mut value = 0.0;
        for (phi, &node) in values.iter().zip(nodes) {
            value += phi * field[node as usize];
        }
        Ok(value)
    }

    fn sample_with(
        &self,
        x: DVec3,
        field: &[f64],
        scratch: &mut QueryScratch,
    ) -> Result<Sample, ShapeError> {
        self.gather(x, scratch)?;
        let QueryScratch {
            nodes,
            values,
            gradients,
            shape,
        } = scratch;
        gradients.resize(nodes.len(), DVec3::ZERO);
        let approximation = self.approximation();
        let mut sample = Sample {
            value: 0.0,
            gradient: DVec3::ZERO,
            condition: approximation.shape_functions_into(x, nodes, shape, values, gradients)?,
        };
        for (k, &node) in nodes.iter().enumerate() {
            let u = field[node as usize];
            sample.value += values[k] * u;
            sample.gradient += gradients[k] * u;
        }
        Ok(sample)
    }
}

fn flatten(points: &[DVec3], basis: Basis) -> Vec<DVec3> {
    let dimension = basis.dimension();
    points.iter().map(|&x| dimension.flatten(x)).collect()
}

#[cfg(test)]
mod tests;
