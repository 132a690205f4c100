#![doc = include_str!("../README.md")]

mod body;
mod check;
mod contact;
mod event;
mod material;
mod method;
mod path;
mod region;
mod rigid;
mod scene;
mod scheme;
mod settings;
mod support;
#[cfg(feature = "text")]
mod text;
mod tool;

pub use body::{
    Body, Form, ImageFile, PointFile, Sampling, SurfelSettings, SurfelSpacing, SurfelTarget, Target,
};
pub use check::{Checks, DidYouMean, Fault, nearest};
pub use contact::{Between, BodyContact, Touching};
pub use event::{Capture, Cut, Gravity, Support, SupportMotion};
pub use material::Inclusion;
pub use method::Method;
pub use path::{Key, pose_at};
pub use phyxel_discretize::{Axis, Refinement, Shape, UnitGuess};
pub use phyxel_elastic::{Dilatation, Fiber, MaterialSettings, Model, Preset, PronyTerm};
pub use phyxel_enrich::CutRule;
pub use phyxel_integrate::{Pose, RigidShape as ToolShape};
pub use phyxel_splat::{DrawMode, InsideTest, Measure, RadiusRule, View, WeightLaw};
pub use region::Region;
pub use rigid::RigidMesh;
pub use scene::{Scene, VERSION};
pub use scheme::Scheme;
pub use settings::{Backdrop, Coloring, Integration, Observe, Pictures, Rest, Settle, Show};
#[cfg(feature = "text")]
pub use text::*;
pub use tool::{Release, Tool};
