//! What springs hold while their samples change: a cut gives flanks other rows, by which other gaps come.

use super::disks::Placed;
use super::press::{self, Pair};
use super::{DeformableContact, NEAR};
use glam::DVec3;

/// Halvings of an interval of offsets: to round-off.
const HALVINGS: u32 = 60;

impl DeformableContact {
    /// Energy (J) of each point's springs with an offset (m), and its least gap.
    fn energy(&self, point: u32, pairs: &[Pair], offset: f64) -> f64 {
        let spring = |pair: &Pair| pair.phi * pair.stiffness * (offset - pair.gap).max(0.0).powi(2);
        let area = self.disks.samples[point as usize].area;
        0.25 * area * pairs.iter().map(spring).sum::<f64>() / press::norm(pairs)
    }

    fn placed(&self, positions: &[DVec3]) -> Vec<Placed> {
        let place = |&sample: &u32| self.disks.place(sample as usize, positions);
        self.near.iter().map(place).collect()
    }

    /// Energy (J) of the springs of each point; none before the first step.
    pub(super) fn energies(&mut self, positions: &[DVec3]) -> Vec<f64> {
        if self.state.listed_at.is_empty() {
            return Vec::new();
        }
        self.update_lists(positions);
        let (placed, mut pairs) = (self.placed(positions), Vec::new());
        let mut energies = vec![0.0; self.disks.len()];
        for (point, range) in &self.points {
            self.find_pairs(*point, self.listed(range), &placed, NEAR, &mut pairs);
            energies[*point as usize] =
                self.energy(*point, &pairs, self.state.offsets[*point as usize]);
        }
        energies
    }

    /// Gives every known point the offset with which it has the energy that it had.
    pub(super) fn keep_energies(&mut self, positions: &[DVec3]) {
        self.update_lists(positions);
        let (placed, mut pairs) = (self.placed(positions), Vec::new());
        let stored = std::mem::take(&mut self.stored);
        let mut offsets = std::mem::take(&mut self.state.offsets);
        for (point, range) in &self.points {
            self.find_pairs(*point, self.listed(range), &placed, NEAR, &mut pairs);
            let offset = &mut offsets[*point as usize];
            let least = pairs
                .iter()
                .map(|pair| pair.gap)
                .fold(f64::INFINITY, f64::min);
            let kept = stored.get(*point as usize).copied().unwrap_or(0.0);
            if offset.is_nan() || pairs.is_empty() || (kept == 0.0 && *offset <= least) {
                continue;
            }
            let (mut low, mut high) = (least, least);
            if kept > 0.0 {
                let spacing = self.disks.samples[*point as usize].spacing;
                high += spacing;
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (low + high);
                    let less = self.energy(*point, &pairs, middle) < kept;
                    *(if less { &mut low } else { &mut high }) = middle;
                }
            }
            *offset = low;
        }
        self.state.offsets = offsets;
        let energies = self.energies(positions);
        let change = energies.iter().sum::<f64>() - stored.iter().sum::<f64>();
        self.state.offset_work += change;
    }
}
