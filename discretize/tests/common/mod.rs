//! What more than one test file checks.
#![allow(dead_code, reason = "not every test file needs all of it")]

use glam::{DMat3, DVec3};
use phyxel_discretize::{SampleError, SampleSettings, Sampling, Solid, Target, sample_tetrahedra};
use testkit::tol::{assert_below, assert_relative};

/// Volumes positive and complete, boundary vectors closed, `sum b (x) X = V I`, each to 1e-10.
pub(crate) fn check_sums(name: &str, s: &Sampling) {
    assert!(
        s.volumes.iter().all(|v| *v > 0.0),
        "{name}: a volume is not positive"
    );
    let volume: f64 = s.volumes.iter().sum();
    assert_relative(name, volume, s.report.volume, 0.0, 1e-12);
    check_boundary(
        name,
        &s.positions,
        &s.boundary_vectors,
        volume,
        s.report.area,
    );
}

/// `sum b = 0` and `sum b (x) X = V I`.
pub(crate) fn check_boundary(name: &str, x: &[DVec3], b: &[DVec3], volume: f64, area: f64) {
    let closed: DVec3 = b.iter().sum();
    assert_below(name, closed.length(), 1e-10 * area);
    let middle = x[0];
    let mut moment = DMat3::ZERO;
    for (b, x) in b.iter().zip(x) {
        let x = *x - middle;
        moment += DMat3::from_cols(*b * x.x, *b * x.y, *b * x.z);
    }
    for e in (moment - DMat3::from_diagonal(DVec3::splat(volume))).to_cols_array() {
        assert_below(name, e.abs(), 1e-10 * volume);
    }
}

pub(crate) fn sample(solid: &Solid, count: usize) -> Result<Sampling, SampleError> {
    let settings = SampleSettings {
        target: Target::NodeCount(count),
        ..SampleSettings::default()
    };
    sample_tetrahedra(solid, &settings)
}
