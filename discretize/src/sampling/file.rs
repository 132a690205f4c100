//! One call from a mesh file to nodes.

use std::path::Path;

use crate::mesh::Mesh;
use crate::mesh::error::RepairError;
use crate::mesh::read::{MeshFile, ReadError, read_mesh};
use crate::mesh::repair::{MeshReport, RepairSettings, repair};
use crate::sampling::error::SampleError;
use crate::sampling::settings::SampleSettings;
use crate::sampling::solid::Solid;
use crate::sampling::tetrahedra::{SampledNodes, sample_tetrahedra};

/// A mesh file, repaired and sampled.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SampledFile {
    /// What was read, scaled.
    pub file: MeshFile,
    /// What was found and done.
    pub mesh_report: MeshReport,
    /// The body.
    pub solid: Solid,
    /// Its nodes.
    pub sampling: SampledNodes,
}

/// Why [`sample_file`] failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// Reading.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// Repairing.
    #[error(transparent)]
    Repair(#[from] RepairError),
    /// Sampling.
    #[error(transparent)]
    Sample(#[from] SampleError),
}

/// Reads a mesh, multiplies its coordinates by `scale` (file unit to metre), repairs and samples it.
///
/// # Errors
/// [`FileError`]: the first stage that failed.
pub fn sample_file(
    path: impl AsRef<Path>,
    scale: f64,
    repair_settings: &RepairSettings,
    sample_settings: &SampleSettings,
) -> Result<SampledFile, FileError> {
    let mut file = read_mesh(path)?;
    file.mesh = Mesh::scaled(file.mesh, scale);
    let (mesh, mesh_report) = repair(&file.mesh, repair_settings)?;
    let solid = Solid::from_mesh(mesh);
    let sampling = sample_tetrahedra(&solid, sample_settings)?;
    Ok(SampledFile {
        file,
        mesh_report,
        solid,
        sampling,
    })
}
