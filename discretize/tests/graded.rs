//! Octrees and tetrahedra on them: balance, sizes, sums, quality.

use crate::common::{check_graded, check_octree, check_sums, graded, refined, shapes};
use glam::DVec3;
use phyxel_discretize::{
    Grading, Octree, Primitive, SampleError, SampleSettings, SampleTarget, SampledNodes, Solid,
    sample_tetrahedra, surface_mesh,
};
use testkit::assert_matches;
use testkit::tol::{assert_below, assert_relative};

#[test]
fn octrees_are_balanced_and_small_where_asked() {
    let liver = Solid::from(Primitive::Liver);
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
fn graded_samplings_have_exact_sums_and_good_angles() {
    for shape in shapes() {
        let analytic = Solid::from(shape);
        let mesh = Solid::from_mesh(surface_mesh(&analytic, 0.02).unwrap());
        for (body, solid) in [("function", &analytic), ("mesh", &mesh)] {
            let all = [(0.25, 2.0), (1.0, 4.0), (0.5, 1.0)];
            for &(factor, coarsest) in if body == "mesh" { &all[..1] } else { &all } {
                let grading = refined(DVec3::new(0.03, 0.02, 0.02), 0.01, factor, coarsest);
                let name = format!("{shape:?} {body} {factor} {coarsest}");
                let s = check_graded(&name, solid, 1500, grading);
                assert_eq!(s.report.pieces, 1, "{name}");
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
    let solid = Primitive::Box { half_extents }.into();
    let s = graded(&solid, SampleTarget::Spacing(0.04), grading).unwrap();
    check_sums("box", &s);
    let volume = 8.0 * half_extents.element_product();
    assert_relative("volume", s.report.volume, volume, 0.0, 1e-12);
    assert!(s.report.quality.smallest_dihedral > 35.0, "{}", s.report);
}

/// Mean edge (m) of the tetrahedra whose middle's distance from a position is as wanted.
fn mean_edge(s: &SampledNodes, center: DVec3, wanted: impl Fn(f64) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for t in &s.tetrahedra {
        let p = t.map(|v| s.positions[v as usize]);
        let middle = 0.25 * (p[0] + p[1] + p[2] + p[3]);
        if wanted(middle.distance(center)) {
            for (i, a) in p.iter().enumerate() {
                for b in &p[i + 1..] {
                    sum += a.distance(*b);
                    count += 1.0;
                }
            }
        }
    }
    sum / count
}

#[test]
fn the_size_field_is_followed() {
    let half_extents = DVec3::new(0.031, 0.05, 0.1);
    let bodies = [
        (Primitive::Liver, DVec3::splat(0.03), 0.05),
        // Its cells are stretched to fit it.
        (Primitive::Box { half_extents }, DVec3::Z * 0.07, 0.1),
    ];
    for (body, center, tolerance) in bodies {
        for factor in [0.5, 0.25] {
            let grading = refined(center, 0.02, factor, 1.0);
            let s = graded(&body.into(), SampleTarget::Spacing(0.012), grading).unwrap();
            let near = mean_edge(&s, center, |d| d < 0.015);
            let far = mean_edge(&s, center, |d| d > 0.06);
            println!(
                "{body:?} {factor}: near {:.3}, far {:.3} of what was asked for",
                near / factor / 0.012,
                far / 0.012
            );
            // Improved edges at the surface are longer, so the cells are finer for the mean to be as
            // wished: by 8 % in this liver of three thousand nodes.
            assert_relative("near", near, factor * 0.012, 0.0, 0.1);
            assert_relative("far", far, 0.012, 0.0, tolerance);
        }
    }
}

#[test]
fn bad_gradings_are_refused() {
    let liver = Solid::from(Primitive::Liver);
    let at = |grading| graded(&liver, SampleTarget::Spacing(0.01), grading).unwrap_err();
    for (coarsest, growth) in [(0.5, 1.0), (1.0, f64::NAN)] {
        let grading = Grading {
            coarsest,
            growth,
            ..Grading::default()
        };
        assert_matches!(at(grading), SampleError::Grading { .. });
    }
    let factor = refined(DVec3::ZERO, 0.01, 0.001, 1.0);
    assert_matches!(at(factor), SampleError::Refinement { refinement: 0, .. });
    let radius = refined(DVec3::ZERO, -1.0, 0.5, 1.0);
    assert_matches!(at(radius), SampleError::Refinement { .. });
    let small = SampleSettings {
        target: SampleTarget::Spacing(0.002),
        grading: refined(DVec3::ZERO, 0.03, 0.125, 1.0),
        largest_lattice: 10_000,
        ..SampleSettings::default()
    };
    let fine = sample_tetrahedra(&liver, &small).unwrap_err();
    assert_matches!(fine, SampleError::TooFine { .. });
}
