//! Table 1 of Aras 2014: error of moving least squares at the nodes for support radii 1 to 7 and two
//! bases, random data on equidistant nodes.
//!
//! `cargo run --release -p benches --example table1`
#![allow(clippy::print_stdout, reason = "prints its table")]

use benches::StudyError;
use benches::report::{folder_of, write_csv};
use glam::DVec3;
use phyxel_mls::{Approximation, Basis, Dimension, Kernel, Order, ShapeScratch};
use testkit::cloud::Random;

/// Root mean square error at the nodes; `None` where a moment matrix is singular.
fn error(order: Order, radius: f64, data: &[f64]) -> Option<f64> {
    let nodes: Vec<DVec3> = (0_u32..)
        .take(data.len())
        .map(|i| DVec3::X * f64::from(i))
        .collect();
    let radii = vec![radius; nodes.len()];
    let all: Vec<u32> = (0..).take(nodes.len()).collect();
    let approximation = Approximation {
        nodes: &nodes,
        support_radii: &radii,
        basis: Basis::polynomial(order, Dimension::One),
        kernel: Kernel::Polynomial,
    };
    let mut scratch = ShapeScratch::default();
    let mut phi = vec![0.0; nodes.len()];
    let mut sum = 0.0;
    for (&node, &value) in nodes.iter().zip(data) {
        approximation
            .shape_values_into(node, &all, &mut scratch, &mut phi)
            .ok()?;
        let found: f64 = phi.iter().zip(data).map(|(p, u)| p * u).sum();
        sum += (found - value) * (found - value);
    }
    let count = u32::try_from(data.len()).expect("few nodes");
    Some((sum / f64::from(count)).sqrt())
}

fn main() -> Result<(), StudyError> {
    let mut random = Random::new(2014);
    let data: Vec<f64> = (0..21).map(|_| random.unit()).collect();
    let text = |value: Option<f64>| value.map_or("singular".into(), |v| format!("{v:.6}"));
    println!("{:>8} {:>12} {:>12}", "radius", "linear", "quadratic");
    let mut rows = Vec::new();
    let mut table = Vec::new();
    for radius in 1..=7_u32 {
        let cells = [Order::Linear, Order::Quadratic].map(|o| error(o, f64::from(radius), &data));
        println!("{radius:>8} {:>12} {:>12}", text(cells[0]), text(cells[1]));
        rows.push([radius.to_string(), text(cells[0]), text(cells[1])]);
        table.push(cells);
    }
    let file = folder_of("mls")?.join("table1.csv");
    write_csv(&file, ["radius", "linear", "quadratic"], &rows)?;

    // The pattern of the table: its three singular cells, growth with the radius, quadratic below.
    for (place, cells) in table.iter().enumerate() {
        assert_eq!(
            cells[0].is_none(),
            place == 0,
            "linear is singular at radius 1 only"
        );
        assert_eq!(
            cells[1].is_none(),
            place < 2,
            "quadratic is singular at radii 1 and 2 only"
        );
        if let [Some(linear), Some(quadratic)] = cells {
            assert!(quadratic < linear, "quadratic below linear");
        }
        for (cell, before) in cells.iter().zip(&table[place.saturating_sub(1)]) {
            if let (Some(cell), Some(before)) = (cell, before) {
                assert!(
                    place == 0 || cell > before,
                    "the error grows with the radius"
                );
            }
        }
    }
    Ok(())
}
