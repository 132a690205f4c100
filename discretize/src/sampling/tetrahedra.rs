//! From a solid to nodes, volumes, boundary vectors and tetrahedra.

use std::fmt;

use glam::DVec3;

use crate::mesh::{
    Field, Mesh, boundary_triangles, fit_boundary, index, nodal_boundary_vectors, nodal_volumes,
    tetrahedra_edges, vtk_tetrahedra,
};
use crate::sampling::{
    Filler, Frame, Grading, MEAN_EDGE, NodeOrder, SampleError, SampleSettings, SampleTarget, Solid,
    Stuffed, TetrahedraQuality, add_slivers, check_parts, layered_order, missed_share,
    space_filling_order, tetrahedra_quality,
};

/// Nodes from which on they are ordered in layers. Forces of `phyxel-elastic` on jittered blocks, one thread, f64,
/// take 1.04 times less so than along a curve at 5,832 nodes, where what is read is in a cache anyway and searches
/// want runs of nodes in a small box, and 1.4 times less at 68,921.
const LAYERED_FROM: usize = 20_000;

/// Nodes with everything a simulation starts from, ordered for reading neighbours: along a space-filling curve, or in
/// layers from 20,000 nodes on.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SampledNodes {
    /// Rest positions (m), shape `(n)`.
    pub positions: Vec<DVec3>,
    /// Nodal volumes (m³), positive, sum = [`SamplingReport::volume`].
    pub volumes: Vec<f64>,
    /// Nodal boundary vectors (m²), outward, sum 0, zero inside.
    pub boundary_vectors: Vec<DVec3>,
    /// Tetrahedra of positive volume.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Boundary of the tetrahedra, counter-clockwise from outside.
    pub surface_triangles: Vec<[u32; 3]>,
    /// Mean edge (m).
    pub spacing: f64,
    /// What came out.
    pub report: SamplingReport,
}

/// What a sampling is like, and what it lost.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SamplingReport {
    /// Nodes.
    pub nodes: usize,
    /// Nodes on the surface.
    pub surface_nodes: usize,
    /// Tetrahedra.
    pub tetrahedra: usize,
    /// Shape and size of the tetrahedra.
    pub quality: TetrahedraQuality,
    /// What the nodal volumes sum to (m³): the mesh's volume but for large lost parts, or that of the tetrahedra.
    pub volume: f64,
    /// `(volume - V) / V` against the body's volume V ([`Solid::volume`]); `None` where a function alone gives the body.
    pub volume_error: Option<f64>,
    /// The same of the tetrahedra's own volume: how far they are from the body.
    pub tetrahedra_error: Option<f64>,
    /// Area of the tetrahedra's boundary (m²).
    pub area: f64,
    /// Pieces of the tetrahedra, each joined through shared nodes.
    pub pieces: usize,
    /// Closed parts of the input surface; 0 for implicit bodies.
    pub input_parts: usize,
    /// Parts of the input (cavities) that no lattice edge met: too small for the spacing.
    pub lost_cavities: usize,
    /// Fraction of the input's vertices farther than one spacing from every surface node: thin parts
    /// that were cut off. 0 for implicit bodies.
    pub missed: f64,
}

impl fmt::Display for SamplingReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let q = &self.quality;
        writeln!(
            f,
            "{} nodes ({} on the surface), {} tetrahedra in {} piece(s)",
            self.nodes, self.surface_nodes, self.tetrahedra, self.pieces
        )?;
        write!(f, "volume {:.6e}", self.volume)?;
        if let Some(error) = self.volume_error {
            write!(f, " ({:+.3} % against the body's", 100.0 * error)?;
            let own = 100.0 * self.tetrahedra_error.unwrap_or_default();
            write!(f, ", its tetrahedra's {own:+.3} %)")?;
        }
        writeln!(f, ", area {:.6e}", self.area)?;
        writeln!(
            f,
            "edges {:.4e} to {:.4e}, mean {:.4e}; smallest height {:.4e}",
            q.shortest_edge, q.longest_edge, q.mean_edge, q.smallest_height
        )?;
        write!(
            f,
            "dihedral angles {:.1} to {:.1} degrees, {} inverted",
            q.smallest_dihedral, q.largest_dihedral, q.inverted
        )?;
        write!(
            f,
            "\nsmallest nodal volume {:.3} of the mean; explicit step {:.3} mean edges over the wave speed",
            q.smallest_volume,
            3.0 * q.smallest_step / q.mean_edge
        )?;
        let filled = self.lost_cavities;
        if filled > 0 {
            write!(
                f,
                "\n{filled} cavity(ies) smaller than the spacing are filled"
            )?;
        }
        if self.missed > 0.0 {
            write!(
                f,
                "\n{:.2} % of the input's vertices are farther than one spacing from the sampled \
                 surface: places thinner than the spacing are cut off",
                100.0 * self.missed
            )?;
        }
        Ok(())
    }
}

