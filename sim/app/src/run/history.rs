//! `history.csv`: energies and extremes over time.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::output::{OutputError, OutputFolder};
use crate::run::series::Series;
use phyxel::{Body, Cutting, World};

/// Extremes of one body over all records.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Extremes {
    pub(super) momentum_error: f64,
    pub(super) largest_speed: f64,
}

/// The file in the making.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct History {
    series: Series,
    worst: Vec<Extremes>,
}

const HEADER: &str = "time_s,scene_time_s,body,kinetic_J,elastic_J,external_work_J,dissipated_J,\
    energy_correction_J,balance_J,momentum_kg_m_s,momentum_error,smallest_determinant,\
    largest_speed_m_s,severed_pairs";

impl History {
    pub(super) fn new() -> Self {
        Self {
            series: Series::new(HEADER),
            worst: Vec::new(),
        }
    }

    /// Whether a row is due at `rate` rows a second (1/s).
    pub(super) fn is_due(&self, world: &World, rate: f64) -> bool {
        self.series.is_due(world.time(), rate)
    }

    /// Adds a row per body.
    pub(super) fn record(&mut self, world: &World, rate: f64) {
        self.series.done(world.time(), rate);
        self.worst
            .resize(world.members().len(), Extremes::default());
        for (member, worst) in world.members().iter().zip(&mut self.worst) {
            let body = &member.body;
            let now = extremes(body);
            worst.momentum_error = worst.momentum_error.max(now.momentum_error);
            worst.largest_speed = worst.largest_speed.max(now.largest_speed);
            let audit = body.motion.audit();
            let severed = member.cutting.as_ref().map_or(0, Cutting::severed_pairs);
            let numbers = [
                audit.kinetic,
                audit.elastic,
                audit.external_work(),
                audit.dissipated,
                audit.energy_correction,
                audit.energy_error(),
                audit.momentum.length(),
                now.momentum_error,
                body.smallest_volume_ratio(),
                now.largest_speed,
            ];
            self.series
                .row(world, &[&body.name], &numbers, &[severed.to_string()]);
        }
    }

    /// Writes the file.
    pub(super) fn write(&self, folder: &OutputFolder) -> Result<(), OutputError> {
        folder.write("history.csv", self.series.text().as_bytes())
    }

    /// The extremes per body.
    pub(super) fn worst(&self) -> &[Extremes] {
        &self.worst
    }
}

fn extremes(body: &Body) -> Extremes {
    let forces = &body.motion.state().forces;
    let total: DVec3 = forces.iter().sum();
    let size: f64 = forces.iter().map(|f| f.length()).sum();
    let speeds = body.motion.velocities().iter();
    Extremes {
        momentum_error: if size > 0.0 {
            total.length() / size
        } else {
            0.0
        },
        largest_speed: speeds.map(|v| v.length()).fold(0.0, f64::max),
    }
}
