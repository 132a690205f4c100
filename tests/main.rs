//! What needs two crates or more: one test binary, one module per subject.
#![allow(
    clippy::missing_assert_message,
    reason = "a failing test names its line; messages are given where the values are not in sight"
)]

/// Cracks with a known answer, through cuts, never glued.
mod cut_accuracy;
mod elastic_accuracy;
/// Elastic blocks as force laws, for the tests of `phyxel-integrate` with `phyxel-elastic`.
mod integrate_bodies;
/// Waves, energy, stability, impact.
mod integrate_dynamics;
/// Indentation against finite elements and Hertz.
mod integrate_indentation;
mod organ_stencils;
