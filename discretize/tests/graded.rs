//! Octrees and tetrahedra on them: balance, sizes, sums, quality.
#![allow(
    clippy::missing_assert_message,
    clippy::unwrap_used,
    reason = "a failing test names its line"
)]

mod common;

use common::check_sums;
use glam::{DQuat, DVec3};
use phyxel_discretize::{
    Bounds, Grading, Octree, Refinement, SampleError, SampleSettings, Sampling, Shape, Solid,
    Target, sample_tetrahedra, surface_mesh,
};
use proptest::prelude::*;
use testkit::strategies::{rotation, scale, vector};
use testkit::tol::{assert_below, assert_relative};

/// Leaves, by brute force, of which two touch and differ by more than a factor of two, and the
/// volume they cover.
fn check_octree(tree: &Octree) {
    let leaves = tree.leaves();
    let smallest = leaves
        .iter()
        .map(|l| l.size.x)
        .fold(f64::INFINITY, f64::min);
    let slack = 1e-6 * smallest;
    for (i, a) in leaves.iter().enumerate() {
        for b in &leaves[i + 1..] {
            let apart = (a.min - (b.min + b.size)).max(b.min - (a.min + a.size));
            if apart.max_element() <= slack {
                let ratio = a.size.x / b.size.x;
                assert!((0.49..2.01).contains(&ratio), "{a:?} touches {b:?}");
                // Touch only: no two leaves share volume.
                assert!(apart.max_element() >= -slack, "{a:?} overlaps {b:?}");
            }
        }
    }
    let bounds = leaves.iter().fold(Bounds::EMPTY, |mut all, l| {
        all.include(l.min);
        all.include(l.min + l.size);
        all
    });
    let covered: f64 = leaves.iter().map(|l| l.size.element_product()).sum();
    assert_relative("cover", covered, bounds.size().element_product(), 0.0, 1e-9);
}

fn refined(center: DVec3, radius: f64, factor: f64, coarsest: f64) -> Grading {
    Grading {
        coarsest,
        growth: 1.0,
        refinements: vec![Refinement {
            from: center,
            to: center,
            radius,
            factor,
        }],
    }
}

fn graded(solid: &Solid, target: Target, grading: Grading) -> Result<Sampling, SampleError> {
    let settings = SampleSettings {
        target,
        grading,
        ..SampleSettings::default()
    };
    sample_tetrahedra(solid, &settings)
}

#[test]
fn octrees_are_balanced_and_small_where_asked() {
    let liver = Solid::from(Shape::Liver);
    let center = DVec3::new(0.03, 0.02, 0.04);
    for (factor, coarsest) in [(1.0, 4.0), (0.25, 1.0), (0.3, 2.0), (0.125, 8.0)] {
        let cell = 0.012;
        let grading = refined(center, 0.01, factor, coarsest);
        let tree = Octree::new(&liver, cell, &grading, 1_000_000).unwrap();
        check_octree(&tree);
        let mut largest = 0.0_f64;
        for leaf in tree.leaves() {
            let middle = leaf.min + 0.5 * leaf.size;
            let inside = liver.contains(middle);
            if leaf.at_surface {
                assert!(leaf.size.x <= cell * 1.001, "{leaf:?}");
            }
            if inside && middle.distance(center) < 0.01 {
                assert!(leaf.size.x <= factor * cell * 1.001, "{leaf:?}");
            }
            if inside {
                largest = largest.max(leaf.size.x);
            }
        }
        assert!(largest <= coarsest * cell * 1.001);
        assert!(coarsest < 2.0 || largest > 1.9 * cell, "{largest}");
    }
}

#[test]
fn a_thread_more_changes_no_bit() {
    let run = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| {
                let grading = refined(DVec3::new(0.03, 0.02, 0.04), 0.02, 0.5, 4.0);
                graded(&Shape::Liver.into(), Target::NodeCount(3000), grading).unwrap()
            })
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn graded_samplings_have_exact_sums_and_good_angles() {
    let shapes = [
        Shape::Ellipsoid {
            semi_axes: DVec3::new(0.1, 0.06, 0.08),
        },
        Shape::Capsule {
            half_length: 0.1,
            radius: 0.04,
        },
        Shape::Tube {
            half_length: 0.1,
            outer_radius: 0.05,
            inner_radius: 0.025,
        },
        Shape::Box {
            half_extents: DVec3::new(0.04, 0.05, 0.1),
        },
        Shape::Liver,
    ];
    for shape in shapes {
        let analytic = Solid::from(shape);
        let mesh = Solid::from_mesh(surface_mesh(&analytic, 0.004).unwrap());
        for (body, solid) in [("function", &analytic), ("mesh", &mesh)] {
            for (factor, coarsest) in [(1.0, 4.0), (0.5, 1.0), (0.25, 2.0)] {
                let grading = refined(DVec3::new(0.03, 0.02, 0.02), 0.01, factor, coarsest);
                let s = graded(solid, Target::NodeCount(5000), grading).unwrap();
                let name = format!("{shape:?} {body} {factor} {coarsest}");
                check_sums(&name, &s);
                assert!(s.positions.len().abs_diff(5000) <= 250, "{name}");
                assert_eq!(s.report.quality.inverted, 0, "{name}");
                let angle = s.report.quality.smallest_dihedral;
                assert!(angle > 8.0, "{name}: {angle}");
                assert_eq!(s.report.pieces, 1, "{name}");
                // The boundary of the tetrahedra holds what the tetrahedra hold: none overlaps.
                let (surface, _) = s.surface();
                assert_relative(&name, surface.volume(), s.report.volume, 0.0, 1e-10);
                if body == "function" {
                    let size = shape.bounds().diagonal();
                    for p in &s.positions {
                        assert_below("node outside", shape.value(*p), 1e-11 * size);
                    }
                }
            }
        }
    }
}

