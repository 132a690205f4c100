//! A world's state, to be kept and gone on from.
//!
//! A scene says how bodies are built; what it does not say is where their nodes are, and what blades
//! have done. Of a blade only what it added to the cut is kept, in the material: taking that up again
//! gives the same cut, factors and rows, to the bit.

use glam::DVec3;
use phyxel_elastic::Offsets;
use serde::{Deserialize, Serialize};

use super::cutting::{CutEnergy, Cutting, Moment, OpenStroke, Sweep};
use super::error::{BodyProblem, WorldError};
use super::grip::{Adjusted, Grip};
use super::guard::{Kept, Retaken, presses};
use super::input::HandsState;
use super::tool::Touch;
use super::{CutPiece, Member, World};
use crate::phases::Phases;

/// All of a world that its scene does not say.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct WorldState {
    origin: Option<f64>,
    gravity: Option<DVec3>,
    hands: HandsState,
    phases: Phases,
    latencies: Vec<f64>,
    bodies: Vec<BodyState>,
    incisions: Vec<Incision>,
    kept: Option<Kept>,
    caution: f64,
    retaken: Retaken,
    adjusted: Adjusted,
}

/// What moves in a body, and what watches over it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct BodyState {
    /// Checksum of the rest positions: a mesh file may have changed since.
    fingerprint: u32,
    motion: phyxel_integrate::State,
    estimates: [f64; 2],
    eigenvector: Vec<DVec3>,
    indicator: f64,
    smallest_ratio: f64,
    growth: Option<f64>,
    cut_energy: Option<CutEnergy>,
    /// Blades that are in strokes.
    strokes: Vec<OpenStroke>,
    /// What viscous materials remember, and the energy (J) they took up.
    history: Vec<[f64; 6]>,
    relaxed: f64,
    /// What rebuilt rows carried over: nodes, deformation gradients, lengths of bonds.
    offset_nodes: Vec<u32>,
    offsets: Vec<[f64; 9]>,
    bond_offsets: Vec<f64>,
    touches: Vec<Touch>,
    grip: Option<Grip>,
}

impl BodyState {
    /// Whether a tool acted in the last step.
    pub(super) fn is_pressed(&self) -> bool {
        presses(&self.motion.applied)
    }

    pub(super) fn audit(&self) -> &phyxel_integrate::Audit {
        &self.motion.audit
    }
}

impl Member {
    /// What moves, to be kept.
    pub(super) fn state(&self) -> BodyState {
        let Self {
            body,
            cutting,
            touches,
        } = self;
        let offsets = body.elastic.offsets();
        BodyState {
            fingerprint: body.fingerprint,
            motion: body.motion.state().clone(),
            estimates: body.estimates,
            eigenvector: body.eigenvector.clone(),
            indicator: body.indicator,
            smallest_ratio: body.smallest_ratio,
            growth: cutting.as_ref().map(Cutting::growth),
            strokes: cutting
                .as_ref()
                .map_or_else(Vec::new, Cutting::open_strokes),
            cut_energy: cutting.as_ref().map(Cutting::energy),
            history: body.elastic.viscous_history().to_vec(),
            relaxed: body.relaxed,
            offset_nodes: offsets.nodes,
            offsets: offsets.values,
            bond_offsets: body.elastic.bond_offsets(),
            touches: touches.clone(),
            grip: body.grip.clone(),
        }
    }

    /// Takes over a kept state of the same body with the same cuts.
    pub(super) fn set_state(&mut self, state: BodyState) {
        let body = &mut self.body;
        body.elastic.set_offsets(&Offsets {
            nodes: state.offset_nodes,
            values: state.offsets,
        });
        body.elastic.set_bond_offsets(&state.bond_offsets);
        body.indicator = state.indicator;
        body.smallest_ratio = state.smallest_ratio;
        let viscous = (&*state.history, state.relaxed);
        body.grip = state.grip;
        body.restore(state.motion, state.estimates, state.eigenvector, viscous);
        self.touches = state.touches;
        if let Some(cutting) = &mut self.cutting {
            if let Some(growth) = state.growth {
                cutting.set_growth(growth);
            }
            if let Some(energy) = state.cut_energy {
                cutting.set_energy(energy);
            }
            cutting.set_open_strokes(state.strokes);
        }
    }
}

