//! Gradient error at the nodes against set-up time and time per evaluation: kernels, bases, support
//! sizes, and storage in f64 and f32.
//!
//! `cargo run --release -p phyxel-mls --example speed_error`
#![allow(
    clippy::print_stdout,
    clippy::cast_precision_loss,
    reason = "prints its table; counts are far below 2^53"
)]

use std::hint::black_box;
use std::time::Instant;

use glam::{DVec3, Vec3};
use phyxel_mls::{
    Approximation, Basis, ConservativeSettings, ConservativeStencils, Dimension, GradientStencils,
    Kernel, NearestSettings, Neighborhoods, Order, ShapeScratch, inverse_square_weights, k_nearest,
    kernel_weights,
};
use study::{Line, median, write_csv, write_plot};
use testkit::kuhn::{Block, kuhn_block};

mod study;

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

/// Gradient stencils in whatever form, ready to be evaluated.
struct Made {
    graph: Neighborhoods,
    gradients: Vec<DVec3>,
    setup: f64,
}

/// Relative rms error and nanoseconds per node of one evaluation, in f64 and with f32 stencils.
fn evaluate(block: &Block, made: &Made) -> [(f64, f64); 2] {
    let values: Vec<f64> = block.positions.iter().map(|&x| field(x)).collect();
    let count = block.positions.len() as f64;
    let error = |found: &[DVec3]| {
        let (mut sum, mut scale) = (0.0, 0.0);
        for (g, &x) in found.iter().zip(&block.positions) {
            sum += (*g - slope(x)).length_squared();
            scale += slope(x).length_squared();
        }
        (sum / scale).sqrt()
    };
    let mut out = vec![DVec3::ZERO; block.positions.len()];
    let mut timed = |row: &dyn Fn(usize) -> DVec3| {
        let mut times = Vec::new();
        for _ in 0..9 {
            let start = Instant::now();
            for (i, out) in out.iter_mut().enumerate() {
                *out = row(i);
            }
            times.push(start.elapsed().as_secs_f64() * 1e9 / count);
            black_box(&out);
        }
        (error(&out), median(times))
    };
    let wide = timed(&|i| {
        let mut sum = DVec3::ZERO;
        for pair in made.graph.pairs(i) {
            let j = made.graph.indices()[pair] as usize;
            sum += made.gradients[pair] * (values[j] - values[i]);
        }
        sum
    });
    let narrow: Vec<Vec3> = made.gradients.iter().map(|g| g.as_vec3()).collect();
    let stored = timed(&|i| {
        let mut sum = DVec3::ZERO;
        for pair in made.graph.pairs(i) {
            let j = made.graph.indices()[pair] as usize;
            sum += narrow[pair].as_dvec3() * (values[j] - values[i]);
        }
        sum
    });
    [wide, stored]
}

/// Shape-function gradients of a basis at the nodes on the k nearest.
fn shaped(block: &Block, kernel: Kernel, order: Order, nearest: usize, scale: f64) -> Made {
    let start = Instant::now();
    let settings = NearestSettings {
        nearest,
        scale,
        limit: None,
    };
    let found = k_nearest(&block.positions, &settings).expect("finite points");
    let graph = found.neighborhoods;
    let approximation = Approximation {
        nodes: &block.positions,
        support_radii: &found.support_radii,
        basis: Basis::polynomial(order, Dimension::Three),
        kernel,
    };
    let mut scratch = ShapeScratch::default();
    let mut gradients = Vec::with_capacity(graph.pair_count());
    for (i, &x) in block.positions.iter().enumerate() {
        // The node itself belongs to the approximation; its value is the reference of the row.
        let mut row = vec![u32::try_from(i).expect("few nodes")];
        row.extend_from_slice(graph.row(i));
        let mut phi = vec![0.0; row.len()];
        let mut gradient = vec![DVec3::ZERO; row.len()];
        approximation
            .shape_functions_into(x, &row, &mut scratch, &mut phi, &mut gradient)
            .expect("the support is well posed");
        gradients.extend_from_slice(&gradient[1..]);
    }
    Made {
        graph,
        gradients,
        setup: start.elapsed().as_secs_f64(),
    }
}

/// Stencils of eqs. (25)-(27) on the k nearest.
fn plain(block: &Block, kernel: Kernel, nearest: usize, scale: f64) -> Made {
    let start = Instant::now();
    let settings = NearestSettings {
        nearest,
        scale,
        limit: None,
    };
    let found = k_nearest(&block.positions, &settings).expect("finite points");
    let graph = found.neighborhoods;
    let weights = kernel_weights(kernel, &block.positions, &found.support_radii, &graph);
    let made = GradientStencils::new(&block.positions, &graph, weights, 1e-3).expect("finite");
    Made {
        graph,
        gradients: made.pair_gradients,
        setup: start.elapsed().as_secs_f64(),
    }
}

