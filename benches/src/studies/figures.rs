//! The dissertation's figures with data that no other study has: 5 to 7, 11 and 14 to 17, and table 1, approximation on a line.

use glam::DVec3;
use phyxel_mls::{Approximation, Basis, Dimension, Order, ShapeScratch, kernel};
use testkit::cloud::Random;

use crate::report::{Cell, Plot, Report, Series, Table, plots, row};
use crate::{Effort, StudyError};

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
            let moved = if jitter > 0.0 {
                random.range(-jitter, jitter)
            } else {
                0.0
            };
            f64::from(i) + moved
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

/// Random values at 21 nodes.
fn data() -> Vec<f64> {
    let mut random = Random::new(2014);
    (0..21).map(|_| random.unit()).collect()
}

/// Weights, or shape functions, of the nodes at a position.
fn shapes(nodes: &Nodes, radius: f64, order: Order, x: f64) -> Result<Vec<f64>, StudyError> {
    let radii = vec![radius; nodes.at.len()];
    let all: Vec<u32> = (0..).take(nodes.at.len()).collect();
    let approximation = Approximation {
        nodes: &nodes.at,
        support_radii: &radii,
        basis: Basis::polynomial(order, Dimension::One),
    };
    let mut phi = vec![0.0; nodes.at.len()];
    let mut scratch = ShapeScratch::default();
    approximation.shape_values_into(DVec3::X * x, &all, &mut scratch, &mut phi)?;
    Ok(phi)
}

/// Places along the nodes.
fn places(nodes: &Nodes) -> impl Iterator<Item = f64> {
    let first = nodes.at[0].x;
    let length = nodes.at[nodes.at.len() - 1].x - first;
    (0..=400).map(move |step| first + length * f64::from(step) / 400.0)
}

/// Curve over the nodes by moving least squares.
fn mls(
    nodes: &Nodes,
    radius: f64,
    order: Order,
    data: &[f64],
) -> Result<Vec<(f64, f64)>, StudyError> {
    places(nodes)
        .map(|x| {
            let phi = shapes(nodes, radius, order, x)?;
            Ok((x, phi.iter().zip(data).map(|(p, u)| p * u).sum()))
        })
        .collect()
}

/// Curve over the nodes by SPH, `u(x) = Σ_j w_j(x) u_j ΔV_j` with the kernel normalised to unit integral,
/// `32 h / 35` (Aras 2014, eq. (10)).
fn sph(nodes: &Nodes, radius: f64, data: &[f64]) -> Vec<(f64, f64)> {
    let value = |x: f64| -> f64 {
        let terms = nodes.at.iter().zip(&nodes.lengths).zip(data);
        let weight = |at: &DVec3| kernel((x - at.x).abs() / radius);
        let parts = terms.map(|((at, length), u)| weight(at) * u * length);
        parts.sum::<f64>() / (32.0 / 35.0 * radius)
    };
    places(nodes).map(|x| (x, value(x))).collect()
}

/// Largest deviation from a function.
fn deviation(curve: &[(f64, f64)], exact: impl Fn(f64) -> f64) -> f64 {
    let off = curve.iter().map(|&(x, y)| (y - exact(x)).abs());
    off.fold(0.0, f64::max)
}

fn dots(nodes: &Nodes, data: &[f64]) -> Series {
    let points = nodes.at.iter().zip(data).map(|(x, &u)| (x.x, u)).collect();
    Series::dots("data", points)
}

/// Label of axes along the nodes.
const ALONG: &str = "x (node distances)";

/// Deviations from the data's function: figure, curve, how much.
#[derive(Default)]
struct Rows(Vec<Vec<Cell>>);

impl Rows {
    fn add(&mut self, figure: &str, curve: &str, deviation: f64) {
        self.0.push(row![figure, curve, deviation]);
    }
}

pub(crate) fn run(_: Effort) -> Result<Report, StudyError> {
    let (even, mut rows) = (nodes(0.0), Rows::default());
    let constant = constant_data(&even, &mut rows)?;
    let moved = uneven_nodes(&mut rows)?;
    let parabolas = parabolas(&even, &mut rows)?;
    let distances = (-60..=60).map(|k| f64::from(k) / 50.0);
    let weights = distances.map(|r| (r, kernel(r.abs()))).collect();
    let mut plots = plots![
        "figure5" "Figure 5: constant data, even nodes", linear ALONG, linear "u" => constant;
        "figure6" "Figure 6: constant data, uneven nodes", linear ALONG, linear "u" => moved;
        "figure7" "Figure 7: data of x^2, radius 5, at the first of 21 nodes",
            linear ALONG, linear "u" => parabolas;
        "figure11" "Figure 11: the polynomial kernel",
            linear "distance over support radius", linear "w" => vec![Series::line("w", weights)];
    ];
    plots.extend(random_data(&even)?);
    let errors = Table::new(
        "approximation",
        "Largest deviation from the data's function (figures 5 to 7)",
        "figure; curve; deviation (1)",
        rows.0,
    );
    Ok(Report::new(&[WORDS], vec![errors, table_1(&even)], plots))
}

fn constant_data(even: &Nodes, rows: &mut Rows) -> Result<Vec<Series>, StudyError> {
    let ones = vec![1.0; even.at.len()];
    let mut lines = vec![dots(even, &ones)];
    for radius in [1.5, 2.5, 5.0] {
        let curve = sph(even, radius, &ones);
        let name = format!("SPH, radius {radius}");
        rows.add("5", &name, deviation(&curve, |_| 1.0));
        lines.push(Series::line(name, curve));
    }
    let curve = mls(even, 2.5, Order::Linear, &ones)?;
    rows.add("5", "MLS, radius 2.5", deviation(&curve, |_| 1.0));
    lines.push(Series::line("MLS, linear", curve));
    Ok(lines)
}

