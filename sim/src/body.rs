//! One deformable body: from its description to nodes in motion.

use glam::DVec3;
use phyxel_discretize::Solid;
use phyxel_elastic::Elastic;
use phyxel_enrich::CutRule;
use phyxel_integrate::{
    Applied, BoundaryConditions, ClosureLaw, Eigenvalue, Grip, Implicit, Motion, MotionSettings,
    NewtonSettings, StaticLoad, StepView, StiffnessTracker, critical_step, radial_start,
    solve_static,
};
use phyxel_mls::{GradientStencils, Neighborhoods, mean_pair_length};

use crate::cut_state::Cutting;
use crate::error::{BodyProblem, WorldError, in_body};
use crate::model::build;
use crate::phases::{StepTimes, timed};
use crate::scene::{self, Scene};
use crate::shares::{Whole, lock};
use crate::stiffness::estimate;
use crate::tool::{ToolContact, ToolSurface};

/// Unbalanced force, relative, at which an equilibrium is found.
const AT_REST: f64 = 1e-6;
/// Load steps to begin with; those that fail are halved.
const LOAD_STEPS: u32 = 4;

/// A body, its model, its motion, and what touches and cuts it.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name in the scene.
    pub name: String,
    /// What the body occupies at rest (m).
    pub solid: Solid,
    /// Rest positions (m) of the nodes.
    pub rest: Vec<DVec3>,
    /// Mass (kg) and volume (m³) before the first step, which cuts must not change.
    pub mass: f64,
    /// See [`Body::mass`].
    pub volume: f64,
    /// Nodal volumes (m³).
    pub volumes: Vec<f64>,
    /// Nodal masses (kg).
    pub masses: Vec<f64>,
    /// Nodes within a support, ascending: they have no strain.
    pub(crate) inert: Vec<u32>,
    /// Tetrahedra that gave volumes and edges; results are written on them. None where nodes are mere
    /// points.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Deviation of the tetrahedra's volume from the body's, relative, which nodes of meshes make up for; `None` where
    /// a function alone gives the body.
    pub volume_error: Option<f64>,
    /// Fraction of the mesh's vertices that lie where it is too thin for its nodes; 0 for other shapes.
    pub missed: f64,
    /// Mean distance between neighbouring nodes (m).
    pub spacing: f64,
    /// Who is coupled with whom.
    pub neighborhoods: Neighborhoods,
    /// Gradient stencils.
    pub stencils: GradientStencils,
    /// Forces and nodes in motion.
    pub(crate) whole: Whole,
    /// Largest eigenvalue of the uncut body.
    pub eigenvalue: Eigenvalue,
    /// Estimates of the largest eigenvalue, for the step.
    pub(crate) stiffness: StiffnessTracker,
    /// Smallest `det F` of nodes that carry strain energy, over all steps and the rest state.
    pub smallest_ratio: f64,
    /// The first time that its energy balance was off for many steps on end, if it was.
    pub doubt: Option<phyxel_integrate::Warning>,
    /// Checksum of the rest positions.
    pub(crate) fingerprint: u32,
    /// Fraction of the critical step that is taken.
    pub step_factor: f64,
    /// Mass-proportional damping (1/s) once settled.
    pub damping: f64,
    /// Energy (J) that viscosity has lost; what its terms store is elastic energy.
    pub relaxed: f64,
    /// How a cut weakens pairs.
    pub(crate) cut_rule: CutRule,
    /// Energy (J/m²) that tearing takes up per area; `None` if it never tears.
    pub(crate) toughness: Option<f64>,
    /// What tools touch of the uncut body.
    pub(crate) tool_surface: ToolSurface,
    /// What cuts need: present from the first capture of a blade.
    pub cutting: Option<Cutting>,
    /// Tools that may touch it.
    pub(crate) contacts: Vec<ToolContact>,
    /// What contact between bodies adds to the largest eigenvalue (1/s²) at most.
    pub(crate) contact_eigenvalue: f64,
    /// The patch that a hand holds.
    pub(crate) grip: Option<Grip>,
    /// What takes the steps of an implicit scheme, and the step (s).
    implicit: Option<(Box<Implicit>, f64)>,
    /// Time in parts of the last step.
    pub(crate) times: StepTimes,
}

