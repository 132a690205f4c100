use super::super::tests::{sample, sheets};
use super::*;

/// Patch test: whatever the samples, uniform pressure passes, also through a field of linear displacements.
#[test]
fn rows_follow_linear_fields_exactly() {
    let (contact, rest) = sheets(0.0, 7);
    let matrix = DMat3::from_cols(
        DVec3::new(1.1, 0.2, -0.1),
        DVec3::new(0.0, 0.9, 0.3),
        DVec3::new(-0.2, 0.1, 0.8),
    );
    let moved: Vec<DVec3> = rest.iter().map(|x| matrix * *x + DVec3::X).collect();
    for sample in 0..contact.disks.len() {
        let placed = contact.disks.place(sample, &moved);
        let at = contact.disks.samples[sample];
        assert!(
            (placed.x - matrix * at.position - DVec3::X).length() < 1e-12,
            "point"
        );
        let normal = (matrix.inverse().transpose() * at.normal).normalize();
        assert!((placed.n - normal).length() < 1e-12, "normal");
        assert!(
            contact.disks.thickness[sample].abs() < 1e-12,
            "nodes determine it"
        );
    }
}

/// A flank's samples bear by what the cut opened at nodes, whatever their distance, and follow fields that are linear along the disk.
#[test]
fn flanks_bear_by_opened_areas() {
    let spots = (0..75_u32).map(|i| [i % 5, i / 5 % 5, i / 25].map(f64::from));
    let rest: Vec<DVec3> = spots
        .map(|[x, y, z]| DVec3::new(x + 0.1 * y.sin(), y, -z))
        .collect();
    let nodes: Vec<u32> = (0..75).collect();
    let layer = [1.5, -0.5, 0.0];
    let areas: Vec<DVec3> = nodes
        .iter()
        .map(|node| DVec3::new(0.1, 0.0, layer[*node as usize / 25]))
        .collect();
    let matrix = DMat3::from_cols(
        DVec3::new(1.1, 0.2, -0.1),
        DVec3::new(0.0, 0.9, 0.3),
        DVec3::new(0.0, 0.0, 1.0),
    );
    let moved: Vec<DVec3> = rest.iter().map(|x| matrix * *x).collect();
    for height in [0.15, 0.85] {
        let mut disks = ContactDisks::default();
        let at = DVec3::new(2.2, 1.9, height);
        let sample = DiskSample {
            flank: true,
            ..sample(at, DVec3::Z, 0.25, 0)
        };
        disks.push(sample, (&nodes, &areas), &rest);
        let mut layers = [0.0; 3];
        for entry in disks.row(0) {
            layers[disks.nodes[entry] as usize / 25] += disks.weights[entry];
        }
        for (found, expected) in layers.iter().zip(layer) {
            assert!((found - expected).abs() < 0.02, "{layers:?}");
        }
        // Half a spacing in front of the first layer, where the nodes' volume ends.
        assert!(
            (disks.thickness[0] - (height - 0.5)).abs() < 0.02,
            "{disks:?}"
        );
        let along = DVec3::new(2.2, 1.9, 0.0) - DVec3::Z * (disks.thickness[0] - height);
        assert!((disks.place(0, &moved).x - matrix * along).length() < 1e-12);
        // Where areas cancel, as at a cut's front, and without areas it is fitted.
        let mixed: Vec<DVec3> = (0..75)
            .map(|i| areas[i] * f64::from([1, -1][i % 2]))
            .collect();
        let mut fitted = [ContactDisks::default(), ContactDisks::default()];
        fitted[0].push(sample, (&nodes[..16], &mixed[..16]), &rest);
        fitted[1].push(sample, (&nodes[..16], &[]), &rest);
        assert_eq!(fitted[0].weights, fitted[1].weights);
    }
}

