//! What bodies do to each other in a step: sums of forces, and pressures at nodes.

use super::DeformableContact;
use glam::DVec3;

/// Sum over the points at which two bodies, or a body and itself, meet in one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct DeformableForce {
    /// The bodies, ascending.
    pub bodies: [u32; 2],
    /// Force (N) of the second body on the first, drag included; 0 of a body on itself.
    pub force: DVec3,
    /// Sum of the normal forces' amounts (N).
    pub normal: f64,
    /// Sum of the frictional forces' amounts (N).
    pub friction: f64,
    /// Area (m²) under pressure, at rest.
    pub area: f64,
    /// Depth (m) of the deepest point: the mean of its pairs, weighted as its force. A point beside a rim counts as it
    /// is pressed.
    pub penetration: f64,
}

impl DeformableContact {
    /// Sums of the last step for bodies that are near each other, ascending; none before the first step.
    #[must_use]
    pub fn between(&self) -> &[DeformableForce] {
        &self.between
    }

    /// Contact pressure (Pa) at nodes of given positions (m), with the offsets of the last step: the mean of the samples
    /// that a node is one of, by their areas and weights' amounts; 0 where nothing presses.
    ///
    /// # Panics
    /// If there are fewer positions than the samples' nodes require.
    #[must_use]
    pub fn pressures(&self, positions: &[DVec3]) -> Vec<f64> {
        let mut pressures = vec![0.0; self.disks.len()];
        self.each_point(&self.place(positions), |point, pairs| {
            let [_, force] = self.springs(point, pairs, self.state.offsets[point]);
            pressures[point] = force / (0.5 * self.disks.samples[point].area);
        });
        let (mut forces, mut areas) = (vec![0.0; positions.len()], vec![0.0; positions.len()]);
        for (sample, pressure) in pressures.into_iter().enumerate() {
            for entry in self.disks.row(sample) {
                let node = self.disks.nodes[entry] as usize;
                let area = self.disks.samples[sample].area * self.disks.weights[entry].abs();
                forces[node] += area * pressure;
                areas[node] += area;
            }
        }
        let mean = |(force, area): (&f64, &f64)| if *area > 0.0 { force / area } else { 0.0 };
        forces.iter().zip(&areas).map(mean).collect()
    }
}

/// The sum of two bodies in a list.
pub(super) fn sum_of(list: &mut Vec<DeformableForce>, [a, b]: [u32; 2]) -> &mut DeformableForce {
    let bodies = [a.min(b), a.max(b)];
    let found = list.iter().rposition(|sum| sum.bodies == bodies);
    let at = found.unwrap_or_else(|| {
        list.push(DeformableForce {
            bodies,
            ..DeformableForce::default()
        });
        list.len() - 1
    });
    &mut list[at]
}

impl DeformableForce {
    /// Adds a force (N) of the second of two bodies on the first.
    pub(super) fn push(&mut self, [own, other]: [u32; 2], force: DVec3) {
        if own != other {
            self.force += if own < other { force } else { -force };
        }
    }
}
