//! What ranks other than the front do: the commands they receive.

use std::path::PathBuf;

use phyxel::BodyProblem;
use phyxel_integrate::{Pass, State};
use serde::{Deserialize, Serialize};

use crate::command::Command;
use crate::memory::{Memory, moving};
use crate::package::{Change, Package, RankModel};
use crate::share::Share;
use crate::vtu::write_piece;
use crate::wire::{
    FRONT, Wire, all_fine, await_front, broadcast, gather, packed, rank, receive, receive_vectors,
    received_vectors, send_vectors,
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
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
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
    /// Numbers of it.
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
}

/// Does what the front commands until it ends.
pub(crate) fn serve() -> Result<(), WorkerError> {
    let mut wire = Wire::default();
    let mut share: Option<Share> = None;
    let mut memory = Memory::default();
    await_front();
    loop {
        let command = Command::take();
        match command {
            Command::RankModel => {
                drop(share.take());
                let (package, model): (Package, RankModel) = postcard::from_bytes(&receive(FRONT))?;
                let built = Share::new(package, &model);
                all_fine(built.is_ok());
                share = Some(built?);
                continue;
            }
            Command::End => {
                let counted = Counted::of(share.as_ref(), &memory, &wire);
                gather(&packed::<{ Counted::LENGTH }>(&counted), &[]);
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

/// A step of which the front sees the monitored nodes, as `phyxel_integrate::Shares` of the front asks for it.
fn watched_step(share: &mut Share, pass: &Pass, wire: &mut Wire) {
    let mut watched = vec![0.0; 3 * share.package.watched_count];
    broadcast(&mut watched);
    share.set_watched(&watched, false);
    share.begin(pass);
    let motion = &share.motion;
    let places = share.watched(&[motion.positions(), motion.velocities()]);
    gather(&places, &[]);
    broadcast(&mut watched);
    share.set_watched(&watched, true);
    share.evaluate(wire);
    gather(&share.watched(&[share.own_forces()]), &[]);
    watched.push(0.0);
    broadcast(&mut watched);
    gather(&share.end_watched(pass, &watched), &[]);
}

fn set_state(share: &mut Share, wire: &mut Wire) -> Result<(), WorkerError> {
    let (state, loads, viscosity): (State, Vec<glam::DVec3>, f64) =
        postcard::from_bytes(&receive(FRONT))?;
    share.set_state(state, &loads, viscosity)?;
    if share.package.carries {
        share.evaluate(wire);
    }
    Ok(())
}

fn change(share: &mut Share, rows: bool, wire: &mut Wire) -> Result<(), WorkerError> {
    let change: Change = postcard::from_bytes(&receive(FRONT))?;
    let changed = share.change(change);
    all_fine(changed.is_ok());
    changed?;
    if rows {
        share.evaluate_again(wire)?;
    }
    Ok(())
}

fn write(share: &mut Share, wire: &mut Wire) {
    let name = receive(FRONT);
    let folder = PathBuf::from(String::from_utf8_lossy(&name).into_owned());
    share.evaluate_if_due(wire);
    if let Err(error) = write_piece(share, &folder, rank()) {
        eprintln!("rank {}: {}: {error}", rank(), folder.display());
    }
    gather(&[0.0], &[]);
}

fn obey(
    command: Command,
    share: &mut Share,
    memory: &mut Memory,
    wire: &mut Wire,
) -> Result<(), WorkerError> {
    match command {
        Command::RankModel | Command::End => {}
        Command::State => set_state(share, wire)?,
        Command::Change(rows) => change(share, rows, wire)?,
        Command::Step(pass) => {
            gather(&share.step(&pass, wire), &[]);
        }
        Command::Watched(pass) => watched_step(share, &pass, wire),
        Command::Decay(factor) => {
            let works = share.decay(factor);
            gather(&works.each_ref().map(|works| works.len() as f64), &[]);
            gather(&works.concat(), &[]);
        }
        Command::Fetch => {
            hear_velocities(share);
            let lists = moving(share.motion.state()).into_iter();
            lists.for_each(|list| send_vectors(FRONT, list));
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
        Command::Kept => memory
            .kept()
            .iter()
            .for_each(|list| send_vectors(FRONT, list)),
        Command::Write => write(share, wire),
    }
    Ok(())
}
