//! The model's public face: what goes in, what comes out.

use glam::{DMat3, DVec3};

use crate::body::Body;
use crate::dilatation::MeanDilatation;
use crate::error::ElasticError;
use crate::evaluate::{self, Table};
use crate::front;
use crate::kernel::{Lanes, bare::Bare, controlled::Controlled};
use crate::law::Prepared;
use crate::material::{Law, Material};
use crate::rows::{Graph, Rows};
use crate::still::Still;

/// Gradient stencils of all nodes, compressed by rows.
///
/// Row `i` of the graph is `indices[offsets[i]..offsets[i + 1]]`: its neighbours in rising order,
/// without `i` itself.
#[derive(Debug, Clone, Copy)]
pub struct Stencils<'a> {
    /// Starts of the rows, shape `(n + 1)`.
    pub offsets: &'a [u32],
    /// Neighbours, shape `(pairs)`.
    pub indices: &'a [u32],
    /// `g_ij` (1/m): `F_i = I + sum_j (u_j - u_i) ⊗ g_ij`, shape `(pairs)`.
    pub gradients: &'a [DVec3],
    /// `g_ii = -sum_j g_ij` (1/m), shape `(n)`.
    pub self_gradients: &'a [DVec3],
    /// `w_ij = w_ji >= 0` of the moment matrix (any unit), shape `(pairs)`; 0 for a severed pair.
    /// Without zero-energy control the slice may be empty.
    pub weights: &'a [f64],
}

/// Rest state of the nodes.
#[derive(Debug, Clone, Copy)]
pub struct Nodes<'a> {
    /// Rest positions `X_i` (m), shape `(n)`.
    pub rest_positions: &'a [DVec3],
    /// Volumes `V_i` (m³), shape `(n)`, positive.
    pub volumes: &'a [f64],
}

/// Materials of the nodes.
#[derive(Debug, Clone, Copy)]
pub enum Materials<'a> {
    /// One for all.
    Uniform(Material),
    /// A list and, for each node, an index into it.
    PerNode {
        /// The materials.
        list: &'a [Material],
        /// Index per node, shape `(n)`.
        of_node: &'a [u32],
    },
}

/// Options of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// `alpha` of the penalty against zero-energy modes, in units of the shear modulus; 0 turns it
    /// off. 0.1 serves beams, contact and cracks alike; 0.3 is visibly stiff, 0.05 soft.
    pub zero_energy_control: f64,
    /// Storage of pairs.
    pub precision: Precision,
    /// Where volume changes are resisted.
    pub dilatation: Dilatation,
}

/// Storage of what is read once per pair and pass. Positions, stresses, energies and forces are
/// f64 either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// f64.
    #[default]
    Double,
    /// f32: 0.6 of the memory and, beyond the caches, 0.7 to 0.8 of the time, for a relative 1e-7 per row. Forces of a
    /// body at rest vanish exactly; those of a stretched one sum to zero only up to that.
    Single,
}

/// Where a change of volume is resisted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Dilatation {
    /// At each node by itself.
    #[default]
    Local,
    /// By means over neighbourhoods (mean dilatation): softer where a nearly incompressible body is
    /// confined. Worth its two further passes above a Poisson's ratio of about 0.48. Acts on the
    /// `(ln J)²` and eq. (30) parts; not with Saint Venant–Kirchhoff.
    Mean,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            zero_energy_control: 0.1,
            precision: Precision::Double,
            dilatation: Dilatation::Local,
        }
    }
}

/// Elastic body: forces as the exact negative gradient of
/// `E(x) = sum_i V_i W(F_i) + sum_i c_i/2 sum_j w_ij |e_ij|²`.
///
/// `F_i = I + sum_j u_ij ⊗ g_ij` (Aras 2014, eqs (22)–(27) for the gradient), `W` the strain
/// energy (eq. (28)), `e_ij = u_ij - H_i X_ij` what a linear field through the neighbours leaves
/// over, with `H_i = (sum_j w_ij u_ij ⊗ X_ij) A_i⁻¹`, `A_i = sum_j w_ij X_ij X_ijᵀ`,
/// `c_i = alpha mu V_i / sum_j w_ij |X_ij|²`.
///
/// An evaluation is two gathers: nodes read their neighbours and write only their own row. The
/// threads are those of the current rayon pool; the result has the same bits for any number.
#[derive(Debug, Clone)]
pub struct Elastic {
    pub(crate) body: Body,
    pub(crate) pairs: Pairs,
}

/// Pair data in one of the two precisions, with and without zero-energy control.
#[derive(Debug, Clone)]
pub(crate) enum Pairs {
    Double(Table<Controlled<f64>>),
    Single(Table<Controlled<f32>>),
    BareDouble(Table<Bare<f64>>),
    BareSingle(Table<Bare<f32>>),
}

