//! What the package's page shows, compiled and run with what a user has: the package alone.
#![doc = include_str!("../../phyxel-enrich-0.1.0/README.md")]
