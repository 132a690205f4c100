//! What is written down over time: `history.csv` has energies and extremes of bodies; `tools.csv` the contact's forces on the
//! tools, as a haptic device would be sent them; `contacts.csv` those of bodies on each other.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::series::Series;
use super::states::States;
use crate::output::{OutputError, OutputFolder, input_csv};
use phyxel::{Body, Cutting, World};

const HISTORY: &str = "time_s,scene_time_s,body,kinetic_J,elastic_J,external_work_J,dissipated_J,\
    energy_correction_J,balance_J,momentum_kg_m_s,momentum_error,smallest_determinant,\
    largest_speed_m_s,severed_pairs";

const TOOLS: &str = "time_s,scene_time_s,tool,x_m,y_m,z_m,force_x_N,force_y_N,force_z_N,\
    torque_x_N_m,torque_y_N_m,torque_z_N_m,penetration_m,area_m2,work_J";

const BETWEEN: &str = "time_s,scene_time_s,body,other,force_x_N,force_y_N,force_z_N,normal_N,\
    friction_N,area_m2,penetration_m";

/// Names of the files.
pub(super) const FILES: [&str; 3] = ["history.csv", "tools.csv", "contacts.csv"];

/// The files in the making, and what was largest so far.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Records {
    history: Series,
    /// Per body.
    pub(super) worst: Vec<Extremes>,
    tools: Option<Series>,
    between: Option<Series>,
    /// Per tool, in the scene's order.
    pub(super) largest: Vec<Largest>,
    pub(super) states: States,
}

/// Extremes of one body over all rows of the history.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Extremes {
    pub(super) momentum_error: f64,
    pub(super) largest_speed: f64,
}

/// Largest force and penetration of one tool over all steps.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Largest {
    pub(super) force: f64,
    pub(super) penetration: f64,
}

impl Records {
    /// A scene without tools has no file of them, one without contact of bodies none of that.
    pub(super) fn new(world: &World) -> Self {
        let tools = world.scene().tools.len();
        Self {
            history: Series::new(HISTORY),
            worst: Vec::new(),
            tools: (tools > 0).then(|| Series::new(TOOLS)),
            between: (world.body_contact()).map(|_| Series::new(BETWEEN)),
            largest: vec![Largest::default(); tools],
            states: States::default(),
        }
    }

    /// Whether a row of the history is due.
    fn is_due(&self, world: &World) -> bool {
        let rate = world.scene().observe.history_rate;
        self.history.is_due(world.time(), rate)
    }

    /// Takes note of a step and adds the rows that are due; one of the history in any case at the `end`.
    pub(super) fn take(&mut self, world: &World, end: bool) {
        if end || self.is_due(world) {
            self.add_history(world);
        }
        let (time, rate) = (world.time(), world.scene().observe.force_rate);
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
                let names = (sum.bodies).map(|body| &*world.bodies()[body as usize].name);
                let [x, y, z] = sum.force.to_array();
                let amounts = [sum.normal, sum.friction, sum.area, sum.penetration];
                rows.row(world, &names, &[&[x, y, z][..], &amounts].concat(), &[]);
            }
        }
    }

    /// Adds a row per body.
    fn add_history(&mut self, world: &World) {
        let rate = world.scene().observe.history_rate;
        self.history.done(world.time(), rate);
        self.worst.resize(world.bodies().len(), Extremes::default());
        for (body, worst) in world.bodies().iter().zip(&mut self.worst) {
            let now = extremes(body);
            worst.momentum_error = worst.momentum_error.max(now.momentum_error);
            worst.largest_speed = worst.largest_speed.max(now.largest_speed);
            let audit = body.motion().audit();
            let severed = body.cutting.as_ref().map_or(0, Cutting::severed_pairs);
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
            self.history
                .row(world, &[&body.name], &numbers, &[severed.to_string()]);
        }
    }

    /// Writes the files; their names.
    pub(super) fn write(
        &self,
        folder: &OutputFolder,
        world: &World,
    ) -> Result<Vec<String>, OutputError> {
        let mut names = Vec::new();
        let (tools, between) = (self.tools.as_ref(), self.between.as_ref());
        let all = [Some(&self.history), tools, between];
        for (name, rows) in FILES.into_iter().zip(all) {
            if let Some(rows) = rows {
                folder.write(name, rows.text().as_bytes())?;
                names.push(name.to_owned());
            }
        }
        if let Some(inputs) = world.record() {
            folder.write("input.csv", &input_csv(world.scene(), inputs))?;
            names.push("input.csv".to_owned());
        }
        Ok(names)
    }
}

fn extremes(body: &Body) -> Extremes {
    let forces = &body.motion().state().forces;
    let total: DVec3 = forces.iter().sum();
    let size: f64 = forces.iter().map(|f| f.length()).sum();
    let speeds = body.motion().velocities().iter();
    Extremes {
        momentum_error: if size > 0.0 {
            total.length() / size
        } else {
            0.0
        },
        largest_speed: speeds.map(|v| v.length()).fold(0.0, f64::max),
    }
}
