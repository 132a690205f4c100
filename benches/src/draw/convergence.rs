//! Error of value and gradient against the node spacing for the three orders of basis.

use std::path::Path;

use crate::StudyError;
use crate::report::{Series, plots};
use glam::DVec3;
use phyxel_mls::{Approximation, Basis, Dimension, Order, ShapeScratch};
use testkit::cloud::{Random, lattice};
use testkit::derivative::observed_order;

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

pub(super) fn draw(folder: &Path) -> Result<(), StudyError> {
    let sizes = [8, 12, 16, 24, 32];
    let mut lines = Vec::new();
    for (order, name, least) in [
        (Order::Constant, "constant", [0.8, -0.3]),
        (Order::Linear, "linear", [1.8, 0.8]),
        (Order::Quadratic, "quadratic", [2.7, 1.7]),
    ] {
        let found = sizes.map(|cells| (1.0 / f64::from(cells), errors(order, cells)));
        let values = found.map(|(h, (value, _))| (h, value));
        let slopes = found.map(|(h, (_, slope))| (h, slope));
        let overall = [values, slopes].map(|line| {
            let [(coarse, first), .., (fine, last)] = line;
            observed_order(first, last, coarse / fine)
        });
        let rises = overall[0] > least[0] && overall[1] > least[1];
        assert!(rises, "{name}: orders {overall:?}");
        lines.push(Series::line(format!("value, {name}"), values.to_vec()));
        lines.push(Series::line(format!("gradient, {name}"), slopes.to_vec()));
    }
    let plots = plots![
        "convergence" "Error against spacing", log "h", log "rms error" => lines;
    ];
    plots[0].write(folder)
}
