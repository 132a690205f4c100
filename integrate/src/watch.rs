//! The watchdog over a motion: whether energy appears, how stiff the body has become, and how much
//! shorter its steps are to be.

use crate::DeformableState;
use crate::audit::{RigidEnergies, Warning};
use crate::error::{Cause, StepError};
use crate::motion::{Motion, State};
use crate::shares::Shares;
use crate::vector::largest;
use glam::DVec3;

/// Steps in a row with the balance off before anything is said. An unstable step multiplies energies
/// by some power of its excess each time, so this is far from overflow.
const PATIENCE: u32 = 10;

/// Energy balance over what went in above which a warning is kept, and a part of an implicit step is halved.
pub(crate) const LARGEST_BALANCE: f64 = 0.05;
/// A kinetic energy above this multiple of all energy that ever went in is a divergence. A stable
/// step near the critical one swings by some ten times in the highest mode.
const GROWTH_LIMIT: f64 = 100.0;

/// Energy that may appear or vanish over [`StepControl::STEPS`] steps: [`Audit::imbalance`](crate::Audit::imbalance). What a
/// severed tip loses as it lands faster than its waves is never much in one stretch, but 1.0 % in all with 0.2 % allowed, in
/// 4,580 steps (`run liver`); 0.37 % in 5,124 with this.
const LARGEST_IMBALANCE: f64 = 5e-4;
/// The same of contact between bodies, whose springs set in and let go within steps.
const LARGEST_CONTACT_IMBALANCE: f64 = 2e-3;
/// Energy-balance error with which a run ends if no shorter step lowers it.
const FATAL_IMBALANCE: f64 = 0.5;
/// Fraction of the first stable step below which a motion leads nowhere: it would take a million times as long.
const SMALLEST_STEP: f64 = 1e-6;
/// How fast steps grow again after they were shortened, per check.
const RECOVERY: f64 = 1.2;
/// An estimate comes from below and may miss a mode that the one before it saw: it never falls faster
/// than this from one to the next. (Falling freely, two products once let the step of a liver grow by
/// half past the limit.)
const SLOWEST_FALL: f64 = 0.8;
/// Rise of the stiffness indicator of a run of nodes since the last estimate that asks for the next.
const ALARM_RISE: f64 = 1.1;
/// Fraction of the largest indicator from which on a run of nodes is listened to. Once the largest has fallen by it, runs that
/// were not may be the stiffest.
const WATCHED_FRACTION: f64 = 0.5;

/// How much shorter than the stable step explicit steps are taken, after some had to be taken again.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StepControl {
    /// The stable step is divided by this, at least 1.
    pub divisor: f64,
}

impl Default for StepControl {
    fn default() -> Self {
        Self { divisor: 1.0 }
    }
}

impl StepControl {
    /// Steps between two checks of the energy, and between two snapshots to return to.
    pub const STEPS: u64 = 50;
    /// Divisions of the steps of a stretch that is taken again, one after the other until one holds.
    pub const DIVISIONS: [u32; 3] = [2, 4, 8];

    /// Whether it can be one of a running motion.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.divisor.is_finite() && self.divisor >= 1.0
    }

    /// A stretch is taken again in steps that are `division` times as short.
    pub fn shorten(&mut self, division: u32) {
        self.divisor = self.divisor.max(f64::from(division));
    }

    /// A check found nothing wrong.
    pub fn recover(&mut self) {
        self.divisor = (self.divisor / RECOVERY).max(1.0);
    }

    /// Step (s) below which a motion leads nowhere, of its first stable step (s).
    #[must_use]
    pub fn smallest_step(first: f64) -> f64 {
        SMALLEST_STEP * first
    }

    /// Whether a run must end with an energy-balance error that no shorter step lowers.
    #[must_use]
    pub fn is_fatal(imbalance: f64) -> bool {
        imbalance >= FATAL_IMBALANCE
    }
}

/// Where stiffness has changed so much that its largest eigenvalue is to be estimated again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Alarm {
    /// It fell everywhere.
    Fell,
    /// It rose at these runs of nodes, ascending.
    Rose(Vec<usize>),
}

/// Estimates of the largest eigenvalue of a body as it moves, which give its stable step.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StiffnessTracker {
    /// Largest eigenvalue (1/s²) as last estimated, of the whole and around its stiffest nodes.
    pub estimates: [f64; 2],
    /// Stiffness indicators (1/s²) of the runs of nodes when an estimate was last made because of them; empty
    /// before the first.
    pub indicators: Vec<f64>,
}

impl StiffnessTracker {
    /// Starts from the eigenvalue (1/s²) at rest.
    #[must_use]
    pub fn new(eigenvalue: f64) -> Self {
        Self {
            estimates: [eigenvalue; 2],
            indicators: Vec::new(),
        }
    }

    /// The larger of both estimates (1/s²).
    #[must_use]
    pub fn eigenvalue(&self) -> f64 {
        self.estimates[0].max(self.estimates[1])
    }

