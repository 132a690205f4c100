//! Samples on cuts, radii rules, images.

use glam::{DVec3, Vec3};
use phyxel_splat::{
    Animation, ColorScale, CutSampler, Frame, Measure, Overlay, RadiusRule, Tissue, TissueSettings,
    measures, triangle_area,
};
use proptest::prelude::*;
use std::io::Cursor;
use testkit::cloud::{golden_sphere, lattice, swept};
use testkit::strategies;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn count_is_density_times_area_for_any_triangle(
        corners in prop::array::uniform3(strategies::vector(1.0)),
        scale in strategies::scale(),
        wanted in 50.0..400.0_f64,
    ) {
        let triangle = corners.map(|p| p * scale);
        let area = triangle_area(&triangle);
        prop_assume!(area > 1e-6 * scale * scale);
        let mut sampler = CutSampler::new(wanted / area);
        let points = sampler.points(&[triangle]);
        let count = points.len() as f64;
        prop_assert!((count - wanted).abs() <= 1.0, "{count} of {wanted}");
        // In the plane and inside.
        let [a, b, c] = triangle;
        let normal = (b - a).cross(c - a).normalize();
        for p in points {
            prop_assert!((p - a).dot(normal).abs() <= 1e-9 * scale);
            for (s, e) in [(a, b), (b, c), (c, a)] {
                let out = (e - s).cross(p - s).dot(normal);
                prop_assert!(out >= -1e-9 * scale * scale);
            }
        }
    }

    #[test]
    fn strips_that_arrive_one_by_one_keep_the_count(strips in 1_u32..40, wanted in 100.0..900.0_f64) {
        let mut sampler = CutSampler::new(wanted);
        let mut points = Vec::new();
        for k in 0..strips {
            let [x0, x1] = [k, k + 1].map(|i| f64::from(i) / f64::from(strips));
            let edge = |x: f64| [DVec3::new(x, 0.0, 0.0), DVec3::new(x, 1.0, 0.0)];
            points.extend(sampler.points(&swept(edge(x0), edge(x1))));
        }
        prop_assert!((points.len() as f64 - wanted).abs() <= 1.0 + 1e-9);
        // Spacing: the largest hole stays below what a skin disk covers, no two samples meet. A sample
        // at the cut's end may wait for the next strip.
        let spacing = sampler.spacing();
        let (mut hole, mut last): (f64, f64) = (0.0, 0.0);
        for i in 0..60 {
            for j in 0..60 {
                let q = DVec3::new(f64::from(i) + 0.5, f64::from(j) + 0.5, 0.0) / 60.0;
                let near = points.iter().map(|p| p.distance(q)).fold(f64::INFINITY, f64::min);
                let part = if q.x < 1.0 - spacing { &mut hole } else { &mut last };
                *part = part.max(near);
            }
        }
        prop_assert!(hole <= 1.3 * spacing, "hole {} spacings", hole / spacing);
        prop_assert!(last <= 1.8 * spacing, "hole at the end {} spacings", last / spacing);
        let mut least = f64::INFINITY;
        for (i, p) in points.iter().enumerate() {
            for q in &points[..i] {
                least = least.min(p.distance(*q));
            }
        }
        prop_assert!(least >= 0.5 * spacing, "pair {} spacings apart", least / spacing);
    }
}

#[test]
fn degenerate_triangles_give_no_sample() {
    let mut sampler = CutSampler::new(1e6);
    let flat = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
    assert!(sampler.points(&[flat, [DVec3::ONE; 3]]).is_empty());
}

#[test]
fn measures_are_the_dissertations() {
    // A cross of four neighbours around a point raised by d: eqs (52)-(57) by hand.
    let d = 0.1;
    let mut points = vec![DVec3::Z * d];
    points.extend([DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y]);
    let mean = (1.0_f64 + d * d).sqrt();
    assert!((measures(&points, Measure::Density, 4)[0] - mean).abs() < 1e-15);
    let curvature = measures(&points, Measure::Curvature, 4)[0];
    assert!((curvature - 2.0 * d / (mean * mean)).abs() < 1e-14);
    assert!(measures(&points, Measure::Variation, 4)[0].abs() < 1e-15);
    // Six points of an octahedron around the first vary equally in all directions.
    let [x, y, z] = DVec3::AXES;
    let ball = [DVec3::ZERO, x, y, z, -x, -y, -z];
    assert!((measures(&ball, Measure::Variation, 6)[0] - 1.0 / 3.0).abs() < 1e-14);
}

