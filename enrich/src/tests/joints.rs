//! Sheets that stop on, short of or a little behind the faces of older ones.

use glam::DVec3;
use testkit::cloud::Random;

use super::slow::{Cloud, inside};
use crate::{CutSettings, Cuts, PairFactors};

/// How the older sheet lies: a height y over the plane x, z.
#[derive(Clone, Copy, Debug)]
enum Floor {
    Plane,
    Wavy,
    Roof,
}

impl Floor {
    fn height(self, x: f64, z: f64) -> f64 {
        match self {
            Self::Plane => 0.42 + 0.1 * x - 0.05 * z,
            Self::Wavy => 0.42 + 0.04 * (7.0 * x).sin() * (6.0 * z).cos(),
            Self::Roof => 0.45 - 0.15 * (x - 0.5).abs(),
        }
    }

    fn sheet(self, cuts: &mut Cuts) {
        let edge = |k: u32| -> Vec<DVec3> {
            let x = -0.1 + f64::from(k) / 15.0;
            let place = |m: u32| {
                let z = -0.1 + f64::from(m) / 15.0;
                DVec3::new(x, self.height(x, z), z)
            };
            (0..=18).map(place).collect()
        };
        let stroke = cuts.start(&edge(0)).unwrap();
        for k in 1..=18 {
            cuts.append(stroke, &edge(k)).unwrap();
        }
        cuts.end(stroke).unwrap();
    }
}

/// Pairs above the floor, on different sides of an upright sheet at `x` that leans by `lean`, which
/// are still coupled.
fn leaks(
    cloud: &Cloud,
    floor: Floor,
    (x, lean): (f64, f64),
    factors: &PairFactors,
) -> (usize, usize) {
    let from_sheet = |p: DVec3| (p.x - x - lean * (p.y - 0.45)) / f64::hypot(1.0, lean);
    let side = |p: DVec3| from_sheet(p) > 0.0;
    // Joining moves the sheet's end by up to the tolerance, a tenth of the spacing: nodes so near to it
    // may change sides.
    let above = |p: DVec3| p.y > floor.height(p.x, p.z) + 0.01 && from_sheet(p).abs() > 0.11 / 12.0;
    let found = factors.to_vec();
    let (mut leaks, mut apart) = (0, 0);
    for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
        let (a, b) = (cloud.x[i], cloud.x[j]);
        if i < j && above(a) && above(b) && side(a) != side(b) {
            apart += 1;
            leaks += usize::from(found[pair] > 0.0);
        }
    }
    (leaks, apart)
}

#[test]
fn a_sheet_that_stops_within_the_tolerance_of_a_face_joins_it() {
    let cloud = Cloud::lattice(12, 12, 0.25, 2.2);
    let settings = CutSettings::for_spacing(1.0 / 12.0);
    let tolerance = settings.weld_tolerance;
    let mut random = Random::new(21);
    let (mut cases, mut leaking) = (0_u32, 0);
    for floor in [Floor::Plane, Floor::Wavy, Floor::Roof] {
        // The older sheets' triangles are up to 0.1 of the tolerance below their heights.
        for gap in [0.85, 0.5, 0.1, 1e-9, 0.0, -1e-9, -0.3] {
            for lean in [0.0, 0.4, -1.2] {
                // Each in one of the two directions.
                for down in [cases % 2 == 0] {
                    let x = 0.45 + 0.15 * random.unit();
                    let mut cuts = Cuts::new(&settings);
                    floor.sheet(&mut cuts);
                    let steepness = f64::hypot(1.0, lean);
                    // Edges of pieces of a spacing, from above the body to short of the floor; or up from
                    // there.
                    let edge = |share: f64| -> Vec<DVec3> {
                        let place = |m: u32| {
                            let z = -0.1 + f64::from(m) / 15.0 + 0.013;
                            let bottom = |y: f64| x + lean * (y - 0.45);
                            // Where the leaning line meets the floor.
                            let mut y = 0.45;
                            for _ in 0..60 {
                                y = 0.5 * (y + floor.height(bottom(y), z));
                            }
                            let y = y + gap * tolerance / steepness;
                            let y = y + share * (1.15 - y);
                            DVec3::new(bottom(y), y, z)
                        };
                        (0..=18).map(place).collect()
                    };
                    let shares = [1.0, 0.6, 0.3, 0.1, 0.0];
                    let mut factors = cloud.factors();
                    let end = cuts.triangle_count();
                    factors.update(&cloud.graph(), &cuts, 0..end, &inside);
                    let order: Vec<f64> = if down {
                        shares.to_vec()
                    } else {
                        shares.iter().rev().copied().collect()
                    };
                    let stroke = cuts.start(&edge(order[0])).unwrap();
                    for &share in &order[1..] {
                        let new = cuts.append(stroke, &edge(share)).unwrap();
                        factors.update(&cloud.graph(), &cuts, new, &inside);
                    }
                    let (leaks, apart) = leaks(&cloud, floor, (x, lean), &factors);
                    assert!(apart > 200, "{apart}");
                    cases += 1;
                    leaking += usize::from(leaks > 0);
                    if leaks > 0 && testkit::tol::print_residuals() {
                        println!(
                            "{floor:?}, gap {gap}, lean {lean}, {}: {leaks} of {apart} pairs leak",
                            if down { "down" } else { "up" }
                        );
                    }
                }
            }
        }
    }
    if testkit::tol::print_residuals() {
        println!("{leaking} of {cases} joints leak");
    }
    assert_eq!((leaking, cases), (0, 63));
}

#[test]
fn strokes_have_tolerances_of_their_own() {
    let blade = |x: f64| [DVec3::new(x, 0.0, 0.0), DVec3::new(x, 0.0, 1.0)];
    for (tolerance, vertices) in [(0.01, 8), (0.2, 6)] {
        let mut cuts = Cuts::new(&CutSettings::for_spacing(0.1));
        let first = cuts.start(&blade(0.0)).unwrap();
        cuts.append(first, &blade(1.0)).unwrap();
        let second = cuts.start_within(&blade(1.1), tolerance).unwrap();
        cuts.append(second, &blade(2.0)).unwrap();
        assert_eq!(cuts.surface().0.len(), vertices, "{tolerance}");
        // The first is open still, and has kept its own.
        cuts.append(first, &blade(1.05)).unwrap();
        assert_eq!(cuts.surface().0.len(), vertices + 2, "{tolerance}");
    }
}
