#![doc = include_str!("../README.md")]

mod assets;
mod control;
mod gate;
#[cfg(test)]
mod golden;
mod http;
mod incoming;
mod mailbox;
mod outgoing;
mod server;
mod socket;
mod wire;

/// Locks; what may panic under a lock leaves nothing half done.
fn locked<T>(mutex: &std::sync::Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    let locked = mutex.lock();
    locked.unwrap_or_else(std::sync::PoisonError::into_inner)
}

pub use control::{BodyInfo, Control, Picture, Quantity, Scene, Stats, Told, ToolInfo};
pub use incoming::{Hand, HandPhase, MAX_EDGE, MAX_MESH};
pub use outgoing::{
    BodyState, ClipOf, ForceSample, GRIP, MAX_CLIENTS, StateMessage, Surfel, ToolState,
    encode_clips, encode_force, encode_nodes, encode_skin, encode_state, put_surfel,
    surfel_numbers,
};
pub use server::{ClientId, Event, PROTOCOL, Server, ServerError, To};