#[test]
fn two_nearest_surfels_tell_inside_on_smooth_bodies_and_not_in_thin_ones() {
    let ball = golden_sphere(2_000);
    let settings = TissueSettings::default();
    let tissue = |x: &[DVec3], n: &[DVec3]| {
        Tissue::new(x, n, &vec![0.1; x.len()], &[DVec3::ZERO], &settings)
    };
    let round = tissue(&ball, &ball).unwrap();
    let wrong = |tissue: &Tissue, points: &[DVec3], inside: bool| {
        let judged = points.iter().map(|&x| tissue.is_behind_surfels(x));
        judged.filter(|&judged| judged != inside).count()
    };
    let at = |r: f64| ball.iter().map(|&x| x * r).collect::<Vec<_>>();
    let misjudged = [
        wrong(&round, &at(0.98), true),
        wrong(&round, &at(1.01), false),
    ];
    assert_eq!(misjudged, [0, 0]);
    // A convex and a concave rim: of two faces that meet at a right angle, a body is what lies behind both
    // or behind one at least. Across the rim the nearest are one of each face.
    let (mut x, mut n) = (Vec::new(), Vec::new());
    for i in 0..20 {
        for j in 0..20 {
            let (along, off) = (f64::from(i) / 20.0, (f64::from(j) + 0.5) / 20.0);
            x.extend([DVec3::new(off, along, 0.0), DVec3::new(0.0, along, off)]);
            n.extend([DVec3::Z, DVec3::X]);
        }
    }
    let around: Vec<DVec3> = (0..360)
        .map(|i| {
            let (sine, cosine) = (f64::from(i) + 0.5).to_radians().sin_cos();
            DVec3::new(0.02 * cosine, 0.51, 0.02 * sine)
        })
        .collect();
    for sign in [1.0, -1.0] {
        let normals: Vec<DVec3> = n.iter().map(|&n| n * sign).collect();
        let rim = tissue(&x, &normals).unwrap();
        let misjudged = around.iter().filter(|&&p| {
            let (front, side) = (sign * p.z > 0.0, sign * p.x > 0.0);
            // The faces stand on their own normals' sides of each other: concave for +1.
            let inside = !(front && side) && (sign > 0.0 || !(front || side));
            rim.is_behind_surfels(p) != inside
        });
        assert_eq!(misjudged.count(), 0, "{sign}");
    }
    // A plate a tenth as thick as its surfels are apart, two below beside each one above: a point
    // over the plate but nearer to two surfels of the other side is taken to be inside.
    let (mut x, mut n) = (Vec::new(), Vec::new());
    for i in 0..400 {
        let at = DVec3::new(f64::from(i % 20), f64::from(i / 20), 0.0);
        let below = [0.35, 0.65].map(|x| at + DVec3::new(x, 0.5, -0.1));
        x.extend([at, below[0], below[1]]);
        n.extend([DVec3::Z, DVec3::NEG_Z, DVec3::NEG_Z]);
    }
    let plate = tissue(&x, &n).unwrap();
    let over: Vec<DVec3> = (0..200)
        .map(|i| DVec3::new(5.0 + f64::from(i) / 20.0, 8.5, 0.01))
        .collect();
    let taken = wrong(&plate, &over, false);
    assert!(taken > 100, "{taken} of 200");
}

#[test]
fn covering_disks_cover_a_lattice_exactly() {
    // On a square lattice the cell is a square: circumradius h / sqrt(2), times the overlap 1.15.
    let x = lattice([20, 20, 1], 1.0, 0.0, 1);
    let radii = RadiusRule::Covering.radii(&x, &vec![DVec3::Z; 400]);
    let expected = 1.15 * 0.5_f64.sqrt();
    for i in [210, 189, 150] {
        assert!((radii[i] - expected).abs() < 1e-12, "{}", radii[i]);
    }
}

#[test]
fn images_read_back() {
    let mut frame = Frame::blank(320, 200);
    let scale = ColorScale::of(&[0.0, f64::NAN, 2.5]);
    Overlay::new(&mut frame).legend(&scale, "curvature");
    let bright = frame.pixels.iter().any(|p| p[0] > 200 && p[2] < 100);
    assert!(bright, "the bar's end");
    let read = |file| png::Decoder::new(Cursor::new(file)).read_info().unwrap();
    let mut file = Vec::new();
    frame.write_png(&mut file).unwrap();
    let mut reader = read(file);
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    assert_eq!(pixels, frame.pixels.as_flattened());

    let mut file = Vec::new();
    let mut animation = Animation::new(&mut file, 320, 200, 2, 25).unwrap();
    animation.add(&frame).unwrap();
    assert!(animation.add(&Frame::blank(2, 2)).is_err(), "another size");
    animation.add(&Frame::blank(320, 200)).unwrap();
    assert!(animation.add(&frame).is_err(), "more than announced");
    animation.finish().unwrap();
    let reader = read(file);
    assert_eq!(reader.info().animation_control.unwrap().num_frames, 2);
    let short = Animation::new(Vec::new(), 4, 4, 2, 25).unwrap();
    assert!(short.finish().is_err(), "frames are missing");
}

#[test]
fn scales_map_ends_and_outside() {
    let scale = ColorScale::of(&[-1.0, 3.0]);
    assert_eq!(scale.color(-5.0), scale.color(-1.0));
    assert_eq!(scale.color(9.0), scale.color(3.0));
    assert_ne!(scale.color(-1.0), scale.color(3.0));
    let grey: Vec3 = scale.color(f64::NAN);
    assert!((grey.x - grey.y).abs() < 1e-6);
}
