//! Isosurface stuffing on a uniform lattice (Labelle & Shewchuk 2007).

use glam::DVec3;
use rayon::prelude::*;

use crate::error::SampleError;
use crate::lattice::{CLASSES, Edge, Lattice};
use crate::mesh::index;
use crate::oracle::Oracle;
use crate::stencil::{Prism, Stencil};

/// A lattice point moves onto the surface if a cut lies within this fraction of a long edge.
/// Labelle & Shewchuk 2007, table 1 (the pair that bounds dihedral angles by 10.7 and 164.8).
const WARP_LONG: f64 = 0.24999;
/// The same for a short edge.
const WARP_SHORT: f64 = 0.41189;

/// Tetrahedra before renumbering: every node is used.
#[derive(Debug, Default)]
pub(crate) struct Stuffed {
    pub positions: Vec<DVec3>,
    /// On the surface (cut point or moved lattice point).
    pub on_surface: Vec<bool>,
    pub tetrahedra: Vec<[u32; 4]>,
    /// Part of the input surface for each crossing found (see [`Oracle::crossing`]), as a set.
    pub parts_hit: Vec<bool>,
}

/// A place where an edge of the lattice passes the surface.
struct Cut {
    edge: Edge,
    at: DVec3,
    alive: bool,
}

/// Fills the body with tetrahedra of the lattice, cut along the surface.
pub(crate) fn stuff(lattice: &Lattice, oracle: &Oracle<'_>) -> Result<Stuffed, SampleError> {
    let mut sign = oracle.signs(lattice)?;
    let mut stuffed = Stuffed {
        parts_hit: vec![false; oracle.part_count()],
        ..Stuffed::default()
    };
    let mut cuts = find_cuts(lattice, oracle, &sign, &mut stuffed.parts_hit);
    let moved = warp(lattice, &mut cuts, &mut sign);

    let points = lattice.point_count();
    let cut_id = |a: u32, b: u32| -> u32 {
        let key = (a.min(b), a.max(b));
        let found = cuts
            .binary_search_by(|c| key_of(&c.edge).cmp(&key))
            .expect("an edge with a sign change has a cut");
        index(points + found)
    };
    let position = |id: u32| -> DVec3 {
        let id = id as usize;
        if id >= points {
            return cuts[id - points].at;
        }
        let place = index(id);
        if sign[id] == 0
            && let Ok(found) = moved.binary_search_by(|(v, _)| v.cmp(&place))
        {
            return moved[found].1;
        }
        lattice.position(place)
    };
    let slabs: Vec<Vec<[u32; 4]>> = (0..lattice.cells[2])
        .into_par_iter()
        .map(|k| {
            let mut out = Vec::new();
            for j in 0..lattice.cells[1] {
                for i in 0..lattice.cells[0] {
                    lattice.tetrahedra_at([i, j, k], |corners| {
                        let signs = corners.map(|c| sign[c as usize]);
                        if signs.contains(&1) {
                            let stencil = Stencil {
                                corners,
                                sign: signs,
                                class: &CLASSES,
                                cut: cut_id,
                                position,
                            };
                            let prism = stencil.emit(&mut out);
                            debug_assert!(
                                matches!(prism, Prism::Split),
                                "two classes of edges cannot be cyclic"
                            );
                        }
                    });
                }
            }
            out
        })
        .collect();

    let mut number = vec![u32::MAX; points + cuts.len()];
    stuffed.tetrahedra = slabs.concat();
    for tetrahedron in &mut stuffed.tetrahedra {
        for corner in tetrahedron {
            let id = *corner as usize;
            if number[id] == u32::MAX {
                number[id] = index(stuffed.positions.len());
                stuffed.positions.push(position(*corner));
                stuffed.on_surface.push(id >= points || sign[id] == 0);
            }
            *corner = number[id];
        }
    }
    Ok(stuffed)
}

fn key_of(edge: &Edge) -> (u32, u32) {
    (edge.from.min(edge.to), edge.from.max(edge.to))
}

/// One cut for every edge with ends inside and outside, sorted by the ends' ids.
fn find_cuts(
    lattice: &Lattice,
    oracle: &Oracle<'_>,
    sign: &[i8],
    parts_hit: &mut [bool],
) -> Vec<Cut> {
    let slabs: Vec<Vec<(Cut, u32)>> = (0..=lattice.cells[2])
        .into_par_iter()
        .map(|k| {
            let mut out = Vec::new();
            let mut scratch = Vec::new();
            for j in 0..=lattice.cells[1] {
                for i in 0..=lattice.cells[0] {
                    lattice.edges_at([i, j, k], |edge| {
                        let (s, t) = (sign[edge.from as usize], sign[edge.to as usize]);
                        if s * t < 0 {
                            let (inside, outside) = if s > 0 {
                                (edge.from, edge.to)
                            } else {
                                (edge.to, edge.from)
                            };
                            let (at, part) = oracle.crossing(
                                lattice.position(inside),
                                lattice.position(outside),
                                &mut scratch,
                            );
                            let cut = Cut {
                                edge,
                                at,
                                alive: true,
                            };
                            out.push((cut, part));
                        }
                    });
                }
            }
            out
        })
        .collect();
    let mut cuts = Vec::with_capacity(slabs.iter().map(Vec::len).sum());
    for (cut, part) in slabs.into_iter().flatten() {
        if let Some(hit) = parts_hit.get_mut(part as usize) {
            *hit = true;
        }
        cuts.push(cut);
    }
    cuts.par_sort_unstable_by_key(|c| key_of(&c.edge));
    cuts
}

/// Moves lattice points that have a cut too near onto the nearest such cut, in the order of their
/// ids; the cuts on all their edges die with it. Returns the moved points, sorted by id.
fn warp(lattice: &Lattice, cuts: &mut Vec<Cut>, sign: &mut [i8]) -> Vec<(u32, DVec3)> {
    let mut ends: Vec<(u32, u32)> = cuts
        .iter()
        .enumerate()
        .flat_map(|(c, cut)| [(cut.edge.from, index(c)), (cut.edge.to, index(c))])
        .collect();
    ends.par_sort_unstable();
    let mut moved = Vec::new();
    for group in ends.chunk_by(|a, b| a.0 == b.0) {
        let vertex = group[0].0;
        let place = lattice.position(vertex);
        let mut nearest: Option<(f64, DVec3)> = None;
        for &(_, c) in group {
            let cut = &cuts[c as usize];
            if !cut.alive {
                continue;
            }
            let length = lattice
                .position(cut.edge.from)
                .distance(lattice.position(cut.edge.to));
            let distance = cut.at.distance(place);
            let threshold = if cut.edge.long { WARP_LONG } else { WARP_SHORT };
            if distance < threshold * length && nearest.is_none_or(|(d, _)| distance < d) {
                nearest = Some((distance, cut.at));
            }
        }
        if let Some((_, at)) = nearest {
            moved.push((vertex, at));
            sign[vertex as usize] = 0;
            for &(_, c) in group {
                cuts[c as usize].alive = false;
            }
        }
    }
    cuts.retain(|c| c.alive);
    moved
}
