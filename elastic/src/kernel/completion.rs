//! Nodes whose neighbours span only a plane, a line or nothing.
//!
//! Such a row gives the deformation gradient on the span alone, `F_x = Pi + sum u_ij g_ij^T`.
//! `F` is completed with unit vectors normal to the deformed span, so that the missing directions
//! carry no strain and a rigid motion none at all (a Tikhonov term or `I + grad u` would read a
//! rotation as strain). The energy `W(F(F_x))` is then differentiated exactly.

use glam::{DMat3, DVec3};

use crate::law::tensor::{cofactor, outer, volume_ratio};

/// Largest distance of an eigenvalue of `sum X_ij g_ij^T` from 0 or 1, and deviation from the identity up to which a row
/// counts as full without an eigenvalue problem.
const PROJECTOR_TOLERANCE: f64 = 1e-6;

/// Relative size below which a deformed plane or line counts as collapsed.
const DEGENERATE: f64 = 1e-12;

/// Span of a row in the rest frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Span {
    /// 0, 1 or 2 (3 needs no completion).
    pub(crate) rank: u8,
    /// Right-handed orthonormal columns, those in the span first.
    pub(crate) frame: DMat3,
}

/// Result of looking at `sum X_ij g_ij^T`.
pub(crate) enum RowKind {
    Full,
    Deficient(Span),
    Inconsistent(f64),
}

impl Span {
    /// Orthogonal projector onto the span.
    pub(crate) fn projector(&self) -> DMat3 {
        let mut p = DMat3::ZERO;
        for axis in 0..usize::from(self.rank) {
            p += outer(self.frame.col(axis), self.frame.col(axis));
        }
        p
    }

    /// Completes `F_x`.
    #[cold]
    pub(crate) fn complete(&self, fx: DMat3) -> DMat3 {
        match self.rank {
            0 => DMat3::IDENTITY,
            1 => {
                let along = (fx * self.frame.x_axis).normalize_or(self.frame.x_axis);
                let (b2, b3) = along.any_orthonormal_pair();
                fx + outer(b2, self.frame.y_axis) + outer(b3, self.frame.z_axis)
            }
            _ => {
                let (t1, t2) = (fx * self.frame.x_axis, fx * self.frame.y_axis);
                let first = t1.length_squared() >= t2.length_squared();
                let longer = if first { t1 } else { t2 };
                let fallback = longer.normalize_or(self.frame.x_axis);
                let fallback = fallback.any_orthonormal_vector();
                let cross = t1.cross(t2);
                let normal = if cross.length() > DEGENERATE * longer.length_squared() {
                    cross.normalize_or(fallback)
                } else {
                    fallback
                };
                fx + outer(normal, self.frame.z_axis)
            }
        }
    }

    /// The part of a stress at the completed `f` that works on changes of `F_x`.
    #[cold]
    pub(crate) fn project(&self, f: DMat3, stress: DMat3) -> DMat3 {
        let deformed = match self.rank {
            0 => DMat3::ZERO,
            1 => {
                let along = (f * self.frame.x_axis).normalize_or_zero();
                outer(along, along)
            }
            _ => {
                let normal = f * self.frame.z_axis;
                DMat3::IDENTITY - outer(normal, normal)
            }
        };
        deformed * stress * self.projector()
    }

    /// Change of the completed `f` for a change of `F_x`.
    pub(crate) fn complete_change(&self, f: DMat3, dfx: DMat3) -> DMat3 {
        match self.rank {
            0 => DMat3::ZERO,
            1 => {
                // The normals follow the least rotation that takes the line along.
                let a = f * self.frame.x_axis;
                let length_squared = a.length_squared();
                if length_squared < DEGENERATE {
                    return DMat3::ZERO;
                }
                let spin = a.cross(dfx * self.frame.x_axis) / length_squared;
                let (b2, b3) = (f * self.frame.y_axis, f * self.frame.z_axis);
                dfx + outer(spin.cross(b2), self.frame.y_axis)
                    + outer(spin.cross(b3), self.frame.z_axis)
            }
            _ => dfx + outer(self.turned_normal(f, dfx), self.frame.z_axis),
        }
    }

    /// Change of the deformed plane's unit normal; zero for a collapsed plane.
    fn turned_normal(&self, f: DMat3, dfx: DMat3) -> DVec3 {
        let j = volume_ratio(f);
        if j < DEGENERATE {
            return DVec3::ZERO;
        }
        let normal = f * self.frame.z_axis;
        cofactor(f) * (dfx.transpose() * normal) * (-1.0 / j)
    }

