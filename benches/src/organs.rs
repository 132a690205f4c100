//! Real organ meshes in the default scene.

use std::path::{Path, PathBuf};

use glam::DVec3;
use phyxel::scene::{Region, Scene, Shape, Target};
use phyxel_discretize::{Bounds, Placement, RepairSettings, Solid, read_mesh, repair};

use crate::batch::Case;
use crate::error::{StudyError, of_file};
use crate::matrix::as_usual;
use crate::row::Bars;

/// Extensions of mesh files.
const EXTENSIONS: [&str; 6] = ["obj", "stl", "ply", "off", "vtk", "msh"];
/// Meshes that are also run ten times smaller and larger.
const SCALED: [&str; 3] = ["liver-smooth.obj", "gallbladder_visual.stl", "liver2.msh"];
/// Node count beside the default.
const FEW: u32 = 600;

/// What a mesh in its default scene must hold: it ends well.
pub const BARS: Bars = Bars {
    shrink: f64::INFINITY,
    farthest: f64::INFINITY,
    followers: 1.0,
    ..Bars::ordinary()
};

/// The folder that the environment variable `PHYXEL_MESHES` names.
pub fn folder() -> Option<PathBuf> {
    std::env::var_os("PHYXEL_MESHES").map(PathBuf::from)
}

/// Every mesh of `folder` in its default scene, with the default number of nodes and with 600; three of
/// them also ten times smaller and larger. Nothing of a scene's own against the defaults: control of
/// hourglass stabilization and damping are those of a body of which nothing is said.
pub fn cases(folder: &Path) -> Result<Vec<Case>, StudyError> {
    let mut cases = Vec::new();
    for file in meshes(folder)? {
        let name = file.file_name().unwrap_or_default();
        let name = name.to_string_lossy().into_owned();
        let scene = default_scene(&file)?;
        let mut add = |what: &str, scene: Scene| {
            for few in [false, true] {
                let (mut scene, nodes) = (scene.clone(), if few { "600" } else { "6000" });
                if few {
                    scene.bodies[0].sampling.target = Target::Nodes(FEW);
                }
                let name = format!("{name}{what} {nodes} nodes");
                cases.push(Case { name, scene });
            }
        };
        if SCALED.contains(&&*name) {
            add(" x0.1", scaled(scene.clone(), 0.1));
            add(" x10", scaled(scene.clone(), 10.0));
        }
        add("", scene);
    }
    Ok(cases)
}

pub(crate) fn meshes(folder: &Path) -> Result<Vec<PathBuf>, StudyError> {
    let error = of_file(folder);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(&error)? {
        let path = entry.map_err(&error)?.path();
        let extension = path.extension().unwrap_or_default();
        if EXTENSIONS.contains(&&*extension.to_string_lossy()) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// The shape of a mesh as a scene has it, and its box (m).
pub(crate) fn tissue(file: &Path) -> Result<(Shape, Bounds), StudyError> {
    let shape = default_scene(file)?.bodies.remove(0).shape;
    let solid = shape.solid(&Placement::IDENTITY);
    let (solid, _) = solid.map_err(of_file(file))?;
    Ok((shape, solid.bounds()))
}

fn default_scene(file: &Path) -> Result<Scene, StudyError> {
    let read = read_mesh(file).map_err(of_file(file))?;
    let settings = RepairSettings {
        find_self_intersections: false,
        ..RepairSettings::default()
    };
    let (repaired, _) = repair(&read.mesh, &settings).map_err(of_file(file))?;
    let (mut scene, _) = phyxel_scene::for_mesh(file, &Solid::from_mesh(repaired), &[])?;
    as_usual(&mut scene);
    Ok(scene)
}

/// The scene with all its lengths `by` times as large, and its times as they were.
fn scaled(mut scene: Scene, by: f64) -> Scene {
    for body in &mut scene.bodies {
        if let Shape::Mesh { scale, .. } = &mut body.shape {
            *scale *= by;
        }
    }
    let larger = |v: &mut DVec3| *v *= by;
    for support in &mut scene.supports {
        match &mut support.region {
            Region::HalfSpace { point, .. } => larger(point),
            Region::Box { min, max } => {
                larger(min);
                larger(max);
            }
            Region::Sphere { center, radius } => {
                larger(center);
                *radius *= by;
            }
        }
    }
    for cut in &mut scene.cuts {
        cut.edge.iter_mut().for_each(larger);
        let keys = cut.path.iter_mut();
        keys.for_each(|key| larger(&mut key.position));
    }
    scene
}
