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

use glam::{DVec2, DVec3};
use phyxel_enrich::{EnrichmentGrid, GridSettings};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "out".to_owned());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    plane::draw(folder)?;
    space::draw(folder)?;
    // 0.3 ahead of the tip and 0.4 beside it: phi = s/d = 0.4/0.5, eqs. (34) and (37).
    let cut = [DVec2::ZERO, DVec2::X];
    let grid = EnrichmentGrid::from_polyline(&cut, &GridSettings::for_spacing(0.1))?;
    let ahead = grid.evaluate(DVec3::new(1.3, 0.4, 0.0));
    assert!(
        (ahead.phi - 0.8).abs() < 1e-15,
        "phi ahead of the tip is {}",
        ahead.phi
    );
    Ok(())
}
