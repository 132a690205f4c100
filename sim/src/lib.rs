#![doc = include_str!("../README.md")]

// The leaves and the vectors that the public types speak of.
pub use glam;
pub use {
    phyxel_discretize as discretize, phyxel_elastic as elastic, phyxel_enrich as enrich,
    phyxel_integrate as integrate, phyxel_mls as mls, phyxel_splat as splat,
};

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
