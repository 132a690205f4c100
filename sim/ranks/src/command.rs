//! What the front asks of all ranks, itself included.

use phyxel_integrate::Pass;

/// A command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Command {
    /// A package for each rank follows.
    Model,
    /// A state for each rank follows; of each, as many viscous forces as nodes or none.
    State,
    /// A whole step.
    Step(Pass),
    /// A step of which the front sees the watched nodes.
    Watched(Pass),
    /// Positions, velocities, forces and viscous forces go to the front.
    Fetch,
    /// Velocities and viscous forces come from it.
    Store,
    /// What rebuilt rows carried over decays by a factor.
    Decay(f64),
    /// Every rank writes its nodes into the folder that follows.
    Write,
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
        }
    }

    /// From numbers; what is no command ends the rank.
    pub(crate) fn decode([code, step, a, b, c, d]: [f64; LENGTH]) -> Self {
        let pass = Pass {
            step,
            first: [a, b],
            second: [c, d],
        };
        #[allow(
            clippy::cast_possible_truncation,
            reason = "codes are small whole numbers"
        )]
        match code as i64 {
            1 => Self::Model,
            2 => Self::State,
            3 => Self::Step(pass),
            4 => Self::Watched(pass),
            5 => Self::Fetch,
            6 => Self::Store,
            7 => Self::Write,
            8 => Self::Decay(step),
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
            Command::End,
        ];
        for command in all {
            assert_eq!(Command::decode(command.encode()), command);
        }
    }
}
