//! Bodies whose nodes are partitioned: steps are taken where the shares are, all else here.
//!
//! A world keeps its bodies whole: it settles, cuts, watches and records them as ever. What is shared
//! out are the passes over nodes and pairs that every step takes, estimates of the largest eigenvalue, and
//! states to return to. What needs all nodes at once - a blade's edge, a picture, a checkpoint - brings
//! their positions here first.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::{DMat3, DVec3};
use phyxel_elastic::{Dilatation, Part, StiffNode};
use phyxel_integrate::{
    Eigenvalue, EigenvalueError, EigenvalueSettings, Grip, Motion, Shares, State,
};
use rayon::ThreadPool;

use crate::World;
use crate::body::{Body, evaluate, first_estimate};
use crate::error::BodyProblem;
use crate::scene::{self, Scene};

/// The shares of one body.
pub trait BodyShares: Shares + fmt::Debug + Send {
    /// Partitions the body again, at rest: nodes, rows, materials, supports, cuts. `watched` nodes, ascending, are
    /// those that the whole body's motion has to see in every step.
    ///
    /// # Errors
    /// [`BodyProblem`] if a share's model cannot be built.
    fn set_model(&mut self, body: &Body, watched: &[u32]) -> Result<(), BodyProblem>;

    /// Adopts what has changed of that model: the rows of `changed` nodes, ascending, with whatever else cuts have
    /// done to these, and who is monitored. The state is the one of before; if rows changed, its forces are evaluated
    /// again.
    ///
    /// # Errors
    /// [`BodyProblem`] if a share's model refuses them.
    fn change_model(
        &mut self,
        body: &Body,
        changed: &[u32],
        watched: &[u32],
    ) -> Result<(), BodyProblem>;

    /// Adopts the state and the loads of all nodes, and the stiffness-proportional damping.
    ///
    /// # Errors
    /// [`BodyProblem`] if a share refuses them.
    fn set_state(&mut self, motion: &Motion) -> Result<(), BodyProblem>;

    /// [`phyxel_elastic::Elastic::smallest_volume_ratio`] of the whole, at the state last evaluated.
    fn smallest_volume_ratio(&self) -> f64;

    /// [`phyxel_elastic::Elastic::stiffness_indicators`] of the whole, at the state last evaluated.
    fn stiffness_indicators(&self) -> Vec<f64>;

    /// Lets the retained gradients decay ([`phyxel_elastic::Elastic::decay`]); the first
    /// half of the work (J).
    fn decay(&mut self, factor: f64) -> f64;

    /// The second half of the works (J) of the last decay, at the state last evaluated: of deformation gradients
    /// and of bonds.
    fn decay_works(&self) -> [f64; 2];

    /// Estimates the largest eigenvalue of the whole where the nodes are, see
    /// [`phyxel_integrate::largest_eigenvalue`], from the vector of last time.
    ///
    /// # Errors
    /// [`EigenvalueError::NotFinite`].
    fn estimate(&mut self, settings: &EigenvalueSettings) -> Result<Eigenvalue, EigenvalueError>;

    /// Adopts the vector of estimates, one entry per node, or none.
    fn set_vector(&mut self, vector: &[DVec3]);

    /// Gives it back.
    fn vector(&mut self) -> Vec<DVec3>;

    /// [`phyxel_elastic::Elastic::stiffest_nodes`] of the whole where the nodes are, or of some of the runs of
    /// [`phyxel_elastic::WATCHED_NODES`] nodes.
    fn stiffest_nodes(&mut self, count: usize, runs: Option<&[usize]>) -> Vec<StiffNode>;

    /// Deformation gradients of some nodes where the nodes are, and positions (m) of others; both ascending.
    fn read(&mut self, gradients: &[u32], positions: &[u32]) -> (Vec<DMat3>, Vec<DVec3>);

    /// Keeps what [`Shares::fetch`] writes, and the vector of estimates, instead of what was kept before. Of the
    /// `velocities` (m/s) those of monitored nodes are current.
    fn keep(&mut self, velocities: &[DVec3]);

    /// Writes what was kept.
    fn kept(&mut self, state: &mut State, vector: &mut Vec<DVec3>);
}

/// Where the newest vectors of a body are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Newest {
    Here,
    Shares,
    Both,
}

/// A body's shares, and what they know of it.
#[derive(Debug, Clone)]
pub(crate) struct Shared {
    shares: Arc<Mutex<dyn BodyShares>>,
    newest: Newest,
    /// Whether the model here was evaluated where the nodes are.
    evaluated: bool,
    /// Whether the shares have the model, but for the rows of changed nodes.
    model: bool,
    /// Nodes whose rows cuts have changed since.
    changed: Vec<u32>,
    /// Nodes that they tell of in every step.
    watched: Vec<u32>,
    /// Where the newest vector of estimates is.
    vector: Newest,
    /// Whether they have the vectors of the snapshot.
    pub(crate) keeps: bool,
}

