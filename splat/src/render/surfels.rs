//! Surfels in the rest frame.

use std::sync::Arc;

use crate::cast::single;
use crate::render::{Image, Splat};
use glam::{DVec3, Vec2, Vec3};

/// An oriented disk on a surface, rest frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfel {
    /// Centre (m).
    pub position: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
    /// The part of the surface that it stands for (m²).
    pub area: f64,
    /// Radius of the disk (m).
    pub radius: f64,
    /// Shape operator in the tangents of [`Surfel::tangents`] (1/m): the normal at tangent offset
    /// d is about `n + [xx xy; xy yy] d`, stored as (xx, xy, yy). Half its trace is the mean
    /// curvature, positive where the surface bulges outwards.
    pub shape: DVec3,
    /// Material id, an index into the surfaces that the renderer knows.
    pub material: u16,
    /// Where it lies in an image, if it does.
    pub place: Option<TexturePlace>,
}

/// Where a surfel lies in an image, by the texture coordinates of the mesh it was sampled from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TexturePlace {
    /// Which of [`crate::RenderSettings::images`].
    pub image: u16,
    /// Place of the centre: u to the right and v down, 1 the image's whole width and height.
    pub at: Vec2,
    /// Its change along the two tangents of [`Surfel::tangents`] (1/m).
    pub along: [Vec2; 2],
}

impl TexturePlace {
    /// Mean colour of what a disk of a radius (m) shows of its image: for pictures that light splats one by one, and
    /// for callers that get surfels and no images. White where there is no such image.
    #[must_use]
    pub fn color(&self, images: &[Arc<Image>], radius: f64) -> Vec3 {
        let [u, v] = self.along.map(|along| along.length());
        let footprint = u.max(v) * single(radius);
        images
            .get(usize::from(self.image))
            .map_or(Vec3::ONE, |image| image.color(self.at, footprint))
    }
}

impl Surfel {
    /// The tangent frame of a surfel: two unit vectors that make a right-handed frame with the
    /// normal (`t0 × t1 = n`). Depends on the normal alone.
    #[must_use]
    #[inline]
    pub fn tangents(normal: DVec3) -> (DVec3, DVec3) {
        let t0 = normal.any_orthonormal_vector();
        (t0, normal.cross(t0))
    }

    /// A point of its plane (m), and the plane's normal.
    pub(crate) fn plane(&self) -> (DVec3, DVec3) {
        (self.position, self.normal)
    }

    /// Half-axes of the disk (m).
    pub(crate) fn axes(&self) -> [DVec3; 2] {
        let (t0, t1) = Self::tangents(self.normal);
        [t0 * self.radius, t1 * self.radius]
    }

    /// Change of the normal per metre along the two tangents.
    #[inline]
    pub(crate) fn normal_derivatives(&self, t0: DVec3, t1: DVec3) -> [DVec3; 2] {
        let DVec3 { x, y, z } = self.shape;
        [t0 * x + t1 * y, t0 * y + t1 * z]
    }

    /// The undeformed disk.
    #[must_use]
    pub fn at_rest(&self) -> Splat {
        let (t0, t1) = Self::tangents(self.normal);
        let bends = self.normal_derivatives(t0, t1);
        Splat {
            position: self.position,
            normal: self.normal,
            axes: self.axes(),
            normal_derivatives: bends.map(|bend| bend * self.radius),
        }
    }
}
