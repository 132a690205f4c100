//! Why a step failed, and what to do about it.

/// Likely cause of a motion that diverges.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Cause {
    /// The step is above the critical one that the caller stated.
    #[error("the step of {step:.3e} s is above the critical {critical:.3e} s; take a smaller one")]
    StepTooLarge {
        /// Step taken (s).
        step: f64,
        /// Critical step (s).
        critical: f64,
    },
    /// Forces from outside (contact) outweigh the internal ones at the node.
    #[error("contact too stiff for the step; lower the penalty or the step")]
    ContactTooStiff,
    /// The force law gave a value that is not finite at finite positions.
    #[error(
        "the force law gave a value that is not finite (node inverted or torn off); \
         take a smaller step or load"
    )]
    BrokenForceLaw,
    /// None of these: the stiffness has probably risen since the step was chosen.
    #[error(
        "the body has become stiffer or gives way faster than the step follows; take a smaller one"
    )]
    StiffnessRose,
}

/// Why an explicit step was refused or stopped. The state holds no NaN afterwards, but do not
/// continue from it: restore an earlier one.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// A force is not finite.
    #[error("force not finite at node {node}, time {time:.6} s: {cause}")]
    ForceNotFinite {
        /// First such node.
        node: usize,
        /// Time (s) of the step.
        time: f64,
        /// Likely cause.
        cause: Cause,
    },
    /// There is more kinetic energy than all that ever went in can account for.
    #[error(
        "motion diverges at node {node}, time {time:.6} s, kinetic energy {kinetic:.3e} J: {cause}"
    )]
    Diverged {
        /// The node with most kinetic energy.
        node: usize,
        /// Time (s) of the step.
        time: f64,
        /// Kinetic energy (J).
        kinetic: f64,
        /// Likely cause.
        cause: Cause,
    },
    /// The step is not positive and finite.
    #[error("a step of {step} s cannot be taken; it must be positive and finite")]
    BadStep {
        /// Step (s).
        step: f64,
    },
}

/// Why a motion cannot be set up.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// A list has another length than the positions.
    #[error("{count} {quantity} for {nodes} nodes; give one per node")]
    Lengths {
        /// Which list.
        quantity: &'static str,
        /// Its length.
        count: usize,
        /// Number of positions.
        nodes: usize,
    },
    /// A mass is not positive and finite.
    #[error("node {node} has mass {mass} kg, which must be positive and finite")]
    BadMass {
        /// Index of the node.
        node: usize,
        /// Its mass (kg).
        mass: f64,
    },
    /// A position, velocity or load is not finite.
    #[error("node {node}: {quantity} is not finite")]
    NotFinite {
        /// Index of the node.
        node: usize,
        /// Which quantity.
        quantity: &'static str,
    },
    /// A setting is negative or not finite.
    #[error("{name} is {value}; it must be finite and not negative")]
    BadSetting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
    },
}
