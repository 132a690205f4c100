//! What is repaired, reported and refused.

use crate::common::{ball, cube, join, repaired, soup};
use glam::DVec3;
use phyxel_discretize::{
    Primitive, SampleError, SampleSettings, Solid, sample_tetrahedra, surface_mesh,
};
use testkit::tol::assert_relative;

#[test]
fn repair_turns_welds_drops_and_closes() {
    // Inside out, and one triangle turned.
    let mut mesh = cube(DVec3::ZERO);
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    mesh.triangles[3].swap(0, 1);
    let (fixed, report) = repaired(&mesh);
    assert_eq!((report.turned_parts, report.turned_triangles), (1, 1));
    assert_relative("volume", fixed.volume(), 1.0, 0.0, 1e-12);
    // Triangle soup with a duplicate and a degenerate one.
    let mut soup = soup(&mesh);
    soup.triangles.extend([soup.triangles[0], [4, 4, 5]]);
    let (fixed, report) = repaired(&soup);
    let dropped = (report.duplicate_triangles, report.degenerate_triangles);
    assert_eq!(dropped, (1, 1));
    assert_eq!((report.welded_vertices, fixed.vertices.len()), (28, 8));
    assert_eq!(report.genus, Some(0));
    // A small hole in a fine sphere is closed.
    let mut sphere = surface_mesh(&ball(1.0), 0.1).unwrap();
    let whole = sphere.volume();
    sphere.triangles.drain(100..103);
    let (fixed, report) = repaired(&sphere);
    assert!(report.closed_holes > 0 && report.largest_hole > 0.0);
    assert_relative("volume", fixed.volume(), whole, 0.0, 1e-2);
}

/// A ball in a hollow ball in a cube: winding numbers and parts.
#[test]
fn nested_parts_and_cavities() {
    let shell = |radius| surface_mesh(&ball(radius), 0.3 * radius).unwrap();
    let nested = join(&[(shell(1.0), false), (shell(0.7), true), (shell(0.3), false)]);
    // All turned: the repair turns the whole nest back.
    let mut turned = nested.clone();
    turned.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    for mesh in [nested, turned] {
        let (mesh, report) = repaired(&mesh);
        assert_eq!((report.parts, report.cavities), (3, 1));
        let solid = Solid::from_mesh(mesh);
        for (x, inside) in [(0.0, true), (0.5, false), (0.85, true), (1.2, false)] {
            assert_eq!(solid.contains(DVec3::new(x, 0.01, 0.02)), inside, "{x}");
        }
        let s = crate::common::sample(&solid, 8000).unwrap();
        assert_eq!(s.report.pieces, 2);
        assert_eq!(s.report.lost_cavities, 0);
    }
}

#[test]
fn thin_and_lost_parts_are_refused_or_told() {
    let at = |spacing| SampleSettings::spacing(spacing);
    let plate = Primitive::Ellipsoid {
        semi_axes: DVec3::new(1.0, 1.0, 0.01),
    };
    let mesh = surface_mesh(&plate.into(), 0.02).unwrap();
    let solid = Solid::from_mesh(mesh);
    // Between lattice planes: vanishes or is reported.
    match sample_tetrahedra(&solid, &at(0.3)) {
        Err(SampleError::Vanished { .. } | SampleError::LostParts { .. }) => {}
        Ok(s) => assert!(s.report.missed > 0.0 || s.report.volume_error.unwrap().abs() > 0.1),
        Err(other) => panic!("{other}"),
    }
    let shell = |radius, spacing| surface_mesh(&ball(radius), spacing).unwrap();
    let mut small = shell(0.02, 0.01);
    for v in &mut small.vertices {
        *v += DVec3::new(1.53, 0.37, 0.41);
    }
    let solid = Solid::from_mesh(join(&[(shell(1.0, 0.2), false), (small, false)]));
    match sample_tetrahedra(&solid, &at(0.25)) {
        Err(SampleError::LostParts { parts, of, .. }) => assert_eq!((parts, of), (1, 2)),
        other => panic!("{other:?}"),
    }
}
