//! Contact of a body's surface with one rigid tool: penalty, augmented Lagrangian, friction.

use crate::law::ForceLaw;
use crate::shape::{Pose, Shape, outer};
use crate::surface::ContactSurface;
use glam::{DMat3, DVec3};

/// Penalty times spacing over Young's modulus of [`penalty`]. Between 15 and 40 block indentation
/// forces stay within some 3 % at contact radii of two spacings or more; stiffer shortens explicit
/// steps, below 10 the penetration itself becomes an error.
const RELATIVE_PENALTY: f64 = 30.0;

/// Automatic penalty (N/m³): `30 E / h` for Young's modulus `E` (Pa) and surface spacing `h` (m) at the
/// contact.
#[must_use]
pub fn penalty(youngs_modulus: f64, spacing: f64) -> f64 {
    RELATIVE_PENALTY * youngs_modulus / spacing
}

/// How a contact resists.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactSettings {
    /// Pressure over penetration (N/m³); see [`penalty`].
    pub penalty: f64,
    /// Coulomb's coefficient of friction, 0 for none. Only explicit steps apply it.
    pub friction: f64,
}

/// Sum of a contact's forces.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactForce {
    /// Force on the tool (N).
    pub force: DVec3,
    /// Torque on the tool about its origin (N m).
    pub torque: DVec3,
    /// Energy of the penalty (J), friction left out.
    pub energy: f64,
    /// Area in contact (m²), at rest.
    pub area: f64,
    /// Deepest penetration (m); 0 without contact.
    pub penetration: f64,
}

/// A point in contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPoint {
    /// Index of the point on the surface.
    pub point: u32,
    /// Where it is (m).
    pub position: DVec3,
    /// Outward normal of the tool there.
    pub normal: DVec3,
    /// Pressure (Pa), over the area at rest; never negative.
    pub pressure: f64,
    /// Area at rest (m²).
    pub area: f64,
    group: u32,
    /// Second derivative of the energy (N/m).
    stiffness: DMat3,
}

/// A surface that can touch a tool, with the state of that contact.
///
/// The energy is `Σ_q a_q ⟨λ_q − k φ_q⟩² / 2k` over the surface's points, with the signed distance `φ`
/// at the linearly interpolated position; the force on a point, `a ⟨λ − k φ⟩ ∇φ`, goes to its nodes
/// by its weights. Without [`Contact::augment`] all `λ` are 0: plain penalty.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Contact {
    surface: ContactSurface,
    settings: ContactSettings,
    multipliers: Vec<f64>,
    /// Where a sticking point holds on to the tool, in the tool's frame; empty without friction.
    anchors: Vec<Option<DVec3>>,
    #[cfg_attr(feature = "serde", serde(skip))]
    active: Vec<ContactPoint>,
    sticking: Vec<u32>,
}

impl Contact {
    /// A contact that is not touched yet.
    ///
    /// # Panics
    /// If the penalty is not positive and finite or the friction negative or not finite.
    #[must_use]
    pub fn new(surface: ContactSurface, settings: ContactSettings) -> Self {
        let sound = settings.penalty.is_finite() && settings.penalty > 0.0;
        assert!(sound, "the penalty must be positive and finite");
        let sound = settings.friction.is_finite() && settings.friction >= 0.0;
        assert!(sound, "friction must be finite and not negative");
        let rubs = settings.friction > 0.0;
        let anchors = if rubs {
            vec![None; surface.point_count()]
        } else {
            Vec::new()
        };
        Self {
            surface,
            settings,
            multipliers: Vec::new(),
            anchors,
            active: Vec::new(),
            sticking: Vec::new(),
        }
    }

    /// The surface.
    #[must_use]
    pub fn surface(&self) -> &ContactSurface {
        &self.surface
    }

    /// Points in contact at the last evaluation, in order.
    #[must_use]
    pub fn points(&self) -> &[ContactPoint] {
        &self.active
    }

