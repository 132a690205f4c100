//! `phyxel sample`.

use std::path::{Path, PathBuf};

use clap::Args;
use glam::DVec3;
use phyxel_discretize::{
    Axis, Grading, Placement, Refinement, RepairSettings, SampleError, SampleSettings,
    SampleTarget, Shape, SolidError, ply_mesh, sample_points, sample_tetrahedra,
};

use super::{CliError, say};
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
    /// Largest distance between nodes inside over that at the surface, 1 to 32.
    #[arg(long, value_name = "C", default_value_t = 1.0)]
    coarsest: f64,
    /// A ball with smaller distances between nodes: middle and radius (m, after scaling) and the
    /// factor of the distance, 1/32 to 1. May be given several times.
    #[arg(long, value_name = "X,Y,Z,R,F", value_parser = ball, allow_hyphen_values = true)]
    refine: Vec<Refinement>,
    /// Nodes without tetrahedra: cell centres of a lattice, or of an octree with --coarsest or
    /// --refine, and points of the surface.
    #[arg(long)]
    points: bool,
    /// Holes up to this perimeter, as a fraction of the diagonal of the mesh's box, are closed.
    #[arg(long, value_name = "SHARE", default_value_t = RepairSettings::default().largest_hole)]
    largest_hole: f64,
    /// File to write: .vtk for nodes and tetrahedra with volumes and boundary vectors, .ply for the
    /// surface of the tetrahedra [default: the mesh's name with .nodes.vtk, in this folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Show nothing but errors.
    #[arg(long)]
    quiet: bool,
}

/// A refined ball from the command line.
fn ball(text: &str) -> Result<Refinement, String> {
    let number = |word: &str| {
        let number = word.trim().parse();
        number.map_err(|_| format!("`{word}` is not a number"))
    };
    let numbers: Vec<f64> = text.split(',').map(number).collect::<Result<_, _>>()?;
    let &[x, y, z, radius, factor] = numbers.as_slice() else {
        return Err(format!("five numbers are needed, found {}", numbers.len()));
    };
    let center = DVec3::new(x, y, z);
    Ok(Refinement {
        from: center,
        to: center,
        radius,
        factor,
    })
}

/// A mesh that cannot be sampled as asked.
#[derive(Debug, thiserror::Error)]
pub(super) enum SampleProblem {
    #[error("--out {}: give the file the ending .vtk or .ply", file.display())]
    Ending { file: PathBuf },
    #[error("--points writes no surface: give --out the ending .vtk")]
    NoSurface,
    #[error("--scale {scale}: it must be finite and above 0 (metres per unit of the file)")]
    Scale { scale: f64 },
    #[error(transparent)]
    Mesh(SolidError),
    #[error("{}: {problem}", file.display())]
    Nodes { file: PathBuf, problem: SampleError },
}

/// Fills a mesh with nodes, writes them and reports their quality.
pub(super) fn sample(arguments: &SampleArguments) -> Result<(), CliError> {
    let mesh = &arguments.mesh;
    let out = arguments.out.clone().unwrap_or_else(|| {
        let stem = mesh.file_stem().unwrap_or(mesh.as_os_str());
        PathBuf::from(stem).with_extension("nodes.vtk")
    });
    let (content, reports) = sampled(arguments, &out)?;
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = OutputFolder::create(folder.unwrap_or(Path::new(".")))?;
    let name = out.file_name().unwrap_or_default();
    folder.write(name, &content)?;
    if !arguments.quiet {
        say(&format!("{reports}{}", out.display()))?;
    }
    Ok(())
}

/// What a file of nodes holds, and lines on the quality of the mesh and of the nodes.
fn sampled(arguments: &SampleArguments, out: &Path) -> Result<(Vec<u8>, String), SampleProblem> {
    let ending = out.extension().map(|text| text.to_ascii_lowercase());
    let surface_only = match ending.as_deref().and_then(|text| text.to_str()) {
        Some("vtk") => false,
        Some("ply") => true,
        _ => return Err(SampleProblem::Ending { file: out.into() }),
    };
    let (file, scale) = (arguments.mesh.clone(), arguments.scale);
    if !(scale.is_finite() && scale > 0.0) {
        return Err(SampleProblem::Scale { scale });
    }
    let settings = SampleSettings {
        target: match arguments.spacing {
            Some(spacing) => SampleTarget::Spacing(spacing),
            None => SampleTarget::NodeCount(arguments.nodes.unwrap_or(DEFAULT_NODES)),
        },
        grading: Grading {
            coarsest: arguments.coarsest,
            refinements: arguments.refine.clone(),
            ..Grading::default()
        },
        ..SampleSettings::default()
    };
    if arguments.points && surface_only {
        return Err(SampleProblem::NoSurface);
    }
    let shape = Shape::Mesh {
        file: file.clone(),
        scale,
        up: Axis::Z,
        largest_hole: arguments.largest_hole,
    };
    let solid = shape.solid(&Placement::IDENTITY);
    let (solid, mesh) = solid.map_err(SampleProblem::Mesh)?;
    let sampled = if arguments.points {
        let nodes = sample_points(&solid, &settings, true);
        nodes.map(|nodes| (nodes.to_vtk(), nodes.report.to_string()))
    } else {
        sample_tetrahedra(&solid, &settings).map(|nodes| {
            let surface = surface_only.then(|| ply_mesh(&nodes.surface().0));
            let content = surface.unwrap_or_else(|| nodes.to_vtk());
            (content, nodes.report.to_string())
        })
    };
    let (content, nodes) = sampled.map_err(|problem| SampleProblem::Nodes { file, problem })?;
    let mesh = mesh.map_or(String::new(), |report| format!("mesh: {report}\n"));
    Ok((content, format!("{mesh}nodes: {nodes}\n")))
}
