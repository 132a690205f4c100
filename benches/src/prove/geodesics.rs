//! Factors around random and twisted strips against shortest paths that are searched, not derived.

use super::Proof;
use crate::problems::cracks::add_stroke;
use glam::DVec3;
use phyxel_enrich::{CutSettings, Cuts, FactorSettings, InfluenceRadius, PairFactors, Rows};
use testkit::cloud::{self, Random};

/// Weight over the distance relative to the influence radius.
fn kernel(q: f64) -> f64 {
    (1.0 - q * q).max(0.0).powi(3)
}

/// Inside of the unit cube.
fn inside(p: DVec3) -> bool {
    p.cmpge(DVec3::ZERO).all() && p.cmple(DVec3::ONE).all()
}

/// Whether `ab` crosses the triangle, in plain floating point.
fn crosses(a: DVec3, b: DVec3, [p, q, r]: [DVec3; 3]) -> bool {
    let n = (q - p).cross(r - p);
    let (da, db) = (n.dot(a - p), n.dot(b - p));
    if (da > 0.0) == (db > 0.0) {
        return false;
    }
    let at = a + (b - a) * (da / (da - db));
    let in_edge = |u: DVec3, v: DVec3| n.dot((v - u).cross(at - u)) >= 0.0;
    in_edge(p, q) && in_edge(q, r) && in_edge(r, p)
}

/// Nodes within 0.98 of the influence radius (m) of each other, cut by strips: the ends of each pair and its factor,
/// and the paths around the cut.
fn cut(
    x: &[DVec3],
    radius: f64,
    strips: &[Vec<Vec<DVec3>>],
) -> (Vec<(usize, usize, f64)>, SampledPaths) {
    let near = |i: u32, j: u32| x[i as usize].distance(x[j as usize]) < 0.98 * radius;
    let count = x.len() as u32;
    let edges = (0..count).flat_map(|i| (0..i).filter(move |&j| near(i, j)).map(move |j| [i, j]));
    let rows = Rows::from_edges(x.len(), edges).unwrap();
    let graph = rows.graph(x).unwrap();
    let settings = FactorSettings {
        influence_radius: InfluenceRadius::Length(radius),
        ..FactorSettings::default()
    };
    let mut factors = PairFactors::new(&graph, &settings);
    let mut cuts = Cuts::new(&CutSettings {
        weld_tolerance: 0.02 * radius,
        influence_radius: radius,
    });
    for strip in strips {
        add_stroke(&mut cuts, strip).unwrap();
    }
    factors.update(&graph, &cuts, 0..cuts.triangle_count(), &inside);
    let mut pairs = Vec::new();
    for i in 0..x.len() {
        for pair in rows.offsets()[i] as usize..rows.offsets()[i + 1] as usize {
            let j = rows.indices()[pair] as usize;
            if i < j {
                pairs.push((i, j, factors.factor(pair)));
            }
        }
    }
    let triangles = (0..cuts.triangle_count()).map(|t| cuts.triangle(t));
    (pairs, SampledPaths::new(triangles.collect(), radius))
}

/// Shortest paths in space around triangles over many points close to their edges.
///
/// Each edge of each triangle, whether the cut ends there or not, has points every `STEP` of the radius
/// along it and seven at each position around it, so that no two are on opposite sides: nothing is said of where a path may bend, nor how often.
struct SampledPaths {
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

impl SampledPaths {
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
        !self.triangles.iter().any(|&t| crosses(a, b, t))
    }

