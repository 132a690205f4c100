//! Force laws with closed-form answers, for this crate's tests.

use crate::contact::{Contact, ContactSettings, ContactSurface};
use crate::eigenvalue::{Eigenvalue, EigenvalueSettings, largest_eigenvalue};
use crate::law::ForceLaw;
use crate::motion::{Motion, MotionSettings};
use crate::shape::Pose;
use crate::supports::BoundaryConditions;
use glam::{DMat3, DQuat, DVec3};
use testkit::cloud::uniform;

/// Frequency (rad/s) of the [`oscillator`].
pub(crate) const OMEGA: f64 = 3.0;

/// A mass of 1 kg on a spring to the origin.
pub(crate) fn oscillator(x: &[DVec3], f: &mut [DVec3]) -> f64 {
    f[0] = -x[0] * OMEGA * OMEGA;
    0.5 * OMEGA * OMEGA * x[0].length_squared()
}

/// Where it is at 2 s from rest at 1 m: x'' + c x' + w^2 x = 0 with a damping c (1/s).
pub(crate) fn swung(damping: f64) -> f64 {
    let omega = (OMEGA * OMEGA - 0.25 * damping * damping).sqrt();
    let (s, c) = (omega * 2.0).sin_cos();
    (-0.5 * damping * 2.0).exp() * (c + 0.5 * damping / omega * s)
}

/// A mass of 1 kg at rest one metre out along x.
pub(crate) fn one_node(settings: MotionSettings) -> Motion {
    let supports = BoundaryConditions::free(1);
    Motion::new(&[DVec3::X], &[1.0], supports, settings).unwrap()
}

pub(crate) fn damped(damping: f64) -> MotionSettings {
    MotionSettings {
        damping,
        ..MotionSettings::default()
    }
}

pub(crate) fn pulled(gravity: DVec3) -> MotionSettings {
    MotionSettings {
        gravity,
        ..MotionSettings::default()
    }
}

/// No forces at all.
pub(crate) fn nothing(_: &[DVec3], f: &mut [DVec3]) -> f64 {
    f.fill(DVec3::ZERO);
    0.0
}

/// Free nodes with the settings of default.
pub(crate) fn free(x: &[DVec3], masses: &[f64]) -> Motion {
    let supports = BoundaryConditions::free(x.len());
    Motion::new(x, masses, supports, MotionSettings::default()).unwrap()
}

/// Linear springs between each node and the next, at ease where they are.
pub(crate) fn springs(
    rest: &[DVec3],
    stiffness: f64,
) -> impl Fn(&[DVec3], &mut [DVec3]) -> f64 + '_ {
    move |x, f| {
        f.fill(DVec3::ZERO);
        let mut energy = 0.0;
        for i in 1..x.len() {
            let stretch = (x[i] - x[i - 1]) - (rest[i] - rest[i - 1]);
            f[i - 1] += stretch * stiffness;
            f[i] -= stretch * stiffness;
            energy += 0.5 * stiffness * stretch.length_squared();
        }
        energy
    }
}

/// Masses between springs along x, both ends tied to walls: `K` is tridiagonal (2, −1) · k.
pub(crate) struct Chain {
    pub(crate) stiffness: f64,
    pub(crate) masses: Vec<f64>,
    pub(crate) rest: Vec<DVec3>,
}

impl Chain {
    pub(crate) fn new(n: usize, stiffness: f64, mass: f64) -> Self {
        let rest = (0..n)
            .map(|i| DVec3::X * f64::from(u32::try_from(i).expect("a short chain")))
            .collect();
        Self {
            stiffness,
            masses: vec![mass; n],
            rest,
        }
    }

    /// Its nodes at random off their places.
    pub(crate) fn shaken(&self, by: f64, seed: u64) -> Vec<DVec3> {
        let moved = uniform(self.rest.len(), by, seed);
        self.rest.iter().zip(moved).map(|(x, d)| *x + d).collect()
    }

    pub(crate) fn product(&self, v: &[DVec3], out: &mut [DVec3]) {
        for i in 0..v.len() {
            let left = if i > 0 { v[i - 1] } else { DVec3::ZERO };
            let right = v.get(i + 1).copied().unwrap_or(DVec3::ZERO);
            out[i] = (v[i] * 2.0 - left - right) * self.stiffness;
        }
    }

    /// Linear forces `-K u` and the energy `u·K u/2`.
    pub(crate) fn forces(&self, x: &[DVec3], f: &mut [DVec3]) -> f64 {
        let u: Vec<DVec3> = x.iter().zip(&self.rest).map(|(x, r)| *x - *r).collect();
        self.product(&u, f);
        let mut energy = 0.0;
        for (f, u) in f.iter_mut().zip(&u) {
            energy += 0.5 * f.dot(*u);
            *f = -*f;
        }
        energy
    }