impl SampledNodes {
    /// Nodes and tetrahedra with volumes and boundary vectors as binary legacy VTK.
    #[must_use]
    pub fn to_vtk(&self) -> Vec<u8> {
        let fields = [
            ("volume", Field::Scalars(&self.volumes)),
            ("boundary_vector", Field::Vectors(&self.boundary_vectors)),
        ];
        vtk_tetrahedra(&self.positions, &self.tetrahedra, &fields)
    }

    /// The boundary of the tetrahedra as a mesh, and the node of each of its vertices.
    #[must_use]
    pub fn surface(&self) -> (Mesh, Vec<u32>) {
        let mut node_of: Vec<u32> = self.surface_triangles.iter().flatten().copied().collect();
        node_of.sort_unstable();
        node_of.dedup();
        let number = |v: &u32| index(node_of.partition_point(|node| node < v));
        let vertices = node_of.iter().map(|v| self.positions[*v as usize]);
        let triangles = self.surface_triangles.iter();
        let mesh = Mesh {
            vertices: vertices.collect(),
            triangles: triangles.map(|t| t.each_ref().map(number)).collect(),
        };
        (mesh, node_of)
    }
}

/// About how many nodes [`sample_tetrahedra`] makes in a volume (m³) at one spacing (m): 1.57 in each cube
/// of it, as a body-centred lattice whose mean edge is the spacing has; more on a thin body's surface.
#[must_use]
pub fn estimate_tetrahedra_nodes(volume: f64, spacing: f64) -> f64 {
    1.57 * volume / (spacing * spacing * spacing)
}

/// Samples a body with tetrahedra whose corners are the nodes; nodes lie on the surface and inside.
///
/// Isosurface stuffing (Labelle & Shewchuk 2007) on a body-centred cubic lattice or, where the
/// grading asks for more than one spacing, on an octree. A box gets a lattice stretched by a few
/// percent that fits it exactly.
///
/// # Errors
/// [`SampleError`]: target or grading out of range, body thinner than the spacing, parts lost, not
/// inside its bounds, count missed.
pub fn sample_tetrahedra(
    solid: &Solid,
    settings: &SampleSettings,
) -> Result<SampledNodes, SampleError> {
    settings.grading.check()?;
    if let Some((frame, upright)) = Frame::upright(solid) {
        let found = sample_tetrahedra(upright, &frame.settings(settings));
        let mut found = found.map_err(|error| frame.error(error))?;
        frame.place_all(&mut found.positions, &mut found.boundary_vectors);
        return Ok(found);
    }
    let Some((frame, inside)) = Frame::of(solid) else {
        let (stuffed, cell) = fill(solid, settings)?;
        return finish(solid, stuffed, cell * MEAN_EDGE);
    };
    let filled = fill(&inside, &frame.settings(settings));
    let (mut stuffed, cell) = filled.map_err(|error| frame.error(error))?;
    frame.place_all(&mut stuffed.positions, &mut []);
    finish(solid, stuffed, cell * frame.length * MEAN_EDGE)
}

/// Tetrahedra and the cell that gave what was asked for.
fn fill(solid: &Solid, settings: &SampleSettings) -> Result<(Stuffed, f64), SampleError> {
    let filler = Filler::new(solid, settings);
    match settings.target {
        SampleTarget::Spacing(spacing) => filler.search_spacing(spacing),
        SampleTarget::NodeCount(nodes) => filler.search(nodes),
    }
}

