//! Surfels follow their nodes.

use crate::binding::Binding;
use crate::cast::index;
use crate::surfels::Surfels;
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Surfels in the deformed frame, ready to draw; one entry per surfel in every array. The fields of
/// normals (`bends_*`) and the rest axes (`rest_*`) may be left empty: flat disks, a texture constant
/// over each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Splats {
    /// Centres (m).
    pub positions: Vec<DVec3>,
    /// First half-axis: the image of the rest disk's first tangent times radius (m).
    pub axes_u: Vec<DVec3>,
    /// Second half-axis (m).
    pub axes_v: Vec<DVec3>,
    /// Outward unit normals.
    pub normals: Vec<DVec3>,
    /// Change of the normal from the centre to the end of the first axis (Aras 2014, eq. (51):
    /// a linear field of normals over the disk).
    pub bends_u: Vec<DVec3>,
    /// Change of the normal from the centre to the end of the second axis.
    pub bends_v: Vec<DVec3>,
    /// First axis in the rest frame (m): how texture coordinates vary over the disk.
    pub rest_u: Vec<DVec3>,
    /// Second axis in the rest frame (m).
    pub rest_v: Vec<DVec3>,
}

impl Splats {
    /// Appends all of another body's splats.
    pub fn extend(&mut self, other: &Self) {
        self.positions.extend(&other.positions);
        self.axes_u.extend(&other.axes_u);
        self.axes_v.extend(&other.axes_v);
        self.normals.extend(&other.normals);
        self.bends_u.extend(&other.bends_u);
        self.bends_v.extend(&other.bends_v);
        self.rest_u.extend(&other.rest_u);
        self.rest_v.extend(&other.rest_v);
    }

    /// The undeformed surfels.
    #[must_use]
    pub fn at_rest(surfels: &Surfels) -> Self {
        let mut out = Self::default();
        for i in 0..surfels.len() {
            let (t0, t1) = Surfels::tangents(surfels.normals[i]);
            out.positions.push(surfels.positions[i]);
            out.axes_u.push(t0 * surfels.radii[i]);
            out.axes_v.push(t1 * surfels.radii[i]);
            out.normals.push(surfels.normals[i]);
            let [a, b] = bends(surfels.shapes[i], t0, t1);
            out.bends_u.push(a * surfels.radii[i]);
            out.bends_v.push(b * surfels.radii[i]);
            out.rest_u.push(t0 * surfels.radii[i]);
            out.rest_v.push(t1 * surfels.radii[i]);
        }
        out
    }
}

/// Change of the rest normal per metre along the two tangents.
#[inline]
fn bends(shape: DVec3, t0: DVec3, t1: DVec3) -> [DVec3; 2] {
    [t0 * shape.x + t1 * shape.y, t0 * shape.y + t1 * shape.z]
}

