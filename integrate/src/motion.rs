//! Nodes in explicit motion: state, settings, and what may be asked of them.

use crate::audit::{Audit, Warning};
use crate::error::MotionError;
use crate::nodes::NodeConstants;
use crate::pieces::NamedPieces;
use crate::supports::{BoundaryConditions, NodeSupport};
use glam::DVec3;

/// Explicit scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum ExplicitScheme {
    /// Half kick, drift, half kick (Störmer 1907; Verlet 1967; the central difference method):
    /// second order, symplectic, reversible, one force evaluation a step.
    #[default]
    VelocityVerlet,
    /// Kick, drift: symplectic, first order, same limit and cost.
    SymplecticEuler,
}

/// How to move.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotionSettings {
    /// Scheme.
    pub scheme: ExplicitScheme,
    /// Mass-proportional damping (1/s): velocities decay as `exp(−damping · t)`, applied exactly; in
    /// free pieces ([`Motion::set_pieces`]) relative to their rigid motion.
    pub damping: f64,
    /// Stiffness-proportional (viscous) damping (s): forces `viscosity · df/dt`, from the forces of
    /// two steps; lowers the critical step, see [`crate::critical_step`].
    pub viscosity: f64,
    /// Acceleration of all nodes (m/s²).
    pub gravity: DVec3,
}

impl Default for MotionSettings {
    /// Velocity Verlet without damping, viscosity and gravity.
    fn default() -> Self {
        Self {
            scheme: ExplicitScheme::VelocityVerlet,
            damping: 0.0,
            viscosity: 0.0,
            gravity: DVec3::ZERO,
        }
    }
}

/// All that changes in time. Restoring a clone (or what serde made of it) continues bitwise identical.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// Time (s).
    pub time: f64,
    /// Steps taken.
    pub steps: u64,
    /// Positions (m).
    pub positions: Vec<DVec3>,
    /// Velocities (m/s).
    pub velocities: Vec<DVec3>,
    /// Internal forces (N) at the positions; empty before the first evaluation.
    pub forces: Vec<DVec3>,
    /// Forces (N) applied by the caller in the last step; empty if none.
    pub applied: Vec<DVec3>,
    /// Viscous forces (N) of the last step; empty without viscosity.
    pub viscous: Vec<DVec3>,
    /// Energies after the last step.
    pub audit: Audit,
    /// What of [`Audit::staggered`] (J) the last step and the forces last evaluated make: `Δt²/8 Σ f²/m` under velocity
    /// Verlet, `−Δt/2 Σ f·v` under symplectic Euler.
    pub lag: f64,
    /// Size (s) of the last step; 0 before the first.
    pub step: f64,
    /// Energy (J) that is subtracted from the loads' potential, so that their work starts at 0.
    pub load_origin: f64,
    /// Steps in a row after which the balance was off.
    pub suspicion: u32,
}

impl State {
    /// Whether forces that the caller applies acted in the last step, as where a tool touches.
    #[must_use]
    pub fn is_pressed(&self) -> bool {
        self.applied.iter().any(|force| *force != DVec3::ZERO)
    }
}

/// Heap bytes of a [`Motion`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct MotionBytes {
    /// Masses, positions, velocities, forces: what every motion needs.
    pub state: usize,
    /// Fixed nodes and their paths; 0 without any.
    pub supports: usize,
    /// Constant forces on nodes; 0 without any.
    pub loads: usize,
    /// Viscous forces; 0 without viscosity.
    pub viscous: usize,
    /// Forces applied step by step; 0 without any.
    pub applied: usize,
}

/// What a driven node was before the step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DrivenNode {
    pub(crate) support: NodeSupport,
    pub(crate) position: DVec3,
    pub(crate) velocity: DVec3,
    pub(crate) force: DVec3,
    pub(crate) applied: DVec3,
    pub(crate) viscous: DVec3,
}

