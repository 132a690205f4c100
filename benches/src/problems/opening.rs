//! A box that is drawn out and then cut, by finite elements with doubled nodes on the plane of the cut.

use glam::{DMat3, DVec3};
use phyxel::scene::{Key, pose_at};

use super::block::lattice;
use super::lanes::{Lanes, boxes};
use super::solid::Solid;

/// Edges of the box (m); its middle is the origin.
pub const SIZE: DVec3 = DVec3::new(0.12, 0.04, 0.08);
/// Damping (1/s), an eighth of what is critical for the lowest mode along x (80 rad/s).
pub const DAMPING: f64 = 20.0;
/// Times (s): the blade enters, it has come half the height down, the end.
pub const BEGINS: f64 = 0.7;
pub const ENDS: f64 = 0.75;
pub const REST: f64 = 1.4;
/// Corners (m) of a stiff inclusion: 1 cm below where the blade ends.
pub const STIFF: [DVec3; 2] = [
    DVec3::new(-0.02, -0.01, -0.03),
    DVec3::new(0.02, 0.01, -0.01),
];
/// Its Young's modulus over that of the box.
pub const RATIO: f64 = 100.0;
/// Radius (m) within which the mouth is read.
const RADIUS: f64 = 0.02;
/// The step over the time in which a pressure wave crosses an element at rest: of the box, whose elements stretch and become
/// stiffer, and of the inclusion. Half of the first changes the released energy by less than 0.1 %.
const STEPS: [f64; 2] = [0.25, 0.7];
/// Steps from one state to the next.
const STEPS_PER_STATE: u32 = 4;
/// Fraction of an element that the front passes before a node is let go.
const LEAST: f64 = 0.05;

/// Path along x (m) of the end at `x > 0`, to a stretch of 1.3; the other one moves against it.
pub fn pull() -> [Key; 2] {
    [(0.0, 0.0), (0.3, 0.15)].map(|(time, part)| Key::new(time, DVec3::X * (part * SIZE.x)))
}

/// Path of the blade, a line along y at `x = 0`, along z (m): 0.8 m/s, where Rayleigh waves have 1.8.
pub fn blade() -> [Key; 2] {
    [(BEGINS, 0.5), (ENDS, 0.0)].map(|(time, part)| Key::new(time, DVec3::Z * (part * SIZE.z)))
}

/// A state: time (s), opening of the mouth (m), energy stored (J).
pub type State = [f64; 3];

/// How far (m) a side's flank has moved at the mouth along x, outwards: a field linear in x and z, fitted to the side's nodes
/// within [`RADIUS`] of the mouth with the weights `m (1 − r²/R²)²`. Nodes at `x = 0` are on no side.
pub fn flank(side: f64, rest: &[DVec3], positions: &[DVec3], masses: &[f64]) -> f64 {
    let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for ((rest, x), mass) in rest.iter().zip(positions).zip(masses) {
        let apart = (*rest - DVec3::Z * (0.5 * SIZE.z)) / RADIUS;
        let left = 1.0 - apart.length_squared();
        if left > 0.0 && side * rest.x > 1e-9 {
            let row = DVec3::new(1.0, apart.x, apart.z);
            let weight = mass * left * left;
            matrix += DMat3::from_cols(row * row.x, row * row.y, row * row.z) * weight;
            right += row * (weight * side * (x.x - rest.x));
        }
    }
    (matrix.inverse() * right).x
}

/// Nodes above each other on the plane of the cut.
#[derive(Debug)]
struct Column {
    /// From the bottom up.
    nodes: Vec<usize>,
    /// Place at rest (m, along z) of the lowest point that the blade's edge has come to.
    front: f64,
    /// `μ A/h` (N/m), of the area `A` around a node.
    stiffness: f64,
}

impl Column {
    /// Moves the front to where the edge (m) meets the column, if that is lower.
    fn advance(&mut self, edge: f64, rest: &[DVec3], positions: &[DVec3]) {
        let both = |k: usize| [rest, positions].map(|of| of[self.nodes[k]].z);
        let above = (1..self.nodes.len()).find(|k| both(*k)[1] > edge);
        if let Some(k) = above {
            let [low, high] = [both(k - 1), both(k)];
            let part = (edge - low[1]) / (high[1] - low[1]);
            self.front = self.front.min(low[0] + part * (high[0] - low[0]));
        }
    }

    /// Holds nodes at `x = 0`; returns the energy (J) of the springs.
    ///
    /// A node is held by a spring of the stiffness `μ A/h (1/s − 1)` once the front has passed the fraction `s` of the
    /// element below it. The body opposes about `μ A/h` to a node, so released energy rises evenly with the front.
    /// Without springs it jumps from node to node; a stiffness of 0.7 or 1.8 times this moves the extrapolation by 0.2 %.
    fn hold(&self, rest: &[DVec3], positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let height = rest[self.nodes[1]].z - rest[self.nodes[0]].z;
        let mut energy = 0.0;
        for &node in &self.nodes {
            let passed = (rest[node].z - self.front) / height;
            let (force, x) = (&mut forces[node].x, positions[node].x);
            if passed < LEAST {
                *force = 0.0;
            } else {
                let spring = self.stiffness * (1.0 / passed - 1.0).max(0.0);
                *force -= spring * x;
                energy += 0.5 * spring * x * x;
            }
        }
        energy
    }
}

