//! Tetrahedra near the surface that can be changed one operation at a time.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::mesh::{boundary_triangles, index};
use crate::sampling::{Stuffed, faces};

/// `sqrt(V_i / K_i)` over the cell, `K_i = sum_T V_T / h_T^2` with the heights of the node, above
/// which a node is good enough. A node of the lattice has 0.36; the explicit step is about three
/// times the smallest over the wave speed.
const GOOD_STEP: f64 = 0.30;
/// Sine of the dihedral angle that is good enough.
const GOOD_SINE: f64 = 0.40;
/// Sine of the dihedral angle below which no collapse may make a tetrahedron.
const LEAST_SINE: f64 = 0.27;
/// In place of corners of a tetrahedron or face that is gone.
const GONE: u32 = u32::MAX;

/// What a tetrahedron gives its corners.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TetrahedronMeasure {
    /// Volume.
    pub volume: f64,
    /// Volume over the squared height of each corner.
    pub stiffness: [f64; 4],
    /// Sine of the dihedral angle farthest from a right one.
    pub sine: f64,
}

impl TetrahedronMeasure {
    /// Of a tetrahedron without volume: anything is better.
    const FLAT: Self = Self {
        volume: 0.0,
        stiffness: [f64::INFINITY; 4],
        sine: -1.0,
    };
}

/// A stuffing with what surrounds each node near its surface.
pub(crate) struct StuffingPatch {
    pub positions: Vec<DVec3>,
    pub on_surface: Vec<bool>,
    pub size: Vec<f64>,
    /// Those at nodes that may move or neighbour one, and what each gives its corners.
    pub tetrahedra: Vec<[u32; 4]>,
    measures: Vec<TetrahedronMeasure>,
    /// All others.
    rest: Vec<[u32; 4]>,
    pub faces: Vec<[u32; 3]>,
    /// Tetrahedra at each node that may move or neighbours one.
    pub tetrahedra_at: Vec<Vec<u32>>,
    /// Boundary faces at each surface node.
    pub faces_at: Vec<Vec<u32>>,
    /// Near enough to the surface to be worth moving.
    pub may_move: Vec<bool>,
    volume: Vec<f64>,
    stiffness: Vec<f64>,
    parts_hit: Vec<bool>,
    /// Per node: the round of evaluation that touched it, and its changes in that round.
    stamp: Vec<u32>,
    change: Vec<(f64, f64)>,
    touched: Vec<u32>,
    fresh: Vec<TetrahedronMeasure>,
    round: u32,
}

/// Per node: the elements that it is a corner of.
fn at_nodes<const N: usize>(nodes: usize, elements: &[[u32; N]]) -> Vec<Vec<u32>> {
    let mut at = vec![Vec::new(); nodes];
    for (element, corners) in elements.iter().enumerate() {
        for &v in corners {
            at[v as usize].push(index(element));
        }
    }
    at
}

impl StuffingPatch {
    pub(crate) fn new(stuffed: Stuffed) -> Self {
        let Stuffed {
            positions,
            on_surface,
            size,
            tetrahedra,
            parts_hit,
        } = stuffed;
        let n = positions.len();
        let faces = boundary_triangles(&tetrahedra, |v| on_surface[v as usize]);
        let spread = |near: &[bool]| {
            let mut wider = near.to_vec();
            for t in &tetrahedra {
                if t.iter().any(|v| near[*v as usize]) {
                    t.iter().for_each(|v| wider[*v as usize] = true);
                }
            }
            wider
        };
        let may_move = spread(&on_surface);
        let listed = spread(&may_move);
        let (mut volume, mut stiffness) = (vec![0.0; n], vec![0.0; n]);
        let (near, rest): (Vec<_>, Vec<_>) = tetrahedra
            .into_iter()
            .partition(|t| t.iter().any(|v| listed[*v as usize]));
        let measures: Vec<TetrahedronMeasure> = near
            .iter()
            .map(|t| measure(t.map(|v| positions[v as usize])).unwrap_or(TetrahedronMeasure::FLAT))
            .collect();
        for (corners, m) in near.iter().zip(&measures) {
            for (k, &v) in corners.iter().enumerate() {
                volume[v as usize] += 0.25 * m.volume;
                stiffness[v as usize] += m.stiffness[k];
            }
        }
        Self {
            positions,
            on_surface,
            size,
            tetrahedra_at: at_nodes(n, &near),
            tetrahedra: near,
            measures,
            rest,
            faces_at: at_nodes(n, &faces),
            faces,
            may_move,
            volume,
            stiffness,
            parts_hit,
            stamp: vec![0; n],
            change: vec![(0.0, 0.0); n],
            touched: Vec::new(),
            fresh: Vec::new(),
            round: 0,
        }
    }

    /// The step that a node allows, over a good one.
    pub(crate) fn goodness(&self, v: u32) -> f64 {
        let v = v as usize;
        self.ratio(v, self.volume[v], self.stiffness[v])
    }

