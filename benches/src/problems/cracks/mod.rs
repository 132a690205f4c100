//! Cracks with a known answer: how a cut weakens pairs, and what that does to the mechanics.

mod cut_body;
mod field;
mod intrinsic;
mod penny;
mod problems;

pub use cut_body::{CutBody, Form, Plate};
pub use field::stress;
pub use penny::{Penny, READINGS, penny};
pub use problems::{Ratios, centre_crack, edge_crack, gravity_slit, inclined_crack, upright};

/// Young's modulus (Pa) and Poisson's ratio of all cracks.
pub const YOUNG: f64 = 1000.0;
/// See [`YOUNG`].
pub const POISSON: f64 = 0.3;

/// Eight places of the tip along the line and of the line across it, relative to the nodes, in
/// spacings: what a method does must not hang on them.
pub const PLACES: [[f64; 2]; 8] = [
    [0.0, 0.25],
    [0.25, 0.25],
    [0.5, 0.25],
    [0.75, 0.25],
    [0.0, 0.4],
    [0.25, 0.4],
    [0.5, 0.4],
    [0.75, 0.4],
];