    /// Takes an estimate (1/s²) of the whole; that around the stiffest nodes is due as well then.
    pub fn take_whole(&mut self, eigenvalue: f64) {
        let [whole, local] = &mut self.estimates;
        *whole = eigenvalue.max(SLOWEST_FALL * *whole);
        *local *= SLOWEST_FALL;
    }

    /// Takes an estimate (1/s²) around some nodes; what was found elsewhere stays.
    pub fn take_local(&mut self, eigenvalue: f64) {
        self.estimates[1] = self.estimates[1].max(eigenvalue);
    }

    /// Compares the indicators (1/s²) of runs of nodes with those of the last estimate.
    #[must_use]
    pub fn follow(&mut self, indicators: Vec<f64>) -> Option<Alarm> {
        let largest = indicators.iter().copied().fold(0.0, f64::max);
        self.indicators.resize(indicators.len(), 0.0);
        let before = self.indicators.iter().copied().fold(0.0, f64::max);
        if largest < WATCHED_FRACTION * before {
            self.indicators = indicators;
            self.estimates[1] *= SLOWEST_FALL;
            return Some(Alarm::Fell);
        }
        let mut rose = Vec::new();
        for (run, (now, before)) in indicators.into_iter().zip(&mut self.indicators).enumerate() {
            if now > ALARM_RISE * *before && now > WATCHED_FRACTION * largest {
                *before = now;
                rose.push(run);
            }
        }
        (!rose.is_empty()).then_some(Alarm::Rose(rose))
    }
}

impl DeformableState {
    /// The energy error since a snapshot over `moved` (J), the sum of what its bodies moved
    /// ([`Audit::scale_since`](crate::Audit::scale_since)), what springs held then or what offsets put in, if it is above what
    /// is allowed; `round_off` as for a motion.
    #[must_use]
    pub fn gained_since(&self, before: &Self, moved: f64, round_off: f64) -> Option<f64> {
        let change = (self.energy_error() - before.energy_error()).abs();
        let sums = [self.work, self.energy, self.dissipated, self.offset_work];
        let floor = round_off.max(1e-9 * sums.iter().map(|sum| sum.abs()).sum::<f64>());
        let put_in = (self.offset_work - before.offset_work).abs();
        let scale = moved.max(before.energy).max(put_in);
        (change > floor && change > LARGEST_CONTACT_IMBALANCE * scale).then(|| change / scale)
    }
}

impl Motion {
    /// The energy-balance error since a snapshot if it is above what is allowed, larger where a tool presses.
    ///
    /// # Arguments
    /// * `rigid` -- energies of rigid motions then and now ([`Motion::rigid_energies`]).
    /// * `round_off` -- energy (J) below which nothing is said.
    #[must_use]
    pub fn gained_since(
        &self,
        before: &State,
        rigid: [RigidEnergies; 2],
        round_off: f64,
    ) -> Option<f64> {
        let state = &self.state;
        let pressed = [before, state].map(State::is_pressed);
        // A force that sets in with the last step kicks before it works.
        let lag = if pressed == [false, true] {
            0.0
        } else {
            state.lag
        };
        let imbalance = (state.audit).imbalance(&before.audit, rigid, lag, round_off);
        (imbalance > LARGEST_IMBALANCE).then_some(imbalance)
    }

    /// Compares the energies after a step with what went in.
    pub(crate) fn judge(
        &mut self,
        step: f64,
        shares: Option<&mut dyn Shares>,
    ) -> Result<(), StepError> {
        let audit = self.state.audit;
        let scale = audit.scale();
        // With all of the kinetic energy: what staggered velocities conserve, they conserve in a mode
        // that grows without bound, too.
        let off = audit.energy_error() + audit.staggered;
        // What an implicit scheme gave is booked, and no less of a gain for it.
        let balance = off.abs().max(-audit.numerical);
        if balance <= LARGEST_BALANCE * scale {
            self.state.suspicion = 0;
            return Ok(());
        }
        // A force that sets in suddenly kicks before it works: wait whether the balance stays off.
        self.state.suspicion += 1;
        if self.state.suspicion < PATIENCE {
            return Ok(());
        }
        // Below 1e-9 body sizes a step, energies are round-off.
        let slow = 1e-9 * self.size / step;
        let floor = 0.5 * self.nodes.masses.iter().sum::<f64>() * slow * slow;
        if balance <= floor {
            return Ok(());
        }
        if let Some(shares) = shares {
            shares.fetch(&mut self.state);
        }
        // What damping took is no measure: of a motion that diverges it takes as much as there is.
        let put_in = scale - audit.dissipated.abs();
        if audit.kinetic > GROWTH_LIMIT * put_in && audit.kinetic > floor {
            let node = self.fastest_node();
            return Err(StepError::Diverged {
                node,
                time: self.state.time,
                kinetic: audit.kinetic,
                cause: self.cause(node, step),
            });
        }
        if self.warning.is_none() {
            let node = self.fastest_node();
            self.warning = Some(Warning {
                time: self.state.time,
                node,
                relative: balance.copysign(off) / scale,
                cause: self.cause(node, step),
            });
        }
        Ok(())
    }

