//! Steps of the body, as its motion asks for them.

use std::time::Instant;

use glam::DVec3;
use phyxel_integrate::{Pass, PassSums, Shares, State};

use super::Front;
use crate::command::Command;
use crate::memory::{moving, moving_mut};
use crate::traffic::FETCHED;
use crate::wire::{FRONT, broadcast, receive_vectors, send_vectors};

impl Shares for Front {
    fn begin(&mut self, pass: &Pass, state: &mut State) {
        if self.watched.is_empty() {
            Command::Step(*pass).give();
            let (mine, wire) = self.mine();
            let told = mine.step(pass, wire);
            self.hear(&told, false);
            return;
        }
        Command::Watched(*pass).give();
        let mut velocities = self.picked(&state.velocities);
        broadcast(&mut velocities);
        let (mine, _) = self.mine();
        mine.set_watched(&velocities, false);
        mine.begin(pass);
        let told = mine.watched(&[mine.motion.positions(), mine.motion.velocities()]);
        let found: [_; 2] = self.gather_watched(&told);
        self.put(&found[0], &mut state.positions);
        self.put(&found[1], &mut state.velocities);
    }

    fn evaluate(&mut self, state: &mut State, forces: &mut [DVec3]) {
        if self.watched.is_empty() {
            return;
        }
        let mut positions = self.picked(&state.positions);
        broadcast(&mut positions);
        let (mine, wire) = self.mine();
        mine.set_watched(&positions, true);
        mine.evaluate(wire);
        let told = mine.watched(&[mine.own_forces()]);
        let [found] = self.gather_watched(&told);
        self.put(&found, forces);
    }

    fn end(
        &mut self,
        pass: &Pass,
        applied: &[DVec3],
        state: &mut State,
        viscous: &mut [DVec3],
    ) -> (f64, Vec<PassSums>) {
        if !self.watched.is_empty() {
            let acts = !applied.is_empty();
            let mut numbers = vec![f64::from(u8::from(acts))];
            if acts {
                numbers.extend(self.picked(applied));
            } else {
                numbers.resize(1 + 3 * self.watched.len(), 0.0);
            }
            broadcast(&mut numbers);
            let (mine, _) = self.mine();
            let told = mine.end_watched(pass, &numbers);
            let found = self.hear(&told, true);
            self.put(&found[0], &mut state.velocities);
            self.put(&found[1], viscous);
        }
        (self.energy, std::mem::take(&mut self.sums))
    }

    fn fetch(&mut self, state: &mut State) {
        let Some(layout) = self.layout.clone() else {
            return;
        };
        let begun = Instant::now();
        Command::Fetch.give();
        self.tell_velocities(&state.velocities);
        let (mine, _) = self.mine();
        let own = mine.motion.state().clone();
        let n = layout.range(layout.ranks() - 1).end;
        let viscous = state.viscous.len() == n && n > 0;
        for rank in 0..layout.ranks() {
            let range = layout.range(rank);
            let lists = moving_mut(state).into_iter().zip(moving(&own));
            for (k, (to, from)) in lists.enumerate() {
                let none = k == 3 && !viscous;
                let to = &mut to[if none { 0..0 } else { range.clone() }];
                if rank == FRONT {
                    to.copy_from_slice(from);
                } else {
                    receive_vectors(rank, to);
                    self.traffic[FETCHED].bytes += size_of_val(to);
                }
            }
        }
        self.traffic[FETCHED].add(begun);
    }

    fn store(&mut self, state: &State) {
        let Some(layout) = self.layout.clone() else {
            return;
        };
        Command::Store.give();
        for rank in 0..layout.ranks() {
            let range = layout.range(rank);
            let velocities = &state.velocities[range.clone()];
            let viscous = state.viscous.get(range).unwrap_or_default();
            if rank == FRONT {
                let (mine, _) = self.mine();
                mine.motion.places_mut().1.copy_from_slice(velocities);
                mine.motion.viscous_mut().copy_from_slice(viscous);
            } else {
                send_vectors(rank, velocities);
                send_vectors(rank, viscous);
            }
        }
    }
}
