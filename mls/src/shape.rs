//! Shape functions and their gradients at arbitrary points.

use glam::DVec3;

use crate::basis::{BasisValues, LARGEST_BASIS};
use crate::{Basis, ShapeError, kernel, kernel_slope};

/// Square of the smallest pivot, relative to its diagonal, below which a moment matrix counts as
/// singular: at this point a reproduced polynomial keeps no digit.
const SINGULAR_PIVOT: f64 = 1e-14;

/// Nodes of a cloud with their supports and the approximation on them.
///
/// Coordinates that the basis does not span are not looked at, neither in the basis nor in distances.
#[derive(Debug, Clone, Copy)]
pub struct Approximation<'a> {
    /// Node positions (m), shape `(n)`.
    pub nodes: &'a [DVec3],
    /// Support radii (m), shape `(n)`, positive.
    pub support_radii: &'a [f64],
    /// Basis of the approximation.
    pub basis: Basis,
}

/// Workspace of [`Approximation::shape_functions_into`]; contents on entry do not matter.
#[derive(Debug, Clone, Default)]
pub struct ShapeScratch {
    weights: Vec<f64>,
    weight_gradients: Vec<DVec3>,
    values: Vec<BasisValues>,
}

/// A point's moment matrix solved.
struct Fit {
    /// What lengths are divided by (m).
    scale: f64,
    inverse: Matrix,
    /// Condition of the scaled moment matrix.
    condition: f64,
    /// `A⁻¹ p(x)`.
    a: BasisValues,
}

impl Approximation<'_> {
    /// Shape functions and gradients of some nodes at one point.
    ///
    /// `φ_j = p(x)ᵀ A⁻¹ w_j p(x_j)` with `A = Σ_j w_j p(x_j) p(x_j)ᵀ` and
    /// `w_j = w(|x − x_j| / h_j)` (Aras 2014, eqs. (11), (19)); the gradient is the full one,
    /// `∇φ_j = ∇w_j aᵀp_j + w_j p_jᵀ A⁻¹ (∇p − ∇A a)`, `a = A⁻¹ p(x)`. Polynomials are taken
    /// around x in units of the largest distance, which leaves φ unchanged and A well scaled.
    ///
    /// # Arguments
    /// * `x` -- evaluation point (m).
    /// * `neighbors` -- nodes to use, unique; those whose support does not hold x get 0.
    /// * `phi`, `gradient` -- outputs, overwritten: values (1) and gradients (1/m), shape of
    ///   `neighbors`.
    ///
    /// Returns the condition number of the scaled moment matrix (1-norm).
    ///
    /// # Errors
    /// [`ShapeError`] if fewer supports than the basis has functions hold x, or if the moment matrix is
    /// singular. Outputs are then unspecified.
    ///
    /// # Panics
    /// If an output is not as long as `neighbors`, or an index is out of range.
    ///
    /// # Numerics
    /// Reproduces the basis to about `condition · ε`. Sums run in the order of `neighbors`. Allocates
    /// only to grow the scratch.
    pub fn shape_functions_into(
        &self,
        x: DVec3,
        neighbors: &[u32],
        scratch: &mut ShapeScratch,
        phi: &mut [f64],
        gradient: &mut [DVec3],
    ) -> Result<f64, ShapeError> {
        assert_eq!(phi.len(), neighbors.len(), "one value per neighbour");
        let count = neighbors.len();
        assert_eq!(gradient.len(), count, "one gradient per neighbour");
        let m = self.basis.size();
        let fit = self.fit(x, neighbors, scratch)?;
        let a = fit.a;
        // A⁻¹ (∇p − ∇A a) for each axis, with ∇A a = Σ ∇w_j p_j (p_jᵀ a).
        let mut changes = self.basis.gradients(x, x, fit.scale);
        for (dw, p) in scratch.weight_gradients.iter().zip(&scratch.values) {
            let along = dot(p, &a, m);
            for (change, part) in changes.iter_mut().zip(dw.to_array()) {
                for k in 0..m {
                    change[k] -= part * along * p[k];
                }
            }
        }
        let changes = changes.map(|change| multiply(&fit.inverse, &change, m));
        let data = scratch.weights.iter().zip(&scratch.weight_gradients);
        let data = data.zip(&scratch.values);
        for (((w, dw), p), (phi, gradient)) in data.zip(phi.iter_mut().zip(gradient)) {
            let along = dot(p, &a, m);
            *phi = w * along;
            let change = DVec3::from_array([0, 1, 2].map(|axis| dot(p, &changes[axis], m)));
            *gradient = *dw * along + change * *w;
        }
        Ok(fit.condition)
    }

    /// Shape functions alone, see [`Approximation::shape_functions_into`].
    ///
    /// # Errors
    /// As there.
    ///
    /// # Panics
    /// As there.
    pub fn shape_values_into(
        &self,
        x: DVec3,
        neighbors: &[u32],
        scratch: &mut ShapeScratch,
        phi: &mut [f64],
    ) -> Result<f64, ShapeError> {
        assert_eq!(phi.len(), neighbors.len(), "one value per neighbour");
        let m = self.basis.size();
        let Fit { condition, a, .. } = self.fit(x, neighbors, scratch)?;
        for ((w, p), phi) in scratch.weights.iter().zip(&scratch.values).zip(phi) {
            *phi = w * dot(p, &a, m);
        }
        Ok(condition)
    }

    /// Weighs the neighbours and solves for what the basis at `x` takes of them.
    fn fit(
        &self,
        x: DVec3,
        neighbors: &[u32],
        scratch: &mut ShapeScratch,
    ) -> Result<Fit, ShapeError> {
        let scale = self.weigh(x, neighbors, scratch)?;
        let m = self.basis.size();
        let mut moment = [[0.0; LARGEST_BASIS]; LARGEST_BASIS];
        for (w, p) in scratch.weights.iter().zip(&scratch.values) {
            add_outer(&mut moment, *w, p, m);
        }
        let (inverse, condition) = invert(&moment, m)?;
        let a = multiply(&inverse, &self.basis.values(x, x, scale), m);
        Ok(Fit {
            scale,
            inverse,
            condition,
            a,
        })
    }

    /// Weights, their gradients and basis values of all neighbours; returns the length scale.
    fn weigh(
        &self,
        x: DVec3,
        neighbors: &[u32],
        scratch: &mut ShapeScratch,
    ) -> Result<f64, ShapeError> {
        scratch.weights.clear();
        scratch.weight_gradients.clear();
        scratch.values.clear();
        let dimension = self.basis.dimension();
        let mut found = 0;
        let mut scale: f64 = 0.0;
        for &node in neighbors {
            let from = dimension.flatten(x - self.nodes[node as usize]);
            let h = self.support_radii[node as usize];
            let r = from.length();
            let held = r < h;
            let w = if held { kernel(r / h) } else { 0.0 };
            if w > 0.0 {
                found += 1;
                scale = scale.max(r);
            }
            let slope = if held && r > 0.0 {
                kernel_slope(r / h) / (h * r)
            } else {
                0.0
            };
            scratch.weights.push(w);
            scratch.weight_gradients.push(from * slope);
        }
        let needed = self.basis.size();
        if found < needed {
            return Err(ShapeError::TooFewNeighbors { found, needed });
        }
        let scale = if scale > 0.0 { scale } else { 1.0 };
        let basis = self.basis;
        let nodes = neighbors.iter().map(|&node| self.nodes[node as usize]);
        scratch
            .values
            .extend(nodes.map(|node| basis.values(node, x, scale)));
        Ok(scale)
    }
}