/// Binds `$table` to the table of either kind.
macro_rules! with_table {
    ($pairs:expr, $table:ident => $work:expr) => {
        match $pairs {
            $crate::model::Pairs::Double($table) => $work,
            $crate::model::Pairs::Single($table) => $work,
            $crate::model::Pairs::BareDouble($table) => $work,
            $crate::model::Pairs::BareSingle($table) => $work,
        }
    };
}
pub(crate) use with_table;

impl Elastic {
    /// Builds a model.
    ///
    /// # Errors
    /// [`ElasticError`] names the first node, pair or material that cannot be used: values that
    /// are not finite, volumes that are not positive, unsorted rows, rows without linear
    /// consistency, one-way pairs or unequal weights under zero-energy control or mean dilatation,
    /// parameters out of range.
    ///
    /// # Panics
    /// If the slices' lengths do not fit together.
    pub fn new(
        stencils: &Stencils<'_>,
        nodes: &Nodes<'_>,
        materials: &Materials<'_>,
        settings: &Settings,
    ) -> Result<Self, ElasticError> {
        let (rest, volumes) = (nodes.rest_positions, nodes.volumes);
        let node_count = rest.len();
        stencils.check_lengths(node_count, settings.zero_energy_control > 0.0);
        assert_eq!(volumes.len(), node_count, "one volume per node");
        for (node, (x, &volume)) in rest.iter().zip(volumes).enumerate() {
            if !x.is_finite() {
                let what = "rest position";
                return Err(ElasticError::NotFinite { what, node });
            }
            if !(volume > 0.0 && volume.is_finite()) {
                return Err(ElasticError::NonPositiveVolume { node, volume });
            }
        }
        let materials = checked_materials(materials, node_count)?;
        let body = Body::new(settings, rest, volumes, materials);
        match (settings.precision, body.controlled()) {
            (Precision::Double, true) => Self::assemble(body, stencils, Pairs::Double),
            (Precision::Single, true) => Self::assemble(body, stencils, Pairs::Single),
            (Precision::Double, false) => Self::assemble(body, stencils, Pairs::BareDouble),
            (Precision::Single, false) => Self::assemble(body, stencils, Pairs::BareSingle),
        }
    }

    fn assemble<L: Lanes>(
        mut body: Body,
        stencils: &Stencils<'_>,
        wrap: fn(Table<L>) -> Pairs,
    ) -> Result<Self, ElasticError> {
        let mean = body.settings.dilatation == Dilatation::Mean;
        let symmetric = body.controlled() || mean;
        let mut rows = Rows::<L>::new(Graph::new(stencils, symmetric)?);
        for node in 0..body.node_count() {
            body.set_row(&mut rows, node, stencils)?;
        }
        if L::CONTROLLED {
            for node in 0..body.node_count() {
                rows.check_symmetry(node)?;
            }
        }
        if mean {
            if let Some(material) = body
                .materials
                .iter()
                .position(|m| matches!(m.law, Law::SaintVenantKirchhoff { .. }))
            {
                return Err(ElasticError::NoVolumetricPart { material });
            }
            let laws = body.prepared.iter_mut().map(Prepared::split_volumetric);
            let laws = laws.collect();
            body.dilatation = Some(MeanDilatation::new(laws, &body.volumes, &rows));
        }
        let blank = L::matrix(DMat3::ZERO, DMat3::ZERO);
        let matrices = vec![blank; body.node_count()];
        let pairs = wrap(Table { rows, matrices });
        Ok(Self { body, pairs })
    }

    /// Gives every node a fiber direction of its own (unit vectors, rest state) in place of its
    /// material's.
    ///
    /// # Errors
    /// [`ElasticError::NotFinite`] if a direction has no length.
    ///
    /// # Panics
    /// If there is not one direction per node.
    pub fn set_fiber_directions(&mut self, directions: &[DVec3]) -> Result<(), ElasticError> {
        let n = self.node_count();
        assert_eq!(directions.len(), n, "one direction per node");
        let mut unit = Vec::with_capacity(n);
        for (node, direction) in directions.iter().enumerate() {
            let what = "fiber direction";
            let error = ElasticError::NotFinite { what, node };
            unit.push(direction.try_normalize().ok_or(error)?);
        }
        self.body.fiber_directions = unit;
        self.body.plain = false;
        Ok(())
    }

