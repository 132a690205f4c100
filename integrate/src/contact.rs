//! Contact of a body's surface with one rigid tool: by a penalty.

mod friction;
pub(crate) mod pressed;
mod scratch;
mod semi_implicit;
mod surface;
#[cfg(test)]
mod tests;

use scratch::SemiImplicit;
pub use surface::{ContactSurface, SurfaceError};

use crate::shape::{Pose, RigidShape, outer};
use glam::{DMat3, DVec3};

/// Penalty times spacing over Young's modulus of [`penalty`]. Between 20 and 60 block indentation
/// forces stay within some 3 % at contact radii of two spacings or more; below 10 the penetration
/// itself becomes an error.
const RELATIVE_PENALTY: f64 = 40.0;

/// Automatic penalty (N/m³): `40 E / h` for Young's modulus `E` (Pa) and surface spacing `h` (m) at the
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
    /// Coulomb's coefficient of friction, 0 for none.
    pub friction: f64,
    /// In explicit steps, solve for the contact's forces at the middle of the coming step
    /// ([`Contact::press_semi_implicit`]): the penalty then leaves the critical step alone. `false`: forces
    /// from where the nodes are, which keep energy better and limit the step.
    pub implicit: bool,
}

impl ContactSettings {
    /// No friction, implicit.
    #[must_use]
    pub fn new(penalty: f64) -> Self {
        Self {
            penalty,
            friction: 0.0,
            implicit: true,
        }
    }
}

/// Sum of a contact's forces.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ContactForce {
    /// Force on the tool (N).
    pub force: DVec3,
    /// Torque on the tool about its origin (N m).
    pub torque: DVec3,
    /// Energy of the springs (J): penalty and, under lagged friction, its incremental potential.
    pub energy: f64,
    /// Area in contact (m²), at rest: of a triangle that is touched, all that is no farther from the tool than it is high.
    pub area: f64,
    /// Deepest penetration (m); 0 without contact.
    pub penetration: f64,
}

/// A point in contact.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ContactPoint {
    /// Index of the point on the surface.
    pub point: u32,
    /// Where it is (m), on its triangle; the surface touches as far in front of it as it is high.
    pub position: DVec3,
    /// Outward normal of the tool there.
    pub normal: DVec3,
    /// Pressure (Pa), over the area at rest; never negative, and 0 where only lagged friction acts any longer.
    pub pressure: f64,
    /// Traction of friction on the body (Pa), over the area at rest.
    pub traction: DVec3,
    /// Area at rest (m²).
    pub area: f64,
    pub(crate) group: u32,
    /// Second derivative of the energy (N/m).
    pub(crate) stiffness: DMat3,
    /// The same without the tool's curvature: positive semidefinite.
    pub(crate) rigid: DMat3,
}

/// What limits the traction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Limit {
    /// Friction times the present pressure.
    Present,
    /// The limits of the last [`Contact::lag_friction`] or [`Contact::settle_friction`], in the planes that the tool has where
    /// points hold on to it, also at those that have left it: a potential without jumps.
    Lagged,
}

/// An ascending list, from the last point on that was asked for: none before it is asked for again.
struct Ascending<'a, T>(&'a [(u32, T)]);

impl<T: Copy> Ascending<'_, T> {
    fn of(&mut self, point: u32) -> Option<T> {
        while let [(next, value), rest @ ..] = self.0 {
            if *next >= point {
                return (*next == point).then_some(*value);
            }
            self.0 = rest;
        }
        None
    }
}

