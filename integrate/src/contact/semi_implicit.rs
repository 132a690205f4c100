//! Contact forces at the middle of the coming step: explicit motion that a penalty does not limit.

use super::scratch::SemiImplicit;
use super::{Contact, ContactForce, Limit};
use crate::shape::{Pose, RigidShape};
use crate::view::StepView;
use glam::{DMat3, DVec3};

/// Newton iterations at most; two or three do.
const NEWTON: usize = 16;

/// Times that a Newton step is halved at most.
const HALVINGS: usize = 6;

/// Conjugate gradient iterations at most, in each.
const LINEAR: usize = 40;

/// Newton stops at this residual over the contact's force. What is left is no error of the balance of
/// momentum, only of the position where the forces are taken.
const TOLERANCE: f64 = 1e-4;

/// Sums over near members and the tool.
fn dot(local: &[u32], a: &[DVec3], b: &[DVec3], tool: [DVec3; 2]) -> f64 {
    let nodes = local.iter().map(|i| a[*i as usize].dot(b[*i as usize]));
    nodes.sum::<f64>() + tool[0].dot(tool[1])
}

impl Contact {
    /// Adds the contact's forces (N), friction included, at the middle of the coming step to `forces`:
    /// those that act where nodes and tool will be half a step from now under them,
    /// `z = x + dt v/2 + dt²/2 (a + f_c(z)/m)`.
    ///
    /// With the central difference method for everything else this is stable at the critical step of
    /// the body alone, for any penalty: a mode of elastic fraction `e = ω² dt²` and contact fraction `κ` has
    /// `(1 + κ/2) z² + (e − 2 + κ/2) z + 1 = 0`, inside the unit circle for `e < 4`. It damps what the
    /// step does not resolve of the contact's own vibration, and forces come half a step early.
    ///
    /// * `pose` -- tool at the middle of the coming step, before the contact moves it.
    /// * `mass` -- of a tool that gives way (kg); `None` for one that does not.
    ///
    /// Gauss-Newton on the nodes near the tool alone, with conjugate gradients and line search. Forces are those of one
    /// evaluation, so that they never pull and balance to round-off however well it converged.
    ///
    /// # Panics
    /// If slices are shorter than the surface's nodes require.
    pub fn press_semi_implicit(
        &mut self,
        shape: &RigidShape,
        pose: &Pose,
        mass: Option<f64>,
        view: &StepView<'_>,
        forces: &mut [DVec3],
    ) -> ContactForce {
        let mut semi_implicit = std::mem::take(&mut self.semi_implicit);
        let half = 0.5 * view.step;
        semi_implicit.gather(&self.surface, |node| {
            let moved = view.velocities[node] + view.acceleration(node) * view.step;
            view.positions[node] + moved * half
        });
        semi_implicit.choose_near(&self.surface, shape, pose, &self.sticking);
        // Forces only push away: what does not touch where it moves by itself never does.
        semi_implicit.keep_touching(&self.surface, shape, pose);
        let mut sum = ContactForce::default();
        let mut at = *pose;
        if semi_implicit.near.is_empty() {
            self.active.clear();
            self.pushed.clear();
        } else {
            semi_implicit.choose_local(&self.surface, view);
            let tool = mass.map(|mass| mass * 2.0 / (view.step * view.step));
            (sum, at) = self.solve_semi_implicit(shape, pose, tool, &mut semi_implicit);
            for &member in &semi_implicit.local {
                let node = self.surface.members[member as usize] as usize;
                forces[node] += semi_implicit.forces[member as usize];
            }
        }
        self.settle_friction(&at);
        self.semi_implicit = semi_implicit;
        sum
    }

