//! Points with normals and areas on a surface.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::{Creased, Mesh, SurfaceSamples, index};
use crate::sampling::{Near, Solid};

/// Candidates drawn per surfel kept.
const CANDIDATES: usize = 6;
/// Cosine below which two normals are those of opposite sides of a thin part.
const SAME_SIDE: f64 = -0.5;
/// Rejection radius of the first sweep, over the spacing of a hexagonal packing.
const FIRST_RADIUS: f64 = 0.82;

/// Puts about `count` surfels evenly on a surface (the result is within a few percent; its
/// length is the count). The areas sum to the mesh's area exactly up to round-off.
///
/// Candidates are drawn by area with a stratified low-discrepancy sequence and accepted if no
/// earlier one is nearer than a radius, which starts near the densest packing and shrinks until the
/// count is reached (Poisson discs by dart throwing, Cook 1986). Each candidate then gives its area
/// to the nearest surfel.
///
/// `exact`: the body the mesh approximates; positions are moved onto it and normals taken from it. A
/// body given by a mesh is taken for a smooth surface with creases, where faces meet at more than
/// 40°: normals are interpolated between those at the corners of its triangles. Without `exact` they
/// are those of the triangles.
///
/// # Panics
/// If a triangle names a vertex out of range.
#[must_use]
pub fn sample_surfels(mesh: &Mesh, count: usize, exact: Option<&Solid>) -> SurfaceSamples {
    let area = mesh.area();
    if count == 0 || area <= 0.0 || area.is_nan() {
        return SurfaceSamples::default();
    }
    let candidates = draw(mesh, area, count * CANDIDATES);
    let packed = (area / count as f64 * 2.0 / 3.0_f64.sqrt()).sqrt();
    let mut kept: Vec<u32> = Vec::with_capacity(count);
    // Squared distance (m²) from a candidate to a surfel that it was rejected for, and 0 for a surfel: both stay.
    let mut apart = vec![f64::INFINITY; candidates.len()];
    let mut radius = FIRST_RADIUS * packed;
    let mut tree = Near::default();
    while kept.len() < count && radius > 0.3 * packed {
        for (i, candidate) in candidates.iter().enumerate() {
            if kept.len() == count {
                break;
            }
            if apart[i] < radius * radius {
                continue;
            }
            let alike =
                |id: &u32| candidates[*id as usize].normal.dot(candidate.normal) > SAME_SIDE;
            if let Some(near) = tree.within(candidate.position, radius).find(alike) {
                let near = candidates[near as usize].position;
                apart[i] = near.distance_squared(candidate.position);
            } else {
                apart[i] = 0.0;
                kept.push(index(i));
                tree.insert(candidate.position, index(i));
            }
        }
        radius *= 0.95;
    }
    let chosen = kept.iter().map(|&i| candidates[i as usize]);
    let mut surfels = SurfaceSamples {
        positions: chosen.clone().map(|candidate| candidate.position).collect(),
        normals: chosen.map(|candidate| candidate.normal).collect(),
        areas: vec![0.0; kept.len()],
    };
    let mut place = vec![u32::MAX; candidates.len()];
    for (k, &i) in kept.iter().enumerate() {
        place[i as usize] = index(k);
    }
    let share = area / candidates.len() as f64;
    let owner = |(i, candidate): (usize, &Candidate)| match place[i] {
        u32::MAX => place[nearest(&tree, &candidates, candidate, apart[i]) as usize],
        own => own,
    };
    let owners: Vec<u32> = (candidates.par_iter().enumerate()).map(owner).collect();
    for owner in owners {
        surfels.areas[owner as usize] += share;
    }
    if let Some(solid) = exact {
        let given = solid.mesh().zip(solid.hierarchy());
        let creased = given.map(|(mesh, hierarchy)| Creased::new(mesh, hierarchy));
        let all = (surfels.positions.par_iter_mut()).zip(&mut surfels.normals);
        all.for_each(|(position, normal)| {
            *position = solid.project(*position);
            let exact = match &creased {
                Some(creased) => creased.normal(*position),
                None => solid.normal(*position),
            };
            if exact != DVec3::ZERO {
                *normal = exact;
            }
        });
    }
    surfels
}

#[derive(Debug, Clone, Copy)]
struct Candidate {
    position: DVec3,
    normal: DVec3,
}

/// Points spread over the triangles by area: the k-th takes the area quantile `(k + 1/2)/n`, its
/// position in the triangle from the R2 sequence (Roberts 2018); then shuffled by a fixed stride.
fn draw(mesh: &Mesh, area: f64, n: usize) -> Vec<Candidate> {
    const R2: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3];
    let mut out = Vec::with_capacity(n);
    let mut triangle = 0;
    let mut vector = mesh.area_vector(0);
    let mut reached = vector.length();
    for k in 0..n {
        let wanted = (k as f64 + 0.5) / n as f64 * area;
        while reached < wanted && triangle + 1 < mesh.triangles.len() {
            triangle += 1;
            vector = mesh.area_vector(triangle);
            reached += vector.length();
        }
        let [a, b, c] = mesh.corners(triangle);
        let (mut u, mut v) = (
            (0.5 + R2[0] * k as f64).fract(),
            (0.5 + R2[1] * k as f64).fract(),
        );
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        out.push(Candidate {
            position: a + u * (b - a) + v * (c - a),
            normal: vector.normalize_or_zero(),
        });
    }
    shuffle(&mut out);
    out
}

/// Fisher-Yates with `SplitMix64` from a fixed seed.
#[allow(
    clippy::cast_possible_truncation,
    reason = "reduced below the length before"
)]
fn shuffle<T>(items: &mut [T]) {
    let mut state = 0x5eed_u64;
    for i in (1..items.len()).rev() {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        items.swap(i, (z % (i as u64 + 1)) as usize);
    }
}

/// The nearest inserted point of the same side, of any side if there is none; one is known within a squared distance (m²).
fn nearest(tree: &Near, all: &[Candidate], of: &Candidate, within: f64) -> u32 {
    let alike = |id: &u32| all[*id as usize].normal.dot(of.normal) > SAME_SIDE;
    // Points in a ball come faster out of the tree than points in order.
    if within.is_finite() {
        let squared = |id: u32| all[id as usize].position.distance_squared(of.position);
        let ball = tree.within(of.position, within.sqrt()).filter(alike);
        let mut near: Vec<(f64, u32)> = ball.map(|id| (squared(id), id)).collect();
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        if let [first, rest @ ..] = &near[..]
            && rest.first().is_none_or(|next| first.0 < next.0)
        {
            return first.1;
        }
    }
    let found = tree.ascending(of.position).find(alike);
    found.unwrap_or_else(|| tree.nearest(of.position))
}
