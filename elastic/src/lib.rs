#![doc = include_str!("../README.md")]

mod bound;
mod completion;
mod error;
mod kernel;
mod material;
mod model;
mod rows;
mod update;

pub use bound::StiffnessCap;
pub use error::ElasticError;
pub use material::{Law, Material};
pub use model::{Elastic, Materials, Nodes, Settings, Stencils};