    /// Number of nodes.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.body.node_count()
    }

    /// Number of directed pairs.
    #[must_use]
    pub fn pair_count(&self) -> usize {
        with_table!(&self.pairs, table => table.rows.pair_count())
    }

    /// Volumes `V_i` (m³) that carry strain energy: the given ones, 0 at nodes that
    /// [`Elastic::weaken`] took it from.
    #[must_use]
    pub fn elastic_volumes(&self) -> &[f64] {
        &self.body.elastic_volumes
    }

    /// Deformation gradients `F_i` of the last evaluation; the identity before the first.
    ///
    /// A node with a deficient row has unit vectors normal to the deformed span of its neighbours
    /// in place of the directions that its row cannot see. A weak node has the mean of those nodes that
    /// its bonds lead to and that are nearer to sound ones, the identity without any.
    #[must_use]
    pub fn deformation_gradients(&self) -> &[DMat3] {
        &self.body.deformation
    }

    /// Number of dimensions, 0 to 3, that the row of `node` sees.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn rank(&self, node: usize) -> u8 {
        self.body.ranks[node]
    }

    /// Material of a node.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn material(&self, node: usize) -> &Material {
        self.body.material(node)
    }

    /// First Piola–Kirchhoff stress `P_i` (Pa) at the state last evaluated, with fibers, viscous
    /// part and, under mean dilatation, the mean pressure.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn first_piola_kirchhoff(&self, node: usize) -> DMat3 {
        let f = self.body.deformation[node];
        let (_, stress) = self.body.energy_and_stress(node, f);
        match &self.body.dilatation {
            None => stress,
            Some(mean) => {
                let volume = self.body.volumes[node];
                let pressure = with_table!(&self.pairs, table =>
                    mean.pressures[node] + mean.spread(&table.rows, node, &mean.pressures) / volume);
                stress + crate::law::cofactor(f) * pressure
            }
        }
    }

    /// Cauchy stress `sigma = P Fᵀ / J` (Pa) at the state last evaluated; not finite for `J = 0`.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn cauchy_stress(&self, node: usize) -> DMat3 {
        let f = self.body.deformation[node];
        self.first_piola_kirchhoff(node) * f.transpose() * f.determinant().recip()
    }

    /// Names the nodes that stay at their rest positions in every evaluation from now on, and at zero in
    /// every vector: what can have no strain and no force because of that is not computed. The rest is as
    /// before, forces on held nodes with moving neighbours too. An empty slice takes it back.
    ///
    /// What is given of a held node that has moved is not noticed; its forces are then wrong.
    ///
    /// # Panics
    /// If a node does not exist.
    pub fn set_held(&mut self, nodes: &[u32]) {
        let n = self.node_count();
        let still = with_table!(&self.pairs, table => Still::new(&table.rows, n, nodes));
        self.body.still = still;
    }

    /// Writes the forces `f = -dE/dx` (N) at `positions` (m) and returns the energy `E` (J).
    ///
    /// Keeps the deformation gradients of this state for [`Elastic::deformation_gradients`] and
    /// [`Elastic::tangent_product_into`]. Positions that are not finite give forces that are not
    /// finite; nothing else does.
    ///
    /// # Panics
    /// If a slice is not as long as there are nodes.
    ///
    /// # Numerics
    /// The penalty's energy comes from `-u·f/2` and the virtual work of the stresses, which costs
    /// nothing per pair; its round-off is that of `sum |u| |f|`.
    pub fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let n = self.node_count();
        assert_eq!(positions.len(), n, "one position per node");
        assert_eq!(forces.len(), n, "one force per node");
        let body = &mut self.body;
        let energy = with_table!(&mut self.pairs, table => {
            evaluate::forces(body, table, positions, forces)
        });
        if body.fronts.is_empty() {
            return energy;
        }
        energy + front::add_forces(body, positions, forces)
    }

    /// Writes `K v` with `K = d²E/dx²` (N/m, symmetric) at the state last evaluated by
    /// [`Elastic::forces_into`].
    ///
    /// `K` is positive semidefinite at rest and need not be elsewhere.
    ///
    /// # Panics
    /// If a slice is not as long as there are nodes.
    pub fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        let n = self.node_count();
        assert_eq!(vector.len(), n, "one vector per node");
        assert_eq!(product.len(), n, "one product per node");
        let body = &mut self.body;
        with_table!(&mut self.pairs, table => {
            evaluate::tangent_product(body, table, vector, product);
        });
        let of = |node: u32| vector[node as usize];
        front::add_product(body, |_| true, of, |node, p| product[node as usize] += p);
    }

    /// Those of [`Elastic::bytes`] that [`Elastic::set_held`] takes.
    #[must_use]
    pub fn held_bytes(&self) -> usize {
        self.body.still.bytes()
    }

    /// Heap bytes that the model holds.
    #[must_use]
    pub fn bytes(&self) -> usize {
        fn table_bytes<L: Lanes>(table: &Table<L>) -> usize {
            table.rows.bytes() + table.matrices.capacity() * size_of::<L::Matrix>()
        }
        self.body.bytes() + with_table!(&self.pairs, table => table_bytes(table))
    }

    /// Those of them that cuts need: control of touched nodes, offsets, bonds; 0 before the first.
    #[must_use]
    pub fn cut_bytes(&self) -> usize {
        self.body.cut_bytes()
    }

    /// Those of them that [`Elastic::watch_stiffness`] takes.
    #[must_use]
    pub fn watch_bytes(&self) -> usize {
        self.body.watch_bytes()
    }

    /// Those of them that only viscous materials need; 0 without any.
    #[must_use]
    pub fn viscous_bytes(&self) -> usize {
        let viscosity = self.body.viscosity.as_ref();
        viscosity.map_or(0, crate::viscosity::Viscosity::bytes)
    }

    /// Prepares the viscous part for a step of `time_step` (s) from the state of the last
    /// [`Elastic::end_viscous_step`]: forces and energy are then those of the step's incremental
    /// potential. Without a call the body answers with its long-term law. Does nothing for a body
    /// without viscous materials.
    pub fn begin_viscous_step(&mut self, time_step: f64) {
        let body = &mut self.body;
        if let Some(viscosity) = &mut body.viscosity {
            let material_of = &body.material_of;
            viscosity.begin_step(time_step, &body.materials, |node| {
                material_of.get(node).map_or(0, |&m| m as usize)
            });
        }
    }

    /// Ends the step begun last at the state last evaluated: overstresses relax and take up the
    /// change of the long-term stress.
    ///
    /// A node squeezed below a hundredth of its volume keeps the stress it had before.
    pub fn end_viscous_step(&mut self) {
        let body = &mut self.body;
        let Some(mut viscosity) = body.viscosity.take() else {
            return;
        };
        for node in 0..body.node_count() {
            let f = body.deformation[node];
            if f.determinant() > 0.01 {
                let (_, stress) = body.law(node).get().energy_and_stress(f);
                viscosity.end_step(node, body.material_index(node), f.inverse() * stress);
            }
        }
        body.viscosity = Some(viscosity);
    }

    /// Viscous state for a checkpoint: per node the last second Piola–Kirchhoff stress and one
    /// overstress per Prony term (Pa; xx, yy, zz, xy, yz, zx). Empty without viscous materials.
    #[must_use]
    pub fn viscous_history(&self) -> &[[f64; 6]] {
        self.body.viscosity.as_ref().map_or(&[], |v| v.history())
    }

    /// Restores what [`Elastic::viscous_history`] gave.
    ///
    /// # Panics
    /// If it comes from a model of another size.
    pub fn set_viscous_history(&mut self, history: &[[f64; 6]]) {
        match &mut self.body.viscosity {
            Some(viscosity) => viscosity.set_history(history),
            None => assert!(history.is_empty(), "this body has no viscous materials"),
        }
    }
}

