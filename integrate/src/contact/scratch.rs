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
    /// Where all groups were looked at.
    clearance: Option<Clearance>,
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

/// That no group but some could touch: until a member has moved so far past the tool, no other can.
#[derive(Debug, Clone)]
struct Clearance {
    shape: RigidShape,
    pose: Pose,
    positions: Vec<DVec3>,
    /// Distance (m), squared.
    distance_squared: f64,
    /// Those that could, with a margin of the largest group's radius.
    groups: Vec<u32>,
}

impl Clearance {
    fn holds(&self, shape: &RigidShape, pose: &Pose, positions: &[DVec3]) -> bool {
        // Distances are those in the tool's frame.
        let shift = pose.position - self.pose.position;
        let near =
            |(a, b): (&DVec3, &DVec3)| a.distance_squared(*b - shift) < self.distance_squared;
        (self.shape, self.pose.rotation) == (*shape, pose.rotation)
            && self.positions.len() == positions.len()
            && self.positions.iter().zip(positions).all(near)
    }
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

    /// Lists the groups whose middle is no farther from the tool than from their nodes, but for the largest height, and those of
    /// sticking points (ascending).
    pub(super) fn choose_near(
        &mut self,
        surface: &ContactSurface,
        shape: &RigidShape,
        pose: &Pose,
        sticking: &[(u32, DVec3)],
    ) {
        let sticks = |group: u32| {
            let points = surface.points(group);
            let next = sticking.get(sticking.partition_point(|stuck| stuck.0 < points.start));
            next.is_some_and(|stuck| stuck.0 < points.end)
        };
        let placed = shape.placed(pose);
        let positions = &self.positions;
        // The middle's distance from the tool, less the largest height, and how far from it (squared) its members are. Points
        // are means of these, and so move no farther.
        let reach = |group: u32| {
            let members = surface.group_members(group);
            let at = |member: &u32| positions[*member as usize];
            let sum: DVec3 = members.iter().map(at).sum();
            let middle = sum * surface.share(group);
            let away = members
                .iter()
                .map(|member| middle.distance_squared(at(member)));
            let value = placed.value(middle) - surface.highest;
            (value, away.fold(0.0, f64::max))
        };
        let held = self.clearance.take();
        let clearance = held.filter(|held| held.holds(shape, pose, positions));
        let clearance = clearance.unwrap_or_else(|| {
            let reaches: Vec<(f64, f64)> = (0..surface.group_count()).map(reach).collect();
            let largest = reaches.iter().map(|reach| reach.1).fold(0.0, f64::max);
            let slack = |(value, farthest): &(f64, f64)| value - farthest.sqrt();
            let (mut groups, mut least) = (Vec::new(), f64::INFINITY);
            for (group, slack) in (0..).zip(reaches.iter().map(slack)) {
                if slack <= largest.sqrt() || sticks(group) {
                    groups.push(group);
                } else {
                    least = least.min(slack);
                }
            }
            Clearance {
                shape: *shape,
                pose: *pose,
                positions: positions.clone(),
                distance_squared: least * least,
                groups,
            }
        });
        self.near.clear();
        self.near.extend(clearance.groups.iter().filter(|&&group| {
            let (value, farthest) = reach(group);
            value <= 0.0 || farthest >= value * value || sticks(group)
        }));
        self.clearance = Some(clearance);
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
                let position = bound.map(|(n, w)| positions[n] * w).sum();
                placed.value(position) < surface.heights[point as usize]
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