/// What a blade's edge did when it was taken up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Incision {
    /// Steps that had been taken.
    pub(super) steps: u64,
    /// Index of the body.
    pub(super) member: usize,
    /// Index of the scene's cut.
    pub(super) cut: usize,
    pub(super) moment: Moment,
    /// What it added to the cut.
    pub(super) sweep: Sweep,
}

impl World {
    /// The state between two steps. Pieces that [`World::take_new_pieces`] has not handed out count
    /// as handed out.
    #[must_use]
    pub fn state(&self) -> WorldState {
        WorldState {
            origin: self.origin,
            gravity: self.gravity,
            hands: self.hands.state(),
            phases: self.phases.clone(),
            latencies: self.latencies.clone(),
            bodies: self.members.iter().map(Member::state).collect(),
            kept: self.kept.clone(),
            caution: self.caution,
            retaken: self.retaken,
            incisions: self.incisions.clone(),
            adjusted: self.adjusted,
        }
    }

    /// Brings a new world into a state that [`World::state`] gave. `grown` sees the pieces of cuts
    /// as the first run saw them, with the world's cuts as they were then.
    ///
    /// # Errors
    /// [`WorldError`] with [`BodyProblem::OtherBody`] if a body is not built as it was, and whatever
    /// taking up an edge or `grown` returns.
    pub fn restore<F>(&mut self, state: WorldState, mut grown: F) -> Result<(), WorldError>
    where
        F: FnMut(&Self, &[CutPiece]) -> Result<(), WorldError>,
    {
        self.check(&state)?;
        self.adjusted = state.adjusted;
        for (k, incision) in state.incisions.iter().enumerate() {
            self.take_up(incision)?;
            let next = state.incisions.get(k + 1);
            if next.is_none_or(|next| next.steps != incision.steps) {
                let pieces = self.take_new_pieces();
                if !pieces.is_empty() {
                    grown(self, &pieces)?;
                }
            }
        }
        if let (Some(start), None) = (state.origin, self.origin) {
            self.start_scene_at(start)?;
        }
        self.set_gravity(state.gravity)?;
        for (member, kept) in self.members.iter_mut().zip(state.bodies) {
            member.set_state(kept);
        }
        self.kept = state.kept;
        self.caution = state.caution;
        self.retaken = state.retaken;
        self.step = self.smallest_step_size();
        self.hands.restore(state.hands);
        self.phases = state.phases;
        self.latencies = state.latencies;
        self.incisions = state.incisions;
        Ok(())
    }

    fn check(&self, state: &WorldState) -> Result<(), WorldError> {
        for (index, Member { body, .. }) in self.members.iter().enumerate() {
            let kept = state.bodies.get(index);
            if kept.is_none_or(|kept| kept.fingerprint != body.fingerprint) {
                return Err(WorldError::Body {
                    body: body.name.clone(),
                    problem: BodyProblem::OtherBody,
                });
            }
        }
        Ok(())
    }

    fn take_up(&mut self, incision: &Incision) -> Result<(), WorldError> {
        let Some(cut) = self.scene.cuts.get(incision.cut) else {
            return Ok(());
        };
        let Some(member) = self.members.get_mut(incision.member) else {
            return Ok(());
        };
        let capture = member
            .replay(incision, cut)
            .map_err(|problem| WorldError::Body {
                body: member.body.name.clone(),
                problem,
            })?;
        self.cut_through[incision.cut] |= capture.changed;
        if !capture.triangles.is_empty() {
            self.new_pieces.push(CutPiece {
                member: incision.member,
                triangles: capture.triangles,
            });
        }
        Ok(())
    }
}

pub(super) fn fingerprint(rest: &[DVec3]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    for x in rest {
        for coordinate in x.to_array() {
            hasher.update(&coordinate.to_le_bytes());
        }
    }
    hasher.finalize()
}
