//! What moves in a body, to be kept and resumed from.

use glam::DVec3;
use phyxel_integrate::{Grip, StiffnessTracker};
use serde::{Deserialize, Serialize};

use crate::Member;
use crate::cutting::{CutState, Cutting};
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
    pub(crate) cut: CutState,
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
        let mut numbers = self.stiffness.indicators.iter().chain([&self.relaxed]);
        let mut estimates = self.stiffness.estimates.iter();
        body.motion.fits(&self.motion)
            && estimates.all(|value| value.is_finite() && *value >= 0.0)
            && (self.eigenvector.is_empty() || self.eigenvector.len() == n)
            && self.eigenvector.iter().all(|x| x.is_finite())
            && !self.smallest_ratio.is_nan()
            && numbers.all(|x| x.is_finite())
            && self.cut.is_finite()
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
            cut: cutting.as_ref().map(Cutting::state).unwrap_or_default(),
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
            cutting.set_state(state.cut);
        }
    }
}
