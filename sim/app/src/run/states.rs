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
/// What the name of a list of states with their times ends with.
const SERIES: &str = ".series";

/// Removes the last states of an earlier run.
pub(super) fn remove_last(folder: &OutputFolder) -> Result<(), OutputError> {
    ENDINGS
        .iter()
        .try_for_each(|ending| folder.remove_named(LAST, ending, &[]))
}

/// Periodic states: times of those that are written, and which is due next.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct States {
    /// Simulated times (s), after settling.
    times: Vec<f64>,
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
            let bodies = world.bodies().iter();
            let kept: Vec<String> = bodies
                .flat_map(|body| (0..self.times.len()).map(|index| numbered(body, index)))
                .map(|name| format!("{name}{suffix}"))
                .collect();
            folder.fresh_subfolder(FOLDER, "", suffix, &kept)?;
        }
        folder.fresh_subfolder(FOLDER, "", SERIES, &[])?;
        Ok(())
    }

    /// The rate (1/s) and the time (s) of a state, if one is due.
    fn due(&self, world: &World) -> Option<(f64, f64)> {
        let (rate, time) = (world.scene().observe.state_rate?, world.scene_time()?);
        (time >= self.next / rate).then_some((rate, time))
    }

    /// Writes the state that is due, if one is. Surfels are where the bodies are only after
    /// [`Painter::carry`].
    pub(super) fn write_due(
        &mut self,
        folder: &OutputFolder,
        world: &World,
        painter: Option<&mut Painter>,
    ) -> Result<(), OutputError> {
        let Some((rate, time)) = self.due(world) else {
            return Ok(());
        };
        self.next = (time * rate).floor() + 1.0;
        let folder = OutputFolder::create(&folder.path().join(FOLDER))?;
        let index = self.times.len();
        write(&folder, world, painter, |body| numbered(body, index))?;
        self.times.push(time);
        Ok(())
    }

    /// Writes the last state and the periodic ones' times; the files' names.
    pub(super) fn write_last(
        &self,
        folder: &OutputFolder,
        world: &World,
        painter: Option<&mut Painter>,
    ) -> Result<Vec<String>, OutputError> {
        let name = |body: &Body| format!("{LAST}{}", file_name(&body.name));
        let mut names = write(folder, world, painter, name)?;
        if !self.times.is_empty() {
            let folder = OutputFolder::create(&folder.path().join(FOLDER))?;
            for body in world.bodies() {
                let name = format!("{}.vtk{SERIES}", file_name(&body.name));
                folder.write(&name, self.series(body).as_bytes())?;
            }
            names.push(format!("{FOLDER}/ ({} of each body)", self.times.len()));
        }
        Ok(names)
    }

    /// Times of a body's states as ParaView reads them: its `.pvd` has no place for legacy VTK files.
    fn series(&self, body: &Body) -> String {
        let line = |(index, time)| {
            let name = numbered(body, index);
            format!("  {{\"name\": \"{name}.vtk\", \"time\": {time}}}")
        };
        let lines: Vec<String> = self.times.iter().enumerate().map(line).collect();
        let lines = lines.join(",\n");
        format!("{{\"file-series-version\": \"1.0\", \"files\": [\n{lines}\n]}}\n")
    }
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
    for (index, body) in world.bodies().iter().enumerate() {
        let mut keep = |name: String, content: &[u8]| {
            folder.write(&name, content)?;
            names.push(name);
            Ok(())
        };
        let pressures = world.contact_pressures(index);
        let state = vtk(body, pressures.as_deref());
        keep(format!("{}.vtk", name(body)), &state)?;
        if let Some(painter) = &painter {
            let skin = &painter.skins()[index];
            let (splats, surfels) = (skin.splats().iter(), skin.tissue.surfels().iter());
            let surfels = SurfaceSamples {
                positions: splats.clone().map(|splat| splat.position).collect(),
                normals: splats.map(|splat| splat.normal).collect(),
                areas: surfels.map(|surfel| surfel.area).collect(),
            };
            keep(format!("{}.ply", name(body)), &ply_surfels(&surfels))?;
        }
    }
    Ok(names)
}

fn vtk(body: &Body, pressures: Option<&[f64]>) -> Vec<u8> {
    let elastic = body.elastic();
    let stress: Vec<f64> = (0..body.rest.len())
        .map(|node| von_mises_stress(elastic.cauchy_stress(node)))
        .collect();
    let mut fields = vec![
        ("rest_position_m", Field::Vectors(&body.rest)),
        ("velocity_m_s", Field::Vectors(body.motion().velocities())),
        ("volume_m3", Field::Scalars(&body.volumes)),
        ("von_mises_stress_Pa", Field::Scalars(&stress)),
    ];
    if let Some(pressures) = pressures {
        fields.push(("contact_pressure_Pa", Field::Scalars(pressures)));
    }
    let positions = &body.smoothed_positions();
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
