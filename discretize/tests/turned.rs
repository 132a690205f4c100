//! A body that is turned has the nodes of the one that is not, turned.

use glam::{DMat3, DVec3};
use phyxel_discretize::{
    Grading, Placement, Primitive, Refinement, SampleSettings, Shape, Solid, sample_points,
    sample_surfels, sample_tetrahedra, surface_mesh,
};
use proptest::prelude::*;
use testkit::strategies::{rotation, vector};

fn shapes() -> [Shape; 5] {
    let at = DVec3::new;
    [
        Shape::Liver { width: 0.17 },
        Shape::Box {
            size: at(0.12, 0.05, 0.03),
        },
        Shape::Ellipsoid {
            radii: at(0.06, 0.03, 0.02),
        },
        Shape::Capsule {
            from: at(0.01, 0.0, 0.0),
            to: at(0.05, 0.02, 0.0),
            radius: 0.02,
        },
        Shape::Tube {
            from: at(0.0, 0.0, -0.03),
            to: at(0.01, 0.02, 0.03),
            inner_radius: 0.01,
            outer_radius: 0.02,
        },
    ]
}

/// Tetrahedra and points of the solid and the turned one: the same but for the round-off of the rotation.
fn check(name: &str, solid: &Solid, turned: &Solid, turn: DMat3, shift: DVec3, coarsest: f64) {
    let size = solid.bounds().diagonal();
    let with = |refined: Refinement| SampleSettings {
        grading: Grading {
            coarsest,
            refinements: vec![refined],
            ..Grading::default()
        },
        ..SampleSettings::nodes(300)
    };
    let refined = Refinement {
        from: solid.bounds().center(),
        to: solid.bounds().max,
        radius: 0.1 * size,
        factor: 1.0 / coarsest,
    };
    let place = |p: DVec3| turn * p + shift;
    let there = Refinement {
        from: place(refined.from),
        to: place(refined.to),
        ..refined
    };
    let far = size + shift.length();
    let same = |one: &[DVec3], other: &[DVec3], place: &dyn Fn(DVec3) -> DVec3, unit: f64| {
        assert_eq!(one.len(), other.len(), "{name}");
        for (a, b) in one.iter().zip(other) {
            let off = place(*a).distance(*b);
            assert!(off <= 1e-12 * unit, "{name}: off by {off:e}");
        }
    };
    let one = sample_tetrahedra(solid, &with(refined)).unwrap();
    let other = sample_tetrahedra(turned, &with(there)).unwrap();
    same(&one.positions, &other.positions, &place, far);
    same(
        &one.boundary_vectors,
        &other.boundary_vectors,
        &|b| turn * b,
        size * size,
    );
    assert_eq!(one.volumes, other.volumes, "{name}: volumes");
    assert_eq!(one.tetrahedra, other.tetrahedra, "{name}: tetrahedra");
    assert_eq!(one.report, other.report, "{name}: report");
    let exact = if name.starts_with("Box") { 1e-12 } else { 1.0 };
    let is_known = |error: Option<f64>| error.is_some_and(|error| error.abs() < exact);
    assert!(is_known(one.report.volume_error), "{name}: its volume");
    let one = sample_points(solid, &with(refined), true).unwrap();
    let other = sample_points(turned, &with(there), true).unwrap();
    same(&one.positions, &other.positions, &place, far);
    assert_eq!(one.volumes, other.volumes, "{name}: volumes of points");
    assert!(is_known(other.report.volume_error), "{name}: of points");
    let surface = surface_mesh(turned, 0.03 * size).unwrap();
    let surfels = sample_surfels(&surface, 50, Some(turned));
    for x in &surfels.positions {
        let off = turned.signed_distance(*x).abs();
        assert!(off < 1e-6 * size, "{name}: a surfel {off:e} m off");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1))]

    #[test]
    fn turned_bodies_have_the_same_nodes_turned(
        turn in rotation(),
        shift in vector(0.3),
        coarsest in prop::sample::select(vec![1.0, 2.0]),
    ) {
        let turn = DMat3::from_quat(turn);
        let placed = Placement { turn, position: shift, ..Placement::IDENTITY };
        for shape in shapes() {
            let (solid, _) = shape.solid(&Placement::IDENTITY).unwrap();
            let (turned, _) = shape.solid(&placed).unwrap();
            check(&format!("{shape:?}"), &solid, &turned, turn, shift, coarsest);
        }
        let mesh = surface_mesh(&Primitive::Liver.into(), 0.02).unwrap();
        let solid = Solid::from_mesh(mesh);
        let turned = solid.clone().turned(turn, shift);
        check("mesh", &solid, &turned, turn, shift, coarsest);
    }
}

/// A shape that is scaled, turned and moved has the distances of its own, times the scale, at the positions taken
/// back into its frame.
#[test]
fn a_placed_shape_is_the_same_elsewhere() {
    // A quarter turn about z, twice the size.
    let placed = Placement {
        scale: 2.0,
        turn: DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2),
        position: DVec3::new(0.3, -0.2, 0.1),
    };
    for shape in shapes() {
        let (solid, _) = shape.solid(&Placement::IDENTITY).expect("a solid");
        let (moved, _) = shape.solid(&placed).expect("a solid");
        let (mut inside, mut outside) = (0, 0);
        for k in 0..729 {
            let pick = |k: i32| f64::from(k % 9 - 4) * 0.011;
            let p = DVec3::new(pick(k), pick(k / 9), pick(k / 81));
            let there = 2.0 * DVec3::new(-p.y, p.x, p.z) + placed.position;
            let (a, b) = (solid.signed_distance(p), moved.signed_distance(there));
            let same = (2.0 * a - b).abs() < 1e-15 + 1e-12 * a.abs();
            assert!(same, "{shape:?} at {p}: {a} {b}");
            assert_eq!(solid.contains(p), moved.contains(there), "{shape:?} at {p}");
            if a < 0.0 { inside += 1 } else { outside += 1 }
        }
        let both = format!("{shape:?}: {inside} inside, {outside} outside");
        assert!(inside > 20 && outside > 20, "{both}");
    }
}
