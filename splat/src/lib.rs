#![doc = include_str!("../README.md")]

mod binding;
mod camera;
mod carry;
mod cast;
mod clip;
mod error;
mod frame;
mod noise;
mod project;
mod radii;
mod raster;
mod render;
mod rim;
mod scene;
mod shade;
mod skin;
mod surfels;
mod texture;
mod tissue;
mod tool;

pub use binding::{BindSettings, Binding, WeightLaw};
pub use camera::{Camera, Lens};
pub use carry::{Splats, carry_into};
pub use clip::Clip;
pub use error::{ImageError, SurfelError};
pub use frame::{Animation, Frame};
pub use noise::{fractal_noise, gradient_noise, slope_noise};
pub use radii::{RadiusRule, covering_radii, shape_operators};
pub use render::{RenderSettings, Renderer};
pub use scene::{Background, DrawMode, Light, Lighting, SplatView, Surface};
pub use skin::{CutSampler, triangle_area};
pub use surfels::Surfels;
pub use texture::{CAPSULE, PARENCHYMA, TissueTexture};
pub use tissue::{CutChange, Tissue, TissueSettings};
pub use tool::Mesh;