impl Shared {
    /// Whether they have what moves as it is, forces after a cut included.
    pub(crate) fn is_handed(&self) -> bool {
        self.newest != Newest::Here && self.changed.is_empty()
    }

    /// Estimates the largest eigenvalue of what was handed over; `vector` is the one here.
    pub(crate) fn estimate(
        &mut self,
        vector: &[DVec3],
        settings: &EigenvalueSettings,
    ) -> Result<Eigenvalue, EigenvalueError> {
        self.hand_vector(vector);
        self.vector = Newest::Shares;
        self.lock().estimate(settings)
    }

    pub(crate) fn hand_vector(&mut self, vector: &[DVec3]) {
        if self.vector == Newest::Here {
            self.lock().set_vector(vector);
            self.vector = Newest::Both;
        }
    }

    /// Brings all vectors here.
    fn fetch(&mut self, motion: &mut Motion) {
        if self.newest == Newest::Shares {
            motion.fetch(&mut *self.lock());
            self.newest = Newest::Both;
        }
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, dyn BodyShares + 'static> {
        self.shares.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl World {
    /// Brings the positions, velocities and forces of shared bodies here, for callers that read them.
    pub fn fetch(&mut self) {
        for body in &mut self.bodies {
            body.fetch();
        }
    }

    /// As [`World::fetch`], and brings all else here that [`World::state`] holds.
    pub fn fetch_state(&mut self) {
        self.fetch();
        self.fetch_kept();
        for body in &mut self.bodies {
            body.fetch_vector();
        }
    }

    /// As [`World::fetch`], and evaluates the models where the nodes are, for callers that read strains and
    /// stresses.
    pub fn fetch_all(&mut self) {
        for body in &mut self.bodies {
            body.fetch_all();
        }
    }
}

impl Body {
    /// Builds a body but for its eigenvalue and gives it to shares, which find that; `builders` build it.
    pub(crate) fn shared(
        scene: &Scene,
        description: &scene::Body,
        shares: Arc<Mutex<dyn BodyShares>>,
        builders: &ThreadPool,
    ) -> Result<Self, BodyProblem> {
        if let Some(what) = unshared(scene, description) {
            return Err(BodyProblem::NotShared(what));
        }
        let mut body = builders.install(|| Self::build(scene, description))?;
        let watched = body.watched();
        let found = {
            let mut shares = shares.lock().unwrap_or_else(PoisonError::into_inner);
            shares.set_model(&body, &watched)?;
            shares.set_vector(&body.eigenvector);
            shares.estimate(&first_estimate())?
        };
        body.take_first_eigenvalue(found, description.damping_ratio)?;
        body.shared = Some(Shared {
            shares,
            // They know nothing yet of loads, and of damping.
            newest: Newest::Here,
            evaluated: true,
            model: true,
            changed: Vec::new(),
            watched,
            vector: Newest::Shares,
            keeps: false,
        });
        Ok(body)
    }

    /// Gives the shares what has changed here.
    pub(crate) fn hand_over(&mut self) -> Result<(), BodyProblem> {
        let Some(mut shared) = self.shared.take() else {
            return Ok(());
        };
        let handed = self.hand_over_to(&mut shared);
        self.shared = Some(shared);
        handed
    }

    fn hand_over_to(&mut self, shared: &mut Shared) -> Result<(), BodyProblem> {
        if self.motion.state().forces.is_empty() {
            self.refresh()?;
            shared.newest = Newest::Here;
            shared.evaluated = true;
        }
        let watched = self.watched();
        let mut changed = std::mem::take(&mut shared.changed);
        if !shared.model {
            shared.fetch(&mut self.motion);
            shared.lock().set_model(self, &watched)?;
            shared.newest = Newest::Here;
            shared.model = true;
        } else if !changed.is_empty() || shared.watched != watched {
            shared.fetch(&mut self.motion);
            changed.sort_unstable();
            changed.dedup();
            shared.lock().change_model(self, &changed, &watched)?;
        }
        shared.watched = watched;
        if shared.newest == Newest::Here {
            shared.lock().set_state(&self.motion)?;
            shared.newest = Newest::Both;
        }
        Ok(())
    }

    /// Nodes that the motion of the whole has to see in every step, ascending.
    fn watched(&self) -> Vec<u32> {
        let supports = self.motion.supports().entries().iter();
        let driven = supports.filter(|support| support.path.is_some());
        let mut nodes: Vec<u32> = driven.map(|support| support.node).collect();
        let tools = self.contacts.iter().map(|tool| &tool.rigid.contact);
        nodes.extend(tools.flat_map(|contact| contact.surface().members()));
        nodes.extend(self.grip.iter().flat_map(Grip::nodes));
        nodes.extend(self.elastic.bond_ends());
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Brings positions, velocities and forces here.
    pub(crate) fn fetch(&mut self) {
        if let Some(shared) = &mut self.shared {
            shared.fetch(&mut self.motion);
        }
    }

    /// Brings them here and evaluates the model there.
    pub(crate) fn fetch_all(&mut self) {
        self.fetch();
        if let Some(shared) = &mut self.shared
            && !std::mem::replace(&mut shared.evaluated, true)
        {
            evaluate(&mut self.elastic, self.motion.positions());
        }
    }

    /// Brings the vector of estimates here.
    pub(crate) fn fetch_vector(&mut self) {
        if let Some(shared) = &mut self.shared
            && shared.vector == Newest::Shares
        {
            self.eigenvector = shared.lock().vector();
            shared.vector = Newest::Both;
        }
    }

    /// The stiffest nodes where the nodes are, of all or of some runs of them.
    pub(crate) fn stiffest_nodes(
        &mut self,
        count: usize,
        runs: Option<&[usize]>,
    ) -> Vec<StiffNode> {
        if let Some(shared) = &mut self.shared
            && shared.is_handed()
        {
            return shared.lock().stiffest_nodes(count, runs);
        }
        self.fetch_all();
        self.elastic.stiffest_nodes(count, runs)
    }

    /// Brings what products within a part read.
    pub(crate) fn fetch_part(&mut self, part: &Part) {
        if let Some(shared) = &mut self.shared
            && !shared.evaluated
        {
            let (gradients, positions) = shared.lock().read(part.rows(), part.ends());
            self.elastic.set_part_state(part, &gradients, &positions);
        }
    }

    /// Notes that the vector of estimates was changed here, after a [`Body::fetch_vector`].
    pub(crate) fn turned_here(&mut self) {
        if let Some(shared) = &mut self.shared {
            shared.vector = Newest::Here;
        }
    }

    /// Notes that what moves was changed here, after a [`Body::fetch`].
    pub(crate) fn moved_here(&mut self) {
        if let Some(shared) = &mut self.shared {
            shared.newest = Newest::Here;
        }
    }

    /// Notes that the model was changed here, and evaluated where the nodes are.
    pub(crate) fn rebuilt_here(&mut self) {
        if let Some(shared) = &mut self.shared {
            shared.newest = Newest::Here;
            shared.model = false;
            shared.changed.clear();
            shared.evaluated = true;
        }
    }

    /// Notes that a cut changed the rows of some nodes of the model here, which was evaluated where the nodes are.
    pub(crate) fn cut_here(&mut self, nodes: &[u32]) {
        if let Some(shared) = &mut self.shared {
            shared.changed.extend_from_slice(nodes);
        }
    }

    /// Shares that take the steps, to be locked for the one that follows.
    pub(crate) fn shares(&mut self) -> Option<Arc<Mutex<dyn BodyShares>>> {
        self.shared.as_mut().map(|shared| {
            shared.newest = Newest::Shares;
            shared.evaluated = false;
            shared.shares.clone()
        })
    }

    /// Smallest `det F` at the state last evaluated, of nodes that carry strain energy.
    #[must_use]
    pub fn smallest_volume_ratio(&self) -> f64 {
        match &self.shared {
            Some(shared) if !shared.evaluated => shared.lock().smallest_volume_ratio(),
            _ => self.elastic.smallest_volume_ratio(),
        }
    }

    /// Lets the retained gradients decay, here and in the shares; the first half of the work (J).
    pub(crate) fn decay_by(&mut self, factor: f64) -> f64 {
        // Where the nodes are with shares, what the model here says of works is of another state.
        let works = self.elastic.decay(factor, self.motion.positions());
        let [offsets, bonds] = works.sums();
        let work = offsets + bonds;
        let shared = self.shared.as_ref();
        shared.map_or(work, |shared| shared.lock().decay(factor))
    }

    /// The second halves (J) of the works of the last [`Body::decay_by`].
    pub(crate) fn decay_works(&mut self) -> [f64; 2] {
        let works = self.elastic.decay_works().sums();
        let shared = self.shared.as_ref();
        shared.map_or(works, |shared| shared.lock().decay_works())
    }

    /// Stiffness indicators of the runs of nodes at the state last evaluated.
    pub(crate) fn stiffness_indicators(&self) -> Vec<f64> {
        match &self.shared {
            Some(shared) if !shared.evaluated => shared.lock().stiffness_indicators(),
            _ => self.elastic.stiffness_indicators().collect(),
        }
    }
}

/// What of a scene's body takes all of its nodes in one place.
fn unshared(scene: &Scene, body: &scene::Body) -> Option<&'static str> {
    let (material, scheme) = (&body.material, scene.integration.scheme);
    let of = |found: bool, what| found.then_some(what);
    of(scene.bodies.len() != 1, "one of several bodies")
        .or(of(
            scene.contact.is_some(),
            "contact between bodies (contact)",
        ))
        .or(of(
            scheme.step().is_some(),
            "implicit schemes (integration.scheme)",
        ))
        .or(of(
            !material.viscosity.is_empty(),
            "viscous materials (material.viscosity)",
        ))
        .or(of(
            material.dilatation == Dilatation::Mean,
            "mean dilatation (material.dilatation)",
        ))
}
