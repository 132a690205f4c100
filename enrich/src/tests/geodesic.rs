//! Random strips through random clouds against shortest paths that are searched, not derived.

use glam::DVec3;
use testkit::cloud::{self, Random};

use super::slow::{Cloud, cross3, inside, kernel};
use super::space_cases::{cut, factors, settings};
use crate::face::nearest_on_triangle;

/// Shortest paths in space around triangles over many points close to their edges.
///
/// Each edge of each triangle, whether the cut ends there or not, has points every `STEP` of the radius
/// along it and seven at each place around it, so that no two are on opposite sides: nothing is said of where a path may bend, nor how often.
struct SampledWays {
    triangles: Vec<[DVec3; 3]>,
    edges: Vec<[DVec3; 2]>,
    stops: Vec<Stop>,
}

/// A point beside an edge.
#[derive(Clone, Copy)]
struct Stop {
    at: DVec3,
    edge: usize,
    /// From the edge to the point.
    beside: DVec3,
}

const STEP: f64 = 0.08;
/// Distance of a stop from its edge, relative to the radius.
const BESIDE: f64 = 1e-5;

impl SampledWays {
    fn new(triangles: Vec<[DVec3; 3]>, radius: f64) -> Self {
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
        for (edge, &[p, q]) in edges.iter().enumerate() {
            let u = (q - p).normalize().any_orthonormal_vector();
            let v = (q - p).normalize().cross(u);
            let count = (p.distance(q) / (STEP * radius)).ceil() as u32;
            for k in 0..=count {
                let at = p.lerp(q, f64::from(k) / f64::from(count));
                for turn in 0..7 {
                    let (s, c) = (f64::from(turn) * std::f64::consts::TAU / 7.0 + 0.1).sin_cos();
                    let beside = BESIDE * radius * (c * u + s * v);
                    let at = at + beside;
                    if inside(at) {
                        stops.push(Stop { at, edge, beside });
                    }
                }
            }
        }
        Self {
            triangles,
            edges,
            stops,
        }
    }

    fn free(&self, a: DVec3, b: DVec3) -> bool {
        !self.triangles.iter().any(|&t| cross3(a, b, t))
    }

    /// Lengths of the shortest paths found with one bend, and with any number; infinite from `limit`.
    fn shortest(&self, a: DVec3, b: DVec3, limit: f64) -> [f64; 2] {
        // Triangles and stops within the ellipsoid of the limit.
        let middle = a.midpoint(b);
        let local: Vec<[DVec3; 3]> = self
            .triangles
            .iter()
            .copied()
            .filter(|&t| nearest_on_triangle(t, middle).distance(middle) < 0.5 * limit)
            .collect();
        let free = |a: DVec3, b: DVec3| !local.iter().any(|&t| cross3(a, b, t));
        let near: Vec<Stop> = self
            .stops
            .iter()
            .copied()
            .filter(|s| s.at.distance(a) + s.at.distance(b) < limit)
            .collect();
        let to_end: Vec<bool> = near.iter().map(|s| free(s.at, b)).collect();
        let from_start: Vec<bool> = near.iter().map(|s| free(a, s.at)).collect();
        // Dijkstra 1959, by loops.
        let mut reached: Vec<f64> = (near.iter().zip(&from_start))
            .map(|(s, &seen)| {
                if seen {
                    s.at.distance(a)
                } else {
                    f64::INFINITY
                }
            })
            .collect();
        let mut with_one = f64::INFINITY;
        for k in (0..near.len()).filter(|&k| to_end[k] && from_start[k]) {
            let way = self.tight(&[near[k]], a, b, &free);
            with_one = with_one.min(way);
        }
        let mut before = vec![usize::MAX; near.len()];
        let mut done = vec![false; near.len()];
        // Of the sampled paths those a little longer than the best may be the best when tightened.
        let (mut best, mut best_sampled) = (with_one, f64::INFINITY);
        while let Some(k) = (0..near.len())
            .filter(|&k| {
                !done[k]
                    && reached[k] + near[k].at.distance(b)
                        < (best_sampled + 0.02 * limit).min(limit)
            })
            .min_by(|&k, &m| reached[k].total_cmp(&reached[m]))
        {
            done[k] = true;
            if to_end[k] {
                best_sampled = best_sampled.min(reached[k] + near[k].at.distance(b));
                let (mut path, mut at) = (vec![], k);
                while at != usize::MAX {
                    path.push(near[at]);
                    at = before[at];
                }
                path.reverse();
                best = best.min(self.tight(&path, a, b, &free));
            }
            for m in 0..near.len() {
                let length = reached[k] + near[k].at.distance(near[m].at);
                if !done[m]
                    && length < reached[m]
                    && length + near[m].at.distance(b) < (best_sampled + 0.02 * limit).min(limit)
                    && free(near[k].at, near[m].at)
                {
                    reached[m] = length;
                    before[m] = k;
                }
            }
        }
        [with_one, best].map(|l| if l < limit { l } else { f64::INFINITY })
    }

