#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod adapt;
mod binding;
mod border;
mod camera;
mod carry;
mod cast;
mod clip;
mod comparators;
mod drawn;
mod eigen;
mod error;
mod frame;
mod image;
mod inspect;
mod legend;
mod markers;
mod memory;
mod merged;
mod near;
mod noise;
mod project;
mod radii;
mod raster;
mod render;
mod resolve;
mod rim;
mod scene;
mod shade;
mod skin;
mod splats;
mod surfels;
mod texture;
mod tissue;
mod tool;
mod tree;
mod view;

pub use adapt::follow_curvature;
pub use binding::{BindSettings, Binding, WeightLaw};
pub use camera::{Camera, Lens};
pub use carry::carry_into;
pub use clip::Clip;
pub use comparators::carry_by_displacements_into;
pub use drawn::DrawnTissue;
pub use error::{CodecError, ImageError, SurfelError};
pub use frame::{Animation, Frame};
pub use glam;
pub use image::{Image, linear_color};
pub use inspect::{PairGraph, drawn_binding, drawn_lattices, drawn_normals, drawn_sweep};
pub use legend::{ColorScale, Overlay};
pub use markers::Markers;
pub use merged::MergedSplats;
pub use near::triangle_near_box;
pub use noise::{fractal_noise, gradient_noise, slope_noise};
pub use radii::{Measure, RadiusRule, covering_radii, mapped_radii, measures, shape_operators};
pub use render::Renderer;
pub use scene::{
    Background, DrawMode, ImageCoat, Light, Lighting, RenderSettings, SplatView, Surface,
};
pub use skin::{CutSampler, triangle_area};
pub use splats::Splats;
pub use surfels::{Surfels, TexturePlace};
pub use texture::{CAPSULE, PARENCHYMA, TissueTexture};
pub use tissue::{CutChange, InsideTest, Tissue, TissueSettings};
pub use tool::DrawnMesh;
pub use view::View;
