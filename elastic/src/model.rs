//! The model: built once from slices, then two passes per evaluation.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::completion::{RowKind, Span, row_kind};
use crate::error::ElasticError;
use crate::kernel::{LANES, Move, NodeRows, PairRow, gather_force, gather_gradient};
use crate::material::{Material, Prepared, double_dot};
use crate::rows::{RowSums, Rows};

/// Nodes per unit of parallel work, and per partial sum of the energy.
const CHUNK: usize = 256;
/// Below this many nodes a second thread costs more than it saves.
const PARALLEL_NODES: usize = 1024;

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
    /// `w_ij = w_ji >= 0` of the moment matrix (any unit), shape `(pairs)`. Only zero-energy
    /// control reads them; without it the slice may be empty.
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
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            zero_energy_control: 0.1,
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
    pub(crate) settings: Settings,
    pub(crate) rows: Rows,
    pub(crate) rest: Vec<DVec3>,
    pub(crate) volumes: Vec<f64>,
    /// `V_i` with the stiffness cap applied.
    pub(crate) elastic_volumes: Vec<f64>,
    pub(crate) materials: Vec<Material>,
    prepared: Vec<Prepared>,
    /// Empty if there is one material for all.
    material_of: Vec<u32>,
    pub(crate) own_pairs: Vec<PairRow>,
    /// `A_i⁻¹`, zero where zero-energy control is off or the row is deficient.
    moment_inverses: Vec<DMat3>,
    /// `1 / sum_j w_ij |X_ij|²`, zero likewise.
    spread_inverses: Vec<f64>,
    /// Nodes whose row is not full, rising.
    spans: Vec<(u32, Span)>,
    ranks: Vec<u8>,
    // Computed by an evaluation.
    moves: Vec<Move>,
    node_rows: Vec<NodeRows>,
    deformation: Vec<DMat3>,
    partial_energies: Vec<f64>,
}

impl Elastic {
    /// Builds a model.
    ///
    /// # Errors
    /// [`ElasticError`] names the first node, pair or material that cannot be used: values that
    /// are not finite, volumes that are not positive, unsorted rows, rows without linear
    /// consistency, one-way pairs or unequal weights under zero-energy control, parameters out of
    /// range.
    ///
    /// # Panics
    /// If the slices' lengths do not fit together.
    pub fn new(
        stencils: &Stencils<'_>,
        nodes: &Nodes<'_>,
        materials: &Materials<'_>,
        settings: &Settings,
    ) -> Result<Self, ElasticError> {
        let node_count = nodes.rest_positions.len();
        let controlled = settings.zero_energy_control > 0.0;
        stencils.check_lengths(node_count, controlled);
        assert_eq!(nodes.volumes.len(), node_count, "one volume per node");
        for (node, (x, &volume)) in nodes.rest_positions.iter().zip(nodes.volumes).enumerate() {
            if !x.is_finite() {
                let what = "rest position";
                return Err(ElasticError::NotFinite { what, node });
            }
            if !(volume > 0.0 && volume.is_finite()) {
                return Err(ElasticError::NonPositiveVolume { node, volume });
            }
        }
        let (list, material_of) = checked_materials(materials, node_count)?;
        let blank = PairRow([0.0; LANES]);
        let mut model = Self {
            settings: *settings,
            rows: Rows::new(stencils, controlled)?,
            rest: nodes.rest_positions.to_vec(),
            volumes: nodes.volumes.to_vec(),
            elastic_volumes: nodes.volumes.to_vec(),
            prepared: list.iter().map(Prepared::new).collect(),
            materials: list,
            material_of,
            own_pairs: vec![blank; node_count],
            moment_inverses: vec![DMat3::ZERO; node_count],
            spread_inverses: vec![0.0; node_count],
            spans: Vec::new(),
            ranks: vec![3; node_count],
            moves: vec![[0.0; 4]; node_count],
            node_rows: vec![NodeRows([[0.0; LANES]; 3]); node_count],
            deformation: vec![DMat3::IDENTITY; node_count],
            partial_energies: vec![0.0; node_count.div_ceil(CHUNK)],
        };
        for node in 0..node_count {
            model.set_row(node, stencils)?;
        }
        if controlled {
            for node in 0..node_count {
                model.rows.check_symmetry(node)?;
            }
        }
        Ok(model)
    }

