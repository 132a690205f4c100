//! How steps follow each other, as settings say it.

use phyxel_integrate::{ExplicitScheme, ImplicitScheme, ImplicitSettings, NewtonSettings};

/// How one step follows another.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Scheme {
    /// Explicit, second order, at the stable step (velocity Verlet, central differences).
    #[default]
    VelocityVerlet,
    /// Explicit, first order, at the stable step.
    SymplecticEuler,
    /// Implicit, first order, damps what the step does not resolve (Aras 2014, eqs. (12)-(14)). Neither
    /// `damping_ratio` nor released tools go with it.
    BackwardEuler {
        /// Step (s), of any length.
        #[serde(default = "Scheme::default_step")]
        step: f64,
        /// Unbalanced force, relative, at which a step is solved.
        #[serde(default = "Scheme::default_tolerance")]
        tolerance: f64,
    },
    /// Implicit, second order, keeps the sum of kinetic and elastic energy at any step (midpoint rule with a
    /// discrete gradient, Gonzalez 1996). Neither `damping_ratio` nor released tools go with it.
    #[serde(alias = "Newmark")]
    EnergyMomentum {
        /// Step (s), of any length.
        #[serde(default = "Scheme::default_step")]
        step: f64,
        /// Unbalanced force, relative, at which a step is solved.
        #[serde(default = "Scheme::default_tolerance")]
        tolerance: f64,
    },
}

impl Scheme {
    const fn default_step() -> f64 {
        0.01
    }

    /// Unbalanced force, relative, at which a step is solved if a scene does not say.
    #[must_use]
    pub const fn default_tolerance() -> f64 {
        1e-6
    }

    /// Step (s) of an implicit scheme; `None` for explicit ones, whose step follows the body.
    #[must_use]
    pub const fn step(&self) -> Option<f64> {
        match *self {
            Self::VelocityVerlet | Self::SymplecticEuler => None,
            Self::BackwardEuler { step, .. } | Self::EnergyMomentum { step, .. } => Some(step),
        }
    }
    /// The explicit scheme that it is, or stands for where it is implicit.
    #[must_use]
    pub const fn explicit(&self) -> ExplicitScheme {
        match self {
            Self::SymplecticEuler => ExplicitScheme::SymplecticEuler,
            Self::VelocityVerlet | Self::BackwardEuler { .. } | Self::EnergyMomentum { .. } => {
                ExplicitScheme::VelocityVerlet
            }
        }
    }

    /// How to solve the steps of an implicit scheme; `None` for explicit ones.
    #[must_use]
    pub fn implicit(&self) -> Option<ImplicitSettings> {
        let (scheme, tolerance) = match *self {
            Self::VelocityVerlet | Self::SymplecticEuler => return None,
            Self::BackwardEuler { tolerance, .. } => (ImplicitScheme::BackwardEuler, tolerance),
            Self::EnergyMomentum { tolerance, .. } => (ImplicitScheme::EnergyMomentum, tolerance),
        };
        let newton = NewtonSettings::with_tolerance(tolerance);
        Some(ImplicitSettings { scheme, newton })
    }
}
