//! How tools and blades are driven from where a client last said to where it says now.
//!
//! Pointers speak some sixty times a second, steps are taken a thousand times. Between two samples a
//! tool follows with a lag and a speed limit: without the lag each sample would be a jolt, without the
//! limit a sample from far away would fling tissue. What comes out of here is what the world is given.

use std::collections::VecDeque;

use glam::{DQuat, DVec3};

/// Time (s) in which a tool makes up for most of its lag: half of a pointer's interval at 60 a second.
const LAG: f64 = 0.008;
/// Largest speed (m/s) of a tool or a blade: fast hands in surgery reach a few decimetres a second.
const LARGEST_SPEED: f64 = 0.6;
/// Largest turning speed (rad/s) of a tool.
const LARGEST_TURN: f64 = 20.0;
/// Distance (m) and angle (rad) at which a tool has arrived.
const ARRIVED: f64 = 1e-7;

/// Where a tool is (m), and how it is turned.
pub type Placement = (DVec3, DQuat);

/// A tool on its way to where a client wants it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseLead {
    now: Placement,
    target: Placement,
}

impl PoseLead {
    /// A tool at rest.
    #[must_use]
    pub const fn new(now: Placement) -> Self {
        Self { now, target: now }
    }

    /// Where it is.
    #[must_use]
    pub const fn now(&self) -> Placement {
        self.now
    }

    /// Sets where it shall go.
    pub fn aim(&mut self, target: Placement) {
        self.target = target;
    }

    /// Puts it somewhere at once.
    pub fn put(&mut self, now: Placement) {
        *self = Self::new(now);
    }

    /// Moves it for a step (s); where it is then, if it moved.
    pub fn lead(&mut self, step: f64) -> Option<Placement> {
        if self.now == self.target {
            return None;
        }
        let ((from, turned), (to, turn)) = (self.now, self.target);
        let way = to - from;
        let turn = (turn * turned.inverse()).normalize();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let (axis, angle) = turn.to_axis_angle();
        if way.length() < ARRIVED && angle < ARRIVED {
            self.now = self.target;
            return Some(self.now);
        }
        let share = 1.0 - (-step / LAG).exp();
        let position = from + (way * share).clamp_length_max(LARGEST_SPEED * step);
        let angle = (angle * share).min(LARGEST_TURN * step);
        let rotation = (DQuat::from_axis_angle(axis, angle) * turned).normalize();
        self.now = (position, rotation);
        Some(self.now)
    }
}

/// Most edges that wait; beyond that the oldest path is straightened.
const MOST_WAITING: usize = 256;

/// A blade's edge on its way along what a client drew.
#[derive(Debug, Clone, PartialEq)]
pub struct BladeLead {
    edge: Vec<DVec3>,
    captured: Vec<DVec3>,
    /// Edges still to come, in order.
    waiting: VecDeque<Vec<DVec3>>,
    /// Path length (m) of the farthest point between two captures.
    capture: f64,
    ending: bool,
}

/// What a step of a blade asks for.
#[derive(Debug, Clone, PartialEq)]
pub enum Led {
    /// Nothing yet.
    Nothing,
    /// The edge is to be captured.
    Capture(Vec<DVec3>),
    /// The edge is to be captured, and the stroke ends.
    End(Vec<DVec3>),
}

impl BladeLead {
    /// A stroke that starts at an edge of two points or more and is captured every `capture` (m).
    #[must_use]
    pub fn new(edge: Vec<DVec3>, capture: f64) -> Self {
        Self {
            captured: edge.clone(),
            edge,
            waiting: VecDeque::new(),
            capture,
            ending: false,
        }
    }

    /// The edge as it is now.
    #[must_use]
    pub fn edge(&self) -> &[DVec3] {
        &self.edge
    }

    /// Adds an edge that it shall pass.
    ///
    /// # Panics
    /// If it has not as many points as the first.
    pub fn pass(&mut self, edge: Vec<DVec3>) {
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
    pub fn way(&self) -> impl Iterator<Item = &[DVec3]> {
        let waiting = self.waiting.iter().map(Vec::as_slice);
        std::iter::once(self.edge()).chain(waiting)
    }

    /// Goes to the next edge at once, and from there as if the stroke began.
    pub fn skip(&mut self) {
        if let Some(next) = self.waiting.pop_front() {
            self.captured.clone_from(&next);
            self.edge = next;
        }
    }

    /// Ends the stroke where the blade is.
    pub fn stop(&mut self) {
        self.waiting.clear();
        self.ending = true;
    }

    /// Whether the stroke ends with the edges that wait.
    #[must_use]
    pub const fn is_ending(&self) -> bool {
        self.ending
    }

    /// Ends the stroke where the last edge lies.
    pub fn end(&mut self) {
        self.ending = true;
    }

    /// Moves the edge for a step (s), by as much as makes the farthest point reach the speed limit, or
    /// the path between two captures.
    pub fn lead(&mut self, step: f64) -> Led {
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
            return Led::End(self.edge.clone());
        }
        if due {
            self.captured.clone_from(&self.edge);
            return Led::Capture(self.edge.clone());
        }
        Led::Nothing
    }
}

/// Largest distance (m) of two points in the same position of two lines.
fn largest_distance(from: &[DVec3], to: &[DVec3]) -> f64 {
    let moves = from.iter().zip(to).map(|(from, to)| from.distance(*to));
    moves.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tool_arrives_and_is_never_faster_than_allowed() {
        let start = (DVec3::ZERO, DQuat::IDENTITY);
        let goal = (DVec3::new(0.03, -0.02, 0.01), DQuat::from_rotation_x(2.0));
        let mut lead = PoseLead::new(start);
        assert_eq!(lead.lead(1e-3), None, "nothing to do");
        lead.aim(goal);
        let (mut before, mut steps) = (start, 0);
        while let Some(now) = lead.lead(1e-3) {
            let way = now.0.distance(before.0);
            assert!(way <= LARGEST_SPEED * 1e-3 * (1.0 + 1e-12), "{way} m");
            (before, steps) = (now, steps + 1);
            assert!(steps < 1000, "it must arrive");
        }
        assert_eq!(lead.now(), goal);
    }

    #[test]
    fn a_blade_passes_all_edges_in_captures_of_the_distance_asked() {
        let edge = |x: f64, y: f64| vec![DVec3::new(x, y, 0.0), DVec3::new(x, y, 0.05)];
        let mut lead = BladeLead::new(edge(0.0, 0.0), 0.004);
        lead.pass(edge(0.01, 0.0));
        lead.pass(edge(0.01, 0.01));
        lead.end();
        let (mut captures, mut last) = (Vec::new(), DVec3::ZERO);
        for _ in 0..1000 {
            match lead.lead(1e-3) {
                Led::Nothing => {}
                Led::Capture(edge) => captures.push(edge[0]),
                Led::End(edge) => {
                    captures.push(edge[0]);
                    break;
                }
            }
            let way = lead.edge()[0].distance(last);
            assert!(
                way <= LARGEST_SPEED * 1e-3 * (1.0 + 1e-9),
                "{way} m in a step"
            );
            last = lead.edge()[0];
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
