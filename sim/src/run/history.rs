//! `history.csv`: energies and extremes over time.

use std::io::Write;

use glam::DVec3;

use super::RunError;
use crate::output::{OutputFile, OutputFolder};
use crate::world::{Body, Cutting, World};

/// Extremes of one body over all records.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extremes {
    pub(super) momentum_error: f64,
    pub(super) smallest_determinant: f64,
    pub(super) largest_speed: f64,
}

impl Default for Extremes {
    fn default() -> Self {
        Self {
            momentum_error: 0.0,
            smallest_determinant: f64::INFINITY,
            largest_speed: 0.0,
        }
    }
}

/// The file in the making.
#[derive(Debug)]
pub(super) struct History {
    file: Option<OutputFile>,
    rate: f64,
    next: f64,
    worst: Vec<Extremes>,
}

const HEADER: &str = "time_s,scene_time_s,body,kinetic_J,elastic_J,external_work_J,dissipated_J,\
booked_J,balance_J,momentum_kg_m_s,momentum_error,smallest_determinant,largest_speed_m_s,\
severed_pairs\n";

impl History {
    pub(super) fn new(folder: &OutputFolder, rate: f64) -> Result<Self, RunError> {
        let mut file = folder.file("history.csv")?;
        file.write_all(HEADER.as_bytes())
            .map_err(|error| file.error(error))?;
        Ok(Self {
            file: Some(file),
            rate,
            next: 0.0,
            worst: Vec::new(),
        })
    }

    pub(super) fn is_due(&self, world: &World) -> bool {
        world.time() >= self.next / self.rate
    }

    /// Writes a row per body.
    pub(super) fn record(&mut self, world: &World) -> Result<(), RunError> {
        self.next = (world.time() * self.rate).floor() + 1.0;
        self.worst
            .resize(world.members().len(), Extremes::default());
        let mut rows = String::new();
        for (member, worst) in world.members().iter().zip(&mut self.worst) {
            let body = &member.body;
            let now = extremes(body);
            worst.momentum_error = worst.momentum_error.max(now.momentum_error);
            worst.smallest_determinant = worst.smallest_determinant.min(now.smallest_determinant);
            worst.largest_speed = worst.largest_speed.max(now.largest_speed);
            let audit = body.motion.audit();
            let scene_time = world.scene_time().map_or(String::new(), |t| t.to_string());
            let severed = member.cutting.as_ref().map_or(0, Cutting::severed_pairs);
            rows.push_str(&format!(
                "{},{scene_time},{},{:e},{:e},{:e},{:e},{:e},{:e},{:e},{:e},{},{:e},{severed}\n",
                world.time(),
                csv_field(&body.name),
                audit.kinetic,
                audit.elastic,
                audit.external_work(),
                audit.dissipated,
                audit.booked,
                audit.balance(),
                audit.momentum.length(),
                now.momentum_error,
                now.smallest_determinant,
                now.largest_speed,
            ));
        }
        if let Some(file) = &mut self.file {
            file.write_all(rows.as_bytes())
                .map_err(|error| file.error(error))?;
        }
        Ok(())
    }

    /// Completes the file; the extremes per body.
    pub(super) fn finish(&mut self) -> Result<Vec<Extremes>, RunError> {
        if let Some(file) = self.file.take() {
            file.finish()?;
        }
        Ok(std::mem::take(&mut self.worst))
    }
}

/// A field that may hold any text.
fn csv_field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

fn extremes(body: &Body) -> Extremes {
    let forces = &body.motion.state().forces;
    let total: DVec3 = forces.iter().sum();
    let size: f64 = forces.iter().map(|f| f.length()).sum();
    let gradients = body.elastic.deformation_gradients();
    let speeds = body.motion.velocities().iter();
    Extremes {
        momentum_error: if size > 0.0 {
            total.length() / size
        } else {
            0.0
        },
        smallest_determinant: gradients
            .iter()
            .map(glam::DMat3::determinant)
            .fold(f64::INFINITY, f64::min),
        largest_speed: speeds.map(|v| v.length()).fold(0.0, f64::max),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_commas_and_quotes_stay_one_field() {
        assert_eq!(csv_field("liver"), "liver");
        assert_eq!(csv_field("a,\"b\""), "\"a,\"\"b\"\"\"");
    }
}