    /// Length of a path whose stops are moved along their edges, halving steps, as long as that makes it
    /// shorter and leaves it free.
    fn tight(&self, path: &[Stop], a: DVec3, b: DVec3, free: &dyn Fn(DVec3, DVec3) -> bool) -> f64 {
        let mut points: Vec<DVec3> = path.iter().map(|s| s.at).collect();
        let ends = |points: &[DVec3], k: usize| {
            let last = if k == 0 { a } else { points[k - 1] };
            (last, points.get(k + 1).copied().unwrap_or(b))
        };
        let mut step = 0.5 * STEP;
        while step > 1e-4 {
            for k in 0..points.len() {
                let [p, q] = self.edges[path[k].edge];
                let (last, next) = ends(&points, k);
                let size = p.distance(q);
                let t = (points[k] - path[k].beside - p).dot(q - p) / (size * size);
                for move_by in [step, -step] {
                    let t = (t + move_by / size).clamp(0.0, 1.0);
                    let to = p.lerp(q, t) + path[k].beside;
                    if last.distance(to) + to.distance(next)
                        < last.distance(points[k]) + points[k].distance(next)
                        && free(last, to)
                        && free(to, next)
                    {
                        points[k] = to;
                    }
                }
            }
            step *= 0.7;
        }
        let mut length = 0.0;
        for k in 0..points.len() {
            length += ends(&points, k).0.distance(points[k]);
        }
        length + points[points.len() - 1].distance(b)
    }
}

/// A strip that wanders: steps and blades turn at random, long enough to leave the body or not.
fn strip(random: &mut Random, radius: f64) -> Vec<Vec<DVec3>> {
    let mut at = DVec3::splat(0.5) + random.vector(0.3);
    let mut along = random.vector(1.0).normalize();
    let mut blade = along.any_orthonormal_vector();
    let width = radius * (0.8 + 3.0 * random.vector(0.5).x.abs());
    let mut blades = Vec::new();
    for _ in 0..3 + random.bits() % 5 {
        blades.push(vec![at, at + width * blade]);
        at += radius * (0.7 + random.vector(0.3).x) * along;
        along = (along + random.vector(0.5)).normalize();
        blade = (blade + random.vector(0.3)).normalize();
    }
    blades
}

