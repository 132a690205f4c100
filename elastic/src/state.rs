//! What decays, and what a model is restored from.

use glam::{DMat3, DVec3};

use crate::cut::Works;
use crate::law::viscosity::Viscosity;
use crate::model::Elastic;

/// All of a model that time and cuts change, its rows aside.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// Per node of a viscous body the last second Piola–Kirchhoff stress, one overstress per Prony term (Pa; xx, yy,
    /// zz, xy, yz, zx), the last Green strain, and the energy densities (J/m³) of the long-term law and of each term.
    pub viscosity: Vec<[f64; 6]>,
    /// Nodes with a retained gradient or mean volume ratio, ascending, its offset `A` by columns and that of the ratio.
    pub offsets: Vec<(u32, ([f64; 9], f64))>,
    /// Nodes without a strain of their own, ascending. Which a cut leaves follows from where nodes were, too.
    pub deficient: Vec<u32>,
    /// Offsets (m) of all their bonds.
    pub bonds: Vec<f64>,
    /// Nodes whose hourglass stabilization has a scale other than 1, ascending, and the scale.
    pub control: Vec<(u32, f64)>,
    /// Nodes with a control of a cut's front, ascending, and its matrix.
    pub fronts: Vec<(u32, DMat3)>,
}

impl State {
    /// Whether it can be a state of `body`: lists of its lengths, nodes within it, numbers within their bounds.
    #[must_use]
    pub fn fits(&self, body: &Elastic) -> bool {
        let exists = |node: u32| (node as usize) < body.node_count();
        let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
        let viscosity = body.state.viscosity.as_ref();
        self.viscosity.len() == viscosity.map_or(0, |v| v.history().len())
            && self.viscosity.iter().all(|row| finite(row))
            && (self.offsets.iter())
                .all(|(node, (value, mean))| exists(*node) && finite(value) && mean.is_finite())
            && self.deficient == body.deficient_nodes()
            && self.bonds.len() == body.bond_offsets().len()
            && finite(&self.bonds)
            && (self.control.iter())
                .all(|&(node, scale)| exists(node) && scale.is_finite() && scale >= 1.0)
            && (self.fronts.iter()).all(|(node, matrix)| exists(*node) && is_mean(matrix))
    }
}

/// Whether this can be a mean of squares of unit vectors, or a part of it.
fn is_mean(matrix: &DMat3) -> bool {
    let trace = matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z;
    matrix.is_finite() && trace > 0.0 && trace < 1.0 + 1e-9
}

impl Elastic {
    /// Whether there are retained gradients or bonds, for [`Elastic::decay`].
    #[must_use]
    pub fn decays(&self) -> bool {
        !self.state.prestrain.is_empty() || !self.cut.bonds.is_empty()
    }

    /// Multiplies the offsets of retained gradients and bonds with `factor` (0 to 1), where the nodes are (m). Returns the
    /// first half of the works, with the stresses last evaluated; [`Elastic::decay_works`] returns the second after the
    /// next evaluation.
    ///
    /// # Panics
    /// If `positions` is not one per node.
    pub fn decay(&mut self, factor: f64, positions: &[DVec3]) -> &Works {
        assert_eq!(positions.len(), self.node_count(), "one position per node");
        // Elsewhere than here the nodes of a body that is shared out were evaluated.
        for bond in &mut self.cut.bonds.list {
            bond.set_x(positions[bond.other as usize] - positions[bond.node as usize]);
        }
        let mut works = std::mem::take(&mut self.cut.works);
        self.decay_offsets(factor, &mut works.offsets);
        self.decay_bonds(factor, &mut works.bonds);
        self.cut.works = works;
        &self.cut.works
    }

    /// The second half of the works of the last [`Elastic::decay`], at the state last evaluated; to be asked for once.
    pub fn decay_works(&mut self) -> &Works {
        let mut works = std::mem::take(&mut self.cut.works);
        self.offset_works(&mut works.offsets);
        self.bond_works(&mut works.bonds);
        self.cut.works = works;
        &self.cut.works
    }

    /// The state, for snapshots and checkpoints.
    #[must_use]
    pub fn state(&self) -> State {
        let viscosity = self.state.viscosity.as_ref();
        State {
            viscosity: viscosity.map_or_else(Vec::new, |v| v.history().to_vec()),
            offsets: self.offsets(),
            deficient: self.deficient_nodes().to_vec(),
            bonds: self.bond_offsets(),
            control: self.control_scales(),
            fronts: self.fronts(),
        }
    }

    /// Restores a state on the same rows and deficient nodes ([`Elastic::weaken`] makes those that are missing). Viscosity
    /// is then between two steps.
    ///
    /// # Panics
    /// If [`State::fits`] would say no.
    pub fn set_state(&mut self, state: &State) {
        self.set_offsets(&state.offsets);
        self.set_bond_offsets(&state.bonds);
        self.set_control_scales(&state.control);
        self.restore_fronts(&state.fronts);
        match &mut self.state.viscosity {
            Some(viscosity) => Viscosity::set_history(viscosity, &state.viscosity),
            None => assert!(state.viscosity.is_empty(), "no viscous materials here"),
        }
        self.begin_viscous_step(0.0);
    }
}
