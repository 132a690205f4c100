//! Regular lattices of nodes in a box.

use glam::UVec3;

use crate::mesh::{Bounds, tetrahedron_volume};
use crate::sampling::{SampleError, SampledNodes, Solid, Stuffed, finish};

/// Most nodes of a lattice: its tetrahedra take 100 bytes for each.
const MOST_NODES: f64 = 1e7;

/// Ways from a cell's first corner to its last along the three axes: one tetrahedron each.
const WAYS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
];

/// Six tetrahedra for each cell of a lattice, mirrored from cell to cell so that no diagonal is preferred
/// (Kuhn's division); of positive volume where x, y and z are right-handed.
///
/// # Arguments
/// * `counts` -- nodes along x, y and z; nodes are numbered along x first, then y.
///
/// # Examples
/// ```
/// assert_eq!(phyxel_discretize::lattice_tetrahedra([3, 2, 2]).len(), 12);
/// ```
#[must_use]
pub fn lattice_tetrahedra(counts: [u32; 3]) -> Vec<[u32; 4]> {
    let [nx, ny, nz] = counts;
    let mut tetrahedra = Vec::new();
    for k in 1..nz {
        for j in 1..ny {
            for i in 1..nx {
                let cell = [i - 1, j - 1, k - 1];
                // Odd cells are seen in a mirror.
                let place =
                    |at: [u32; 3]| [0, 1, 2].map(|axis| cell[axis] + (at[axis] ^ cell[axis] & 1));
                let number = |[a, b, c]: [u32; 3]| a + nx * (b + ny * c);
                for way in WAYS {
                    let mut at = [0; 3];
                    let mut corners = [place(at); 4];
                    for (corner, axis) in corners[1..].iter_mut().zip(way) {
                        at[axis] = 1;
                        *corner = place(at);
                    }
                    let points = corners.map(|corner| UVec3::from_array(corner).as_dvec3());
                    if tetrahedron_volume(points) < 0.0 {
                        corners.swap(2, 3);
                    }
                    tetrahedra.push(corners.map(number));
                }
            }
        }
    }
    tetrahedra
}

/// Samples a box with a regular lattice of nodes, its corners, edges and faces included, and the
/// tetrahedra of [`lattice_tetrahedra`].
///
/// # Arguments
/// * `bounds` -- the box.
/// * `counts` -- nodes along x, y and z.
///
/// # Errors
/// [`SampleError::Lattice`] for fewer than two nodes along an axis or ten million in all.
pub fn sample_lattice(bounds: Bounds, counts: [u32; 3]) -> Result<SampledNodes, SampleError> {
    let nodes: f64 = counts.iter().map(|count| f64::from(*count)).product();
    if counts.iter().any(|count| *count < 2) || nodes > MOST_NODES {
        return Err(SampleError::Lattice {
            counts,
            limit: MOST_NODES,
        });
    }
    let cells = UVec3::from_array(counts) - UVec3::ONE;
    let cell = bounds.size() / cells.as_dvec3();
    let (mut positions, mut on_surface) = (Vec::new(), Vec::new());
    for z in 0..counts[2] {
        for y in 0..counts[1] {
            for x in 0..counts[0] {
                let at = UVec3::new(x, y, z);
                let share = at.as_dvec3() / cells.as_dvec3();
                positions.push(bounds.min + share * bounds.size());
                on_surface.push((at.cmpeq(UVec3::ZERO) | at.cmpeq(cells)).any());
            }
        }
    }
    let solid = Solid::from(bounds);
    let stuffed = Stuffed {
        size: vec![cell.max_element(); positions.len()],
        positions,
        on_surface,
        tetrahedra: lattice_tetrahedra(counts),
        parts_hit: Vec::new(),
    };
    finish(&solid, stuffed, cell.max_element())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_lattice_fills_its_box_with_the_nodes_asked_for() {
        let bounds = Bounds::new(
            DVec3::new(-0.035, -0.035, -0.105),
            DVec3::new(0.035, 0.035, 0.105),
        );
        let found = sample_lattice(bounds, [8, 8, 22]).unwrap();
        assert_eq!(found.positions.len(), 1_408);
        assert_eq!(found.tetrahedra.len(), 6 * 7 * 7 * 21);
        assert_eq!(found.report.surface_nodes, 1_408 - 6 * 6 * 20);
        let volume = found.volumes.iter().sum::<f64>() / (0.07 * 0.07 * 0.21);
        assert!((volume - 1.0).abs() < 1e-12, "{volume} of its volume");
        let area = found.report.area / (2.0 * 0.07 * 0.07 + 4.0 * 0.07 * 0.21);
        assert!((area - 1.0).abs() < 1e-12, "{area} of its area");
        assert_eq!(found.report.quality.inverted, 0);
        for p in &found.positions {
            let place = (*p - bounds.min) / 0.01;
            let off = place.distance(place.round());
            assert!(off < 1e-12, "{p} is no lattice point");
        }
    }

    /// A large body's rows read a few layers, whatever its nodes were called before; a small one follows a curve.
    #[test]
    fn many_nodes_are_ordered_in_layers() {
        let bounds = Bounds::new(DVec3::ZERO, DVec3::new(5.0, 1.0, 1.0));
        let farthest = |counts: [u32; 3]| {
            let sampling = sample_lattice(bounds, counts).unwrap();
            let spans = sampling.tetrahedra.iter().map(|t| {
                let ends = [t.iter().min(), t.iter().max()].map(|end| end.copied().unwrap_or(0));
                ends[1] - ends[0]
            });
            spans.max().unwrap_or(0)
        };
        let layer = 15 * 15;
        assert!(farthest([92, 15, 15]) < 4 * layer, "in layers");
        assert!(farthest([80, 15, 15]) > 8 * layer, "along a curve");
    }

    #[test]
    fn thin_and_huge_lattices_are_refused() {
        let bounds = Bounds::new(DVec3::ZERO, DVec3::ONE);
        for counts in [[1, 8, 8], [8, 8, 0], [3_000, 3_000, 3_000]] {
            let refused = sample_lattice(bounds, counts);
            testkit::assert_matches!(refused, Err(SampleError::Lattice { .. }));
        }
    }
}
