//! What clients are sent: scenes and surfaces once, then what changes.

use std::time::Instant;

use glam::DVec3;
use phyxel_live::{
    BodyState, GRIP, StateMessage, To, Told, encode_force, encode_nodes, encode_state,
};

use super::{LiveShow, Owners};
use crate::live::skin::Skins;
use crate::live::told::{energies_of, nodes_of, scene_of, stats_of, tool_states, values_of};
use crate::run::doubts;

impl LiveShow {
    /// Takes the surfaces as they are for what clients know, who get them by [`LiveShow::introduce`].
    pub(super) fn know_skins(&mut self) {
        self.skins = Skins::new(self.session.painter());
    }

    /// Everything again: another world is shown.
    pub(super) fn begin_epoch(&mut self) {
        self.epoch += 1;
        self.owners = Owners::default();
        self.doubts = 0;
        self.know_skins();
        self.clock.origin = None;
        self.clock.last = None;
        self.introduce(To::All);
    }

    /// Sends all that a client needs to know.
    pub(super) fn introduce(&mut self, to: To) {
        let world = self.session.world();
        let recordings = self.recordings();
        let scene = scene_of(
            self.epoch,
            &self.session,
            &self.base,
            &self.sources,
            recordings,
        );
        let nodes = world.bodies().iter().enumerate();
        let nodes = nodes.map(|(index, body)| encode_nodes(self.epoch, index, &body.rest));
        let skins = self.skins.whole(self.epoch, self.session.painter());
        let messages = nodes.chain(skins).collect();
        self.server.begin(to, scene, messages);
        self.fresh = true;
        self.send_stats();
    }

    pub(super) fn send_state(&mut self) {
        self.number = self.number.wrapping_add(1);
        self.fresh = false;
        let world = self.session.world();
        let tools = tool_states(world);
        let nodes = nodes_of(world);
        let quantities = self.colors.iter().fold(0, |all, one| all | one.bit());
        let values = values_of(world, quantities);
        let bodies: Vec<BodyState<'_>> = (nodes.iter().zip(&values))
            .map(|((positions, gradients), values)| BodyState {
                positions,
                gradients,
                values,
            })
            .collect();
        let state = StateMessage {
            number: self.number,
            step: world.steps(),
            time: world.time(),
            step_size: world.step_size(),
            seen: self.seen,
            energies: energies_of(world),
            grip: world.grip_force().unwrap_or(DVec3::ZERO),
            tools: &tools,
            blade: self.session.blade(),
            values: quantities,
            bodies: &bodies,
        };
        let state = encode_state(self.epoch, &state);
        let count = tools.len();
        for (hand, samples) in self.session.forces().drain().into_iter().enumerate() {
            if samples.iter().any(|sample| sample.force != DVec3::ZERO) {
                let tool = u32::try_from(hand).ok().filter(|_| hand < count);
                let message = encode_force(self.epoch, tool.unwrap_or(GRIP), &samples);
                self.server.send(To::All, message);
            }
        }
        self.server.put_state(self.number, state);
    }

    pub(super) fn send_stats(&mut self) {
        self.told = Instant::now();
        let time = self.session.world().time();
        let mut stats = stats_of(&self.session, self.skins.len());
        stats.playing = self.playing;
        stats.slipped = self.clock.slipped;
        let (spent, steps) = std::mem::take(&mut self.clock.stepping);
        stats.step_ms = 1e3 * spent.as_secs_f64() / f64::from(steps.max(1));
        if let Some((wall, before)) = self.clock.last {
            stats.real_time = (time - before).max(0.0) / wall.elapsed().as_secs_f64().max(1e-3);
        }
        self.clock.last = Some((Instant::now(), time));
        self.server.tell(To::All, &Told::Stats(Box::new(stats)));
        let doubts = doubts(self.session.world());
        for doubt in doubts.iter().skip(self.doubts) {
            self.complain(To::All, doubt);
        }
        self.doubts = self.doubts.max(doubts.len());
    }
}
