//! Nodes with volumes inside a ball, and how far their volumes are from the ball's.

use phyxel_discretize::{SampleSettings, Primitive, Solid, glam::DVec3, sample_tetrahedra};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let semi_axes = DVec3::ONE;
    let ball = Solid::from(Primitive::Ellipsoid { semi_axes });
    let nodes = sample_tetrahedra(&ball, &SampleSettings::nodes(2000))?;
    let volume: f64 = nodes.volumes.iter().sum();
    let error = volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0;
    println!("volume off by {:.2} %, {}", 100.0 * error, nodes.report);
    assert!(error.abs() < 0.03);
    Ok(())
}