/// Where a flank sees both sides of its cut it hangs on its own, if that has nodes enough; without any it touches nothing.
#[test]
fn a_flank_hangs_on_its_own_side() {
    let spots = (0..50_u32).map(|i| [i % 5, i / 5 % 5, i / 25].map(f64::from));
    let rest: Vec<DVec3> = spots.map(|[x, y, z]| DVec3::new(x, y, z - 0.5)).collect();
    let flank = DiskSample {
        flank: true,
        ..sample(DVec3::new(2.0, 2.0, 0.0), DVec3::Z, 0.25, 0)
    };
    let above = |nodes: &[u32]| {
        let mut disks = ContactDisks::default();
        let areas = vec![DVec3::ZERO; nodes.len()];
        disks.push(flank, (nodes, &areas), &rest);
        let on = disks.row(0).map(|entry| disks.nodes[entry]);
        (on.filter(|node| *node >= 25).count(), disks.samples[0].area)
    };
    let [below, beyond] = [6..14, 31..39_u32].map(|nodes| nodes.collect::<Vec<_>>());
    let both = [&below[..], &beyond].concat();
    assert_eq!(above(&both), (0, 0.25));
    assert_eq!(above(&both[1..]), (8, 0.25), "seven are too few");
    assert_eq!(above(&beyond), (8, 0.0), "no tissue behind it");
}

/// A sheet of one layer of nodes does not determine its normal direction: the surface stays as far outside as at rest.
#[test]
fn a_membrane_has_a_thickness() {
    let rest: Vec<DVec3> = (0..9_u32)
        .map(|i| DVec3::new((i % 3).into(), (i / 3).into(), 0.0))
        .collect();
    let mut disks = ContactDisks::default();
    let sample = sample(DVec3::new(1.2, 0.9, 0.4), DVec3::Z, 1.0, 0);
    disks.push(sample, (&[0, 1, 2, 3, 4, 5, 6, 7, 8, 0], &[]), &rest);
    assert!((disks.thickness[0] - 0.4).abs() < 1e-12, "{disks:?}");
    assert!(
        (disks.place(0, &rest).x - DVec3::new(1.2, 0.9, 0.0)).length() < 1e-12,
        "{disks:?}"
    );
    let alone = DiskSample { body: 1, ..sample };
    disks.push(alone, (&[4], &[]), &rest);
    assert!(
        disks.reach[1] < 1e-300,
        "a single node makes a point without a disk"
    );
    assert!((disks.thickness[1] - 0.4).abs() < 1e-12, "{disks:?}");
    let far = DiskSample {
        position: sample.position + DVec3::Z,
        ..alone
    };
    disks.push(far, (&[4], &[]), &rest);
    assert!(disks.samples[2].area < 1e-300, "too far off");
}

/// A sample on a sphere stands in front of the triangle of its nodes; one on a face beside the triangle that cuts off its edge does not.
#[test]
fn what_is_cut_off_of_a_crease_is_no_bulge() {
    let circle =
        |degrees: f64| DVec3::new(degrees.to_radians().cos(), 0.0, degrees.to_radians().sin());
    let rest = [
        circle(75.0),
        circle(105.0) + DVec3::Y * 0.3,
        circle(90.0) - DVec3::Y * 0.5,
    ];
    let mut disks = ContactDisks::default();
    disks.push(sample(DVec3::Z, DVec3::Z, 0.1, 0), (&[0, 1, 2], &[]), &rest);
    let bulge = 1.0 - 0.5 * (75.0_f64.to_radians().sin() + 1.0);
    assert!(disks.thickness[0] > 0.2 * bulge, "{}", disks.thickness[0]);
    // From one face to the other, each 0.5 from their edge along y.
    let rest = [
        DVec3::NEG_X * 0.5,
        DVec3::new(-0.5, 1.0, 0.0),
        DVec3::new(0.0, 0.5, -0.5),
    ];
    disks.push(
        sample(DVec3::new(-0.2, 0.5, 0.0), DVec3::Z, 0.1, 0),
        (&[0, 1, 2], &[]),
        &rest,
    );
    assert!(disks.thickness[1].abs() < 1e-12, "{}", disks.thickness[1]);
}