    /// Adds the contact's normal forces (N) on nodes at `positions` (m) to `forces`.
    ///
    /// # Panics
    /// If the slices differ in length or are shorter than the surface's nodes require.
    ///
    /// # Numerics
    /// Groups of points whose nodes are farther from the tool than they are from each other are
    /// skipped. Sums run in the order of points.
    pub fn add_forces(
        &mut self,
        shape: &Shape,
        pose: &Pose,
        positions: &[DVec3],
        forces: &mut [DVec3],
    ) -> ContactForce {
        assert_eq!(positions.len(), forces.len(), "one force per node");
        self.active.clear();
        let mut sum = ContactForce::default();
        let stiffness = self.settings.penalty;
        let surface = &self.surface;
        for (index, group) in (0_u32..).zip(&surface.groups) {
            let nodes = &surface.nodes[group.nodes[0] as usize..group.nodes[1] as usize];
            let first = positions[nodes[0] as usize];
            let reach = nodes
                .iter()
                .map(|n| first.distance_squared(positions[*n as usize]));
            let reach = reach.fold(0.0, f64::max).sqrt();
            if shape.distance_value(pose, first) > reach && self.multipliers.is_empty() {
                continue;
            }
            let mut weights = surface.weights[group.weights as usize..].chunks_exact(nodes.len());
            for point in group.points[0]..group.points[1] {
                let Some(weights) = weights.next() else { break };
                let bound = nodes.iter().zip(weights);
                let position: DVec3 = bound
                    .clone()
                    .map(|(n, w)| positions[*n as usize] * *w)
                    .sum();
                let at = shape.distance(pose, position);
                let multiplier = self.multipliers.get(point as usize).copied().unwrap_or(0.0);
                let pressure = multiplier - stiffness * at.value;
                if pressure <= 0.0 {
                    continue;
                }
                let area = surface.areas[point as usize];
                let force = at.normal * (area * pressure);
                for (n, w) in bound {
                    forces[*n as usize] += force * *w;
                }
                sum.force -= force;
                sum.torque -= (position - pose.position).cross(force);
                sum.energy += 0.5 * area * pressure * pressure / stiffness;
                sum.area += area;
                sum.penetration = sum.penetration.max(-at.value);
                let block = outer(at.normal) * stiffness - at.curvature * pressure;
                self.active.push(ContactPoint {
                    point,
                    position,
                    normal: at.normal,
                    pressure,
                    area,
                    group: index,
                    stiffness: block * area,
                });
            }
        }
        sum
    }

    /// Adds frictional forces at the points of the last [`Contact::add_forces`] to `forces` and `sum`:
    /// each point sticks to where it first touched by a tangential spring as stiff as the penalty and
    /// slides on when that pulls more than `friction · pressure` (Coulomb; return mapping). To be called
    /// once a step.
    ///
    /// # Panics
    /// If `forces` is shorter than the surface's nodes require.
    pub fn add_friction(&mut self, pose: &Pose, forces: &mut [DVec3], sum: &mut ContactForce) {
        if self.anchors.is_empty() {
            return;
        }
        for &point in &self.sticking {
            if self
                .active
                .binary_search_by_key(&point, |a| a.point)
                .is_err()
            {
                self.anchors[point as usize] = None;
            }
        }
        self.sticking.clear();
        let back = pose.rotation.inverse();
        for active in &self.active {
            self.sticking.push(active.point);
            let local = back * (active.position - pose.position);
            let anchor = &mut self.anchors[active.point as usize];
            let slip = pose.rotation * (local - anchor.unwrap_or(local));
            let slip = slip - active.normal * active.normal.dot(slip);
            let pull = self.settings.penalty * slip.length();
            let limit = self.settings.friction * active.pressure;
            let kept = if pull > limit {
                slip * (limit / pull)
            } else {
                slip
            };
            *anchor = Some(local - back * kept);
            let force = kept * (-self.settings.penalty * active.area);
            let group = &self.surface.groups[active.group as usize];
            for (n, w) in weights_of(&self.surface, group, active.point) {
                forces[n as usize] += force * w;
            }
            sum.force -= force;
            sum.torque -= (active.position - pose.position).cross(force);
        }
    }

