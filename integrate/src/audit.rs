//! Where the energy is, and where it came from.

use crate::error::Cause;
use glam::DVec3;

/// Energies (J) and momentum after a step. Works and the dissipated energy are sums from the start.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Audit {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Energy that the force law states, at the current positions.
    pub elastic: f64,
    /// Work of gravity and of constant nodal loads.
    pub load_work: f64,
    /// Work of forces that the caller applies step by step (contact, a tool).
    pub applied_work: f64,
    /// Work of driven supports.
    pub support_work: f64,
    /// Energy taken out by damping; never negative for mass-proportional damping.
    pub dissipated: f64,
    /// Energy that the scheme takes by itself, negative if it gives. Backward Euler takes
    /// `½ Σ m |v1 − v0|² + E(x0) − E(x1) − f(x1)·(x1 − x0)` a step: the second part, and so all of it, is
    /// never negative where the energy is convex along the step. The energy–momentum method takes what its
    /// correction has not reached, some 1e-10 of what there is. 0 in explicit schemes.
    pub numerical: f64,
    /// Correction of the energy from outside the motion, such as the loss in a cut.
    pub energy_correction: f64,
    /// Kinetic plus elastic energy at the start.
    pub initial: f64,
    /// What of the kinetic energy the steps themselves do not see: velocity Verlet's velocities stand
    /// half a step apart, and what it conserves is `½ Σ m v(t − Δt/2)·v(t + Δt/2)` and the potential
    /// energy. `kinetic` is `Δt²/8 Σ f²/m` more, and under symplectic Euler, which reads the earlier of
    /// the two, `Δt/2 Σ f·v` less; counted from the start, without the jumps where the force law, velocities or steps
    /// changed. 0 under implicit schemes.
    pub staggered: f64,
    /// Linear momentum (kg m/s).
    pub momentum: DVec3,
}

impl Audit {
    /// Work of all that acts from outside.
    #[must_use]
    pub fn external_work(&self) -> f64 {
        self.load_work + self.applied_work + self.support_work
    }

    /// What is there less what should be there: 0 for an exact solution, and for explicit schemes with
    /// linear forces, whatever their steps. (With the kinetic energy of the velocities at whole steps it would
    /// swing by `(ω Δt)²/4` of the energy in a mode `ω`, and keep that much of what a cut releases
    /// into the stiffest modes when damping has taken them.) It is no sign of a step that is too large:
    /// in a mode that grows without bound it is kept, too; there `staggered` grows past what was put in.
    #[must_use]
    pub fn energy_error(&self) -> f64 {
        self.kinetic - self.staggered + self.elastic + self.dissipated + self.numerical
            - self.initial
            - self.energy_correction
            - self.external_work()
    }

    /// Energy (J) that damping and the scheme took.
    #[must_use]
    pub fn taken(&self) -> f64 {
        self.dissipated + self.numerical.max(0.0)
    }

    /// Fraction that nothing explains, of the larger of what is stored and what damping and the scheme took. It has no meaning
    /// where all of that is below the energy's round-off.
    #[must_use]
    pub fn unexplained(&self) -> f64 {
        let scale = self.elastic.max(self.taken());
        self.energy_error().abs() / scale.max(f64::MIN_POSITIVE)
    }

    /// Energy that the balance is to be judged by: the sum of all amounts that went in or out.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.initial.abs()
            + self.energy_correction.abs()
            + self.load_work.abs()
            + self.applied_work.abs()
            + self.support_work.abs()
            + self.dissipated.abs()
    }

    /// Fraction of the energy that appeared or vanished since `before`.
    ///
    /// With the change of the balance over the time between, `δ = |balance - balance'|`, this is `max(δ, lag - s) / s`,
    /// where `s` is the largest of the elastic and the kinetic energy before, the work from outside since, and what
    /// was dissipated since (no more than there was and came in), the rigid motions of free pieces taken out of all of
    /// these: a severed piece that falls has soon many times the energy that strains anything, and would hide what
    /// appears in the rest. Not what there is now: a motion that diverges would be its own measure. In a mode that
    /// grows without bound the balance is kept, but what it leaves out of the kinetic energy grows past all there was:
    /// so `lag` counts where it is above `s`.
    ///
    /// # Arguments
    /// * `rigid` -- energies of rigid motions before and now ([`crate::Motion::rigid_energies`]).
    /// * `lag` -- that of the last step (J; [`crate::State::lag`]).
    /// * `round_off` -- energy (J) below which nothing is said, as the model's; it is not below 1e-9 of
    ///   [`Audit::scale`].
    #[must_use]
    pub fn imbalance(
        &self,
        before: &Self,
        rigid: [RigidEnergies; 2],
        lag: f64,
        round_off: f64,
    ) -> f64 {
        let [_, now] = rigid;
        let change = (self.energy_error() - before.energy_error()).abs();
        let scale = self.scale_since(before, rigid);
        let floor = (1e-9 * self.scale()).max(round_off);
        let unseen = lag - now.lag - scale;
        let off = [change, unseen].into_iter().filter(|off| *off > floor);
        let off = off.fold(0.0, f64::max);
        if off > 0.0 { off / scale } else { 0.0 }
    }

    /// The measure `s` of [`Audit::imbalance`] (J).
    #[must_use]
    pub fn scale_since(&self, before: &Self, [then, now]: [RigidEnergies; 2]) -> f64 {
        let dissipated = (self.dissipated - before.dissipated).abs();
        let lifted = now.kinetic - then.kinetic;
        let work = (self.external_work() - before.external_work() - lifted).abs();
        let had = before.elastic.max(before.kinetic - then.kinetic);
        had.max(work).max(dissipated.min(had + work))
    }
}

/// What of a motion's energies is of the rigid motions of the pieces that no support holds
/// ([`crate::Motion::rigid_energies`]).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RigidEnergies {
    /// Kinetic energy (J).
    pub kinetic: f64,
    /// Their part of [`crate::State::lag`] (J).
    pub lag: f64,
}

/// The balance is off by more than the settings allow; the motion continues.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[error(
    "at {time:.4e} s the energy is {:+.1} % off; most kinetic energy is at node {node}: {cause}",
    1e2 * .relative
)]
#[non_exhaustive]
pub struct Warning {
    /// Time (s).
    pub time: f64,
    /// The node with most kinetic energy.
    pub node: usize,
    /// Balance over scale.
    pub relative: f64,
    /// Likely cause.
    pub cause: Cause,
}

#[cfg(test)]
#[path = "audit_tests.rs"]
mod tests;
