#![doc = include_str!("../README.md")]

pub mod cli;
pub mod output;
pub mod phases;
pub mod picture;
pub mod run;
pub mod scene;
pub mod study;
pub mod world;
