//! Every case in space: exactness, pieces, and the slow twin.

use std::f64::consts::TAU;

use glam::DVec3;

use super::shapes::{Lines, Strokes, curve, space};
use super::slow::{Cloud, cross3, inside, kernel};
use crate::{CutSettings, Cuts};

pub(crate) fn settings(cloud: &Cloud) -> CutSettings {
    CutSettings {
        weld_tolerance: 0.02 * cloud.radius,
        influence_radius: cloud.radius,
    }
}

pub(crate) fn cut(strokes: &Strokes, settings: &CutSettings) -> Cuts {
    let mut cuts = Cuts::new(settings);
    for blades in strokes {
        let stroke = cuts.start(&blades[0]).unwrap();
        for blade in &blades[1..] {
            cuts.append(stroke, blade).unwrap();
        }
        cuts.end(stroke).unwrap();
    }
    cuts
}

pub(crate) fn factors(cloud: &Cloud, cuts: &Cuts) -> Vec<f64> {
    let mut factors = cloud.factors();
    factors.update(&cloud.graph(), cuts, 0..cuts.triangle_count(), &inside);
    factors.to_vec()
}

/// All triangles of a case as loose corners.
pub(crate) fn soup(cuts: &Cuts) -> Vec<[DVec3; 3]> {
    let all = 0..cuts.triangle_count();
    all.map(|t| cuts.triangle(t)).collect()
}

/// Clouds are jittered, but where a cut is to run through nodes.
pub(crate) fn jitter(name: &str) -> f64 {
    if name.contains("through nodes") {
        0.0
    } else {
        0.25
    }
}

pub(crate) fn body(name: &str) -> Cloud {
    Cloud::lattice(12, 12, jitter(name), 2.2)
}

/// The rule for paths of one bend by loops over all triangles and all edges, in plain floating point.
///
/// Built on its own from the corners: nothing is shared with the crate but the statement of the rule.
struct Twin {
    triangles: Vec<[DVec3; 3]>,
    bends: Vec<(DVec3, DVec3, DVec3)>,
}

impl Twin {
    fn new(triangles: Vec<[DVec3; 3]>) -> Self {
        let mut bends: Vec<(DVec3, DVec3, DVec3)> = Vec::new();
        for t in &triangles {
            for k in 0..3 {
                let (p, q, r) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
                let along = (q - p).normalize();
                let inward = (r - p).reject_from_normalized(along).normalize();
                let same = |e: &&mut (DVec3, DVec3, DVec3)| {
                    (e.0 == p && e.1 == q) || (e.0 == q && e.1 == p)
                };
                match bends.iter_mut().find(same) {
                    Some(edge) => edge.2 += inward,
                    None => bends.push((p, q, inward)),
                }
            }
        }
        bends.retain(|e| e.2.length() >= 0.05);
        Self { triangles, bends }
    }

    fn crosses(&self, a: DVec3, b: DVec3) -> bool {
        self.triangles.iter().any(|&t| cross3(a, b, t))
    }

    fn factor(&self, a: DVec3, b: DVec3, h: f64) -> f64 {
        if !self.crosses(a, b) {
            return 1.0;
        }
        let mut paths: Vec<(f64, DVec3, DVec3)> = Vec::new();
        for &(p, q, inward) in &self.bends {
            // No path over the edge is shorter than the distances of both ends from it.
            let along = q - p;
            let distance = |end: DVec3| {
                let t = (end - p).dot(along) / along.length_squared();
                end.distance(p + t.clamp(0.0, 1.0) * along)
            };
            if distance(a) + distance(b) >= h {
                continue;
            }
            // Best point of the edge by golden section instead of the closed form.
            let path = |t: f64| {
                let at = p.lerp(q, t);
                a.distance(at) + at.distance(b)
            };
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..40 {
                let step = 0.381_966 * (high - low);
                let (m, n) = (low + step, high - step);
                if path(m) < path(n) {
                    high = n;
                } else {
                    low = m;
                }
            }
            let t = 0.5 * (low + high);
            paths.push((path(t), p.lerp(q, t), inward.normalize()));
        }
        paths.retain(|(length, ..)| *length < h);
        paths.sort_by(|x, y| x.0.total_cmp(&y.0));
        let free = paths.iter().find(|(_, at, inward)| {
            let outside = |share: f64| *at - share * h * *inward;
            let seen = |p: DVec3| !self.crosses(a, p) && !self.crosses(p, b);
            // Free outside, and right beside the edge too.
            inside(outside(0.05)) && seen(outside(0.05)) && seen(outside(5e-6))
        });
        let best = free.map_or(h, |(length, ..)| *length);
        kernel(best / h) / kernel(a.distance(b) / h)
    }
}

