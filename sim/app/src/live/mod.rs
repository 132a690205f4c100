//! A session in which someone cuts, presses and pulls bodies while they move.
//!
//! The solver runs in ticks of a few milliseconds on the thread that owns the [`Session`]; clients
//! (`phyxel-live`) send what a user does and are sent what moves. What reaches [`phyxel::World::push`] is
//! recorded, so that a session can be repeated bit for bit.

mod serve;
mod session;
mod setting;
mod skin;
mod sources;
mod told;

pub use serve::{LiveOptions, serve};
pub use session::{Session, SessionError};
pub use sources::{MeshReader, Sources};
