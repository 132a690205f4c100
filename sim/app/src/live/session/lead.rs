//! How tools and blades are driven from where a client last said to where it says now.
//!
//! Pointers speak some sixty times a second, steps are taken a thousand times. Between two samples a
//! tool follows with a lag and a speed limit: without the lag each sample would be a jolt, without the
//! limit a sample from far away would fling tissue. What comes out of here is what the world is given.

use std::collections::VecDeque;

use glam::{DQuat, DVec3};
use phyxel::StrokePhase;
use phyxel::scene::Pose;
use phyxel_enrich::largest_distance;

/// Time (s) in which a tool makes up for most of its lag: half of a pointer's interval at 60 a second.
const LAG: f64 = 0.008;
/// Largest speed (m/s) of a tool or a blade: fast hands in surgery reach a few decimetres a second.
const LARGEST_SPEED: f64 = 0.6;
/// Largest turning speed (rad/s) of a tool.
const LARGEST_TURN: f64 = 20.0;
/// Distance (m) and angle (rad) at which a tool has arrived.
const ARRIVED: f64 = 1e-7;

/// A tool on its way to where a client wants it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PoseLead {
    pub(super) now: Pose,
    pub(super) target: Pose,
}

impl PoseLead {
    /// A tool at rest.
    pub(super) fn new(now: Pose) -> Self {
        Self { now, target: now }
    }

    /// Moves it for a step (s); where it is then, if it moved.
    pub(super) fn lead(&mut self, step: f64) -> Option<Pose> {
        if self.now == self.target {
            return None;
        }
        let Pose { position, rotation } = self.now;
        let way = self.target.position - position;
        let turn = (self.target.rotation * rotation.inverse()).normalize();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let (axis, angle) = turn.to_axis_angle();
        if way.length() < ARRIVED && angle < ARRIVED {
            self.now = self.target;
            return Some(self.now);
        }
        let share = 1.0 - (-step / LAG).exp();
        let angle = (angle * share).min(LARGEST_TURN * step);
        self.now = Pose {
            position: position + (way * share).clamp_length_max(LARGEST_SPEED * step),
            rotation: (DQuat::from_axis_angle(axis, angle) * rotation).normalize(),
        };
        Some(self.now)
    }
}

/// Most edges that wait; beyond that the oldest path is straightened.
const MOST_WAITING: usize = 256;

/// A blade's edge on its way along what a client drew.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BladeLead {
    /// The edge as it is now.
    pub(super) edge: Vec<DVec3>,
    captured: Vec<DVec3>,
    /// Edges still to come, in order.
    waiting: VecDeque<Vec<DVec3>>,
    /// Path length (m) of the farthest point between two captures.
    capture: f64,
    /// Whether the stroke ends where the last edge that waits lies.
    pub(super) ending: bool,
}

impl BladeLead {
    /// A stroke that starts at an edge of two points or more and is captured every `capture` (m).
    pub(super) fn new(edge: Vec<DVec3>, capture: f64) -> Self {
        Self {
            captured: edge.clone(),
            edge,
            waiting: VecDeque::new(),
            capture,
            ending: false,
        }
    }

    /// Adds an edge that it shall pass.
    ///
    /// # Panics
    /// If it has not as many points as the first.
    pub(super) fn pass(&mut self, edge: Vec<DVec3>) {
        assert_eq!(edge.len(), self.edge.len(), "as many points as the first");
        if self.ending {
            return;
        }
        if self.waiting.len() == MOST_WAITING {
            self.waiting.pop_back();
        }
        self.waiting.push_back(edge);
    }

    /// The edges that it has still to pass, from where it is now.
    pub(super) fn way(&self) -> impl Iterator<Item = &[DVec3]> {
        let waiting = self.waiting.iter().map(Vec::as_slice);
        std::iter::once(&*self.edge).chain(waiting)
    }

