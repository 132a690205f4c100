//! What is drawn: splats, surfaces, light, background.

use crate::render::{Clip, Image, Splat, Surfel};
use glam::Vec3;
use std::sync::Arc;

/// How surfels are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum DrawMode {
    /// Blended disks, lit per pixel: passes for visibility, blending, and normalisation with the light.
    #[default]
    ThreePass,
    /// Squares that face the viewer, lit one by one (Aras 2014, fig. 41).
    Squares,
    /// Disks that face the viewer, lit one by one (Aras 2014, fig. 42).
    Disks,
    /// Oriented disks lit one by one, blended by eq. (50) from back to front in one pass (Aras 2014, figs. 45-47).
    SinglePass,
}

/// An image laid on a surface from the six sides of a box, by rest position and normal.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageCoat {
    /// The image; it repeats.
    pub image: Arc<Image>,
    /// Width of one repeat (m).
    pub size: f64,
}

/// Optical properties of a material id.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Colours that replace the splats' own, looked up per pixel (three-pass mode).
    pub coat: Option<ImageCoat>,
    /// Strength of the highlight (1).
    pub specular: f32,
    /// Exponent of the highlight (1).
    pub shininess: f32,
    /// Amplitude of the fine relief: tilt of the normal (1).
    pub relief: f32,
    /// Cells of the fine relief per metre (1/m).
    pub relief_frequency: f32,
}

/// What a splat without a surface of its own takes.
static PLAIN: Surface = Surface {
    coat: None,
    specular: 0.35,
    shininess: 50.0,
    relief: 0.0,
    relief_frequency: 400.0,
};

impl Default for Surface {
    fn default() -> Self {
        PLAIN.clone()
    }
}

/// A distant light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Direction to the light in camera axes (right, up, towards the viewer), need not be unit.
    pub direction: Vec3,
    /// Linear colour times strength.
    pub color: Vec3,
}

/// The light of a scene, fixed to the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Lighting {
    /// Distant lights.
    pub lights: Vec<Light>,
    /// Ambient light from above (linear).
    pub sky: Vec3,
    /// Ambient light from below (linear).
    pub ground: Vec3,
}

impl Default for Lighting {
    /// An operating lamp from the upper left, a cool fill from the right, a rim from behind.
    fn default() -> Self {
        Self {
            lights: vec![
                Light {
                    direction: Vec3::new(-0.45, 0.75, 0.65),
                    color: Vec3::new(2.1, 2.0, 1.9),
                },
                Light {
                    direction: Vec3::new(0.9, 0.15, 0.5),
                    color: Vec3::new(0.38, 0.42, 0.5),
                },
                Light {
                    direction: Vec3::new(0.2, 0.6, -0.75),
                    color: Vec3::new(0.5, 0.5, 0.55),
                },
            ],
            sky: Vec3::new(0.30, 0.31, 0.34),
            ground: Vec3::new(0.12, 0.09, 0.08),
        }
    }
}

/// Linear colours of the background, from top to bottom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Background {
    /// Colour of the upper border.
    pub top: Vec3,
    /// Colour of the lower border.
    pub bottom: Vec3,
}

impl Default for Background {
    /// Surgical drape: a dark blue-green.
    fn default() -> Self {
        Self {
            top: Vec3::new(0.016, 0.045, 0.055),
            bottom: Vec3::new(0.05, 0.12, 0.13),
        }
    }
}

/// What the image is like.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderSettings {
    /// Width (px).
    pub width: u32,
    /// Height (px).
    pub height: u32,
    /// Anti-aliasing: samples per pixel along each axis; 1, 2 or 4.
    pub samples: u32,
    /// How splats are drawn.
    pub mode: DrawMode,
    /// Splats blend with those at most this much nearer, in radii of the splat.
    pub tolerance: f64,
    /// Optical properties by material id; a splat whose id has none takes the default surface.
    pub surfaces: Vec<Surface>,
    /// Images that splats lie in by texture coordinates, see [`Surfel::place`]: such an image replaces their colour and
    /// their material's coat (three-pass mode).
    pub images: Vec<Arc<Image>>,
    /// Light.
    pub lighting: Lighting,
    /// Background.
    pub background: Background,
    /// Give the frame its normals too (three-pass mode).
    pub keep_normals: bool,
}

impl Default for RenderSettings {
    /// 1280 × 720 pixels of 2 × 2 samples, three passes, one default surface, an operating lamp.
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            samples: 2,
            mode: DrawMode::ThreePass,
            tolerance: 0.7,
            surfaces: vec![Surface::default()],
            images: Vec::new(),
            lighting: Lighting::default(),
            background: Background::default(),
            keep_normals: false,
        }
    }
}

impl RenderSettings {
    pub(crate) fn surface(&self, material: u16) -> &Surface {
        self.surfaces.get(usize::from(material)).unwrap_or(&PLAIN)
    }
}

/// Splats and what belongs to them; all slices have one entry per splat.
#[derive(Debug, Clone, Copy)]
pub struct SplatView<'a> {
    /// Carried disks.
    pub splats: &'a [Splat],
    /// The same at rest: their materials, the texture coordinates of relief and images, the radii that clips are
    /// measured by.
    pub surfels: &'a [Surfel],
    /// Linear colour per splat.
    pub colors: &'a [Vec3],
    /// What bounds each disk; empty: nothing bounds any.
    pub clips: &'a [Option<Arc<Clip>>],
    /// Linear colour of what is seen of the body from behind through gaps of its surface, as along
    /// the end of a cut (three-pass mode); `None`: the background is seen there.
    pub inside: Option<Vec3>,
}

impl<'a> SplatView<'a> {
    /// Splats of whole, unbounded surfels with a colour each.
    #[must_use]
    pub fn new(splats: &'a [Splat], surfels: &'a [Surfel], colors: &'a [Vec3]) -> Self {
        Self {
            splats,
            surfels,
            colors,
            clips: &[],
            inside: None,
        }
    }

    pub(crate) fn is_whole(&self) -> bool {
        let n = self.splats.len();
        [self.surfels.len(), self.colors.len()] == [n; 2]
            && (self.clips.is_empty() || self.clips.len() == n)
    }
}
