//! Messages between ranks. All numbers travel as `f64`; who sends how many to whom both sides know.

use std::time::{Duration, Instant};

use bytemuck::{cast_slice, cast_slice_mut};
use glam::DVec3;
use mpi::collective::{CommunicatorCollectives, Root};
use mpi::datatype::PartitionMut;
use mpi::point_to_point::{Destination, Source};
use mpi::request::multiple_scope;
use mpi::topology::{Communicator, Rank, SimpleCommunicator};
use serde::{Serialize, de::DeserializeOwned};

use crate::package::Package;

/// Rank that keeps the whole body.
pub(crate) const FRONT: usize = 0;
/// Largest number of bytes in one message; counts of MPI are of 31 bits.
const LARGEST: usize = 1 << 28;

/// A rank's end of all messages, with what it counts of the exchange of ghosts.
#[derive(Debug, Default)]
pub(crate) struct Wire {
    outgoing: Vec<Vec<f64>>,
    incoming: Vec<Vec<f64>>,
    /// Exchanges, messages sent in them, bytes sent in them.
    pub(crate) exchanges: u64,
    pub(crate) messages: u64,
    pub(crate) bytes: u64,
    /// Time in exchanges.
    pub(crate) waited: Duration,
}

/// Vectors as numbers.
pub(crate) fn flat(vectors: &[DVec3]) -> &[f64] {
    cast_slice(vectors)
}

/// Numbers as vectors.
pub(crate) fn vectors(numbers: &[f64]) -> &[DVec3] {
    cast_slice(numbers)
}

/// A value as numbers, for messages whose length all know.
pub(crate) fn packed<const N: usize>(value: &impl Serialize) -> [f64; N] {
    let mut numbers = [0.0; N];
    let bytes = cast_slice_mut(&mut numbers);
    postcard::to_slice(value, bytes).expect("as many numbers as it takes");
    numbers
}

/// What [`packed`] made numbers.
pub(crate) fn unpacked<T: DeserializeOwned>(numbers: &[f64]) -> postcard::Result<T> {
    postcard::from_bytes(cast_slice(numbers))
}

fn world() -> SimpleCommunicator {
    SimpleCommunicator::world()
}

fn mpi_rank(rank: usize) -> Rank {
    Rank::try_from(rank).unwrap_or(Rank::MAX)
}

/// This rank's number.
pub(crate) fn rank() -> usize {
    usize::try_from(world().rank()).unwrap_or(0)
}

/// Number of ranks.
pub(crate) fn ranks() -> usize {
    usize::try_from(world().size()).unwrap_or(1)
}

/// How many ranks run on this one's machine; a question that all have to ask.
pub(crate) fn ranks_here() -> usize {
    let here = world().split_shared(world().rank());
    usize::try_from(here.size()).unwrap_or(1)
}

/// Waits for the front's first word without taking a core from it, as MPI's own calls do.
pub(crate) fn await_front() {
    let world = world();
    let front = world.process_at_rank(mpi_rank(FRONT));
    while front.immediate_probe().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    receive(FRONT);
}

/// The front's first word to all ranks.
pub(crate) fn wake() {
    for rank in FRONT + 1..ranks() {
        send(rank, &[]);
    }
}

/// Gives all ranks what the front has.
pub(crate) fn broadcast(numbers: &mut [f64]) {
    world()
        .process_at_rank(mpi_rank(FRONT))
        .broadcast_into(numbers);
}

/// Counts of each rank's numbers as MPI takes them, and where they begin.
fn places(counts: &[usize]) -> (Vec<Rank>, Vec<Rank>) {
    let counts: Vec<Rank> = counts.iter().map(|&count| mpi_rank(count)).collect();
    let mut next = 0;
    let starts = counts.iter().map(|count| {
        next += count;
        next - count
    });
    let starts = starts.collect();
    (counts, starts)
}

/// Brings numbers of all ranks to the front, in the order of the ranks; nothing elsewhere.
pub(crate) fn gather(mine: &[f64], counts: &[usize]) -> Vec<f64> {
    let world = world();
    let root = world.process_at_rank(mpi_rank(FRONT));
    if rank() != FRONT {
        root.gather_varcount_into(mine);
        return Vec::new();
    }
    let mut all = vec![0.0; counts.iter().sum()];
    let (counts, starts) = places(counts);
    let mut parts = PartitionMut::new(&mut all[..], counts, starts);
    root.gather_varcount_into_root(mine, &mut parts);
    all
}

/// Brings numbers of all ranks to the front, of each so many of every kind, one kind after the other; all of a kind in the
/// order of the ranks.
pub(crate) fn gather_kinds<const N: usize>(mine: &[f64], counts: &[[usize; N]]) -> [Vec<f64>; N] {
    let of_ranks: Vec<usize> = counts.iter().map(|counts| counts.iter().sum()).collect();
    let all = gather(mine, &of_ranks);
    let (mut kinds, mut next) = ([(); N].map(|()| Vec::new()), 0);
    for counts in counts {
        for (kind, count) in kinds.iter_mut().zip(counts) {
            kind.extend_from_slice(&all[next..next + count]);
            next += count;
        }
    }
    kinds
}

/// Whether all ranks could do what they were asked, as the front sees it.
pub(crate) fn all_fine(mine: bool) -> bool {
    let said = gather(&[f64::from(u8::from(mine))], &vec![1; ranks()]);
    said.iter().all(|fine| *fine > 0.0)
}

