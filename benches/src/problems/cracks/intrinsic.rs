//! The intrinsic basis of a crack tip in mechanics (Aras 2014, eqs (31)–(33); Fleming, Chu, Moran,
//! Belytschko 1997), a baseline: gradients of the nodes near a tip by moving least squares over the nodes
//! that they see, in a basis that holds the near field.

use glam::{DMat3, DVec3};
use phyxel_enrich::Cuts;
use phyxel_integrate::ForceLaw;
use phyxel_mls::{Approximation, Basis, GradientStencils, ShapeScratch};

use super::plate::Plate;
use super::{shear_modulus, stress};
use crate::problems::elements::{displacements, linear_forces};

/// Nodes nearer than this to a tip, in spacings, have the basis.
const NEAR: f64 = 2.5;
/// Radius of their supports in spacings: some 20 nodes of a layer, 7 functions.
const SUPPORT: f64 = 2.6;
/// Hourglass stabilization, as the default has it.
const CONTROL: f64 = 0.1;

/// Gradients of all nodes, those near a tip in its basis.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    offsets: Vec<usize>,
    indices: Vec<u32>,
    /// Of the node's own value too.
    gradients: Vec<DVec3>,
}

/// A tip: its position (m) and the angle (rad) of the crack's extension to the x axis.
type Tip = (DVec3, f64);

/// The ends of an upright cut that lie in the body. None where the cut is not upright.
fn tips(body: &Plate, blades: &[[DVec3; 2]]) -> Option<Vec<Tip>> {
    let upright = |blade: &[DVec3; 2]| (blade[1] - blade[0]).truncate().length() < 1e-9;
    if blades.len() < 2 || !blades.iter().all(upright) {
        return None;
    }
    let middle = |blade: &[DVec3; 2]| blade[0].midpoint(blade[1]);
    let ends = [
        (&blades[0], &blades[1]),
        (&blades[blades.len() - 1], &blades[blades.len() - 2]),
    ];
    let of = |(end, before): (&[DVec3; 2], &[DVec3; 2])| {
        let along = middle(end) - middle(before);
        (middle(end), along.y.atan2(along.x))
    };
    let found = ends.map(of).into_iter();
    Some(found.filter(|(tip, _)| body.inside(*tip)).collect())
}

impl Rows {
    /// Rows of a cut body: those of `stencils` but near the tips. None where the cut has no upright tip
    /// or a node sees too few others.
    pub(super) fn new(
        body: &Plate,
        cuts: &Cuts,
        blades: &[[DVec3; 2]],
        stencils: &GradientStencils,
    ) -> Option<Self> {
        let (rest, graph) = (&body.block.rest, &body.block.graph);
        let written_out = stencils.pair_gradients(rest, graph);
        let tips = tips(body, blades)?;
        let flat = |x: DVec3| x.with_z(0.0);
        let away = |tip: DVec3, x: DVec3| flat(tip).distance(flat(x));
        let radii = vec![SUPPORT * body.spacing; rest.len()];
        let mut scratch = ShapeScratch::default();
        let mut rows = Self {
            offsets: vec![0],
            indices: Vec::new(),
            gradients: Vec::new(),
        };
        for (i, &x) in rest.iter().enumerate() {
            let near = tips
                .iter()
                .min_by(|a, b| away(a.0, x).total_cmp(&away(b.0, x)));
            match near {
                Some(&(tip, angle)) if away(tip, x) < NEAR * body.spacing => {
                    let sees = |(_, y): &(u32, &DVec3)| {
                        y.distance(x) < SUPPORT * body.spacing && !cuts.crosses(x, **y)
                    };
                    let seen = (0..).zip(rest).filter(sees);
                    let seen: Vec<u32> = seen.map(|(j, _)| j).collect();
                    let approximation = Approximation {
                        nodes: rest,
                        support_radii: &radii,
                        basis: Basis::CrackTip { tip, angle },
                    };
                    let mut phi = vec![0.0; seen.len()];
                    let mut slopes = vec![DVec3::ZERO; seen.len()];
                    approximation
                        .shape_functions_into(x, &seen, &mut scratch, &mut phi, &mut slopes)
                        .ok()?;
                    rows.indices.extend(seen);
                    rows.gradients.extend(slopes.into_iter().map(flat));
                }
                _ => {
                    let own = u32::try_from(i).ok()?;
                    let row = &written_out[graph.pairs(i)];
                    rows.indices.push(own);
                    rows.gradients.push(-row.iter().sum::<DVec3>());
                    rows.indices.extend(graph.row(i));
                    rows.gradients.extend(row);
                }
            }
            rows.offsets.push(rows.indices.len());
        }
        Some(rows)
    }

    fn row(&self, node: usize) -> impl Iterator<Item = (usize, DVec3)> + '_ {
        let places = self.offsets[node]..self.offsets[node + 1];
        let indices = self.indices[places.clone()].iter().map(|j| *j as usize);
        indices.zip(self.gradients[places].iter().copied())
    }

    /// Gradient of nodal values at a node.
    pub(super) fn gradient(&self, values: &[DVec3], node: usize) -> DMat3 {
        let parts = self.row(node).map(|(j, g)| outer(values[j], g));
        parts.fold(DMat3::ZERO, |sum, part| sum + part)
    }
}

fn outer(left: DVec3, right: DVec3) -> DMat3 {
    DMat3::from_cols(left * right.x, left * right.y, left * right.z)
}

/// Linear elasticity on such rows: `Σ V σ(G) : G / 2` and the default's penalty of pairs.
pub(super) struct Mechanics<'a> {
    pub(super) body: &'a Plate,
    pub(super) stencils: &'a GradientStencils,
    pub(super) rows: &'a Rows,
}

impl ForceLaw for Mechanics<'_> {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let moved = displacements(positions, &self.body.block.rest);
        linear_forces(self, &moved, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        let (block, stencils) = (&self.body.block, self.stencils);
        let graph = &block.graph;
        let mu = shear_modulus();
        product.fill(DVec3::ZERO);
        for (i, x) in block.rest.iter().enumerate() {
            let volume = stencils.volumes[i];
            let gradient = self.rows.gradient(vector, i);
            let mut stressed = stress(gradient) * volume;
            let pairs = || graph.pairs(i).zip(graph.row(i));
            let apart = |j: &u32| block.rest[*j as usize] - *x;
            let spread: f64 = pairs()
                .map(|(pair, j)| stencils.weights[pair] * apart(j).length_squared())
                .sum();
            for (pair, j) in pairs() {
                let strength = CONTROL * mu * volume * stencils.weights[pair] / spread;
                let off = vector[*j as usize] - vector[i] - gradient * apart(j);
                product[*j as usize] += off * strength;
                product[i] -= off * strength;
                stressed -= outer(off * strength, apart(j));
            }
            for (j, g) in self.rows.row(i) {
                product[j] += stressed * g;
            }
        }
    }
}
