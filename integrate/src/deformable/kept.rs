//! What springs hold while their samples change: a cut gives flanks other rows, by which other gaps come.

use super::DeformableContact;
use glam::DVec3;

/// Halvings of an interval of offsets: to round-off.
const HALVINGS: u32 = 60;

impl DeformableContact {
    /// Energy (J) of the springs of each point; none before the first step.
    pub(super) fn energies(&mut self, positions: &[DVec3]) -> Vec<f64> {
        if self.state.listed_at.is_empty() {
            return Vec::new();
        }
        self.update_lists(positions);
        let mut energies = vec![0.0; self.disks.len()];
        let placed = self.place(positions);
        self.each_point(&placed, |point, pairs| {
            [energies[point], _] = self.springs(point, pairs, self.state.offsets[point]);
        });
        energies
    }

    /// Gives every known point the offset with which it has the energy that it had.
    pub(super) fn keep_energies(&mut self, positions: &[DVec3]) {
        self.update_lists(positions);
        let stored = std::mem::take(&mut self.stored);
        let mut offsets = std::mem::take(&mut self.state.offsets);
        let mut now = 0.0;
        let placed = self.place(positions);
        self.each_point(&placed, |point, pairs| {
            let gaps = pairs.iter().map(|pair| pair.gap);
            let least = gaps.fold(f64::INFINITY, f64::min);
            let kept = stored.get(point).copied().unwrap_or(0.0);
            let offset = &mut offsets[point];
            if offset.is_nan() || pairs.is_empty() || (kept == 0.0 && *offset <= least) {
                return;
            }
            let (mut low, mut high) = (least, least);
            if kept > 0.0 {
                high += self.disks.samples[point].spacing;
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (low + high);
                    let less = self.springs(point, pairs, middle)[0] < kept;
                    *(if less { &mut low } else { &mut high }) = middle;
                }
            }
            *offset = low;
            now += self.springs(point, pairs, low)[0];
        });
        self.state.offsets = offsets;
        self.state.offset_work += now - stored.iter().sum::<f64>();
    }
}
