#![allow(
    clippy::float_cmp,
    reason = "the twin computes the same operations in the same order"
)]

use super::*;
use proptest::prelude::*;
use testkit::assert_matches;
use testkit::cloud;

/// All other nodes by distance, then index: what the tree must agree with.
fn brute_force(points: &[DVec3], node: usize) -> Vec<(f64, u32)> {
    let mut all: Vec<(f64, u32)> = (0..points.len())
        .filter(|&j| j != node)
        .map(|j| ((points[j] - points[node]).length_squared(), to_u32(j)))
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    all
}

fn check(points: &[DVec3], settings: &NearestSettings) {
    let found = k_nearest(points, settings).unwrap();
    for i in 0..points.len() {
        let all = brute_force(points, i);
        let nearest = &all[..settings.nearest.min(all.len())];
        let mut mean: f64 = nearest.iter().map(|&(squared, _)| squared.sqrt()).sum();
        mean /= (nearest.len() as f64).max(1.0);
        assert_eq!(found.mean_distances[i], mean);
        let radius = settings.scale * mean;
        assert_eq!(found.support_radii[i], radius);
        let mut row: Vec<u32> = all
            .iter()
            .take(settings.limit.unwrap_or(usize::MAX))
            .filter(|&&(squared, _)| squared <= radius * radius)
            .map(|&(_, index)| index)
            .collect();
        row.sort_unstable();
        assert_eq!(found.neighborhoods.row(i), row.as_slice(), "node {i}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn tree_equals_brute_force(
        cells in proptest::collection::vec((0_i8..5, 0_i8..5, 0_i8..3), 1..90),
        nearest in 1_usize..20,
        limit in proptest::option::of(1_usize..24),
        radius in 0.5..3.0_f64,
    ) {
        // Integer points: full of ties and coincident nodes.
        let points: Vec<DVec3> = cells
            .iter()
            .map(|&(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z)))
            .collect();
        check(&points, &NearestSettings { nearest, scale: 1.3, limit });
        let graph = within_radius(&points, radius).unwrap();
        for i in 0..points.len() {
            let mut row: Vec<u32> = brute_force(&points, i)
                .iter()
                .filter(|&&(squared, _)| squared <= radius * radius)
                .map(|&(_, index)| index)
                .collect();
            row.sort_unstable();
            prop_assert_eq!(graph.row(i), row.as_slice());
        }
        prop_assert!(graph.reverse_pairs().is_ok());
    }
}

#[test]
fn random_cloud_equals_brute_force() {
    let points = cloud::uniform(900, 2.0, 11);
    check(&points, &NearestSettings::default());
    check(
        &points,
        &NearestSettings {
            nearest: 10,
            scale: 2.0,
            limit: None,
        },
    );
}

#[test]
fn bad_input_is_named() {
    let mut points = cloud::uniform(5, 1.0, 1);
    let settings = NearestSettings::default();
    let nearest = |nearest, scale| {
        let settings = NearestSettings {
            nearest,
            scale,
            ..settings
        };
        k_nearest(&points, &settings).unwrap_err()
    };
    assert_eq!(nearest(0, 1.5), CloudError::NoNeighbors);
    let (name, value) = ("the support scale", -1.0);
    assert_eq!(nearest(16, -1.0), CloudError::NotPositive { name, value });
    let within = within_radius(&points, f64::NAN);
    assert_matches!(within, Err(CloudError::NotPositive { .. }));
    points[3].y = f64::NAN;
    let refused = k_nearest(&points, &settings);
    assert_eq!(refused, Err(CloudError::NotFinite { point: 3 }));
}

#[test]
fn one_thread_and_many_give_the_same_rows() {
    let points = cloud::uniform(3000, 1.0, 21);
    let rows = || k_nearest(&points, &NearestSettings::default()).unwrap();
    assert_eq!(testkit::on_threads(1, rows), rows());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn runs_equal_brute_force(
        cells in proptest::collection::vec((0_i8..9, 0_i8..9, 0_i8..5), 1..400),
        sorted in proptest::bool::ANY,
        count in 1_usize..20,
        copies in 1_u8..16,
    ) {
        // Up to three groups of runs.
        let tiled = (0..copies).flat_map(|copy| cells.iter().map(move |cell| (copy, cell)));
        let mut points: Vec<DVec3> = tiled
            .map(|(copy, &(x, y, z))| {
                let place = [f64::from(x) + 4.0 * f64::from(copy), f64::from(y), f64::from(z)];
                DVec3::from_array(place)
            })
            .collect();
        if sorted {
            points.sort_by(|a, b| a.x.total_cmp(&b.x));
        }
        let runs = PointRuns::new(&points).unwrap();
        let mut found = Vec::new();
        for at in [points[0], DVec3::new(4.3, 4.1, 2.2), DVec3::new(-7.0, 20.0, 1.0)] {
            let mut all: Vec<(f64, u32)> = points
                .iter()
                .enumerate()
                .map(|(j, x)| ((*x - at).length_squared(), to_u32(j)))
                .collect();
            all.sort_by(nearer);
            all.truncate(count);
            for reach in [f64::INFINITY, 3.0] {
                all.retain(|&(squared, _)| squared <= reach * reach);
                runs.nearest_into(&points, at, reach, count, &mut found);
                prop_assert_eq!(&found, &all);
            }
        }
    }
}
