//! The gradient of a smooth field from nodal values.

use glam::DVec3;
use phyxel_mls::{
    Approximation, Basis, ConservativeSettings, Dimension, GradientStencils, NearestSettings,
    Neighborhoods, Order, ShapeScratch, inverse_square_weights, k_nearest, kernel_weights,
    within_radius,
};

use crate::report::{Report, Series, Table, median_time, plots, row};
use crate::{Effort, StudyError};
use testkit::cloud::Random;

/// Runs of which the median time is taken.
const RUNS: usize = 5;
/// Largest shift of a node inside, as a fraction of the spacing.
const JITTER: f64 = 0.2;
/// Support radius of the shape functions, in spacings.
const SUPPORT: f64 = 2.2;

/// A jittered lattice that fills the unit cube, nodes on its faces included.
struct Cloud {
    spacing: f64,
    positions: Vec<DVec3>,
    volumes: Vec<f64>,
    boundary: Vec<DVec3>,
}

/// What one method did on one cloud.
struct Measured {
    pairs: usize,
    error: f64,
    /// Largest `|sum_i V_i g_ij - b_j|` over the largest `|b_j|`, where the method has stencils.
    conservation: Option<f64>,
    setup: f64,
    evaluation: f64,
}

/// A method for gradients.
#[derive(Clone, Copy)]
enum Method {
    Dissertation,
    Conservative,
    Shape(Order),
}

const METHODS: [(Method, &str); 4] = [
    (
        Method::Dissertation,
        "MLS stencils, 16 neighbours (Aras 2014)",
    ),
    (Method::Conservative, "conservative stencils"),
    (Method::Shape(Order::Linear), "linear shape functions"),
    (Method::Shape(Order::Quadratic), "quadratic shape functions"),
];

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let sides: &[u32] = effort.choose(&[8, 12, 17, 24, 34], &[7, 10]);
    let mut rows = Vec::new();
    let mut by_spacing = Vec::new();
    let mut by_time = Vec::new();
    for (method, name) in METHODS {
        let mut errors = Vec::new();
        let mut costs = Vec::new();
        for &side in sides {
            let cloud = cloud(side);
            let nodes = cloud.positions.len();
            let measured = measure(method, &cloud)?;
            let order = errors.last().map(|&(spacing, error): &(f64, f64)| {
                (error / measured.error).ln() / (spacing / cloud.spacing).ln()
            });
            let (nodes_f, pairs_f) = (nodes as f64, measured.pairs as f64);
            let setup = 1e6 * measured.setup / nodes_f;
            rows.push(row![
                name,
                nodes,
                cloud.spacing,
                pairs_f / nodes_f,
                measured.error,
                order,
                measured.conservation,
                setup,
                1e9 * measured.evaluation / pairs_f
            ]);
            errors.push((cloud.spacing, measured.error));
            costs.push((measured.setup, measured.error));
        }
        by_spacing.push(Series::line(name, errors));
        by_time.push(Series::line(name, costs));
    }
    let table = Table::new(
        "methods",
        "Gradient error and cost",
        "method; nodes (1); spacing (m); neighbours (1); error (1); order (1); \
         conservation (1); set-up (us/node); evaluation (ns/pair)",
        rows,
    );
    let plots = plots![
        "error" "Error of the gradient against spacing",
            log "spacing (m)", log "gradient error, relative RMS (1)" => by_spacing;
        "time" "Error of the gradient against set-up time",
            log "set-up, or first evaluation without one (s)", log "gradient error, relative RMS (1)" => by_time;
    ];
    Ok(Report::new(
        &[
            &format!(
                "u = sin(3x) cos(2y) exp(z) on nodes that fill the unit cube, faces included, those \
                 inside shifted by up to {JITTER} of the spacing. The error is the root of the mean \
                 square of the gradient's error over all nodes, relative to that of the gradient."
            ),
            "Conservation is how far the stencils are from summing to the surface, relative to the \
             largest boundary vector: a nodal method with an error there fails the patch test. Set-up \
             is from positions to stencils, search included; shape functions have none and are built \
             where they are evaluated. Times are medians, all threads.",
        ],
        vec![table],
        plots,
    ))
}

fn field(x: DVec3) -> f64 {
    (3.0 * x.x).sin() * (2.0 * x.y).cos() * x.z.exp()
}

fn field_gradient(x: DVec3) -> DVec3 {
    let ((s3, c3), (s2, c2), e) = ((3.0 * x.x).sin_cos(), (2.0 * x.y).sin_cos(), x.z.exp());
    DVec3::new(3.0 * c3 * c2 * e, -2.0 * s3 * s2 * e, s3 * c2 * e)
}

fn cloud(side: u32) -> Cloud {
    let last = side - 1;
    let spacing = 1.0 / f64::from(last);
    let (mut positions, mut volumes, mut boundary) = (Vec::new(), Vec::new(), Vec::new());
    let mut random = Random::new(1);
    for index in 0..side * side * side {
        let lattice = [index % side, index / side % side, index / (side * side)];
        let on_face = lattice.iter().filter(|&&i| i == 0 || i == last).count();
        let mut point = lattice.map(|i| f64::from(i) * spacing);
        if on_face == 0 {
            for coordinate in &mut point {
                *coordinate += JITTER * spacing * random.range(-1.0, 1.0);
            }
        }
        positions.push(DVec3::from_array(point));
        // A node on a face stands for half a cell, on an edge for a quarter, in a corner an eighth.
        let share = on_face
            .try_into()
            .map_or(1.0, |faces: i32| 0.5_f64.powi(faces));
        volumes.push(share * spacing * spacing * spacing);
        // And for twice that fraction of each face's area.
        let outward = lattice.map(|i| f64::from(i == last) - f64::from(i == 0));
        boundary.push(DVec3::from_array(outward) * (2.0 * share * spacing * spacing));
    }
    Cloud {
        spacing,
        positions,
        volumes,
        boundary,
    }
}

