//! What a contact's solve needs room for.

use super::surface::ContactSurface;
use crate::shape::{Pose, RigidShape};
use crate::view::StepView;
use glam::{DMat3, DVec3};

/// Vectors over the members of a surface; scratch, no state.
#[derive(Debug, Clone, Default)]
pub(crate) struct SemiImplicit {
    pub(super) positions: Vec<DVec3>,
    pub(super) forces: Vec<DVec3>,
    /// Groups that may touch.
    pub(super) near: Vec<u32>,
    /// Where nothing was near when it was last looked for, if so.
    clear: Option<Clearance>,
    /// Members of those groups.
    pub(super) local: Vec<u32>,
    pub(super) marked: Vec<bool>,
    pub(super) predicted: Vec<DVec3>,
    /// Inertia of a member over `step²/2` (N/m).
    pub(super) inertia: Vec<f64>,
    pub(super) free: Vec<DMat3>,
    pub(super) residual: Vec<DVec3>,
    pub(super) change: Vec<DVec3>,
    pub(super) direction: Vec<DVec3>,
    pub(super) image: Vec<DVec3>,
    pub(super) blocks: Vec<DMat3>,
    /// Stiffness between the members of a group, row by row, for the groups in `assembled`.
    pub(super) coupling: Vec<DMat3>,
    pub(super) assembled: Vec<u32>,
    /// Active points of all other groups.
    pub(super) loose: Vec<u32>,
}

/// That no group could touch: until a member has moved so far, none can.
#[derive(Debug, Clone)]
struct Clearance {
    shape: RigidShape,
    pose: Pose,
    positions: Vec<DVec3>,
    /// Distance (m), squared.
    distance_squared: f64,
}

impl PartialEq for SemiImplicit {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl SemiImplicit {
    /// Takes the positions of members.
    pub(super) fn gather(&mut self, surface: &ContactSurface, position: impl Fn(usize) -> DVec3) {
        let members = surface.members.iter();
        self.positions.clear();
        self.positions
            .extend(members.map(|node| position(*node as usize)));
        self.forces.resize(surface.members.len(), DVec3::ZERO);
    }

    /// Lists the groups whose middle is no farther from the tool than from their nodes, and those of sticking points
    /// (ascending).
    pub(super) fn choose_near(
        &mut self,
        surface: &ContactSurface,
        shape: &RigidShape,
        pose: &Pose,
        sticking: &[(u32, DVec3)],
    ) {
        self.near.clear();
        if let Some(clear) = &self.clear
            && (clear.shape, clear.pose) == (*shape, *pose)
            && clear.positions.len() == self.positions.len()
            && (clear.positions.iter().zip(&self.positions))
                .all(|(a, b)| a.distance_squared(*b) < clear.distance_squared)
        {
            return;
        }
        let placed = shape.placed(pose);
        // Points are means of their members, and so move no farther.
        let mut least = f64::INFINITY;
        for group in 0..surface.group_count() {
            let members = surface.group_members(group);
            let at = |member: &u32| self.positions[*member as usize];
            let sum: DVec3 = members.iter().map(at).sum();
            let middle = sum * surface.share(group);
            let value = placed.value(middle);
            let away = members
                .iter()
                .map(|member| middle.distance_squared(at(member)));
            let farthest = away.fold(0.0, f64::max);
            let points = surface.points(group);
            let sticks = sticking.get(sticking.partition_point(|stuck| stuck.0 < points.start));
            let sticks = sticks.is_some_and(|stuck| stuck.0 < points.end);
            if value <= 0.0 || farthest >= value * value || sticks {
                self.near.push(group);
            } else {
                least = least.min(value - farthest.sqrt());
            }
        }
        let is_clear = self.near.is_empty();
        self.clear = is_clear.then(|| Clearance {
            shape: *shape,
            pose: *pose,
            positions: self.positions.clone(),
            distance_squared: least * least,
        });
    }

    /// Keeps the groups with a point in contact.
    pub(super) fn keep_touching(
        &mut self,
        surface: &ContactSurface,
        shape: &RigidShape,
        pose: &Pose,
    ) {
        let placed = shape.placed(pose);
        let positions = &self.positions;
        self.near.retain(|&group| {
            surface.points(group).any(|point| {
                let bound = surface.weights_of(group, point);
                placed.value(bound.map(|(n, w)| positions[n] * w).sum()) < 0.0
            })
        });
    }

    /// Moves local members by what the contact added to their positions in the last step, and forgets that of all others.
    pub(super) fn push(&mut self, pushed: &mut Vec<DVec3>) {
        pushed.resize(self.positions.len(), DVec3::ZERO);
        let mut local = self.local.iter().peekable();
        for (member, push) in (0..).zip(pushed) {
            if local.next_if(|next| **next == member).is_some() {
                let i = member as usize;
                self.positions[i] += self.free[i] * *push;
            } else {
                *push = DVec3::ZERO;
            }
        }
    }

    /// What it costs to leave the predicted positions (J).
    pub(super) fn inertial_energy(&self, tool: Option<f64>, shift: DVec3) -> f64 {
        let nodes = self.local.iter().map(|i| {
            let i = *i as usize;
            0.5 * self.inertia[i] * (self.positions[i] - self.predicted[i]).length_squared()
        });
        nodes.sum::<f64>() + tool.map_or(0.0, |inertia| 0.5 * inertia * shift.length_squared())
    }

    /// Members of the near groups, with what the solve needs of them.
    pub(super) fn choose_local(&mut self, surface: &ContactSurface, view: &StepView<'_>) {
        let count = surface.members.len();
        self.local.clear();
        self.marked.clear();
        self.marked.resize(count, false);
        for &group in &self.near {
            for &member in surface.group_members(group) {
                if !self.marked[member as usize] {
                    self.marked[member as usize] = true;
                    self.local.push(member);
                }
            }
        }
        self.local.sort_unstable();
        self.predicted.clone_from(&self.positions);
        for array in [
            &mut self.residual,
            &mut self.change,
            &mut self.direction,
            &mut self.image,
        ] {
            array.resize(count, DVec3::ZERO);
        }
        self.inertia.resize(count, 0.0);
        self.free.resize(count, DMat3::IDENTITY);
        self.blocks.resize(count, DMat3::ZERO);
        let share = 2.0 / (view.step * view.step);
        for &member in &self.local {
            let node = surface.members[member as usize] as usize;
            self.inertia[member as usize] = view.mass(node) * share;
            self.free[member as usize] = view.free(node);
        }
    }
}
