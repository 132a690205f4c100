//! What lies between tetrahedra with corners on the surface of a body and that surface.

use crate::mesh::Mesh;
use crate::sampling::{Middles, Solid};

/// Largest `|λ|`. Boxes and organs want -0.3 to 0.4. What wants more has lost a part (a fin: 2.2), or has a mesh that counts some of its
/// volume twice (a cube with a buried one of 0.4 of its size: 1.4). Without a bound that cube has 6.4 % too much mass.
const LARGEST: f64 = 0.5;

/// Adds to the volumes (m³) of nodes the slivers between a mesh's surface and that of the tetrahedra, `surface`, whose corners lie on it.
///
/// `d` (m) is the distance of the surface from an edge's middle, negative in hollows. Over a triangle of the area `A` it is taken for the
/// quadratic that vanishes at the corners a, b, c, so that `v_a = A/15 Σ (2 d_ab + 2 d_ca + d_bc)` falls to a over its triangles. Across
/// creases more lies behind a distance. So `V_a += v_a + λ w_a`, with `w` of `|d|` and the one `λ` that gives all nodes together the
/// mesh's volume; 0 where that is beyond [`LARGEST`]. So the volume of small lost parts is spread over all surface nodes. Where
/// hollows take `x` of a node, `V²/(V + x)` is left: `V - x` but for the second order, and positive.
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
    let wanted = (missing - signed) / size;
    let is_sound = wanted.abs() <= LARGEST;
    let lambda = if is_sound { wanted } else { 0.0 };
    for (volume, (signed, size)) in volumes.iter_mut().zip(slivers) {
        let sliver = signed + lambda * size;
        *volume *= if sliver > 0.0 {
            1.0 + sliver / *volume
        } else {
            *volume / (*volume - sliver)
        };
    }
    if is_sound {
        // Round-off, and the second order of hollows.
        let scale = mesh.volume() / volumes.iter().sum::<f64>();
        volumes.iter_mut().for_each(|volume| *volume *= scale);
    }
}
