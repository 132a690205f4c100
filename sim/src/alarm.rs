//! What a run reports at once, each once: a step that all but vanishes, bodies that lie in one another, and contact that
//! gives way.

use glam::DVec3;
use phyxel_integrate::Occupied;

use crate::World;
use crate::body::Body;
use crate::error::WorldError;

/// Fraction of the first step below which a step is reported.
const SHORT: f64 = 0.01;
/// Steps in a row below it with which a run ends: it would take more than a hundred times as long as estimated.
const PATIENCE: u64 = 10_000;
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
        let Some(stiffest) = self.stiffest_body() else {
            return Ok(());
        };
        let body = &mut self.bodies[stiffest];
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
        let mut found = Vec::new();
        for (second, b) in self.bodies.iter().enumerate() {
            for a in &self.bodies[..second] {
                if a.occupied().meets(&b.occupied()) {
                    let (a, b) = (&a.name, &b.name);
                    found.push(format!("bodies '{a}' and '{b}' lie in one another"));
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
        let body = |number: u32| &self.bodies[number as usize];
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

impl Body {
    fn occupied(&self) -> Occupied<'_, impl Fn(DVec3) -> f64> {
        Occupied {
            rest: &self.rest,
            positions: self.motion().positions(),
            spacing: self.spacing,
            distance: |x| self.solid.signed_distance(x),
        }
    }
}
