#![doc = include_str!("../README.md")]

mod audit;
mod eigenvalue;
mod error;
mod explicit;
mod motion;
mod path;
mod supports;
#[cfg(test)]
mod testing;

pub use audit::{Audit, Warning};
pub use eigenvalue::{
    Eigenvalue, EigenvalueError, EigenvalueSettings, critical_step, largest_eigenvalue,
};
pub use error::{Cause, MotionError, StepError};
pub use explicit::Applied;
pub use motion::{Frame, Motion, MotionSettings, Scheme, State};
pub use path::{Ease, Path, PathError};
pub use supports::{Support, Supports};