/// Nodes with masses and supports, moved explicitly.
///
/// # Examples
/// ```
/// use phyxel_integrate::glam::DVec3;
/// use phyxel_integrate::{BoundaryConditions, Motion, MotionSettings};
///
/// // Two masses of 1 kg on a spring of 50 N/m, 1 m long at rest; the first is fixed, gravity pulls the other.
/// let mut supports = BoundaryConditions::free(2);
/// supports.fix(0);
/// let settings = MotionSettings { gravity: DVec3::Z * -9.81, ..MotionSettings::default() };
/// let start = [DVec3::ZERO, DVec3::NEG_Z];
/// let mut motion = Motion::new(&start, &[1.0; 2], supports, settings)?;
/// motion.advance_to(1.0, 1e-3, |x, forces| {
///     let stretch = (x[1] - x[0]).length() - 1.0;
///     forces[1] = (x[0] - x[1]).normalize() * (50.0 * stretch);
///     forces[0] = -forces[1];
///     25.0 * stretch * stretch // J
/// })?;
/// let z = -1.0 - 9.81 / 50.0 * (1.0 - 50.0_f64.sqrt().cos());
/// assert!((motion.positions()[1].z - z).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Numerics
/// One force evaluation a step. Node loops run in chunks of fixed size, whose partial sums are added in
/// order, so any number of threads gives bitwise identical results; they run in parallel from 4,096 nodes.
#[derive(Debug, Clone)]
pub struct Motion {
    pub(crate) settings: MotionSettings,
    pub(crate) nodes: NodeConstants,
    pub(crate) critical_step: Option<f64>,
    pub(crate) warning: Option<Warning>,
    pub(crate) state: State,
    pub(crate) next_forces: Vec<DVec3>,
    pub(crate) next_applied: Vec<DVec3>,
    pub(crate) next_viscous: Vec<DVec3>,
    pub(crate) driven: Vec<DrivenNode>,
    pub(crate) size: f64,
    pub(crate) pieces: NamedPieces,
}

impl Motion {
    /// Nodes at rest at `positions` (m), time 0.
    ///
    /// # Errors
    /// [`MotionError`] if `positions` (m), `masses` (kg) and `supports` are not for the same number of nodes, a mass
    /// is not positive, a position not finite, or a setting negative.
    pub fn new(
        positions: &[DVec3],
        masses: &[f64],
        supports: BoundaryConditions,
        settings: MotionSettings,
    ) -> Result<Self, MotionError> {
        let n = positions.len();
        let lists = [
            ("masses", masses.len()),
            ("supports", supports.node_count()),
        ];
        for (quantity, count) in lists {
            if count != n {
                return Err(MotionError::Lengths {
                    quantity,
                    count,
                    nodes: n,
                });
            }
        }
        for (node, &mass) in masses.iter().enumerate() {
            if !(mass.is_finite() && mass > 0.0) {
                return Err(MotionError::BadMass { node, mass });
            }
        }
        finite(positions, "position")?;
        not_negative("damping", settings.damping)?;
        not_negative("viscosity", settings.viscosity)?;
        not_negative("gravity", settings.gravity.length())?;
        let low = positions.iter().copied().reduce(DVec3::min);
        let high = positions.iter().copied().reduce(DVec3::max);
        let size = low
            .zip(high)
            .map_or(0.0, |(low, high)| (high - low).length());
        let mut motion = Self {
            settings,
            nodes: NodeConstants::new(masses, supports),
            critical_step: None,
            warning: None,
            state: State {
                positions: positions.to_vec(),
                velocities: vec![DVec3::ZERO; n],
                ..State::default()
            },
            next_forces: vec![DVec3::ZERO; n],
            next_applied: Vec::new(),
            next_viscous: Vec::new(),
            driven: Vec::new(),
            size,
            pieces: NamedPieces::default(),
        };
        motion.restart_audit();
        Ok(motion)
    }

    /// Heap bytes held, by what needs them.
    #[must_use]
    pub fn bytes(&self) -> MotionBytes {
        let vectors = |list: &[&Vec<DVec3>]| list.iter().map(|v| size_of_val(&***v)).sum();
        let s = &self.state;
        let [inverse, partly] = self.nodes.mobility.bytes();
        MotionBytes {
            state: vectors(&[&s.positions, &s.velocities, &s.forces, &self.next_forces])
                + size_of_val(&*self.nodes.masses)
                + inverse,
            supports: if self.nodes.supports.entries().is_empty() {
                0
            } else {
                self.nodes.supports.bytes() + partly
            },
            loads: vectors(&[&self.nodes.loads]),
            viscous: vectors(&[&s.viscous, &self.next_viscous]),
            applied: vectors(&[&s.applied, &self.next_applied]),
        }
    }