    /// Adds `K v` of the normal forces (N/m) at the last evaluation to `product`.
    ///
    /// # Panics
    /// If a slice is shorter than the surface's nodes require.
    pub fn add_tangent_product(&self, vector: &[DVec3], product: &mut [DVec3]) {
        for active in &self.active {
            let group = &self.surface.groups[active.group as usize];
            let bound = weights_of(&self.surface, group, active.point);
            let moved: DVec3 = bound.clone().map(|(n, w)| vector[n as usize] * w).sum();
            let change = active.stiffness * moved;
            for (n, w) in bound {
                product[n as usize] += change * w;
            }
        }
    }

    /// Adds the diagonal blocks of that stiffness (N/m).
    ///
    /// # Panics
    /// If `blocks` is shorter than the surface's nodes require.
    pub fn add_blocks(&self, blocks: &mut [DMat3]) {
        for active in &self.active {
            let group = &self.surface.groups[active.group as usize];
            for (n, w) in weights_of(&self.surface, group, active.point) {
                blocks[n as usize] += active.stiffness * (w * w);
            }
        }
    }

    /// Augmented Lagrangian update after a solution: pressures become multipliers (`λ ← ⟨λ − k φ⟩`), so
    /// that the next solution needs less penetration. Returns the deepest penetration (m) that was left.
    pub fn augment(&mut self, shape: &Shape, pose: &Pose) -> f64 {
        self.multipliers.clear();
        self.multipliers.resize(self.surface.point_count(), 0.0);
        let mut deepest: f64 = 0.0;
        for active in &self.active {
            self.multipliers[active.point as usize] = active.pressure;
            deepest = deepest.max(-shape.distance_value(pose, active.position));
        }
        deepest
    }

    /// Forgets multipliers: plain penalty again.
    pub fn reset(&mut self) {
        self.multipliers.clear();
    }
}

fn weights_of<'a>(
    surface: &'a ContactSurface,
    group: &crate::surface::Group,
    point: u32,
) -> impl Iterator<Item = (u32, f64)> + Clone + 'a {
    let nodes = &surface.nodes[group.nodes[0] as usize..group.nodes[1] as usize];
    let begin = group.weights as usize + (point - group.points[0]) as usize * nodes.len();
    let weights = &surface.weights[begin..begin + nodes.len()];
    nodes.iter().copied().zip(weights.iter().copied())
}

/// A force law with contacts added, for static and implicit solutions. Friction is left out.
#[derive(Debug)]
pub struct Pressed<'a, L> {
    /// The body's own law.
    pub law: L,
    /// Contact, shape and pose of each tool.
    pub contacts: Vec<(&'a mut Contact, Shape, Pose)>,
    /// Forces on the tools at the last evaluation.
    pub tool_forces: Vec<ContactForce>,
}

impl<'a, L: ForceLaw> Pressed<'a, L> {
    /// One body, one tool.
    pub fn new(law: L, contact: &'a mut Contact, shape: Shape, pose: Pose) -> Self {
        Self {
            law,
            contacts: vec![(contact, shape, pose)],
            tool_forces: Vec::new(),
        }
    }
}

impl<L: ForceLaw> ForceLaw for Pressed<'_, L> {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let mut energy = self.law.forces_into(positions, forces);
        self.tool_forces.clear();
        for (contact, shape, pose) in &mut self.contacts {
            let sum = contact.add_forces(shape, pose, positions, forces);
            energy += sum.energy;
            self.tool_forces.push(sum);
        }
        energy
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        self.law.tangent_product_into(vector, product);
        for (contact, _, _) in &self.contacts {
            contact.add_tangent_product(vector, product);
        }
    }

    fn tangent_blocks_into(&mut self, blocks: &mut [DMat3]) -> bool {
        let known = self.law.tangent_blocks_into(blocks);
        if known {
            for (contact, _, _) in &self.contacts {
                contact.add_blocks(blocks);
            }
        }
        known
    }
}

#[cfg(test)]
#[path = "contact_tests.rs"]
mod tests;