impl Body {
    /// Builds the body that `description` asks for.
    ///
    /// # Errors
    /// [`WorldError`] with the body's name.
    pub fn new(scene: &Scene, description: &scene::Body) -> Result<Self, WorldError> {
        let built = Self::build(scene, description).and_then(|mut body| {
            let found = body.whole_eigenvalue(&estimate(None))?;
            body.take_first_eigenvalue(found, description.damping_ratio)?;
            Ok(body)
        });
        in_body(built, &description.name)
    }

    /// Takes the eigenvalue of the body at rest, without which it has no step.
    pub(crate) fn take_first_eigenvalue(
        &mut self,
        found: Eigenvalue,
        damping_ratio: f64,
    ) -> Result<(), BodyProblem> {
        if !found.critical_step.is_finite() {
            return Err(BodyProblem::NoStiffness);
        }
        self.stiffness = StiffnessTracker::new(found.value);
        self.eigenvalue = found;
        let is_explicit = self.is_explicit();
        let (elastic, motion) = self.whole.as_it_is();
        motion.set_viscosity(2.0 * damping_ratio / found.value.sqrt())?;
        if is_explicit {
            elastic.watch_stiffness(&self.masses);
        }
        Ok(())
    }

    /// All but the eigenvalue.
    pub(crate) fn build(scene: &Scene, description: &scene::Body) -> Result<Self, BodyProblem> {
        let (solid, _) = description.shape.solid(&description.placement())?;
        let (sampled, coupled, mut elastic) = build(scene, &solid, description)?;
        let neighborhoods = coupled.neighborhoods;
        let spacing = mean_pair_length(&sampled.positions, &neighborhoods);
        let tool_surface = ToolSurface::of(scene, &solid, &sampled, spacing)?;
        let rest = sampled.positions;
        let (volumes, masses) = (coupled.volumes, coupled.masses);
        let (mass, volume) = (masses.iter().sum(), volumes.iter().sum());
        let supports = scene.supports_of(description, &rest, None);
        elastic.set_held(&supports.fixed_nodes());
        // Stretching stiffens; the estimate is taken at rest and the step factor leaves the room.
        evaluate(&mut elastic, &rest);
        let scheme = scene.integration.scheme;
        let settings = MotionSettings {
            scheme: scheme.explicit(),
            damping: description.damping,
            ..MotionSettings::default()
        };
        let solver = scheme.implicit().map(Implicit::new).transpose()?;
        let motion = Motion::new(&rest, &masses, supports, settings)?;
        let mut body = Self {
            fingerprint: fingerprint(&rest),
            whole: Whole::new(elastic, motion, radial_start(&rest)),
            name: description.name.clone(),
            solid,
            tetrahedra: sampled.tetrahedra,
            volume_error: sampled.volume_error,
            missed: sampled.missed,
            spacing,
            rest,
            mass,
            volume,
            volumes,
            masses,
            inert: coupled.inert,
            neighborhoods,
            stencils: coupled.stencils,
            stiffness: StiffnessTracker::default(),
            smallest_ratio: 1.0,
            doubt: None,
            eigenvalue: Eigenvalue::default(),
            step_factor: scene.integration.step_factor,
            damping: description.damping,
            relaxed: 0.0,
            cut_rule: description.cut_rule,
            toughness: description.material.toughness,
            tool_surface,
            cutting: None,
            contacts: Vec::new(),
            contact_eigenvalue: 0.0,
            grip: None,
            implicit: solver.map(Box::new).zip(scheme.step()),
            times: StepTimes::default(),
        };
        body.contacts = body.contacts_of(scene, description)?;
        Ok(body)
    }

