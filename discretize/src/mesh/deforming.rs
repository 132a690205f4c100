//! The part of a body that can deform where supports hold whole tetrahedra.

use glam::DVec3;

use crate::mesh::{
    boundary_triangles, fit_boundary, nodal_boundary_vectors, nodal_volumes, tetrahedra_edges,
};

/// The part of a body that can deform, where a support holds whole tetrahedra: those do not, and the strain of a
/// node on their face is that of its other side. Taken for both sides it would be half of that, as if the
/// body were free up to half a spacing within the support: a liver of 622 nodes, held by a fifth of them, sags
/// 16 % too far then.
#[derive(Debug, Clone)]
pub struct DeformingPart {
    /// Volumes (m³) by the tetrahedra that can deform, shape `(n)`: that part of a node's volume. The volume of other nodes is all of it.
    pub volumes: Vec<f64>,
    /// Their boundary vectors (m²), shape `(n)`.
    pub boundary_vectors: Vec<DVec3>,
    /// Edges of those tetrahedra.
    edges: (Vec<u32>, Vec<u32>),
}

impl DeformingPart {
    /// The part of a body whose nodes have these `volumes` (m³) that deforms; `None` if all of it can. Each node has the
    /// number of its support, 0 without one; a tetrahedron whose nodes all have the same is held.
    ///
    /// # Panics
    /// If a tetrahedron names a node out of range.
    #[must_use]
    pub fn new(
        rest: &[DVec3],
        tetrahedra: &[[u32; 4]],
        volumes: &[f64],
        supports: &[u32],
    ) -> Option<Self> {
        let is_held = |tetrahedron: &[u32; 4]| {
            let [first, others @ ..] = tetrahedron.map(|node| supports[node as usize]);
            first > 0 && others.iter().all(|other| *other == first)
        };
        if !tetrahedra.iter().any(is_held) {
            return None;
        }
        let free = tetrahedra
            .iter()
            .filter(|tetrahedron| !is_held(tetrahedron));
        let free: Vec<[u32; 4]> = free.copied().collect();
        let mut part = Self {
            volumes: nodal_volumes(rest, &free),
            boundary_vectors: nodal_boundary_vectors(rest, &boundary_triangles(&free, |_| true)),
            edges: tetrahedra_edges(rest.len(), &free),
        };
        // Nodes near the surface may have more than their tetrahedra give.
        let whole = nodal_volumes(rest, tetrahedra);
        for ((own, all), whole) in part.volumes.iter_mut().zip(volumes).zip(whole) {
            *own *= all / whole;
        }
        fit_boundary(rest, &free, &part.volumes, &mut part.boundary_vectors);
        for node in part.inert() {
            part.volumes[node as usize] = volumes[node as usize];
        }
        Some(part)
    }

    /// Nodes without a tetrahedron that can deform, ascending.
    #[must_use]
    pub fn inert(&self) -> Vec<u32> {
        let nodes = (0_u32..).zip(self.edges.0.windows(2));
        let inert = nodes.filter(|(_, ends)| ends[0] == ends[1]);
        inert.map(|(node, _)| node).collect()
    }

    /// Takes the weights of a graph from pairs of one support that no tetrahedron that can deform joins, and from all pairs
    /// of nodes without any.
    ///
    /// # Panics
    /// If the graph has other nodes, or not a weight per pair.
    pub fn uncouple(
        &self,
        supports: &[u32],
        (offsets, indices): (&[u32], &[u32]),
        weights: &mut [f64],
    ) {
        let (starts, all) = &self.edges;
        let joined = |node: usize| &all[starts[node] as usize..starts[node + 1] as usize];
        for node in 0..supports.len() {
            for pair in offsets[node] as usize..offsets[node + 1] as usize {
                let other = indices[pair] as usize;
                let together = supports[node] > 0 && supports[node] == supports[other];
                let apart = together && joined(node).binary_search(&indices[pair]).is_err();
                if apart || joined(node).is_empty() || joined(other).is_empty() {
                    weights[pair] = 0.0;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three tetrahedra in a row: a support holds the first with all of its nodes, and another the tip of the last.
    #[test]
    fn what_a_support_holds_whole_does_not_deform() {
        let rest = [
            DVec3::ZERO,
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            DVec3::ONE,
            DVec3::splat(2.0),
        ];
        let tetrahedra = [[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]];
        let volumes = nodal_volumes(&rest, &tetrahedra);
        let part = |supports: [u32; 6]| DeformingPart::new(&rest, &tetrahedra, &volumes, &supports);
        assert!(part([1, 1, 1, 2, 0, 2]).is_none());
        let supports = [1, 1, 1, 1, 0, 2];
        let part = part(supports).unwrap();
        assert_eq!(part.inert(), [0]);
        let mut expected = nodal_volumes(&rest, &tetrahedra[1..]);
        expected[0] = volumes[0];
        assert_eq!(part.volumes, expected);
        let pairs = [(0, 4), (1, 0), (1, 2), (1, 5), (3, 5)];
        let (offsets, indices) = ([0, 1, 4, 4, 5, 5, 5], pairs.map(|(_, other)| other));
        let kept = |supports: [u32; 6]| {
            let mut weights = [1.0; 5];
            part.uncouple(&supports, (&offsets, &indices), &mut weights);
            weights.map(|weight| weight > 0.0)
        };
        assert_eq!(kept(supports), [false, false, true, true, true]);
        // No edge joins 1 and 5.
        assert_eq!(kept([1; 6]), [false, false, true, false, true]);
    }

    /// Nodes with half as much again keep that in what deforms, and its boundary vectors hold as much.
    #[test]
    fn volume_beyond_tetrahedra_deforms_with_them() {
        let rest = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
        let tetrahedra = [[0, 1, 2, 3], [1, 2, 3, 4]];
        let mut volumes = nodal_volumes(&rest, &tetrahedra);
        volumes[1] *= 1.5;
        volumes[4] *= 1.5;
        let part = DeformingPart::new(&rest, &tetrahedra, &volumes, &[1, 1, 1, 1, 0]).unwrap();
        let quarter = 1.0 / 12.0;
        let expected = [volumes[0], 1.5 * quarter, quarter, quarter, 1.5 * quarter];
        let mut moments = DVec3::ZERO;
        for i in 0..5 {
            assert!((part.volumes[i] - expected[i]).abs() < 1e-15, "{i}");
            moments += part.boundary_vectors[i] * rest[i];
        }
        let off = (moments - 5.0 * quarter).abs().max_element();
        assert!(off < 1e-15, "{moments} m³");
    }
}
