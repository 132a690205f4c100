//! Nodes with volumes inside a ball, and how far their volumes are from the ball's.

use phyxel_discretize::{SampleSettings, Shape, Solid, Target, glam::DVec3, sample_tetrahedra};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ball = Solid::from(Shape::Ellipsoid { semi_axes: DVec3::ONE });
    let settings = SampleSettings { target: Target::NodeCount(2000), ..Default::default() };
    let nodes = sample_tetrahedra(&ball, &settings)?;
    let volume: f64 = nodes.volumes.iter().sum();
    let error = volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0;
    println!("{} nodes, volume off by {:.2} %", nodes.positions.len(), 100.0 * error);
    assert!(error.abs() < 0.03);
    Ok(())
}
