#![doc = include_str!("../README.md")]

pub mod cli;
#[cfg(feature = "live")]
pub mod live;
pub mod output;
pub mod phases;
pub mod picture;
pub mod run;
pub mod scene;
pub mod study;
pub mod sweep;
pub mod world;