    /// Change of the projected stress: `stress` at the completed `f`, `change` its change for
    /// [`Span::complete_change`].
    pub(crate) fn project_change(
        &self,
        f: DMat3,
        dfx: DMat3,
        stress: DMat3,
        change: DMat3,
    ) -> DMat3 {
        match self.rank {
            0 => DMat3::ZERO,
            1 => {
                let t = self.frame.x_axis;
                let a = f * t;
                let length = a.length();
                if length * length < DEGENERATE {
                    return DMat3::ZERO;
                }
                let along = a / length;
                let da = dfx * t;
                let turned = (da - along * along.dot(da)) / length;
                // P projected is (â·P t) â tᵀ.
                let size = along.dot(stress * t);
                let grown = turned.dot(stress * t) + along.dot(change * t);
                outer(along * grown + turned * size, t)
            }
            _ => {
                let normal = f * self.frame.z_axis;
                let turned = self.turned_normal(f, dfx);
                let deformed = DMat3::IDENTITY - outer(normal, normal);
                let swing = outer(turned, normal) + outer(normal, turned);
                (deformed * change - swing * stress) * self.projector()
            }
        }
    }
}

/// Reads rank and span off `m = sum X_ij g_ij^T`, the identity for a full row.
pub(crate) fn row_kind(m: DMat3) -> RowKind {
    if !m.is_finite() {
        return RowKind::Inconsistent(f64::INFINITY);
    }
    let off = m - DMat3::IDENTITY;
    if largest(off) <= PROJECTOR_TOLERANCE {
        return RowKind::Full;
    }
    let skew = largest(m - m.transpose());
    if skew > PROJECTOR_TOLERANCE {
        return RowKind::Inconsistent(skew);
    }
    let (values, vectors) = symmetric_eigen(m);
    let mut kept = [DVec3::ZERO; 3];
    let mut rank = 0;
    let mut dropped = 2;
    for (value, vector) in values.into_iter().zip(vectors) {
        let residual = value.abs().min((value - 1.0).abs());
        if residual > PROJECTOR_TOLERANCE {
            return RowKind::Inconsistent(residual);
        }
        if value > 0.5 {
            kept[usize::from(rank)] = vector;
            rank += 1;
        } else {
            kept[dropped] = vector;
            dropped = dropped.saturating_sub(1);
        }
    }
    if rank == 3 {
        return RowKind::Full;
    }
    let mut frame = DMat3::from_cols(kept[0], kept[1], kept[2]);
    if frame.determinant() < 0.0 {
        frame.z_axis = -frame.z_axis;
    }
    RowKind::Deficient(Span { rank, frame })
}

/// Largest over smallest eigenvalue of a symmetric matrix; infinite if the smallest is not positive.
pub(crate) fn condition(m: DMat3) -> f64 {
    let (values, _) = symmetric_eigen(m);
    let [a, b, c] = values;
    let (least, most) = (a.min(b).min(c), a.max(b).max(c));
    if least > 0.0 {
        most / least
    } else {
        f64::INFINITY
    }
}

/// Largest absolute entry.
fn largest(m: DMat3) -> f64 {
    let values = m.to_cols_array();
    values.iter().fold(0.0, |most: f64, v| most.max(v.abs()))
}

/// Eigenvalues and orthonormal eigenvectors of a symmetric matrix by cyclic Jacobi rotations.
pub(crate) fn symmetric_eigen(m: DMat3) -> ([f64; 3], [DVec3; 3]) {
    let mut a = m.to_cols_array_2d();
    let mut v = DMat3::IDENTITY.to_cols_array_2d();
    for _ in 0..30 {
        let off = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
        if off <= f64::MIN_POSITIVE {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q].abs() <= f64::MIN_POSITIVE {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = (t * t + 1.0).sqrt().recip();
            let s = t * c;
            for row in &mut a {
                let (x, y) = (row[p], row[q]);
                row[p] = c * x - s * y;
                row[q] = s * x + c * y;
            }
            let (x, y) = (a[p], a[q]);
            for k in 0..3 {
                a[p][k] = c * x[k] - s * y[k];
                a[q][k] = s * x[k] + c * y[k];
            }
            let (x, y) = (v[p], v[q]);
            for k in 0..3 {
                v[p][k] = c * x[k] - s * y[k];
                v[q][k] = s * x[k] + c * y[k];
            }
        }
    }
    ([a[0][0], a[1][1], a[2][2]], v.map(DVec3::from_array))
}
