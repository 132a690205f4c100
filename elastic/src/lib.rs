#![doc = include_str!("../README.md")]

mod body;
mod bound;
mod completion;
mod dilatation;
mod error;
mod evaluate;
mod fiber;
mod kernel;
mod law;
mod material;
mod model;
mod part;
mod plain;
mod rows;
mod still;
mod update;
mod viscosity;

pub use bound::StiffnessCap;
pub use error::ElasticError;
pub use fiber::Fiber;
pub use material::{Law, MAX_PRONY_TERMS, Material};
pub use model::{Dilatation, Elastic, Materials, Nodes, Precision, Settings, Stencils};
pub use part::Part;
pub use viscosity::PronyTerm;
