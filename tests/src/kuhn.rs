//! A block of tetrahedra with everything a nodal method needs, made without any other crate.

use glam::DVec3;

use crate::cloud;

/// A box cut into six tetrahedra per cell (Kuhn), with nodal volumes, boundary vectors and edges.
#[derive(Debug, Clone)]
pub struct Block {
    /// Node positions (m), z slowest.
    pub positions: Vec<DVec3>,
    /// Corners, positively oriented.
    pub tetrahedra: Vec<[u32; 4]>,
    /// A quarter of the adjacent tetrahedra's volumes per node (m³).
    pub volumes: Vec<f64>,
    /// A third of the adjacent surface triangles' outward area vectors per node (m²).
    pub boundary_vectors: Vec<DVec3>,
    /// Surface triangles, outward.
    pub surface: Vec<[u32; 3]>,
    /// Row starts of the graph of edges.
    pub offsets: Vec<u32>,
    /// Neighbours by edges, rows sorted.
    pub indices: Vec<u32>,
}

/// Box of `cells[k]` cells per axis, `spacing` apart, from the origin; nodes inside are moved by up
/// to `jitter · spacing` per axis, nodes on a face stay on it.
#[must_use]
#[allow(clippy::cast_possible_truncation, reason = "counts of tests are small")]
pub fn kuhn_block(cells: [usize; 3], spacing: f64, jitter: f64, seed: u64) -> Block {
    let n = [cells[0] + 1, cells[1] + 1, cells[2] + 1];
    let mut positions = cloud::lattice(n, spacing, 0.0, 0);
    let moved = cloud::lattice(n, spacing, jitter, seed);
    let id = |i: usize, j: usize, k: usize| i + n[0] * (j + n[1] * k);
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                let node = id(i, j, k);
                let free = |at: usize, axis: usize| at > 0 && at < cells[axis];
                if free(i, 0) {
                    positions[node].x = moved[node].x;
                }
                if free(j, 1) {
                    positions[node].y = moved[node].y;
                }
                if free(k, 2) {
                    positions[node].z = moved[node].z;
                }
            }
        }
    }
    let mut tetrahedra = Vec::new();
    for k in 0..cells[2] {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                for order in [
                    [0, 1, 2],
                    [1, 2, 0],
                    [2, 0, 1],
                    [0, 2, 1],
                    [2, 1, 0],
                    [1, 0, 2],
                ] {
                    let mut at = [i, j, k];
                    let mut corners = [id(i, j, k) as u32; 4];
                    for (corner, axis) in corners[1..].iter_mut().zip(order) {
                        at[axis] += 1;
                        *corner = id(at[0], at[1], at[2]) as u32;
                    }
                    let even = [[0, 1, 2], [1, 2, 0], [2, 0, 1]].contains(&order);
                    if !even {
                        corners.swap(2, 3);
                    }
                    tetrahedra.push(corners);
                }
            }
        }
    }
    from_tetrahedra(positions, tetrahedra)
}

/// Volumes, boundary vectors, surface and edges of positively oriented tetrahedra.
#[must_use]
#[allow(clippy::cast_possible_truncation, reason = "counts of tests are small")]
pub fn from_tetrahedra(positions: Vec<DVec3>, tetrahedra: Vec<[u32; 4]>) -> Block {
    let count = positions.len();
    let mut volumes = vec![0.0; count];
    let mut faces = Vec::new();
    let mut edges = Vec::new();
    for t in &tetrahedra {
        let p = t.map(|v| positions[v as usize]);
        let volume = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]) / 6.0;
        for &v in t {
            volumes[v as usize] += volume / 4.0;
            edges.extend(
                t.iter()
                    .filter(|&&other| other != v)
                    .map(|&other| (v, other)),
            );
        }
        for face in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]] {
            let face = face.map(|k: usize| t[k]);
            let mut key = face;
            key.sort_unstable();
            faces.push((key, face));
        }
    }
    faces.sort_unstable();
    let mut boundary_vectors = vec![DVec3::ZERO; count];
    let mut surface = Vec::new();
    for (place, &(key, face)) in faces.iter().enumerate() {
        let twin = |other: Option<&([u32; 3], [u32; 3])>| other.is_some_and(|o| o.0 == key);
        let before = if place > 0 {
            faces.get(place - 1)
        } else {
            None
        };
        if twin(before) || twin(faces.get(place + 1)) {
            continue;
        }
        let p = face.map(|v| positions[v as usize]);
        let area = (p[1] - p[0]).cross(p[2] - p[0]) / 2.0;
        for v in face {
            boundary_vectors[v as usize] += area / 3.0;
        }
        surface.push(face);
    }
    edges.sort_unstable();
    edges.dedup();
    let mut offsets = vec![0_u32; count + 1];
    for &(from, _) in &edges {
        offsets[from as usize + 1] += 1;
    }
    for node in 0..count {
        offsets[node + 1] += offsets[node];
    }
    let indices = edges.into_iter().map(|(_, to)| to).collect();
    Block {
        positions,
        tetrahedra,
        volumes,
        boundary_vectors,
        surface,
        offsets,
        indices,
    }
}

/// A block with every node moved by a map that turns no tetrahedron over.
#[must_use]
pub fn mapped(block: &Block, map: impl Fn(DVec3) -> DVec3) -> Block {
    let positions = block.positions.iter().map(|&x| map(x)).collect();
    from_tetrahedra(positions, block.tetrahedra.clone())
}

/// The jittered block `[0, 1]³` with coordinates pushed towards the origin, cells 3 times smaller there.
#[must_use]
#[allow(clippy::cast_precision_loss, reason = "cells are few")]
pub fn graded(cells: usize, seed: u64) -> Block {
    let plain = kuhn_block([cells; 3], (cells as f64).recip(), 0.2, seed);
    let push = |s: f64| 0.35 * s + 0.65 * s * s * s;
    mapped(&plain, |x| DVec3::new(push(x.x), push(x.y), push(x.z)))
}

/// A jittered block bent into a flattened bean: an organ's proportions, no flat face.
#[must_use]
#[allow(clippy::cast_precision_loss, reason = "cells are few")]
pub fn organ(cells: [usize; 3], seed: u64) -> Block {
    let plain = kuhn_block(cells, 1.0, 0.2, seed);
    let size = DVec3::from_array(cells.map(|c| c as f64));
    let round = |a: f64, b: f64| (1.0 - a / 2.0 - b / 2.0 + a * b / 3.0).sqrt();
    mapped(&plain, |x| {
        let s = x / size * 2.0 - 1.0;
        // The cube to a ball, the ball to a bean.
        let q = s * s;
        let ball = s * DVec3::new(round(q.y, q.z), round(q.z, q.x), round(q.x, q.y));
        DVec3::new(
            1.6 * ball.x,
            0.8 * ball.y + 0.5 * ball.x * ball.x,
            0.6 * ball.z,
        )
    })
}
