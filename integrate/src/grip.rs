//! A user's grip of a patch of a body: a spring and a damper at each fixed node.

use glam::DVec3;

use crate::view::StepView;

/// Stiffness of the hold over that of the patch, `2 E r / (1 - ν²)` with ν = 1/2 (a rigid disk on a
/// half-space): the patch comes along by nine tenths of the user's displacement, by less where nodes are
/// few and [`LARGEST_PHASE`] bounds it.
const FIRMNESS: f64 = 10.0;
/// Largest frequency of a fixed node on its spring times the step, and damping of that node, as a fraction of
/// critical. With damping that is taken at the half step a mode needs `(ω dt)² < 4 - 2 c dt`; the
/// stiffest of a body has 2.9 at a step factor of 0.85, the hold adds at most 0.25 and takes 0.5.
const LARGEST_PHASE: f64 = 0.5;
const DAMPING_RATIO: f64 = 0.25;

/// Nodes that a grip holds, each by a spring and a damper to its position in the grip.
///
/// With `w = (1 - d²/r²)²` of a node at the distance `d` of the point that is gripped, the springs have
/// `k_i = κ m_i w_i` in all: all fixed nodes swing alike. `κ Σ m w` is ten times the stiffness of the patch
/// under a rigid disk, `2 E r / (1 - ν²)` with ν = 1/2, and `κ` at most `(0.5 / Δt)²`, so that an explicit
/// step (s) stays stable; dampers have a quarter of critical damping. Work on the body is work of applied forces.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Grip {
    held: Vec<Held>,
    /// Displacement (m) of the grip since it began, at the end of this step, and its velocity (m/s).
    by: DVec3,
    velocity: DVec3,
    /// Force (N) on the hand at the end of the last step.
    force: DVec3,
}

#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Held {
    node: u32,
    /// Position (m) when it was gripped.
    from: DVec3,
    /// Stiffness (N/m) and damping (N s/m).
    stiffness: f64,
    damping: f64,
}

impl Grip {
    /// Holds the nodes within `radius` (m) of a point (m), the nearer the firmer; `None` if there is none.
    ///
    /// # Arguments
    /// * `positions`, `masses` -- of the body's nodes (m, kg), shape `(n)`.
    /// * `youngs_modulus` -- of the patch (Pa).
    /// * `step` -- largest step (s) with which the body is moved.
    ///
    /// # Panics
    /// If there is not one mass per position, or there are 2³² nodes or more.
    #[must_use]
    pub fn new(
        positions: &[DVec3],
        masses: &[f64],
        point: DVec3,
        radius: f64,
        youngs_modulus: f64,
        step: f64,
    ) -> Option<Self> {
        assert_eq!(positions.len(), masses.len(), "one mass per node");
        let near = |&(_, x): &(usize, &DVec3)| x.distance(point) < radius;
        let weight = |x: &DVec3| (1.0 - x.distance_squared(point) / (radius * radius)).powi(2);
        let patch = || positions.iter().enumerate().filter(near);
        let mass: f64 = patch().map(|(i, x)| masses[i] * weight(x)).sum();
        if mass <= 0.0 {
            return None;
        }
        let whole = FIRMNESS * 2.0 * youngs_modulus * radius / 0.75;
        // Springs in proportion to masses: all fixed nodes swing alike.
        let per_mass = (whole / mass).min((LARGEST_PHASE / step).powi(2));
        let held = patch().map(|(node, &from)| {
            let share = weight(&from);
            Held {
                node: u32::try_from(node).expect("node indices are u32"),
                from,
                stiffness: per_mass * masses[node] * share,
                damping: 2.0 * DAMPING_RATIO * masses[node] * (per_mass * share).sqrt(),
            }
        });
        Some(Self {
            held: held.collect(),
            by: DVec3::ZERO,
            velocity: DVec3::ZERO,
            force: DVec3::ZERO,
        })
    }

    /// Whether it can be one of a body of so many nodes, as one that was read from a file may not.
    #[must_use]
    pub fn is_sound(&self, node_count: usize) -> bool {
        let vectors = [self.by, self.velocity, self.force];
        vectors.iter().all(|vector| vector.is_finite())
            && self.held.iter().all(|held| {
                (held.node as usize) < node_count
                    && held.from.is_finite()
                    && held.stiffness.is_finite()
                    && held.damping.is_finite()
            })
    }

    /// The nodes that it holds.
    pub fn nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.held.iter().map(|held| held.node)
    }

    /// Moves the grip over a step (s) from one displacement (m) since it gripped to another.
    pub fn lead(&mut self, from: DVec3, to: DVec3, step: f64) {
        self.by = to;
        self.velocity = (to - from) / step;
    }

    /// Adds the forces (N) of the hold on the body's nodes at the end of a step: what
    /// [`crate::Motion::step_with`] wants from its closure.
    ///
    /// # Panics
    /// If a fixed node is not one of the view's.
    pub fn pull(&mut self, view: &StepView<'_>, forces: &mut [DVec3]) {
        self.force = DVec3::ZERO;
        for held in &self.held {
            let node = held.node as usize;
            let apart = held.from + self.by - view.positions[node];
            let force =
                apart * held.stiffness + (self.velocity - view.velocities[node]) * held.damping;
            forces[node] += force;
            self.force -= force;
        }
    }

    /// Force (N) on the hand at the end of the last step.
    #[must_use]
    pub fn force(&self) -> DVec3 {
        self.force
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{free, nothing};

    /// Free nodes on springs of their own: where damping has taken the swing they are at the pointer, and the
    /// force on it is none; while the pointer pulls, it feels what the nodes feel.
    #[test]
    fn held_nodes_follow_the_hand_and_pull_back() {
        let positions = [DVec3::ZERO, DVec3::X * 0.004, DVec3::X * 0.5];
        let masses = [2e-3, 1e-3, 1e-3];
        let step = 1e-3;
        let mut grip = Grip::new(&positions, &masses, DVec3::ZERO, 0.01, 5e3, step)
            .expect("two nodes are near");
        assert!(grip.is_sound(3) && !grip.is_sound(1), "nodes 0 and 1");
        let mut motion = free(&positions, &masses);
        let (way, mut largest) = (DVec3::new(0.01, 0.02, 0.0), 0.0_f64);
        for k in 0..2000 {
            let [from, to] = [k, k + 1].map(|k| way * (f64::from(k) / 50.0).min(1.0));
            grip.lead(from, to, step);
            let mut on_nodes = DVec3::ZERO;
            motion
                .step_with(step, nothing, &mut |view, forces| {
                    let before: DVec3 = forces.iter().sum();
                    grip.pull(view, forces);
                    on_nodes = forces.iter().sum::<DVec3>() - before;
                })
                .unwrap();
            let sum = on_nodes + grip.force();
            assert!(sum.length() <= 1e-12 * on_nodes.length(), "{sum} N");
            largest = largest.max(grip.force().length());
        }
        for (node, from) in positions[..2].iter().enumerate() {
            let off = motion.positions()[node].distance(*from + way);
            assert!(off < 1e-9, "node {node} is {off} m off");
        }
        assert_eq!(motion.positions()[2], positions[2], "too far to be held");
        assert!(grip.force().length() < 1e-9 * largest, "{} N", grip.force());
        let far = Grip::new(&positions, &masses, DVec3::Y, 0.01, 5e3, step);
        assert_eq!(far, None, "no node is near");
    }
}
