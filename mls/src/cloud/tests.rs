use super::*;
use proptest::prelude::*;
use testkit::cloud::Random;
use testkit::strategies::{rotation, scale, vector};

const ORDERS: [Order; 3] = [Order::Constant, Order::Linear, Order::Quadratic];
const DIMENSIONS: [Dimension; 3] = [Dimension::One, Dimension::Two, Dimension::Three];

/// A jittered lattice from 0 to `cells` along each axis of the dimension; the other coordinates are
/// anything.
fn lattice(dimension: Dimension, cells: i32, jitter: f64, seed: u64) -> Vec<DVec3> {
    let mut random = Random::new(seed);
    let range = |axis: usize| 0..=if axis < dimension.count() { cells } else { 0 };
    let mut points = Vec::new();
    for k in range(2) {
        for j in range(1) {
            for i in range(0) {
                let at = DVec3::new(f64::from(i), f64::from(j), f64::from(k));
                let off = random.vector(jitter);
                let aside = random.vector(9.0);
                points.push(dimension.flatten(at + off) + aside - dimension.flatten(aside));
            }
        }
    }
    points
}

/// A polynomial of the order and its gradient.
fn polynomial(order: Order, dimension: Dimension, x: DVec3) -> (f64, DVec3) {
    let x = dimension.flatten(x);
    let (a, b) = (DVec3::new(0.7, -1.3, 0.4), DVec3::new(0.2, 0.3, -0.6));
    match order {
        Order::Constant => (1.7, DVec3::ZERO),
        Order::Linear => (1.7 + a.dot(x), dimension.flatten(a)),
        Order::Quadratic => (
            1.7 + a.dot(x) + b.dot(x).powi(2),
            dimension.flatten(a + b * (2.0 * b.dot(x))),
        ),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Polynomials of the basis come back with their gradient anywhere in the cloud, under the supports
    /// that the settings choose, in every order and dimension, wherever the cloud lies and at
    /// any scale; coordinates that the dimension does not have are ignored. So are constants: shape
    /// functions sum to one.
    #[test]
    fn polynomials_come_back_anywhere(
        seed in 0_u64..1000, jitter in 0.0..0.35_f64, size in scale(), shift in vector(3.0), turn in rotation(),
    ) {
        for dimension in DIMENSIONS {
            let cells = [40, 9, 6][dimension.count() - 1];
            let plain = lattice(dimension, cells, jitter, seed);
            let place = |x: DVec3| match dimension {
                Dimension::Three => turn * x * size + shift * size,
                _ => x * size + shift * size,
            };
            let points: Vec<DVec3> = plain.iter().map(|&x| place(x)).collect();
            let mut random = Random::new(seed + 1);
            for order in ORDERS {
                let cloud = Cloud::new(&points, &CloudSettings::new(order, dimension)).unwrap();
                let field: Vec<f64> =
                    plain.iter().map(|&x| polynomial(order, dimension, x).0).collect();
                for _ in 0..3 {
                    let half = 0.5 * f64::from(cells);
                    let x = random.vector(half) + half;
                    let found = cloud.sample(place(x), &field).unwrap();
                    let (value, slope) = polynomial(order, dimension, x);
                    let slope = match dimension {
                        Dimension::Three => turn * slope,
                        _ => slope,
                    };
                    let allowed = f64::EPSILON * found.condition * 640.0;
                    prop_assert!((found.value - value).abs() <= allowed * (1.0 + value.abs()));
                    let error = (found.gradient * size - slope).length();
                    prop_assert!(error <= allowed * (1.0 + value.abs() + slope.length()) * 10.0);
                    let alone = cloud.value(place(x), &field).unwrap();
                    prop_assert_eq!(alone.to_bits(), found.value.to_bits());
                }
            }
        }
    }

    /// The tree finds what looking at all nodes finds, on points of any spread and radii of any sizes,
    /// and the sums over them are those of the shape functions of all nodes.
    #[test]
    fn supports_are_those_of_brute_force(seed in 0_u64..1000, count in 1_usize..200) {
        let mut random = Random::new(seed);
        let points: Vec<DVec3> = (0..count).map(|_| random.vector(1.0)).collect();
        let radii: Vec<f64> = (0..count).map(|_| 10.0_f64.powf(random.range(-3.0, 0.5))).collect();
        let field: Vec<f64> = (0..count).map(|_| random.unit()).collect();
        for dimension in DIMENSIONS {
            let basis = Basis::polynomial(Order::Linear, dimension);
            let flat = flatten(&points, basis);
            let cloud = Cloud::build(flat, radii.clone(), basis).unwrap();
            let mut found = Vec::new();
            let all: Vec<u32> = (0..u32::try_from(count).unwrap()).collect();
            let whole = Approximation { nodes: &points, support_radii: &radii, basis };
            for _ in 0..20 {
                let x = random.vector(1.2);
                let held = |&j: &u32| {
                    dimension.flatten(x - points[j as usize]).length() < radii[j as usize]
                };
                let expected: Vec<u32> = all.iter().copied().filter(held).collect();
                cloud.supports_into(x, &mut found);
                prop_assert_eq!(&found, &expected);
                let (mut phi, mut slope) = (vec![0.0; count], vec![DVec3::ZERO; count]);
                let made = whole
                    .shape_functions_into(x, &all, &mut ShapeScratch::default(), &mut phi, &mut slope);
                match (made, cloud.sample(x, &field)) {
                    (Ok(condition), Ok(sample)) => {
                        let sum: f64 = phi.iter().zip(&field).map(|(p, u)| p * u).sum();
                        let slope = slope.iter().zip(&field).map(|(g, u)| *g * *u).sum::<DVec3>();
                        prop_assert!((sample.condition / condition - 1.0).abs() < 1e-6 * condition);
                        let size = f64::EPSILON * condition * 1e3;
                        prop_assert!((sample.value - sum).abs() <= size);
                        let rate = phi.iter().fold(1.0, |m: f64, p| m.max(p.abs()));
                        prop_assert!(
                            (sample.gradient - slope).length() <= size * rate * (slope.length() + 1e3)
                        );
                    }
                    (made, sample) => prop_assert_eq!(made.err(), sample.err()),
                }
            }
        }
    }
}

#[test]
fn many_points_answer_as_one_by_one_on_any_number_of_threads() {
    let points = lattice(Dimension::Three, 7, 0.3, 5);
    let field: Vec<f64> = points.iter().map(|x| x.length()).collect();
    let cloud = Cloud::new(&points, &CloudSettings::default()).unwrap();
    let mut random = Random::new(3);
    let asked: Vec<DVec3> = (0..500).map(|_| random.vector(9.0)).collect();
    let serial: Vec<_> = asked.iter().map(|&x| cloud.sample(x, &field)).collect();
    let values: Vec<_> = asked.iter().map(|&x| cloud.value(x, &field)).collect();
    assert!(serial.iter().any(Result::is_ok) && serial.iter().any(Result::is_err));
    for threads in [1, 2, 5] {
        let both = || (cloud.samples(&asked, &field), cloud.values(&asked, &field));
        let (samples, all) = testkit::on_threads(threads, both);
        assert_eq!(samples, serial);
        assert_eq!(all, values);
    }
}

/// No query inside the box of random points, corners included, lacks supports, nor is one worse than
/// what loses eight digits.
#[test]
fn chosen_supports_serve_random_points_everywhere() {
    for (dimension, count) in [(Dimension::Two, 1500), (Dimension::Three, 3000)] {
        for order in ORDERS {
            let mut random = Random::new(11);
            let points: Vec<DVec3> = (0..count).map(|_| random.vector(1.0)).collect();
            let cloud = Cloud::new(&points, &CloudSettings::new(order, dimension)).unwrap();
            let field = vec![1.0; count];
            let mut worst = 0.0_f64;
            let corners = (0..8).map(|c| {
                DVec3::new(f64::from(c & 1), f64::from(c >> 1 & 1), f64::from(c >> 2)) * 2.0 - 1.0
            });
            let asked: Vec<DVec3> = corners
                .chain((0..4000).map(|_| random.vector(1.0)))
                .collect();
            for (x, sample) in asked.iter().zip(cloud.samples(&asked, &field)) {
                let sample =
                    sample.unwrap_or_else(|e| panic!("{order:?} {dimension:?} at {x}: {e}"));
                worst = worst.max(sample.condition);
            }
            assert!(worst < 1e8, "{order:?} {dimension:?}: condition {worst:e}");
        }
    }
}

#[test]
fn bad_input_is_named() {
    let settings = CloudSettings::default();
    let bad = [DVec3::ZERO, DVec3::new(f64::NAN, 0.0, 0.0)];
    let refused = Cloud::new(&bad, &settings).unwrap_err();
    assert_eq!(refused, CloudError::NotFinite { point: 1 });
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let made = Cloud::new(&[DVec3::ZERO], &CloudSettings { scale, ..settings });
        assert!(made.is_err(), "scale {scale}");
    }
    let none = CloudSettings {
        nearest: 0,
        ..settings
    };
    let refused = Cloud::new(&[DVec3::ZERO], &none).unwrap_err();
    assert_eq!(refused, CloudError::NoNeighbors);
    let empty = Cloud::new(&[], &settings).unwrap_err();
    assert_eq!(empty, CloudError::Empty);
    let cloud = Cloud::new(&[DVec3::ZERO], &settings).unwrap();
    let lost = cloud.value(DVec3::splat(f64::NAN), &[1.0]);
    assert_eq!(lost, Err(ShapeError::NotFinite));
    let (found, needed) = (0, 10);
    let nothing = Err(ShapeError::TooFewNeighbors { found, needed });
    assert_eq!(cloud.value(DVec3::X * 3.0, &[1.0]), nothing);
    // Points in a plane do not tell z apart.
    let flat: Vec<DVec3> = lattice(Dimension::Two, 6, 0.0, 0)
        .iter()
        .map(|x| x.with_z(0.0))
        .collect();
    let linear = CloudSettings::new(Order::Linear, Dimension::Three);
    let cloud = Cloud::new(&flat, &linear).unwrap();
    let asked = cloud.value(DVec3::new(3.1, 2.9, 0.0), &vec![0.0; flat.len()]);
    assert_eq!(asked, Err(ShapeError::SingularMoment { function: 3 }));
}