fn uneven_nodes(rows: &mut Rows) -> Result<Vec<Series>, StudyError> {
    let mut lines = Vec::new();
    for jitter in [0.0, 0.2, 0.45] {
        let uneven = nodes(jitter);
        let ones = vec![1.0; uneven.at.len()];
        let curve = sph(&uneven, 1.8, &ones);
        // Inside, away from the ends, where even nodes are nearly right.
        let inside = curve.iter().filter(|p| p.0 > 3.0 && p.0 < 17.0);
        let inside: Vec<_> = inside.copied().collect();
        let name = format!("SPH, nodes moved by {jitter}");
        rows.add("6", &name, deviation(&inside, |_| 1.0));
        let exact = mls(&uneven, 2.5, Order::Linear, &ones)?;
        let same = format!("MLS, nodes moved by {jitter}");
        rows.add("6", &same, deviation(&exact, |_| 1.0));
        lines.push(Series::line(name, curve));
    }
    Ok(lines)
}

fn parabolas(even: &Nodes, rows: &mut Rows) -> Result<Vec<Series>, StudyError> {
    let squares: Vec<f64> = even.at.iter().map(|x| x.x * x.x).collect();
    let mut lines = vec![dots(even, &squares)];
    for (order, name) in ORDERS {
        let (curve, name) = (mls(even, 5.0, order, &squares)?, format!("{name} basis"));
        let off = deviation(&curve, |x| x * x);
        rows.add("7", &format!("MLS, {name}"), off);
        lines.push(Series::line(name, curve));
    }
    // Curves that are 3 apart at 400 look like one.
    for line in &mut lines {
        line.points.retain(|point| point.0 <= 4.0);
    }
    Ok(lines)
}

const WORDS: &str = "Figures of Aras 2014 that show data and that no other study has. Errors of splats and their radii (its \
     figures 47, 48, 55 and 65) are in the study splat, 69 to 73 in hertz, and the frames per second of chapter 6 in chapter6. \
     Figure 5: there and here SPH misses a constant, most at the ends, and moving least squares do not. \
     Figure 6: SPH gets worse as nodes lose their evenness. Figure 7: a quadratic basis reproduces a parabola, a linear \
     one does not. Figure 11: the kernel of eq. (15). Figures 14 and 16: other data, as those there are random and not \
     given; beside the radius 5 of the text 3 and 7. Figures 15 and 17: what each node gives to the ninth, weight \
     and shape function, as there; the latter sum up to 1. Table 1: the same cells are singular, the error grows with the \
     radius, quadratic below linear.";

const ORDERS: [(Order, &str); 2] = [(Order::Linear, "linear"), (Order::Quadratic, "quadratic")];

/// Figures 14 to 17: random data, and the weights and shape functions of all nodes at the ninth.
fn random_data(even: &Nodes) -> Result<Vec<Plot>, StudyError> {
    let data = data();
    let curves = |order| -> Result<Vec<Series>, StudyError> {
        let mut lines = vec![dots(even, &data)];
        for radius in [3.0, 5.0, 7.0] {
            let curve = mls(even, radius, order, &data)?;
            lines.push(Series::line(format!("radius {radius}"), curve));
        }
        Ok(lines)
    };
    let at_ninth = |order| -> Result<Vec<Series>, StudyError> {
        let (ninth, radius) = (even.at[8].x, 5.0);
        let weight = |x: f64| kernel((x - ninth).abs() / radius);
        let weights = even.at.iter().map(|x| (x.x, weight(x.x))).collect();
        let shape = shapes(even, radius, order, ninth)?;
        let shape = even.at.iter().zip(shape).map(|(x, phi)| (x.x, phi));
        Ok(vec![
            Series::line("weight of the node, radius 5", weights),
            Series::line("its shape function", shape.collect()),
        ])
    };
    let (node, value) = ("place of the node (node distances)", "value at the ninth");
    Ok(plots![
        "figure14" "Figure 14: random data, linear basis",
            linear ALONG, linear "u" => curves(Order::Linear)?;
        "figure15" "Figure 15: weights and shape functions at the ninth node, linear basis",
            linear node, linear value => at_ninth(Order::Linear)?;
        "figure16" "Figure 16: random data, quadratic basis",
            linear ALONG, linear "u" => curves(Order::Quadratic)?;
        "figure17" "Figure 17: weights and shape functions at the ninth node, quadratic basis",
            linear node, linear value => at_ninth(Order::Quadratic)?;
    ])
}

/// Table 1: root mean square errors at the nodes; empty where a moment matrix is singular.
fn table_1(even: &Nodes) -> Table {
    let data = data();
    let error = |order: Order, radius: f64| {
        let mut sum = 0.0;
        for (node, value) in even.at.iter().zip(&data) {
            let phi = shapes(even, radius, order, node.x).ok()?;
            let found: f64 = phi.iter().zip(&data).map(|(p, u)| p * u).sum();
            sum += (found - value) * (found - value);
        }
        let count = u32::try_from(data.len()).unwrap_or(u32::MAX);
        Some((sum / f64::from(count)).sqrt())
    };
    let rows = (1..=7_u32).map(|radius| {
        let mut row = row![f64::from(radius)];
        for (order, _) in ORDERS {
            row.push(error(order, f64::from(radius)).into());
        }
        row
    });
    Table::new(
        "table1",
        "Table 1: error of moving least squares at the nodes; none where a moment matrix is singular",
        "radius (1); linear (1); quadratic (1)",
        rows.collect(),
    )
}