#[test]
fn a_graded_box_keeps_its_volume() {
    let half_extents = DVec3::new(0.1, 0.13, 0.5);
    let grading = refined(DVec3::ZERO, 0.05, 0.5, 4.0);
    let s = graded(
        &Shape::Box { half_extents }.into(),
        Target::Spacing(0.04),
        grading,
    )
    .unwrap();
    check_sums("box", &s);
    let volume = 8.0 * half_extents.element_product();
    assert_relative("volume", s.report.volume, volume, 0.0, 1e-12);
    assert!(s.report.quality.smallest_dihedral > 35.0, "{}", s.report);
}

#[test]
fn the_size_field_is_followed() {
    let liver = Solid::from(Shape::Liver);
    let center = DVec3::new(0.03, 0.03, 0.03);
    let edge = |s: &Sampling, near: bool| {
        let (mut sum, mut count) = (0.0, 0.0);
        for t in &s.tetrahedra {
            let p = t.map(|v| s.positions[v as usize]);
            let middle = 0.25 * (p[0] + p[1] + p[2] + p[3]);
            let distance = middle.distance(center);
            if (near && distance < 0.015) || (!near && distance > 0.06) {
                for (i, a) in p.iter().enumerate() {
                    for b in &p[i + 1..] {
                        sum += a.distance(*b);
                        count += 1.0;
                    }
                }
            }
        }
        sum / count
    };
    for factor in [0.5, 0.25] {
        let grading = refined(center, 0.02, factor, 1.0);
        let s = graded(&liver, Target::Spacing(0.012), grading).unwrap();
        let (near, far) = (edge(&s, true), edge(&s, false));
        assert_relative("near", near, factor * 0.012, 0.0, 0.15);
        assert_relative("far", far, 0.012, 0.0, 0.15);
    }
}

#[test]
fn bad_gradings_are_refused() {
    let liver = Solid::from(Shape::Liver);
    let at = |grading| graded(&liver, Target::Spacing(0.01), grading).unwrap_err();
    let coarse = Grading {
        coarsest: 0.5,
        ..Grading::default()
    };
    assert!(matches!(at(coarse), SampleError::Grading { .. }));
    let growth = Grading {
        growth: f64::NAN,
        ..Grading::default()
    };
    assert!(matches!(at(growth), SampleError::Grading { .. }));
    let factor = refined(DVec3::ZERO, 0.01, 0.001, 1.0);
    assert!(matches!(
        at(factor),
        SampleError::Refinement { refinement: 0, .. }
    ));
    let radius = refined(DVec3::ZERO, -1.0, 0.5, 1.0);
    assert!(matches!(at(radius), SampleError::Refinement { .. }));
    let small = SampleSettings {
        target: Target::Spacing(0.002),
        grading: refined(DVec3::ZERO, 0.03, 0.125, 1.0),
        largest_lattice: 10_000,
        ..SampleSettings::default()
    };
    let fine = sample_tetrahedra(&liver, &small).unwrap_err();
    assert!(matches!(fine, SampleError::TooFine { .. }), "{fine}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn random_blobs_on_random_octrees(
        turn in rotation(), size in scale(), shift in vector(1.0), bump in vector(1.0),
        radius in 0.3..0.9_f64, fine in vector(1.0), factor in 0.2..1.0_f64, coarsest in 1.0..6.0_f64,
    ) {
        check_blob(turn, size, shift, bump, radius, fine, factor, coarsest);
    }
}

/// Two overlapping balls, turned, moved and scaled, finer round a random place.
#[allow(clippy::too_many_arguments, reason = "what a random case is made of")]
fn check_blob(
    turn: DQuat,
    size: f64,
    shift: DVec3,
    bump: DVec3,
    radius: f64,
    fine: DVec3,
    factor: f64,
    coarsest: f64,
) {
    let value = move |p: DVec3| {
        let p = turn.inverse() * (p / size - shift);
        size * (p.length() - 1.0).min((p - bump).length() - radius)
    };
    let reach = size * 2.8;
    let center = size * shift;
    let bounds = Bounds {
        min: center - reach,
        max: center + reach,
    };
    let solid = Solid::implicit(bounds, value);
    let grading = refined(size * (shift + fine), 0.3 * size, factor, coarsest);
    let tree = Octree::new(&solid, 0.3 * size, &grading, 1_000_000).unwrap();
    check_octree(&tree);
    let s = graded(&solid, Target::Spacing(0.25 * size), grading).unwrap();
    check_sums("blob", &s);
    let q = s.report.quality;
    assert!(q.smallest_dihedral > 8.0, "{q:?}");
    assert_eq!(q.inverted, 0);
    let (surface, _) = s.surface();
    assert_relative("volume", surface.volume(), s.report.volume, 0.0, 1e-10);
    for p in &s.positions {
        assert_below("node outside", value(*p), 1e-11 * reach);
    }
}
