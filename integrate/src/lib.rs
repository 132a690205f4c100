#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod ahead;
mod audit;
mod contact;
mod coupling;
mod eigenvalue;
mod equilibrium;
mod error;
mod explicit;
#[cfg(feature = "faer")]
mod factor;
mod friction;
mod implicit;
mod law;
mod leveling;
mod linear;
mod motion;
mod newton;
mod path;
mod pressed;
mod rigid;
mod shape;
mod shares;
mod supports;
mod surface;
mod sweep;
#[cfg(test)]
mod testing;
mod tool;
mod turn;
mod vector;
mod view;

pub use audit::{Audit, Warning};
pub use contact::{Contact, ContactForce, ContactPoint, ContactSettings, penalty};
pub use coupling::Coupling;
pub use eigenvalue::{
    Eigenvalue, EigenvalueError, EigenvalueSettings, critical_step, largest_eigenvalue,
};
pub use equilibrium::{StaticLoad, StaticReport, solve_static};
pub use error::{Cause, MotionError, StepError};
pub use explicit::Applied;
pub use glam;
pub use implicit::{Implicit, ImplicitScheme, ImplicitSettings};
pub use law::{Differences, ForceLaw, Law};
pub use leveling::{Leveled, level_masses};
pub use motion::{Frame, Motion, MotionBytes, MotionSettings, Scheme, State};
#[cfg(feature = "faer")]
pub use newton::FACTOR_LASTS;
pub use newton::{NewtonReport, NewtonSettings, Preconditioner, SolveError};
pub use path::{Ease, Path, PathError};
pub use pressed::Pressed;
pub use shape::{Distance, Pose, Shape};
pub use shares::{Pass, PassSums, SHARED_NODES, Shares};
pub use supports::{Support, Supports};
pub use surface::{ContactSurface, SurfaceError};
pub use tool::{Drive, Tool};
pub use turn::Turn;
pub use view::StepView;
