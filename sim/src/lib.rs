// Documentation has no files beside it: what is defined first counts.
#![doc = "[scene]: phyxel_scene"]
#![cfg_attr(feature = "cli", doc = "[sweep]: mod@sweep")]
#![cfg_attr(feature = "live", doc = "[page]: phyxel_live")]
#![doc = ""]
#![doc = include_str!("../README.md")]

pub use phyxel_scene as scene;
pub use phyxel_world as world;

// The leaves and the vectors that the public types speak of.
pub use glam;
pub use {
    phyxel_discretize as discretize, phyxel_elastic as elastic, phyxel_enrich as enrich,
    phyxel_integrate as integrate, phyxel_mls as mls, phyxel_splat as splat,
};

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "live")]
pub mod live;
#[cfg(feature = "cli")]
pub mod output;
pub mod picture;
#[cfg(feature = "cli")]
pub mod run;
#[cfg(feature = "cli")]
pub mod sweep;
