//! Surfels follow their nodes: exactly for affine maps, and only their own piece after a cut.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use phyxel_splat::{Splat, Surfel, Tissue, TissueSettings, WeightLaw};
use proptest::prelude::*;
use testkit::cloud::{filled_cube, patch, swept};
use testkit::strategies;

/// Surfels of the plane z = 0.5 over nodes that fill the unit cube.
fn slab(settings: &TissueSettings) -> (Tissue, Vec<DVec3>) {
    let (x, n, a) = patch(30, 0.3, 7);
    let nodes = filled_cube(8, 3);
    (Tissue::new(&x, &n, &a, &nodes, settings).unwrap(), nodes)
}

/// The splats where nodes of one gradient carry them.
fn carried(tissue: &Tissue, nodes: &[DVec3], gradient: DMat3) -> Vec<Splat> {
    let mut splats = Vec::new();
    tissue.carry_into(nodes, &vec![gradient; nodes.len()], &mut splats);
    splats
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn affine_maps_are_reproduced(
        turn in strategies::rotation(),
        stretch in strategies::vector(0.4),
        shift in strategies::vector(10.0),
    ) {
        let (tissue, nodes) = slab(&TissueSettings::default());
        for (f, allowed) in [
            (DMat3::from_quat(turn), 1e-12),
            (DMat3::from_quat(turn) * DMat3::from_diagonal(DVec3::ONE + stretch), 1e-10),
        ] {
            let map = DAffine3::from_mat3_translation(f, shift);
            let moved: Vec<DVec3> = nodes.iter().map(|&p| map.transform_point3(p)).collect();
            let cofactor = f.inverse().transpose();
            let splats = carried(&tissue, &moved, f);
            for (i, (splat, rest)) in splats.iter().zip(tissue.surfels()).enumerate() {
                let x = splat.position.distance(map.transform_point3(rest.position));
                prop_assert!(x <= allowed * 10.0, "surfel {i} is off by {x:e}");
                let e = splat.normal.distance((cofactor * rest.normal).normalize());
                prop_assert!(e <= allowed, "normal {i} is off by {e:e}");
            }
        }
    }
}

#[test]
fn each_surfel_follows_its_own_piece_after_a_through_cut() {
    let (mut tissue, nodes) = slab(&TissueSettings::default());
    let crosses = |a: DVec3, b: DVec3| (a.x < 0.03) != (b.x < 0.03);
    let corner = |y: f64, z: f64| DVec3::new(0.03, y, z);
    let edge = |z: f64| [corner(-2.0, z), corner(2.0, z)];
    let inside = |p: DVec3| p.abs().max_element() < 0.5;
    let change = tissue
        .cut(&swept(edge(-2.0), edge(2.0)), &inside, &crosses)
        .unwrap();
    assert!(change.doubled > 10 && change.skin > 100, "{change:?}");
    // The right piece moves by a distance that f64 adds exactly.
    let shift = DVec3::X * 1024.0;
    let moved: Vec<DVec3> = nodes
        .iter()
        .map(|&p| if p.x < 0.03 { p } else { p + shift })
        .collect();
    let splats = carried(&tissue, &moved, DMat3::IDENTITY);
    for (i, surfel) in tissue.surfels().iter().enumerate() {
        let row = tissue.binding().row(i);
        let sides: Vec<bool> = row.0.iter().map(|&k| nodes[k as usize].x < 0.03).collect();
        let one = sides.iter().all(|&s| s == sides[0]);
        assert!(one, "surfel {i} hangs on both pieces");
        let rest = surfel.position;
        let expected = if sides[0] { rest } else { rest + shift };
        let off = splats[i].position.distance(expected);
        assert!(off < 1e-12 * 1024.0, "surfel {i}");
        // Outer surfels that were not doubled lie on the side of their nodes.
        let n = surfel.normal;
        let faces_away = (n.x > 0.0) == sides[0];
        assert!(n.x.abs() <= 0.9 || faces_away, "skin {i} and its piece");
    }
}

