//! What the front asks of all ranks, itself included.

use phyxel_integrate::{EigenvalueSettings, Pass};

use crate::estimate::whole;

/// A command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Command {
    /// A package for each rank follows.
    Model,
    /// A change of its model for each rank follows; whether rows changed on any.
    Change(bool),
    /// A state for each rank follows; of each, as many viscous forces as nodes or none.
    State,
    /// A whole step.
    Step(Pass),
    /// A step of which the front sees the monitored nodes.
    Watched(Pass),
    /// Velocities of monitored nodes follow, if there are any; then positions, velocities, forces and viscous forces of all
    /// go to the front.
    Fetch,
    /// Velocities and viscous forces come from it.
    Store,
    /// The retained gradients decay by a factor.
    Decay(f64),
    /// Every rank writes its nodes into the folder that follows.
    Write,
    /// Estimates the largest eigenvalue.
    Estimate(EigenvalueSettings),
    /// The vector of estimates comes from the front.
    SetVector,
    /// It goes there.
    Vector,
    /// So many of the stiffest nodes are reported, of all or of as many runs of nodes as follow.
    Stiffest(usize, Option<usize>),
    /// Deformation gradients of so many nodes and positions of so many others, which follow, are reported.
    Read(usize, usize),
    /// Velocities of monitored nodes follow, if there are any; with them the state is kept.
    Keep,
    /// What was kept goes to the front.
    Kept,
    /// What was counted goes to the front, and the ranks end.
    End,
}

/// Numbers of a command.
pub(crate) const LENGTH: usize = 6;

impl Command {
    /// As numbers.
    pub(crate) fn encode(self) -> [f64; LENGTH] {
        let of = |code: f64, pass: Option<Pass>| {
            pass.map_or([code, 0.0, 0.0, 0.0, 0.0, 0.0], |pass| {
                let ([a, b], [c, d]) = (pass.first, pass.second);
                [code, pass.step, a, b, c, d]
            })
        };
        match self {
            Self::Model => of(1.0, None),
            Self::State => of(2.0, None),
            Self::Step(pass) => of(3.0, Some(pass)),
            Self::Watched(pass) => of(4.0, Some(pass)),
            Self::Fetch => of(5.0, None),
            Self::Store => of(6.0, None),
            Self::Write => of(7.0, None),
            Self::Decay(factor) => [8.0, factor, 0.0, 0.0, 0.0, 0.0],
            Self::End => of(9.0, None),
            Self::Estimate(settings) => {
                let products = settings.iterations as f64;
                let (tolerance, margin) = (settings.tolerance, settings.margin);
                [10.0, products, tolerance, margin, 0.0, 0.0]
            }
            Self::SetVector => of(11.0, None),
            Self::Vector => of(12.0, None),
            Self::Stiffest(count, runs) => {
                let runs = runs.map_or(-1.0, |runs| runs as f64);
                [13.0, count as f64, runs, 0.0, 0.0, 0.0]
            }
            Self::Read(gradients, places) => [14.0, gradients as f64, places as f64, 0.0, 0.0, 0.0],
            Self::Keep => of(15.0, None),
            Self::Kept => of(16.0, None),
            Self::Change(rows) => [17.0, f64::from(u8::from(rows)), 0.0, 0.0, 0.0, 0.0],
        }
    }

    /// From numbers; what is no command ends the rank.
    pub(crate) fn decode([code, step, a, b, c, d]: [f64; LENGTH]) -> Self {
        let pass = Pass {
            step,
            first: [a, b],
            second: [c, d],
        };
        match code as i64 {
            1 => Self::Model,
            2 => Self::State,
            3 => Self::Step(pass),
            4 => Self::Watched(pass),
            5 => Self::Fetch,
            6 => Self::Store,
            7 => Self::Write,
            8 => Self::Decay(step),
            10 => Self::Estimate(EigenvalueSettings {
                iterations: whole(step),
                tolerance: a,
                margin: b,
            }),
            11 => Self::SetVector,
            12 => Self::Vector,
            13 => Self::Stiffest(whole(step), (a >= 0.0).then(|| whole(a))),
            14 => Self::Read(whole(step), whole(a)),
            15 => Self::Keep,
            16 => Self::Kept,
            17 => Self::Change(step > 0.0),
            _ => Self::End,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_come_back_as_they_went() {
        let pass = Pass {
            step: 1e-3,
            first: [5e-4, 0.99],
            second: [0.0, 1.0],
        };
        let all = [
            Command::Model,
            Command::State,
            Command::Step(pass),
            Command::Watched(pass),
            Command::Fetch,
            Command::Store,
            Command::Write,
            Command::Decay(0.75),
            Command::Estimate(EigenvalueSettings::default()),
            Command::SetVector,
            Command::Vector,
            Command::Stiffest(8, None),
            Command::Stiffest(8, Some(3)),
            Command::Read(5, 0),
            Command::Keep,
            Command::Kept,
            Command::Change(true),
            Command::Change(false),
            Command::End,
        ];
        for command in all {
            assert_eq!(Command::decode(command.encode()), command);
        }
    }
}
