//! Which nodes a scene holds or drives.

use glam::{DMat3, DVec3};
use phyxel_integrate::{Ease, Path, Supports};

use crate::scene::{Body, Key, Motion, Scene, Support, pose_at};

/// Angle (rad) at which a rotating path is sampled, 0.75°: the chord misses the arc by 5e-6 of its
/// radius, however long the turn takes.
const SAMPLING: f64 = std::f64::consts::FRAC_PI_2 / 120.0;

fn acts_on(support: &Support, body: &Body) -> bool {
    support.body.as_ref().is_none_or(|name| *name == body.name)
}

/// How many nodes of a body a support holds or drives.
pub(super) fn held_count(support: &Support, body: &Body, rest: &[DVec3]) -> usize {
    if acts_on(support, body) {
        nodes_in(support, rest).len()
    } else {
        0
    }
}

fn nodes_in(support: &Support, rest: &[DVec3]) -> Vec<u32> {
    (0_u32..)
        .zip(rest)
        .filter(|(_, x)| support.region.contains(**x))
        .map(|(node, _)| node)
        .collect()
}

/// Which support each node follows, counted from 1, the last of several; 0 where none does. What one support
/// holds moves as a rigid body from beginning to end.
pub(super) fn holders(scene: &Scene, body: &Body, rest: &[DVec3]) -> Vec<u32> {
    let mut holders = vec![0; rest.len()];
    for (number, support) in (1..).zip(&scene.supports) {
        if acts_on(support, body) {
            for node in nodes_in(support, rest) {
                holders[node as usize] = number;
            }
        }
    }
    holders
}

/// All supported nodes at rest: what holds while the body settles.
pub(super) fn supports_of(scene: &Scene, body: &Body, rest: &[DVec3]) -> Supports {
    let mut supports = Supports::free(rest.len());
    for support in scene.supports.iter().filter(|s| acts_on(s, body)) {
        for node in nodes_in(support, rest) {
            supports.fix(node);
        }
    }
    supports
}

/// Supports once scene time runs, with 0 at the motion's time `start` (s); `None` if none is
/// driven, so that those of settling stay.
pub(super) fn driven_supports_of(
    scene: &Scene,
    body: &Body,
    rest: &[DVec3],
    start: f64,
) -> Option<Supports> {
    let ours = || scene.supports.iter().filter(|s| acts_on(s, body));
    if ours().all(|support| support.motion == Motion::Fixed) {
        return None;
    }
    let mut supports = Supports::free(rest.len());
    for support in ours() {
        let nodes = nodes_in(support, rest);
        match &support.motion {
            Motion::Fixed => {
                for node in nodes {
                    supports.fix(node);
                }
            }
            Motion::Driven { path } => {
                supports.drive(&nodes, [true; 3], displacement(path, start), rest);
            }
        }
    }
    Some(supports)
}

/// Displacement of rest points along a scene's path, shifted by `start` (s).
fn displacement(path: &[Key], start: f64) -> Path {
    let turning = path.iter().any(|key| key.rotation != DVec3::ZERO);
    let mut times: Vec<f64> = Vec::new();
    for pair in path.windows(2) {
        let (from, to) = (pair[0].time, pair[1].time);
        let pieces = if turning {
            let (from, to) = (pose_at(path, from).rotation, pose_at(path, to).rotation);
            let angle = from.angle_between(to);
            // Both quaternions of a rotation mean the same.
            let shorter = angle.min(std::f64::consts::TAU - angle);
            (shorter / SAMPLING - 1e-9).ceil().max(1.0)
        } else {
            1.0
        };
        let mut piece = 0.0;
        while piece < pieces {
            times.push(from + (to - from) * (piece / pieces));
            piece += 1.0;
        }
    }
    times.extend(path.last().map(|key| key.time));
    let poses = times
        .iter()
        .map(|&time| (start + time, pose_at(path, time)));
    let path = if turning {
        let keys = poses.map(|(time, pose)| {
            let gradient = DMat3::from_quat(pose.rotation) - DMat3::IDENTITY;
            (time, gradient, pose.position)
        });
        Path::affine(&keys.collect::<Vec<_>>())
    } else {
        Path::new(
            poses.map(|(time, pose)| (time, pose.position)).collect(),
            Ease::Linear,
        )
    };
    path.expect("a validated path has finite keys in rising order")
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let mut supports = Supports::free(rest.len());
            supports.drive(&nodes, [true; 3], displacement(&path, 0.0), &rest);
            supports
        });
        let turned = displacement(&turn(1.0, 170.0), 0.0).bytes();
        assert!(supports[0].bytes() < supports[1].bytes() + turned);
        assert_eq!(supports[0].paths().len(), 1);
        let mut places = rest.clone();
        supports[0].place(2.0, &mut places);
        let pose = pose_at(&turn(1.0, 170.0), 1.0);
        for (x, rest) in places.iter().zip(&rest) {
            assert!(x.distance(pose.apply(*rest)) < 1e-12 * (1.0 + rest.length()));
        }
    }

    /// The path of a point on the rim stays on the circle, and a slow turn takes no more keys.
    #[test]
    fn a_turn_is_sampled_by_its_angle() {
        for time in [1e-3, 1.0, 1e4] {
            let path = displacement(&turn(time, 90.0), 0.0);
            for k in 0..=1000 {
                let share = f64::from(k) / 1000.0;
                let x = DVec3::X + path.of(DVec3::X, time * share).0;
                let angle = share * std::f64::consts::FRAC_PI_2;
                let exact = DVec3::new(angle.cos(), angle.sin(), 0.0);
                // The sagitta of a piece's chord.
                let bound = 1.01 * SAMPLING * SAMPLING / 8.0;
                assert!(x.distance(exact) < bound, "{x} for {exact} at {share}");
            }
            let same = displacement(&turn(1.0, 90.0), 0.0);
            assert_eq!(path.bytes(), same.bytes(), "{time} s");
        }
    }
}