fn measure(method: Method, cloud: &Cloud) -> Result<Measured, StudyError> {
    match method {
        Method::Dissertation => of_stencils(cloud, || {
            let near = k_nearest(&cloud.positions, &NearestSettings::default())?;
            let (graph, radii) = (near.neighborhoods, near.support_radii);
            let weights = kernel_weights(&cloud.positions, &radii, &graph);
            let stencils = GradientStencils::plain(&cloud.positions, &graph, weights, 1e-3)?;
            Ok((graph, stencils))
        }),
        Method::Conservative => of_stencils(cloud, || {
            let near = k_nearest(&cloud.positions, &NearestSettings::default())?;
            let graph = near.neighborhoods.symmetrized()?;
            let weights = inverse_square_weights(&cloud.positions, &graph);
            let stencils = GradientStencils::conservative(
                &cloud.positions,
                &cloud.volumes,
                &cloud.boundary,
                &graph,
                weights,
                &ConservativeSettings::default(),
            )?;
            Ok((graph, stencils))
        }),
        Method::Shape(order) => of_shape_functions(cloud, order),
    }
}

fn of_stencils(
    cloud: &Cloud,
    make: impl Fn() -> Result<(Neighborhoods, GradientStencils), StudyError>,
) -> Result<Measured, StudyError> {
    let (made, setup) = median_time(RUNS, || -> Result<_, StudyError> {
        let (graph, stencils) = make()?;
        let gradients = stencils.pair_gradients(&cloud.positions, &graph);
        Ok((graph, gradients))
    });
    let (graph, pair_gradients) = made?;
    let values: Vec<f64> = cloud.positions.iter().map(|&x| field(x)).collect();
    let (gradients, evaluation) = median_time(RUNS, || {
        (0..cloud.positions.len())
            .map(|node| {
                let row = graph
                    .row(node)
                    .iter()
                    .zip(&pair_gradients[graph.pairs(node)]);
                row.map(|(&j, &g)| (values[j as usize] - values[node]) * g)
                    .sum()
            })
            .collect::<Vec<DVec3>>()
    });
    // sum_i V_i g_ij with g_ii = -sum_j g_ij.
    let mut sums = vec![DVec3::ZERO; cloud.positions.len()];
    for node in 0..cloud.positions.len() {
        for (&j, &g) in graph
            .row(node)
            .iter()
            .zip(&pair_gradients[graph.pairs(node)])
        {
            sums[j as usize] += cloud.volumes[node] * g;
            sums[node] -= cloud.volumes[node] * g;
        }
    }
    let largest =
        |vectors: &mut dyn Iterator<Item = DVec3>| vectors.map(DVec3::length).fold(0.0, f64::max);
    let mut differences = sums.iter().zip(&cloud.boundary).map(|(&a, &b)| a - b);
    let off = largest(&mut differences);
    Ok(Measured {
        pairs: graph.pair_count(),
        error: error(cloud, &gradients),
        conservation: Some(off / largest(&mut cloud.boundary.iter().copied())),
        setup,
        evaluation,
    })
}

fn of_shape_functions(cloud: &Cloud, order: Order) -> Result<Measured, StudyError> {
    let values: Vec<f64> = cloud.positions.iter().map(|&x| field(x)).collect();
    let (made, seconds) = median_time(1, || -> Result<_, StudyError> {
        let radius = SUPPORT * cloud.spacing;
        let graph = within_radius(&cloud.positions, radius)?;
        let radii = vec![radius; cloud.positions.len()];
        let approximation = Approximation {
            nodes: &cloud.positions,
            support_radii: &radii,
            basis: Basis::polynomial(order, Dimension::Three),
        };
        let mut scratch = ShapeScratch::default();
        let (mut near, mut phi, mut dphi) = (Vec::new(), Vec::new(), Vec::new());
        let mut gradients = Vec::with_capacity(cloud.positions.len());
        let mut pairs = 0;
        for (node, &x) in (0_u32..).zip(&cloud.positions) {
            near.clear();
            near.extend_from_slice(graph.row(node as usize));
            near.push(node);
            pairs += near.len();
            phi.resize(near.len(), 0.0);
            dphi.resize(near.len(), DVec3::ZERO);
            approximation.shape_functions_into(x, &near, &mut scratch, &mut phi, &mut dphi)?;
            let terms = near.iter().zip(&dphi);
            gradients.push(terms.map(|(&j, &g)| values[j as usize] * g).sum());
        }
        Ok((gradients, pairs))
    });
    let (gradients, pairs): (Vec<DVec3>, usize) = made?;
    Ok(Measured {
        pairs,
        error: error(cloud, &gradients),
        conservation: None,
        setup: seconds,
        evaluation: seconds,
    })
}

/// Root of the mean square error of the gradients over that of the gradient itself.
fn error(cloud: &Cloud, gradients: &[DVec3]) -> f64 {
    let (mut off, mut size) = (0.0, 0.0);
    for (&x, &gradient) in cloud.positions.iter().zip(gradients) {
        let exact = field_gradient(x);
        off += (gradient - exact).length_squared();
        size += exact.length_squared();
    }
    (off / size).sqrt()
}
