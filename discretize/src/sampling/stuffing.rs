//! Isosurface stuffing (Labelle & Shewchuk 2007) of a body by a background of tetrahedra.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::{Mesh, boundary_triangles, index};
use crate::sampling::{BackgroundEdge, BackgroundMesh, SampleError, Solid, Stencil};

/// Tetrahedra before renumbering: every node is used.
#[derive(Debug, Default, Clone)]
pub(crate) struct Stuffed {
    pub positions: Vec<DVec3>,
    /// On the surface (cut point or moved lattice point).
    pub on_surface: Vec<bool>,
    /// Edge of the background cell that the node comes from.
    pub size: Vec<f64>,
    pub tetrahedra: Vec<[u32; 4]>,
    /// Part of the input surface for each crossing found (see [`Solid::crossing`]), as a set.
    pub parts_hit: Vec<bool>,
}

impl Stuffed {
    /// The boundary, over all vertices.
    pub(crate) fn into_surface(self) -> Mesh {
        let triangles = boundary_triangles(&self.tetrahedra, |v| self.on_surface[v as usize]);
        Mesh {
            vertices: self.positions,
            triangles,
        }
    }
}

/// A position where an edge of the background passes the surface.
struct EdgeCut {
    edge: BackgroundEdge,
    at: DVec3,
    alive: bool,
}

/// Fills the body with tetrahedra of the background, cut along the surface.
pub(crate) fn stuff(
    background: &dyn BackgroundMesh,
    solid: &Solid,
) -> Result<Stuffed, SampleError> {
    let mut sign = background.signs(solid)?;
    check_bounds(background, solid, &sign)?;
    let mut stuffed = Stuffed {
        parts_hit: vec![false; solid.parts().1],
        ..Stuffed::default()
    };
    let mut cuts = find_cuts(background, solid, &sign, &mut stuffed.parts_hit);
    let moved = warp(background, &mut cuts, &mut sign);

    let points = background.point_count();
    let cut_id = |a: u32, b: u32| -> u32 {
        let key = [a.min(b), a.max(b)];
        let found = cuts
            .binary_search_by(|c| c.edge.ends.cmp(&key))
            .expect("an edge with a sign change has a cut");
        index(points + found)
    };
    let position = |id: u32| -> DVec3 {
        match (id as usize).checked_sub(points) {
            Some(cut) => cuts[cut].at,
            None if sign[id as usize] == 0 => place_of(background, &moved, id),
            None => background.position(id),
        }
    };
    let chunks: Vec<Vec<[u32; 4]>> = (0..background.chunks())
        .into_par_iter()
        .map(|chunk| {
            let mut out = Vec::new();
            background.tetrahedra_in(chunk, &mut |corners, class| {
                let signs = corners.map(|c| sign[c as usize]);
                if signs.contains(&1) {
                    let stencil = Stencil {
                        corners,
                        sign: signs,
                        class,
                        cut: cut_id,
                        position,
                    };
                    stencil.emit(&mut out);
                }
            });
            out
        })
        .collect();

    let mut number = vec![u32::MAX; points + cuts.len()];
    stuffed.tetrahedra = chunks.concat();
    for tetrahedron in &mut stuffed.tetrahedra {
        for corner in tetrahedron {
            let id = *corner as usize;
            if number[id] == u32::MAX {
                number[id] = index(stuffed.positions.len());
                stuffed.positions.push(position(*corner));
                stuffed.on_surface.push(id >= points || sign[id] == 0);
                stuffed.size.push(match id.checked_sub(points) {
                    Some(cut) => {
                        let [a, b] = cuts[cut].edge.ends;
                        background.size(a).min(background.size(b))
                    }
                    None => background.size(*corner),
                });
            }
            *corner = number[id];
        }
    }
    Ok(stuffed)
}

/// Refuses an implicit body that reaches beyond its bounds.
fn check_bounds(
    background: &dyn BackgroundMesh,
    solid: &Solid,
    sign: &[i8],
) -> Result<(), SampleError> {
    if solid.mesh().is_some() {
        return Ok(());
    }
    let bounds = solid.bounds();
    let slack = 1e-9 * bounds.diagonal();
    let beyond = (0..sign.len())
        .into_par_iter()
        .filter(|v| sign[*v] > 0)
        .map(|v| background.position(index(v)))
        .find_first(|p| bounds.distance_squared(*p) > slack * slack);
    beyond.map_or(Ok(()), |at| Err(SampleError::OutsideBounds { at }))
}

/// Position of a background point: where it was moved to, or where it always was.
fn place_of(background: &dyn BackgroundMesh, moved: &[(u32, DVec3)], id: u32) -> DVec3 {
    match moved.binary_search_by(|(v, _)| v.cmp(&id)) {
        Ok(found) => moved[found].1,
        Err(_) => background.position(id),
    }
}

/// One cut for every edge with ends inside and outside, sorted by the ends' ids.
fn find_cuts(
    background: &dyn BackgroundMesh,
    solid: &Solid,
    sign: &[i8],
    parts_hit: &mut [bool],
) -> Vec<EdgeCut> {
    let mut edges = background.crossed_edges(sign);
    edges.par_sort_unstable_by_key(|e| e.ends);
    let found: Vec<(EdgeCut, u32)> = edges
        .into_par_iter()
        .map_init(Vec::new, |scratch, edge| {
            let [a, b] = edge.ends;
            let (inside, outside) = if sign[a as usize] > 0 { (a, b) } else { (b, a) };
            let (at, part) = solid.crossing(
                background.position(inside),
                background.position(outside),
                scratch,
            );
            let alive = true;
            (EdgeCut { edge, at, alive }, part)
        })
        .collect();
    found
        .into_iter()
        .map(|(cut, part)| {
            if let Some(hit) = parts_hit.get_mut(part as usize) {
                *hit = true;
            }
            cut
        })
        .collect()
}

/// Moves background points that have a cut too near onto the nearest such cut, in the order of
/// their ids; the cuts on all their edges die with it. Returns the moved points, sorted by id.
fn warp(
    background: &dyn BackgroundMesh,
    cuts: &mut Vec<EdgeCut>,
    sign: &mut [i8],
) -> Vec<(u32, DVec3)> {
    let mut ends: Vec<(u32, u32)> = cuts
        .iter()
        .enumerate()
        .flat_map(|(c, cut)| cut.edge.ends.map(|v| (v, index(c))))
        .collect();
    ends.par_sort_unstable();
    let mut moved: Vec<(u32, DVec3)> = Vec::new();
    for group in ends.chunk_by(|a, b| a.0 == b.0) {
        let vertex = group[0].0;
        let place = background.position(vertex);
        let mut nearest: Option<(f64, DVec3)> = None;
        for &(_, c) in group {
            let cut = &cuts[c as usize];
            if !cut.alive {
                continue;
            }
            let [a, b] = cut.edge.ends;
            let length = background.position(a).distance(background.position(b));
            let distance = cut.at.distance(place);
            if distance < cut.edge.reach * length && nearest.is_none_or(|(d, _)| distance < d) {
                nearest = Some((distance, cut.at));
            }
        }
        let now = |id| place_of(background, &moved, id);
        if let Some((_, at)) = nearest
            && background.may_warp(vertex, at, &now)
        {
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
