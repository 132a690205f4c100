//! Blocks cut into six tetrahedra per cell (Kuhn), with nodal volumes, boundary vectors and edges, without stencils.

use glam::DVec3;

pub use crate::block::Block;
use crate::cloud::Random;

/// Box of `cells[k]` cells per axis, `spacing` apart, from the origin; nodes inside are moved by up
/// to `jitter · spacing` per axis, nodes on a face stay on it. All cells have the same diagonal.
#[must_use]
pub fn kuhn_block(cells: [usize; 3], spacing: f64, jitter: f64, seed: u64) -> Block {
    let size = DVec3::from_array(cells.map(|count| count as f64)) * spacing;
    let positions = jittered_lattice(cells, size, jitter, seed);
    from_tetrahedra(positions, six_tetrahedra(cells, false))
}

/// Box `[0, size]` of `cells` in the same way, with diagonals that are mirrored from cell to cell.
#[must_use]
pub fn mirrored_block(cells: [usize; 3], size: DVec3, jitter: f64, seed: u64) -> Block {
    let positions = jittered_lattice(cells, size, jitter, seed);
    from_tetrahedra(positions, six_tetrahedra(cells, true))
}

/// Volumes, boundary vectors, surface and edges of positively oriented tetrahedra.
#[must_use]
pub fn from_tetrahedra(positions: Vec<DVec3>, tetrahedra: Vec<[u32; 4]>) -> Block {
    let n = positions.len();
    let mut volumes = vec![0.0; n];
    for t in &tetrahedra {
        let [a, b, c, d] = t.map(|v| positions[v as usize]);
        let volume = (b - a).cross(c - a).dot(d - a) / 24.0;
        for &v in t {
            volumes[v as usize] += volume;
        }
    }
    let triangles = boundary_triangles(&tetrahedra);
    let mut boundary_vectors = vec![DVec3::ZERO; n];
    for t in &triangles {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        let area = (b - a).cross(c - a) / 6.0;
        for &v in t {
            boundary_vectors[v as usize] += area;
        }
    }
    let (offsets, indices) = edge_graph(n, &tetrahedra);
    Block {
        positions,
        tetrahedra,
        volumes,
        boundary_vectors,
        triangles,
        offsets,
        indices,
        ..Block::default()
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
pub fn graded(cells: usize, seed: u64) -> Block {
    let plain = kuhn_block([cells; 3], (cells as f64).recip(), 0.2, seed);
    let push = |s: f64| 0.35 * s + 0.65 * s * s * s;
    mapped(&plain, |x| DVec3::new(push(x.x), push(x.y), push(x.z)))
}

/// A jittered block bent into a flattened bean: an organ's proportions, no flat face.
#[must_use]
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

/// Lattice of `cells + 1` nodes per axis, `jitter` in cell sizes, faces kept flat.
fn jittered_lattice(cells: [usize; 3], size: DVec3, jitter: f64, seed: u64) -> Vec<DVec3> {
    let mut random = Random::new(seed);
    let step = size / DVec3::from_array(cells.map(|count| count as f64));
    let mut positions = Vec::new();
    for k in 0..=cells[2] {
        for j in 0..=cells[1] {
            for i in 0..=cells[0] {
                let mut at = DVec3::new(i as f64, j as f64, k as f64);
                let shift = random.vector(jitter);
                for (axis, index) in [i, j, k].into_iter().enumerate() {
                    if index > 0 && index < cells[axis] {
                        at[axis] += shift[axis];
                    }
                }
                positions.push(at * step);
            }
        }
    }
    positions
}

/// Six tetrahedra per cell around a diagonal, mirrored from cell to cell or not.
fn six_tetrahedra(cells: [usize; 3], mirrored: bool) -> Vec<[u32; 4]> {
    let mut tetrahedra = Vec::new();
    let orders = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let id = |value: usize| u32::try_from(value).expect("test bodies are small");
    let node = |at: [usize; 3]| id(at[0] + (cells[0] + 1) * (at[1] + (cells[1] + 1) * at[2]));
    for k in 0..cells[2] {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                let cell = [i, j, k];
                let turned = cell.map(|c| if mirrored { c % 2 } else { 0 });
                let low = [0, 1, 2].map(|axis| cell[axis] + turned[axis]);
                let high = [0, 1, 2].map(|axis| cell[axis] + 1 - turned[axis]);
                for order in orders {
                    let mut at = low;
                    let mut t = [node(at); 4];
                    for (corner, axis) in order.into_iter().enumerate() {
                        at[axis] = high[axis];
                        t[corner + 1] = node(at);
                    }
                    // Odd orders and every mirrored axis turn it over.
                    let odd = usize::from(order[1] != (order[0] + 1) % 3);
                    if (odd + turned.iter().sum::<usize>()) % 2 == 1 {
                        t.swap(2, 3);
                    }
                    tetrahedra.push(t);
                }
            }
        }
    }
    tetrahedra
}

/// Faces that belong to one tetrahedron only, outward.
fn boundary_triangles(tetrahedra: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let mut faces = Vec::new();
    for &[a, b, c, d] in tetrahedra {
        for face in [[b, c, d], [a, d, c], [a, b, d], [a, c, b]] {
            let mut key = face;
            key.sort_unstable();
            faces.push((key, face));
        }
    }
    faces.sort_unstable();
    let alone = |k: usize| {
        (k == 0 || faces[k - 1].0 != faces[k].0)
            && (k + 1 == faces.len() || faces[k + 1].0 != faces[k].0)
    };
    let outer = (0..faces.len()).filter(|&k| alone(k));
    outer.map(|k| faces[k].1).collect()
}

/// Symmetric graph of the tetrahedra's edges.
fn edge_graph(node_count: usize, tetrahedra: &[[u32; 4]]) -> (Vec<u32>, Vec<u32>) {
    let mut edges = Vec::new();
    for t in tetrahedra {
        for &a in t {
            edges.extend(t.iter().filter(|&&b| b != a).map(|&b| (a, b)));
        }
    }
    edges.sort_unstable();
    edges.dedup();
    let mut offsets = vec![0_u32; node_count + 1];
    for &(a, _) in &edges {
        offsets[a as usize + 1] += 1;
    }
    for i in 0..node_count {
        offsets[i + 1] += offsets[i];
    }
    (offsets, edges.into_iter().map(|(_, b)| b).collect())
}
