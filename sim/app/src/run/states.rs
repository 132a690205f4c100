//! The bodies as ParaView reads them: nodes as VTK with stress, surfels as PLY, at the end and at a
//! rate.

use phyxel_discretize::{Field, SurfaceSamples, ply_surfels, vtk_points, vtk_tetrahedra};
use phyxel_elastic::von_mises_stress;
use serde::{Deserialize, Serialize};

use crate::output::{OutputError, OutputFolder};
use crate::picture::Painter;
use phyxel::{Body, World};

/// Name of the folder of periodic states.
const FOLDER: &str = "states";
/// What the names of last states begin with.
const LAST: &str = "final-";
/// Endings of the files.
const ENDINGS: [&str; 2] = [".vtk", ".ply"];

/// Removes the last states of an earlier run.
pub(super) fn remove_last(folder: &OutputFolder) -> Result<(), OutputError> {
    ENDINGS
        .iter()
        .try_for_each(|ending| folder.remove_named(LAST, ending, &[]))
}

/// Periodic states: how many are written, and which is due next.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct States {
    count: usize,
    /// Number, at the rate, of the one that is due next.
    next: f64,
}

impl States {
    /// Removes those of an earlier run, but for what this run has written before it was interrupted.
    pub(super) fn clear(&self, folder: &OutputFolder, world: &World) -> Result<(), OutputError> {
        let wanted = world.scene().observe.state_rate.is_some();
        if !wanted && !folder.path().join(FOLDER).exists() {
            return Ok(());
        }
        for suffix in ENDINGS {
            let kept: Vec<String> = bodies(world)
                .flat_map(|body| (0..self.count).map(|index| numbered(body, index)))
                .map(|name| format!("{name}{suffix}"))
                .collect();
            folder.fresh_subfolder(FOLDER, "", suffix, &kept)?;
        }
        Ok(())
    }

    /// Whether a state is due.
    pub(super) fn is_due(&self, world: &World) -> bool {
        let rate = world.scene().observe.state_rate;
        let due = rate.zip(world.scene_time());
        due.is_some_and(|(rate, time)| time >= self.next / rate)
    }

    /// Writes the state that is due, if one is. Surfels are where the bodies are only after
    /// [`Painter::carry`].
    pub(super) fn write_due(
        &mut self,
        folder: &OutputFolder,
        world: &World,
        painter: Option<&mut Painter>,
    ) -> Result<(), OutputError> {
        let (Some(rate), Some(time)) = (world.scene().observe.state_rate, world.scene_time())
        else {
            return Ok(());
        };
        if time < self.next / rate {
            return Ok(());
        }
        self.next = (time * rate).floor() + 1.0;
        let folder = OutputFolder::create(&folder.path().join(FOLDER))?;
        let index = self.count;
        write(&folder, world, painter, |body| numbered(body, index))?;
        self.count += 1;
        Ok(())
    }

    /// Writes the last state; the files' names.
    pub(super) fn write_last(
        &self,
        folder: &OutputFolder,
        world: &World,
        painter: Option<&mut Painter>,
    ) -> Result<Vec<String>, OutputError> {
        let name = |body: &Body| format!("{LAST}{}", file_name(&body.name));
        let mut names = write(folder, world, painter, name)?;
        if self.count > 0 {
            names.push(format!("{FOLDER}/ ({} of each body)", self.count));
        }
        Ok(names)
    }
}

fn bodies(world: &World) -> impl Iterator<Item = &Body> {
    world.members().iter().map(|member| &member.body)
}

fn numbered(body: &Body, index: usize) -> String {
    format!("{}-{index:05}", file_name(&body.name))
}

fn write(
    folder: &OutputFolder,
    world: &World,
    mut painter: Option<&mut Painter>,
    name: impl Fn(&Body) -> String,
) -> Result<Vec<String>, OutputError> {
    let mut names = Vec::new();
    if let Some(painter) = &mut painter {
        painter.carry(world);
    }
    for (index, body) in bodies(world).enumerate() {
        let mut keep = |name: String, content: &[u8]| {
            folder.write(&name, content)?;
            names.push(name);
            Ok(())
        };
        keep(format!("{}.vtk", name(body)), &vtk(body))?;
        if let Some(painter) = &painter {
            let (positions, normals, areas) = painter.surfels(index);
            let surfels = SurfaceSamples {
                positions: positions.to_vec(),
                normals: normals.to_vec(),
                areas: areas.to_vec(),
            };
            keep(format!("{}.ply", name(body)), &ply_surfels(&surfels))?;
        }
    }
    Ok(names)
}

fn vtk(body: &Body) -> Vec<u8> {
    let stress: Vec<f64> = (0..body.rest.len())
        .map(|node| von_mises_stress(body.elastic.cauchy_stress(node)))
        .collect();
    let fields = [
        ("rest_position_m", Field::Vectors(&body.rest)),
        ("velocity_m_s", Field::Vectors(body.motion.velocities())),
        ("volume_m3", Field::Scalars(&body.volumes)),
        ("von_mises_stress_Pa", Field::Scalars(&stress)),
    ];
    let positions = body.motion.positions();
    if body.tetrahedra.is_empty() {
        vtk_points(positions, &fields)
    } else {
        vtk_tetrahedra(positions, &body.tetrahedra, &fields)
    }
}

/// A body's name with what file systems refuse replaced.
fn file_name(name: &str) -> String {
    name.replace(|c: char| !(c.is_alphanumeric() || "-_.".contains(c)), "-")
}
