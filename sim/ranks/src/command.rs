//! What the front asks of all ranks, itself included.

use phyxel_integrate::{EigenvalueSettings, Pass};
use serde::{Deserialize, Serialize};

use crate::wire::{broadcast, packed, unpacked};

/// Numbers of a command.
const LENGTH: usize = 6;

/// A command.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum Command {
    /// A package for each rank follows.
    RankModel,
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

impl Command {
    /// Gives it to all other ranks.
    pub(crate) fn give(self) {
        let mut numbers: [f64; LENGTH] = packed(&self);
        broadcast(&mut numbers);
    }

    /// Takes what rank 0 gives; what is no command ends the rank.
    pub(crate) fn take() -> Self {
        let mut numbers = [0.0; LENGTH];
        broadcast(&mut numbers);
        unpacked(&numbers).unwrap_or(Self::End)
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
        // Those that say something, and the first and last.
        let all = [
            Command::RankModel,
            Command::Step(pass),
            Command::Watched(pass),
            Command::Decay(0.75),
            Command::Estimate(EigenvalueSettings::default()),
            Command::Stiffest(8, None),
            Command::Stiffest(8, Some(3)),
            Command::Read(5, 0),
            Command::Change(true),
            Command::Change(false),
            Command::End,
        ];
        for command in all {
            let numbers: [f64; LENGTH] = packed(&command);
            assert_eq!(unpacked::<Command>(&numbers), Ok(command));
        }
    }
}