#[test]
fn equal_to_brute_force_in_any_case() {
    for (name, strokes, wanted) in space() {
        let cloud = body(&name);
        let cuts = cut(&strokes, &settings(&cloud));
        let found = factors(&cloud, &cuts);
        let twin = Twin::new(soup(&cuts));
        let through_nodes = name.contains("through nodes");
        let (mut crossed, mut severed, mut compared, mut borderline) = (0, 0, 0, 0);
        let mut longer = 0;
        for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
            crossed += usize::from(found[pair] < 1.0);
            severed += usize::from(found[pair] == 0.0);
            // Each pair once; of crossed pairs a third and of others a share, to keep the time.
            let share = if found[pair] < 1.0 { 3 } else { 31 };
            if i > j || through_nodes || pair % share != 0 {
                continue;
            }
            compared += 1;
            let expected = twin.factor(cloud.x[i], cloud.x[j], cloud.radius);
            let same = (expected >= 1.0) == (found[pair] >= 1.0);
            assert!(same, "{name}: {i} {j} {expected}");
            if found[pair] > expected + 1e-6 {
                // A path of more bends, which the tests of geodesics judge.
                longer += 1;
            } else if (expected - found[pair]).abs() > 1e-6 {
                // Two paths may differ when a bend's free point grazes another triangle.
                borderline += 1;
            }
        }
        if testkit::tol::print_residuals() {
            println!(
                "{name}: crossed {crossed}, severed {severed}, differ {borderline} of {compared}, {longer} of more bends"
            );
        }
        let few = borderline * 2000 <= compared;
        assert!(few, "{name}: {borderline} of {compared} differ");
        let sizes = cloud.piece_sizes(&found);
        let large = sizes.iter().filter(|&&s| s > 3).count();
        assert_eq!(large, wanted, "{name}: {sizes:?}");
    }
}

#[test]
fn upright_strips_have_the_true_geodesic_of_the_plane_extended_by_height() {
    // Full-height strips over a plane cut: the shortest path is sqrt(L² + dz²) with the plane's L.
    let mut cases: Vec<(String, Lines)> = Vec::new();
    for count in [12, 48] {
        let spiral = |turns: f64, low: f64, high: f64| {
            curve(count, |t| {
                let (sin, cos) = (turns * TAU * t).sin_cos();
                let r = low + (high - low) * t;
                [0.5 + r * cos, 0.5 + r * sin]
            })
        };
        for (turns, low, high) in [
            (2.0, 0.08, 0.38),
            (2.0, 0.02, 0.4),
            (1.0, 0.05, 0.2),
            (3.0, 0.1, 0.4),
            (0.5, 0.06, 0.06),
        ] {
            let name = format!("{turns} turns from {low} to {high} in {count}");
            cases.push((name, vec![spiral(turns, low, high)]));
        }
        let wave = curve(count, |t| [0.2 + 0.6 * t, 0.5 + 0.2 * (TAU * t).sin()]);
        cases.push((format!("wave in {count}"), vec![wave]));
    }
    for (name, lines, _) in super::shapes::plane() {
        let skipped = ["through nodes", "dust", "diced", "long line"];
        if !skipped.iter().any(|s| name.contains(s)) {
            cases.push((name.to_owned(), lines));
        }
    }
    let cloud = body("");
    for (name, lines) in cases {
        let errors = errors_of_extruded(&cloud, &lines);
        let squares: f64 = errors.iter().map(|error| error.powi(2)).sum();
        let count = errors.len();
        let rms = (squares / count.max(1) as f64).sqrt();
        if testkit::tol::print_residuals() {
            println!("{name}: rms of the weight {rms:.1e} over {count}");
        }
        assert!(rms <= 1e-4, "{name}: rms {rms}");
    }
}

/// Errors of the weights of every third pair that a cut crosses which goes straight up through the plane, against the
/// shortest path in the plane: of the weight itself, not of its ratio to the uncut weight.
fn errors_of_extruded(cloud: &Cloud, lines: &Lines) -> Vec<f64> {
    let strokes = super::shapes::extruded(lines, -0.3, 1.3);
    let cuts = cut(&strokes, &settings(cloud));
    let found = factors(cloud, &cuts);
    let planar = super::planar_cases::cut(lines, 0.02 * cloud.radius);
    let oracle = super::slow::VisibilityGraph::new(&super::planar_cases::segments(&planar));
    let mut errors = Vec::new();
    for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
        if found[pair] >= 1.0 || i > j || pair % 3 != 0 {
            continue;
        }
        let (a, b) = (cloud.x[i], cloud.x[j]);
        let flat = oracle.shortest(a.truncate(), b.truncate(), cloud.radius);
        let exact = kernel((flat.hypot(a.z - b.z) / cloud.radius).min(1.0));
        errors.push(found[pair] * kernel(a.distance(b) / cloud.radius) - exact);
    }
    errors
}