/// Refuses lost parts, orders the nodes, sums volumes and boundary vectors, measures.
pub(crate) fn finish(
    solid: &Solid,
    stuffed: Stuffed,
    spacing: f64,
) -> Result<SampledNodes, SampleError> {
    let lost_cavities = check_parts(solid, &stuffed.parts_hit, spacing)?;
    let order = order_of(&stuffed);
    let positions = order.apply(&stuffed.positions);
    let on_surface = order.apply(&stuffed.on_surface);
    let mut tetrahedra = stuffed.tetrahedra;
    for v in tetrahedra.iter_mut().flatten() {
        *v = order.new_of_old[*v as usize];
    }
    tetrahedra.sort_unstable_by_key(|t| t.iter().copied().min());
    let surface_triangles = boundary_triangles(&tetrahedra, |v| on_surface[v as usize]);
    let mut volumes = nodal_volumes(&positions, &tetrahedra);
    let mut boundary_vectors = nodal_boundary_vectors(&positions, &surface_triangles);
    let quality = tetrahedra_quality(&positions, &tetrahedra);
    let surface = Mesh {
        vertices: positions,
        triangles: surface_triangles,
    };
    let own: f64 = volumes.iter().sum();
    add_slivers(solid, &surface, &mut volumes);
    let nodes = &surface.vertices;
    let pieces = fit_boundary(nodes, &tetrahedra, &volumes, &mut boundary_vectors);
    let volume: f64 = volumes.iter().sum();
    let report = SamplingReport {
        nodes: surface.vertices.len(),
        surface_nodes: on_surface.iter().filter(|s| **s).count(),
        tetrahedra: tetrahedra.len(),
        quality,
        volume,
        volume_error: solid.volume().map(|v| (volume - v) / v),
        tetrahedra_error: solid.volume().map(|v| (own - v) / v),
        area: surface.area(),
        pieces,
        input_parts: solid.parts().1,
        lost_cavities,
        missed: solid.mesh().map_or(0.0, |input| {
            missed_share(input, &surface, quality.mean_edge)
        }),
    };
    Ok(SampledNodes {
        positions: surface.vertices,
        volumes,
        boundary_vectors,
        tetrahedra,
        surface_triangles: surface.triangles,
        spacing: quality.mean_edge,
        report,
    })
}

/// The order in which what reads neighbours is fastest: near ones are in the first caches along a curve while the
/// body is small; of a large one they come from afar, and sooner where they are read in runs.
fn order_of(stuffed: &Stuffed) -> NodeOrder {
    let count = stuffed.positions.len();
    if count < LAYERED_FROM {
        return space_filling_order(&stuffed.positions);
    }
    let (offsets, indices) = tetrahedra_edges(count, &stuffed.tetrahedra);
    layered_order(&offsets, &indices)
}

/// The boundary of a body as triangles: the input of a mesh, else that of a stuffing at `spacing`.
///
/// # Errors
/// As [`sample_tetrahedra`].
pub fn surface_mesh(solid: &Solid, spacing: f64) -> Result<Mesh, SampleError> {
    surface_triangles(solid, spacing, &Grading::default())
}

/// The same by way of cells that grow inside as `grading` says; its refinements have no meaning here.
pub(crate) fn surface_triangles(
    solid: &Solid,
    spacing: f64,
    grading: &Grading,
) -> Result<Mesh, SampleError> {
    if let Some(mesh) = solid.mesh() {
        return Ok(mesh.clone());
    }
    if let Some((frame, upright)) = Frame::upright(solid) {
        let found = surface_triangles(upright, spacing, grading);
        let mut found = found.map_err(|error| frame.error(error))?;
        frame.place_all(&mut found.vertices, &mut []);
        return Ok(found);
    }
    let settings = SampleSettings {
        smoothing_sweeps: 0,
        grading: Grading {
            refinements: Vec::new(),
            ..grading.clone()
        },
        ..SampleSettings::default()
    };
    let stuffed = Filler::new(solid, &settings).fill(spacing / MEAN_EDGE)?;
    Ok(stuffed.into_surface().compacted())
}
