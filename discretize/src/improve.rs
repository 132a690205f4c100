//! Moving nodes near the surface so that tetrahedra get higher and rounder.
//!
//! Stuffing leaves tetrahedra whose smallest height is an eighth of the spacing; an explicit step
//! is as short as the smallest height. A few guarded sweeps raise it.

use glam::DVec3;

use crate::mesh::index;
use crate::solid::Solid;
use crate::stuffing::Stuffed;

/// Height over cell at which a tetrahedron is good enough (a lattice tetrahedron has 0.71).
const GOOD_HEIGHT: f64 = 0.4;
/// Sine of the dihedral angle that is good enough (35 degrees).
const GOOD_SINE: f64 = 0.57;
/// Fractions of the way to the middle of the neighbours that are tried.
const STEPS: [f64; 3] = [1.0, 0.5, 0.25];
/// A moved surface node must lie on the surface within this fraction of the cell.
const ON_SURFACE: f64 = 1e-9;

/// Sweeps over the nodes of bad tetrahedra in index order: a node moves toward the middle of its
/// neighbours (a surface node toward that of its surface neighbours, then back onto the surface) if
/// the worst tetrahedron at it gets better. No tetrahedron gets worse than the worst of its
/// neighbourhood was, none is turned over, no node leaves the surface.
pub(crate) fn improve(stuffed: &mut Stuffed, solid: &Solid, cell: f64, sweeps: usize) {
    let n = stuffed.positions.len();
    let mut offsets = vec![0_u32; n + 1];
    for &v in stuffed.tetrahedra.iter().flatten() {
        offsets[v as usize + 1] += 1;
    }
    for i in 0..n {
        offsets[i + 1] += offsets[i];
    }
    let mut fill = offsets.clone();
    let mut around = vec![0_u32; stuffed.tetrahedra.len() * 4];
    for (t, corners) in stuffed.tetrahedra.iter().enumerate() {
        for &v in corners {
            around[fill[v as usize] as usize] = index(t);
            fill[v as usize] += 1;
        }
    }
    for _ in 0..sweeps {
        let mut moved = false;
        for v in 0..n {
            let own = &around[offsets[v] as usize..offsets[v + 1] as usize];
            moved |= improve_node(stuffed, solid, cell, v, own);
        }
        if !moved {
            break;
        }
    }
}

fn improve_node(stuffed: &mut Stuffed, solid: &Solid, cell: f64, v: usize, own: &[u32]) -> bool {
    let before = stuffed.positions[v];
    let worst_now = worst(stuffed, cell, own, f64::NEG_INFINITY);
    if worst_now >= 1.0 {
        return false;
    }
    let on_surface = stuffed.on_surface[v];
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for &t in own {
        for &other in &stuffed.tetrahedra[t as usize] {
            let other = other as usize;
            if other != v && (!on_surface || stuffed.on_surface[other]) {
                sum += stuffed.positions[other];
                count += 1.0;
            }
        }
    }
    if count == 0.0 {
        return false;
    }
    let middle = sum / count;
    for step in STEPS {
        let mut place = before + step * (middle - before);
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
        stuffed.positions[v] = place;
        if worst(stuffed, cell, own, worst_now) > worst_now {
            return true;
        }
    }
    stuffed.positions[v] = before;
    false
}

/// Goodness of the worst tetrahedron of a list; stops early at or below `enough`.
fn worst(stuffed: &Stuffed, cell: f64, list: &[u32], enough: f64) -> f64 {
    let mut least = f64::INFINITY;
    for &t in list {
        let corners = stuffed.tetrahedra[t as usize].map(|v| stuffed.positions[v as usize]);
        least = least.min(goodness(corners, cell));
        if least <= enough {
            break;
        }
    }
    least
}

/// The smaller of height over the good height and sine of the sharpest or flattest dihedral angle
/// over the good sine; negative if turned over.
fn goodness([a, b, c, d]: [DVec3; 4], cell: f64) -> f64 {
    let (ab, ac, ad) = (b - a, c - a, d - a);
    let normals = [
        (c - b).cross(d - b),
        ad.cross(ac),
        ab.cross(ad),
        ac.cross(ab),
    ];
    let six_volumes = ab.cross(ac).dot(ad);
    let lengths = normals.map(DVec3::length);
    let largest = lengths.into_iter().fold(0.0, f64::max);
    let height = six_volumes / (largest * cell * GOOD_HEIGHT);
    if height <= 0.0 || height.is_nan() {
        return -1.0;
    }
    let mut cosine_squared = 0.0_f64;
    for i in 0..4 {
        for j in i + 1..4 {
            let cosine = normals[i].dot(normals[j]) / (lengths[i] * lengths[j]);
            cosine_squared = cosine_squared.max(cosine * cosine);
        }
    }
    let sine = (1.0 - cosine_squared).max(0.0).sqrt() / GOOD_SINE;
    height.min(sine)
}
