//! What clients' users do.

use glam::DVec3;
use phyxel_live::{ClientId, Event, Hand, HandPhase, Quantity, To};

use super::LiveShow;
use phyxel::scene::Pose;

impl LiveShow {
    /// Does what a client did or asked for.
    pub(super) fn take(&mut self, client: ClientId, event: Event) {
        match event {
            Event::Joined => {
                self.heard[client] = 0;
                self.seen[client] = 0;
                self.away[client] = false;
                self.colors[client] = Quantity::None;
                self.introduce(To::One(client));
            }
            Event::Left => self.leave(client),
            Event::Hand(sequence, hand) => {
                self.heard[client] = sequence;
                self.hurried = true;
                self.hand(client, hand);
            }
            Event::Control(control) => {
                if let Err(error) = self.control(client, control) {
                    self.complain(To::One(client), &error.to_string());
                }
            }
            Event::Mesh(extension, content) => self.take_mesh(client, &extension, &content),
            Event::Ready => {}
        }
        if self.fresh && !self.is_moving() && self.server.wants_state() {
            self.send_state();
        }
    }

    pub(super) fn leave(&mut self, client: ClientId) {
        self.away[client] = false;
        self.colors[client] = Quantity::None;
        if self.owners.blade == Some(client) {
            self.owners.blade = None;
            self.session.end_stroke();
        }
        if self.owners.grip == Some(client) {
            self.owners.grip = None;
            self.session.let_go();
        }
        let own = |(_, owner): &mut (usize, ClientId)| *owner == client;
        for (tool, _) in self.owners.tools.extract_if(.., own) {
            self.session.put_tool(tool, None);
        }
    }

    /// Whether someone else drives what a client wants to, who is told so when they begin.
    fn is_taken(
        &self,
        by: Option<ClientId>,
        client: ClientId,
        phase: HandPhase,
        how: &str,
    ) -> bool {
        let taken = by.is_some_and(|owner| owner != client);
        if taken && phase == HandPhase::Begin {
            self.complain(To::One(client), how);
        }
        taken
    }

    pub(super) fn hand(&mut self, client: ClientId, hand: Hand) {
        if self.session.is_replaying() {
            if hand.phase() == HandPhase::Begin {
                self.complain(
                    To::One(client),
                    "a recording is played: hands wait for its end",
                );
            }
            return;
        }
        match hand {
            Hand::Pose {
                tool,
                phase,
                position,
                rotation,
            } => {
                let pose = Pose {
                    rotation: rotation.normalize(),
                    position,
                };
                if tool >= self.session.world().scene().tools.len() {
                    return self.complain(To::One(client), &format!("there is no tool {tool}"));
                }
                self.owners.tools.retain(|(led, _)| *led != tool);
                if phase == HandPhase::End {
                    return self.session.put_tool(tool, None);
                }
                self.owners.tools.push((tool, client));
                match phase {
                    HandPhase::Begin => self.session.put_tool(tool, Some(pose)),
                    _ => self.session.lead_tool(tool, pose),
                }
            }
            Hand::Edge { phase, points } => self.edge(client, phase, points),
            Hand::Grip {
                phase,
                position,
                radius,
            } => {
                let how = "someone else holds the tissue";
                if self.is_taken(self.owners.grip, client, phase, how) {
                    return;
                }
                match phase {
                    HandPhase::Begin => {
                        self.owners.grip = Some(client);
                        self.session.grip(position, radius);
                    }
                    HandPhase::Move => self.session.pull(position),
                    HandPhase::End => {
                        self.owners.grip = None;
                        self.session.let_go();
                    }
                }
            }
        }
    }

    /// Drives the blade.
    fn edge(&mut self, client: ClientId, phase: HandPhase, points: Vec<DVec3>) {
        let how = "someone else is cutting";
        if self.is_taken(self.owners.blade, client, phase, how) {
            return;
        }
        match phase {
            HandPhase::Begin => {
                self.owners.blade = self.session.begin_stroke(points).then_some(client);
                if self.owners.blade.is_none() {
                    let text = "many strokes wait already; let the blade make them, or undo";
                    self.complain(To::One(client), text);
                }
            }
            _ if self.owners.blade.is_none() => {}
            HandPhase::Move => self.session.lead_stroke(&points),
            HandPhase::End => {
                if points.len() >= 2 {
                    self.session.lead_stroke(&points);
                }
                self.session.end_stroke();
                self.owners.blade = None;
            }
        }
    }
}
