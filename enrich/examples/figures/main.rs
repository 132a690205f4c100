//! Draws the dissertation's figures 20 to 37 and 67, and the default beside figure 28.
//!
//! `cargo run --release -p phyxel-enrich --example figures -- out` writes PNG files into `out`.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "colours and pixel numbers are clamped"
)]

mod canvas;
mod plane;
mod space;

use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "out".to_owned());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    plane::draw(folder)?;
    space::draw(folder)
}