    /// Lengths of the shortest paths found with one bend, and with any number; infinite from `limit`.
    fn shortest(&self, a: DVec3, b: DVec3, limit: f64) -> [f64; 2] {
        // Triangles and stops within the ellipsoid of the limit.
        let is_local = |t: &&[DVec3; 3]| {
            let center = (t[0] + t[1] + t[2]) / 3.0;
            let size = t.map(|corner| corner.distance(center));
            let reach = 0.5 * limit + size[0].max(size[1]).max(size[2]);
            center.distance(a.midpoint(b)) < reach
        };
        let local: Vec<[DVec3; 3]> = self.triangles.iter().filter(is_local).copied().collect();
        let free = |a: DVec3, b: DVec3| !local.iter().any(|&t| crosses(a, b, t));
        let is_near = |s: &&Stop| s.at.distance(a) + s.at.distance(b) < limit;
        let near: Vec<Stop> = self.stops.iter().filter(is_near).copied().collect();
        let to_end: Vec<bool> = near.iter().map(|s| free(s.at, b)).collect();
        let from_start = |s: &Stop| {
            if free(a, s.at) {
                s.at.distance(a)
            } else {
                f64::INFINITY
            }
        };
        // Dijkstra 1959, by loops.
        let mut reached: Vec<f64> = near.iter().map(from_start).collect();
        let bends = (0..near.len()).filter(|&k| to_end[k] && reached[k].is_finite());
        let with_one = bends.map(|k| self.tight(&[near[k]], a, b, &free));
        let with_one = with_one.fold(f64::INFINITY, f64::min);
        let mut before = vec![None; near.len()];
        let mut done = vec![false; near.len()];
        let (mut best, mut best_sampled) = (with_one, f64::INFINITY);
        // Of the sampled paths those a little longer than the best may be the best when tightened.
        let is_short = |length: f64, k: usize, best_sampled: f64| {
            length + near[k].at.distance(b) < (best_sampled + 0.02 * limit).min(limit)
        };
        while let Some(k) = (0..near.len())
            .filter(|&k| !done[k] && is_short(reached[k], k, best_sampled))
            .min_by(|&k, &m| reached[k].total_cmp(&reached[m]))
        {
            done[k] = true;
            if to_end[k] {
                best_sampled = best_sampled.min(reached[k] + near[k].at.distance(b));
                let stops = std::iter::successors(Some(k), |&k| before[k]);
                let mut path: Vec<Stop> = stops.map(|k| near[k]).collect();
                path.reverse();
                best = best.min(self.tight(&path, a, b, &free));
            }
            for m in 0..near.len() {
                let length = reached[k] + near[k].at.distance(near[m].at);
                let nearer = !done[m] && length < reached[m];
                if nearer && is_short(length, m, best_sampled) && free(near[k].at, near[m].at) {
                    reached[m] = length;
                    before[m] = Some(k);
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

/// Weights of all pairs of random clouds that random strips cross, against the shortest paths.
pub(super) fn geodesics_random(proof: &mut Proof) {
    let radius = 0.22;
    let (mut count, mut severed, mut wrong, mut leaks) = (0.0, 0.0, 0.0, 0.0);
    // Squares of errors of the weight: what is found, and the best of one bend.
    let mut squares = [0.0; 2];
    let mut above = 0.0_f64;
    for seed in 0..24 {
        let mut random = Random::new(1000 + seed);
        let x = cloud::uniform(500, 0.5, 77 + seed);
        let x: Vec<DVec3> = x.into_iter().map(|p| p + DVec3::splat(0.5)).collect();
        // Two strips in every third case: they may cross, meet or miss each other.
        let strips: Vec<_> = (0..1 + usize::from(seed % 3 == 0))
            .map(|_| strip(&mut random, radius))
            .collect();
        let (pairs, paths) = cut(&x, radius, &strips);
        for (i, j, factor) in pairs {
            let (a, b) = (x[i], x[j]);
            wrong += f64::from(u8::from(paths.free(a, b) != (factor >= 1.0)));
            if factor >= 1.0 {
                continue;
            }
            count += 1.0;
            let [one, any] = paths.shortest(a, b, 1.02 * radius);
            if any > 1.01 * radius {
                severed += 1.0;
                leaks += f64::from(u8::from(factor > 0.0));
            }
            // The weight itself, not its ratio to the uncut weight.
            let weight = factor * kernel(a.distance(b) / radius);
            let [one, any] = [one, any].map(|l| kernel((l / radius).min(1.0)));
            above = above.max(weight - any);
            squares[0] += (weight - any).powi(2);
            squares[1] += (one - any).powi(2);
        }
    }
    proof.above("pairs that are crossed", count, 1500.0);
    proof.above("pairs without a path", severed, 200.0);
    proof.within("pairs wrongly crossed or missed", wrong, 0.0, 0.0);
    proof.within("pairs without a path that are coupled", leaks, 0.0, 0.0);
    // A path that is found is there; the sampled one may be a little longer.
    proof.below("weight above the sampled path's", above, 0.01);
    let [rms, of_one_bend] = squares.map(|s: f64| (s / count).sqrt());
    proof.below("rms of the weight", rms, 2e-3);
    // Crumpled strips, a kink at every step of 0.7 of the radius: paths of one bend are not enough.
    proof.above("rms of paths of one bend", of_one_bend, 5e-3);
}

/// The same of a fraction of the pairs that twisted strips cross.
pub(super) fn geodesics_twisted(proof: &mut Proof) {
    let turns = [
        (90.0, 16),
        (180.0, 16),
        (360.0, 16),
        (360.0, 40),
        (720.0, 32),
    ];
    for (turn, blades) in turns {
        let blade = |k: u32| {
            let t = f64::from(k) / f64::from(blades);
            let (sin, cos) = (f64::to_radians(turn) * t).sin_cos();
            let arm = DVec3::new(0.0, 0.35 * cos, 0.35 * sin);
            let middle = DVec3::new(0.05 + 0.9 * t, 0.5, 0.5);
            vec![middle - arm, middle + arm]
        };
        let x = cloud::lattice([12; 3], 1.0, 0.25, 11);
        let x: Vec<DVec3> = x.iter().map(|p| (*p + DVec3::splat(0.5)) / 12.0).collect();
        let radius = 2.2 / 12.0;
        let (pairs, paths) = cut(&x, radius, &[(0..=blades).map(blade).collect()]);
        let (mut squares, mut count) = (0.0, 0.0);
        let crossed = pairs.into_iter().filter(|(.., factor)| *factor < 1.0);
        for (i, j, factor) in crossed.step_by(19) {
            let (a, b) = (x[i], x[j]);
            let [_, any] = paths.shortest(a, b, 1.01 * radius);
            let weight = factor * kernel(a.distance(b) / radius);
            squares += (weight - kernel((any / radius).min(1.0))).powi(2);
            count += 1.0;
        }
        let rms = f64::sqrt(squares / count);
        let what = format!("twist of {turn} in {blades}: rms of the weight");
        proof.below(what, rms, 2e-3);
    }
}
