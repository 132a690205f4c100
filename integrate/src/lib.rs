#![doc = include_str!("../README.md")]

mod audit;
mod eigenvalue;
mod equilibrium;
mod error;
mod explicit;
mod implicit;
mod law;
mod linear;
mod motion;
mod newton;
mod path;
mod supports;
#[cfg(test)]
mod testing;
mod vector;

pub use audit::{Audit, Warning};
pub use eigenvalue::{
    Eigenvalue, EigenvalueError, EigenvalueSettings, critical_step, largest_eigenvalue,
};
pub use equilibrium::{RelaxReport, RelaxSettings, StaticLoad, StaticReport, relax, solve_static};
pub use error::{Cause, MotionError, StepError};
pub use explicit::Applied;
pub use implicit::{Implicit, ImplicitScheme, ImplicitSettings};
pub use law::ForceLaw;
pub use motion::{Frame, Motion, MotionSettings, Scheme, State};
pub use newton::{NewtonReport, NewtonSettings, SolveError};
pub use path::{Ease, Path, PathError};
pub use supports::{Support, Supports};