    /// Number of nodes.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.rest.len()
    }

    /// Number of directed pairs.
    #[must_use]
    pub fn pair_count(&self) -> usize {
        self.rows.pair_count()
    }

    /// Volumes `V_i` (m³) that carry elastic energy: the given ones, less where
    /// [`Elastic::cap_stiffness`] lowered them.
    #[must_use]
    pub fn elastic_volumes(&self) -> &[f64] {
        &self.elastic_volumes
    }

    /// Deformation gradients `F_i` of the last evaluation; the identity before the first.
    ///
    /// A node with a deficient row has unit vectors normal to the deformed span of its neighbours
    /// in place of the directions that its row cannot see.
    #[must_use]
    pub fn deformation_gradients(&self) -> &[DMat3] {
        &self.deformation
    }

    /// Number of dimensions, 0 to 3, that the row of `node` sees.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn rank(&self, node: usize) -> u8 {
        self.ranks[node]
    }

    /// Material of a node.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn material(&self, node: usize) -> &Material {
        &self.materials[self.material_index(node)]
    }

    /// First Piola–Kirchhoff stress `P_i` (Pa) at the state last evaluated.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn first_piola_kirchhoff(&self, node: usize) -> DMat3 {
        self.material(node)
            .energy_and_stress(self.deformation[node])
            .1
    }

    /// Cauchy stress (Pa) at the state last evaluated; see [`Material::cauchy_stress`].
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn cauchy_stress(&self, node: usize) -> DMat3 {
        self.material(node).cauchy_stress(self.deformation[node])
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
        for ((m, x), rest) in self.moves.iter_mut().zip(positions).zip(&self.rest) {
            let u = *x - *rest;
            [m[0], m[1], m[2]] = u.to_array();
        }
        let mut node_rows = std::mem::take(&mut self.node_rows);
        let mut deformation = std::mem::take(&mut self.deformation);
        let mut partial = std::mem::take(&mut self.partial_energies);
        let first = |(chunk, ((rows, f), energy)): Work<'_, (&mut [NodeRows], &mut [DMat3])>| {
            *energy = 0.0;
            for (k, (rows, f)) in rows.iter_mut().zip(f).enumerate() {
                *energy += self.stress_rows(chunk * CHUNK + k, rows, f);
            }
        };
        if self.parallel() {
            node_rows
                .par_chunks_mut(CHUNK)
                .zip(deformation.par_chunks_mut(CHUNK))
                .zip(&mut partial)
                .enumerate()
                .for_each(first);
        } else {
            node_rows
                .chunks_mut(CHUNK)
                .zip(deformation.chunks_mut(CHUNK))
                .zip(&mut partial)
                .enumerate()
                .for_each(first);
        }
        self.deformation = deformation;
        let second = |(chunk, (forces, energy)): Work<'_, &mut [DVec3]>| {
            for (k, force) in forces.iter_mut().enumerate() {
                let node = chunk * CHUNK + k;
                *force = self.force(node, &node_rows);
                let [ux, uy, uz, _] = self.moves[node];
                *energy -= 0.5 * DVec3::new(ux, uy, uz).dot(*force);
            }
        };
        if self.parallel() {
            forces
                .par_chunks_mut(CHUNK)
                .zip(&mut partial)
                .enumerate()
                .for_each(second);
        } else {
            forces
                .chunks_mut(CHUNK)
                .zip(&mut partial)
                .enumerate()
                .for_each(second);
        }
        let energy = partial.iter().sum();
        self.node_rows = node_rows;
        self.partial_energies = partial;
        energy
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
        for (m, v) in self.moves.iter_mut().zip(vector) {
            [m[0], m[1], m[2]] = v.to_array();
        }
        let mut node_rows = std::mem::take(&mut self.node_rows);
        let first = |(chunk, rows): (usize, &mut [NodeRows])| {
            for (k, rows) in rows.iter_mut().enumerate() {
                self.stress_change_rows(chunk * CHUNK + k, rows);
            }
        };
        if self.parallel() {
            node_rows.par_chunks_mut(CHUNK).enumerate().for_each(first);
        } else {
            node_rows.chunks_mut(CHUNK).enumerate().for_each(first);
        }
        let second = |(chunk, product): (usize, &mut [DVec3])| {
            for (k, product) in product.iter_mut().enumerate() {
                *product = -self.force(chunk * CHUNK + k, &node_rows);
            }
        };
        if self.parallel() {
            product.par_chunks_mut(CHUNK).enumerate().for_each(second);
        } else {
            product.chunks_mut(CHUNK).enumerate().for_each(second);
        }
        self.node_rows = node_rows;
    }

    /// Heap bytes that the model holds.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.rows.bytes()
            + self.rest.capacity() * size_of::<DVec3>()
            + (self.volumes.capacity() + self.elastic_volumes.capacity()) * size_of::<f64>()
            + self.materials.capacity() * size_of::<Material>()
            + self.prepared.capacity() * size_of::<Prepared>()
            + self.material_of.capacity() * size_of::<u32>()
            + self.own_pairs.capacity() * size_of::<PairRow>()
            + self.moment_inverses.capacity() * size_of::<DMat3>()
            + self.spread_inverses.capacity() * size_of::<f64>()
            + self.spans.capacity() * size_of::<(u32, Span)>()
            + self.ranks.capacity()
            + self.moves.capacity() * size_of::<Move>()
            + self.node_rows.capacity() * size_of::<NodeRows>()
            + self.deformation.capacity() * size_of::<DMat3>()
            + self.partial_energies.capacity() * size_of::<f64>()
    }

    fn parallel(&self) -> bool {
        self.node_count() >= PARALLEL_NODES && rayon::current_num_threads() > 1
    }

    pub(crate) fn material_index(&self, node: usize) -> usize {
        self.material_of.get(node).map_or(0, |&m| m as usize)
    }

    fn span(&self, node: usize) -> Option<&Span> {
        let found = self
            .spans
            .binary_search_by(|(at, _)| (*at as usize).cmp(&node));
        found.ok().map(|k| &self.spans[k].1)
    }

    /// First pass of one node: `F`, the rows `(-V P, c H)`, and its share of the energy.
    #[inline]
    fn stress_rows(&self, node: usize, rows: &mut NodeRows, deformation: &mut DMat3) -> f64 {
        let (indices, pairs) = self.rows.row(node);
        let own = &self.moves[node];
        let sum = gather_gradient(own, indices, pairs, &self.moves);
        let (h, s) = split(&sum);
        let law = &self.prepared[self.material_index(node)];
        let (f, energy, stress) = if self.ranks[node] == 3 {
            let f = DMat3::IDENTITY + h;
            let (energy, stress) = law.energy_and_stress(f);
            (f, energy, stress)
        } else if let Some(span) = self.span(node) {
            span.energy_and_stress(law, span.projector() + h)
        } else {
            (DMat3::IDENTITY, 0.0, DMat3::ZERO)
        };
        *deformation = f;
        let volume = self.elastic_volumes[node];
        *rows = join(stress * -volume, s * (self.moment_inverses[node] * own[3]));
        volume * (energy - 0.5 * double_dot(stress, h))
    }

    #[inline]
    fn stress_change_rows(&self, node: usize, rows: &mut NodeRows) {
        let (indices, pairs) = self.rows.row(node);
        let own = &self.moves[node];
        let sum = gather_gradient(own, indices, pairs, &self.moves);
        let (dh, ds) = split(&sum);
        let law = &self.prepared[self.material_index(node)];
        let f = self.deformation[node];
        let change = if self.ranks[node] == 3 {
            law.stress_change(f, dh)
        } else if let Some(span) = self.span(node) {
            span.stress_change(law, f, dh)
        } else {
            DMat3::ZERO
        };
        *rows = join(
            change * -self.elastic_volumes[node],
            ds * (self.moment_inverses[node] * own[3]),
        );
    }

    /// Second pass of one node.
    #[inline]
    fn force(&self, node: usize, node_rows: &[NodeRows]) -> DVec3 {
        let (indices, reversed, weights) = self.rows.incoming(node);
        DVec3::from_array(gather_force(
            &self.moves[node],
            &node_rows[node],
            &self.own_pairs[node],
            indices,
            reversed,
            weights,
            &self.moves,
            node_rows,
        ))
    }

    /// Reads a row of the stencils and everything that follows from it.
    pub(crate) fn set_row(
        &mut self,
        node: usize,
        stencils: &Stencils<'_>,
    ) -> Result<(), ElasticError> {
        let controlled = self.settings.zero_energy_control > 0.0;
        let sums = self.rows.set_row(node, stencils, &self.rest, controlled)?;
        let RowSums {
            own_pair,
            consistency,
            moment,
        } = sums;
        self.own_pairs[node] = own_pair;
        let at = self
            .spans
            .binary_search_by(|(other, _)| (*other as usize).cmp(&node));
        let full = match row_kind(consistency) {
            RowKind::Full => {
                self.ranks[node] = 3;
                if let Ok(at) = at {
                    self.spans.remove(at);
                }
                true
            }
            RowKind::Deficient(span) => {
                self.ranks[node] = span.rank;
                match at {
                    Ok(at) => self.spans[at].1 = span,
                    Err(at) => {
                        let id = u32::try_from(node).unwrap_or(u32::MAX);
                        self.spans.insert(at, (id, span));
                    }
                }
                false
            }
            RowKind::Inconsistent(residual) => {
                return Err(ElasticError::InconsistentRow { node, residual });
            }
        };
        let spread = moment.x_axis.x + moment.y_axis.y + moment.z_axis.z;
        // Without a full row the leftover e_ij is not blind to rotations; the node is then held by
        // the control of its neighbours.
        let inverse = moment.inverse();
        let usable = full && controlled && spread > 0.0 && inverse.is_finite();
        self.moment_inverses[node] = if usable { inverse } else { DMat3::ZERO };
        self.spread_inverses[node] = if usable { spread.recip() } else { 0.0 };
        self.refresh_control(node);
        Ok(())
    }

    /// Recomputes `c_i` after its volume or row changed.
    pub(crate) fn refresh_control(&mut self, node: usize) {
        let mu = self.material(node).lame_mu();
        self.moves[node][3] = self.settings.zero_energy_control
            * mu
            * self.elastic_volumes[node]
            * self.spread_inverses[node];
    }

    /// `c_i` of a node.
    pub(crate) fn control(&self, node: usize) -> f64 {
        self.moves[node][3]
    }
}

