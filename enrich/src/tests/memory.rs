//! What cuts hold.

use glam::DVec3;

use super::space_cases::cut;
use crate::{CutSettings, Cuts};

/// A straight strip of `captures` steps of a spacing in a corner of a lattice of spacing 1.
fn strip(captures: u32) -> Cuts {
    let at = |k: u32, z: f64| DVec3::new(f64::from(k) + 0.6, 2.4, z);
    let blade = |k: u32| vec![at(k, 1.2), at(k, 4.9)];
    let strokes = vec![(0..=captures).map(blade).collect()];
    cut(&strokes, &CutSettings::for_spacing(1.0))
}

#[test]
fn a_cut_takes_the_same_memory_per_triangle_however_long_it_is() {
    let per_triangle = |captures| {
        let cuts = strip(captures);
        cuts.bytes() as f64 / cuts.triangle_count() as f64
    };
    let (short, long) = (per_triangle(2), per_triangle(200));
    assert!(long < 2.0 * short && long < 2000.0, "{short} and {long}");
}