/// A surface that can touch a tool, with the state of that contact.
///
/// The energy is `Σ_q a_q k ⟨h_q − φ_q⟩² / 2` over the surface's points. `φ` is the signed distance at the linearly interpolated
/// position, `h` the height of the surface there ([`ContactSurface::raised`]). The force on a point, `a k ⟨h − φ⟩ ∇φ`, goes to its
/// nodes by its weights. Outside of a box's edge its curvature, `1/φ`, has no bound; implicit steps over such edges converge.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Contact {
    pub(crate) surface: ContactSurface,
    pub(crate) settings: ContactSettings,
    /// Largest traction (Pa) that lagged friction may take at points, ascending; none at all others.
    pub(crate) limits: Vec<(u32, f64)>,
    /// Points that stick, ascending, and where they hold on to the tool, in its frame.
    pub(crate) sticking: Vec<(u32, DVec3)>,
    /// How far (m) the last step's forces moved each member by its middle: where the next solve begins; empty before a
    /// contact.
    pub(crate) pushed: Vec<DVec3>,
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(crate) active: Vec<ContactPoint>,
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(crate) semi_implicit: SemiImplicit,
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
        Self {
            surface,
            settings,
            limits: Vec::new(),
            sticking: Vec::new(),
            pushed: Vec::new(),
            active: Vec::new(),
            semi_implicit: SemiImplicit::default(),
        }
    }

    /// Whether it can be one with a body of so many nodes: indices within the body and its surface, finite numbers.
    /// One that comes from a file may not be.
    #[must_use]
    pub fn is_sound(&self, node_count: usize) -> bool {
        let points = self.surface.point_count();
        let known = |point: u32| (point as usize) < points;
        let (limits, sticking) = (&self.limits, &self.sticking);
        let settings = &self.settings;
        self.surface.is_sound(node_count)
            && limits
                .iter()
                .all(|&(point, limit)| known(point) && limit.is_finite())
            && limits.is_sorted_by_key(|limit| limit.0)
            && sticking
                .iter()
                .all(|&(point, anchor)| known(point) && anchor.is_finite())
            && sticking.is_sorted_by_key(|anchor| anchor.0)
            && (self.pushed.is_empty() || self.pushed.len() == self.surface.members.len())
            && self.pushed.iter().all(|push| push.is_finite())
            && settings.penalty.is_finite()
            && settings.penalty > 0.0
            && settings.friction.is_finite()
            && settings.friction >= 0.0
    }

    /// The surface.
    #[must_use]
    pub fn surface(&self) -> &ContactSurface {
        &self.surface
    }

    /// Settings.
    #[must_use]
    pub fn settings(&self) -> &ContactSettings {
        &self.settings
    }

    /// Bytes of the surface and of the state of the contact.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.surface.bytes()
            + size_of_val(&*self.limits)
            + size_of_val(&*self.sticking)
            + size_of_val(&*self.pushed)
    }

    /// Points in contact at the last evaluation, in order.
    #[must_use]
    pub fn points(&self) -> &[ContactPoint] {
        &self.active
    }

    /// Contact pressure (Pa) at each of `node_count` nodes at the last evaluation: the mean of the points that hang on a node, by
    /// their areas (m²) and weights' amounts; 0 where nothing presses.
    ///
    /// # Panics
    /// If a point hangs on a node beyond `node_count`.
    #[must_use]
    pub fn pressures(&self, node_count: usize) -> Vec<f64> {
        let (mut forces, mut areas) = (vec![0.0; node_count], vec![0.0; node_count]);
        let mut pressures = vec![0.0; self.surface.areas.len()];
        for active in &self.active {
            pressures[active.point as usize] = active.pressure;
        }
        for group in (0..).take(self.surface.groups.len()) {
            for point in self.surface.points(group) {
                for (member, weight) in self.surface.weights_of(group, point) {
                    let node = self.surface.members[member] as usize;
                    let area = self.surface.areas[point as usize] * weight.abs();
                    forces[node] += area * pressures[point as usize];
                    areas[node] += area;
                }
            }
        }
        let mean = |(force, area): (f64, f64)| if area > 0.0 { force / area } else { 0.0 };
        forces.into_iter().zip(areas).map(mean).collect()
    }

    /// Nodes that carry points in contact at the last evaluation, once for each.
    pub(crate) fn touched(&self) -> impl Iterator<Item = u32> + '_ {
        self.active.iter().flat_map(|active| {
            let members = self.surface.group_members(active.group).iter();
            members.map(|member| self.surface.members[*member as usize])
        })
    }

    /// Adds the contact's normal forces (N) on nodes at `positions` (m) to `forces`.
    ///
    /// # Panics
    /// If the slices differ in length or are shorter than the surface's nodes require.
    ///
    /// # Numerics
    /// Groups of points are skipped whose middle is farther from the tool than from their nodes, by more than the largest
    /// height. Sums run in the order of points.
    pub fn add_forces(
        &mut self,
        shape: &RigidShape,
        pose: &Pose,
        positions: &[DVec3],
        forces: &mut [DVec3],
    ) -> ContactForce {
        self.add_all(shape, pose, positions, forces, None)
    }

    pub(crate) fn add_all(
        &mut self,
        shape: &RigidShape,
        pose: &Pose,
        positions: &[DVec3],
        forces: &mut [DVec3],
        friction: Option<Limit>,
    ) -> ContactForce {
        assert_eq!(positions.len(), forces.len(), "one force per node");
        let mut semi_implicit = std::mem::take(&mut self.semi_implicit);
        semi_implicit.gather(&self.surface, |node| positions[node]);
        semi_implicit.choose_near(&self.surface, shape, pose, &self.sticking);
        let sum = self.evaluate(shape, pose, &mut semi_implicit, friction);
        for (member, force) in self.surface.members.iter().zip(&semi_implicit.forces) {
            forces[*member as usize] += *force;
        }
        self.semi_implicit = semi_implicit;
        sum
    }

    /// Forces on members at `semi_implicit.positions` into `semi_implicit.forces`, over the near groups; friction if a
    /// limit is named.
    pub(crate) fn evaluate(
        &mut self,
        shape: &RigidShape,
        pose: &Pose,
        semi_implicit: &mut SemiImplicit,
        friction: Option<Limit>,
    ) -> ContactForce {
        self.active.clear();
        semi_implicit.forces.fill(DVec3::ZERO);
        let mut sum = ContactForce::default();
        let stiffness = self.settings.penalty;
        let surface = &self.surface;
        let placed = shape.placed(pose);
        let lagged = friction == Some(Limit::Lagged);
        let mut limits = Ascending(&self.limits);
        for &group in &semi_implicit.near {
            let top = surface.top(group);
            let (mut area_below, mut is_touched) = (0.0, false);
            for point in surface.points(group) {
                let bound = surface.weights_of(group, point);
                let position: DVec3 = bound
                    .clone()
                    .map(|(n, w)| semi_implicit.positions[n] * w)
                    .sum();
                let height = surface.heights[point as usize];
                let value = placed.value(position);
                let touches = value < height;
                is_touched |= touches;
                if value < top {
                    area_below += surface.areas[point as usize];
                }
                if !(touches || lagged && limits.of(point).is_some_and(|limit| limit > 0.0)) {
                    continue;
                }
                let at = placed.distance(position);
                let depth = height - at.value;
                let pressure = (stiffness * depth).max(0.0);
                let area = surface.areas[point as usize];
                let force = at.normal * (area * pressure);
                for (n, w) in bound {
                    semi_implicit.forces[n] += force * w;
                }
                sum.force -= force;
                sum.torque -= (position - pose.position).cross(force);
                sum.energy += 0.5 * area * pressure * pressure / stiffness;
                sum.penetration = sum.penetration.max(depth);
                let rigid = if touches {
                    outer(at.normal) * (stiffness * area)
                } else {
                    DMat3::ZERO
                };
                self.active.push(ContactPoint {
                    point,
                    position,
                    normal: at.normal,
                    pressure,
                    traction: DVec3::ZERO,
                    area,
                    group,
                    stiffness: rigid - at.curvature * (pressure * area),
                    rigid,
                });
            }
            sum.area += if is_touched { area_below } else { 0.0 };
        }
        if let Some(limit) = friction {
            self.rub((shape, pose), limit, &mut semi_implicit.forces, &mut sum);
        }
        sum
    }

    /// Adds `K v` (N/m) at the last evaluation to `product`; friction counts as far as its limits are
    /// given and its part is symmetric.
    ///
    /// # Panics
    /// If a slice is shorter than the surface's nodes require.
    pub(crate) fn add_tangent_product(&self, vector: &[DVec3], product: &mut [DVec3]) {
        let node = |member: usize| self.surface.members[member] as usize;
        for active in &self.active {
            let bound = self.surface.weights_of(active.group, active.point);
            let moved: DVec3 = bound.clone().map(|(n, w)| vector[node(n)] * w).sum();
            let change = active.stiffness * moved;
            for (n, w) in bound {
                product[node(n)] += change * w;
            }
        }
    }

    /// Adds the diagonal blocks of that stiffness (N/m).
    ///
    /// # Panics
    /// If `blocks` is shorter than the surface's nodes require.
    pub(crate) fn add_blocks(&self, blocks: &mut [DMat3]) {
        for active in &self.active {
            for (n, w) in self.surface.weights_of(active.group, active.point) {
                blocks[self.surface.members[n] as usize] += active.stiffness * (w * w);
            }
        }
    }
}
