//! Slow references: the rule by loops over everything, and true shortest paths.

use glam::{DVec2, DVec3};
use testkit::cloud;

use crate::{FactorSettings, Graph, InfluenceRadius, PairFactors, Rule, connected_pieces};

/// Nodes, rows and the influence radius of a test cloud.
pub(crate) struct Cloud {
    pub(crate) x: Vec<DVec3>,
    pub(crate) offsets: Vec<u32>,
    pub(crate) indices: Vec<u32>,
    pub(crate) radius: f64,
}

impl Cloud {
    /// Cell centres of a lattice of the unit square (`depth` 1) or cube, jittered, joined within
    /// 0.98 of the radius.
    pub(crate) fn lattice(n: usize, depth: usize, jitter: f64, radius: f64) -> Self {
        let spacing = 1.0 / n as f64;
        let mut x = cloud::lattice([n, n, depth], 1.0, jitter, 11);
        for p in &mut x {
            *p = (*p + DVec3::splat(0.5)) * spacing;
            if depth == 1 {
                p.z = 0.0;
            }
        }
        Self::joined(x, radius * spacing)
    }

    /// A block of 7 x 7 x 7 nodes, one apart, about the origin.
    pub(crate) fn block() -> Self {
        let at = |k: u32| f64::from(k) - 3.0;
        let nodes = (0..343).map(|k| DVec3::new(at(k % 7), at(k / 7 % 7), at(k / 49)));
        Self::joined(nodes.collect(), 1.9)
    }

    pub(crate) fn joined(x: Vec<DVec3>, radius: f64) -> Self {
        let (mut offsets, mut indices) = (vec![0], Vec::new());
        for (i, p) in x.iter().enumerate() {
            for (j, q) in x.iter().enumerate() {
                if i != j && p.distance(*q) < 0.98 * radius {
                    indices.push(j as u32);
                }
            }
            offsets.push(indices.len() as u32);
        }
        Self {
            x,
            offsets,
            indices,
            radius,
        }
    }

    pub(crate) fn graph(&self) -> Graph<'_> {
        Graph::new(&self.x, &self.offsets, &self.indices).unwrap()
    }

    /// Factors before any cut.
    pub(crate) fn factors(&self) -> PairFactors {
        let settings = FactorSettings {
            influence_radius: InfluenceRadius::Length(self.radius),
            rule: Rule::Diffraction,
        };
        PairFactors::new(&self.graph(), &settings)
    }

    /// Sizes of the pieces that factors leave.
    pub(crate) fn piece_sizes(&self, factors: &[f64]) -> Vec<u32> {
        connected_pieces(&self.offsets, &self.indices, factors).sizes
    }

    /// Directed pairs as `(i, j)`, in the order of the graph.
    pub(crate) fn pairs(&self) -> Vec<(usize, usize)> {
        let rows = self.offsets.windows(2).enumerate();
        let row = |(i, row): (usize, &[u32])| {
            let row = &self.indices[row[0] as usize..row[1] as usize];
            row.iter().map(move |&j| (i, j as usize))
        };
        rows.flat_map(row).collect()
    }
}

pub(crate) fn kernel(q: f64) -> f64 {
    (1.0 - q * q).max(0.0).powi(3)
}

/// Inside of the unit square or cube.
pub(crate) fn inside(p: DVec3) -> bool {
    p.cmpge(DVec3::ZERO).all() && p.cmple(DVec3::ONE).all()
}

/// Whether `ab` crosses `pq`, in plain floating point; for points in general position.
pub(crate) fn cross2(a: DVec2, b: DVec2, p: DVec2, q: DVec2) -> bool {
    let side = |u: DVec2, v: DVec2, w: DVec2| (v - u).perp_dot(w - u) > 0.0;
    side(p, q, a) != side(p, q, b) && side(a, b, p) != side(a, b, q)
}

/// Whether `ab` crosses the triangle, in plain floating point.
pub(crate) fn cross3(a: DVec3, b: DVec3, [p, q, r]: [DVec3; 3]) -> bool {
    let n = (q - p).cross(r - p);
    let (da, db) = (n.dot(a - p), n.dot(b - p));
    if (da > 0.0) == (db > 0.0) {
        return false;
    }
    let at = a + (b - a) * (da / (da - db));
    let in_edge = |u: DVec3, v: DVec3| n.dot((v - u).cross(at - u)) >= 0.0;
    in_edge(p, q) && in_edge(q, r) && in_edge(r, p)
}

/// True shortest paths in the plane around polylines, by a visibility graph.
///
/// Every corner of the polylines stands for one point in each of its angular sectors, so that no path
/// slips through a corner from one side to the other.
pub(crate) struct VisibilityGraph {
    segments: Vec<[DVec2; 2]>,
    stops: Vec<DVec2>,
    ways: Vec<Vec<f64>>,
}

impl VisibilityGraph {
    pub(crate) fn new(segments: &[[DVec2; 2]]) -> Self {
        let mut corners: Vec<DVec2> = Vec::new();
        for p in segments.iter().flatten() {
            if !corners.contains(p) {
                corners.push(*p);
            }
        }
        let mut stops = Vec::new();
        for &corner in &corners {
            let both = segments.iter().flat_map(|&[p, q]| [(p, q), (q, p)]);
            let from = both.filter(|(from, _)| *from == corner);
            let mut angles: Vec<f64> = from.map(|(from, to)| (to - from).to_angle()).collect();
            angles.sort_by(f64::total_cmp);
            for k in 0..angles.len() {
                let around = angles[0] + std::f64::consts::TAU;
                let next = angles.get(k + 1).copied().unwrap_or(around);
                // Of a wide sector three: none of them is in line with a segment.
                let wide = next - angles[k] > std::f64::consts::PI;
                let shares = if wide { &[0.2, 0.45, 0.7][..] } else { &[0.5] };
                for share in shares.iter().filter(|_| next - angles[k] > 1e-9) {
                    let (sin, cos) = (angles[k] + share * (next - angles[k])).sin_cos();
                    let stop = corner + 1e-9 * DVec2::new(cos, sin);
                    if inside(stop.extend(0.0)) {
                        stops.push(stop);
                    }
                }
            }
        }
        let mut graph = Self {
            segments: segments.to_vec(),
            stops,
            ways: Vec::new(),
        };
        let ways = |&a| graph.stops.iter().map(|&b| graph.way(a, b)).collect();
        graph.ways = graph.stops.iter().map(ways).collect();
        graph
    }

    fn way(&self, a: DVec2, b: DVec2) -> f64 {
        let free = !self.segments.iter().any(|&[p, q]| cross2(a, b, p, q));
        if free { a.distance(b) } else { f64::INFINITY }
    }

    /// Length of the shortest path, infinite beyond `limit`.
    pub(crate) fn shortest(&self, a: DVec2, b: DVec2, limit: f64) -> f64 {
        let n = self.stops.len();
        let mut best: Vec<f64> = self.stops.iter().map(|&s| self.way(a, s)).collect();
        let mut done = vec![false; n];
        let mut shortest = self.way(a, b);
        while let Some(k) = (0..n)
            .filter(|&k| !done[k] && best[k] < limit)
            .min_by(|&i, &j| best[i].total_cmp(&best[j]))
        {
            done[k] = true;
            shortest = shortest.min(best[k] + self.way(self.stops[k], b));
            for m in 0..n {
                best[m] = best[m].min(best[k] + self.ways[k][m]);
            }
        }
        if shortest < limit {
            shortest
        } else {
            f64::INFINITY
        }
    }
}