    /// Newton from the predicted positions and what the last step's contact added to them; `tool` is its mass over
    /// `step²/2` (N/m).
    fn solve_semi_implicit(
        &mut self,
        shape: &RigidShape,
        pose: &Pose,
        tool: Option<f64>,
        semi_implicit: &mut SemiImplicit,
    ) -> (ContactForce, Pose) {
        let mut shift = DVec3::ZERO;
        let mut at = *pose;
        semi_implicit.push(&mut self.pushed);
        let mut sum = self.evaluate(shape, &at, semi_implicit, Some(Limit::Lagged));
        let mut potential = sum.energy + semi_implicit.inertial_energy(tool, shift);
        for _ in 0..NEWTON {
            for &i in &semi_implicit.local {
                let i = i as usize;
                let pull = (semi_implicit.positions[i] - semi_implicit.predicted[i])
                    * semi_implicit.inertia[i];
                semi_implicit.residual[i] =
                    semi_implicit.free[i] * (semi_implicit.forces[i] - pull);
            }
            let on_tool = tool.map_or(DVec3::ZERO, |inertia| sum.force - shift * inertia);
            let size = dot(
                &semi_implicit.local,
                &semi_implicit.residual,
                &semi_implicit.residual,
                [on_tool; 2],
            )
            .sqrt();
            if size <= TOLERANCE * sum.force.length() {
                break;
            }
            let (moved, slope) = self.linear_semi_implicit(tool, on_tool, semi_implicit);
            let begin = shift;
            // Back until the potential falls; `done` is the fraction of the change taken so far.
            let mut done = 0.0;
            let mut length = 1.0;
            for _ in 0..HALVINGS {
                for &i in &semi_implicit.local {
                    let i = i as usize;
                    semi_implicit.positions[i] += semi_implicit.change[i] * (length - done);
                }
                done = length;
                shift = begin + moved * length;
                at.position = pose.position + shift;
                sum = self.evaluate(shape, &at, semi_implicit, Some(Limit::Lagged));
                let there = sum.energy + semi_implicit.inertial_energy(tool, shift);
                if there <= potential - 1e-4 * length * slope {
                    potential = there;
                    break;
                }
                length *= 0.5;
            }
        }
        for &i in &semi_implicit.local {
            let i = i as usize;
            self.pushed[i] = semi_implicit.positions[i] - semi_implicit.predicted[i];
        }
        (sum, at)
    }

    /// Stiffness of the active points, group by group where that is less work than point by point, and
    /// its diagonal blocks.
    fn assemble(&self, a: &mut SemiImplicit) {
        a.coupling.clear();
        a.assembled.clear();
        a.loose.clear();
        let mut first = 0;
        for points in self.active.chunk_by(|one, two| one.group == two.group) {
            let group = points[0].group;
            let members = self.surface.group_members(group);
            let count = members.len();
            let dense = count <= 2 * points.len();
            if dense {
                a.assembled.push(group);
                let begin = a.coupling.len();
                a.coupling.resize(begin + count * count, DMat3::ZERO);
                let blocks = &mut a.coupling[begin..];
                for active in points {
                    let bound = self.surface.weights_of(group, active.point);
                    let rows = blocks.chunks_exact_mut(count).zip(bound.clone());
                    for (k, (row, (_, w))) in rows.enumerate() {
                        for (block, (_, v)) in row.iter_mut().zip(bound.clone()).skip(k) {
                            *block += active.rigid * (w * v);
                        }
                    }
                }
                for (k, member) in members.iter().enumerate() {
                    a.blocks[*member as usize] += blocks[k * count + k];
                    for l in 0..k {
                        blocks[k * count + l] = blocks[l * count + k];
                    }
                }
            } else {
                for (index, active) in (first..).zip(points) {
                    a.loose.push(index);
                    for (n, w) in self.surface.weights_of(group, active.point) {
                        a.blocks[n] += active.rigid * (w * w);
                    }
                }
            }
            first += u32::try_from(points.len()).expect("no more points than the surface has");
        }
    }

