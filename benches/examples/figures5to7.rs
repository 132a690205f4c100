//! Figures 5 to 7 of Aras 2014: SPH against moving least squares on constant and quadratic data.
//!
//! `cargo run --release -p benches --example figures5to7`
#![allow(clippy::print_stdout, reason = "prints its table")]

use benches::StudyError;
use benches::report::{Plot, Scale, Series, folder_of};
use glam::DVec3;
use phyxel_mls::{Approximation, Basis, Dimension, Kernel, Order, ShapeScratch, sph_value};
use testkit::cloud::Random;

/// Nodes on a line with the length each stands for.
struct Nodes {
    at: Vec<DVec3>,
    lengths: Vec<f64>,
}

/// Nodes 0..=20, moved by up to `jitter`.
fn nodes(jitter: f64) -> Nodes {
    let mut random = Random::new(7);
    let at: Vec<f64> = (0..=20)
        .map(|i| {
            f64::from(i)
                + if jitter > 0.0 {
                    random.range(-jitter, jitter)
                } else {
                    0.0
                }
        })
        .collect();
    let last = at.len() - 1;
    let edge = |i: usize| f64::midpoint(at[i], at[i + 1]);
    let lengths = (0..=last)
        .map(|i| {
            let left = if i == 0 { at[0] } else { edge(i - 1) };
            let right = if i == last { at[last] } else { edge(i) };
            right - left
        })
        .collect();
    Nodes {
        at: at.iter().map(|&x| DVec3::X * x).collect(),
        lengths,
    }
}

/// Curve over the nodes by SPH (`order` none) or moving least squares.
fn curve(nodes: &Nodes, radius: f64, order: Option<Order>, data: &[f64]) -> Vec<(f64, f64)> {
    let radii = vec![radius; nodes.at.len()];
    let all: Vec<u32> = (0..).take(nodes.at.len()).collect();
    let approximation = Approximation {
        nodes: &nodes.at,
        support_radii: &radii,
        basis: Basis::polynomial(order.unwrap_or(Order::Constant), Dimension::One),
        kernel: Kernel::Polynomial,
    };
    let mut scratch = ShapeScratch::default();
    let mut phi = vec![0.0; nodes.at.len()];
    let first = nodes.at[0].x;
    let length = nodes.at[nodes.at.len() - 1].x - first;
    (0..=400)
        .map(|step| {
            let x = DVec3::X * (first + length * f64::from(step) / 400.0);
            let value = if order.is_some() {
                approximation
                    .shape_values_into(x, &all, &mut scratch, &mut phi)
                    .expect("supports cover the line");
                phi.iter().zip(data).map(|(p, u)| p * u).sum()
            } else {
                sph_value(&approximation, x, &all, &nodes.lengths, data)
                    .expect("the kernel has an integral")
            };
            (x.x, value)
        })
        .collect()
}

/// Largest deviation from a function.
fn deviation(curve: &[(f64, f64)], exact: impl Fn(f64) -> f64) -> f64 {
    curve
        .iter()
        .fold(0.0, |most, &(x, y)| most.max((y - exact(x)).abs()))
}

fn dots(nodes: &Nodes, data: &[f64]) -> Series {
    let points = nodes.at.iter().zip(data).map(|(x, &u)| (x.x, u)).collect();
    Series::dots("data", points)
}

fn main() -> Result<(), StudyError> {
    let folder = folder_of("mls")?;
    let axes = ["x (node distances)", "u"];
    let scales = [Scale::Linear; 2];
    let even = nodes(0.0);
    let ones = vec![1.0; even.at.len()];

    println!("largest deviation from the data's function");
    let mut lines = vec![dots(&even, &ones)];
    for radius in [1.5, 2.5, 5.0] {
        let sph = curve(&even, radius, None, &ones);
        let error = deviation(&sph, |_| 1.0);
        println!("fig. 5  SPH, constant, radius {radius}: {error:.3e}");
        assert!(error > 0.05, "SPH does not reproduce a constant");
        lines.push(Series::line(format!("SPH, radius {radius}"), sph));
    }
    let mls = curve(&even, 2.5, Some(Order::Linear), &ones);
    let error = deviation(&mls, |_| 1.0);
    println!("fig. 5  MLS, constant, radius 2.5: {error:.3e}");
    assert!(error < 1e-12, "moving least squares does");
    lines.push(Series::line("MLS, linear", mls));
    Plot::new("figure5", "Constant data, even nodes", axes, scales, lines).write(&folder)?;

    let mut lines = Vec::new();
    let mut last = 0.0;
    for jitter in [0.0, 0.2, 0.45] {
        let uneven = nodes(jitter);
        let sph = curve(&uneven, 1.8, None, &ones);
        // Inside, away from the ends, where even nodes are nearly right.
        let inside: Vec<_> = sph
            .iter()
            .copied()
            .filter(|p| p.0 > 3.0 && p.0 < 17.0)
            .collect();
        let error = deviation(&inside, |_| 1.0);
        println!("fig. 6  SPH, constant, nodes moved by {jitter}: {error:.3e} inside");
        assert!(
            error > last,
            "the error grows as the nodes lose their evenness"
        );
        last = error;
        let mls = curve(&uneven, 2.5, Some(Order::Linear), &ones);
        assert!(
            deviation(&mls, |_| 1.0) < 1e-12,
            "moving least squares does not notice"
        );
        lines.push(Series::line(format!("SPH, nodes moved by {jitter}"), sph));
    }
    Plot::new(
        "figure6",
        "Constant data, uneven nodes",
        axes,
        scales,
        lines,
    )
    .write(&folder)?;

    let squares: Vec<f64> = even.at.iter().map(|x| x.x * x.x).collect();
    let linear = curve(&even, 5.0, Some(Order::Linear), &squares);
    let quadratic = curve(&even, 5.0, Some(Order::Quadratic), &squares);
    let errors = [&linear, &quadratic].map(|line| deviation(line, |x| x * x));
    println!(
        "fig. 7  MLS, x², linear basis: {:.3e}, quadratic basis: {:.3e}",
        errors[0], errors[1]
    );
    assert!(errors[0] > 0.1, "a linear basis does not reproduce x²");
    assert!(errors[1] < 400.0 * 1e-12, "a quadratic one does");
    let lines = vec![
        dots(&even, &squares),
        Series::line("linear basis", linear),
        Series::line("quadratic basis", quadratic),
    ];
    Plot::new("figure7", "y = x², radius 5", axes, scales, lines).write(&folder)
}
