//! Nodes without tetrahedra: sums, positions, volumes.

use crate::common::{ball, check_count, check_points, gradings, shapes};
use glam::DVec3;
use phyxel_discretize::{
    Grading, Primitive, SampleSettings, SampleTarget, Solid, estimate_point_nodes,
    estimate_tetrahedra_nodes, parse_mesh, repair, sample_points, sample_tetrahedra, surface_mesh,
};
use testkit::tol::assert_below;

fn with(target: SampleTarget, grading: Grading) -> SampleSettings {
    SampleSettings {
        target,
        grading,
        ..SampleSettings::default()
    }
}

#[test]
fn every_shape_lattice_and_octree_with_and_without_surface_nodes() {
    for shape in shapes() {
        let analytic = Solid::from(shape);
        let mesh = Solid::from_mesh(surface_mesh(&analytic, 0.02).unwrap());
        for solid in [&analytic, &mesh] {
            for grading in gradings(DVec3::new(0.03, 0.02, 0.02), 0.01) {
                for on_surface in [false, true] {
                    let name = format!("{shape:?} {grading:?} {on_surface}");
                    let settings = with(SampleTarget::NodeCount(250), grading.clone());
                    let s = sample_points(solid, &settings, on_surface).unwrap();
                    check_points(&name, &s);
                    check_count(&name, s.positions.len(), 250);
                    let count = s.on_surface.iter().filter(|on| **on).count();
                    assert_eq!(count, s.report.surface_nodes);
                    assert_eq!(count > 0, on_surface);
                    for (p, on) in s.positions.iter().zip(&s.on_surface) {
                        if solid.mesh().is_none() {
                            let value = shape.value(*p);
                            assert_below(&name, value, 1e-12);
                            assert!(!on || value > -1e-9, "{name}");
                        } else if !on {
                            assert!(solid.contains(*p), "{name}");
                        }
                    }
                }
            }
        }
    }
}

/// A regular lattice is what it says: every inner node has a neighbour at one spacing.
#[test]
fn one_spacing_is_a_regular_lattice() {
    let solid = Solid::from(Primitive::Liver);
    let h = 0.012;
    let settings = with(SampleTarget::Spacing(h), Grading::default());
    let s = sample_points(&solid, &settings, false).unwrap();
    for p in &s.positions {
        let cells = (*p - s.positions[0]) / h;
        assert_below("off the lattice", (cells - cells.round()).length(), 1e-9);
    }
    // Inner nodes own a whole cell, up to the correction.
    let whole = h * h * h * (1.0 + s.report.correction);
    let largest = s.volumes.iter().copied().fold(0.0, f64::max);
    let is_whole = |v: &&f64| (**v / whole - 1.0).abs() < 1e-9;
    assert!(s.volumes.iter().filter(is_whole).count() > 100);
    assert!(largest < 3.0 * whole);
}

/// However fine the nodes, those in the tip of a wedge of 4 degrees lie nearly in a plane.
#[test]
fn wedges_as_sharp_as_a_blade_have_boundary_vectors() {
    let text = "OFF\n6 8 0\n0 0 0\n1 0.07 0\n1 -0.07 0\n0 0 0.3\n1 0.07 0.3\n1 -0.07 0.3\n\
                3 0 1 2\n3 3 5 4\n3 0 3 4\n3 0 4 1\n3 0 2 5\n3 0 5 3\n3 1 4 5\n3 1 5 2\n";
    let mesh = parse_mesh(text.as_bytes()).unwrap().mesh;
    let solid = Solid::from_mesh(repair(&mesh, &Default::default()).unwrap().0);
    for target in [1000, 25_000] {
        let settings = with(SampleTarget::NodeCount(target), Grading::default());
        let s = sample_points(&solid, &settings, true).unwrap();
        check_points("wedge", &s);
        check_count("wedge", s.positions.len(), target);
    }
}

#[test]
fn points_are_written_and_are_no_mesh() {
    let settings = SampleSettings::nodes(1500);
    let sampled = sample_points(&Primitive::Liver.into(), &settings, true).unwrap();
    let written = sampled.to_vtk();
    assert!(parse_mesh(&written).is_err(), "points are no mesh");
    assert!(written.len() > 1500 * (24 + 8 + 24));
}

/// The counts reported before sampling are those made, but for the surface's share.
#[test]
fn estimates_are_near_what_is_made() {
    let ball = ball(0.1);
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    for spacing in [0.016, 0.01] {
        let settings = SampleSettings::spacing(spacing);
        let tetrahedra = sample_tetrahedra(&ball, &settings).unwrap().positions.len();
        let points = sample_points(&ball, &settings, false)
            .unwrap()
            .positions
            .len();
        // Nodes on the surface stand for half a cell: 6 spacings across and more.
        let least = 1.0..1.0 + 6.0 * spacing / 0.1;
        let over = tetrahedra as f64 / estimate_tetrahedra_nodes(volume, spacing);
        assert!(
            least.contains(&over),
            "{tetrahedra} nodes, {over} of the estimate"
        );
        let over = points as f64 / estimate_point_nodes(volume, spacing);
        assert!(
            (0.8..1.25).contains(&over),
            "{points} points, {over} of the estimate"
        );
    }
}