    /// Adds that stiffness times `a.direction`, less the tool's, to `a.image`; returns the sum.
    fn couple(&self, a: &mut SemiImplicit, tool_direction: DVec3) -> DVec3 {
        let mut sum = DVec3::ZERO;
        let mut blocks = a.coupling.iter();
        for &group in &a.assembled {
            let members = self.surface.group_members(group);
            for row in members {
                let mut change = DVec3::ZERO;
                for (column, block) in members.iter().zip(&mut blocks) {
                    change += *block * (a.direction[*column as usize] - tool_direction);
                }
                a.image[*row as usize] += change;
                sum += change;
            }
        }
        for &index in &a.loose {
            let active = &self.active[index as usize];
            let bound = self.surface.weights_of(active.group, active.point);
            let gap: DVec3 = bound.clone().map(|(n, w)| a.direction[n] * w).sum();
            let change = active.rigid * (gap - tool_direction);
            for (n, w) in bound {
                a.image[n] += change * w;
            }
            sum += change;
        }
        sum
    }

    /// Conjugate gradients for the change of members (`semi_implicit.change`) and of the tool, preconditioned
    /// by blocks; returns the latter, and how fast the potential falls along it.
    fn linear_semi_implicit(
        &self,
        tool: Option<f64>,
        on_tool: DVec3,
        semi_implicit: &mut SemiImplicit,
    ) -> (DVec3, f64) {
        let a = semi_implicit;
        for &i in &a.local {
            let i = i as usize;
            a.blocks[i] = DMat3::from_diagonal(DVec3::splat(a.inertia[i]));
            a.change[i] = DVec3::ZERO;
        }
        let mut tool_block = DMat3::from_diagonal(DVec3::splat(tool.unwrap_or(1.0)));
        self.assemble(a);
        if tool.is_some() {
            tool_block += self.active.iter().map(|active| active.rigid).sum::<DMat3>();
        }
        for &i in &a.local {
            a.blocks[i as usize] = a.blocks[i as usize].inverse();
        }
        let tool_block = tool_block.inverse();
        let mut moved = DVec3::ZERO;
        let mut slope = 0.0;
        let mut left = on_tool;
        // The image array holds the preconditioned residual between products.
        let precondition = |a: &mut SemiImplicit, left: DVec3| -> (f64, DVec3) {
            for &i in &a.local {
                let i = i as usize;
                a.image[i] = a.free[i] * (a.blocks[i] * a.residual[i]);
            }
            let on_tool = tool.map_or(DVec3::ZERO, |_| tool_block * left);
            let rho = dot(&a.local, &a.residual, &a.image, [left, on_tool]);
            (rho, on_tool)
        };
        let (mut rho, mut tool_direction) = precondition(a, left);
        for &i in &a.local {
            a.direction[i as usize] = a.image[i as usize];
        }
        let goal = 1e-4 * rho;
        for _ in 0..LINEAR {
            if rho <= goal || rho <= 0.0 {
                break;
            }
            for &i in &a.local {
                let i = i as usize;
                a.image[i] = a.direction[i] * a.inertia[i];
            }
            let mut tool_image = tool_direction * tool.unwrap_or(0.0);
            tool_image -= self.couple(a, tool_direction);
            for &i in &a.local {
                let i = i as usize;
                a.image[i] = a.free[i] * a.image[i];
            }
            if tool.is_none() {
                tool_image = DVec3::ZERO;
            }
            let curvature = dot(
                &a.local,
                &a.direction,
                &a.image,
                [tool_direction, tool_image],
            );
            if curvature <= 0.0 {
                break;
            }
            let alpha = rho / curvature;
            // The residual at the start times the change: directions are conjugate.
            slope += alpha * rho;
            for &i in &a.local {
                let i = i as usize;
                a.change[i] += a.direction[i] * alpha;
                a.residual[i] -= a.image[i] * alpha;
            }
            moved += tool_direction * alpha;
            left -= tool_image * alpha;
            let (next, on_tool) = precondition(a, left);
            let beta = next / rho;
            rho = next;
            for &i in &a.local {
                let i = i as usize;
                a.direction[i] = a.image[i] + a.direction[i] * beta;
            }
            tool_direction = on_tool + tool_direction * beta;
        }
        (moved, slope)
    }
}

#[cfg(test)]
#[path = "semi_implicit_tests.rs"]
mod tests;
