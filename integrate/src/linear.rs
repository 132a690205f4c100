//! Conjugate gradients, preconditioned by diagonal blocks.

use crate::supports::BoundaryConditions;
use crate::vector::{add_scaled, dot, norm, update};
use glam::{DMat3, DVec3};

/// Work arrays, kept between solves.
#[derive(Debug, Clone, Default)]
pub(crate) struct Conjugate {
    residual: Vec<DVec3>,
    preconditioned: Vec<DVec3>,
    direction: Vec<DVec3>,
    image: Vec<DVec3>,
    /// Inverse of each node's diagonal block on its free directions; one for all if empty.
    pub(crate) inverse_blocks: Vec<DMat3>,
}

impl Conjugate {
    /// Sets the preconditioner from diagonal blocks and supports. A block that is not positive
    /// definite is replaced by the mean of its diagonal.
    pub(crate) fn set_blocks(&mut self, blocks: &[DMat3], supports: &BoundaryConditions) {
        self.inverse_blocks.clear();
        self.inverse_blocks
            .extend(blocks.iter().enumerate().map(|(node, block)| {
                let free = supports.of(node).map_or(DMat3::IDENTITY, |s| s.free);
                let trace = (block.x_axis.x + block.y_axis.y + block.z_axis.z) / 3.0;
                let fill = if trace > 0.0 { trace } else { 1.0 };
                // Held directions get a stiffness of their own, so that the block can be inverted.
                let held = DMat3::IDENTITY - free;
                let inner = free * *block * free + held * fill;
                let safe = positive_definite(&inner).then(|| inner.inverse());
                let inverse =
                    safe.unwrap_or_else(|| DMat3::from_diagonal(DVec3::splat(fill.recip())));
                free * inverse * free
            }));
    }

    /// Solves `A x = b` from `x = 0` until `|b − A x| ≤ tolerance · |b|`; `product` writes `A v`, and `b` has no fixed parts.
    /// Returns the iterations taken. A direction of negative curvature ends the solve; what was found
    /// so far still descends.
    pub(crate) fn solve(
        &mut self,
        mut product: impl FnMut(&[DVec3], &mut [DVec3]),
        b: &[DVec3],
        x: &mut [DVec3],
        (tolerance, limit): (f64, usize),
    ) -> usize {
        let n = b.len();
        x.fill(DVec3::ZERO);
        self.residual.clear();
        self.residual.extend_from_slice(b);
        self.preconditioned.resize(n, DVec3::ZERO);
        self.direction.resize(n, DVec3::ZERO);
        self.image.resize(n, DVec3::ZERO);
        let goal = tolerance * norm(b);
        let mut iterations = 0;
        let mut rho = self.precondition();
        self.direction.copy_from_slice(&self.preconditioned);
        while norm(&self.residual) > goal && iterations < limit && rho > 0.0 {
            product(&self.direction, &mut self.image);
            iterations += 1;
            let curvature = dot(&self.direction, &self.image);
            if curvature <= 0.0 || !curvature.is_finite() {
                if iterations == 1 {
                    x.copy_from_slice(&self.direction);
                }
                break;
            }
            let alpha = rho / curvature;
            add_scaled(x, alpha, &self.direction);
            add_scaled(&mut self.residual, -alpha, &self.image);
            let next = self.precondition();
            let beta = next / rho;
            rho = next;
            let z = &self.preconditioned;
            update(&mut self.direction, |i, p| *p = z[i] + *p * beta);
        }
        iterations
    }

    /// `z = P r`; returns `r · z`.
    fn precondition(&mut self) -> f64 {
        let (r, blocks) = (&self.residual, &self.inverse_blocks);
        if blocks.is_empty() {
            self.preconditioned.copy_from_slice(r);
        } else {
            update(&mut self.preconditioned, |i, z| *z = blocks[i] * r[i]);
        }
        dot(r, &self.preconditioned)
    }
}

/// Leading minors of a symmetric matrix, against round-off of its size.
fn positive_definite(a: &DMat3) -> bool {
    let size = a.x_axis.x.abs().max(a.y_axis.y.abs()).max(a.z_axis.z.abs());
    let second = a.x_axis.x * a.y_axis.y - a.x_axis.y * a.y_axis.x;
    let small = 1e-12;
    a.x_axis.x > small * size
        && second > small * size * size
        && a.determinant() > small * size * size * size
}
