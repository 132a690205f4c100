//! Random strips through random clouds against shortest ways that are searched, not derived.

use glam::DVec3;
use testkit::cloud::{self, Random};

use super::slow::{Cloud, cross3, inside, kernel};
use super::space_cases::{cut, factors, settings};

/// Shortest ways in space round triangles over many points close to their edges.
///
/// Each edge of each triangle, whether the cut ends there or not, has points every `STEP` of the reach
/// along it and eight at each place round it: nothing is said of where a way may bend, nor how often.
struct SampledWays {
    triangles: Vec<[DVec3; 3]>,
    stops: Vec<DVec3>,
}

const STEP: f64 = 0.08;
/// Distance of a stop from its edge, relative to the reach.
const BESIDE: f64 = 1e-5;

impl SampledWays {
    fn new(triangles: Vec<[DVec3; 3]>, reach: f64) -> Self {
        let mut edges: Vec<[DVec3; 2]> = Vec::new();
        for t in &triangles {
            for k in 0..3 {
                let (p, q) = (t[k], t[(k + 1) % 3]);
                if !edges.contains(&[p, q]) && !edges.contains(&[q, p]) {
                    edges.push([p, q]);
                }
            }
        }
        let mut stops = Vec::new();
        for [p, q] in edges {
            let u = (q - p).normalize().any_orthonormal_vector();
            let v = (q - p).normalize().cross(u);
            let count = (p.distance(q) / (STEP * reach)).ceil() as u32;
            for k in 0..=count {
                let at = p.lerp(q, f64::from(k) / f64::from(count));
                for turn in 0..8 {
                    let (s, c) = (f64::from(turn) * std::f64::consts::FRAC_PI_4 + 0.1).sin_cos();
                    let stop = at + BESIDE * reach * (c * u + s * v);
                    if inside(stop) {
                        stops.push(stop);
                    }
                }
            }
        }
        Self { triangles, stops }
    }

    fn free(&self, a: DVec3, b: DVec3) -> bool {
        !self.triangles.iter().any(|&t| cross3(a, b, t))
    }

    /// Lengths of the shortest ways found with one bend, and with up to three; infinite from `limit`.
    fn shortest(&self, a: DVec3, b: DVec3, limit: f64) -> [f64; 2] {
        // Stops within the ellipsoid of the limit, by the length of the way so far.
        let near: Vec<DVec3> = self
            .stops
            .iter()
            .copied()
            .filter(|s| s.distance(a) + s.distance(b) < limit)
            .collect();
        let (mut best, mut with_one) = (f64::INFINITY, f64::INFINITY);
        let mut reached: Vec<f64> = near
            .iter()
            .map(|&s| {
                if self.free(a, s) {
                    s.distance(a)
                } else {
                    f64::INFINITY
                }
            })
            .collect();
        let to_end: Vec<bool> = near.iter().map(|&s| self.free(s, b)).collect();
        for bends in 1..=3 {
            for (k, &s) in near.iter().enumerate() {
                if to_end[k] {
                    best = best.min(reached[k] + s.distance(b));
                }
            }
            if bends == 1 {
                with_one = best;
            }
            if bends == 3 {
                break;
            }
            let before = reached.clone();
            for (m, &t) in near.iter().enumerate() {
                for (k, &s) in near.iter().enumerate() {
                    let length = before[k] + s.distance(t);
                    let useful = length < reached[m] && length + t.distance(b) < best.min(limit);
                    if useful && self.free(s, t) {
                        reached[m] = length;
                    }
                }
            }
        }
        [with_one, best].map(|l| if l < limit { l } else { f64::INFINITY })
    }
}

/// A strip that wanders: steps and blades turn at random, long enough to leave the body or not.
fn strip(random: &mut Random, reach: f64) -> Vec<Vec<DVec3>> {
    let mut at = DVec3::splat(0.5) + random.vector(0.3);
    let mut along = random.vector(1.0).normalize();
    let mut blade = along.any_orthonormal_vector();
    let width = reach * (0.8 + 3.0 * random.vector(0.5).x.abs());
    let mut blades = Vec::new();
    for _ in 0..3 + random.bits() % 5 {
        blades.push(vec![at, at + width * blade]);
        at += reach * (0.7 + random.vector(0.3).x) * along;
        along = (along + random.vector(0.5)).normalize();
        blade = (blade + random.vector(0.3)).normalize();
    }
    blades
}

#[test]
fn random_strips_through_random_clouds_match_sampled_shortest_ways() {
    let reach = 0.22;
    let (mut count, mut severed, mut apart) = (0_u32, 0, 0);
    // Squares of the weight's error: against one bend, any bends, and of no way round at all.
    let mut squares = [0.0; 3];
    for seed in 0..24 {
        let mut random = Random::new(1000 + seed);
        let x = cloud::uniform(500, 0.5, 77 + seed)
            .into_iter()
            .map(|p| p + DVec3::splat(0.5))
            .collect();
        let cloud = Cloud::joined(x, reach);
        // Two strips in every third case: they may cross, meet or miss each other.
        let strokes: Vec<_> = (0..1 + usize::from(seed % 3 == 0))
            .map(|_| strip(&mut random, reach))
            .collect();
        let cuts = cut(&strokes, &settings(&cloud));
        let found = factors(&cloud, &cuts);
        let triangles = (0..cuts.triangle_count()).map(|t| cuts.triangle(t));
        let ways = SampledWays::new(triangles.collect(), reach);
        for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
            if i > j {
                continue;
            }
            let (a, b) = (cloud.x[i], cloud.x[j]);
            let pair = found[pair];
            assert_eq!(ways.free(a, b), pair >= 1.0, "seed {seed}: {i} {j}");
            if pair >= 1.0 {
                continue;
            }
            count += 1;
            let [one, any] = ways.shortest(a, b, 1.02 * reach);
            if any > 1.01 * reach {
                severed += 1;
                assert!(pair == 0.0, "seed {seed}: {i} {j} leak {pair}");
            }
            // The weight itself, not its ratio to the uncut weight.
            let weight = pair * kernel(a.distance(b) / reach);
            let [one, any] = [one, any].map(|l| kernel((l / reach).min(1.0)));
            // Above the true one only by what the bend's free point, beside the edge, sees more.
            assert!(weight < any + 0.03, "seed {seed}: {i} {j} {weight} > {any}");
            apart += u32::from((weight - one).abs() > 0.02);
            squares[0] += (weight - one).powi(2);
            squares[1] += (weight - any).powi(2);
            squares[2] += any.powi(2);
        }
    }
    let rms = squares.map(|s| (s / f64::from(count)).sqrt());
    if testkit::tol::print_residuals() {
        println!("{count} crossed, {severed} severed: rms {rms:.4?}, {apart} apart");
    }
    assert!(count > 1500 && severed > 200, "{count} {severed}");
    // The same as the shortest sampled way of one bend but for single pairs.
    assert!(rms[0] < 0.02 && apart * 100 < count, "{rms:?} {apart}");
    // Ways of more bends are not found: over crumpled strips, a kink at every step of 0.7 reach, the
    // pairs that they would couple are too weak. Nearer than without any way all the same.
    assert!(rms[1] < 0.1 && rms[1] < 0.7 * rms[2], "{rms:?}");
}
