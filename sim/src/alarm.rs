//! What a run reports at once, each once: a step that all but vanishes, bodies that lie in one another, and contact that
//! gives way.

use glam::DVec3;
use phyxel_discretize::Bounds;
use phyxel_mls::within_radius;

use crate::body::Body;
use crate::error::WorldError;
use crate::{Member, World};

/// Fraction of the first step below which a step is reported.
const SHORT: f64 = 0.01;
/// Steps in a row below it with which a run ends: it would take more than a hundred times as long as estimated.
const PATIENCE: u64 = 10_000;
/// Nodes so deep in a body at rest, in its spacings, are inside of it for sure, and what comes half as near to them
/// is so too.
const DEEP: f64 = 1.0;
const NEAR: f64 = 0.5;
/// Depth (spacings) from which contact between bodies fades.
const FADING: f64 = 0.5;

impl World {
    /// What the run has reported so far, one sentence each.
    #[must_use]
    pub fn alarms(&self) -> &[String] {
        &self.now.alarms
    }

    pub(crate) fn alarm(&mut self, what: String, how: &str) {
        if !self.now.alarms.iter().any(|alarm| alarm.starts_with(&what)) {
            self.now.alarms.push(what + how);
        }
    }

    /// Reports where the step is below a hundredth of the first, and ends a run that stays there.
    pub(crate) fn watch_step(&mut self) -> Result<(), WorldError> {
        let (time, step, first, number) =
            (self.time(), self.now.step, self.first_step, self.steps());
        if step >= SHORT * first {
            self.now.short_since = None;
            return Ok(());
        }
        if let Some(since) = self.now.short_since {
            return match number.saturating_sub(since) {
                0..PATIENCE => Ok(()),
                _ => self.check_step(step),
            };
        }
        self.now.short_since = Some(number);
        let eigenvalue = |member: &Member| member.body.current_eigenvalue();
        let stiffest =
            (self.members.iter_mut()).max_by(|a, b| eigenvalue(a).total_cmp(&eigenvalue(b)));
        let Some(Member { body, .. }) = stiffest else {
            return Ok(());
        };
        let what = format!("body '{}': its step fell below", body.name);
        let place = body.stiffest_nodes(1, None).first().map_or_else(
            || "the whole body".to_owned(),
            |stiff| {
                let DVec3 { x, y, z } = body.rest[stiff.node as usize];
                let node = stiff.node;
                format!("node {node}, at rest at ({x:.3e}, {y:.3e}, {z:.3e}) m")
            },
        );
        let how = format!(
            " a hundredth of the first, from {first:.1e} s to {step:.1e} s, {time:.4} s after the first one; \
             stiffest is {place}, where tissue is crushed or stretched far"
        );
        self.alarm(what, &how);
        Ok(())
    }

    /// Reports which bodies lie in one another: a node well inside of one is near to a node of the other.
    pub(crate) fn watch_overlaps(&mut self) {
        let bodies = || self.members.iter().map(|member| &member.body);
        let boxes: Vec<Bounds> = bodies()
            .map(|body| Bounds::of(body.motion.positions().iter().copied()))
            .collect();
        let mut found = Vec::new();
        for (second, b) in bodies().enumerate() {
            for (first, a) in bodies().enumerate().take(second) {
                let low = boxes[first].min.max(boxes[second].min);
                let high = boxes[first].max.min(boxes[second].max);
                if low.cmple(high).all() && lie_in_one_another(a, b, [low, high]) {
                    found.push(format!(
                        "bodies '{}' and '{}' lie in one another",
                        a.name, b.name
                    ));
                }
            }
        }
        let how = format!(
            ", seen {:.4} s after the first step: bodies touch each other in scenes with the key `contact`",
            self.time()
        );
        for what in found {
            self.alarm(what, &how);
        }
    }

    /// Reports which bodies press so deep into each other that contact gives way.
    pub(crate) fn watch_depths(&mut self) {
        let Some(contact) = &self.deformable else {
            return;
        };
        let body = |number: u32| &self.members[number as usize].body;
        let deepest = contact.contact.between().iter().filter_map(|sum| {
            let [a, b] = sum.bodies.map(body);
            let depth = sum.penetration / a.spacing.min(b.spacing);
            let what = if a.name == b.name {
                format!("body '{}' presses into itself", a.name)
            } else {
                format!("bodies '{}' and '{}' press into each other", a.name, b.name)
            };
            (depth > FADING).then_some((what, depth))
        });
        for (what, depth) in deepest.collect::<Vec<_>>() {
            let how = format!(
                ", {depth:.1} spacings deep, {:.4} s after the first step: near a pressure of Young's modulus contact gives \
                 way, and surfaces pass through each other",
                self.time()
            );
            self.alarm(what, &how);
        }
    }
}

/// Whether a node well inside of one body is near to a node of the other, within a box (m).
fn lie_in_one_another(a: &Body, b: &Body, [low, high]: [DVec3; 2]) -> bool {
    let margin = NEAR * a.spacing.max(b.spacing);
    let near = |x: &DVec3| x.cmpge(low - margin).all() && x.cmple(high + margin).all();
    let within = |body: &Body| -> Vec<(usize, DVec3)> {
        let places = body.motion.positions().iter().copied().enumerate();
        places.filter(|(_, x)| near(x)).collect()
    };
    let (of_a, of_b) = (within(a), within(b));
    if of_a.is_empty() || of_b.is_empty() {
        return false;
    }
    let points: Vec<DVec3> = of_a.iter().chain(&of_b).map(|(_, x)| *x).collect();
    // Places that are not finite end the run elsewhere.
    let Ok(pairs) = within_radius(&points, margin) else {
        return false;
    };
    let is_inside = |body: &Body, node: usize, distance: f64| {
        distance < NEAR * body.spacing
            && body.solid.signed_distance(body.rest[node]) < -DEEP * body.spacing
    };
    of_a.iter().enumerate().any(|(k, &(node, x))| {
        let others = pairs.row(k).iter().map(|&other| other as usize);
        let mut others = others.filter_map(|other| of_b.get(other.checked_sub(of_a.len())?));
        others.any(|&(other, y)| {
            let distance = x.distance(y);
            is_inside(a, node, distance) || is_inside(b, other, distance)
        })
    })
}
