//! Gradient error at the nodes against set-up time and time per evaluation: kernels, bases, support
//! sizes, and storage in f64 and f32.
//!
//! `cargo run --release -p benches --example speed_error`
#![allow(
    clippy::print_stdout,
    clippy::cast_precision_loss,
    reason = "prints its table; counts are far below 2^53"
)]

use std::hint::black_box;
use std::time::Instant;

use benches::StudyError;
use benches::problems::block::jittered_stencils;
use benches::report::{Plot, Scale, Series, folder_of, median, write_csv};
use glam::{DVec3, Vec3};
use phyxel_mls::{
    Approximation, Basis, ConservativeSettings, Dimension, GradientStencils, Kernel,
    NearestSettings, Neighborhoods, Order, ShapeScratch, k_nearest, kernel_weights,
};
use testkit::kuhn::{Block, kuhn_block};

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

/// The fastest of three set-ups.
fn fastest(make: impl Fn() -> Made) -> Made {
    let mut made = make();
    for _ in 0..2 {
        let again = make();
        if again.setup < made.setup {
            made = again;
        }
    }
    made
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
    let made = GradientStencils::plain(&block.positions, &graph, weights, 1e-3).expect("finite");
    Made {
        gradients: made.pair_gradients(&block.positions, &graph),
        graph,
        setup: start.elapsed().as_secs_f64(),
    }
}

/// Conservative stencils on the edges of the tetrahedra.
fn conservative(block: &Block) -> Made {
    let start = Instant::now();
    let graph = Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone())
        .expect("edges are a graph");
    let made =
        jittered_stencils(block, &graph, &ConservativeSettings::default()).expect("finite data");
    Made {
        gradients: made.pair_gradients(&block.positions, &graph),
        graph,
        setup: start.elapsed().as_secs_f64(),
    }
}

/// Nearest neighbours and scale of the radius.
const SUPPORTS: [(usize, f64); 4] = [(16, 1.3), (16, 1.5), (16, 2.0), (32, 1.5)];

/// One stencil to be measured: what it is, on which kernel and support.
struct Case {
    basis: &'static str,
    kernel: Kernel,
    /// Index into [`SUPPORTS`]; none for the edges of the tetrahedra.
    support: Option<usize>,
    made: Made,
}

impl Case {
    fn name(&self) -> String {
        let support = self.support.map_or_else(
            || "tetrahedra's edges".to_owned(),
            |k| format!("{} x {}", SUPPORTS[k].0, SUPPORTS[k].1),
        );
        format!("{}, {}, {support}", self.basis, self.kernel.name())
    }

    fn series(&self, points: Vec<(f64, f64)>, stored: bool) -> Series {
        let storage = if stored { ", f32" } else { "" };
        let name = format!("{}, {}{storage}", self.basis, self.kernel.name());
        Series::dots(name, points)
    }
}

fn cases(block: &Block) -> Vec<Case> {
    let mut cases = Vec::new();
    for kernel in [Kernel::Polynomial, Kernel::CubicSpline, Kernel::WendlandC2] {
        for (k, (nearest, scale)) in SUPPORTS.into_iter().enumerate() {
            let mut add = |basis, made| {
                cases.push(Case {
                    basis,
                    kernel,
                    support: Some(k),
                    made,
                });
            };
            add(
                "eqs 25-27",
                fastest(|| plain(block, kernel, nearest, scale)),
            );
            let shaped = |order| fastest(|| shaped(block, kernel, order, nearest, scale));
            add("linear", shaped(Order::Linear));
            if k >= 2 {
                // Fewer neighbours leave the ten monomials of some nodes undetermined.
                add("quadratic", shaped(Order::Quadratic));
            }
        }
    }
    cases.push(Case {
        basis: "eqs 25-27",
        kernel: Kernel::InverseSquare,
        support: Some(1),
        made: fastest(|| plain(block, Kernel::InverseSquare, 16, 1.5)),
    });
    cases.push(Case {
        basis: "conservative",
        kernel: Kernel::InverseSquare,
        support: None,
        made: fastest(|| conservative(block)),
    });
    cases
}

fn main() -> Result<(), StudyError> {
    let block = kuhn_block([17; 3], 1.0 / 17.0, 0.2, 1);
    println!("{} nodes, single evaluation thread", block.positions.len());
    println!(
        "{:<42} {:>9} {:>9} {:>9} {:>9} {:>9} {:>10}",
        "stencil", "pairs/n", "setup ms", "ns/node", "error", "f32 ns", "f32 - f64"
    );
    let mut cases = cases(&block);
    cases.sort_by_key(|case| (case.basis, case.kernel.name(), case.support));
    let mut rows = Vec::new();
    let (mut setups, mut steps) = (Vec::new(), Vec::new());
    let mut best = [("linear", f64::INFINITY), ("quadratic", f64::INFINITY)];
    for group in cases.chunk_by(|a, b| (a.basis, a.kernel) == (b.basis, b.kernel)) {
        let (mut setup, mut step, mut narrow) = (Vec::new(), Vec::new(), Vec::new());
        for case in group {
            let (name, made) = (case.name(), &case.made);
            let [(error, time), (stored_error, stored_time)] = evaluate(&block, made);
            let pairs = made.graph.pair_count() as f64 / block.positions.len() as f64;
            let change = (stored_error - error).abs() / error;
            println!(
                "{name:<42} {pairs:>9.1} {:>9.2} {time:>9.1} {error:>9.2e} {stored_time:>9.1} {change:>10.1e}",
                made.setup * 1e3
            );
            rows.push([
                name.clone(),
                pairs.to_string(),
                made.setup.to_string(),
                time.to_string(),
                error.to_string(),
                stored_time.to_string(),
            ]);
            setup.push((made.setup * 1e3, error));
            step.push((time, error));
            narrow.push((stored_time, stored_error));
            for best in &mut best {
                if best.0 == case.basis {
                    best.1 = best.1.min(error);
                }
            }
            assert!(
                error < 0.25 && change < 1e-4,
                "{name}: error {error}, f32 storage adds {change}"
            );
        }
        setups.push(group[0].series(setup, false));
        steps.push(group[0].series(step, false));
        steps.push(group[0].series(narrow, true));
    }
    assert!(
        best[1].1 < 0.5 * best[0].1,
        "the quadratic basis is the more accurate one: {best:?}"
    );
    let folder = folder_of("mls")?;
    let header = [
        "stencil",
        "pairs_per_node",
        "setup_s",
        "ns_per_node",
        "error",
        "ns_per_node_f32",
    ];
    write_csv(&folder.join("speed_error.csv"), header, &rows)?;
    let title = "Gradient, 5,832 nodes; supports 16 x 1.3, 16 x 1.5, 16 x 2, 32 x 1.5";
    for (file, axis, lines) in [
        ("speed_error_setup", "set-up (ms)", setups),
        ("speed_error_step", "evaluation (ns per node)", steps),
    ] {
        let axes = [axis, "relative rms error"];
        Plot::new(file, title, axes, [Scale::Logarithmic; 2], lines).write(&folder)?;
    }
    Ok(())
}
