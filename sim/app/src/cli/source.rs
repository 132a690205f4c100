//! What a scene argument names: an embedded scene, a scene file or a mesh.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use glam::DVec3;
use phyxel_discretize::{
    Primitive, ReadError, RepairError, RepairSettings, Solid, read_mesh, repair,
};

use phyxel_scene::{EMBEDDED, Override, Syntax, TextError, place_of, read_text};

use crate::picture::PictureError;
use crate::run::RunError;
use phyxel::scene::{Scene, UnitGuess};
use phyxel::{BodyProblem, WorldError};

use super::CliError;

/// Extensions of mesh files.
const MESH_EXTENSIONS: [&str; 6] = ["obj", "stl", "ply", "off", "vtk", "msh"];

/// An argument that names nothing that can be run.
#[derive(Debug, thiserror::Error)]
pub(super) enum SourceError {
    #[error(
        "{}: neither a scene (.ron, .json) nor a mesh ({})",
        file.display(),
        MESH_EXTENSIONS.map(|extension| format!(".{extension}")).join(", ")
    )]
    Extension { file: PathBuf },
    #[error(transparent)]
    Mesh(#[from] ReadError),
    #[error("{}: {problem}", file.display())]
    Solid { file: PathBuf, problem: RepairError },
}

/// What an argument names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Source {
    Embedded(String),
    File(PathBuf),
    Mesh(PathBuf),
}

impl Source {
    /// Understands `argument`; the first embedded scene where there is none.
    pub(super) fn of(argument: Option<&OsStr>) -> Result<Self, SourceError> {
        let Some(argument) = argument else {
            return Ok(Self::Embedded(EMBEDDED[0].name.to_owned()));
        };
        let path = Path::new(argument);
        let extension = path
            .extension()
            .map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("ron" | "json") => Ok(Self::File(path.to_owned())),
            Some(extension) if MESH_EXTENSIONS.contains(&extension) => {
                Ok(Self::Mesh(path.to_owned()))
            }
            None if !path.exists() && path.components().count() == 1 => {
                Ok(Self::Embedded(argument.to_string_lossy().into_owned()))
            }
            None if EMBEDDED.iter().any(|scene| argument == scene.name) => {
                Ok(Self::Embedded(argument.to_string_lossy().into_owned()))
            }
            _ => Err(SourceError::Extension {
                file: path.to_owned(),
            }),
        }
    }

    /// A failure with the position where what is at fault was written: a body or one of the scene's values.
    pub(super) fn locate(
        &self,
        scene: &Scene,
        overrides: &[Override],
        error: RunError,
    ) -> CliError {
        let key = |name: &String| {
            let index = scene.bodies.iter().position(|body| body.name == *name);
            format!("bodies[{}]", index.unwrap_or(0))
        };
        let path = match &error {
            RunError::World(WorldError::Scene { fault, .. }) => fault.path.clone(),
            RunError::World(WorldError::Body {
                body,
                problem: BodyProblem::Scene(fault),
            }) => format!("{}.{}", key(body), fault.path),
            RunError::World(WorldError::Body { body, .. })
            | RunError::Picture(PictureError::Body { body, .. }) => key(body),
            _ => return error.into(),
        };
        let (text, syntax, origin) = match self {
            Self::Embedded(name) => {
                let scene = EMBEDDED.iter().find(|scene| scene.name == name);
                let text = scene.map_or("", |scene| scene.text).to_owned();
                (text, Syntax::Ron, format!("scene '{name}'"))
            }
            Self::File(file) => {
                // It was read before; if it is gone now, its name is all there is to tell.
                let text = read_text(file).unwrap_or_default();
                (text, Syntax::of(file), file.display().to_string())
            }
            Self::Mesh(file) => {
                let origin = format!("default scene of {}", file.display());
                (String::new(), Syntax::Ron, origin)
            }
        };
        let place = place_of(&path, &text, syntax, &origin, overrides);
        match error {
            RunError::World(WorldError::Scene { fault, .. }) => TextError::At {
                place,
                problem: fault.to_string(),
                path,
            }
            .into(),
            error => CliError::At {
                place,
                error: Box::new(error.into()),
            },
        }
    }

    /// The scene, changed and validated, and what a person should know about how it was made.
    pub(super) fn scene(
        &self,
        overrides: &[Override],
    ) -> Result<(Scene, Option<String>), CliError> {
        match self {
            Self::Embedded(name) => Ok((phyxel_scene::embedded(name, overrides)?, None)),
            Self::File(file) => Ok((phyxel_scene::load(file, overrides)?, None)),
            Self::Mesh(file) => {
                let (scene, note) = mesh_scene(file, overrides)?;
                Ok((scene, Some(note)))
            }
        }
    }
}

/// The default scene of a mesh, and how its unit was understood.
fn mesh_scene(file: &Path, overrides: &[Override]) -> Result<(Scene, String), CliError> {
    // A change that fits no scene is told first, whatever the mesh is.
    let half_extents = DVec3::splat(0.1);
    let stand_in = Solid::from(Primitive::Box { half_extents });
    if let Err(wrong @ TextError::Override(_)) = phyxel_scene::for_mesh(file, &stand_in, overrides)
    {
        return Err(wrong.into());
    }
    let read = read_mesh(file).map_err(SourceError::from)?;
    let settings = RepairSettings {
        // The run looks for them itself.
        find_self_intersections: false,
        largest_hole: Override::number(overrides, "bodies[0].shape.largest_hole")
            .unwrap_or(RepairSettings::default().largest_hole),
        ..RepairSettings::default()
    };
    let (mesh, _) = repair(&read.mesh, &settings).map_err(|problem| SourceError::Solid {
        file: file.to_owned(),
        problem,
    })?;
    let (scene, unit) = phyxel_scene::for_mesh(file, &Solid::from_mesh(mesh), overrides)?;
    let note = match unit {
        UnitGuess::Metres => format!("{}: taken to be in metres", file.display()),
        UnitGuess::Millimetres => format!(
            "{}: taken to be in millimetres; to change it: --set 'bodies[0].shape.scale=..'",
            file.display()
        ),
        UnitGuess::Scaled { scale, longest } => format!(
            "{}: {:.4} units long, which no organ is in metres: scaled by {scale:.4e} to {longest} m; \
             to change it: --set 'bodies[0].shape.scale=..'",
            file.display(),
            longest / scale
        ),
    };
    Ok((scene, note))
}
