//! `tools.csv`: the contact's forces on the tools over time, as a haptic device would be sent them; `contacts.csv`: those
//! of bodies on each other.

use serde::{Deserialize, Serialize};

use super::series::Series;
use crate::output::{OutputError, OutputFolder};
use phyxel::World;

const HEADER: &str = "time_s,scene_time_s,tool,x_m,y_m,z_m,force_x_N,force_y_N,force_z_N,\
    torque_x_N_m,torque_y_N_m,torque_z_N_m,penetration_m,area_m2,work_J";

const BETWEEN: &str = "time_s,scene_time_s,body,other,force_x_N,force_y_N,force_z_N,normal_N,\
    friction_N,area_m2,penetration_m";

/// Names of the files.
pub(super) const FILES: [&str; 2] = ["tools.csv", "contacts.csv"];

/// The files in the making, and what was largest so far.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Forces {
    tools: Option<Series>,
    between: Option<Series>,
    largest: Vec<Largest>,
}

/// Largest force and penetration of one tool over all steps.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Largest {
    pub(super) force: f64,
    pub(super) penetration: f64,
}

impl Forces {
    /// A scene without tools has no file of them, one without contact of bodies none of that.
    pub(super) fn of(world: &World) -> Self {
        let tools = world.scene().tools.len();
        Self {
            tools: (tools > 0).then(|| Series::new(HEADER)),
            between: (world.body_contact()).map(|_| Series::new(BETWEEN)),
            largest: vec![Largest::default(); tools],
        }
    }

    /// Takes note of a step, and adds a row per tool, and per two bodies that are near each other, if one is due at
    /// `rate` (1/s).
    pub(super) fn record(&mut self, world: &World, rate: f64) {
        let time = world.time();
        let forces = world.tool_forces();
        for (now, largest) in forces.iter().zip(&mut self.largest) {
            largest.force = largest.force.max(now.force.length());
            largest.penetration = largest.penetration.max(now.penetration);
        }
        if let Some(tools) = self.tools.as_mut().filter(|rows| rows.is_due(time, rate)) {
            tools.done(time, rate);
            for (tool, now) in world.scene().tools.iter().zip(&forces) {
                let vectors = [now.pose.position, now.force, now.torque];
                let mut numbers: Vec<f64> = vectors.iter().flat_map(|v| v.to_array()).collect();
                numbers.extend([now.penetration, now.area, now.work]);
                tools.row(world, &[&tool.name], &numbers, &[]);
            }
        }
        if let Some(rows) = self.between.as_mut().filter(|rows| rows.is_due(time, rate)) {
            rows.done(time, rate);
            let between = world.body_contact().map_or(&[][..], |(between, _)| between);
            for sum in between {
                let names = (sum.bodies).map(|body| &*world.members()[body as usize].body.name);
                let [x, y, z] = sum.force.to_array();
                let amounts = [sum.normal, sum.friction, sum.area, sum.penetration];
                rows.row(world, &names, &[&[x, y, z][..], &amounts].concat(), &[]);
            }
        }
    }

    /// Writes the files; their names.
    pub(super) fn write(&self, folder: &OutputFolder) -> Result<Vec<String>, OutputError> {
        let all = FILES.into_iter().zip([&self.tools, &self.between]);
        let all = all.filter_map(|(name, rows)| rows.as_ref().map(|rows| (name, rows)));
        all.map(|(name, rows)| {
            folder.write(name, rows.text().as_bytes())?;
            Ok(name.to_owned())
        })
        .collect()
    }

    /// Per tool, in the scene's order.
    pub(super) fn largest(&self) -> &[Largest] {
        &self.largest
    }
}
