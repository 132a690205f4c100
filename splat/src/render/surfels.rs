//! Surfels as arrays, in the rest frame.

use std::sync::Arc;

use crate::cast::single;
use crate::error::{SurfelError, one_per_point};
use crate::render::image::Image;
use glam::{DVec3, Vec2, Vec3};

/// Oriented disks on a surface, rest frame; all arrays have one entry per surfel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surfels {
    /// Centres (m).
    pub positions: Vec<DVec3>,
    /// Outward unit normals.
    pub normals: Vec<DVec3>,
    /// Fraction of the surface that each surfel stands for (m²).
    pub areas: Vec<f64>,
    /// Radius of the disk (m).
    pub radii: Vec<f64>,
    /// Shape operator in the tangents of [`Surfels::tangents`] (1/m): the normal at tangent offset
    /// d is about `n + [xx xy; xy yy] d`, stored as (xx, xy, yy). Half its trace is the mean
    /// curvature, positive where the surface bulges outwards.
    pub shapes: Vec<DVec3>,
    /// Material id, an index into the surfaces that the renderer knows.
    pub materials: Vec<u16>,
    /// Where surfels lie in images, of those that do; empty without images.
    pub places: Vec<Option<TexturePlace>>,
}

/// Where a surfel lies in an image, by the texture coordinates of the mesh it was sampled from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TexturePlace {
    /// Which of [`crate::RenderSettings::images`].
    pub image: u16,
    /// Place of the centre: u to the right and v down, 1 the image's whole width and height.
    pub at: Vec2,
    /// Its change along the two tangents of [`Surfels::tangents`] (1/m).
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

impl Surfels {
    /// Number of surfels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Heap bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.positions)
            + size_of_val(&*self.normals)
            + size_of_val(&*self.areas)
            + size_of_val(&*self.radii)
            + size_of_val(&*self.shapes)
            + size_of_val(&*self.materials)
            + size_of_val(&*self.places)
    }

    /// True if there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Checks samples as a surface sampler gives them and makes their normals unit; radii are
    /// `sqrt(area / pi)`, material 0.
    ///
    /// # Errors
    /// [`SurfelError::BadSurfel`] names the first surfel with a value that is not finite, a zero
    /// normal or an area that is not positive; [`SurfelError::Counts`] if the slices differ in length.
    pub fn from_samples(
        positions: &[DVec3],
        normals: &[DVec3],
        areas: &[f64],
    ) -> Result<Self, SurfelError> {
        one_per_point("normals", normals.len(), positions.len())?;
        one_per_point("areas", areas.len(), positions.len())?;
        let mut out = Self::default();
        for (surfel, ((&x, &n), &a)) in positions.iter().zip(normals).zip(areas).enumerate() {
            let unit = n.try_normalize();
            let fine = x.is_finite() && a.is_finite() && a > 0.0;
            let Some(unit) = unit.filter(|_| fine) else {
                return Err(SurfelError::BadSurfel { surfel });
            };
            out.push(x, unit, a, (a / std::f64::consts::PI).sqrt(), 0);
        }
        Ok(out)
    }

    /// Appends one flat surfel; `normal` is taken as it is.
    pub fn push(&mut self, position: DVec3, normal: DVec3, area: f64, radius: f64, material: u16) {
        self.positions.push(position);
        self.normals.push(normal);
        self.areas.push(area);
        self.radii.push(radius);
        self.shapes.push(DVec3::ZERO);
        self.materials.push(material);
        if !self.places.is_empty() {
            self.places.push(None);
        }
    }

    /// Appends a copy of a surfel.
    pub(crate) fn push_copy(&mut self, of: usize) {
        self.positions.push(self.positions[of]);
        self.normals.push(self.normals[of]);
        self.areas.push(self.areas[of]);
        self.radii.push(self.radii[of]);
        self.shapes.push(self.shapes[of]);
        self.materials.push(self.materials[of]);
        let place = self.places.get(of).copied();
        self.places.extend(place);
    }

    /// The tangent frame of a surfel: two unit vectors that make a right-handed frame with the
    /// normal (`t0 × t1 = n`). Depends on the normal alone.
    #[must_use]
    #[inline]
    pub fn tangents(normal: DVec3) -> (DVec3, DVec3) {
        let t0 = normal.any_orthonormal_vector();
        (t0, normal.cross(t0))
    }
}
