//! Problems whose answer is known, by a closed form or by finite elements: bodies, loads, references.
//!
//! Studies tabulate errors on them, tests assert bounds, benches time them.

pub mod block;
pub mod cantilever;
pub mod cracks;
pub mod elements;
pub mod indentation;
pub mod model;
pub mod reference;
pub mod solid;