/// Carries surfels by their nodes' positions and deformation gradients.
///
/// `x(X) = Σ w_i(X) p_i` with `p_i = x_i + F_i (X - X_i)`. The disk's axes are r times the derivative
/// of x along the tangents, `F t + Σ p_i (∇w_i · t)` with `F = Σ w_i F_i`: neighbouring disks move
/// apart just as they grow, so that no hole opens where nodes disagree. The normal is `cof(F) N`
/// normalised, smoother than the disk's own; the linear field of normals over the disk is carried by
/// the same cofactor: where Aras 2014 calls Phong splatting (eq. (51)) unfit for bodies that deform,
/// this keeps it at the price of two products. All this replaces Aras 2014, eq. (59)
/// (`x = X + Σ w_i u_i / Σ w_i`, in print without its sum), which drags surfels behind in a rotation
/// and leaves normals where they were.
///
/// # Arguments
/// * `rest_nodes`, `nodes` -- node positions in the rest and the deformed frame (m), shape `(n)`.
/// * `gradients` -- deformation gradients of the nodes (1), shape `(n)`.
/// * `max_stretch` -- a disk's axis never grows beyond this times its radius: an overstretched
///   node near a cut would otherwise throw a disk over the picture.
/// * `splats` -- output, resized.
///
/// # Panics
/// If the slices disagree in length.
///
/// # Numerics
/// An affine map of the nodes with its gradient is reproduced to round-off. A singular `F` keeps
/// the rest normal. Same bits at any thread count.
#[allow(
    clippy::too_many_arguments,
    reason = "plain arrays in, plain arrays out"
)]
pub fn carry_into(
    surfels: &Surfels,
    binding: &Binding,
    rest_nodes: &[DVec3],
    nodes: &[DVec3],
    gradients: &[DMat3],
    max_stretch: f64,
    splats: &mut Splats,
) {
    let n = surfels.len();
    assert_eq!(binding.len(), n, "one binding row per surfel");
    assert_eq!(rest_nodes.len(), nodes.len(), "one position per node");
    assert_eq!(gradients.len(), nodes.len(), "one gradient per node");
    splats.positions.resize(n, DVec3::ZERO);
    splats.axes_u.resize(n, DVec3::ZERO);
    splats.axes_v.resize(n, DVec3::ZERO);
    splats.normals.resize(n, DVec3::ZERO);
    splats.bends_u.resize(n, DVec3::ZERO);
    splats.bends_v.resize(n, DVec3::ZERO);
    splats.rest_u.resize(n, DVec3::ZERO);
    splats.rest_v.resize(n, DVec3::ZERO);
    splats
        .positions
        .par_iter_mut()
        .zip(&mut splats.axes_u)
        .zip(&mut splats.axes_v)
        .zip(&mut splats.normals)
        .zip(splats.bends_u.par_iter_mut().zip(&mut splats.bends_v))
        .zip(splats.rest_u.par_iter_mut().zip(&mut splats.rest_v))
        .enumerate()
        .with_min_len(256)
        .for_each(
            |(i, (((((x, u), v), normal), (bend_u, bend_v)), (rest_u, rest_v)))| {
                let rest = surfels.positions[i];
                let (row, weights) = binding.row(i);
                let image = |node: usize| nodes[node] + gradients[node] * (rest - rest_nodes[node]);
                let first = image(index(row[0]));
                let mut at = first;
                let mut f = DMat3::ZERO;
                // What the change of the weights over the disk adds to its axes.
                let mut drift = [DVec3::ZERO; 2];
                for ((&node, &w), slope) in row.iter().zip(weights).zip(binding.slopes(i)) {
                    let node = index(node);
                    let aside = image(node) - first;
                    at += aside * w;
                    f += gradients[node] * w;
                    drift[0] += aside * slope[0];
                    drift[1] += aside * slope[1];
                }
                let rest_normal = surfels.normals[i];
                let (t0, t1) = Surfels::tangents(rest_normal);
                let (a, b) = (f * t0, f * t1);
                *x = at;
                let radius = surfels.radii[i];
                let raw = a.cross(b);
                let length = raw.length();
                if length > 0.0 {
                    let cofactor = DMat3::from_cols(
                        f.y_axis.cross(f.z_axis),
                        f.z_axis.cross(f.x_axis),
                        f.x_axis.cross(f.y_axis),
                    );
                    *normal = raw / length;
                    let [p, q] = bends(surfels.shapes[i], t0, t1);
                    *bend_u = cofactor * p * (radius / length);
                    *bend_v = cofactor * q * (radius / length);
                } else {
                    *normal = rest_normal;
                    *bend_u = DVec3::ZERO;
                    *bend_v = DVec3::ZERO;
                }
                (*rest_u, *rest_v) = (t0 * radius, t1 * radius);
                *u = (a + drift[0]).clamp_length_max(max_stretch) * radius;
                *v = (b + drift[1]).clamp_length_max(max_stretch) * radius;
            },
        );
}