    /// Goes to the next edge at once, and from there as if the stroke began.
    pub(super) fn skip(&mut self) {
        if let Some(next) = self.waiting.pop_front() {
            self.captured.clone_from(&next);
            self.edge = next;
        }
    }

    /// Ends the stroke where the blade is.
    pub(super) fn stop(&mut self) {
        self.waiting.clear();
        self.ending = true;
    }

    /// Moves the edge for a step (s), by as much as makes the farthest point reach the speed limit, or
    /// the path between two captures; the edge where it is to be captured, and whether the stroke goes on or ends with it.
    pub(super) fn lead(&mut self, step: f64) -> Option<(StrokePhase, Vec<DVec3>)> {
        let mut left = LARGEST_SPEED * step;
        while let Some(next) = self.waiting.front() {
            let way = largest_distance(&self.edge, next);
            let room = (self.capture - largest_distance(&self.captured, &self.edge)).max(0.0);
            let share = left.min(room);
            if way > share {
                if share > 0.0 {
                    for (point, next) in self.edge.iter_mut().zip(next) {
                        *point = point.lerp(*next, share / way);
                    }
                }
                break;
            }
            left -= way;
            self.edge.clone_from(next);
            self.waiting.pop_front();
        }
        let moved = largest_distance(&self.captured, &self.edge);
        // Round-off must not hold a capture back.
        let due = moved >= self.capture * (1.0 - 1e-9);
        if self.ending && self.waiting.is_empty() {
            return Some((StrokePhase::End, self.edge.clone()));
        }
        due.then(|| {
            self.captured.clone_from(&self.edge);
            (StrokePhase::Update, self.edge.clone())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tool_arrives_and_is_never_faster_than_allowed() {
        let start = Pose::IDENTITY;
        let goal = Pose {
            position: DVec3::new(0.03, -0.02, 0.01),
            rotation: DQuat::from_rotation_x(2.0),
        };
        let mut lead = PoseLead::new(start);
        assert_eq!(lead.lead(1e-3), None, "nothing to do");
        lead.target = goal;
        let (mut before, mut steps) = (start, 0);
        while let Some(now) = lead.lead(1e-3) {
            let way = now.position.distance(before.position);
            assert!(way <= LARGEST_SPEED * 1e-3 * (1.0 + 1e-12), "{way} m");
            (before, steps) = (now, steps + 1);
            assert!(steps < 1000, "it must arrive");
        }
        assert_eq!(lead.now, goal);
    }

    #[test]
    fn a_blade_passes_all_edges_in_captures_of_the_distance_asked() {
        let edge = |x: f64, y: f64| vec![DVec3::new(x, y, 0.0), DVec3::new(x, y, 0.05)];
        let mut lead = BladeLead::new(edge(0.0, 0.0), 0.004);
        lead.pass(edge(0.01, 0.0));
        lead.pass(edge(0.01, 0.01));
        lead.ending = true;
        let (mut captures, mut last) = (Vec::new(), DVec3::ZERO);
        for _ in 0..1000 {
            let led = lead.lead(1e-3);
            captures.extend(led.iter().map(|(_, edge)| edge[0]));
            if led.is_some_and(|(phase, _)| phase == StrokePhase::End) {
                break;
            }
            let way = lead.edge[0].distance(last);
            assert!(way <= LARGEST_SPEED * 1e-3 * (1.0 + 1e-9), "{way} m");
            last = lead.edge[0];
        }
        assert_eq!(captures.last(), Some(&DVec3::new(0.01, 0.01, 0.0)));
        let pairs = captures.windows(2);
        for pair in pairs {
            let way = pair[0].distance(pair[1]);
            assert!(way <= 0.004 * (1.0 + 1e-9), "{way} m between captures");
        }
        // 20 mm of path with a corner, which shortens a chord: five captures or six.
        assert!((5..=6).contains(&captures.len()), "{}", captures.len());
    }
}
