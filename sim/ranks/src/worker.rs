//! What ranks other than the front do: the commands they receive.

use std::path::{Path, PathBuf};

use phyxel::BodyProblem;
use phyxel_integrate::State;

use crate::command::{Command, LENGTH};
use crate::memory::Memory;
use crate::package::{Change, Package};
use crate::share::Share;
use crate::wire::{
    FRONT, Wire, await_front, broadcast, gather, rank, receive, receive_vectors, received_vectors,
    send_vectors,
};

/// Why a rank cannot continue.
#[derive(Debug, thiserror::Error)]
pub(crate) enum WorkerError {
    #[error(transparent)]
    Body(#[from] BodyProblem),
    #[error("a message from rank 0 cannot be read: {0}")]
    Message(#[from] postcard::Error),
    #[error("rank 0 asks for steps before there is a model")]
    Order,
}

/// What a rank counted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Counted {
    /// Own nodes, nodes of others, heap bytes of the share.
    pub(crate) own: f64,
    pub(crate) ghosts: f64,
    pub(crate) heap: f64,
    /// Exchanges of ghosts, messages and bytes sent in them.
    pub(crate) exchanges: f64,
    pub(crate) messages: f64,
    pub(crate) bytes: f64,
    /// Seconds in the force law, in exchanges, and in estimates with theirs.
    pub(crate) in_forces: f64,
    pub(crate) in_exchange: f64,
    pub(crate) in_estimates: f64,
}

impl Counted {
    pub(crate) const LENGTH: usize = 9;

    pub(crate) fn of(share: Option<&Share>, memory: &Memory, wire: &Wire) -> Self {
        Self {
            own: share.map_or(0.0, |share| share.package.count as f64),
            ghosts: share.map_or(0.0, |share| share.ghosts() as f64),
            heap: share.map_or(0.0, |share| (share.bytes() + memory.bytes()) as f64),
            exchanges: wire.exchanges as f64,
            messages: wire.messages as f64,
            bytes: wire.bytes as f64,
            in_forces: share.map_or(0.0, |share| share.in_forces.as_secs_f64()),
            in_exchange: wire.waited.as_secs_f64(),
            in_estimates: share.map_or(0.0, |share| share.in_estimates.as_secs_f64()),
        }
    }

    fn numbers(&mut self) -> [&mut f64; Self::LENGTH] {
        [
            &mut self.own,
            &mut self.ghosts,
            &mut self.heap,
            &mut self.exchanges,
            &mut self.messages,
            &mut self.bytes,
            &mut self.in_forces,
            &mut self.in_exchange,
            &mut self.in_estimates,
        ]
    }

    pub(crate) fn encode(mut self) -> [f64; Self::LENGTH] {
        self.numbers().map(|number| *number)
    }