    /// Its model, evaluated where the nodes are.
    #[must_use]
    pub fn elastic(&self) -> &Elastic {
        self.whole.elastic()
    }

    /// Its nodes in motion.
    #[must_use]
    pub fn motion(&self) -> &Motion {
        self.whole.motion()
    }

    /// Reads what no step changes of its model, wherever its nodes are.
    #[doc(hidden)]
    pub fn of_model<R>(&self, read: impl FnOnce(&Elastic) -> R) -> R {
        self.whole.of_model(read)
    }

    pub(crate) fn time(&self) -> f64 {
        self.whole.of_motion(Motion::time)
    }

    pub(crate) fn steps(&self) -> u64 {
        self.whole.of_motion(Motion::steps)
    }

    /// Positions (m) of the nodes as they are read: on the field whose gradient the deformation gradients are
    /// ([`Elastic::smoothed_positions`]), while [`Motion::positions`] are its coefficients, which contact, loads and
    /// steps use. Directions that supports hold or drive keep their values. Computed at each call.
    #[must_use]
    pub fn smoothed_positions(&self) -> Vec<DVec3> {
        let motion = self.motion();
        let nodes = motion.positions();
        let smoothed = |elastic: &Elastic| elastic.smoothed_positions(nodes);
        let mut smoothed = self.whole.of_model(smoothed);
        motion.supports().keep(nodes, &mut smoothed);
        smoothed
    }

    /// Largest eigenvalue (1/s²) as last estimated, never below the uncut body's at rest.
    #[must_use]
    pub fn current_eigenvalue(&self) -> f64 {
        self.stiffness.eigenvalue().max(self.eigenvalue.value)
    }

    /// Largest stable step (s) of the uncut body at rest, damping included.
    #[must_use]
    pub fn critical_step(&self) -> f64 {
        self.stable_step(self.eigenvalue.value)
    }

    fn stable_step(&self, eigenvalue: f64) -> f64 {
        let viscosity = |motion: &Motion| motion.settings().viscosity;
        critical_step(eigenvalue, self.whole.of_motion(viscosity))
    }

    /// Step (s) for the eigenvalue as last estimated: the step factor times the critical step; that of
    /// an implicit scheme as it is.
    #[must_use]
    pub fn step_size(&self) -> f64 {
        if let Some((_, step)) = self.implicit {
            return step;
        }
        self.step_factor * self.current_critical_step()
    }

    fn current_critical_step(&self) -> f64 {
        self.stable_step(self.current_eigenvalue() + self.contact_eigenvalue)
    }

