//! Tetrahedra on an octree that is balanced 2:1 (Labelle & Shewchuk 2007, section 4).
//!
//! Nodes are the corners and the centre of every leaf. Between equal leaves lie the tetrahedra of the
//! body-centred lattice, halved where an edge has a node in its middle; a leaf that meets four
//! smaller ones has eight quarter tetrahedra at that face, and each small one two half pyramids.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::{Groups, index, rows, tetrahedron_volume};
use crate::sampling::sides::first_error;
use crate::sampling::{
    BackgroundEdge, BackgroundMesh, Cell, Octree, SampleError, Solid, Visit, WARP_LONG, WARP_SHORT,
};

/// Tetrahedra that one thread cuts at a time.
const CHUNK: usize = 4096;
/// A moved point leaves at least this fraction of the volume of each tetrahedron at it.
const LEAST_VOLUME: f64 = 0.2;

type Halves = [u32; 3];

/// The background on an octree.
pub(crate) struct Graded<'a> {
    octree: &'a Octree,
    /// Positions in halves of the smallest cell.
    points: Vec<Halves>,
    /// Width of the smallest leaf at each point, in units.
    width: Vec<u32>,
    tetrahedra: Vec<[u32; 4]>,
    /// Pairs of points of leaves that the surface does not touch.
    calm: Vec<[u32; 2]>,
    /// Tetrahedra at each point (CSR).
    offsets: Vec<usize>,
    around: Vec<u32>,
}

impl<'a> Graded<'a> {
    pub(crate) fn new(octree: &'a Octree) -> Self {
        let cells = &octree.cells;
        let pieces: Vec<Vec<[Halves; 4]>> = cells
            .par_chunks(1024)
            .map(|chunk| {
                let mut out = Vec::new();
                for cell in chunk {
                    fill(octree, *cell, &mut out);
                }
                out
            })
            .collect();
        let raw = pieces.concat();
        let mut number: HashMap<Halves, u32> = HashMap::with_capacity(raw.len() / 4);
        let mut points: Vec<Halves> = Vec::with_capacity(raw.len() / 4);
        let mut tetrahedra = Vec::with_capacity(raw.len());
        for corners in raw {
            tetrahedra.push(corners.map(|p| {
                *number.entry(p).or_insert_with(|| {
                    points.push(p);
                    index(points.len() - 1)
                })
            }));
        }
        let mut width = vec![u32::MAX; points.len()];
        let mut calm = Vec::new();
        for (leaf, cell) in cells.iter().enumerate() {
            let w = cell.width();
            let mut first = None;
            for p in lattice_points(*cell) {
                let Some(&v) = number.get(&p) else {
                    continue;
                };
                width[v as usize] = width[v as usize].min(w);
                if !octree.at_surface[leaf] {
                    calm.push([*first.get_or_insert(v), v]);
                }
            }
        }
        let corners = (0..).zip(&tetrahedra);
        let corners = corners.flat_map(|(t, corners)| corners.map(|v| (v, t)));
        let (offsets, around) = rows(points.len(), corners);
        Self {
            octree,
            points,
            width,
            tetrahedra,
            calm,
            offsets,
            around,
        }
    }
}

/// Corners and centre of a leaf.
fn lattice_points(cell: Cell) -> impl Iterator<Item = Halves> {
    let w = cell.width();
    let corner = move |k: u32| [0, 1, 2].map(|axis| 2 * cell.at[axis] + 2 * w * (k >> axis & 1));
    (0..8).map(corner).chain([cell.at.map(|x| 2 * x + w)])
}

/// Emits the tetrahedra of one leaf: those inside it, and those it shares with its next equal
/// neighbours.
fn fill(octree: &Octree, cell: Cell, out: &mut Vec<[Halves; 4]>) {
    for axis in 0..3 {
        for up in [false, true] {
            let mut beyond = cell.at.map(i64::from);
            beyond[axis] += if up { i64::from(cell.width()) } else { -1 };
            if let Some(other) = octree.leaf_at(beyond) {
                fill_at(octree, cell, octree.cells[other], (axis, up), out);
            }
        }
    }
}

