//! What moves in a body, as it is kept.

use glam::DVec3;
use phyxel_elastic::Elastic;
use phyxel_integrate::{Grip, State, StiffnessTracker, Warning};
use serde::{Deserialize, Serialize};

use crate::body::Body;
use crate::cut_state::{Cutting, KeptCut};
use crate::tool::ToolContact;

/// What moves in a body, and what watches over it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct BodyState {
    /// Checksum of the rest positions: a mesh file may have changed since.
    pub(crate) fingerprint: u32,
    pub(crate) motion: State,
    pub(crate) stiffness: StiffnessTracker,
    pub(crate) eigenvector: Vec<DVec3>,
    pub(crate) smallest_ratio: f64,
    pub(crate) doubt: Option<Warning>,
    pub(crate) cut: KeptCut,
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
    pub(crate) fn fits(&self, body: &Body) -> bool {
        let n = body.rest.len();
        let mut numbers = self.stiffness.indicators.iter().chain([&self.relaxed]);
        let mut estimates = self.stiffness.estimates.iter();
        body.motion().fits(&self.motion)
            && estimates.all(|value| value.is_finite() && *value >= 0.0)
            && (self.eigenvector.is_empty() || self.eigenvector.len() == n)
            && self.eigenvector.iter().all(|x| x.is_finite())
            && !self.smallest_ratio.is_nan()
            && numbers.all(|x| x.is_finite())
            && self.cut.is_finite()
            && body.of_model(|elastic| self.elastic.fits(elastic))
            && self.contacts.len() == body.contacts.len()
            && (self.contacts.iter().zip(&body.contacts))
                .all(|(kept, built)| kept.is_sound(n, built))
            && self.grip.as_ref().is_none_or(|grip| grip.is_sound(n))
    }
}

impl Body {
    /// What moves, to be kept.
    pub(crate) fn state(&self) -> BodyState {
        let motion = self.motion().state().clone();
        self.state_with(motion, self.whole.eigenvector().to_vec())
    }

    fn state_with(&self, motion: State, eigenvector: Vec<DVec3>) -> BodyState {
        let cutting = self.cutting.as_ref();
        BodyState {
            fingerprint: self.fingerprint,
            motion,
            stiffness: self.stiffness.clone(),
            eigenvector,
            smallest_ratio: self.smallest_ratio,
            doubt: self.doubt,
            cut: cutting.map(Cutting::state).unwrap_or_default(),
            elastic: self.whole.of_model(Elastic::state),
            relaxed: self.relaxed,
            contacts: self.contacts.clone(),
            grip: self.grip.clone(),
        }
    }

    /// What moves, to be kept: shares that have it keep their vectors themselves, and the state has none.
    pub(crate) fn keep(&mut self) -> BodyState {
        if !self.whole.keep() {
            return self.state();
        }
        let mut vectors = Default::default();
        self.whole.as_it_is().1.swap_vectors(&mut vectors);
        let motion = self.whole.of_motion(|motion| motion.state().clone());
        self.whole.as_it_is().1.swap_vectors(&mut vectors);
        self.state_with(motion, Vec::new())
    }

    /// Brings what [`Body::keep`] left with shares: of a state without positions.
    pub(crate) fn fetch_kept(&self, kept: &mut BodyState) {
        if kept.motion.positions.is_empty() {
            self.whole
                .fetch_kept(&mut kept.motion, &mut kept.eigenvector);
        }
    }

    /// Restores a snapshot of the same body with the same cuts; the model is brought to its positions.
    pub(crate) fn set_state(&mut self, state: BodyState) {
        self.whole
            .restore(&state.elastic, state.motion, state.eigenvector);
        self.stiffness = state.stiffness;
        self.smallest_ratio = state.smallest_ratio;
        self.doubt = state.doubt;
        self.relaxed = state.relaxed;
        self.contacts = state.contacts;
        self.grip = state.grip;
        if let Some(cutting) = &mut self.cutting {
            cutting.set_state(state.cut);
        }
    }
}
