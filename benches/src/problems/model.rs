//! Elastic models of bodies for studies: the default and the dissertation's.

use glam::{DMat3, DVec3};
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings, Stencils};
use phyxel_integrate::{
    BoundaryConditions, ClosureLaw, Eigenvalue, EigenvalueSettings, ForceLaw, largest_eigenvalue,
};
use phyxel_mls::{DissertationCloud, NearestSettings, dissertation_cloud, k_nearest};
use testkit::solve::conjugate_gradients;

use super::block::{Block, faces_where, lattice};
use super::solid::Solid;
use crate::StudyError;
use crate::error::not_solved;

/// The elastic model as the static solver wants it.
pub(crate) fn law(elastic: &mut Elastic) -> impl ForceLaw {
    ClosureLaw::of(elastic, Elastic::forces_into, Elastic::tangent_product_into)
}

/// An elastic body ready to be moved, by the default model or by the dissertation's.
#[derive(Debug, Clone)]
pub struct ElasticBody {
    /// Rest positions (m).
    pub rest: Vec<DVec3>,
    /// Nodal masses (kg).
    pub masses: Vec<f64>,
    /// Surface triangles, anticlockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Forces.
    pub elastic: Elastic,
    blocks: Option<Vec<DMat3>>,
}

impl ElasticBody {
    /// The default model, neo-Hookean with hourglass stabilization `control`; nodes are put in
    /// space-filling order.
    ///
    /// # Errors
    /// [`StudyError`] if there are no stencils on these nodes.
    pub fn new(
        nodes: &[DVec3],
        tetrahedra: &[[u32; 4]],
        solid: Solid,
        control: f64,
    ) -> Result<Self, StudyError> {
        Self::on(Block::ordered(nodes, tetrahedra)?, solid, control)
    }

    /// As [`ElasticBody::new`], of a body that is there.
    ///
    /// # Errors
    /// [`StudyError`] if the model does not take the stencils.
    pub fn on(block: Block, solid: Solid, control: f64) -> Result<Self, StudyError> {
        let material = Material::neo_hookean(solid.youngs_modulus, solid.poissons_ratio);
        let settings = Settings {
            stabilization: control,
            ..Settings::default()
        };
        let elastic = block.elastic(&block.stencils, material, &settings)?;
        let blocks = block.diagonal_blocks(solid, control);
        Ok(Self {
            masses: block.volumes.iter().map(|v| v * solid.density).collect(),
            rest: block.rest,
            triangles: block.triangles,
            elastic,
            blocks: Some(blocks),
        })
    }

    /// A box from `low` to `high` of `cells`.
    ///
    /// # Errors
    /// [`StudyError`] if there are no stencils on these nodes.
    pub fn block(
        cells: [u32; 3],
        low: DVec3,
        high: DVec3,
        solid: Solid,
        control: f64,
    ) -> Result<Self, StudyError> {
        let (nodes, tetrahedra) = lattice(cells, |s| low + (high - low) * s);
        Self::new(&nodes, &tetrahedra, solid, control)
    }

    /// The dissertation's model on the same nodes: see `dissertation`.
    ///
    /// # Errors
    /// [`StudyError`] if there are no stencils on these nodes.
    pub fn dissertation(
        nodes: &[DVec3],
        tetrahedra: &[[u32; 4]],
        solid: Solid,
    ) -> Result<Self, StudyError> {
        let block = Block::ordered(nodes, tetrahedra)?;
        let material = Material::saint_venant_kirchhoff(solid.youngs_modulus, solid.poissons_ratio);
        let (elastic, masses) = dissertation(&block.rest, material, solid.density)?;
        Ok(Self {
            masses,
            rest: block.rest,
            triangles: block.triangles,
            elastic,
            blocks: None,
        })
    }

    /// Surface triangles whose corners all pass a test of their place at rest.
    pub fn faces(&self, chosen: impl Fn(DVec3) -> bool) -> Vec<[u32; 3]> {
        faces_where(&self.triangles, &self.rest, chosen)
    }

    /// Largest eigenvalue at rest, and the step it allows.
    ///
    /// # Errors
    /// If there is none.
    pub fn eigenvalue(
        &mut self,
        supports: &BoundaryConditions,
        settings: &EigenvalueSettings,
    ) -> Result<Eigenvalue, StudyError> {
        let Self {
            rest,
            masses,
            elastic,
            ..
        } = self;
        elastic.forces_into(rest, &mut vec![DVec3::ZERO; rest.len()]);
        let product = |v: &[DVec3], out: &mut [DVec3]| elastic.tangent_product_into(v, out);
        let found = largest_eigenvalue(masses, supports, product, &mut Vec::new(), settings)?;
        Ok(found)
    }
}

impl ForceLaw for ElasticBody {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        self.elastic.forces_into(positions, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        self.elastic.tangent_product_into(vector, product);
    }

    fn tangent_blocks_into(&mut self, blocks: &mut [DMat3]) -> bool {
        match &self.blocks {
            Some(known) => blocks.copy_from_slice(known),
            None => return false,
        }
        true
    }
}

/// The dissertation's own mechanics, for comparison: 16 nearest nodes, plain moving least squares
/// (Aras 2014, eqs. (25)–(27)), volumes of eqs. (17) and (18), no hourglass stabilization; the
/// model and the nodal masses (kg).
///
/// # Errors
/// [`StudyError`] if the nodes are no cloud of three dimensions.
pub fn dissertation(
    rest: &[DVec3],
    material: Material,
    density: f64,
) -> Result<(Elastic, Vec<f64>), StudyError> {
    let near = k_nearest(rest, &NearestSettings::default())?;
    let DissertationCloud {
        neighborhoods: graph,
        stencils: rows,
        masses,
        ..
    } = dissertation_cloud(rest, &near, density, 1e-3)?;
    let (weights, matrices) = (&rows.weights, &rows.matrices);
    let stencils = Stencils::plain(graph.offsets(), graph.indices(), weights, matrices);
    let nodes = Nodes::new(rest, &masses.volumes);
    let settings = Settings {
        stabilization: 0.0,
        ..Settings::default()
    };
    let elastic = Elastic::new(&stencils, &nodes, &Materials::Uniform(material), &settings)?;
    Ok((elastic, masses.masses))
}

/// Displacements (m) of small strain under nodal forces (N) by conjugate gradients to 1e-10; components of a node whose
/// mask is 0 are held.
///
/// # Errors
/// If they do not come so near.
pub fn small_displacements(
    law: &mut impl ForceLaw,
    rest: &[DVec3],
    forces: &[DVec3],
    mask: impl Fn(usize) -> DVec3,
) -> Result<Vec<DVec3>, StudyError> {
    let n = rest.len();
    law.forces_into(rest, &mut vec![DVec3::ZERO; n]);
    let mask: Vec<DVec3> = (0..n).map(mask).collect();
    let forces = forces.iter().zip(&mask).map(|(f, m)| *f * *m).collect();
    let product = |v: &[DVec3], product: &mut [DVec3]| {
        law.tangent_product_into(v, product);
        for (q, m) in product.iter_mut().zip(&mask) {
            *q *= *m;
        }
    };
    let solved = conjugate_gradients(product, forces, &vec![1.0; n], 1e-20, 8000);
    solved.map_err(|(_, left)| not_solved(left.sqrt()))
}
