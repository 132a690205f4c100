//! Procedural colour of tissue, defined in the volume: the inside of a cut is textured too.

use crate::render::{Surface, Surfel, fractal_noise, gradient_noise};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Material id of the outer surface.
pub const CAPSULE: u16 = 0;
/// Material id of new skin in a cut.
pub const PARENCHYMA: u16 = 1;

/// Colours of an organ's outside and inside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TissueTexture {
    /// Linear colour of the capsule.
    pub capsule: Vec3,
    /// Linear colour of the capsule's darker patches.
    pub capsule_dark: Vec3,
    /// Linear colour of the parenchyma seen in a cut.
    pub parenchyma: Vec3,
    /// Linear colour of its lobules' borders.
    pub parenchyma_dark: Vec3,
    /// Size of the patches (m).
    pub patch: f64,
}

impl TissueTexture {
    /// Liver: a brown-red, glossy capsule; brighter, pinker parenchyma with lobules.
    /// `size` is the body's extent (m), which sets the scale of the patches.
    #[must_use]
    pub fn liver(size: f64) -> Self {
        Self {
            capsule: Vec3::new(0.150, 0.026, 0.016),
            capsule_dark: Vec3::new(0.070, 0.010, 0.008),
            parenchyma: Vec3::new(0.42, 0.085, 0.065),
            parenchyma_dark: Vec3::new(0.24, 0.032, 0.026),
            patch: 0.12 * size,
        }
    }

    /// A liver's texture in other colours: the linear ones of capsule and parenchyma.
    #[must_use]
    pub fn in_colors(capsule: Vec3, parenchyma: Vec3, size: f64) -> Self {
        Self {
            capsule,
            capsule_dark: capsule * 0.55,
            parenchyma,
            parenchyma_dark: parenchyma * 0.6,
            ..Self::liver(size)
        }
    }

    /// Linear colour at a rest point.
    #[must_use]
    pub fn color(&self, at: DVec3, material: u16) -> Vec3 {
        let p = (at / self.patch).as_vec3();
        if material == CAPSULE {
            let broad = 0.5 + 0.9 * fractal_noise(p, 3);
            let mottle = 0.08 * gradient_noise(p * 9.0);
            self.capsule_dark
                .lerp(self.capsule, (broad + mottle).clamp(0.0, 1.0))
        } else {
            let lobules = gradient_noise(p * 7.0).abs();
            let fine = 0.5 + 0.7 * fractal_noise(p * 4.0, 2);
            self.parenchyma_dark.lerp(
                self.parenchyma,
                (0.35 + 0.8 * lobules + 0.4 * fine).clamp(0.0, 1.0),
            )
        }
    }

    /// Colours of all surfels.
    #[must_use]
    pub fn colors(&self, surfels: &[Surfel]) -> Vec<Vec3> {
        let color = |surfel: &Surfel| self.color(surfel.position, surfel.material);
        surfels.par_iter().map(color).collect()
    }

    /// Optical properties for the two materials: a smooth wet capsule, a rougher wet inside.
    #[must_use]
    pub fn surfaces(&self) -> Vec<Surface> {
        let per_metre = crate::cast::single(1.0 / self.patch);
        vec![
            Surface {
                coat: None,
                specular: 0.42,
                shininess: 70.0,
                relief: 0.0,
                relief_frequency: 6.0 * per_metre,
            },
            Surface {
                coat: None,
                specular: 0.30,
                shininess: 35.0,
                relief: 0.16,
                relief_frequency: 14.0 * per_metre,
            },
        ]
    }
}