impl Stencils<'_> {
    pub(crate) fn check_lengths(&self, node_count: usize, controlled: bool) {
        let pairs = self.indices.len();
        assert_eq!(self.offsets.len(), node_count + 1, "offsets: nodes + 1");
        assert_eq!(self.self_gradients.len(), node_count, "one g_ii per node");
        assert_eq!(self.gradients.len(), pairs, "one g_ij per pair");
        assert!(
            self.weights.len() == pairs || (self.weights.is_empty() && !controlled),
            "one weight per pair; none only without zero-energy control"
        );
        assert!(
            self.offsets.windows(2).all(|o| o[0] <= o[1])
                && self.offsets[0] == 0
                && self.offsets[node_count] as usize == pairs,
            "offsets must rise from 0 to the number of pairs"
        );
    }
}

fn checked_materials(
    materials: &Materials<'_>,
    node_count: usize,
) -> Result<(Vec<Material>, Vec<u32>), ElasticError> {
    let (list, of_node) = match materials {
        Materials::Uniform(material) => (vec![*material], Vec::new()),
        Materials::PerNode { list, of_node } => {
            assert_eq!(of_node.len(), node_count, "one material index per node");
            let count = list.len();
            for (node, &material) in of_node.iter().enumerate() {
                let material = material as usize;
                if material >= count {
                    return Err(ElasticError::UnknownMaterial {
                        node,
                        material,
                        count,
                    });
                }
            }
            (list.to_vec(), of_node.to_vec())
        }
    };
    for (index, material) in list.iter().enumerate() {
        material.validate(index)?;
    }
    Ok((list, of_node))
}

#[cfg(test)]
mod tests;