    /// Takes one step (s), where the shares of the body are if it has any, with the tools that may touch it and what else
    /// acts on it.
    pub(crate) fn step(
        &mut self,
        step: f64,
        mut others: Option<&mut Applied<'_>>,
    ) -> Result<(), BodyProblem> {
        let decay = self.decay(step)?;
        let critical = self.is_explicit().then(|| self.current_critical_step());
        let shares = self.shares()?;
        let (elastic, motion) = self.whole.begin_step();
        if let Some(critical) = critical {
            motion.set_critical_step(critical);
        }
        let (contacts, grip, times) = (&mut self.contacts, &mut self.grip, &mut self.times);
        let is_free = contacts.is_empty() && grip.is_none() && others.is_none();
        let forces =
            |x: &[DVec3], f: &mut [DVec3]| timed(&mut times.forces, || elastic.forces_into(x, f));
        let press = &mut |view: &StepView<'_>, forces: &mut [DVec3]| {
            timed(&mut times.tools, || {
                for contact in contacts.iter_mut() {
                    contact.rigid.press(view, forces);
                }
            });
            if let Some(grip) = grip {
                grip.pull(view, forces);
            }
            if let Some(others) = &mut others {
                others(view, forces);
            }
        };
        if let Some((solver, _)) = &mut self.implicit {
            let timer = &mut (elastic, &mut times.forces);
            let law = &mut ClosureLaw::of(
                timer,
                |(elastic, spent), x, f| timed(spent, || elastic.forces_into(x, f)),
                |(elastic, spent), v, out| timed(spent, || elastic.tangent_product_into(v, out)),
            );
            let tools = contacts.iter_mut().map(|contact| &mut contact.rigid);
            solver.step_with(motion, step, law, &mut tools.collect::<Vec<_>>())?;
        } else if let Some(shares) = shares {
            let shares = &mut *lock(&shares);
            motion.step_shared(step, shares, if is_free { None } else { Some(press) })?;
        } else if is_free {
            motion.step(step, forces)?;
        } else {
            motion.step_with(step, forces, press)?;
        }
        self.smallest_ratio = self.smallest_ratio.min(self.smallest_volume_ratio());
        let (elastic, motion) = self.whole.as_it_is();
        self.doubt = self.doubt.or_else(|| motion.take_warning());
        timed(&mut self.times.forces, || {
            elastic.end_viscous_step();
            elastic.begin_viscous_step(0.0);
        });
        if let Some(half) = decay {
            self.book_decay(half);
        }
        Ok(())
    }

    /// Takes supports that hold for the rest of the scene.
    pub(crate) fn set_supports(&mut self, supports: BoundaryConditions) {
        let (elastic, motion) = self.whole.rebuild();
        elastic.set_held(&supports.fixed_nodes());
        motion.set_supports(supports);
    }

    /// Adds a velocity (m/s) to that of all its nodes.
    pub(crate) fn begin_with(&mut self, velocity: DVec3) -> Result<(), BodyProblem> {
        let motion = self.whole.motion_mut();
        let velocities = motion.velocities().iter().map(|v| *v + velocity);
        let velocities: Vec<DVec3> = velocities.collect();
        motion.set_velocities(&velocities)?;
        self.whole.refresh()?;
        Ok(())
    }

    /// Moves the nodes to where they are in equilibrium with constant `loads` (N), viscosity at rest.
    pub(crate) fn come_to_rest(&mut self, loads: &[DVec3]) -> Result<(), BodyProblem> {
        let (elastic, motion) = self.whole.rebuild();
        elastic.begin_viscous_step(f64::INFINITY);
        let mut positions = self.rest.clone();
        let load = StaticLoad {
            forces: loads,
            steps: LOAD_STEPS,
            ..StaticLoad::default()
        };
        let law = &mut ClosureLaw::of(
            &mut *elastic,
            Elastic::forces_into,
            Elastic::tangent_product_into,
        );
        let settings = NewtonSettings::with_tolerance(AT_REST);
        let supports = motion.supports();
        let found = solve_static(law, &mut positions, supports, &load, &settings);
        if found.is_err() {
            elastic.begin_viscous_step(0.0);
        }
        found?;
        evaluate(elastic, &positions);
        elastic.end_viscous_step();
        elastic.begin_viscous_step(0.0);
        motion.set_positions(&positions)?;
        Ok(())
    }

    /// What round-off leaves of its elastic energy (J), see [`Elastic::energy_round_off`].
    pub(crate) fn energy_round_off(&self) -> f64 {
        let positions = self.motion().positions();
        self.whole
            .of_model(|elastic| elastic.energy_round_off(positions))
    }

    /// Whether the stable step is to be monitored.
    pub(crate) fn is_explicit(&self) -> bool {
        self.implicit.is_none()
    }
}

/// Brings a model to positions (m).
pub(crate) fn evaluate(elastic: &mut Elastic, positions: &[DVec3]) {
    elastic.forces_into(positions, &mut vec![DVec3::ZERO; positions.len()]);
}

/// Checksum of rest positions.
fn fingerprint(rest: &[DVec3]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    for coordinate in rest.iter().flat_map(DVec3::to_array) {
        hasher.update(&coordinate.to_le_bytes());
    }
    hasher.finalize()
}