/// The same at one face, with its neighbour there.
fn fill_at(
    octree: &Octree,
    cell: Cell,
    other: Cell,
    (axis, up): (usize, bool),
    out: &mut Vec<[Halves; 4]>,
) {
    let w = cell.width();
    let step = i64::from(w);
    let center = cell.at.map(|x| 2 * x + w);
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut base = cell.at.map(|x| 2 * x);
    base[axis] += if up { 2 * w } else { 0 };
    let ring = [[0, 0], [2 * w, 0], [2 * w, 2 * w], [0, 2 * w]].map(|[du, dv]| {
        let mut corner = base;
        corner[u] += du;
        corner[v] += dv;
        corner
    });
    let sides = [0, 1, 2, 3].map(|side| (side, ring[side], ring[(side + 1) % 4]));
    let middle = |a: Halves, b: Halves| [0, 1, 2].map(|i| a[i].midpoint(b[i]));
    if other.level > cell.level {
        // The larger neighbour's face has its middle at one corner of this one.
        let is_middle = |c: Halves| {
            [u, v]
                .iter()
                .all(|&a| c[a] == 2 * other.at[a] + other.width())
        };
        let k = (0..4).find(|k| is_middle(ring[*k])).unwrap_or(0);
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| ring[(k + i) % 4]);
        out.extend([[center, a, b, c], [center, a, c, d]]);
    } else if other.level < cell.level {
        let face = middle(ring[0], ring[2]);
        for (_, a, b) in sides {
            let m = middle(a, b);
            out.extend([[center, face, a, m], [center, face, m, b]]);
        }
    } else if up {
        let opposite = other.at.map(|x| 2 * x + w);
        for (side, a, b) in sides {
            // The two cells across the edge: is one of them divided?
            let out_of = if side % 2 == 0 { v } else { u };
            let mut across = cell.at.map(i64::from);
            across[out_of] += if matches!(side, 1 | 2) { step } else { -step };
            let mut diagonal = across;
            diagonal[axis] += step;
            let smaller = |leaf: usize| octree.cells[leaf].level < cell.level;
            let mut both = [across, diagonal].into_iter();
            if both.any(|p| octree.leaf_at(p).is_some_and(smaller)) {
                let m = middle(a, b);
                out.extend([[center, opposite, a, m], [center, opposite, m, b]]);
            } else {
                out.push([center, opposite, a, b]);
            }
        }
    }
}

fn squared(a: Halves, b: Halves) -> u64 {
    (0..3)
        .map(|i| {
            let d = u64::from(a[i].abs_diff(b[i]));
            d * d
        })
        .sum()
}

impl BackgroundMesh for Graded<'_> {
    fn point_count(&self) -> usize {
        self.points.len()
    }

    fn position(&self, id: u32) -> DVec3 {
        self.octree.point(self.points[id as usize])
    }

    fn size(&self, id: u32) -> f64 {
        self.octree.edge(self.width[id as usize])
    }

    fn signs(&self, solid: &Solid) -> Result<Vec<i8>, SampleError> {
        // Points of a leaf that the surface does not touch share their sign.
        let n = self.points.len();
        let mut alike = Groups::new(n);
        if solid.mesh().is_some() {
            for [a, b] in &self.calm {
                alike.join(*a, *b);
            }
        }
        let roots: Vec<u32> = (0..n).map(|v| alike.find(index(v))).collect();
        let own = (0..n).into_par_iter().with_min_len(256).map(|v| {
            if roots[v] as usize == v {
                solid.sign_at(self.position(index(v)))
            } else {
                Ok(0)
            }
        });
        let own = first_error(own)?;
        Ok(roots.into_iter().map(|r| own[r as usize]).collect())
    }

    fn crossed_edges(&self, sign: &[i8]) -> Vec<BackgroundEdge> {
        let mut ends: Vec<[u32; 2]> = self
            .tetrahedra
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| {
                let mut out = Vec::new();
                for t in chunk {
                    for i in 0..4 {
                        for j in i + 1..4 {
                            if sign[t[i] as usize] * sign[t[j] as usize] < 0 {
                                out.push([t[i].min(t[j]), t[i].max(t[j])]);
                            }
                        }
                    }
                }
                out
            })
            .collect();
        ends.par_sort_unstable();
        ends.dedup();
        ends.into_iter()
            .map(|[a, b]| {
                let (p, q) = (self.points[a as usize], self.points[b as usize]);
                let straight = (0..3).filter(|i| p[*i] != q[*i]).count() == 1;
                let reach = if straight { WARP_LONG } else { WARP_SHORT };
                BackgroundEdge::new(a, b, reach)
            })
            .collect()
    }

    fn chunks(&self) -> usize {
        self.tetrahedra.len().div_ceil(CHUNK)
    }

    fn tetrahedra_in(&self, chunk: usize, visit: &mut Visit<'_>) {
        let end = self.tetrahedra.len().min((chunk + 1) * CHUNK);
        for corners in &self.tetrahedra[chunk * CHUNK..end] {
            let places = corners.map(|v| self.points[v as usize]);
            let lengths = places.map(|a| places.map(|b| squared(a, b)));
            let edges = lengths.as_flattened().iter();
            let rank = |length: u64| {
                // Every edge stands there twice.
                let shorter = edges.clone().filter(|l| **l > 0 && **l < length).count() / 2;
                u8::try_from(shorter).expect("at most six edges")
            };
            visit(*corners, &lengths.map(|row| row.map(rank)));
        }
    }

    fn may_warp(&self, id: u32, to: DVec3, position: &dyn Fn(u32) -> DVec3) -> bool {
        let v = id as usize;
        let own = &self.around[self.offsets[v]..self.offsets[v + 1]];
        own.iter().all(|t| {
            let corners = self.tetrahedra[*t as usize];
            let whole = tetrahedron_volume(corners.map(|c| self.position(c)));
            let then = corners.map(|c| if c == id { to } else { position(c) });
            tetrahedron_volume(then) / whole > LEAST_VOLUME
        })
    }
}
