//! Volumes, boundary vectors, edges and boundary of tetrahedra.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::{Groups, area_vector, index};

/// Signed volume of a tetrahedron, positive if d lies where the right-hand thumb of a, b, c points.
#[must_use]
pub fn tetrahedron_volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

/// Nodal volumes `V_i = sum of V_T / 4` over the tetrahedra at i.
///
/// # Panics
/// If a tetrahedron names a node out of range.
#[must_use]
pub fn nodal_volumes(positions: &[DVec3], tetrahedra: &[[u32; 4]]) -> Vec<f64> {
    let mut volumes = vec![0.0; positions.len()];
    for tetrahedron in tetrahedra {
        let quarter = 0.25 * tetrahedron_volume(tetrahedron.map(|v| positions[v as usize]));
        for &v in tetrahedron {
            volumes[v as usize] += quarter;
        }
    }
    volumes
}

/// Nodal boundary vectors `b_i = sum of n_t A_t / 3` over the surface triangles at i (outward);
/// zero inside. `sum b_i = 0` and `sum b_i (x) X_i = V I` by the divergence theorem.
///
/// # Panics
/// If a triangle names a node out of range.
#[must_use]
pub fn nodal_boundary_vectors(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    let mut vectors = vec![DVec3::ZERO; positions.len()];
    for triangle in triangles {
        let third = area_vector(triangle.map(|v| positions[v as usize])) / 3.0;
        for &v in triangle {
            vectors[v as usize] += third;
        }
    }
    vectors
}

/// Gives the boundary vectors of pieces of tetrahedra, joined through nodes, the volumes that their nodes have in place of
/// [`nodal_volumes`], so that `sum b_i (x) X_i = (sum V_i) I` in each; how many pieces there are.
pub(crate) fn fit_boundary(
    positions: &[DVec3],
    tetrahedra: &[[u32; 4]],
    volumes: &[f64],
    vectors: &mut [DVec3],
) -> usize {
    let mut pieces = Groups::new(positions.len());
    for t in tetrahedra {
        for &other in &t[1..] {
            pieces.join(t[0], other);
        }
    }
    let (piece_of, count) = pieces.numbers(0..index(positions.len()));
    let mut sums = vec![(0.0, 0.0); count];
    let own = nodal_volumes(positions, tetrahedra);
    for ((piece, volume), own) in piece_of.iter().zip(volumes).zip(own) {
        let sums = &mut sums[*piece as usize];
        *sums = (sums.0 + volume, sums.1 + own);
    }
    for (vector, piece) in vectors.iter_mut().zip(piece_of) {
        let (now, own) = sums[piece as usize];
        if own > 0.0 {
            *vector *= now / own;
        }
    }
    count
}

/// Faces of positive tetrahedra that only one of them has, outward, sorted by their corners.
/// `candidate` may rule out nodes that lie on no such face (return true where not known).
#[must_use]
pub fn boundary_triangles(
    tetrahedra: &[[u32; 4]],
    candidate: impl Fn(u32) -> bool + Sync,
) -> Vec<[u32; 3]> {
    let mut faces: Vec<([u32; 3], [u32; 3])> = tetrahedra
        .par_iter()
        .flat_map_iter(|&[a, b, c, d]| [[b, c, d], [a, d, c], [a, b, d], [a, c, b]])
        .filter(|face| face.iter().all(|v| candidate(*v)))
        .map(|face| {
            let mut key = face;
            key.sort_unstable();
            (key, face)
        })
        .collect();
    faces.par_sort_unstable();
    let mut out = Vec::new();
    for group in faces.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, face)] = group {
            out.push(*face);
        }
    }
    out
}

/// Entries by row: where each row starts and where the last ends, and the rows one after the other, each in
/// the order in which it was given.
pub(crate) fn rows<T: Copy + Default>(
    count: usize,
    entries: impl Iterator<Item = (u32, T)> + Clone,
) -> (Vec<usize>, Vec<T>) {
    let mut offsets = vec![0; count + 1];
    for (row, _) in entries.clone() {
        offsets[row as usize + 1] += 1;
    }
    for i in 0..count {
        offsets[i + 1] += offsets[i];
    }
    let mut next = offsets.clone();
    let mut values = vec![T::default(); offsets[count]];
    for (row, value) in entries {
        values[next[row as usize]] = value;
        next[row as usize] += 1;
    }
    (offsets, values)
}

/// The graph of tetrahedra's edges as symmetric CSR without self entries: `offsets`
/// (`node_count + 1`) and `indices`, rows sorted.
///
/// # Panics
/// If a tetrahedron names a node out of range, or more than `u32::MAX` pairs arise.
#[must_use]
pub fn tetrahedra_edges(node_count: usize, tetrahedra: &[[u32; 4]]) -> (Vec<u32>, Vec<u32>) {
    for &v in tetrahedra.iter().flatten() {
        let known = (v as usize) < node_count;
        assert!(known, "tetrahedron names node {v} of {node_count}");
    }
    // Every tetrahedron writes its three neighbours into the rows of its corners; rows are then
    // sorted and made unique.
    let sides = |t: &[u32; 4]| {
        let t = *t;
        (0..12).map(move |k| (t[k / 3], t[(k / 3 + k % 3 + 1) % 4]))
    };
    let (start, mut raw) = rows(node_count, tetrahedra.iter().flat_map(sides));
    let mut offsets = Vec::with_capacity(node_count + 1);
    let mut indices = Vec::with_capacity(raw.len() / 4);
    offsets.push(0);
    for i in 0..node_count {
        let row = &mut raw[start[i]..start[i + 1]];
        row.sort_unstable();
        let begin = indices.len();
        for &j in row.iter() {
            if indices.len() == begin || indices.last() != Some(&j) {
                indices.push(j);
            }
        }
        offsets.push(index(indices.len()));
    }
    (offsets, indices)
}
