#![doc = include_str!("../README.md")]

mod body;
mod bond;
mod bound;
mod completion;
mod dilatation;
mod error;
mod evaluate;
mod fiber;
mod front;
mod kernel;
mod law;
mod material;
mod model;
mod offset;
mod part;
mod plain;
mod rows;
mod still;
mod update;
mod viscosity;
mod watch;

pub use error::ElasticError;
pub use fiber::Fiber;
pub use material::{Law, MAX_PRONY_TERMS, Material};
pub use model::{Dilatation, Elastic, Materials, Nodes, Precision, Settings, Stencils};
pub use offset::Offsets;
pub use part::Part;
pub use viscosity::PronyTerm;
pub use watch::StiffNode;