    pub(crate) fn eigenvalue(
        &self,
        settings: &EigenvalueSettings,
        warm: &mut Vec<DVec3>,
    ) -> Eigenvalue {
        let supports = BoundaryConditions::free(self.masses.len());
        largest_eigenvalue(
            &self.masses,
            &supports,
            |v, out| self.product(v, out),
            warm,
            settings,
        )
        .expect("valid masses")
    }
}

/// Free nodes tied to each other by springs of the energy `k (r − r0)²/2 (1 + (r − r0)²)`: conserves
/// linear and angular momentum.
pub(crate) struct Network {
    pub(crate) springs: Vec<(usize, usize, f64)>,
    pub(crate) stiffness: f64,
    at: Vec<DVec3>,
}

impl Network {
    pub(crate) fn complete(rest: &[DVec3], stiffness: f64) -> Self {
        let mut springs = Vec::new();
        for i in 0..rest.len() {
            for j in 0..i {
                springs.push((i, j, rest[i].distance(rest[j])));
            }
        }
        Self {
            springs,
            stiffness,
            at: rest.to_vec(),
        }
    }

    pub(crate) fn forces(&self, x: &[DVec3], f: &mut [DVec3]) -> f64 {
        f.fill(DVec3::ZERO);
        let mut energy = 0.0;
        for &(i, j, length) in &self.springs {
            let d = x[j] - x[i];
            let r = d.length();
            let s = r - length;
            energy += 0.5 * self.stiffness * s * s * (1.0 + s * s);
            let pull = d * (self.stiffness * s * (1.0 + 2.0 * s * s) / r);
            f[i] += pull;
            f[j] -= pull;
        }
        energy
    }
}

/// A network that hangs by three nodes, its nodes at ease, and loads on all of them.
pub(crate) fn hung() -> (Network, Vec<DVec3>, BoundaryConditions, Vec<DVec3>) {
    let rest = uniform(20, 1.0, 11);
    let network = Network::complete(&rest, 10.0);
    let supports = BoundaryConditions::fixed(20, &[0, 1, 2]);
    let loads = vec![DVec3::new(0.0, 0.3, -1.5); 20];
    (network, rest, supports, loads)
}

impl Network {
    fn block(&self, i: usize, j: usize, length: f64) -> DMat3 {
        let d = self.at[j] - self.at[i];
        let r = d.length();
        let (n, s) = (d / r, r - length);
        let first = self.stiffness * s * (1.0 + 2.0 * s * s) / r;
        let second = self.stiffness * (1.0 + 6.0 * s * s);
        let outer = DMat3::from_cols(n * n.x, n * n.y, n * n.z);
        outer * (second - first) + DMat3::from_diagonal(DVec3::splat(first))
    }
}

impl ForceLaw for Network {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        self.at.copy_from_slice(positions);
        self.forces(positions, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        product.fill(DVec3::ZERO);
        for &(i, j, length) in &self.springs {
            let pull = self.block(i, j, length) * (vector[j] - vector[i]);
            product[i] -= pull;
            product[j] += pull;
        }
    }

    fn tangent_blocks_into(&mut self, blocks: &mut [DMat3]) -> bool {
        blocks.fill(DMat3::ZERO);
        for &(i, j, length) in &self.springs {
            let block = self.block(i, j, length);
            blocks[i] += block;
            blocks[j] += block;
        }
        true
    }
}

impl ForceLaw for Chain {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        self.forces(positions, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        self.product(vector, product);
    }
}

/// Contact of the [`patch`] with points of a `level`, and its nodes.
pub(crate) fn contact(level: u32, penalty: f64, friction: f64) -> (Contact, Vec<DVec3>) {
    let (x, triangles) = patch();
    let surface = ContactSurface::from_triangles(&triangles, &x, level).unwrap();
    let settings = ContactSettings {
        friction,
        ..ContactSettings::new(penalty)
    };
    (Contact::new(surface, settings), x)
}

/// The half space above z = −0.1, which presses the whole patch by that much, moved along x.
pub(crate) fn plate(shift: f64) -> Pose {
    Pose {
        position: DVec3::new(shift, 0.0, -0.1),
        rotation: DQuat::from_rotation_x(std::f64::consts::PI),
    }
}

/// A square of 3 × 3 nodes in z = 0, 1 apart, as eight triangles.
pub(crate) fn patch() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let x = (0..9_u32)
        .map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3), 0.0))
        .collect();
    let mut triangles = Vec::new();
    for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let a = 3 * j + i;
        triangles.push([a, a + 1, a + 4]);
        triangles.push([a, a + 4, a + 3]);
    }
    (x, triangles)
}
