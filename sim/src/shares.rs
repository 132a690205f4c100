//! Bodies whose nodes are partitioned: steps are taken where the shares are, all else here.
//!
//! A world keeps its bodies whole: it settles, cuts, watches and records them as ever. What is shared
//! out are the passes over nodes and pairs that every step takes, estimates of the largest eigenvalue, and
//! states to return to. What needs all nodes at once - a blade's edge, a picture, a checkpoint - brings
//! their positions here first.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::{DMat3, DVec3};
use phyxel_elastic::{Dilatation, Elastic, Part, StiffNode};
use phyxel_integrate::{
    Eigenvalue, EigenvalueError, EigenvalueSettings, Grip, Motion, Shares, State, StepError,
    largest_eigenvalue,
};
use rayon::ThreadPool;

use crate::body::{Body, evaluate};
use crate::error::BodyProblem;
use crate::newest::Newest;
use crate::scene::{self, Scene};
use crate::stiffness::estimate;

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

/// A body's shares, and what they have of it.
#[derive(Debug)]
struct SharedBody {
    shares: Arc<Mutex<dyn BodyShares>>,
    /// Positions, velocities, forces and loads.
    motion: bool,
    /// The vector of estimates.
    vector: bool,
    /// The model, but for the rows of changed nodes.
    model: bool,
    /// Nodes whose rows cuts have changed since.
    changed: Vec<u32>,
    /// Nodes whose motion is known here after every step.
    watched: Vec<u32>,
}

impl SharedBody {
    /// Whether they have what moves as it is, forces after a cut included.
    fn is_handed(&self) -> bool {
        self.motion && self.changed.is_empty()
    }

    fn hand_vector(&mut self, vector: &[DVec3]) {
        if !std::mem::replace(&mut self.vector, true) {
            self.lock().set_vector(vector);
        }
    }

    fn lock(&self) -> MutexGuard<'_, dyn BodyShares + 'static> {
        lock(&self.shares)
    }
}

