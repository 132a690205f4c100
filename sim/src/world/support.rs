//! Which nodes a scene holds or drives.

use glam::DVec3;
use phyxel_integrate::{Ease, Path, Supports};

use crate::scene::{Body, Key, Motion, Scene, Support, pose_at};

/// Interval (s) at which a rotating path is sampled: chords of a turn of 90° a second then miss
/// the arc by 1e-5 of its radius.
const SAMPLING: f64 = 1.0 / 120.0;

fn acts_on(support: &Support, body: &Body) -> bool {
    support.body.as_ref().is_none_or(|name| *name == body.name)
}

fn nodes_in(support: &Support, rest: &[DVec3]) -> Vec<u32> {
    (0_u32..)
        .zip(rest)
        .filter(|(_, x)| support.region.contains(**x))
        .map(|(node, _)| node)
        .collect()
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
                for node in nodes {
                    let path = displacement(path, rest[node as usize], start);
                    supports.drive(&[node], [true; 3], path, rest);
                }
            }
        }
    }
    Some(supports)
}

/// Displacement of the rest point `x` along a scene's path, shifted by `start` (s).
fn displacement(path: &[Key], x: DVec3, start: f64) -> Path {
    let turning = path.iter().any(|key| key.rotation != DVec3::ZERO);
    let mut times: Vec<f64> = Vec::new();
    for pair in path.windows(2) {
        let (from, to) = (pair[0].time, pair[1].time);
        let pieces = if turning {
            ((to - from) / SAMPLING).ceil().max(1.0)
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
    let keys = times
        .iter()
        .map(|&time| (start + time, pose_at(path, time).apply(x) - x))
        .collect();
    Path::new(keys, Ease::Linear).expect("a validated path has finite keys in rising order")
}
