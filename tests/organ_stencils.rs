//! Conservative stencils on sampled organs: `phyxel-discretize` gives the nodes, `phyxel-mls` the
//! stencils.

use glam::{DMat3, DVec3};
use phyxel_discretize::{
    Primitive, SampleSettings, Solid, sample_points, sample_tetrahedra, tetrahedra_edges,
};
use phyxel_mls::{
    ConservativeSettings, GradientStencils, NearestSettings, Neighborhoods, inverse_square_weights,
    k_nearest, widen_deficient_rows,
};
use testkit::tol::assert_below;

/// `max_j |Σ_i V_i g_ij − b_j| / max |b|` and the largest entry of `Σ_j X_ij g_ijᵀ − I`.
fn errors(
    positions: &[DVec3],
    graph: &Neighborhoods,
    s: &GradientStencils,
    b: &[DVec3],
) -> (f64, f64) {
    let mut sums: Vec<DVec3> = b.iter().map(|b| -*b).collect();
    let mut consistency = 0.0_f64;
    let gradients = s.pair_gradients(positions, graph);
    for i in 0..positions.len() {
        let mut sum = DMat3::ZERO;
        for (pair, &j) in graph.pairs(i).zip(graph.row(i)) {
            let (j, g) = (j as usize, gradients[pair]);
            sums[j] += g * s.volumes[i];
            sums[i] -= g * s.volumes[i];
            let x = positions[j] - positions[i];
            sum += DMat3::from_cols(x * g.x, x * g.y, x * g.z);
        }
        for entry in (sum - DMat3::IDENTITY).to_cols_array() {
            consistency = consistency.max(entry.abs());
        }
    }
    let largest = |values: &[DVec3]| values.iter().fold(0.0_f64, |m, v| m.max(v.length()));
    (largest(&sums) / largest(b), consistency)
}

/// The stencils of nodes, volumes (m³) and boundary vectors (m²) on a graph, which is widened where neighbours lie in a plane.
fn stencils_of(
    positions: &[DVec3],
    volumes: &[f64],
    boundary: &[DVec3],
    edges: &Neighborhoods,
) -> (Neighborhoods, GradientStencils) {
    let (graph, left) = widen_deficient_rows(positions, edges, 1e-3).expect("valid");
    assert!(left.is_empty(), "{left:?} have neighbours in a plane only");
    let weights = inverse_square_weights(positions, &graph);
    let settings = ConservativeSettings::default();
    let found =
        GradientStencils::conservative(positions, volumes, boundary, &graph, weights, &settings);
    let stencils = found.expect("valid");
    assert!(stencils.report.is_some_and(|report| report.converged));
    (graph, stencils)
}

#[test]
fn liver_is_conservative_and_consistent() {
    let liver = Solid::from(Primitive::Liver);
    for count in [1500, 6000] {
        let settings = SampleSettings::nodes(count);
        let nodes = sample_tetrahedra(&liver, &settings).unwrap();
        let (offsets, indices) = tetrahedra_edges(nodes.positions.len(), &nodes.tetrahedra);
        let edges = Neighborhoods::from_graph(offsets, indices).unwrap();
        let (positions, boundary) = (&nodes.positions, &nodes.boundary_vectors);
        let (graph, stencils) = stencils_of(positions, &nodes.volumes, boundary, &edges);
        let conditions = stencils.ranks.iter().map(|rank| rank.condition);
        let worst = conditions.fold(0.0, f64::max);
        println!(
            "liver, {} nodes, {} pairs ({} added): {:?}, condition {worst:.0}",
            positions.len(),
            graph.pair_count(),
            graph.pair_count() - edges.pair_count(),
            stencils.report
        );
        let (conservation, consistency) = errors(positions, &graph, &stencils, boundary);
        assert_below("conservation", conservation, 1e-10);
        assert_below("consistency", consistency, 1e-12 * worst.max(1.0));
    }
}

/// The same body by points alone: boundary vectors by quadrature over the surface.
#[test]
fn liver_without_tetrahedra_is_conservative_too() {
    let liver = Solid::from(Primitive::Liver);
    let settings = SampleSettings::nodes(1500);
    let nodes = sample_points(&liver, &settings, true).unwrap();
    let nearest = NearestSettings {
        nearest: 14,
        limit: Some(14),
        ..Default::default()
    };
    let near = k_nearest(&nodes.positions, &nearest).unwrap();
    let graph = near.neighborhoods.symmetrized().unwrap();
    let (positions, boundary) = (&nodes.positions, &nodes.boundary_vectors);
    let (_, stencils) = stencils_of(positions, &nodes.volumes, boundary, &graph);
    let report = stencils.report.unwrap();
    println!("liver by points: {report:?}");
    assert_below("shift of b", report.boundary_shift, 1e-12);
}