type Matrix = [[f64; LARGEST_BASIS]; LARGEST_BASIS];

/// `A += w p pᵀ`, lower triangle.
fn add_outer(matrix: &mut Matrix, w: f64, p: &BasisValues, m: usize) {
    for i in 0..m {
        let wp = w * p[i];
        for j in 0..=i {
            matrix[i][j] += wp * p[j];
        }
    }
}

fn dot(a: &BasisValues, b: &BasisValues, m: usize) -> f64 {
    let mut sum = 0.0;
    for k in 0..m {
        sum += a[k] * b[k];
    }
    sum
}

fn multiply(matrix: &Matrix, vector: &BasisValues, m: usize) -> BasisValues {
    let mut out = [0.0; LARGEST_BASIS];
    for i in 0..m {
        out[i] = dot(&matrix[i], vector, m);
    }
    out
}

/// Inverse and 1-norm condition of a symmetric positive definite matrix (lower triangle given), by
/// Cholesky after scaling the diagonal to 1.
fn invert(matrix: &Matrix, m: usize) -> Result<(Matrix, f64), ShapeError> {
    let mut scale = [0.0; LARGEST_BASIS];
    for k in 0..m {
        if !(matrix[k][k] > 0.0 && matrix[k][k].is_finite()) {
            return Err(ShapeError::SingularMoment { function: k });
        }
        scale[k] = matrix[k][k].sqrt().recip();
    }
    let mut factor = [[0.0; LARGEST_BASIS]; LARGEST_BASIS];
    let mut norm = [0.0; LARGEST_BASIS];
    for i in 0..m {
        for j in 0..=i {
            let entry = matrix[i][j] * scale[i] * scale[j];
            norm[j] += entry.abs();
            if i != j {
                norm[i] += entry.abs();
            }
            let mut rest = entry;
            for (a, b) in factor[i].iter().zip(&factor[j]).take(j) {
                rest -= a * b;
            }
            if i == j {
                if rest.is_nan() || rest < SINGULAR_PIVOT {
                    return Err(ShapeError::SingularMoment { function: i });
                }
                factor[i][i] = rest.sqrt();
            } else {
                factor[i][j] = rest / factor[j][j];
            }
        }
    }
    let (inverse, inverse_norm) = invert_factor(&factor, &scale, m);
    let largest = |values: &BasisValues| values.iter().fold(0.0_f64, |most, v| most.max(*v));
    Ok((inverse, largest(&norm) * largest(&inverse_norm)))
}

/// `S L⁻ᵀ L⁻¹ S` of a Cholesky factor L and a diagonal S, and the column sums of `|L⁻ᵀ L⁻¹|`.
fn invert_factor(factor: &Matrix, scale: &BasisValues, m: usize) -> (Matrix, BasisValues) {
    let mut back = [[0.0; LARGEST_BASIS]; LARGEST_BASIS];
    for j in 0..m {
        back[j][j] = factor[j][j].recip();
        for i in j + 1..m {
            let mut sum = 0.0;
            for k in j..i {
                sum += factor[i][k] * back[k][j];
            }
            back[i][j] = -sum / factor[i][i];
        }
    }
    let mut inverse = [[0.0; LARGEST_BASIS]; LARGEST_BASIS];
    let mut inverse_norm = [0.0_f64; LARGEST_BASIS];
    for i in 0..m {
        for j in 0..=i {
            let mut sum = 0.0;
            for row in &back[i..m] {
                sum += row[i] * row[j];
            }
            inverse_norm[j] += sum.abs();
            if i != j {
                inverse_norm[i] += sum.abs();
            }
            inverse[i][j] = sum * scale[i] * scale[j];
            inverse[j][i] = inverse[i][j];
        }
    }
    (inverse, inverse_norm)
}

#[cfg(test)]
mod tests;
