//! Surfels in the deformed frame.

use crate::surfels::Surfels;
use glam::DVec3;

/// Surfels in the deformed frame, ready to draw; one entry per surfel in every array. The fields of
/// normals (`bends_*`) may be left empty: flat disks.
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
        }
        out
    }
}

/// Change of the rest normal per metre along the two tangents.
#[inline]
pub(crate) fn bends(shape: DVec3, t0: DVec3, t1: DVec3) -> [DVec3; 2] {
    [t0 * shape.x + t1 * shape.y, t0 * shape.y + t1 * shape.z]
}
