//! The model's public face.

use glam::{DMat3, DVec3};

use crate::cut::CutState;
use crate::error::ElasticError;
use crate::input::{
    Dilatation, Materials, Nodes, Settings, Stencils, checked_materials, same_length,
};
use crate::kernel::dilatation::{Means, Pressures};
use crate::kernel::fixed::{Either, Tables};
use crate::kernel::forces::{self, Chosen};
use crate::kernel::inactive::{Asleep, Inactive};
use crate::kernel::nodes::{Model, Scratch, State};
use crate::kernel::pairs::Pairs;
use crate::kernel::prestrain::Prestrain;
use crate::kernel::stale::Stale;
use crate::kernel::storage::{CHUNK, copy_gradients, parallel};
use crate::kernel::worst::Watch;
use crate::kernel::{row, tangent};
use crate::law::coefficients::Coefficients;
use crate::law::material::{Law, Material};
use crate::law::tensor::cofactor;
use crate::law::viscosity::Viscosity;

/// Elastic body: forces as the exact negative gradient of its energy.
///
/// [`Elastic::new`] builds it, [`Elastic::forces_into`] gives forces and energy at positions,
/// [`Elastic::cauchy_stress`] stresses there, [`Elastic::tangent_product_into`] what an implicit step or a
/// static solution needs, [`Elastic::apply_cut`] and [`Elastic::decay`] carry a cut.
///
/// # Examples
/// ```
/// use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings, Stencils};
/// use phyxel_elastic::glam::{DMat3, DVec3};
///
/// # let x = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
/// # let (offsets, indices) = ([0, 3, 6, 9, 12], [1, 2, 3, 0, 2, 3, 0, 1, 3, 0, 1, 2]);
/// # let outer = |d: DVec3| DMat3::from_cols(d * d.x, d * d.y, d * d.z);
/// # let matrices = x.map(|a| x.iter().fold(DMat3::ZERO, |sum, &b| sum + outer(b - a)).inverse());
/// # let stencils = Stencils::plain(&offsets, &indices, &[1.0; 12], &matrices);
/// // Nodes x and their stencils as in [`Stencils::plain`].
/// let (nodes, soft) = (Nodes::new(&x, &[1.0 / 24.0; 4]), Material::neo_hookean(1e3, 0.4));
/// let mut body = Elastic::new(&stencils, &nodes, &Materials::Uniform(soft), &Settings::default())?;
/// let mut forces = [DVec3::ZERO; 4];
/// let energy = body.forces_into(&x.map(|x| x * 1.1), &mut forces); // J, N
/// assert!(energy > 0.0 && forces[1].x < 0.0);
/// let stress = body.cauchy_stress(0); // Pa
/// assert!(stress.x_axis.x > 0.0 && stress.x_axis.y.abs() < 1e-9);
/// # Ok::<(), phyxel_elastic::ElasticError>(())
/// ```
///
/// # Energy
/// `E(x) = sum_i V_i W(F_i) + sum_i c_i/2 sum_j w_ij |e_ij|²`.
///
/// `F_i = I + sum_j u_ij ⊗ g_ij` (Aras 2014, eqs (22)–(27) for the gradient), `W` the strain
/// energy (eq. (28)), `e_ij = u_ij - H_i X_ij` what a linear field through the neighbours leaves
/// over, with `H_i = (sum_j w_ij u_ij ⊗ X_ij) A_i⁻¹`, `A_i = sum_j w_ij X_ij X_ijᵀ`,
/// `c_i = alpha mu V_i / sum_j w_ij |X_ij|²`.
///
/// An evaluation is two gathers: nodes read their neighbours and write only their own row. The
/// threads are those of the current rayon pool; the result is bitwise identical for any number.
#[derive(Debug, Clone)]
pub struct Elastic {
    /// Constant between cuts.
    pub(crate) model: Model,
    /// What the last evaluation left.
    pub(crate) state: State,
    /// What cuts leave.
    pub(crate) cut: CutState,
    /// What passes write for each other.
    pub(crate) scratch: Scratch,
    /// Rows of the stencils, and what passes leave of nodes.
    pub(crate) tables: Tables,
}

/// Heap bytes of a model and of parts of it, which are 0 where a body does not use them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Bytes {
    /// The whole model.
    pub all: usize,
    /// What cuts need: control of touched nodes and of fronts, retained gradients, bonds.
    pub cuts: usize,
    /// What [`Elastic::watch_stiffness`] takes.
    pub watch: usize,
    /// What viscous materials need.
    pub viscosity: usize,
    /// What [`Elastic::set_held`] takes.
    pub held: usize,
}

