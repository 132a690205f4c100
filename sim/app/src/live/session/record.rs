//! What is kept of a session: forces, paths, and the score sheet.

use glam::DVec3;
use phyxel_live::ForceSample;

use crate::run::csv_row;

/// Simulated time (s) between two samples of a force: what haptic devices are fed with.
const SAMPLE: f64 = 1e-3;

/// Ways and largest forces of a session.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::live) struct Score {
    /// Path length (m) of the blade's middle, of tools that touch, of the grip.
    pub(in crate::live) path: [f64; 3],
    /// Largest force (N) on a tool and on the grip.
    pub(in crate::live) peak: [f64; 2],
    /// Simulated time (s) in which a blade cut, a tool touched, a hand gripped.
    pub(in crate::live) time: [f64; 3],
}

/// Samples that were not sent yet: of each tool, then of the grip.
#[derive(Debug, Clone, Default)]
pub(in crate::live) struct Forces {
    samples: Vec<Vec<ForceSample>>,
    next: f64,
}

impl Forces {
    /// Takes a sample at a simulated time (s) if one is due: forces (N) and penetrations (m) of the tools and of the grip.
    pub(super) fn take(&mut self, time: f64, forces: &[(DVec3, f64)]) {
        self.samples.resize_with(forces.len(), Vec::new);
        if time < self.next {
            return;
        }
        // Steps longer than the interval give one sample each.
        self.next = (self.next + SAMPLE).max(time);
        for (samples, &(force, penetration)) in self.samples.iter_mut().zip(forces) {
            // Ten simulated seconds that nobody fetched: the oldest are let go.
            if samples.len() == 10_000 {
                samples.clear();
            }
            samples.push(ForceSample {
                time,
                force,
                penetration,
            });
        }
    }

    /// Hands the samples out: those of each tool, then the grip's.
    pub(in crate::live) fn drain(&mut self) -> Vec<Vec<ForceSample>> {
        self.samples.iter_mut().map(std::mem::take).collect()
    }

    /// Time (s) continues from here; what was not handed out is lost.
    pub(super) fn restart(&mut self, time: f64) {
        self.next = time;
        self.samples.clear();
    }
}

impl Score {
    /// The sheet as CSV, with `rows` before its own.
    pub(super) fn csv(&self, rows: &[(&str, String)]) -> String {
        let own = [
            ("blade_path_m", self.path[0]),
            ("blade_time_s", self.time[0]),
            ("tool_path_m", self.path[1]),
            ("tool_time_s", self.time[1]),
            ("tool_peak_force_n", self.peak[0]),
            ("grip_path_m", self.path[2]),
            ("grip_time_s", self.time[2]),
            ("grip_peak_force_n", self.peak[1]),
        ];
        let own = own.map(|(name, value)| csv_row(&[name, &format!("{value:.6}")]));
        let rows = rows.iter().map(|(name, value)| csv_row(&[name, &**value]));
        let header = csv_row(&["quantity", "value"]);
        std::iter::once(header).chain(rows).chain(own).collect()
    }
}
