//! Surfels follow their nodes.

use crate::cast::index;
use crate::render::{Splat, Surfel};
use crate::tissue::Tissue;
use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

/// Fewest surfels that one thread carries, and nodes whose maps it forms.
const CHUNK: usize = 128;

impl Tissue {
    /// Carries all surfels by their nodes' positions and deformation gradients.
    ///
    /// `x(X) = Σ w_i(X) p_i` with `p_i = x_i + F_i (X - X_i)`. The disk's axes are r times the derivative
    /// of x along the tangents, `F t + Σ p_i (∇w_i · t)` with `F = Σ w_i F_i`: neighbouring disks move
    /// apart just as they grow, so that no hole opens where nodes disagree. The normal is `cof(F) N`
    /// normalised, smoother than the disk's own; the linear field of normals over the disk is carried by
    /// the same cofactor: where Aras 2014 calls Phong splatting (eq. (51)) unfit for bodies that deform,
    /// this keeps it at the price of two products. All this replaces Aras 2014, eq. (59)
    /// (`x = X + Σ w_i u_i / Σ w_i`, in print without its sum), which drags surfels behind in a rotation
    /// and leaves normals where they were.
    ///
    /// # Arguments
    /// * `nodes` -- node positions in the deformed frame (m), shape `(n)`.
    /// * `gradients` -- deformation gradients of the nodes (1), shape `(n)`.
    /// * `splats` -- output, overwritten.
    ///
    /// # Panics
    /// If there is not one position and one gradient per node.
    ///
    /// # Numerics
    /// An affine map of the nodes with its gradient is reproduced to round-off. A singular `F` keeps
    /// the rest normal. Bitwise identical at any thread count.
    pub fn carry_into(&self, nodes: &[DVec3], gradients: &[DMat3], splats: &mut Vec<Splat>) {
        assert_eq!(self.rest_nodes.len(), nodes.len(), "one position per node");
        assert_eq!(gradients.len(), nodes.len(), "one gradient per node");
        let maps: Vec<DAffine3> = (&*self.rest_nodes, nodes, gradients)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|(&rest, &node, &gradient)| {
                DAffine3::from_mat3_translation(gradient, node - gradient * rest)
            })
            .collect();
        let all = (0..self.surfels.len()).into_par_iter();
        all.with_min_len(CHUNK)
            .map(|i| self.carried(&maps, i))
            .collect_into_vec(splats);
    }

    /// The surfel that the maps `p(X) = F X + shift` of its nodes make.
    fn carried(&self, maps: &[DAffine3], i: usize) -> Splat {
        let surfel = &self.surfels[i];
        let (rest, normal) = surfel.plane();
        let (row, weights) = self.binding.row(i);
        let first = maps[index(row[0])].transform_point3(rest);
        let (mut position, mut f, mut drift) = (first, DMat3::ZERO, [DVec3::ZERO; 2]);
        for ((&node, &weight), slope) in row.iter().zip(weights).zip(self.binding.slopes(i)) {
            let map = &maps[index(node)];
            let aside = map.transform_point3(rest) - first;
            position += aside * weight;
            f += map.matrix3 * weight;
            // What the change of the weights over the disk adds to its axes.
            drift[0] += aside * slope[0];
            drift[1] += aside * slope[1];
        }
        let (t0, t1) = Surfel::tangents(normal);
        let (a, b) = (f * t0, f * t1);
        let axes = [a + drift[0], b + drift[1]];
        let raw = a.cross(b);
        let length = raw.length();
        let most = self.settings.max_stretch;
        let mut carried = Splat {
            position,
            normal,
            axes: axes.map(|axis| axis.clamp_length_max(most) * surfel.radius),
            normal_derivatives: [DVec3::ZERO; 2],
        };
        if length > 0.0 {
            // cof(F) t0 = F t1 × F n and cof(F) t1 = F n × F t0, as t0, t1, n are a right-handed frame.
            let c = f * normal;
            let per = surfel.radius / length;
            carried.normal = raw / length;
            carried.normal_derivatives =
                surfel.normal_derivatives(b.cross(c) * per, c.cross(a) * per);
        }
        carried
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TissueSettings;

    /// Numbers between -1 and 1 without order.
    fn noise(i: usize) -> f64 {
        (12.9898 * (i + 1) as f64).sin() * 43.7585 % 1.0
    }

    fn vector(i: usize) -> DVec3 {
        DVec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2))
    }

    /// Surfels on a ball that bulge anyhow, and nodes that were moved and turned anyhow.
    fn scene() -> (Tissue, Vec<DVec3>, Vec<DMat3>) {
        let normals: Vec<DVec3> = (0..1_000).map(|i| vector(i).normalize()).collect();
        let areas = vec![0.0126; normals.len()];
        let nodes: Vec<DVec3> = (1_000..1_300).map(vector).collect();
        let settings = TissueSettings {
            max_stretch: 1e9,
            ..TissueSettings::default()
        };
        let mut tissue = Tissue::new(&normals, &normals, &areas, &nodes, &settings)
            .expect("unit normals and finite nodes");
        for (surfel, i) in tissue.surfels.iter_mut().zip(2_000..) {
            surfel.shape = vector(i);
        }
        let moved = nodes.iter().zip(4_000..).map(|(&x, i)| x + 0.2 * vector(i));
        let gradients = (5_000..).step_by(3).take(nodes.len()).map(|i| {
            let columns = [0, 1, 2].map(|k| DMat3::IDENTITY.col(k) + 0.3 * vector(i + k));
            DMat3::from_cols(columns[0], columns[1], columns[2])
        });
        let (moved, gradients) = (moved.collect(), gradients.collect());
        (tissue, moved, gradients)
    }

    /// The formulas as they stand, pair by pair.
    #[test]
    fn carrying_is_what_its_formulas_say() {
        let (tissue, nodes, gradients) = scene();
        let (binding, rest_nodes) = (&tissue.binding, &tissue.rest_nodes);
        let mut splats = Vec::new();
        tissue.carry_into(&nodes, &gradients, &mut splats);
        let mut worst: f64 = 0.0;
        for (i, (surfel, splat)) in tissue.surfels.iter().zip(&splats).enumerate() {
            let (row, weights) = binding.row(i);
            let (t0, t1) = Surfel::tangents(surfel.normal);
            let r = surfel.radius;
            let (mut x, mut u, mut v) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
            let mut f = DMat3::ZERO;
            for (k, &node) in row.iter().enumerate() {
                let node = index(node);
                let p = nodes[node] + gradients[node] * (surfel.position - rest_nodes[node]);
                x += p * weights[k];
                f += gradients[node] * weights[k];
                u += p * binding.slopes(i)[k][0];
                v += p * binding.slopes(i)[k][1];
            }
            let cofactor = f.inverse().transpose() * f.determinant();
            let normal = cofactor * surfel.normal;
            let bend = surfel.normal_derivatives(t0, t1);
            let bend = bend.map(|b| cofactor * b * r / normal.length());
            for (found, expected) in [
                (splat.position, x),
                (splat.axes[0], (f * t0 + u) * r),
                (splat.axes[1], (f * t1 + v) * r),
                (splat.normal, normal.normalize()),
                (splat.normal_derivatives[0], bend[0]),
                (splat.normal_derivatives[1], bend[1]),
            ] {
                worst = worst.max(found.distance(expected) / expected.length().max(1.0));
            }
        }
        // 9e-16.
        assert!(worst < 1e-14, "off by {worst:e}");
    }
}
