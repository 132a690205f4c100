//! What is kept of a session: forces, paths, and the score sheet.

use std::path::Path;

use glam::DVec3;
use phyxel::Input;
use phyxel::scene::Scene;
use phyxel_live::ForceSample;

use super::SAVED;
use crate::output::read_input;

use crate::run::csv_row;

/// Simulated time (s) between two samples of a force: what haptic devices are fed with.
const SAMPLE: f64 = 1e-3;

/// What a saved session did.
#[derive(Debug, Default)]
pub(in crate::live) struct Recording {
    pub(super) inputs: Vec<Input>,
    /// Steps and simulated time (s) at its end.
    pub(super) steps: u64,
    pub(super) time: f64,
}

impl Recording {
    /// Reads what was saved in a folder, and its scene; the words of a failure are for people.
    pub(in crate::live) fn read(folder: &Path) -> Result<(Scene, Self), String> {
        let [scene, input, _, score] = SAVED.map(|name| folder.join(name));
        let scene = phyxel_scene::load(scene, &[]).map_err(|error| error.to_string())?;
        let inputs = read_input(&input, &scene).map_err(|error| error.to_string())?;
        let score = phyxel_scene::read_text(&score).map_err(|error| error.to_string())?;
        let figure = |name: &str| {
            let mut rows = score.lines().filter_map(|line| line.split_once(','));
            let value = rows.find_map(|(key, value)| (key == name).then_some(value));
            value.ok_or(format!("{} does not say {name}", SAVED[3]))
        };
        let unread = || format!("{} is no score sheet", SAVED[3]);
        let steps = figure("steps")?.parse().map_err(|_| unread())?;
        let time = figure("simulated_time_s")?.parse().map_err(|_| unread())?;
        Ok((
            scene,
            Self {
                inputs,
                steps,
                time,
            },
        ))
    }
}

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
