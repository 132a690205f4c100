// Documentation has no files beside it: what is defined first counts.
#![doc = "[scene]: phyxel_scene"]
#![doc = "[sweep]: mod@sweep"]
#![cfg_attr(feature = "live", doc = "[page]: phyxel_live")]
#![doc = ""]
#![doc = include_str!("../README.md")]

pub mod cli;
#[cfg(feature = "live")]
pub mod live;
pub mod output;
pub mod picture;
pub mod run;
pub mod sweep;
mod warnings;
