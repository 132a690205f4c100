//! Surfels in the deformed frame.

use glam::DVec3;

/// A surfel in the deformed frame, ready to draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Splat {
    /// Centre (m).
    pub position: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
    /// Half-axes: the images of the rest disk's two tangents times radius (m).
    pub axes: [DVec3; 2],
    /// Change of the normal from the centre to the end of each axis (Aras 2014, eq. (51): a linear field of normals over
    /// the disk); zero: a flat disk.
    pub normal_derivatives: [DVec3; 2],
}

impl Splat {
    /// Mean curvature (1/m) of the carried surface, positive where it bulges: half the trace of the second
    /// fundamental form in the metric of the disk's axes.
    ///
    /// As good as the normals' change over a disk: a few percent on a smooth surface, nothing across a
    /// crease. Not finite for a disk without area.
    #[must_use]
    pub fn mean_curvature(&self) -> f64 {
        let ([u, v], [a, b]) = (self.axes, self.normal_derivatives);
        let [uu, uv, vv] = [u.dot(u), u.dot(v), v.dot(v)];
        let determinant = uu * vv - uv * uv;
        0.5 * (a.dot(u) * vv - (a.dot(v) + b.dot(u)) * uv + b.dot(v) * uu) / determinant
    }
}
