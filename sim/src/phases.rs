//! Wall-clock time by phase of the run.

use std::time::{Duration, Instant};

/// What the run loop spends time on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Mesh, nodes, stencils, model: everything before the first step.
    Setup,
    /// Elastic forces.
    Forces,
    /// Contact of tools with the body.
    Contact,
    /// Motion of the nodes, without the forces.
    Integration,
    /// Blade mapping, cut geometry, factors, stencils and the new stable step.
    Cut,
    /// Surfels carried by the nodes and new skin.
    Skinning,
    /// Pictures, from surfels to pixels.
    Drawing,
    /// Encoding and writing of files.
    Writing,
}

impl Phase {
    /// Every phase with its name in reports, in the order of a step.
    pub const ALL: [(Self, &'static str); 8] = [
        (Self::Setup, "setup"),
        (Self::Forces, "forces"),
        (Self::Contact, "contact"),
        (Self::Integration, "integration"),
        (Self::Cut, "cut"),
        (Self::Skinning, "skinning"),
        (Self::Drawing, "drawing"),
        (Self::Writing, "writing"),
    ];
}

/// Time spent in one phase.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Spent {
    /// Total (s).
    pub seconds: f64,
    /// How often the phase was entered.
    pub calls: u64,
}

/// A stopwatch per [`Phase`].
#[derive(Debug, Clone, Default)]
pub struct Phases {
    spent: [Spent; Phase::ALL.len()],
}

impl Phases {
    /// Runs `work` and adds its time to `phase`.
    pub fn time<T>(&mut self, phase: Phase, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.add(phase, start.elapsed());
        result
    }

    /// Books a duration measured elsewhere.
    pub fn add(&mut self, phase: Phase, duration: Duration) {
        let spent = &mut self.spent[phase as usize];
        spent.seconds += duration.as_secs_f64();
        spent.calls += 1;
    }

    /// Time spent in a phase so far.
    #[must_use]
    pub fn of(&self, phase: Phase) -> Spent {
        self.spent[phase as usize]
    }
}

/// Time in parts of a body's step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepTimes {
    pub(crate) forces: Duration,
    /// Contact with tools.
    pub(crate) tools: Duration,
}

/// Does some work and adds its time to a sum.
pub(crate) fn timed<T>(sum: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *sum += start.elapsed();
    result
}