    /// Number of nodes.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.nodes.masses.len()
    }

    /// Positions (m).
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.state.positions
    }

    /// Velocities (m/s).
    #[must_use]
    pub fn velocities(&self) -> &[DVec3] {
        &self.state.velocities
    }

    /// Masses (kg).
    #[must_use]
    pub fn masses(&self) -> &[f64] {
        &self.nodes.masses
    }

    /// Supports.
    #[must_use]
    pub fn supports(&self) -> &BoundaryConditions {
        &self.nodes.supports
    }

    /// Time (s).
    #[must_use]
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// Steps taken.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.state.steps
    }

    /// Energies and momentum after the last step.
    #[must_use]
    pub fn audit(&self) -> &Audit {
        &self.state.audit
    }

    /// Takes the first warning since the last call, if the balance went off.
    pub fn take_warning(&mut self) -> Option<Warning> {
        self.warning.take()
    }

    /// Settings.
    #[must_use]
    pub fn settings(&self) -> &MotionSettings {
        &self.settings
    }

    /// Changes the mass-proportional damping (1/s) from the next step on, as for settling under
    /// gravity.
    ///
    /// # Errors
    /// [`MotionError::BadSetting`] if it is negative or not finite.
    pub fn set_damping(&mut self, damping: f64) -> Result<(), MotionError> {
        not_negative("damping", damping)?;
        self.settings.damping = damping;
        Ok(())
    }

    /// Changes the stiffness-proportional damping (s), before the first step.
    ///
    /// # Errors
    /// [`MotionError::BadSetting`] if it is negative or not finite.
    pub fn set_viscosity(&mut self, viscosity: f64) -> Result<(), MotionError> {
        not_negative("viscosity", viscosity)?;
        self.settings.viscosity = viscosity;
        Ok(())
    }

    /// States the critical step (s), so that an error can tell whether the step was above it.
    pub fn set_critical_step(&mut self, step: f64) {
        self.critical_step = Some(step);
    }

    /// Sets velocities (m/s); their fixed parts are dropped. The audit starts again.
    ///
    /// # Errors
    /// [`MotionError::NotFinite`].
    ///
    /// # Panics
    /// If there is not one velocity per node.
    pub fn set_velocities(&mut self, velocities: &[DVec3]) -> Result<(), MotionError> {
        assert_eq!(velocities.len(), self.node_count(), "one velocity per node");
        finite(velocities, "velocity")?;
        self.state.velocities.copy_from_slice(velocities);
        self.nodes.supports.project(&mut self.state.velocities);
        self.restart_audit();
        Ok(())
    }

    /// Sets positions (m), as after a static solution; forces are evaluated again and the audit starts
    /// again. Velocities stay.
    ///
    /// # Errors
    /// [`MotionError::NotFinite`].
    ///
    /// # Panics
    /// If there is not one position per node.
    pub fn set_positions(&mut self, positions: &[DVec3]) -> Result<(), MotionError> {
        assert_eq!(positions.len(), self.node_count(), "one position per node");
        finite(positions, "position")?;
        self.state.positions.copy_from_slice(positions);
        self.state.forces.clear();
        self.restart_audit();
        Ok(())
    }

    /// Sets constant forces on nodes (N), or none with an empty slice. Their work so far is kept.
    ///
    /// # Errors
    /// [`MotionError::NotFinite`].
    ///
    /// # Panics
    /// If `loads` is neither empty nor one per node.
    pub fn set_loads(&mut self, loads: &[DVec3]) -> Result<(), MotionError> {
        let n = self.node_count();
        assert!(
            loads.is_empty() || loads.len() == n,
            "one load per node, or none"
        );
        finite(loads, "load")?;
        let before = self.load_potential();
        self.nodes.loads.clear();
        self.nodes.loads.extend_from_slice(loads);
        self.state.load_origin += self.load_potential() - before;
        self.find_lag();
        Ok(())
    }

    /// Replaces the supports, as when a clamp opens. Velocities lose their fixed parts; what that takes
    /// is counted.
    ///
    /// # Panics
    /// If `supports` is for another number of nodes.
    pub fn set_supports(&mut self, supports: BoundaryConditions) {
        assert_eq!(
            supports.node_count(),
            self.node_count(),
            "supports for every node"
        );
        self.nodes.set_supports(supports);
        self.find_free_pieces();
        let before = self.state.audit.kinetic;
        self.nodes.supports.project(&mut self.state.velocities);
        self.state.audit.kinetic = self.kinetic_energy();
        self.correct_energy(self.state.audit.kinetic - before);
    }

    /// Books an energy (J) that came from outside the equations of motion, positive if added.
    pub fn correct_energy(&mut self, energy: f64) {
        self.state.audit.energy_correction += energy;
    }

    /// The whole state, to be kept.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Goes back to a snapshot.
    ///
    /// # Panics
    /// If the state is for another number of nodes.
    pub fn restore(&mut self, state: State) {
        let n = self.node_count();
        let fits = state.positions.len() == n && state.velocities.len() == n;
        let whole = |v: &Vec<DVec3>| v.is_empty() || v.len() == n;
        let fits = fits && whole(&state.forces) && whole(&state.applied) && whole(&state.viscous);
        assert!(fits, "a state of {n} nodes");
        self.state = state;
        self.warning = None;
    }

    /// Whether a state is one of this motion: as many nodes, and every number finite. One that comes from
    /// a file may not be.
    #[must_use]
    pub fn fits(&self, state: &State) -> bool {
        let n = self.node_count();
        let audit = &state.audit;
        let energies = [
            audit.kinetic,
            audit.elastic,
            audit.load_work,
            audit.applied_work,
            audit.support_work,
            audit.dissipated,
            audit.energy_correction,
            audit.numerical,
            audit.initial,
        ];
        let whole = [&state.positions, &state.velocities];
        let maybe = [&state.forces, &state.applied, &state.viscous];
        whole.iter().all(|list| list.len() == n)
            && maybe.iter().all(|list| list.is_empty() || list.len() == n)
            && whole
                .iter()
                .chain(&maybe)
                .all(|list| list.iter().all(|x| x.is_finite()))
            && energies.iter().all(|energy| energy.is_finite())
            && audit.momentum.is_finite()
            && state.time.is_finite()
            && state.load_origin.is_finite()
    }

    /// Forces of the supports on the body (N), with the index of their node: what holds the node
    /// where it is, or drives it along its path, against all other forces on it; a driven node's own
    /// inertia is left out. As of the last evaluation of the forces.
    #[must_use]
    pub fn reactions(&self) -> Vec<(u32, DVec3)> {
        let entries = self.nodes.supports.entries().iter();
        entries
            .map(|support| {
                let node = support.node as usize;
                let force = if self.state.forces.is_empty() {
                    DVec3::ZERO
                } else {
                    self.total_force(node)
                };
                (support.node, -support.held(force))
            })
            .collect()
    }

    /// Angular momentum about the origin (kg m²/s).
    #[must_use]
    pub fn angular_momentum(&self) -> DVec3 {
        let nodes = self.nodes.masses.iter().zip(&self.state.positions);
        nodes
            .zip(&self.state.velocities)
            .map(|((m, x), v)| x.cross(*v) * *m)
            .sum()
    }

    pub(crate) fn kinetic_energy(&self) -> f64 {
        let nodes = self.nodes.masses.iter().zip(&self.state.velocities);
        nodes.map(|(m, v)| 0.5 * m * v.length_squared()).sum()
    }

    /// Potential (J) of gravity and constant loads.
    pub(crate) fn load_potential(&self) -> f64 {
        let x = &self.state.positions;
        let gravity = self.settings.gravity;
        let weight: f64 = if gravity == DVec3::ZERO {
            0.0
        } else {
            self.nodes
                .masses
                .iter()
                .zip(x)
                .map(|(m, x)| m * x.dot(gravity))
                .sum()
        };
        let loads: f64 = self.nodes.loads.iter().zip(x).map(|(f, x)| f.dot(*x)).sum();
        -(weight + loads)
    }

    fn restart_audit(&mut self) {
        let kinetic = self.kinetic_energy();
        let nodes = self.nodes.masses.iter().zip(&self.state.velocities);
        self.state.audit = Audit {
            kinetic,
            initial: kinetic,
            momentum: nodes.map(|(m, v)| *v * *m).sum(),
            ..Audit::default()
        };
        self.state.load_origin = self.load_potential();
        self.state.step = 0.0;
        self.state.forces.clear();
        self.state.applied.clear();
        self.state.viscous.clear();
    }

    /// All forces (N) but those of supports, at the last evaluation.
    pub(crate) fn total_force(&self, node: usize) -> DVec3 {
        let mut force = self.state.forces[node] + self.settings.gravity * self.nodes.masses[node];
        for more in [&self.nodes.loads, &self.state.applied, &self.state.viscous] {
            if let Some(f) = more.get(node) {
                force += *f;
            }
        }
        force
    }
}

fn not_negative(name: &'static str, value: f64) -> Result<(), MotionError> {
    match value.is_finite() && value >= 0.0 {
        true => Ok(()),
        false => Err(MotionError::BadSetting { name, value }),
    }
}

fn finite(vectors: &[DVec3], quantity: &'static str) -> Result<(), MotionError> {
    match vectors.iter().position(|v| !v.is_finite()) {
        Some(node) => Err(MotionError::NotFinite { node, quantity }),
        None => Ok(()),
    }
}
