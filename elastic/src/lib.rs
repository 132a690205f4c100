#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

// First: documentation lists the methods of Elastic in the modules' order.
mod model;

mod again;
mod apply;
mod cut;
mod error;
mod input;
mod kernel;
mod law;
mod part;
mod release;
mod rows;
mod smoothed;
mod state;
mod stiffness;

pub use apply::{CutEnergy, CutInput, CutPolicy};
pub use cut::Works;
pub use error::ElasticError;
pub use glam;
#[doc(hidden)]
pub use input::Frame;
pub use input::{Dilatation, Materials, Nodes, Settings, Stencils};
pub use law::checks::BadSetting;
pub use law::fiber::Fiber;
pub use law::material::{Law, Material};
pub use law::prony::{MAX_PRONY_TERMS, PronyTerm};
pub use law::settings::{MaterialSettings, Model, Preset};
pub use law::stress::von_mises_stress;
pub use model::{Bytes, Elastic};
pub use part::Part;
pub use release::CrackFront;
pub use rows::Rows;
pub use state::State;
pub use stiffness::StiffNode;
#[doc(hidden)]
pub use {kernel::storage::PARALLEL_NODES, stiffness::WATCHED_NODES};