impl Elastic {
    /// Builds a model.
    ///
    /// # Errors
    /// [`ElasticError`] names the first node, pair or material that cannot be used: values that
    /// are not finite, volumes that are not positive, unsorted rows, rows without linear
    /// consistency, one-way pairs or unequal weights under hourglass stabilization or mean dilatation,
    /// parameters out of range, lists whose lengths do not fit together.
    pub fn new(
        stencils: &Stencils<'_>,
        nodes: &Nodes<'_>,
        materials: &Materials<'_>,
        settings: &Settings,
    ) -> Result<Self, ElasticError> {
        let (rest, volumes) = (nodes.rest_positions, nodes.volumes);
        let node_count = rest.len();
        stencils.check_lengths(node_count)?;
        same_length("volumes", volumes.len(), node_count)?;
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
        let controlled = settings.stabilization > 0.0;
        let mean = settings.dilatation == Dilatation::Mean;
        let pairs = Pairs::new(stencils, controlled || mean, controlled)?;
        let mut model = Model::new(settings, pairs, rest, volumes, materials);
        let mut changes = [Vec::new(), Vec::new()];
        if mean {
            model.means = Some(means_of(&mut model)?);
            changes = [vec![0.0; node_count], vec![0.0; node_count]];
        }
        let state = State {
            viscosity: Viscosity::new(&model.materials, node_count),
            pressures: mean.then(|| Pressures::new(node_count)),
            prestrain: Prestrain::default(),
            watches: vec![Watch::NOTHING; node_count.div_ceil(CHUNK)],
        };
        let scratch = Scratch {
            moves: vec![[0.0; 3]; node_count],
            partial: vec![0.0; node_count.div_ceil(CHUNK)],
            stale: Stale::everything(),
            asleep: vec![Asleep::NONE; node_count.div_ceil(CHUNK)],
            changes,
        };
        let tables = tables(&mut model, stencils)?;
        model.settings.frame = Some(tables.frame());
        Ok(Self {
            model,
            state,
            cut: CutState::default(),
            scratch,
            tables,
        })
    }