    fn fastest_node(&self) -> usize {
        let energies = self.nodes.masses.iter().zip(&self.state.velocities);
        largest(energies.map(|(m, v)| m * v.length_squared()))
    }

    fn cause(&self, node: usize, step: f64) -> Cause {
        let at = |v: &Vec<DVec3>| v.get(node).map_or(0.0, |f| f.length());
        match self.critical_step {
            Some(critical) if step > critical => Cause::StepTooLarge { step, critical },
            _ if at(&self.state.applied) > at(&self.state.forces) => Cause::ContactTooStiff,
            _ => Cause::StiffnessRose,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::StepView;
    use crate::testing::{free, springs};
    use glam::DVec3;

    /// A chain that flies, and whose end meets a spring with the last step of the stretch: the force has not worked yet.
    /// That steps beyond the limit gain energy is seen.
    #[test]
    fn a_force_that_sets_in_with_the_last_step_is_no_gain() {
        let rest = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0].map(|x| DVec3::X * x);
        let mut motion = free(&rest, &[0.1; 8]);
        motion.set_pieces(&[0; 8]);
        motion.set_velocities(&[DVec3::X; 8]).unwrap();
        let forces = springs(&rest, 10.0);
        let wall = &mut |view: &StepView<'_>, f: &mut [DVec3]| {
            f[7].x -= 100.0 * (view.positions[7].x - 7.0799).max(0.0);
        };
        let mut stretch = |step: f64| {
            let (before, rigid) = (motion.state().clone(), motion.rigid_energies());
            for _ in 0..8 {
                motion.step_with(step, &forces, wall).unwrap();
            }
            let gained = motion.gained_since(&before, [rigid, motion.rigid_energies()], 0.0);
            (motion.state().is_pressed(), gained.is_some())
        };
        assert_eq!(stretch(0.01), (true, false));
        assert_eq!(stretch(0.001), (true, false));
        assert!(stretch(0.2).1);
    }

    /// Contact that gives 1 J which nothing held is seen, one whose springs or offsets had it is not.
    #[test]
    fn contact_that_makes_energy_is_seen() {
        let before = DeformableState {
            energy: 3.0,
            work: 10.0,
            ..DeformableState::default()
        };
        let after = |energy, offset_work| DeformableState {
            energy,
            offset_work,
            work: 11.0,
            ..DeformableState::default()
        };
        let gained = |after: DeformableState| after.gained_since(&before, 5.0, 0.0);
        assert_eq!(gained(after(2.0, 0.0)), None, "its springs");
        assert_eq!(gained(after(3.0, 1.0)), None, "its offsets");
        let share = gained(after(3.0, 0.0)).expect("seen");
        assert!((share - 0.2).abs() < 1e-12, "of what moved: {share}");
        assert!(gained(after(2.02, 0.0)).is_some() && gained(after(2.005, 0.0)).is_none());
        assert_eq!(after(3.0, 0.0).gained_since(&before, 5.0, 2.0), None);
    }

    #[test]
    fn steps_shorten_at_once_and_recover_slowly() {
        let mut control = StepControl::default();
        control.shorten(4);
        control.shorten(2);
        assert!((control.divisor - 4.0).abs() < 1e-15, "{control:?}");
        let checks = (1..100).find(|_| {
            control.recover();
            control.divisor <= 1.0
        });
        assert_eq!(checks, Some(8), "1.2^8 is above 4");
        assert!(control.is_sound());
        assert!(!StepControl { divisor: 0.5 }.is_sound());
        assert!(StepControl::is_fatal(0.5) && !StepControl::is_fatal(0.4));
    }

    #[test]
    fn alarms_say_where_stiffness_rose_or_that_it_fell() {
        let mut tracker = StiffnessTracker::new(100.0);
        let rose = |runs: &[usize]| Some(Alarm::Rose(runs.to_vec()));
        for (indicators, alarm) in [
            ([10.0, 1.0, 6.0], rose(&[0, 2])),
            // By less than a tenth.
            ([10.5, 1.0, 6.0], None),
            // Below half of the largest.
            ([10.5, 4.0, 6.0], None),
            ([10.5, 4.0, 9.0], rose(&[2])),
            ([4.0, 4.0, 4.0], Some(Alarm::Fell)),
        ] {
            assert_eq!(tracker.follow(indicators.to_vec()), alarm, "{indicators:?}");
        }
        let local = |tracker: &StiffnessTracker| tracker.estimates[1];
        assert!((local(&tracker) - 80.0).abs() < 1e-12, "falls slowly");
        tracker.take_whole(10.0);
        tracker.take_local(70.0);
        assert!((local(&tracker) - 70.0).abs() < 1e-12, "{tracker:?}");
        assert!((tracker.eigenvalue() - 80.0).abs() < 1e-15);
    }
}
