//! Fewer and better placed nodes near the surface: longer explicit steps, rounder tetrahedra.
//!
//! Stuffing leaves nodes with a fiftieth of the mean volume, and an explicit step is as short as the
//! worst node allows. Short edges are collapsed and nodes moved where that helps the worst node or
//! tetrahedron around; no operation makes the worst of its neighbourhood worse.

use glam::DVec3;

use crate::mesh::{area_vector, closest_on_triangle};
use crate::sampling::{Solid, Stuffed, StuffingPatch};

/// Fractions of the path to the middle of the neighbours that are tried.
const STEPS: [f64; 3] = [1.0, 0.5, 0.25];
/// Lengths of the steps along the axes that are tried then, over the cell.
const PROBES: [f64; 2] = [0.12, 0.04];
/// A moved surface node must lie on the surface within this fraction of the cell.
const ON_SURFACE: f64 = 1e-9;
/// A collapse must raise the worst of its neighbourhood by this factor.
const GAIN: f64 = 1.02;
/// Cosine of the largest turn of a surface triangle in a collapse.
const LARGEST_TURN: f64 = 0.7;
/// Farthest that a collapse may leave the removed surface node off the surface, over the cell.
const LARGEST_SAGITTA: f64 = 0.12;

/// Sweeps of collapses and moves over the nodes near the surface, worst first. No tetrahedron is
/// turned over, no node leaves the surface, the boundary keeps its topology.
pub(crate) fn improve(stuffed: &mut Stuffed, solid: &Solid, sweeps: usize) {
    if sweeps == 0 {
        return;
    }
    let mut patch = StuffingPatch::new(std::mem::take(stuffed));
    for _ in 0..sweeps {
        let mut changed = false;
        for v in patch.by_goodness() {
            changed |= collapse_best(&mut patch, v);
        }
        for v in patch.by_goodness() {
            changed |= move_node(&mut patch, solid, v);
        }
        if !changed {
            break;
        }
    }
    *stuffed = patch.finish();
}

/// Moves a node toward the middle of its neighbours (a surface node toward that of its surface
/// neighbours, then back onto the surface) if the worst around gets better.
fn move_node(patch: &mut StuffingPatch, solid: &Solid, v: u32) -> bool {
    let now = patch.worst_around(v);
    if now >= 1.0 {
        return false;
    }
    let before = patch.positions[v as usize];
    let on_surface = patch.on_surface[v as usize];
    let cell = patch.size[v as usize];
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for &t in &patch.tetrahedra_at[v as usize] {
        for &other in &patch.tetrahedra[t as usize] {
            if other != v && (!on_surface || patch.on_surface[other as usize]) {
                sum += patch.positions[other as usize];
                count += 1.0;
            }
        }
    }
    if count == 0.0 {
        return false;
    }
    let middle = sum / count;
    let axes = [
        DVec3::X,
        DVec3::NEG_X,
        DVec3::Y,
        DVec3::NEG_Y,
        DVec3::Z,
        DVec3::NEG_Z,
    ];
    let toward = STEPS.into_iter().map(|step| step * (middle - before));
    let probes = PROBES
        .into_iter()
        .flat_map(|length| axes.map(|axis| length * cell * axis));
    for step in toward.chain(probes) {
        let mut place = before + step;
        if on_surface {
            place = solid.project(place);
            let off = solid.mesh().is_none() && {
                let value = solid.signed_distance(place);
                value > 0.0 && value > f64::EPSILON * cell || value < -ON_SURFACE * cell
            };
            if off || !place.is_finite() {
                continue;
            }
        }
        if patch.try_move(v, place, now, |p| on_surface || solid.contains(p)) {
            return true;
        }
    }
    false
}

/// Collapses an edge at `v`, onto either end, if the worst around gets better; the best of them.
fn collapse_best(patch: &mut StuffingPatch, v: u32) -> bool {
    if patch.goodness(v) >= 1.0 {
        return false;
    }
    let mut best: Option<(f64, u32, u32)> = None;
    let own = patch.worst_around(v);
    for other in patch.neighbours(v) {
        for (gone, kept) in [(v, other), (other, v)] {
            if !patch.may_move[gone as usize]
                || patch.on_surface[gone as usize] && !patch.on_surface[kept as usize]
            {
                continue;
            }
            let now = if gone == v {
                own
            } else {
                patch.worst_around(gone)
            };
            let enough = best.map_or(now * GAIN, |(most, ..)| most);
            if let Some(then) = patch.worst_after_collapse(gone, kept, enough)
                && surface_stays(patch, gone, kept)
                && patch.link_allows(gone, kept)
            {
                best = Some((then, gone, kept));
            }
        }
    }
    if let Some((_, gone, kept)) = best {
        patch.collapse(gone, kept);
    }
    best.is_some()
}

/// Whether the surface around a node that goes is kept well enough: triangles hardly turn, and the
/// node's position stays near one of them.
fn surface_stays(patch: &StuffingPatch, gone: u32, kept: u32) -> bool {
    if !patch.on_surface[gone as usize] {
        return true;
    }
    let place = patch.positions[gone as usize];
    let mut nearest = f64::INFINITY;
    for &f in &patch.faces_at[gone as usize] {
        let face = patch.faces[f as usize];
        if face.contains(&kept) {
            continue;
        }
        let now = face.map(|v| patch.positions[v as usize]);
        let then = face.map(|v| patch.positions[if v == gone { kept } else { v } as usize]);
        let (a, b) = (area_vector(now), area_vector(then));
        if a.dot(b) < LARGEST_TURN * a.length() * b.length() {
            return false;
        }
        nearest = nearest.min(closest_on_triangle(&then, place).distance_squared(place));
    }
    let limit = LARGEST_SAGITTA * patch.size[gone as usize];
    nearest <= limit * limit
}
