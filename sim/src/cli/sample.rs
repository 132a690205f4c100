//! `phyxel sample`.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use phyxel_discretize::{FileError, RepairSettings, SampleSettings, Target, ply_mesh, sample_file};

use super::CliError;
use crate::output::OutputFolder;

/// Number of nodes where neither spacing nor number is given.
const DEFAULT_NODES: usize = 6_000;

#[derive(Debug, Args)]
pub(super) struct SampleArguments {
    /// Mesh file.
    mesh: PathBuf,
    /// Distance between nodes (m, after scaling).
    #[arg(long, value_name = "H", conflicts_with = "nodes")]
    spacing: Option<f64>,
    /// Number of nodes, met approximately [default: 6000]
    #[arg(long, value_name = "N")]
    nodes: Option<usize>,
    /// Metres per unit of the file.
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    scale: f64,
    /// File to write: .vtk for nodes and tetrahedra with volumes and boundary vectors, .ply for the
    /// surface of the tetrahedra [default: the mesh's name with .nodes.vtk, in this folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Show nothing but errors.
    #[arg(long)]
    quiet: bool,
}

/// A mesh that cannot be sampled as asked.
#[derive(Debug, thiserror::Error)]
pub(super) enum SampleProblem {
    #[error("--out {}: give the file the ending .vtk or .ply", file.display())]
    Ending { file: PathBuf },
    #[error("--scale {scale}: it must be finite and above 0 (metres per unit of the file)")]
    Scale { scale: f64 },
    #[error(transparent)]
    Read(FileError),
    #[error("{}: {problem}", file.display())]
    Mesh { file: PathBuf, problem: FileError },
}

/// Fills a mesh with nodes, writes them and reports their quality.
pub(super) fn sample(arguments: &SampleArguments) -> Result<(), CliError> {
    let mesh = &arguments.mesh;
    let out = arguments.out.clone().unwrap_or_else(|| {
        let stem = mesh.file_stem().unwrap_or(mesh.as_os_str());
        PathBuf::from(stem).with_extension("nodes.vtk")
    });
    let ending = out.extension().map(|text| text.to_ascii_lowercase());
    let surface_only = match ending.as_deref().and_then(|text| text.to_str()) {
        Some("vtk") => false,
        Some("ply") => true,
        _ => return Err(SampleProblem::Ending { file: out }.into()),
    };
    let scale = arguments.scale;
    if !(scale.is_finite() && scale > 0.0) {
        return Err(SampleProblem::Scale { scale }.into());
    }
    let settings = SampleSettings {
        target: match arguments.spacing {
            Some(spacing) => Target::Spacing(spacing),
            None => Target::NodeCount(arguments.nodes.unwrap_or(DEFAULT_NODES)),
        },
        ..SampleSettings::default()
    };
    let sampled =
        sample_file(mesh, scale, &RepairSettings::default(), &settings).map_err(|problem| {
            match problem {
                // The reader names the file itself.
                FileError::Read(_) => SampleProblem::Read(problem),
                problem => SampleProblem::Mesh {
                    file: mesh.clone(),
                    problem,
                },
            }
        })?;
    let content = if surface_only {
        ply_mesh(&sampled.sampling.surface().0)
    } else {
        sampled.sampling.to_vtk()
    };
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = OutputFolder::create(folder.unwrap_or(Path::new(".")))?;
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    folder.write(&name, &content)?;
    if !arguments.quiet {
        let mut terminal = io::stderr().lock();
        writeln!(terminal, "mesh: {}", sampled.mesh_report).map_err(CliError::Stderr)?;
        writeln!(terminal, "nodes: {}", sampled.sampling.report).map_err(CliError::Stderr)?;
        writeln!(terminal, "{}", out.display()).map_err(CliError::Stderr)?;
    }
    Ok(())
}