/// Conservative stencils on the edges of the tetrahedra.
fn conservative(block: &Block) -> Made {
    let start = Instant::now();
    let graph = Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone())
        .expect("edges are a graph");
    let weights = inverse_square_weights(&block.positions, &graph);
    let made = ConservativeStencils::new(
        &block.positions,
        &block.volumes,
        &block.boundary_vectors,
        &graph,
        weights,
        &ConservativeSettings::default(),
    )
    .expect("finite");
    Made {
        graph,
        gradients: made.pair_gradients,
        setup: start.elapsed().as_secs_f64(),
    }
}

fn main() {
    let block = kuhn_block([17; 3], 1.0 / 17.0, 0.2, 1);
    println!("{} nodes, single evaluation thread", block.positions.len());
    println!(
        "{:<42} {:>9} {:>9} {:>9} {:>9} {:>9} {:>10}",
        "stencil", "pairs/n", "setup ms", "ns/node", "error", "f32 ns", "f32 - f64"
    );
    let mut cases: Vec<(String, &str, Made)> = Vec::new();
    for kernel in [Kernel::Polynomial, Kernel::CubicSpline, Kernel::WendlandC2] {
        for (nearest, scale) in [(16, 1.3), (16, 1.5), (16, 2.0), (32, 1.5)] {
            let name = |what: &str| format!("{what}, {}, {nearest} x {scale}", kernel.name());
            cases.push((
                name("eqs 25-27"),
                "eqs 25-27",
                plain(&block, kernel, nearest, scale),
            ));
            let linear = shaped(&block, kernel, Order::Linear, nearest, scale);
            cases.push((name("linear"), "linear", linear));
            if scale * f64::from(u32::try_from(nearest).expect("few")) > 28.0 {
                let quadratic = shaped(&block, kernel, Order::Quadratic, nearest, scale);
                cases.push((name("quadratic"), "quadratic", quadratic));
            }
        }
    }
    cases.push((
        "eqs 25-27, inverse square, 16 x 1.5".into(),
        "eqs 25-27",
        plain(&block, Kernel::InverseSquare, 16, 1.5),
    ));
    cases.push((
        "conservative, 1/r2, tetrahedra's edges".into(),
        "conservative",
        conservative(&block),
    ));
    let mut rows = Vec::new();
    let mut setup_points: Vec<(&str, Vec<(f64, f64)>)> = Vec::new();
    let mut step_points: Vec<(&str, Vec<(f64, f64)>)> = Vec::new();
    let mut best = [("linear", f64::INFINITY), ("quadratic", f64::INFINITY)];
    for (name, group, made) in &cases {
        let [(error, time), (stored_error, stored_time)] = evaluate(&block, made);
        let pairs = made.graph.pair_count() as f64 / block.positions.len() as f64;
        let change = (stored_error - error).abs() / error;
        println!(
            "{name:<42} {pairs:>9.1} {:>9.2} {time:>9.1} {error:>9.2e} {stored_time:>9.1} {change:>10.1e}",
            made.setup * 1e3
        );
        rows.push(vec![
            name.replace(", ", " / "),
            pairs.to_string(),
            made.setup.to_string(),
            time.to_string(),
            error.to_string(),
            stored_time.to_string(),
        ]);
        for (points, x) in [
            (&mut setup_points, made.setup * 1e3),
            (&mut step_points, time),
        ] {
            match points.iter_mut().find(|entry| entry.0 == *group) {
                Some(entry) => entry.1.push((x, error)),
                None => points.push((group, vec![(x, error)])),
            }
        }
        for best in &mut best {
            if best.0 == *group {
                best.1 = best.1.min(error);
            }
        }
        assert!(
            error < 0.25 && change < 1e-4,
            "{name}: error {error}, f32 storage adds {change}"
        );
    }
    assert!(
        best[1].1 < 0.5 * best[0].1,
        "the quadratic basis is the more accurate one: {best:?}"
    );
    write_csv(
        "speed_error.csv",
        "stencil,pairs_per_node,setup_s,ns_per_node,error,ns_per_node_f32",
        &rows,
    );
    for (file, axis, points) in [
        ("speed_error_setup.svg", "set-up (ms)", setup_points),
        (
            "speed_error_step.svg",
            "evaluation (ns per node)",
            step_points,
        ),
    ] {
        let lines: Vec<Line> = points
            .into_iter()
            .map(|(name, points)| Line {
                name: name.into(),
                points,
                dots: true,
            })
            .collect();
        write_plot(
            file,
            "Error of the gradient, 5,832 nodes",
            [axis, "relative rms error"],
            true,
            &lines,
        );
    }
}