    /// Number of nodes.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.model.node_count()
    }

    /// Options that it was built with, and its frame.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.model.settings
    }

    /// Volumes (m³) that it was built with.
    #[must_use]
    pub fn volumes(&self) -> &[f64] {
        &self.model.volumes
    }

    /// Energies (J) at the state last evaluated: of the runs of [`crate::WATCHED_NODES`] nodes, bonds aside, and of each
    /// bond with its deficient node, nodes ascending. Both summed in order, the bonds' last, they are what
    /// [`Elastic::forces_into`] returns.
    #[doc(hidden)]
    #[must_use]
    pub fn energies(&self) -> (&[f64], Vec<(u32, f64)>) {
        let bonds = self.cut.bonds.list.iter();
        let bonds = bonds.map(|bond| (bond.node, bond.energy()));
        (&self.scratch.partial, bonds.collect())
    }

    /// Deformation gradients `F_i` of the last evaluation; the identity before the first.
    ///
    /// A node with a deficient row has unit vectors normal to the deformed span of its neighbours
    /// instead of the directions that its row cannot see. A deficient node has the mean of those nodes that
    /// its bonds reach and that are nearer to valid ones, the identity without any.
    ///
    /// They are stored by components; this copies them.
    #[must_use]
    pub fn deformation_gradients(&self) -> Vec<DMat3> {
        let mut all = vec![DMat3::IDENTITY; self.node_count()];
        let stored = &self.tables.deformation;
        copy_gradients(parallel(self.model.node_count()), stored, &mut all);
        all
    }

    /// One of [`Elastic::deformation_gradients`].
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn deformation_gradient(&self, node: usize) -> DMat3 {
        self.tables.gradient(node)
    }

    /// Material of a node.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn material(&self, node: usize) -> &Material {
        self.model.material(node)
    }

    /// First Piola–Kirchhoff stress `P_i` (Pa) at the state last evaluated.
    pub(crate) fn first_piola_kirchhoff(&self, node: usize) -> DMat3 {
        let f = self.deformation_gradient(node);
        let (model, viscosity) = (&self.model, self.state.viscosity.as_ref());
        let (_, stress) = model.energy_and_stress(viscosity, node, f);
        let pressure = self.mean_pressure(node);
        if pressure == 0.0 {
            stress
        } else {
            stress + cofactor(f) * pressure
        }
    }

    /// What mean dilatation adds to a node's stress, over the cofactor matrix (Pa); 0 without.
    pub(crate) fn mean_pressure(&self, node: usize) -> f64 {
        let model = &self.model;
        match (&model.means, &self.state.pressures) {
            (Some(means), Some(pressures)) => {
                let volume = model.volumes[node];
                means.pressure(&model.pairs, (node, volume), &pressures.pressures) / volume
            }
            _ => 0.0,
        }
    }

    /// Cauchy stress `sigma = P Fᵀ / J` (Pa) at the state last evaluated, with fibers, viscous part and, under mean
    /// dilatation, the mean pressure; not finite for `J = 0`.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn cauchy_stress(&self, node: usize) -> DMat3 {
        let f = self.deformation_gradient(node);
        self.first_piola_kirchhoff(node) * f.transpose() * f.determinant().recip()
    }

    /// Names the nodes that stay at their rest positions in every evaluation from now on, and at zero in
    /// every vector: what can have no strain and no force because of that is not computed. The rest is as
    /// before, forces on fixed nodes with moving neighbours too. An empty slice takes it back.
    ///
    /// What is given of a fixed node that has moved is not noticed; its forces are then wrong.
    ///
    /// # Panics
    /// If a node does not exist.
    pub fn set_held(&mut self, nodes: &[u32]) {
        self.model.inactive = Inactive::new(&self.model.pairs, nodes);
        self.scratch.asleep.fill(Asleep::NONE);
        self.scratch.stale = Stale::everything();
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
        self.evaluate(positions, forces, None)
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
        let parts = (&self.model, &self.state, &mut self.scratch);
        match self.tables.split() {
            Either::Plain(table) => tangent::product(parts, table, vector, product),
            Either::Corrected(table) => tangent::product(parts, table, vector, product),
        }
        self.cut.fronts.add_product(vector, product);
        self.scratch.stale = Stale::everything();
        self.cut.bonds.add_product(vector, product);
    }

    /// Round-off (J) of the energy that [`Elastic::forces_into`] returns at `positions` (m): the larger of `eps sum_i V_i M_i`,
    /// with [`Material::modulus_bound`] `M_i`, because the terms of `W` are as large as the modulus and cancel at
    /// rest, and of `eps (sum_i (d_i u_i·u_i)²)^(1/2)`, because the penalty's energy is `-u·f/2`, where all forces of
    /// neighbours on a node sum to its stiffness `d_i` times `u_i` and cancel with it. What falls for minutes has a large `u`.
    ///
    /// An estimate: smaller differences of energy have no meaning.
    #[must_use]
    pub fn energy_round_off(&self, positions: &[DVec3]) -> f64 {
        let bounds = self.model.materials.iter().map(Material::modulus_bound);
        let bounds: Vec<f64> = bounds.collect();
        let volumes = self.model.elastic_volumes.iter().enumerate();
        let moduli = volumes.map(|(node, volume)| volume * bounds[self.model.material_index(node)]);
        let places = positions.iter().zip(&self.model.rest).enumerate();
        let apart = places
            .map(|(node, (x, rest))| (self.tables.drag(node) * x.distance_squared(*rest)).powi(2));
        f64::EPSILON * moduli.sum::<f64>().max(apart.sum::<f64>().sqrt())
    }

    /// Heap bytes that the model holds.
    #[must_use]
    pub fn bytes(&self) -> Bytes {
        let (model, state) = (&self.model, &self.state);
        Bytes {
            all: model.bytes()
                + state.bytes()
                + self.cut.bytes()
                + self.scratch.bytes()
                + self.tables.bytes(),
            cuts: state.prestrain.bytes()
                + self.cut.bytes()
                + model.control_scales.capacity() * size_of::<f64>(),
            watch: model.watch_bytes(),
            viscosity: state.viscosity.as_ref().map_or(0, Viscosity::bytes),
            held: model.inactive.bytes(),
        }
    }

    pub(crate) fn evaluate(
        &mut self,
        positions: &[DVec3],
        forces: &mut [DVec3],
        chosen: Chosen<'_>,
    ) -> f64 {
        let n = self.node_count();
        assert_eq!(positions.len(), n, "one position per node");
        assert_eq!(forces.len(), n, "one force per node");
        self.pass_one(positions, forces, chosen) + self.pass_two(forces, chosen)
    }

    fn pass_one(&mut self, x: &[DVec3], forces: &mut [DVec3], chosen: Chosen<'_>) -> f64 {
        let model = &self.model;
        let CutState { bonds, fronts, .. } = &mut self.cut;
        let mut beside = || {
            fronts.evaluate(&model.rest, x);
            bonds.evaluate(x)
        };
        let parts = (model, &mut self.state, &mut self.scratch);
        match self.tables.split() {
            Either::Plain(table) => {
                forces::pass_one(parts, table, (x, forces), chosen, &mut beside)
            }
            Either::Corrected(table) => {
                forces::pass_one(parts, table, (x, forces), chosen, &mut beside)
            }
        }
    }

    fn pass_two(&mut self, forces: &mut [DVec3], chosen: Chosen<'_>) -> f64 {
        let CutState { bonds, fronts, .. } = &self.cut;
        let beside = |deformation: &mut [_]| bonds.set_gradients(deformation);
        let parts = (&self.model, &mut self.scratch);
        match self.tables.split() {
            Either::Plain(table) => forces::pass_two(parts, table, forces, chosen, &beside),
            Either::Corrected(table) => forces::pass_two(parts, table, forces, chosen, &beside),
        }
        fronts.add_forces(forces, (&mut self.scratch.partial, CHUNK));
        bonds.add_forces(forces);
        self.scratch.partial.iter().sum()
    }

    /// Prepares the viscous part for a step of `time_step` (s) from the state of the last
    /// [`Elastic::end_viscous_step`]: forces and energy are then those of the step's incremental
    /// potential. Without a call the body answers with its long-term law. Returns whether any material is viscous; does
    /// nothing without.
    pub fn begin_viscous_step(&mut self, time_step: f64) -> bool {
        let model = &self.model;
        let Some(viscosity) = &mut self.state.viscosity else {
            return false;
        };
        let material_of = |node| model.material_index(node);
        viscosity.begin_step(time_step, &model.materials, material_of);
        true
    }

    /// Ends the step begun last at the state last evaluated: overstresses relax and take up the
    /// change of the long-term stress without what resists a change of volume alone.
    ///
    /// A node squeezed below a hundredth of its volume keeps the stress it had before.
    pub fn end_viscous_step(&mut self) {
        let (model, tables) = (&self.model, &self.tables);
        let Some(viscosity) = &mut self.state.viscosity else {
            return;
        };
        for node in 0..model.node_count() {
            let f = tables.gradient(node);
            if f.determinant() > 0.01 {
                let (energy, stress) = model.followed(node).energy_and_stress(f);
                let part = (energy, f.inverse() * stress);
                viscosity.end_step(node, model.material_index(node), f, part);
            }
        }
    }

    /// Energy (J) that viscosity's terms store after [`Elastic::end_viscous_step`]: `sum_i V_i sum_k Y_k`, a
    /// part of the energy that [`Elastic::forces_into`] returns. 0 without viscous materials.
    #[must_use]
    pub fn viscous_energy(&self) -> f64 {
        self.state.viscosity.as_ref().map_or(0.0, |viscosity| {
            let volumes = self.model.elastic_volumes.iter().enumerate();
            let energies = volumes.map(|(node, volume)| volume * viscosity.stored(node));
            energies.sum()
        })
    }
}

/// Takes the volumetric parts of the laws out.
fn means_of(model: &mut Model) -> Result<Means, ElasticError> {
    let green = |m: &Material| matches!(m.law, Law::SaintVenantKirchhoff { .. });
    if let Some(material) = model.materials.iter().position(green) {
        return Err(ElasticError::NoVolumetricPart { material });
    }
    let laws = model.coefficients.iter_mut();
    let laws = laws.map(Coefficients::split_volumetric).collect();
    Ok(Means::new(laws, &model.volumes, &model.pairs))
}

/// Reads all rows.
fn tables(model: &mut Model, stencils: &Stencils<'_>) -> Result<Tables, ElasticError> {
    let multipliers = stencils.multipliers;
    let frame = model.settings.frame;
    let mut tables = Tables::new(&model.rest, multipliers, model.controlled(), frame);
    let n = model.node_count();
    for node in 0..n {
        row::set_row(model, &mut tables, node, stencils)?;
    }
    if model.controlled() {
        for node in 0..n {
            tables.set_drag(&model.pairs, node);
        }
    }
    Ok(tables)
}

// After the methods above: documentation lists methods in this order.
mod bonds;
mod control;
mod fronts;
mod offsets;

#[cfg(test)]
mod tests;
