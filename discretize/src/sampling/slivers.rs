//! What lies between tetrahedra with corners on the surface of a body and that surface.

use crate::mesh::Mesh;
use crate::sampling::{Middles, Solid};

/// Bound of `λ`: triangles straight across a crease of the angle δ cut off `1 / sin(δ/2)` times what distances say, so 1 holds to 60
/// degrees. Boxes and organs want -0.3 to 0.4; what would need more is a part that was lost, which is not given to others.
const LARGEST: f64 = 1.0;

/// Adds to the volumes (m³) of nodes the slivers between a mesh's surface and that of the tetrahedra, `surface`, whose corners lie on it.
///
/// `d` (m) is the distance of the surface from an edge's middle, negative in hollows. Over a triangle of the area `A` it is taken for the
/// quadratic that vanishes at the corners a, b, c, so that `v_a = A/15 Σ (2 d_ab + 2 d_ca + d_bc)` falls to a over its triangles. Across
/// creases more lies behind a distance. So `V_a += v_a + λ w_a`, with `w` of `|d|` and the one `λ` that gives all nodes together the
/// mesh's volume. Where hollows take `x` of a node, `V²/(V + x)` is left: `V - x` but for the second order, and positive.
pub(crate) fn add_slivers(solid: &Solid, surface: &Mesh, volumes: &mut [f64]) {
    let Some(mesh) = solid.mesh() else { return };
    let middles = Middles::new(solid, &surface.vertices, &surface.triangles);
    let mut slivers = vec![(0.0, 0.0); volumes.len()];
    for (at, triangle) in surface.triangles.iter().enumerate() {
        let normal = surface.area_vector(at);
        for (side, off) in middles.of(*triangle).into_iter().enumerate() {
            let volume = off.length().copysign(off.dot(normal)) * normal.length() / 15.0;
            for (corner, node) in triangle.iter().enumerate() {
                let share = if corner == (side + 2) % 3 { 1.0 } else { 2.0 };
                let (signed, size) = &mut slivers[*node as usize];
                *signed += share * volume;
                *size += share * volume.abs();
            }
        }
    }
    let missing = mesh.volume() - volumes.iter().sum::<f64>();
    let signed: f64 = slivers.iter().map(|(signed, _)| signed).sum();
    let size: f64 = slivers.iter().map(|(_, size)| size).sum();
    if size == 0.0 {
        return;
    }
    let lambda = ((missing - signed) / size).clamp(-LARGEST, LARGEST);
    for (volume, (signed, size)) in volumes.iter_mut().zip(slivers) {
        let sliver = signed + lambda * size;
        *volume *= if sliver > 0.0 {
            1.0 + sliver / *volume
        } else {
            *volume / (*volume - sliver)
        };
    }
    if lambda.abs() < LARGEST {
        // Round-off, and the second order of hollows.
        let scale = mesh.volume() / volumes.iter().sum::<f64>();
        volumes.iter_mut().for_each(|volume| *volume *= scale);
    }
}