    fn ratio(&self, v: usize, volume: f64, stiffness: f64) -> f64 {
        (volume / stiffness).max(0.0).sqrt() / (GOOD_STEP * self.size[v])
    }

    /// Nodes that may move, worst first.
    pub(crate) fn by_goodness(&self) -> Vec<u32> {
        let mut order: Vec<(f64, u32)> = (0..self.positions.len())
            .filter(|v| self.may_move[*v] && !self.tetrahedra_at[*v].is_empty())
            .map(|v| (self.goodness(index(v)), index(v)))
            .collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order.into_iter().map(|(_, v)| v).collect()
    }

    /// Nodes that share a tetrahedron with `v`, ascending.
    pub(crate) fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut out: Vec<u32> = self.tetrahedra_at[v as usize]
            .iter()
            .flat_map(|t| self.tetrahedra[*t as usize])
            .filter(|other| *other != v)
            .collect();
        out.sort_unstable();
        out.dedup();
        out
    }

    /// Goodness of the worst node and tetrahedron at `v` and its neighbours' own values.
    pub(crate) fn worst_around(&self, v: u32) -> f64 {
        let mut least = self.goodness(v);
        for &t in &self.tetrahedra_at[v as usize] {
            least = least.min(self.measures[t as usize].sine / GOOD_SINE);
            for other in self.tetrahedra[t as usize] {
                least = least.min(self.goodness(other));
            }
        }
        least
    }

    fn begin(&mut self) {
        self.round += 1;
        self.touched.clear();
    }

    fn add(&mut self, v: u32, volume: f64, stiffness: f64) {
        let i = v as usize;
        if self.stamp[i] != self.round {
            self.stamp[i] = self.round;
            self.change[i] = (0.0, 0.0);
            self.touched.push(v);
        }
        self.change[i].0 += volume;
        self.change[i].1 += stiffness;
    }

    /// Least goodness of the touched nodes with their changes.
    fn least_touched(&self, except: u32) -> f64 {
        self.touched
            .iter()
            .filter(|v| **v != except)
            .map(|v| {
                let i = *v as usize;
                let (dv, dk) = self.change[i];
                self.ratio(i, self.volume[i] + dv, self.stiffness[i] + dk)
            })
            .fold(f64::INFINITY, f64::min)
    }

    fn commit(&mut self) {
        for &v in &self.touched {
            let i = v as usize;
            self.volume[i] += self.change[i].0;
            self.stiffness[i] += self.change[i].1;
        }
    }

    /// Moves a node if the worst around gets better than `now` and the position is `allowed`.
    pub(crate) fn try_move(
        &mut self,
        v: u32,
        place: DVec3,
        now: f64,
        allowed: impl Fn(DVec3) -> bool,
    ) -> bool {
        self.begin();
        self.fresh.clear();
        for k in 0..self.tetrahedra_at[v as usize].len() {
            let t = self.tetrahedra_at[v as usize][k] as usize;
            let ids = self.tetrahedra[t];
            let at = |c: u32| {
                if c == v {
                    place
                } else {
                    self.positions[c as usize]
                }
            };
            let Some(after) = measure(ids.map(at)) else {
                return false;
            };
            if after.sine <= now * GOOD_SINE {
                return false;
            }
            let before = self.measures[t];
            for (c, &id) in ids.iter().enumerate() {
                let volume = 0.25 * (after.volume - before.volume);
                self.add(id, volume, after.stiffness[c] - before.stiffness[c]);
            }
            self.fresh.push(after);
        }
        if self.least_touched(GONE) <= now || !allowed(place) {
            return false;
        }
        self.commit();
        for (t, after) in self.tetrahedra_at[v as usize].iter().zip(&self.fresh) {
            self.measures[*t as usize] = *after;
        }
        self.positions[v as usize] = place;
        true
    }

    /// Goodness of the worst around if `gone` moved onto `kept`, if better than `enough`.
    pub(crate) fn worst_after_collapse(
        &mut self,
        gone: u32,
        kept: u32,
        enough: f64,
    ) -> Option<f64> {
        self.begin();
        let mut least = f64::INFINITY;
        for k in 0..self.tetrahedra_at[gone as usize].len() {
            let t = self.tetrahedra_at[gone as usize][k];
            let ids = self.tetrahedra[t as usize];
            let before = self.measures[t as usize];
            for (c, &v) in ids.iter().enumerate() {
                self.add(v, -0.25 * before.volume, -before.stiffness[c]);
            }
            if ids.contains(&kept) {
                continue;
            }
            let then = ids.map(|v| if v == gone { kept } else { v });
            let after = measure(then.map(|v| self.positions[v as usize]))?;
            if after.sine < LEAST_SINE {
                return None;
            }
            least = least.min(after.sine / GOOD_SINE);
            if least <= enough {
                return None;
            }
            for (c, &v) in then.iter().enumerate() {
                self.add(v, 0.25 * after.volume, after.stiffness[c]);
            }
        }
        least = least.min(self.least_touched(gone));
        (least > enough).then_some(least)
    }

    /// The link condition: what both ends of the edge are joined to is joined to the edge itself,
    /// counting the outside as one more node. Then the collapse changes no topology.
    pub(crate) fn link_allows(&self, gone: u32, kept: u32) -> bool {
        let link = |v: u32, with: Option<u32>| {
            let mut nodes: BTreeSet<u32> = BTreeSet::new();
            let (mut edges, mut triangles) = (BTreeSet::new(), BTreeSet::new());
            let solid = self.tetrahedra_at[v as usize]
                .iter()
                .map(|t| self.tetrahedra[*t as usize]);
            let outside = self.faces_at[v as usize].iter().map(|f| {
                let [a, b, c] = self.faces[*f as usize];
                [a, b, c, GONE]
            });
            for cell in solid.chain(outside) {
                if with.is_some_and(|w| !cell.contains(&w)) {
                    continue;
                }
                let mut rest: Vec<u32> = cell
                    .into_iter()
                    .filter(|c| *c != v && with != Some(*c))
                    .collect();
                rest.sort_unstable();
                nodes.extend(&rest);
                for i in 0..rest.len() {
                    for j in i + 1..rest.len() {
                        edges.insert([rest[i], rest[j]]);
                    }
                }
                if let [a, b, c] = rest[..] {
                    triangles.insert([a, b, c]);
                }
            }
            (nodes, edges, triangles)
        };
        let (nodes_a, edges_a, triangles_a) = link(gone, None);
        let (nodes_b, edges_b, triangles_b) = link(kept, None);
        let (nodes, edges, _) = link(gone, Some(kept));
        nodes_a.intersection(&nodes_b).eq(&nodes)
            && edges_a.intersection(&edges_b).eq(&edges)
            && triangles_a.is_disjoint(&triangles_b)
    }

    /// Moves `gone` onto `kept` and drops what gets flat.
    pub(crate) fn collapse(&mut self, gone: u32, kept: u32) {
        let possible = self.worst_after_collapse(gone, kept, f64::NEG_INFINITY);
        debug_assert!(possible.is_some(), "the collapse was evaluated before");
        self.commit();
        for t in std::mem::take(&mut self.tetrahedra_at[gone as usize]) {
            let ids = self.tetrahedra[t as usize];
            if ids.contains(&kept) {
                self.tetrahedra[t as usize] = [GONE; 4];
                for v in ids {
                    self.tetrahedra_at[v as usize].retain(|other| *other != t);
                }
            } else {
                let ids = ids.map(|v| if v == gone { kept } else { v });
                let corners = ids.map(|v| self.positions[v as usize]);
                self.measures[t as usize] = measure(corners).unwrap_or(TetrahedronMeasure::FLAT);
                self.tetrahedra[t as usize] = ids;
                self.tetrahedra_at[kept as usize].push(t);
            }
        }
        for f in std::mem::take(&mut self.faces_at[gone as usize]) {
            let ids = self.faces[f as usize];
            if ids.contains(&kept) {
                self.faces[f as usize] = [GONE; 3];
                for v in ids {
                    self.faces_at[v as usize].retain(|other| *other != f);
                }
            } else {
                self.faces[f as usize] = ids.map(|v| if v == gone { kept } else { v });
                self.faces_at[kept as usize].push(f);
            }
        }
    }

    /// The stuffing without what is gone.
    pub(crate) fn finish(self) -> Stuffed {
        let mut number = vec![GONE; self.positions.len()];
        let mut out = Stuffed {
            parts_hit: self.parts_hit,
            ..Stuffed::default()
        };
        let all = self.tetrahedra.into_iter().chain(self.rest);
        for ids in all.filter(|t| t[0] != GONE) {
            out.tetrahedra.push(ids.map(|v| {
                let i = v as usize;
                if number[i] == GONE {
                    number[i] = index(out.positions.len());
                    out.positions.push(self.positions[i]);
                    out.on_surface.push(self.on_surface[i]);
                    out.size.push(self.size[i]);
                }
                number[i]
            }));
        }
        out
    }
}

/// What a tetrahedron gives its corners.
pub(crate) fn measure([a, b, c, d]: [DVec3; 4]) -> Option<TetrahedronMeasure> {
    let six_volumes = (b - a).cross(c - a).dot(d - a);
    let normals = faces([a, b, c, d]);
    let squared = normals.map(DVec3::length_squared);
    let stiffness = squared.map(|n| n / (6.0 * six_volumes));
    if six_volumes <= 0.0 || !stiffness.iter().all(|k| k.is_finite()) {
        return None;
    }
    let mut cosine_squared = 0.0_f64;
    for i in 0..4 {
        for j in i + 1..4 {
            let dot = normals[i].dot(normals[j]);
            cosine_squared = cosine_squared.max(dot * dot / (squared[i] * squared[j]));
        }
    }
    Some(TetrahedronMeasure {
        volume: six_volumes / 6.0,
        stiffness,
        sine: (1.0 - cosine_squared).max(0.0).sqrt(),
    })
}