/// The quarter `x > 0`, `y > 0` of the box, of elements that are boxes of one size.
///
/// The law is that of scenes, `P = μ (F − cof F) + (λ + μ) (J − 1) cof F`, without its barrier below `J = 0.4`.
///
/// The problem is even in x and y. So two doubled nodes that are still one are a node that stays at `x = 0`.
#[derive(Debug)]
pub struct Quarter {
    rest: Vec<DVec3>,
    masses: Vec<f64>,
    /// The box, and its inclusion.
    parts: Vec<Lanes>,
    columns: Vec<Column>,
    step: f64,
}

impl Quarter {
    /// With so many elements over half the height, an even number, with or without the inclusion.
    pub fn new(solid: Solid, per_depth: u32, inclusion: bool) -> Self {
        let cells = [3, 1, 4].map(|part| part * per_depth / 2);
        let size = SIZE * DVec3::new(0.5, 0.5, 1.0);
        let cell = size.z / f64::from(cells[2]);
        let (rest, _) = lattice(cells, |s| size * (s - DVec3::new(0.0, 0.0, 0.5)));
        let elements = boxes(cells);
        let mut masses = vec![0.0; rest.len()];
        for corner in elements.iter().flatten() {
            masses[*corner as usize] += solid.density * cell.powi(3) / 8.0;
        }
        let is_stiff = |element: &[u32; 8]| {
            let middle = rest[element[0] as usize].midpoint(rest[element[7] as usize]);
            inclusion && (middle.cmpgt(STIFF[0]) & middle.cmplt(STIFF[1])).all()
        };
        let (stiff, soft): (Vec<_>, Vec<_>) = elements.into_iter().partition(is_stiff);
        let (mut parts, mut step) = (Vec::new(), f64::INFINITY);
        let both = [(soft, 1.0), (stiff, RATIO)].into_iter().zip(STEPS);
        for ((elements, ratio), part) in both.filter(|((elements, _), _)| !elements.is_empty()) {
            let youngs_modulus = ratio * solid.youngs_modulus;
            let solid = Solid {
                youngs_modulus,
                ..solid
            };
            let (mu, lambda) = solid.lame();
            step = step.min(part * cell * (solid.density / (lambda + 2.0 * mu)).sqrt());
            parts.push(Lanes::boxes(&rest, &elements, solid));
        }
        let [x, y, z] = cells.map(|cells| cells as usize + 1);
        let column = |j: usize| Column {
            nodes: (0..z).map(|k| x * (j + y * k)).collect(),
            front: f64::INFINITY,
            // At both ends half as wide.
            stiffness: solid.lame().0 * cell * [1.0, 0.5][usize::from(j == 0 || j + 1 == y)],
        };
        Self {
            columns: (0..y).map(column).collect(),
            rest,
            masses,
            parts,
            step,
        }
    }

    /// A step (s) of symplectic Euler to a time (s), as scenes damp and drive it.
    fn advance(&self, time: f64, step: f64, forces: &[DVec3], x: &mut [DVec3], v: &mut [DVec3]) {
        let left = (-DAMPING * step).exp();
        let pull = pose_at(&pull(), time).position;
        for (node, rest) in self.rest.iter().enumerate() {
            if rest.x > 0.5 * SIZE.x - 1e-9 {
                x[node] = *rest + pull;
                continue;
            }
            v[node] = (v[node] + forces[node] * (step / self.masses[node])) * left;
            if rest.y < 1e-9 {
                v[node].y = 0.0;
            }
            x[node] += v[node] * step;
        }
    }

    /// States of the whole box to the end. What is stored is the work against elements, by the trapezoidal rule.
    pub fn run(mut self) -> Vec<State> {
        let steps = (REST / self.step).ceil();
        let (step, steps) = (REST / steps, steps as u32);
        let (mut x, mut v) = (self.rest.clone(), vec![DVec3::ZERO; self.rest.len()]);
        let (mut forces, mut acting, mut before) = (v.clone(), v.clone(), x.clone());
        let (mut states, mut stored) = (Vec::new(), 0.0);
        for count in 0..steps {
            let time = step * f64::from(count);
            if (BEGINS..=ENDS + step).contains(&time) {
                let edge = pose_at(&blade(), time).position.z;
                for column in &mut self.columns {
                    column.advance(edge, &self.rest, &x);
                }
            }
            before.copy_from_slice(&x);
            acting.copy_from_slice(&forces);
            let columns = self.columns.iter();
            let held = columns.map(|column| column.hold(&self.rest, &x, &mut acting));
            let held: f64 = held.sum();
            if count.is_multiple_of(STEPS_PER_STATE) {
                let opening = 2.0 * flank(1.0, &self.rest, &x, &self.masses);
                states.push([time, opening, 4.0 * (stored + held)]);
            }
            self.advance(time + step, step, &acting, &mut x, &mut v);
            acting.copy_from_slice(&forces);
            forces.fill(DVec3::ZERO);
            for part in &self.parts {
                part.add_explicit(&x, &mut forces);
            }
            for node in 0..x.len() {
                stored -= 0.5 * (acting[node] + forces[node]).dot(x[node] - before[node]);
            }
        }
        states
    }
}
