#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod audit;
mod checks;
mod contact;
mod eigenvalue;
mod equilibrium;
mod error;
mod explicit;
mod grip;
mod implicit;
mod law;
mod led_tool;
mod linear;
mod mass_scaling;
mod motion;
mod newton;
mod path;
mod region;
mod rigid;
mod rigid_path;
mod scheme;
mod shape;
mod shares;
mod supports;
mod sweep;
#[cfg(test)]
mod testing;
mod tool;
mod tool_shape;
mod vector;
mod view;

pub use audit::{Audit, Warning};
pub use checks::BadSetting;
pub use contact::{
    Contact, ContactForce, ContactPoint, ContactSettings, ContactSurface, Pressed, SurfaceError,
    penalty,
};
pub use eigenvalue::{
    Eigenvalue, EigenvalueError, EigenvalueSettings, EigenvalueShare, critical_step,
    largest_eigenvalue, largest_eigenvalue_of_share, largest_eigenvalue_within,
};
pub use equilibrium::{StaticLoad, StaticReport, solve_static};
pub use error::{Cause, MotionError, StepError};
pub use explicit::Applied;
pub use glam;
pub use grip::Grip;
pub use implicit::{Implicit, ImplicitScheme, ImplicitSettings};
pub use law::{ClosureLaw, Differences, ForceLaw};
pub use led_tool::LedTool;
pub use mass_scaling::{MassScaling, scale_masses};
pub use motion::{ExplicitScheme, Interval, Motion, MotionBytes, MotionSettings, State};
pub use newton::{NewtonReport, NewtonSettings, SolveError};
pub use path::{Ease, Path, PathError};
pub use region::Region;
pub use rigid::RigidEnergies;
pub use rigid_path::RigidPath;
pub use scheme::Scheme;
pub use shape::{Distance, Pose, RigidShape};
pub use shares::{Pass, PassSums, SHARED_NODES, Shares};
pub use supports::{NodeSupport, Supports};
pub use tool::{Drive, RigidTool};
pub use tool_shape::ToolShape;
pub use view::StepView;
