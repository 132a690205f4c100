//! Which nodes a scene holds or drives.

use glam::DVec3;
use phyxel_integrate::{BoundaryConditions, Ease, Trajectory};

use crate::{Body, Key, Scene, SupportMotion};

impl Scene {
    /// Whether supports of a body move once scene time runs.
    #[must_use]
    pub fn is_driven(&self, body: &Body) -> bool {
        let mut ours = self.supports.iter().filter(|s| s.acts_on(&body.name));
        ours.any(|support| support.motion != SupportMotion::Fixed)
    }

    /// A body's supports for its nodes at rest (m). All hold while it settles. Once scene time runs, with 0 at the motion's
    /// time `start` (s), the driven ones move.
    ///
    /// # Panics
    /// If a path's keys are not finite or in no order, which [`Scene::validate`] refuses.
    #[must_use]
    pub fn supports_of(
        &self,
        body: &Body,
        rest: &[DVec3],
        start: Option<f64>,
    ) -> BoundaryConditions {
        let mut supports = BoundaryConditions::free(rest.len());
        for support in self.supports.iter().filter(|s| s.acts_on(&body.name)) {
            let nodes = support.region.nodes(rest);
            match (&support.motion, start) {
                (SupportMotion::Driven { path }, Some(start)) => {
                    supports.drive(&nodes, [true; 3], shifted(path, start), rest);
                }
                _ => nodes.into_iter().for_each(|node| supports.fix(node)),
            }
        }
        supports
    }
}

/// A scene's path in the motion's time, which is `start` (s) at its 0.
fn shifted(path: &[Key], start: f64) -> Trajectory {
    let keys = path.iter().map(|key| (start + key.time, key.pose()));
    let path = Trajectory::new(&keys.collect::<Vec<_>>(), Ease::Linear);
    path.expect("a validated path has finite keys in ascending order")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose_at;

    fn turn(time: f64, degrees: f64) -> Vec<Key> {
        let key = |time, degrees| Key {
            time,
            position: DVec3::ZERO,
            rotation: DVec3::Z * degrees,
        };
        vec![key(0.0, 0.0), key(time, degrees)]
    }

    /// Many nodes that turn often take no more memory than many that are shifted, but for one path.
    #[test]
    fn nodes_that_turn_together_share_a_path() {
        let rest: Vec<DVec3> = (0..1000).map(|k| DVec3::splat(f64::from(k))).collect();
        let nodes: Vec<u32> = (0..1000).collect();
        let supports = [turn(1.0, 170.0), turn(1.0, 0.0)].map(|path| {
            let mut supports = BoundaryConditions::free(rest.len());
            supports.drive(&nodes, [true; 3], shifted(&path, 0.0), &rest);
            supports
        });
        let turned = shifted(&turn(1.0, 170.0), 0.0).bytes();
        assert!(supports[0].bytes() < supports[1].bytes() + turned);
        assert_eq!(supports[0].paths().len(), 1);
        let mut places = rest.clone();
        supports[0].place(2.0, &mut places);
        let pose = pose_at(&turn(1.0, 170.0), 1.0);
        for (x, rest) in places.iter().zip(&rest) {
            assert!(x.distance(pose.apply(*rest)) < 1e-12 * (1.0 + rest.length()));
        }
    }

    /// A point on the rim stays on the circle and is where the scene's path has it, however slow the turn.
    #[test]
    fn what_turns_stays_on_its_circle() {
        for time in [1e-3, 1.0, 1e4] {
            let keys = turn(time, 90.0);
            let path = shifted(&keys, 3.0);
            for k in 0..=1000 {
                let share = f64::from(k) / 1000.0;
                let x = path.place(DVec3::X, 3.0 + time * share).0;
                let angle = share * std::f64::consts::FRAC_PI_2;
                let exact = DVec3::new(angle.cos(), angle.sin(), 0.0);
                // Of 3 s the round-off of times is left.
                let bound = 1e-14 + 1e-15 / time;
                assert!(x.distance(exact) < bound, "{x} for {exact} at {share}");
                let posed = pose_at(&keys, time * share).apply(DVec3::X);
                assert!(x.distance(posed) < bound, "{x} for {posed} at {share}");
            }
        }
    }
}
