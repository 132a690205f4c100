use super::*;
use crate::deformation::deformation_gradient;
use glam::DQuat;
use testkit::tol::{assert_below, assert_within};

/// Stencils of a few points that all see each other.
fn star(positions: &[DVec3]) -> (Neighborhoods, ConservativeStencils) {
    let n = positions.len();
    let mut offsets = vec![0];
    let mut indices = Vec::new();
    for i in 0..n {
        indices.extend(
            (0..n)
                .filter(|&j| j != i)
                .map(|j| u32::try_from(j).unwrap()),
        );
        offsets.push(u32::try_from(indices.len()).unwrap());
    }
    let graph = Neighborhoods::from_graph(offsets, indices).unwrap();
    let weights = inverse_square_weights(positions, &graph);
    let s = ConservativeStencils::new(
        positions,
        &vec![1.0; n],
        &vec![DVec3::ZERO; n],
        &graph,
        weights,
        &ConservativeSettings::default(),
    )
    .unwrap();
    (graph, s)
}

#[test]
fn degenerate_clouds_have_a_rank_and_feel_no_rotation() {
    let tilt = DQuat::from_axis_angle(DVec3::new(0.3, 1.0, -0.2).normalize(), 0.9);
    let plane: Vec<DVec3> = [(0.0, 0.0), (1.0, 0.1), (0.2, 1.0), (-0.9, 0.3), (0.1, -1.1)]
        .iter()
        .map(|&(x, y)| tilt * DVec3::new(x, y, 0.0))
        .collect();
    let line: Vec<DVec3> = [0.0, 1.0, 2.5]
        .iter()
        .map(|&t| tilt * DVec3::X * t)
        .collect();
    let cases = [
        (plane, 2_u8),
        (line, 1),
        (vec![DVec3::ZERO, DVec3::Y], 1),
        (vec![DVec3::ONE], 0),
        (vec![DVec3::ONE, DVec3::ONE, DVec3::ONE], 0),
    ];
    for (points, rank) in cases {
        let (graph, s) = star(&points);
        for i in 0..points.len() {
            assert_eq!(s.ranks[i].rank, rank);
            assert!(
                s.ranks[i].condition > 1e12,
                "condition {}",
                s.ranks[i].condition
            );
            let pairs = graph.pairs(i);
            assert!(
                s.pair_gradients[pairs.clone()]
                    .iter()
                    .all(|g| g.is_finite())
            );
            for angle in [0.0, 0.5, 1.6, 3.1] {
                let turn = DQuat::from_axis_angle(DVec3::new(0.5, -0.4, 1.0).normalize(), angle);
                let moved: Vec<DVec3> = points.iter().map(|&x| turn * x + DVec3::ONE).collect();
                let sum = gradient_sum(&moved, i, graph.row(i), &s.pair_gradients[pairs.clone()]);
                let f = deformation_gradient(sum, &s.ranks[i]);
                let strain = f.transpose() * f - DMat3::IDENTITY;
                let size = strain
                    .to_cols_array()
                    .iter()
                    .fold(0.0_f64, |m, x| m.max(x.abs()));
                assert_below("strain of a rotation", size, 1e-14);
                assert!(f.determinant() > 0.0, "no mirror image");
            }
        }
    }
}

#[test]
fn a_stretched_plane_shows_its_strain() {
    let points =
        [(0.0, 0.0), (1.0, 0.1), (0.2, 1.0), (-0.9, 0.3)].map(|(x, y)| DVec3::new(x, y, 0.0));
    let (graph, s) = star(&points);
    let moved = points.map(|x| DVec3::new(1.5 * x.x, x.y, 0.2 * x.x));
    let sum = gradient_sum(&moved, 0, graph.row(0), &s.pair_gradients[graph.pairs(0)]);
    let f = deformation_gradient(sum, &s.ranks[0]);
    assert_within(
        "along x",
        (f.transpose() * f).x_axis.x,
        1.5 * 1.5 + 0.04,
        1e-13,
    );
    assert_within("thickness", (f * DVec3::Z).length(), 1.0, 1e-14);
}
