//! `tools.csv`: the contact's forces on the tools over time, as a haptic device would be sent them.

use serde::{Deserialize, Serialize};

use super::series::Series;
use crate::output::{OutputError, OutputFolder};
use phyxel::World;

const HEADER: [&str; 15] = [
    "time_s",
    "scene_time_s",
    "tool",
    "x_m",
    "y_m",
    "z_m",
    "force_x_N",
    "force_y_N",
    "force_z_N",
    "torque_x_N_m",
    "torque_y_N_m",
    "torque_z_N_m",
    "penetration_m",
    "area_m2",
    "work_J",
];

/// Name of the file.
pub(super) const FILE: &str = "tools.csv";

/// The file in the making, and what was largest so far.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Forces {
    series: Series,
    largest: Vec<Largest>,
}

/// Largest force and penetration of one tool over all steps.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Largest {
    pub(super) force: f64,
    pub(super) penetration: f64,
}

impl Forces {
    /// For a scene with tools; a scene without any has no such file.
    pub(super) fn of(world: &World) -> Option<Self> {
        let tools = world.scene().tools.len();
        (tools > 0).then(|| Self {
            series: Series::new(&HEADER),
            largest: vec![Largest::default(); tools],
        })
    }

    /// Takes note of a step, and adds a row per tool if one is due at `rate` (1/s).
    pub(super) fn record(&mut self, world: &World, rate: f64) {
        let due = self.series.is_due(world.time(), rate);
        if due {
            self.series.done(world.time(), rate);
        }
        let tools = world.scene().tools.iter().zip(world.tool_forces());
        for ((tool, now), largest) in tools.zip(&mut self.largest) {
            largest.force = largest.force.max(now.force.length());
            largest.penetration = largest.penetration.max(now.penetration);
            if due {
                let vectors = [now.pose.position, now.force, now.torque];
                let mut numbers: Vec<f64> = vectors.iter().flat_map(|v| v.to_array()).collect();
                numbers.extend([now.penetration, now.area, now.work]);
                self.series.row(world, &tool.name, &numbers, &[]);
            }
        }
    }

    pub(super) fn write(&self, folder: &OutputFolder) -> Result<(), OutputError> {
        folder.write(FILE, self.series.text().as_bytes())
    }

    /// Per tool, in the scene's order.
    pub(super) fn largest(&self) -> &[Largest] {
        &self.largest
    }
}