    pub(crate) fn decode(numbers: [f64; Self::LENGTH]) -> Self {
        let mut found = Self::default();
        for (to, from) in found.numbers().into_iter().zip(numbers) {
            *to = from;
        }
        found
    }
}

/// Does what the front commands until it ends.
pub(crate) fn serve() -> Result<(), WorkerError> {
    let mut wire = Wire::default();
    let mut share: Option<Share> = None;
    let mut memory = Memory::default();
    await_front();
    loop {
        let mut numbers = [0.0; LENGTH];
        broadcast(&mut numbers);
        let command = Command::decode(numbers);
        match command {
            Command::Model => {
                drop(share.take());
                let package: Package = postcard::from_bytes(&receive(FRONT))?;
                let built = Share::new(package);
                gather(&[f64::from(u8::from(built.is_ok()))], &[]);
                share = Some(built?);
                continue;
            }
            Command::End => {
                gather(&Counted::of(share.as_ref(), &memory, &wire).encode(), &[]);
                return Ok(());
            }
            _ => {}
        }
        let share = share.as_mut().ok_or(WorkerError::Order)?;
        obey(command, share, &mut memory, &mut wire)?;
    }
}

/// Adopts the velocities of monitored nodes, of which rank 0 knows more.
fn hear_velocities(share: &mut Share) {
    // Of all ranks' nodes: none of a rank's own may be among them.
    if share.package.watched_count > 0 {
        let mut velocities = vec![0.0; 3 * share.package.watched_count];
        broadcast(&mut velocities);
        share.set_watched(&velocities, false);
    }
}

fn obey(
    command: Command,
    share: &mut Share,
    memory: &mut Memory,
    wire: &mut Wire,
) -> Result<(), WorkerError> {
    match command {
        Command::Model | Command::End => {}
        Command::State => {
            let (state, loads, viscosity): (State, Vec<glam::DVec3>, f64) =
                postcard::from_bytes(&receive(FRONT))?;
            share.set_state(state, &loads, viscosity)?;
            if share.package.carries {
                share.evaluate(wire);
            }
        }
        Command::Change(rows) => {
            let change: Change = postcard::from_bytes(&receive(FRONT))?;
            let changed = share.change(change);
            gather(&[f64::from(u8::from(changed.is_ok()))], &[]);
            changed?;
            if rows {
                share.evaluate_again(wire)?;
            }
        }
        Command::Step(pass) => {
            share.clear_applied();
            share.begin(&pass);
            share.evaluate(wire);
            gather(&share.end(&pass), &[]);
        }
        Command::Watched(pass) => {
            let mut watched = vec![0.0; 3 * share.package.watched_count];
            broadcast(&mut watched);
            share.set_watched(&watched, false);
            share.begin(&pass);
            let motion = &share.motion;
            gather(
                &share.watched(&[motion.positions(), motion.velocities()]),
                &[],
            );
            broadcast(&mut watched);
            share.set_watched(&watched, true);
            share.evaluate(wire);
            gather(&share.watched(&[share.own_forces()]), &[]);
            watched.push(0.0);
            broadcast(&mut watched);
            gather(&share.end_watched(&pass, &watched), &[]);
        }
        Command::Decay(factor) => {
            let works = share.decay(factor);
            gather(&works.each_ref().map(|works| works.len() as f64), &[]);
            gather(&works.concat(), &[]);
        }
        Command::Fetch => {
            hear_velocities(share);
            let state = share.motion.state();
            let lists = [
                &state.positions,
                &state.velocities,
                &state.forces,
                &state.viscous,
            ];
            for list in lists {
                send_vectors(FRONT, list);
            }
        }
        Command::Store => {
            let (_, velocities) = share.motion.places_mut();
            receive_vectors(FRONT, velocities);
            receive_vectors(FRONT, share.motion.viscous_mut());
        }
        Command::Estimate(settings) => {
            let found = share.estimate(wire, &settings, &mut memory.vector);
            if let Err(error) = found {
                gather(&[share.bad_node(&error)], &[]);
            }
        }
        Command::SetVector => memory.vector = received_vectors(FRONT),
        Command::Vector => send_vectors(FRONT, &memory.vector),
        Command::Stiffest(count, runs) => {
            let mut list = vec![0.0; runs.unwrap_or(0)];
            broadcast(&mut list);
            let told = share.stiffest(wire, count, runs.map(|_| &list[..]));
            gather(&told, &[]);
        }
        Command::Read(gradients, places) => {
            let mut nodes = vec![0.0; gradients + places];
            broadcast(&mut nodes);
            gather(&share.read(wire, &nodes, gradients), &[]);
        }
        Command::Keep => {
            hear_velocities(share);
            memory.keep(share.motion.state());
        }
        Command::Kept => {
            for list in memory.kept() {
                send_vectors(FRONT, list);
            }
        }
        Command::Write => {
            let name = receive(FRONT);
            let folder = PathBuf::from(String::from_utf8_lossy(&name).into_owned());
            share.evaluate_if_due(wire);
            if let Err(error) = write_nodes(share, &folder) {
                eprintln!("rank {}: {}: {error}", rank(), folder.display());
            }
            gather(&[0.0], &[]);
        }
    }
    Ok(())
}

/// Writes a rank's nodes.
pub(crate) fn write_nodes(share: &Share, folder: &Path) -> std::io::Result<()> {
    crate::vtu::write_piece(share, folder, rank())
}