/// A chunk's number, its outputs and its partial energy.
type Work<'a, T> = (usize, (T, &'a mut f64));

impl Stencils<'_> {
    pub(crate) fn check_lengths(&self, node_count: usize, controlled: bool) {
        let pairs = self.indices.len();
        assert_eq!(self.offsets.len(), node_count + 1, "offsets: nodes + 1");
        assert_eq!(self.self_gradients.len(), node_count, "one g_ii per node");
        assert_eq!(self.gradients.len(), pairs, "one g_ij per pair");
        assert!(
            self.weights.len() == pairs || !controlled,
            "zero-energy control needs one weight per pair"
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

/// Splits a 3×6 matrix into the part on `g` and the part on `y`.
#[inline]
fn split(sum: &[[f64; LANES]; 3]) -> (DMat3, DMat3) {
    let column = |k: usize| DVec3::new(sum[0][k], sum[1][k], sum[2][k]);
    (
        DMat3::from_cols(column(0), column(1), column(2)),
        DMat3::from_cols(column(3), column(4), column(5)),
    )
}

#[inline]
fn join(on_gradient: DMat3, on_offset: DMat3) -> NodeRows {
    let (a, b) = (on_gradient, on_offset);
    let row = |a: DVec3, b: DVec3| [a.x, a.y, a.z, b.x, b.y, b.z];
    NodeRows([
        row(a.row(0), b.row(0)),
        row(a.row(1), b.row(1)),
        row(a.row(2), b.row(2)),
    ])
}

#[cfg(test)]
mod tests;
