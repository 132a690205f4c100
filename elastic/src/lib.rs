#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod bond;
mod bound;
mod completion;
mod control;
mod dilatation;
mod early;
mod error;
mod fiber;
mod fixed;
mod forces;
mod front;
mod gather;
mod input;
mod lanes;
mod law;
mod material;
mod mean;
mod model;
mod nodes;
mod offset;
mod pairs;
mod part;
mod planes;
mod settings;
mod stale;
mod still;
mod storage;
mod stress;
mod tangent;
mod update;
mod viscosity;
mod watch;

pub use early::Early;
pub use error::ElasticError;
pub use fiber::Fiber;
pub use glam;
pub use input::{Dilatation, Frame, Instructions, Materials, Nodes, Precision, Settings, Stencils};
pub use material::{Law, MAX_PRONY_TERMS, Material};
pub use model::Elastic;
pub use offset::Offsets;
pub use part::Part;
pub use settings::{MaterialSettings, Model, Preset};
pub use stress::von_mises_stress;
pub use viscosity::PronyTerm;
pub use watch::{StiffNode, WATCHED_NODES};