#[test]
fn bad_data_is_named() {
    let x = [DVec3::ZERO, DVec3::X];
    let n = [DVec3::Z, DVec3::Z];
    let build = |x: &[DVec3], n: &[DVec3], a: &[f64], nodes: &[DVec3]| {
        let built = Tissue::new(x, n, a, nodes, &TissueSettings::default());
        built.unwrap_err().to_string()
    };
    assert!(build(&x, &n, &[1.0, -1.0], &x).starts_with("surfel 1"));
    assert!(build(&x, &[DVec3::ZERO, DVec3::Z], &[1.0, 1.0], &x).starts_with("surfel 0"));
    assert!(build(&x, &n, &[1.0, 1.0], &[]).starts_with("no nodes to carry 2"));
    assert!(build(&x, &n, &[1.0, 1.0], &[DVec3::NAN]).starts_with("node 0"));
    let mut tissue = Tissue::new(&x, &n, &[1.0, 1.0], &x, &TissueSettings::default()).unwrap();
    let bad = [[DVec3::ZERO, DVec3::X, DVec3::INFINITY]];
    let refused = tissue.cut(&bad, &|_| true, &|_, _| false);
    let message = refused.unwrap_err().to_string();
    assert!(message.starts_with("triangle 0"), "{message}");
}

/// However a cut is folded, what is drawn of its skin ends at the body's surface.
#[test]
fn skin_of_a_folded_cut_stays_in_the_body() {
    let (mut tissue, _) = slab(&TissueSettings::default());
    let edge = |k: i32| {
        let x = if k % 2 == 0 { 0.02 } else { -0.03 };
        [-0.2, 0.8].map(|z| DVec3::new(x, 0.02 * f64::from(k), z))
    };
    let inside = |p: DVec3| p.abs().max_element() < 0.5;
    for k in -15..15 {
        tissue
            .cut(&swept(edge(k), edge(k + 1)), &inside, &|_, _| false)
            .unwrap();
    }
    let mut points = 0;
    let all = tissue.surfels().iter().zip(tissue.clips()).enumerate();
    for (i, (surfel, clip)) in all.skip(tissue.outer_count()) {
        let (t0, t1) = Surfel::tangents(surfel.normal);
        // Doubles of the plane's own surfels lie in it.
        if surfel.normal.z.abs() > 0.5 {
            continue;
        }
        // An anchor beside a wall is moved off it by a twentieth of the largest radius at most.
        if let Some(clip) = clip {
            let beyond = |(d, offset): &(DVec2, f64)| clip.anchor.dot(*d) - offset;
            let out = clip.edges.iter().map(beyond).fold(0.0, f64::max);
            let most = 0.05 * 1.3 / 30.0;
            assert!(out < most, "surfel {i} sees from the air: {out}");
        }
        for k in 0..400 {
            let q = DVec2::new(f64::from(k % 20) - 9.5, f64::from(k / 20) - 9.5) / 10.0;
            let hidden = (clip.as_ref()).is_some_and(|clip| clip.hides(q * surfel.radius));
            if q.length() < 1.0 && !hidden {
                let p = surfel.position + (t0 * q.x + t1 * q.y) * surfel.radius;
                // The plane's normals lean by up to 0.0043; its surfels lie up to 0.03 away.
                assert!(p.z < 0.5 + 2e-4, "surfel {i} shows {p}");
                points += 1;
            }
        }
    }
    assert!(points > 10_000, "{points}");
}

/// Eq. (58): the nearest nodes, by `exp(-d²/h²)` with h the distance of the farthest of them, over their sum.
#[test]
fn bell_weights_are_those_of_equation_58() {
    let (tissue, nodes) = slab(&TissueSettings {
        weights: WeightLaw::Gaussian,
        ..TissueSettings::default()
    });
    let mut worst: f64 = 0.0;
    for (i, surfel) in tissue.surfels().iter().enumerate() {
        // Nodes are looked for from 0.02 of the surfels' spacing below the surface.
        let eye = surfel.position - DVec3::Z * 0.02 / 30.0;
        let mut far: Vec<f64> = nodes.iter().map(|node| eye.distance(*node)).collect();
        far.sort_by(f64::total_cmp);
        let bells = far[..8].iter().map(|d| (-(d / far[7]).powi(2)).exp());
        let sum: f64 = bells.clone().sum();
        let (_, weights) = tissue.binding().row(i);
        assert_eq!(weights.len(), 8);
        for (weight, bell) in weights.iter().zip(bells) {
            worst = worst.max((weight - bell / sum).abs());
        }
    }
    // 5e-6: the spacing, by their areas, is not 1/30 to the last digit.
    assert!(worst < 2e-5, "off by {worst:e}");
}
