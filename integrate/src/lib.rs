#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod audit;
mod awake;
mod contact;
mod cut_energy;
mod deformable;
mod eigenvalue;
mod equilibrium;
mod error;
mod explicit;
mod grip;
mod implicit;
mod law;
mod linear;
mod motion;
mod newton;
mod nodes;
mod outside;
mod overlap;
mod pieces;
mod rigid;
mod shape;
mod shares;
mod supports;
mod sweep;
#[cfg(test)]
mod testing;
mod tool;
mod trajectory;
mod vector;
mod view;
mod watch;

pub use audit::{Audit, RigidEnergies, Warning};
pub use awake::awake;
pub use contact::pressed::Pressed;
pub use contact::{
    Contact, ContactForce, ContactPoint, ContactSettings, ContactSurface, SurfaceError, penalty,
};
pub use cut_energy::CutEnergy;
pub use deformable::disks::{ContactDisks, DiskSample};
pub use deformable::{
    DeformableContact, DeformableForce, DeformableSettings, DeformableState, Moved, TouchingNodes,
};
pub use eigenvalue::{
    Eigenvalue, EigenvalueError, EigenvalueSettings, critical_step, largest_eigenvalue,
    largest_eigenvalue_within, radial_start,
};
#[doc(hidden)]
pub use eigenvalue::{EigenvalueShare, largest_eigenvalue_of_share};
pub use equilibrium::{StaticLoad, StaticReport, solve_static};
pub use error::{Cause, MotionError, StepError};
pub use explicit::Applied;
pub use glam;
pub use grip::Grip;
pub use implicit::{Implicit, ImplicitReport, ImplicitScheme, ImplicitSettings};
pub use law::{ClosureLaw, Differences, ForceLaw};
pub use motion::{ExplicitScheme, Motion, MotionBytes, MotionSettings, State};
pub use newton::{NewtonReport, NewtonSettings, SolveError};
pub use outside::Outside;
pub use overlap::Occupied;
pub use shape::{Distance, Pose, RigidShape};
#[doc(hidden)]
pub use shares::{Pass, PassSums, SHARED_NODES, Shares};
pub use supports::{BoundaryConditions, NodeSupport};
pub use tool::{Drive, RigidTool, Stride};
pub use trajectory::{Ease, Trajectory, TrajectoryError};
pub use view::StepView;
pub use watch::{Alarm, StepControl, StiffnessTracker};
