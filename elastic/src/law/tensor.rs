//! Small tensors.

use glam::{DMat3, DVec3};

/// `A : B`.
#[inline]
pub(crate) fn double_dot(a: DMat3, b: DMat3) -> f64 {
    a.x_axis.dot(b.x_axis) + a.y_axis.dot(b.y_axis) + a.z_axis.dot(b.z_axis)
}

/// `a bᵀ`.
#[inline]
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// `cof F = J F⁻ᵀ = dJ/dF`, also where `F` is singular.
#[inline]
pub(crate) fn cofactor(f: DMat3) -> DMat3 {
    DMat3::from_cols(
        f.y_axis.cross(f.z_axis),
        f.z_axis.cross(f.x_axis),
        f.x_axis.cross(f.y_axis),
    )
}

/// `J`.
#[inline]
pub(crate) fn volume_ratio(f: DMat3) -> f64 {
    f.x_axis.dot(f.y_axis.cross(f.z_axis))
}

/// Change of the cofactor for a change `dF`.
pub(crate) fn cofactor_change(f: DMat3, df: DMat3) -> DMat3 {
    DMat3::from_cols(
        df.y_axis.cross(f.z_axis) + f.y_axis.cross(df.z_axis),
        df.z_axis.cross(f.x_axis) + f.z_axis.cross(df.x_axis),
        df.x_axis.cross(f.y_axis) + f.x_axis.cross(df.y_axis),
    )
}
