#![doc = include_str!("../README.md")]

mod assets;
mod control;
mod gate;
#[cfg(test)]
mod golden;
mod http;
mod incoming;
mod lead;
mod mailbox;
mod outgoing;
mod record;
mod server;
mod socket;
mod undo;
mod wire;

pub use control::{BodyInfo, Control, Picture, Scene, Stats, Told, ToolInfo};
pub use incoming::{Hand, HandPhase, MAX_EDGE, MAX_MESH};
pub use lead::{BladeLead, Led, Placement, PoseLead};
pub use outgoing::{
    BodyState, ClipOf, ForceSample, GRIP, MAX_CLIENTS, StateMessage, Surfel, ToolState,
    encode_clips, encode_force, encode_nodes, encode_skin, encode_state, put_surfel,
    surfel_numbers,
};
pub use record::{Forces, Score};
pub use server::{ClientId, Doorman, Event, PROTOCOL, Server, ServerError, To};
pub use undo::Ring;
