//! Surfels in the deformed frame.

use crate::render::surfels::Surfels;
use glam::DVec3;

/// Surfels in the deformed frame, ready to draw; one entry per surfel in every array. The fields of
/// normals (`normal_derivatives_*`) may be left empty: flat disks.
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
    pub normal_derivatives_u: Vec<DVec3>,
    /// Change of the normal from the centre to the end of the second axis.
    pub normal_derivatives_v: Vec<DVec3>,
}

impl Splats {
    /// Appends all of another body's splats.
    pub fn extend(&mut self, other: &Self) {
        self.positions.extend(&other.positions);
        self.axes_u.extend(&other.axes_u);
        self.axes_v.extend(&other.axes_v);
        self.normals.extend(&other.normals);
        self.normal_derivatives_u
            .extend(&other.normal_derivatives_u);
        self.normal_derivatives_v
            .extend(&other.normal_derivatives_v);
    }

    /// Heap bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let vectors = [&self.positions, &self.axes_u, &self.axes_v];
        let normals = [
            &self.normals,
            &self.normal_derivatives_u,
            &self.normal_derivatives_v,
        ];
        let all = vectors.iter().chain(&normals);
        all.map(|vectors| size_of_val(&***vectors)).sum()
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
            let [a, b] = normal_derivatives(surfels.shapes[i], t0, t1);
            out.normal_derivatives_u.push(a * surfels.radii[i]);
            out.normal_derivatives_v.push(b * surfels.radii[i]);
        }
        out
    }

    /// Mean curvature (1/m) of the carried surface at one splat, positive where it bulges: half the
    /// trace of the second fundamental form in the metric of the disk's axes.
    ///
    /// As good as the normals' change over a disk: a few percent on a smooth surface, nothing across a
    /// crease. Not finite for a disk without area.
    ///
    /// # Panics
    /// If there is no such splat.
    #[must_use]
    pub fn mean_curvature(&self, splat: usize) -> f64 {
        let (u, v) = (self.axes_u[splat], self.axes_v[splat]);
        let (a, b) = (
            self.normal_derivatives_u[splat],
            self.normal_derivatives_v[splat],
        );
        let [uu, uv, vv] = [u.dot(u), u.dot(v), v.dot(v)];
        let determinant = uu * vv - uv * uv;
        0.5 * (a.dot(u) * vv - (a.dot(v) + b.dot(u)) * uv + b.dot(v) * uu) / determinant
    }
}

/// Change of the rest normal per metre along the two tangents.
#[inline]
pub(crate) fn normal_derivatives(shape: DVec3, t0: DVec3, t1: DVec3) -> [DVec3; 2] {
    [t0 * shape.x + t1 * shape.y, t0 * shape.y + t1 * shape.z]
}
