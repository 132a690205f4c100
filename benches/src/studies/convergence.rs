//! Error of value and gradient against the node spacing for the three orders of basis.

use crate::report::{Report, Series, Table, plots, row};
use crate::{Effort, StudyError};
use glam::DVec3;
use phyxel_mls::{Approximation, Basis, Dimension, Order, ShapeScratch};
use testkit::cloud::{Random, lattice};

fn field(x: DVec3) -> f64 {
    (3.0 * x.x).sin() * (2.0 * x.y).cos() + (x.z * x.x).exp()
}

fn slope(x: DVec3) -> DVec3 {
    let e = (x.z * x.x).exp();
    DVec3::new(
        3.0 * (3.0 * x.x).cos() * (2.0 * x.y).cos() + x.z * e,
        -2.0 * (3.0 * x.x).sin() * (2.0 * x.y).sin(),
        x.x * e,
    )
}

/// Root mean square errors of value and gradient over the whole unit cube, boundary included.
fn errors(order: Order, cells: u32) -> (f64, f64) {
    let h = 1.0 / f64::from(cells);
    let n = usize::try_from(cells).expect("few cells") + 1;
    let nodes = lattice([n; 3], h, 0.2, 3);
    let radii = vec![2.3 * h; nodes.len()];
    let approximation = Approximation {
        nodes: &nodes,
        support_radii: &radii,
        basis: Basis::polynomial(order, Dimension::Three),
    };
    let mut random = Random::new(1);
    let mut scratch = ShapeScratch::default();
    let (mut value_sum, mut slope_sum) = (0.0, 0.0);
    let samples = 300;
    for _ in 0..samples {
        let x = DVec3::splat(0.5) + random.vector(0.5);
        let near = (0_u32..).zip(&nodes);
        let near = near.filter(|(_, node)| (**node - x).length() < 2.3 * h);
        let near: Vec<u32> = near.map(|(index, _)| index).collect();
        let mut phi = vec![0.0; near.len()];
        let mut gradient = vec![DVec3::ZERO; near.len()];
        approximation
            .shape_functions_into(x, &near, &mut scratch, &mut phi, &mut gradient)
            .expect("supports of 2.3 spacings are well posed");
        let mut value = 0.0;
        let mut along = DVec3::ZERO;
        for (place, &node) in near.iter().enumerate() {
            let u = field(nodes[node as usize]);
            value += phi[place] * u;
            along += gradient[place] * u;
        }
        value_sum += (value - field(x)).powi(2);
        slope_sum += (along - slope(x)).length_squared();
    }
    let mean = |sum: f64| (sum / f64::from(samples)).sqrt();
    (mean(value_sum), mean(slope_sum))
}

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let sizes: &[u32] = effort.choose(&[8, 12, 16, 24, 32], &[8, 12]);
    let (mut rows, mut lines) = (Vec::new(), Vec::new());
    for (order, name) in [
        (Order::Constant, "constant"),
        (Order::Linear, "linear"),
        (Order::Quadratic, "quadratic"),
    ] {
        let (mut values, mut slopes) = (Vec::new(), Vec::new());
        for &cells in sizes {
            let (h, (value, slope)) = (1.0 / f64::from(cells), errors(order, cells));
            rows.push(row![name, h, value, slope]);
            values.push((h, value));
            slopes.push((h, slope));
        }
        lines.push(Series::line(format!("value, {name}"), values));
        lines.push(Series::line(format!("gradient, {name}"), slopes));
    }
    let header = "basis; spacing (1); value (1); gradient (1)";
    let table = Table::new("errors", "Errors of moving least squares", header, rows);
    let plots = plots![
        "convergence" "Error against spacing", log "h", log "rms error" => lines;
    ];
    let words = "A smooth function at the jittered nodes of a unit cube, read at 300 random places of it, those near its \
                 faces included: root mean square errors of value and gradient. Supports are 2.3 spacings.";
    Ok(Report::new(&[words], vec![table], plots))
}
