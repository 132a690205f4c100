//! Elastic bodies as force laws: blocks of any grading on tetrahedra of a lattice.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    reason = "helpers of tests fail by panicking, print what was measured, and count in small numbers"
)]

use glam::{DMat3, DVec3};
use phyxel_discretize::{
    boundary_triangles, nodal_boundary_vectors, nodal_volumes, space_filling_order,
    tetrahedra_edges,
};
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings, Stencils};
use phyxel_integrate::{
    Coupling, Eigenvalue, EigenvalueSettings, ForceLaw, Supports, largest_eigenvalue,
};
use phyxel_mls::{
    ConservativeSettings, ConservativeStencils, Neighborhoods, inverse_square_weights,
};

pub(crate) use phyxel::study::block::lattice;
pub(crate) use phyxel::study::model::Solid;

/// An elastic body ready to be moved.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    pub(crate) rest: Vec<DVec3>,
    pub(crate) masses: Vec<f64>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) elastic: Elastic,
    pub(crate) blocks: Vec<DMat3>,
    coupling: Coupling,
}

impl Body {
    /// A body of tetrahedra, nodes put in space-filling order; `control` is the zero-energy control.
    pub(crate) fn new(
        nodes: &[DVec3],
        tetrahedra: &[[u32; 4]],
        solid: Solid,
        control: f64,
    ) -> Self {
        let order = space_filling_order(nodes);
        let rest = order.apply(nodes);
        let mut place = vec![0_u32; nodes.len()];
        for (new, old) in (0_u32..).zip(&order.apply(&(0..nodes.len()).collect::<Vec<_>>())) {
            place[*old] = new;
        }
        let tetrahedra: Vec<[u32; 4]> = tetrahedra
            .iter()
            .map(|t| t.map(|v| place[v as usize]))
            .collect();
        let volumes = nodal_volumes(&rest, &tetrahedra);
        let triangles = boundary_triangles(&tetrahedra, |_| true);
        let boundary = nodal_boundary_vectors(&rest, &triangles);
        let (offsets, indices) = tetrahedra_edges(rest.len(), &tetrahedra);
        let graph = Neighborhoods::from_graph(offsets, indices).unwrap();
        let weights = inverse_square_weights(&rest, &graph);
        let settings = ConservativeSettings::default();
        let rows =
            ConservativeStencils::new(&rest, &volumes, &boundary, &graph, weights, &settings)
                .unwrap();
        let stencils = Stencils {
            offsets: graph.offsets(),
            indices: graph.indices(),
            weights: &rows.weights,
            matrices: &rows.matrices,
            scales: &rows.scales,
            multipliers: &rows.multipliers,
        };
        let material = Material::neo_hookean(solid.youngs_modulus, solid.poissons_ratio);
        let settings = Settings {
            zero_energy_control: control,
            ..Settings::default()
        };
        let owners = Nodes {
            rest_positions: &rest,
            volumes: &volumes,
        };
        let elastic =
            Elastic::new(&stencils, &owners, &Materials::Uniform(material), &settings).unwrap();
        // Diagonal blocks at rest, Σ_i V_i ((λ + μ) g gᵀ + μ |g|²), and the pair penalty's graph part.
        let mu = solid.youngs_modulus / (2.0 * (1.0 + solid.poissons_ratio));
        let lambda = 2.0 * mu * solid.poissons_ratio / (1.0 - 2.0 * solid.poissons_ratio);
        let mut blocks = vec![DMat3::ZERO; rest.len()];
        let part = |g: DVec3| {
            DMat3::from_cols(g * g.x, g * g.y, g * g.z) * (lambda + mu)
                + DMat3::from_diagonal(DVec3::splat(mu * g.length_squared()))
        };
        for i in 0..rest.len() {
            blocks[i] += part(rows.self_gradients[i]) * volumes[i];
            let pairs = graph.pairs(i);
            let edge = |p: usize| (rest[graph.indices()[p] as usize] - rest[i]).length_squared();
            let spread: f64 = pairs.clone().map(|p| rows.weights[p] * edge(p)).sum();
            for p in pairs {
                let j = graph.indices()[p] as usize;
                blocks[j] += part(rows.pair_gradients[p]) * volumes[i];
                let c = control * mu * volumes[i] / spread * rows.weights[p];
                let c = DMat3::from_diagonal(DVec3::splat(c));
                blocks[i] += c;
                blocks[j] += c;
            }
        }
        let masses = volumes.iter().map(|v| v * solid.density).collect();
        Self {
            rest,
            masses,
            triangles,
            elastic,
            blocks,
            coupling: Coupling::two_rings(graph.offsets(), graph.indices()),
        }
    }

    /// A box from `low` to `high` of `cells`.
    pub(crate) fn block(
        cells: [u32; 3],
        low: DVec3,
        high: DVec3,
        solid: Solid,
        control: f64,
    ) -> Self {
        let (nodes, tetrahedra) = lattice(cells, |s| low + (high - low) * s);
        Self::new(&nodes, &tetrahedra, solid, control)
    }

    /// Nodes that pass a test of their place at rest.
    pub(crate) fn nodes(&self, chosen: impl Fn(DVec3) -> bool) -> Vec<u32> {
        (0_u32..)
            .zip(&self.rest)
            .filter(|(_, x)| chosen(**x))
            .map(|(i, _)| i)
            .collect()
    }

    /// Surface triangles whose corners all pass a test of their place at rest.
    pub(crate) fn faces(&self, chosen: impl Fn(DVec3) -> bool) -> Vec<[u32; 3]> {
        let inside = |t: &&[u32; 3]| t.iter().all(|v| chosen(self.rest[*v as usize]));
        self.triangles.iter().filter(inside).copied().collect()
    }

    /// Largest eigenvalue at rest.
    pub(crate) fn eigenvalue(
        &mut self,
        supports: &Supports,
        settings: &EigenvalueSettings,
    ) -> Eigenvalue {
        let rest = self.rest.clone();
        let mut f = vec![DVec3::ZERO; rest.len()];
        self.elastic.forces_into(&rest, &mut f);
        let masses = self.masses.clone();
        let product = |v: &[DVec3], out: &mut [DVec3]| self.elastic.tangent_product_into(v, out);
        largest_eigenvalue(&masses, supports, product, &mut Vec::new(), settings).unwrap()
    }
}

impl ForceLaw for Body {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        self.elastic.forces_into(positions, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        self.elastic.tangent_product_into(vector, product);
    }

    fn tangent_blocks_into(&mut self, blocks: &mut [DMat3]) -> bool {
        blocks.copy_from_slice(&self.blocks);
        true
    }

    fn coupling(&self) -> Option<&Coupling> {
        Some(&self.coupling)
    }
}
