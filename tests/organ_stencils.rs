//! Conservative stencils on sampled organs: `phyxel-discretize` gives the nodes, `phyxel-mls` the
//! stencils.

use glam::{DMat3, DVec3};
use phyxel_discretize::{
    Primitive, SampleSettings, SampleTarget, Solid, sample_tetrahedra, tetrahedra_edges,
};
use phyxel_mls::{
    BoundarySettings, ConservativeSettings, ConservativeStencils, Neighborhoods, boundary_vectors,
    gradient_sum, inverse_square_weights, triangle_quadrature, widen_deficient_rows,
};
use testkit::tol::assert_below;

/// `max_j |Σ_i V_i g_ij − b_j| / max |b|` and the largest entry of `Σ_j X_ij g_ijᵀ − I`.
fn errors(
    positions: &[DVec3],
    graph: &Neighborhoods,
    s: &ConservativeStencils,
    b: &[DVec3],
) -> (f64, f64) {
    let mut sums: Vec<DVec3> = b.iter().map(|b| -*b).collect();
    let mut consistency = 0.0_f64;
    for i in 0..positions.len() {
        let pairs = graph.pairs(i);
        let row = &s.pair_gradients[pairs.clone()];
        sums[i] += s.self_gradients[i] * s.volumes[i];
        for (&j, &g) in graph.row(i).iter().zip(row) {
            sums[j as usize] += g * s.volumes[i];
        }
        let sum = gradient_sum(positions, i, graph.row(i), row);
        for entry in (sum - DMat3::IDENTITY).to_cols_array() {
            consistency = consistency.max(entry.abs());
        }
    }
    let largest = |values: &[DVec3]| values.iter().fold(0.0_f64, |m, v| m.max(v.length()));
    (largest(&sums) / largest(b), consistency)
}

#[test]
fn liver_is_conservative_and_consistent() {
    let liver = Solid::from(Primitive::Liver);
    for count in [1500, 6000] {
        let settings = SampleSettings {
            target: SampleTarget::NodeCount(count),
            ..Default::default()
        };
        let nodes = sample_tetrahedra(&liver, &settings).unwrap();
        let (offsets, indices) = tetrahedra_edges(nodes.positions.len(), &nodes.tetrahedra);
        let edges = Neighborhoods::from_graph(offsets, indices).unwrap();
        let (graph, left) = widen_deficient_rows(&nodes.positions, &edges, 1e-3).unwrap();
        assert!(left.is_empty(), "{left:?} have neighbours in a plane only");
        let weights = inverse_square_weights(&nodes.positions, &graph);
        let stencils = ConservativeStencils::new(
            &nodes.positions,
            &nodes.volumes,
            &nodes.boundary_vectors,
            &graph,
            weights,
            &ConservativeSettings::default(),
        )
        .unwrap();
        let worst = stencils
            .ranks
            .iter()
            .fold(0.0_f64, |m, r| m.max(r.condition));
        println!(
            "liver, {} nodes, {} pairs ({} added): {:?}, condition {worst:.0}",
            nodes.positions.len(),
            graph.pair_count(),
            graph.pair_count() - edges.pair_count(),
            stencils.report
        );
        assert!(stencils.report.converged, "{:?}", stencils.report);
        let (conservation, consistency) =
            errors(&nodes.positions, &graph, &stencils, &nodes.boundary_vectors);
        assert_below("conservation", conservation, 1e-10);
        assert_below("consistency", consistency, 1e-12 * worst.max(1.0));
    }
}

/// The same body without its tetrahedra: boundary vectors by quadrature over the surface.
#[test]
fn liver_without_tetrahedra_is_conservative_too() {
    let liver = Solid::from(Primitive::Liver);
    let settings = SampleSettings {
        target: SampleTarget::NodeCount(1500),
        ..Default::default()
    };
    let nodes = sample_tetrahedra(&liver, &settings).unwrap();
    let (points, areas) = triangle_quadrature(&nodes.positions, &nodes.surface_triangles, 2);
    let surface = BoundarySettings::for_spacing(nodes.spacing);
    let b = boundary_vectors(&nodes.positions, &points, &areas, &surface).unwrap();
    let (offsets, indices) = tetrahedra_edges(nodes.positions.len(), &nodes.tetrahedra);
    let graph = Neighborhoods::from_graph(offsets, indices).unwrap();
    let weights = inverse_square_weights(&nodes.positions, &graph);
    let stencils = ConservativeStencils::new(
        &nodes.positions,
        &nodes.volumes,
        &b,
        &graph,
        weights,
        &ConservativeSettings::default(),
    )
    .unwrap();
    println!("liver by quadrature: {:?}", stencils.report);
    assert!(stencils.report.converged, "{:?}", stencils.report);
    assert_below("shift of b", stencils.report.boundary_shift, 1e-12);
}
