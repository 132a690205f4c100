#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod cast;
mod error;
mod render;
mod tissue;

pub use error::{ImageError, SurfelError};
pub use glam;
pub use render::Renderer;
pub use render::camera::{Camera, Lens};
pub use render::clip::Clip;
pub use render::frame::{Animation, Frame};
pub use render::image::{Image, linear_color};
pub use render::legend::{ColorScale, Overlay};
pub use render::merged::MergedSplats;
pub use render::mesh::DrawnMesh;
pub use render::scene::{
    Background, DrawMode, ImageCoat, Light, Lighting, RenderSettings, SplatView, Surface,
};
pub use render::splats::Splats;
pub use render::surfels::{Surfels, TexturePlace};
pub use render::view::View;
pub use tissue::adapt::follow_curvature;
pub use tissue::binding::{Binding, WeightLaw};
pub use tissue::drawn::DrawnTissue;
pub use tissue::near::triangle_near_box;
pub use tissue::normals::estimate_normals;
pub use tissue::radii::{Measure, RadiusRule, covering_radii, measures};
pub use tissue::skin::{CutSampler, triangle_area};
pub use tissue::texture::{CAPSULE, PARENCHYMA, TissueTexture};
pub use tissue::{CutChange, InsideTest, Tissue, TissueSettings};