/// Shares that nobody else uses now.
pub(crate) fn lock(shares: &Mutex<dyn BodyShares>) -> MutexGuard<'_, dyn BodyShares + 'static> {
    shares.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What steps change of a body. The newest of it is here or with the shares, if the body has any. Who reads it here
/// brings it. Before shares take a step, decay or estimate, they get what was changed here ([`Body::shares`]).
#[derive(Debug)]
pub(crate) struct Whole {
    elastic: Newest<Elastic>,
    motion: Newest<Motion>,
    /// Vector of the last estimate of the largest eigenvalue, where the next one starts.
    eigenvector: Newest<Vec<DVec3>>,
    shared: Option<SharedBody>,
}

/// A clone has no shares, so that theirs are never two: its nodes are all here.
impl Clone for Whole {
    fn clone(&self) -> Self {
        let (elastic, motion) = (self.elastic().clone(), self.motion().clone());
        Self::new(elastic, motion, self.eigenvector().to_vec())
    }
}

impl Whole {
    pub(crate) fn new(elastic: Elastic, motion: Motion, eigenvector: Vec<DVec3>) -> Self {
        Self {
            elastic: Newest::new(elastic),
            motion: Newest::new(motion),
            eigenvector: Newest::new(eigenvector),
            shared: None,
        }
    }

    pub(crate) fn is_shared(&self) -> bool {
        self.shared.is_some()
    }

    fn ask_shares<R>(&self, ask: impl FnOnce(&mut dyn BodyShares) -> R) -> Option<R> {
        self.shared.as_ref().map(|shared| ask(&mut *shared.lock()))
    }

    pub(crate) fn motion(&self) -> &Motion {
        self.motion.get(|motion| {
            self.ask_shares(|shares| motion.fetch(shares));
        })
    }

    /// Evaluated where the nodes are.
    pub(crate) fn elastic(&self) -> &Elastic {
        self.elastic
            .get(|elastic| evaluate(elastic, self.motion().positions()))
    }

    pub(crate) fn eigenvector(&self) -> &[DVec3] {
        let newest = || self.ask_shares(|shares| shares.vector());
        self.eigenvector
            .get(|vector| *vector = newest().unwrap_or_default())
    }

    /// Reads what the motion knows here as well as there: all but vectors of nodes that are not monitored.
    pub(crate) fn of_motion<R>(&self, read: impl FnOnce(&Motion) -> R) -> R {
        self.motion.peek(read)
    }

    /// Reads what no step changes of the model.
    pub(crate) fn of_model<R>(&self, read: impl FnOnce(&Elastic) -> R) -> R {
        self.elastic.peek(read)
    }

    /// The motion, to be changed.
    pub(crate) fn motion_mut(&mut self) -> &mut Motion {
        self.motion();
        if let Some(shared) = &mut self.shared {
            shared.motion = false;
        }
        self.motion.as_it_is()
    }

    /// Both, to be changed in all.
    pub(crate) fn rebuild(&mut self) -> (&mut Elastic, &mut Motion) {
        self.elastic();
        self.motion_mut();
        if let Some(shared) = &mut self.shared {
            shared.model = false;
            shared.changed.clear();
        }
        self.as_it_is()
    }

    /// Both, to be changed by a cut in the rows of some nodes.
    pub(crate) fn cut(&mut self, touched: &[u32]) -> (&mut Elastic, &mut Motion) {
        self.elastic();
        self.motion();
        if let Some(shared) = &mut self.shared {
            shared.changed.extend_from_slice(touched);
        }
        self.as_it_is()
    }

    /// Both as they are here, for what shares have no part in or do as well: energies, pieces, damping by mass, viscosity,
    /// decay, products within a part.
    pub(crate) fn as_it_is(&mut self) -> (&mut Elastic, &mut Motion) {
        (self.elastic.as_it_is(), self.motion.as_it_is())
    }

    /// Both, for a step that shares take if there are any: the newest is then there.
    pub(crate) fn begin_step(&mut self) -> (&mut Elastic, &mut Motion) {
        if self.is_shared() {
            self.elastic.leave_behind();
            self.motion.leave_behind();
        }
        self.as_it_is()
    }

    /// Evaluates the forces again; the energy's jump (J) is recorded.
    pub(crate) fn refresh(&mut self) -> Result<f64, StepError> {
        self.motion_mut();
        let (elastic, motion) = (self.elastic.take_up(), self.motion.as_it_is());
        motion.refresh(|x, f| elastic.forces_into(x, f))
    }

    /// What a product with the whole stiffness takes, and the vector of estimates to be changed.
    pub(crate) fn products(&mut self) -> (&mut Elastic, &Motion, &mut Vec<DVec3>) {
        self.elastic();
        self.eigenvector_mut();
        let motion = self.motion.as_it_is();
        (self.elastic.as_it_is(), motion, self.eigenvector.as_it_is())
    }

    pub(crate) fn eigenvector_mut(&mut self) -> &mut Vec<DVec3> {
        self.eigenvector();
        if let Some(shared) = &mut self.shared {
            shared.vector = false;
        }
        self.eigenvector.as_it_is()
    }

    /// What surrounds stiff nodes, evaluated, see [`Elastic::part_around`].
    pub(crate) fn part_around(&mut self, stiffest: &[StiffNode]) -> (Part, Vec<DVec3>) {
        let elastic = self.elastic.as_it_is();
        let (part, vector) = elastic.part_around(stiffest);
        if let Some(shared) = &self.shared
            && !self.elastic.is_here()
        {
            let (gradients, positions) = shared.lock().read(part.rows(), part.ends());
            let elastic = self.elastic.as_it_is();
            elastic.set_part_state(&part, &gradients, &positions);
        }
        (part, vector)
    }

    /// Takes a state that was kept.
    pub(crate) fn restore(
        &mut self,
        elastic: &phyxel_elastic::State,
        motion: State,
        vector: Vec<DVec3>,
    ) {
        let model = self.elastic.take_up();
        model.set_state(elastic);
        evaluate(model, &motion.positions);
        self.motion.take_up().restore(motion);
        *self.eigenvector.take_up() = vector;
        self.eigenvector_mut();
        self.rebuild();
    }

    /// Has shares keep their part of the state themselves, if they have it; whether they do.
    pub(crate) fn keep(&mut self) -> bool {
        let Some(shared) = self.shared.as_mut().filter(|shared| shared.is_handed()) else {
            return false;
        };
        shared.hand_vector(self.eigenvector.as_it_is());
        shared.lock().keep(self.motion.as_it_is().velocities());
        true
    }

    /// Brings what shares have kept.
    pub(crate) fn fetch_kept(&self, motion: &mut State, vector: &mut Vec<DVec3>) {
        self.ask_shares(|shares| shares.kept(motion, vector));
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
            let mut shares = lock(&shares);
            shares.set_model(&body, &watched)?;
            shares.set_vector(body.whole.eigenvector());
            shares.estimate(&estimate(None))?
        };
        body.take_first_eigenvalue(found, description.damping_ratio)?;
        body.whole.eigenvector.leave_behind();
        body.whole.shared = Some(SharedBody {
            shares,
            // They know nothing yet of loads, and of damping.
            motion: false,
            vector: true,
            model: true,
            changed: Vec::new(),
            watched,
        });
        Ok(body)
    }

    /// The shares, which have all that has changed here.
    pub(crate) fn shares(&mut self) -> Result<Option<Arc<Mutex<dyn BodyShares>>>, BodyProblem> {
        if !self.whole.is_shared() {
            return Ok(None);
        }
        if self
            .whole
            .of_motion(|motion| motion.state().forces.is_empty())
        {
            self.whole.refresh()?;
        }
        let watched = self.watched();
        let is_same = |shared: &SharedBody| {
            shared.model && shared.changed.is_empty() && shared.watched == watched
        };
        if !self.whole.shared.as_ref().is_some_and(is_same) {
            self.whole.motion();
        }
        let Some(mut shared) = self.whole.shared.take() else {
            return Ok(None);
        };
        let handed = self.hand_over(&mut shared, watched);
        let shares = shared.shares.clone();
        self.whole.shared = Some(shared);
        handed.map(|()| Some(shares))
    }

    fn hand_over(&self, shared: &mut SharedBody, watched: Vec<u32>) -> Result<(), BodyProblem> {
        let mut changed = std::mem::take(&mut shared.changed);
        if !shared.model {
            shared.lock().set_model(self, &watched)?;
            shared.motion = false;
            shared.model = true;
        } else if !changed.is_empty() || shared.watched != watched {
            changed.sort_unstable();
            changed.dedup();
            shared.lock().change_model(self, &changed, &watched)?;
        }
        shared.watched = watched;
        if !shared.motion {
            shared.lock().set_state(self.motion())?;
            shared.motion = true;
        }
        Ok(())
    }

    /// Nodes that the motion of the whole has to see in every step, ascending.
    fn watched(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> = self.whole.of_motion(|motion| {
            let supports = motion.supports().entries().iter();
            let driven = supports.filter(|support| support.path.is_some());
            driven.map(|support| support.node).collect()
        });
        let tools = self.contacts.iter().map(|tool| &tool.rigid.contact);
        nodes.extend(tools.flat_map(|contact| contact.surface().members()));
        nodes.extend(self.grip.iter().flat_map(Grip::nodes));
        let bonds = self.whole.of_model(|elastic| elastic.bond_ends().collect());
        nodes.extend::<Vec<u32>>(bonds);
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Estimates the largest eigenvalue of the whole, from the vector of the last time: where the nodes are, once they
    /// move.
    pub(crate) fn whole_eigenvalue(
        &mut self,
        settings: &EigenvalueSettings,
    ) -> Result<Eigenvalue, BodyProblem> {
        if !self
            .whole
            .of_motion(|motion| motion.state().forces.is_empty())
            && let Some(shares) = self.shares()?
        {
            if let Some(shared) = &mut self.whole.shared {
                shared.hand_vector(self.whole.eigenvector.as_it_is());
            }
            self.whole.eigenvector.leave_behind();
            return Ok(lock(&shares).estimate(settings)?);
        }
        let (elastic, motion, vector) = self.whole.products();
        let product = |v: &[DVec3], out: &mut [DVec3]| elastic.tangent_product_into(v, out);
        let supports = motion.supports();
        Ok(largest_eigenvalue(
            &self.masses,
            supports,
            product,
            vector,
            settings,
        )?)
    }

    /// The stiffest nodes where the nodes are, of all or of some runs of them.
    pub(crate) fn stiffest_nodes(&self, count: usize, runs: Option<&[usize]>) -> Vec<StiffNode> {
        let handed = self
            .whole
            .shared
            .as_ref()
            .filter(|shared| shared.is_handed());
        handed.map_or_else(
            || self.elastic().stiffest_nodes(count, runs),
            |shared| shared.lock().stiffest_nodes(count, runs),
        )
    }

    /// Reads of the model where it was evaluated last, here or by the shares.
    fn evaluated<R>(
        &self,
        here: impl FnOnce(&Elastic) -> R,
        there: impl FnOnce(&mut dyn BodyShares) -> R,
    ) -> R {
        let elsewhere = !self.whole.elastic.is_here();
        let found = elsewhere.then(|| self.whole.ask_shares(there)).flatten();
        found.unwrap_or_else(|| here(self.elastic()))
    }

    /// Smallest `det F` at the state last evaluated, of nodes that carry strain energy.
    #[must_use]
    pub fn smallest_volume_ratio(&self) -> f64 {
        let here = Elastic::smallest_volume_ratio;
        self.evaluated(here, |shares| shares.smallest_volume_ratio())
    }

    /// Stiffness indicators of the runs of nodes at the state last evaluated.
    pub(crate) fn stiffness_indicators(&self) -> Vec<f64> {
        let here = |elastic: &Elastic| elastic.stiffness_indicators().collect();
        self.evaluated(here, |shares| shares.stiffness_indicators())
    }

    /// Lets the retained gradients decay, here and in the shares; the first half of the work (J).
    pub(crate) fn decay_by(&mut self, factor: f64) -> Result<f64, BodyProblem> {
        let shares = self.shares()?;
        let (elastic, motion) = self.whole.as_it_is();
        // Where the nodes are with shares, what the model here says of works is of another state.
        let works = elastic.decay(factor, motion.positions()).sums();
        let there = shares.map(|shares| lock(&shares).decay(factor));
        Ok(there.unwrap_or(works[0] + works[1]))
    }

    /// The second halves (J) of the works of the last [`Body::decay_by`].
    pub(crate) fn decay_works(&mut self) -> [f64; 2] {
        let works = self.whole.as_it_is().0.decay_works().sums();
        let there = self.whole.ask_shares(|shares| shares.decay_works());
        there.unwrap_or(works)
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