#[test]
fn random_strips_through_random_clouds_match_sampled_shortest_ways() {
    let radius = 0.22;
    let (mut count, mut severed) = (0_u32, 0);
    // Squares of errors of the weight: what is found, the best of one bend, and no path around at all.
    let mut squares = [0.0; 3];
    for seed in 0..24 {
        let mut random = Random::new(1000 + seed);
        let x = cloud::uniform(500, 0.5, 77 + seed)
            .into_iter()
            .map(|p| p + DVec3::splat(0.5))
            .collect();
        let cloud = Cloud::joined(x, radius);
        // Two strips in every third case: they may cross, meet or miss each other.
        let strokes: Vec<_> = (0..1 + usize::from(seed % 3 == 0))
            .map(|_| strip(&mut random, radius))
            .collect();
        let cuts = cut(&strokes, &settings(&cloud));
        let found = factors(&cloud, &cuts);
        let triangles = (0..cuts.triangle_count()).map(|t| cuts.triangle(t));
        let ways = SampledWays::new(triangles.collect(), radius);
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
            let [one, any] = ways.shortest(a, b, 1.02 * radius);
            if any > 1.01 * radius {
                severed += 1;
                assert!(pair == 0.0, "seed {seed}: {i} {j} leak {pair}");
            }
            // The weight itself, not its ratio to the uncut weight.
            let weight = pair * kernel(a.distance(b) / radius);
            let [one, any] = [one, any].map(|l| kernel((l / radius).min(1.0)));
            // A path that is found is there; the sampled one may be a little longer.
            assert!(weight < any + 0.01, "seed {seed}: {i} {j} {weight} > {any}");
            squares[0] += (weight - any).powi(2);
            squares[1] += (one - any).powi(2);
            squares[2] += any.powi(2);
        }
    }
    let rms = squares.map(|s| (s / f64::from(count)).sqrt());
    if testkit::tol::print_residuals() {
        println!("{count} crossed, {severed} severed: rms {rms:.5?}");
    }
    assert!(count > 1500 && severed > 200, "{count} {severed}");
    // Crumpled strips, a kink at every step of 0.7 of the radius: paths of one bend are not enough.
    assert!(rms[0] <= 2e-3 && rms[1] > 5e-3, "{rms:?}");
}

/// Root of the mean square of the weight's error, and the largest error, for a share of the crossed pairs.
fn twisted(turn: f64, blades: u32, share: usize) -> ([f64; 2], f64, usize) {
    let blade = |k: u32| {
        let t = f64::from(k) / f64::from(blades);
        let (sin, cos) = (turn * t).sin_cos();
        let arm = DVec3::new(0.0, 0.35 * cos, 0.35 * sin);
        let mid = DVec3::new(0.05 + 0.9 * t, 0.5, 0.5);
        vec![mid - arm, mid + arm]
    };
    let cloud = Cloud::lattice(12, 12, 0.25, 2.2);
    let cuts = cut(&vec![(0..=blades).map(blade).collect()], &settings(&cloud));
    let found = factors(&cloud, &cuts);
    let triangles = (0..cuts.triangle_count()).map(|t| cuts.triangle(t));
    let ways = SampledWays::new(triangles.collect(), cloud.radius);
    let (mut squares, mut most, mut count) = ([0.0; 2], 0.0_f64, 0);
    for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
        if found[pair] >= 1.0 || i > j || pair % share != 0 {
            continue;
        }
        let (a, b) = (cloud.x[i], cloud.x[j]);
        let lengths = ways.shortest(a, b, 1.01 * cloud.radius);
        let [one, any] = lengths.map(|l| kernel((l / cloud.radius).min(1.0)));
        let weight = found[pair] * kernel(a.distance(b) / cloud.radius);
        squares[0] += (weight - any).powi(2);
        squares[1] += (one - any).powi(2);
        if (weight - any).abs() > 5e-3 && testkit::tol::print_residuals() {
            println!("{turn:.2}: {i} {j} {weight:.4} one {one:.4} any {any:.4}");
        }
        most = most.max((weight - any).abs());
        count += 1;
    }
    (squares.map(|s| (s / count as f64).sqrt()), most, count)
}

#[test]
fn ways_round_twisted_strips_are_the_shortest_of_any_number_of_points() {
    for (turn, blades) in [
        (90.0, 16),
        (180.0, 16),
        (360.0, 16),
        (360.0, 40),
        (720.0, 32),
    ] {
        let (rms, most, count) = twisted(f64::to_radians(turn), blades, 19);
        if testkit::tol::print_residuals() {
            println!(
                "twist of {turn}, {blades} blades: rms {rms:.5?}, most {most:.4} over {count}"
            );
        }
        assert!(rms[0] <= 2e-3, "twist of {turn}: rms {rms:?}");
    }
}
