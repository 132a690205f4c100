//! What moves in a body, to be kept and resumed from.

use glam::DVec3;
use phyxel_integrate::{Grip, StiffnessTracker};
use serde::{Deserialize, Serialize};

use crate::Member;
use crate::cutting::{Cutting, OpenStroke};
use crate::energy::CutEnergy;
use crate::tool::ToolContact;

/// What moves in a body, and what watches over it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct BodyState {
    /// Checksum of the rest positions: a mesh file may have changed since.
    pub(crate) fingerprint: u32,
    pub(crate) motion: phyxel_integrate::State,
    pub(crate) stiffness: StiffnessTracker,
    pub(crate) eigenvector: Vec<DVec3>,
    pub(crate) smallest_ratio: f64,
    pub(crate) doubt: Option<phyxel_integrate::Warning>,
    pub(crate) growth: Option<f64>,
    pub(crate) cut_energy: Option<CutEnergy>,
    pub(crate) stroke_energies: Vec<CutEnergy>,
    /// Blades that are in strokes.
    pub(crate) strokes: Vec<OpenStroke>,
    /// What decays in the model, and its control.
    pub(crate) elastic: phyxel_elastic::State,
    /// Energy (J) that viscosity has lost.
    pub(crate) relaxed: f64,
    pub(crate) contacts: Vec<ToolContact>,
    pub(crate) grip: Option<Grip>,
}

impl BodyState {
    /// Whether this can be a state of a body with the cuts that it has now: lists of its lengths, indices
    /// within it, finite numbers.
    pub(crate) fn fits(&self, member: &Member) -> bool {
        let body = &member.body;
        let n = body.rest.len();
        let cut = self.cut_energy.unwrap_or_default();
        let numbers = [
            self.relaxed,
            self.growth.unwrap_or(1.0),
            cut.released,
            cut.added,
            cut.largest_addition,
            cut.decay,
        ];
        let mut numbers = numbers.iter().chain(&self.stiffness.indicators);
        body.motion.fits(&self.motion)
            && self
                .stiffness
                .estimates
                .iter()
                .all(|value| value.is_finite() && *value >= 0.0)
            && (self.eigenvector.is_empty() || self.eigenvector.len() == n)
            && self.eigenvector.iter().all(|x| x.is_finite())
            && !self.smallest_ratio.is_nan()
            && numbers.all(|x| x.is_finite())
            && self.elastic.fits(&body.elastic)
            && self.contacts.len() == member.contacts.len()
            && (self.contacts.iter().zip(&member.contacts))
                .all(|(kept, built)| kept.is_sound(n, built))
            && self.grip.as_ref().is_none_or(|grip| grip.is_sound(n))
    }
}

impl Member {
    /// What moves, to be kept.
    pub(crate) fn state(&self) -> BodyState {
        let Self {
            body,
            cutting,
            contacts,
        } = self;
        BodyState {
            fingerprint: body.fingerprint,
            motion: body.motion.state().clone(),
            stiffness: body.stiffness.clone(),
            eigenvector: body.eigenvector.clone(),
            smallest_ratio: body.smallest_ratio,
            doubt: body.doubt,
            growth: cutting.as_ref().map(Cutting::growth),
            strokes: cutting
                .as_ref()
                .map_or_else(Vec::new, Cutting::open_strokes),
            cut_energy: cutting.as_ref().map(Cutting::energy),
            stroke_energies: cutting.as_ref().map_or_else(Vec::new, |cutting| {
                let strokes = cutting.by_stroke().iter();
                strokes.map(|stroke| stroke.energy).collect()
            }),
            elastic: body.elastic.state(),
            relaxed: body.relaxed,
            contacts: contacts.clone(),
            grip: body.grip.clone(),
        }
    }

    /// Restores a snapshot of the same body with the same cuts.
    pub(crate) fn set_state(&mut self, state: BodyState) {
        let body = &mut self.body;
        body.elastic.set_state(&state.elastic);
        body.relaxed = state.relaxed;
        body.smallest_ratio = state.smallest_ratio;
        body.doubt = state.doubt;
        body.grip = state.grip;
        body.restore(state.motion, state.stiffness, state.eigenvector);
        self.contacts = state.contacts;
        if let Some(cutting) = &mut self.cutting {
            if let Some(growth) = state.growth {
                cutting.set_growth(growth);
            }
            if let Some(energy) = state.cut_energy {
                cutting.set_energy(energy, &state.stroke_energies);
            }
            cutting.set_open_strokes(state.strokes);
        }
    }
}