/// The sum of all ranks' numbers, `counts` of each, in the order of the ranks: the same everywhere.
pub(crate) fn sum_in_order(mine: &[f64], counts: &[usize]) -> f64 {
    let mut all = vec![0.0; counts.iter().sum()];
    let (counts, starts) = places(counts);
    let mut parts = PartitionMut::new(&mut all[..], counts, starts);
    world().all_gather_varcount_into(mine, &mut parts);
    all.iter().sum()
}

/// Sends bytes of any number.
pub(crate) fn send(to: usize, bytes: &[u8]) {
    let world = world();
    let to = world.process_at_rank(mpi_rank(to));
    to.send(&(bytes.len() as u64));
    for part in bytes.chunks(LARGEST) {
        to.send(part);
    }
}

/// Receives what [`send`] sent.
pub(crate) fn receive(from: usize) -> Vec<u8> {
    let world = world();
    let from = world.process_at_rank(mpi_rank(from));
    let (length, _) = from.receive::<u64>();
    let mut bytes = vec![0; usize::try_from(length).unwrap_or(0)];
    for part in bytes.chunks_mut(LARGEST) {
        from.receive_into(part);
    }
    bytes
}

/// Sends vectors of any number.
pub(crate) fn send_vectors(to: usize, list: &[DVec3]) {
    send(to, cast_slice(list));
}

/// Receives what [`send_vectors`] sent.
pub(crate) fn received_vectors(from: usize) -> Vec<DVec3> {
    let bytes = receive(from);
    let mut list = vec![DVec3::ZERO; bytes.len() / size_of::<DVec3>()];
    cast_slice_mut(&mut list).copy_from_slice(&bytes);
    list
}

/// Receives what [`send_vectors`] sent, into a list as long.
pub(crate) fn receive_vectors(from: usize, list: &mut [DVec3]) {
    let bytes = receive(from);
    let to: &mut [u8] = cast_slice_mut(list);
    if to.len() == bytes.len() {
        to.copy_from_slice(&bytes);
    }
}

/// Latency (s) of a message and bandwidth (bytes/s) between the first two ranks: half the way there and back of 8
/// bytes, 1,000 times, and of 4 MiB, 50 times. `None` for one rank and on others.
pub(crate) fn ping() -> Option<(f64, f64)> {
    let there_and_back = |numbers: usize, times: u32| {
        let world = world();
        let mut list = vec![1.0; numbers];
        let start = Instant::now();
        for _ in 0..times {
            match rank() {
                FRONT => {
                    world.process_at_rank(1).send(&list[..]);
                    world.process_at_rank(1).receive_into(&mut list[..]);
                }
                1 => {
                    world.process_at_rank(0).receive_into(&mut list[..]);
                    world.process_at_rank(0).send(&list[..]);
                }
                _ => {}
            }
        }
        start.elapsed().as_secs_f64() / f64::from(2 * times)
    };
    if ranks() < 2 {
        return None;
    }
    let (small, large) = (there_and_back(1, 1000), there_and_back(1 << 19, 50));
    (rank() == FRONT).then_some((small, f64::from(1 << 22) / (large - small)))
}

impl Wire {
    /// Gives the neighbours the positions (m) of own nodes and takes those of ghosts from them.
    pub(crate) fn exchange(&mut self, package: &Package, places: &mut [DVec3]) {
        let begun = Instant::now();
        let (sends, receives) = (&package.sends, &package.receives);
        self.outgoing.resize(sends.len(), Vec::new());
        self.incoming.resize(receives.len(), Vec::new());
        for (buffer, (_, nodes)) in self.outgoing.iter_mut().zip(sends) {
            buffer.clear();
            let picked = nodes
                .iter()
                .flat_map(|&node| places[node as usize].to_array());
            buffer.extend(picked);
        }
        for (buffer, (_, _, count)) in self.incoming.iter_mut().zip(receives) {
            buffer.resize(3 * count, 0.0);
        }
        let world = world();
        let (outgoing, incoming) = (&self.outgoing, &mut self.incoming);
        multiple_scope(receives.len(), |scope, coming| {
            multiple_scope(sends.len(), |to_others, going| {
                for (buffer, (from, _, _)) in incoming.iter_mut().zip(receives) {
                    let from = world.process_at_rank(mpi_rank(*from));
                    coming.add(from.immediate_receive_into(scope, &mut buffer[..]));
                }
                for (buffer, (to, _)) in outgoing.iter().zip(sends) {
                    let to = world.process_at_rank(mpi_rank(*to));
                    going.add(to.immediate_send(to_others, &buffer[..]));
                }
                let mut done = Vec::new();
                going.wait_all(&mut done);
            });
            let mut done = Vec::new();
            coming.wait_all(&mut done);
        });
        for (buffer, &(_, first, count)) in self.incoming.iter().zip(receives) {
            places[first..first + count].copy_from_slice(vectors(buffer));
        }
        self.waited += begun.elapsed();
        self.exchanges += 1;
        self.messages += sends.len() as u64;
        let sent: usize = self
            .outgoing
            .iter()
            .map(|buffer| size_of_val(&**buffer))
            .sum();
        self.bytes += sent as u64;
    }
}
