use super::*;
use crate::{Dimension, Order};
use testkit::cloud::Random;
use testkit::cloud::lattice;
use testkit::derivative::directional_error;
use testkit::tol::assert_below;

const DIMENSIONS: [Dimension; 3] = [Dimension::One, Dimension::Two, Dimension::Three];
const ORDERS: [Order; 3] = [Order::Constant, Order::Linear, Order::Quadratic];

/// A jittered lattice around the origin, about unit spacing, in the dimension given.
fn cloud(dimension: Dimension, jitter: f64, seed: u64) -> Vec<DVec3> {
    let sides = [0, 1, 2].map(|axis| if axis < dimension.count() { 7 } else { 1 });
    let nodes = lattice(sides, 1.0, jitter, seed).into_iter();
    nodes.map(|x| dimension.flatten(x - 3.0)).collect()
}

fn numbers(of: &Approximation<'_>) -> Vec<u32> {
    (0..).take(of.nodes.len()).collect()
}

/// Shape functions of all nodes at a point, and their gradients.
fn functions(of: &Approximation<'_>, x: DVec3) -> (Vec<f64>, Vec<DVec3>) {
    let (mut phi, mut gradient) = (vec![0.0; of.nodes.len()], vec![DVec3::ZERO; of.nodes.len()]);
    let scratch = &mut ShapeScratch::default();
    of.shape_functions_into(x, &numbers(of), scratch, &mut phi, &mut gradient)
        .unwrap();
    (phi, gradient)
}

/// The values alone, and the condition.
fn values(of: &Approximation<'_>, x: DVec3) -> (Vec<f64>, f64) {
    let mut phi = vec![0.0; of.nodes.len()];
    let scratch = &mut ShapeScratch::default();
    let condition = of.shape_values_into(x, &numbers(of), scratch, &mut phi);
    (phi, condition.unwrap())
}

#[test]
fn gradient_is_the_derivative_of_the_values() {
    for dimension in DIMENSIONS {
        let nodes = cloud(dimension, 0.3, 17);
        let radii: Vec<f64> = (0..nodes.len())
            .map(|i| 2.4 + 0.01 * (i % 40) as f64)
            .collect();
        let x = dimension.flatten(DVec3::new(0.31, -0.22, 0.4));
        let direction = dimension.flatten(DVec3::new(0.5, -0.6, 0.62));
        let mut bases: Vec<Basis> = ORDERS.map(|o| Basis::polynomial(o, dimension)).to_vec();
        if dimension == Dimension::Two {
            bases.push(Basis::CrackTip {
                tip: DVec3::new(-0.4, 0.1, 0.0),
                angle: 0.3,
            });
        }
        for basis in bases {
            let approximation = Approximation {
                nodes: &nodes,
                support_radii: &radii,
                basis,
            };
            let (phi, gradient) = functions(&approximation, x);
            assert_eq!(phi, values(&approximation, x).0);
            for j in (0..nodes.len()).filter(|&j| phi[j] != 0.0).take(12) {
                let along = |t: f64| values(&approximation, x + direction * t).0[j];
                let slope = gradient[j].dot(direction);
                let error = directional_error(along, slope, 1e-3, 1e-2);
                assert_below(&format!("{basis:?} node {j}"), error, 2e-7);
            }
        }
    }
}

#[test]
fn crack_tip_basis_reproduces_the_opening_of_a_crack() {
    let nodes = cloud(Dimension::Two, 0.2, 3);
    let radii = vec![3.2; nodes.len()];
    let tip = DVec3::new(0.1, 0.07, 0.0);
    let approximation = Approximation {
        nodes: &nodes,
        support_radii: &radii,
        basis: Basis::CrackTip { tip, angle: 0.0 },
    };
    let field = |x: DVec3| {
        let (dx, dy) = (x.x - tip.x, x.y - tip.y);
        let theta = dy.atan2(dx);
        dx.hypot(dy).sqrt() * (0.5 * theta).sin() * (1.0 + 2.0 * theta.sin()) + 0.5 * x.x - 1.0
    };
    for (x, y) in [(-0.5, 0.3), (0.6, -0.4), (-0.8, -0.2)] {
        let x = DVec3::new(x, y, 0.0);
        let (phi, condition) = values(&approximation, x);
        let parts = phi.iter().zip(&nodes).map(|(p, &node)| p * field(node));
        let error = (parts.sum::<f64>() - field(x)).abs();
        let allowed = 64.0 * f64::EPSILON * condition;
        assert_below("opening field", error, allowed.max(1e-12));
    }
}

#[test]
fn observed_orders_of_convergence() {
    // Errors on smooth data: value h^(m+1), gradient h^m for a basis of order m.
    let field = |x: DVec3| (1.3 * x.x).sin() * (0.9 * x.y).cos() + (0.5 * x.z * x.x).exp();
    let slope = |x: DVec3| {
        let e = (0.5 * x.z * x.x).exp();
        DVec3::new(
            1.3 * (1.3 * x.x).cos() * (0.9 * x.y).cos() + 0.5 * x.z * e,
            -0.9 * (1.3 * x.x).sin() * (0.9 * x.y).sin(),
            0.5 * x.x * e,
        )
    };
    let errors = |order: Order, h: f64| {
        let mut nodes = cloud(Dimension::Three, 0.2, 23);
        nodes.iter_mut().for_each(|x| *x *= h);
        let radii = vec![2.3 * h; nodes.len()];
        let centre = DVec3::new(0.4, 0.3, -0.2);
        let approximation = Approximation {
            nodes: &nodes,
            support_radii: &radii,
            basis: Basis::polynomial(order, Dimension::Three),
        };
        let mut random = Random::new(77);
        let (mut value_error, mut slope_error) = (0.0, 0.0);
        for _ in 0..60 {
            let x = random.vector(0.5 * h);
            let (phi, gradient) = functions(&approximation, x);
            let mut value = 0.0;
            let mut along = DVec3::ZERO;
            for (j, &node) in nodes.iter().enumerate() {
                value += phi[j] * field(centre + node);
                along += gradient[j] * field(centre + node);
            }
            value_error += (value - field(centre + x)).powi(2);
            slope_error += (along - slope(centre + x)).length_squared();
        }
        (value_error.sqrt(), slope_error.sqrt())
    };
    for (order, value_order, slope_order) in [
        (Order::Constant, 1.0, 0.0),
        (Order::Linear, 2.0, 1.0),
        (Order::Quadratic, 3.0, 2.0),
    ] {
        let (coarse, fine) = (errors(order, 0.1), errors(order, 0.05));
        let value = testkit::derivative::observed_order(coarse.0, fine.0, 2.0);
        let slope = testkit::derivative::observed_order(coarse.1, fine.1, 2.0);
        let found = format!("{order:?}: value of order {value:.2}, gradient {slope:.2}");
        assert!(
            value > value_order - 0.15 && slope > slope_order - 0.15,
            "{found}"
        );
        assert!(value < value_order + 1.3, "{found} is suspicious");
    }
}
