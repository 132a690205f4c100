#![allow(
    clippy::needless_range_loop,
    reason = "nodes are walked in step over several arrays"
)]

use glam::DVec3;
use testkit::cloud::uniform;

use crate::{BoundaryConditions, Cause, ExplicitScheme, Motion, MotionSettings, StepError};

/// Blocks of full size and a remainder.
const N: usize = 300;
const STEP: f64 = 0.03;

fn law(x: &[DVec3], f: &mut [DVec3]) -> f64 {
    let mut energy = 0.0;
    for (f, x) in f.iter_mut().zip(x) {
        *f = *x * -4.0;
        energy += 2.0 * x.length_squared();
    }
    energy
}

fn push(time: f64, node: usize) -> DVec3 {
    let phase = if node.is_multiple_of(3) { 1.0 } else { -0.5 };
    DVec3::new(time.sin(), phase, 0.2 * time)
}

/// What a motion is made of, moved node by node as the formulas say.
struct Twin {
    settings: MotionSettings,
    supports: BoundaryConditions,
    masses: Vec<f64>,
    loads: Vec<DVec3>,
    x: Vec<DVec3>,
    v: Vec<DVec3>,
    /// Internal, applied and viscous forces.
    f: [Vec<DVec3>; 3],
    time: f64,
    dissipated: f64,
    applied_work: f64,
    load_work: f64,
}

impl Twin {
    fn acceleration(&self, i: usize) -> DVec3 {
        let sum = self.f[0][i] + self.f[1][i] + self.f[2][i] + self.loads[i];
        self.free(i, sum / self.masses[i] + self.settings.gravity)
    }

    fn free(&self, i: usize, a: DVec3) -> DVec3 {
        self.supports.of(i).map_or(a, |support| support.free * a)
    }

    fn decay(&mut self, decay: f64) {
        for (v, m) in self.v.iter_mut().zip(&self.masses) {
            self.dissipated += 0.5 * m * v.length_squared() * (1.0 - decay * decay);
            *v *= decay;
        }
    }

    fn kick(&mut self, time: f64) {
        for i in 0..N {
            let a = self.acceleration(i);
            self.v[i] += a * time;
        }
    }

    fn step(&mut self) {
        let euler = self.settings.scheme == ExplicitScheme::SymplecticEuler;
        let share = if euler { 1.0 } else { 0.5 };
        let decay = (-share * self.settings.damping * STEP).exp();
        self.decay(decay);
        self.kick(share * STEP);
        for i in 0..N {
            self.x[i] += self.v[i] * STEP;
            let weight = self.settings.gravity * self.masses[i] + self.loads[i];
            self.load_work += weight.dot(self.v[i]) * STEP;
        }
        self.time += STEP;
        let before = self.f.clone();
        law(&self.x, &mut self.f[0]);
        for i in 0..N {
            let factor = self.settings.viscosity / STEP;
            self.f[1][i] = push(self.time, i);
            self.f[2][i] = (self.f[0][i] - before[0][i]) * factor;
            let moved = self.v[i] * STEP;
            self.applied_work += 0.5 * (self.f[1][i] + before[1][i]).dot(moved);
            self.dissipated -= 0.5 * (self.f[2][i] + before[2][i]).dot(moved);
        }
        if !euler {
            self.kick(0.5 * STEP);
            self.decay(decay);
        }
    }
}

/// Every kind of force, damping and support at once, in blocks and node by node.
#[test]
fn blocks_move_as_nodes_do_one_by_one() {
    for scheme in [
        ExplicitScheme::VelocityVerlet,
        ExplicitScheme::SymplecticEuler,
    ] {
        let settings = MotionSettings {
            scheme,
            damping: 0.3,
            viscosity: 0.02,
            gravity: DVec3::new(0.1, -0.2, -9.0),
        };
        let x = uniform(N, 1.0, 3);
        let masses: Vec<f64> = uniform(N, 0.4, 4).iter().map(|v| 1.0 + v.x).collect();
        let mut supports = BoundaryConditions::fixed(N, &[0, 127, 128, 299]);
        supports.slide(290, DVec3::new(1.0, 2.0, -0.5));
        supports.fix_axes(5, [true, false, true]);
        let loads = uniform(N, 2.0, 5);
        let mut motion = Motion::new(&x, &masses, supports.clone(), settings).unwrap();
        motion.set_loads(&loads).unwrap();
        let mut f = vec![DVec3::ZERO; N];
        law(&x, &mut f);
        let mut twin = Twin {
            settings,
            supports,
            masses,
            loads,
            v: vec![DVec3::ZERO; N],
            f: [f, vec![DVec3::ZERO; N], vec![DVec3::ZERO; N]],
            x,
            time: 0.0,
            dissipated: 0.0,
            applied_work: 0.0,
            load_work: 0.0,
        };
        for _ in 0..20 {
            motion
                .step_with(STEP, law, &mut |view, forces| {
                    for (node, force) in forces.iter_mut().enumerate() {
                        *force += push(view.time, node);
                    }
                })
                .unwrap();
            twin.step();
        }
        let close = |a: f64, b: f64, what: &str| {
            let scale = 1.0 + b.abs();
            assert!((a - b).abs() < 1e-11 * scale, "{scheme:?} {what}: {a} {b}");
        };
        for i in 0..N {
            let off = (motion.positions()[i] - twin.x[i]).length();
            assert!(off < 1e-12, "{scheme:?}: node {i} is {off} m away");
            let off = (motion.velocities()[i] - twin.v[i]).length();
            assert!(off < 1e-11, "{scheme:?}: node {i} is {off} m/s too fast");
        }
        let audit = motion.audit();
        let nodes = || twin.masses.iter().zip(&twin.v);
        let kinetic: f64 = nodes().map(|(m, v)| 0.5 * m * v.length_squared()).sum();
        let momentum: DVec3 = nodes().map(|(m, v)| *v * *m).sum();
        close(audit.kinetic, kinetic, "kinetic energy");
        close(audit.dissipated, twin.dissipated, "dissipated");
        close(audit.applied_work, twin.applied_work, "applied work");
        close(audit.load_work, twin.load_work, "work of loads");
        assert!((audit.momentum - momentum).length() < 1e-10, "{scheme:?}");
    }
}

/// A force that is not finite is refused in its block, also on a fixed node.
#[test]
fn a_force_that_is_not_finite_moves_nothing() {
    for node in [0, 130] {
        let x = uniform(N, 1.0, 3);
        let supports = BoundaryConditions::fixed(N, &[0]);
        let mut motion = Motion::new(&x, &[1.0; N], supports, MotionSettings::default()).unwrap();
        motion.step(STEP, law).unwrap();
        let error = motion.step(STEP, |x, f| {
            let energy = law(x, f);
            f[node].y = f64::INFINITY;
            energy
        });
        let StepError::ForceNotFinite {
            node: at, cause, ..
        } = error.unwrap_err()
        else {
            panic!("node {node} is refused");
        };
        assert_eq!((at, cause), (node, Cause::BrokenForceLaw));
        let all = motion.positions().iter().chain(motion.velocities());
        assert!(all.clone().all(|v| v.is_finite()), "state stays finite");
        let bad = motion.step(0.0, law);
        assert_eq!(bad, Err(StepError::BadStep { step: 0.0 }), "step");
    }
}
