//! Strokes of the user's blade: those that wait, and the edges that each is captured by.

use glam::DVec3;
use phyxel::StrokePhase;
use phyxel_discretize::Bounds;
use phyxel_enrich::resampled;

use super::Session;
use super::lead::BladeLead;
use super::undo::Before;

/// Strokes that may wait, the one under way included: a user draws far faster than a blade may be driven.
const MOST_STROKES: usize = 8;

/// A stroke under way, or one that waits for the one before.
#[derive(Debug)]
pub(super) struct Stroke {
    lead: BladeLead,
    /// The first edge, until it is captured: a blade that never moves leaves nothing behind.
    first: Option<Vec<DVec3>>,
    /// The state before the stroke.
    before: Option<Before>,
    /// An edge that is to be captured in the next step.
    due: Option<(StrokePhase, Vec<DVec3>)>,
}

impl Session {
    /// The blade's edge as it is driven (m); empty without a stroke.
    #[must_use]
    pub fn blade(&self) -> &[DVec3] {
        self.stroke.front().map_or(&[], |stroke| &stroke.lead.edge)
    }

    /// Starts a stroke of the blade with an edge of two points or more, as soon as the one before is
    /// done. The state before it is kept for [`Session::undo`]. `false`, and nothing done, where too many wait.
    pub fn begin_stroke(&mut self, edge: Vec<DVec3>) -> bool {
        self.end_stroke();
        if self.stroke.len() == MOST_STROKES {
            return false;
        }
        self.stroke.push_back(Stroke {
            first: Some(edge.clone()),
            lead: BladeLead::new(edge, self.capture()),
            before: None,
            due: None,
        });
        true
    }

    /// Drives the blade of the newest stroke on.
    pub fn lead_stroke(&mut self, edge: &[DVec3]) {
        if let Some(stroke) = self.stroke.back_mut() {
            let count = stroke.lead.edge.len();
            let edge = if edge.len() == count {
                edge.to_vec()
            } else {
                resampled(edge, count)
            };
            stroke.lead.pass(edge);
        }
    }

    /// Ends the newest stroke where its blade was driven last.
    pub fn end_stroke(&mut self) {
        if let Some(stroke) = self.stroke.back_mut() {
            stroke.lead.ending = true;
        }
    }

    /// Drives the blade for a step (s); the edge that is to be captured in it, one at most.
    pub(super) fn lead_blade(&mut self, step: f64) -> Option<(StrokePhase, Vec<DVec3>)> {
        let stroke = self.stroke.front()?;
        if stroke.first.is_some() && stroke.before.is_none() {
            let before = Some(self.before());
            self.stroke.front_mut()?.before = before;
        }
        self.leave_air_out();
        let stroke = self.stroke.front_mut()?;
        if let Some(due) = stroke.due.take() {
            if due.0 == StrokePhase::End {
                self.stroke.pop_front();
            }
            return Some(due);
        }
        let before = stroke.lead.edge[0];
        let led = stroke.lead.lead(step);
        self.moved[0] = stroke.lead.edge[0].distance(before);
        let due = led?;
        match stroke.first.take() {
            Some(first) if due.0 == StrokePhase::End && first == due.1 => {
                self.stroke.pop_front();
                None
            }
            Some(first) => {
                stroke.due = Some(due);
                if let Some(before) = stroke.before.take() {
                    self.remember(before);
                }
                self.strokes += 1;
                Some((StrokePhase::Start, first))
            }
            None => {
                if due.0 == StrokePhase::End {
                    self.stroke.pop_front();
                }
                Some(due)
            }
        }
    }

    /// Leaves out what a stroke sweeps before it comes to a body and after it has left all: a blade that is driven
    /// through air would hold the next stroke back.
    fn leave_air_out(&mut self) {
        let Some(stroke) = self.stroke.front() else {
            return;
        };
        if stroke.due.is_some() || (stroke.first.is_none() && !stroke.lead.ending) {
            return;
        }
        let positions = self.world.bodies().iter().flat_map(|body| {
            let positions = body.motion().positions().iter();
            positions.flat_map(|x| [*x - body.spacing, *x + body.spacing])
        });
        let bodies = Bounds::of(positions);
        let edges: Vec<&[DVec3]> = stroke.lead.way().collect();
        let meets = |pair: &[&[DVec3]]| {
            let swept = Bounds::of(pair.iter().copied().flatten().copied());
            swept.min.cmple(bodies.max).all() && swept.max.cmpge(bodies.min).all()
        };
        let air = edges.windows(2).take_while(|pair| !meets(pair)).count();
        let edges = edges.len();
        let Some(stroke) = self.stroke.front_mut().filter(|_| air > 0) else {
            return;
        };
        if stroke.first.is_some() {
            (0..air).for_each(|_| stroke.lead.skip());
            stroke.first = Some(stroke.lead.edge.clone());
        } else if air + 1 == edges {
            stroke.lead.stop();
        }
    }
}
