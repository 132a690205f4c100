//! Coulomb friction by return mapping, with limits of the moment or lagged ones.

use super::{Ascending, Contact, ContactForce, ContactPoint, Limit};
use crate::shape::{Pose, RigidShape, outer};
use glam::{DMat3, DVec3};

impl Contact {
    /// Adds frictional forces at the points of the last [`Contact::add_forces`] to `forces` and `sum`:
    /// each point sticks to where it first touched by a tangential spring as stiff as the penalty and
    /// slides on when that pulls more than `friction · pressure` (Coulomb; return mapping). Slip is
    /// then settled: to be called once a step.
    ///
    /// # Panics
    /// If `forces` is shorter than the surface's nodes require.
    pub(crate) fn add_friction(
        &mut self,
        (shape, pose): (&RigidShape, &Pose),
        forces: &mut [DVec3],
        sum: &mut ContactForce,
    ) {
        if self.settings.friction <= 0.0 {
            return;
        }
        let mut on_members = vec![DVec3::ZERO; self.surface.members.len()];
        self.rub((shape, pose), Limit::Present, &mut on_members, sum);
        for (member, force) in self.surface.members.iter().zip(&on_members) {
            forces[*member as usize] += *force;
        }
        self.settle_friction(pose);
    }

    /// Takes `friction · pressure` of the last evaluation as the limits of lagged friction, and returns
    /// the largest change of a limit as a fraction of the largest limit. Static solutions with friction
    /// repeat solving and this until that is small, then [`Contact::settle_friction`].
    pub fn lag_friction(&mut self) -> f64 {
        if self.settings.friction <= 0.0 {
            return 0.0;
        }
        let limit =
            |active: &ContactPoint| (active.point, self.settings.friction * active.pressure);
        let limits: Vec<(u32, f64)> = self.active.iter().map(limit).collect();
        let largest = limits.iter().map(|limit| limit.1).fold(0.0, f64::max);
        let change = |of: &[(u32, f64)], from: &[(u32, f64)]| {
            let mut from = Ascending(from);
            let change =
                |&(point, limit): &(u32, f64)| f64::abs(limit - from.of(point).unwrap_or(0.0));
            of.iter().map(change).fold(0.0, f64::max)
        };
        let change = change(&limits, &self.limits).max(change(&self.limits, &limits));
        self.limits = limits;
        if largest > 0.0 {
            change / largest
        } else {
            change
        }
    }

    /// Lets the points of the last evaluation slide to where their tractions hold them, and forgets
    /// those out of contact. Also lags the limits.
    pub fn settle_friction(&mut self, pose: &Pose) {
        if self.settings.friction <= 0.0 {
            return;
        }
        self.active.retain(|point| point.pressure > 0.0);
        self.lag_friction();
        let back = pose.rotation.inverse();
        let stuck = self.active.iter().map(|active| {
            let kept = active.traction / -self.settings.penalty;
            let anchor = back * (active.position - pose.position - kept);
            (active.point, anchor)
        });
        self.sticking.clear();
        self.sticking.extend(stuck);
    }

    /// Adds friction at the active points to forces on members, with its symmetric stiffness.
    pub(crate) fn rub(
        &mut self,
        (shape, pose): (&RigidShape, &Pose),
        limit: Limit,
        forces: &mut [DVec3],
        sum: &mut ContactForce,
    ) {
        if self.settings.friction <= 0.0 {
            return;
        }
        let k = self.settings.penalty;
        let placed = shape.placed(pose);
        let (mut anchors, mut limits) = (Ascending(&self.sticking), Ascending(&self.limits));
        for active in &mut self.active {
            let Some(anchor) = anchors.of(active.point) else {
                active.traction = DVec3::ZERO;
                continue;
            };
            let anchor = pose.position + pose.rotation * anchor;
            let (limit, normal) = match limit {
                Limit::Present => (self.settings.friction * active.pressure, active.normal),
                Limit::Lagged => {
                    let limit = limits.of(active.point);
                    (limit.unwrap_or(0.0), placed.distance(anchor).normal)
                }
            };
            let slip = active.position - anchor;
            let slip = slip - normal * normal.dot(slip);
            let length = slip.length();
            let plane = DMat3::IDENTITY - outer(normal);
            let (traction, stiffness, energy) = if k * length <= limit {
                (slip * -k, plane * k, 0.5 * k * length * length)
            } else {
                let along = slip / length;
                let turning = (plane - outer(along)) * (limit / length);
                (along * -limit, turning, limit * (length - 0.5 * limit / k))
            };
            active.traction = traction;
            active.stiffness += stiffness * active.area;
            active.rigid += stiffness * active.area;
            let force = traction * active.area;
            for (n, w) in self.surface.weights_of(active.group, active.point) {
                forces[n] += force * w;
            }
            sum.force -= force;
            sum.torque -= (active.position - pose.position).cross(force);
            sum.energy += energy * active.area;
        }
    }
}

#[cfg(test)]
#[path = "friction_tests.rs"]
mod tests;
