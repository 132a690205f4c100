//! From a solid to nodes, volumes, boundary vectors and tetrahedra.

use std::fmt;

use glam::DVec3;

use crate::error::SampleError;
use crate::improve::improve;
use crate::lattice::Lattice;
use crate::mesh::{Bounds, Mesh};
use crate::oracle::{Oracle, find};
use crate::order::space_filling_order;
use crate::quality::{TetrahedraQuality, tetrahedra_quality};
use crate::solid::Solid;
use crate::stuffing::{Stuffed, stuff};
use crate::sums::{boundary_triangles, nodal_boundary_vectors, nodal_volumes};

/// Mean edge of the lattice's tetrahedra over the cell: six long edges of 1 and eight short ones
/// of `sqrt(3)/2` meet in every point.
const MEAN_EDGE: f64 = 0.923_433_008_258_963_5;
/// Fewest nodes that can be asked for.
const LEAST_NODES: usize = 30;
/// Rounds of the search for a spacing that gives the wanted number of nodes.
const COUNT_ROUNDS: usize = 14;
/// Direction of the shifts that break symmetry: the R3 sequence (Roberts 2018).
const SHIFT: DVec3 = DVec3::new(
    0.819_172_513_396_164_4,
    0.671_043_606_703_789_2,
    0.549_700_477_901_970_2,
);
/// Nodes on a surface patch of one squared cell, from the samplings of `examples/quality.rs`;
/// only the first guess of the search uses it.
const SURFACE_NODES: f64 = 1.6;

/// How fine to sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// Mean distance between neighbouring nodes inside (length unit of the body).
    Spacing(f64),
    /// Number of nodes, met within [`SampleSettings::count_tolerance`].
    NodeCount(usize),
}

/// What [`sample_tetrahedra`] is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleSettings {
    /// Spacing or number of nodes.
    pub target: Target,
    /// Relative tolerance of [`Target::NodeCount`].
    pub count_tolerance: f64,
    /// Sweeps that move nodes near the surface to raise the smallest height, and with it the
    /// explicit time step; 0 leaves the stuffing as it is. A fitted box needs none.
    pub smoothing_sweeps: usize,
    /// Most lattice cells before [`SampleError::TooFine`]; each takes about 20 bytes.
    pub largest_lattice: usize,
}

impl Default for SampleSettings {
    fn default() -> Self {
        Self {
            target: Target::NodeCount(6000),
            count_tolerance: 0.05,
            smoothing_sweeps: 4,
            largest_lattice: 200_000_000,
        }
    }
}

/// Nodes with everything a simulation starts from, in space-filling order.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampling {
    /// Rest positions (m), shape `(n)`.
    pub positions: Vec<DVec3>,
    /// Nodal volumes (m³), positive, sum = volume of the tetrahedra.
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
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct SamplingReport {
    /// Nodes.
    pub nodes: usize,
    /// Nodes on the surface.
    pub surface_nodes: usize,
    /// Tetrahedra.
    pub tetrahedra: usize,
    /// Shape and size of the tetrahedra.
    pub quality: TetrahedraQuality,
    /// Volume of the tetrahedra (m³): what the nodal volumes sum to.
    pub volume: f64,
    /// `(volume - V) / V` against the input surface's volume V; `None` for implicit bodies.
    pub volume_error: Option<f64>,
    /// Area of the tetrahedra's boundary (m²).
    pub area: f64,
    /// Pieces of the tetrahedra not joined by a face's nodes.
    pub pieces: usize,
    /// Closed parts of the input surface; 0 for implicit bodies.
    pub input_parts: usize,
    /// Parts of the input (cavities) that no lattice edge met: too small for the spacing.
    pub lost_cavities: usize,
    /// Share of the input's vertices farther than one spacing from every surface node: thin places
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
            write!(f, " ({:+.3} % against the surface's)", 100.0 * error)?;
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
        if self.lost_cavities > 0 {
            write!(
                f,
                "\n{} cavity(ies) smaller than the spacing are filled",
                self.lost_cavities
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

/// Samples a body with tetrahedra whose corners are the nodes; nodes lie on the surface and inside.
///
/// Isosurface stuffing (Labelle & Shewchuk 2007) on a body-centred cubic lattice. A box gets a
/// lattice stretched by a few percent that fits it exactly.
///
/// # Errors
/// [`SampleError`]: target out of range, body thinner than the spacing, parts lost, count missed.
pub fn sample_tetrahedra(
    solid: &Solid,
    settings: &SampleSettings,
) -> Result<Sampling, SampleError> {
    let oracle = Oracle::new(solid);
    let (mut stuffed, cell) = match settings.target {
        Target::Spacing(spacing) => {
            let cell = spacing / MEAN_EDGE;
            let lattice = lattice_for(solid, cell, settings.largest_lattice)?;
            (stuff_at(&oracle, &lattice, cell)?, cell)
        }
        Target::NodeCount(nodes) if nodes < LEAST_NODES => {
            let least = LEAST_NODES;
            return Err(SampleError::TooFewNodes { nodes, least });
        }
        Target::NodeCount(wanted) if solid.is_box() => stuff_box(&oracle, wanted, settings)?,
        Target::NodeCount(wanted) => search_count(&oracle, wanted, settings)?,
    };
    if !solid.is_box() {
        improve(&mut stuffed, solid, cell, settings.smoothing_sweeps);
    }
    finish(&oracle, stuffed, cell * MEAN_EDGE)
}

fn stuff_at(oracle: &Oracle<'_>, lattice: &Lattice, cell: f64) -> Result<Stuffed, SampleError> {
    let stuffed = stuff(lattice, oracle)?;
    if stuffed.tetrahedra.is_empty() {
        return Err(SampleError::Vanished {
            spacing: cell * MEAN_EDGE,
            advice: 0.5 * cell * MEAN_EDGE,
        });
    }
    Ok(stuffed)
}

/// The lattice of cell size `cell` round a body: centred on it with a rim of one cell, or fitted
/// exactly if the body is a box.
fn lattice_for(solid: &Solid, cell: f64, largest: usize) -> Result<Lattice, SampleError> {
    if !(cell.is_finite() && cell > 0.0) {
        let spacing = cell * MEAN_EDGE;
        return Err(SampleError::Spacing { spacing });
    }
    let size = solid.bounds().size();
    if solid.is_box() {
        let count = (size / cell).round().max(DVec3::ONE);
        lattice_of(solid, size / count, count, largest)
    } else {
        let count = (size / cell).ceil().max(DVec3::ONE);
        lattice_of(solid, DVec3::splat(cell), count, largest)
    }
}

/// The lattice of `count` cells centred on a body with a rim of one cell.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "limited by `largest` before"
)]
fn lattice_of(
    solid: &Solid,
    cell: DVec3,
    count: DVec3,
    largest: usize,
) -> Result<Lattice, SampleError> {
    let cells = (count + 2.0).element_product();
    let limit = largest as f64;
    if cells > limit.min(1e9) || cells.is_nan() {
        return Err(SampleError::TooFine {
            spacing: cell.max_element() * MEAN_EDGE,
            cells,
            limit,
        });
    }
    let origin = if solid.is_box() {
        solid.bounds().min - cell
    } else {
        solid.bounds().center() - 0.5 * (count + 2.0) * cell
    };
    Ok(Lattice {
        origin,
        cell,
        cells: [count.x, count.y, count.z].map(|n| n as usize + 2),
    })
}

/// Fits a lattice to a box: of the cell counts that give the wanted number of nodes, the one whose
/// cells are nearest to cubes.
///
/// A fitted lattice of `a b c` cells has `(a+1)(b+1)(c+1)` corners, `a b c` centres and
/// `2 (a b + b c + c a)` nodes in the middles of the outer squares.
#[allow(clippy::cast_precision_loss, reason = "counts")]
fn stuff_box(
    oracle: &Oracle<'_>,
    wanted: usize,
    settings: &SampleSettings,
) -> Result<(Stuffed, f64), SampleError> {
    let size = oracle.solid.bounds().size();
    let target = wanted as f64;
    let nodes = |n: DVec3| {
        (n + 1.0).element_product() + n.element_product() + 2.0 * n.dot(DVec3::new(n.y, n.z, n.x))
    };
    let scale = (2.0 * size.element_product() / target).cbrt();
    let mut best = (f64::INFINITY, f64::INFINITY, DVec3::ONE);
    for step in 0..200 {
        let count = size / (scale * 1.02_f64.powi(step - 60));
        for rounding in 0..8 {
            let up = |axis: i32, x: f64| {
                if rounding >> axis & 1 == 0 {
                    x.floor()
                } else {
                    x.ceil()
                }
            };
            let n = DVec3::new(up(0, count.x), up(1, count.y), up(2, count.z)).max(DVec3::ONE);
            let miss = (nodes(n) / target - 1.0).abs();
            let cell = size / n;
            let stretch = cell.max_element() / cell.min_element();
            // Counts within the tolerance compete by shape, others by count alone.
            let rank = if miss <= settings.count_tolerance {
                (0.0, stretch)
            } else {
                (miss, stretch)
            };
            if rank < (best.0, best.1) {
                best = (rank.0, rank.1, n);
            }
        }
    }
    let n = best.2;
    if best.0 > 0.0 {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count"
        )]
        let reached = nodes(n) as usize;
        return Err(SampleError::NodeCount { wanted, reached });
    }
    let lattice = lattice_of(oracle.solid, size / n, n, settings.largest_lattice)?;
    let cell = (size / n).element_sum() / 3.0;
    Ok((stuff_at(oracle, &lattice, cell)?, cell))
}

/// Finds a cell size that gives the wanted number of nodes.
///
/// Model: `n = r (2 V / a^3 + s A / a^2)`, solved for a; r from the last round, then bisection
/// between the nearest samplings above and below.
#[allow(clippy::cast_precision_loss, reason = "counts")]
fn search_count(
    oracle: &Oracle<'_>,
    wanted: usize,
    settings: &SampleSettings,
) -> Result<(Stuffed, f64), SampleError> {
    let target = wanted as f64;
    let size = oracle.solid.bounds().size();
    let (mut volume, mut area) = oracle.solid.mesh().map_or_else(
        || {
            let v = 0.5 * size.element_product();
            (v, 5.0 * v.powf(2.0 / 3.0))
        },
        |mesh| (mesh.volume(), mesh.area()),
    );
    let model =
        |a: f64, volume: f64, area: f64| (2.0 * volume / a + SURFACE_NODES * area) / (a * a);
    let mut ratio = 1.0;
    let (mut coarse, mut fine) = (f64::INFINITY, 0.0_f64);
    let mut nearest = 0;
    for round in 0..COUNT_ROUNDS {
        let mut cell = solve_cell(
            target / ratio,
            |a| model(a, volume, area),
            size.max_element(),
        );
        if round < COUNT_ROUNDS / 3 && !(cell < coarse && cell > fine) {
            cell = if coarse.is_finite() {
                0.5 * (coarse + fine)
            } else {
                2.0 * fine
            };
        }
        let mut lattice = lattice_for(oracle.solid, cell, settings.largest_lattice)?;
        if round >= COUNT_ROUNDS / 3 {
            // A body as symmetric as the lattice jumps in count: leave the symmetry.
            lattice.shift(SHIFT * (round as f64));
        }
        let stuffed = match stuff_at(oracle, &lattice, cell) {
            Err(SampleError::Vanished { .. }) => {
                coarse = cell;
                continue;
            }
            other => other?,
        };
        let nodes = stuffed.positions.len();
        if (nodes as f64 - target).abs() <= settings.count_tolerance * target {
            return Ok((stuffed, cell));
        }
        if nodes.abs_diff(wanted) < wanted.abs_diff(nearest) {
            nearest = nodes;
        }
        if nodes < wanted {
            coarse = coarse.min(cell);
        } else {
            fine = fine.max(cell);
        }
        if oracle.solid.mesh().is_none() {
            let triangles =
                boundary_triangles(&stuffed.tetrahedra, |v| stuffed.on_surface[v as usize]);
            let mesh = Mesh {
                vertices: stuffed.positions,
                triangles,
            };
            (volume, area) = (mesh.volume(), mesh.area());
        }
        ratio = nodes as f64 / model(cell, volume, area);
    }
    Err(SampleError::NodeCount {
        wanted,
        reached: nearest,
    })
}

/// Root of a falling function by bisection of the logarithm.
fn solve_cell(target: f64, model: impl Fn(f64) -> f64, largest: f64) -> f64 {
    let (mut low, mut high) = (1e-5 * largest, 10.0 * largest);
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        if model(middle) > target {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low * high).sqrt()
}

/// Refuses lost parts, orders the nodes, sums volumes and boundary vectors, measures.
fn finish(oracle: &Oracle<'_>, stuffed: Stuffed, spacing: f64) -> Result<Sampling, SampleError> {
    let lost_cavities = check_parts(oracle, &stuffed.parts_hit, spacing)?;
    let order = space_filling_order(&stuffed.positions);
    let positions = order.apply(&stuffed.positions);
    let on_surface = order.apply(&stuffed.on_surface);
    let mut tetrahedra = stuffed.tetrahedra;
    for v in tetrahedra.iter_mut().flatten() {
        *v = order.new_of_old[*v as usize];
    }
    tetrahedra.sort_unstable_by_key(|t| t.iter().copied().min());
    let surface_triangles = boundary_triangles(&tetrahedra, |v| on_surface[v as usize]);
    let volumes = nodal_volumes(&positions, &tetrahedra);
    let boundary_vectors = nodal_boundary_vectors(&positions, &surface_triangles);
    let quality = tetrahedra_quality(&positions, &tetrahedra);
    let volume: f64 = volumes.iter().sum();
    let surface = Mesh {
        vertices: positions,
        triangles: surface_triangles,
    };
    let report = SamplingReport {
        nodes: surface.vertices.len(),
        surface_nodes: on_surface.iter().filter(|s| **s).count(),
        tetrahedra: tetrahedra.len(),
        quality,
        volume,
        volume_error: oracle
            .solid
            .mesh()
            .map(|m| m.volume())
            .map(|v| (volume - v) / v),
        area: surface.area(),
        pieces: count_pieces(surface.vertices.len(), &tetrahedra),
        input_parts: oracle.part_count(),
        lost_cavities,
        missed: oracle.solid.mesh().map_or(0.0, |input| {
            missed_share(input, &surface, quality.mean_edge)
        }),
    };
    Ok(Sampling {
        positions: surface.vertices,
        volumes,
        boundary_vectors,
        tetrahedra,
        surface_triangles: surface.triangles,
        spacing: quality.mean_edge,
        report,
    })
}

/// Counts cavities that no edge met; an outward part that no edge met is an error.
fn check_parts(
    oracle: &Oracle<'_>,
    parts_hit: &[bool],
    spacing: f64,
) -> Result<usize, SampleError> {
    let Some(mesh) = oracle.solid.mesh() else {
        return Ok(0);
    };
    let mut lost: Option<(Bounds, usize)> = None;
    let mut cavities = 0;
    for (part, _) in parts_hit.iter().enumerate().filter(|(_, hit)| !**hit) {
        let own = Mesh {
            vertices: mesh.vertices.clone(),
            triangles: oracle
                .triangles_of(part)
                .map(|t| mesh.triangles[t])
                .collect(),
        };
        if own.volume() < 0.0 {
            cavities += 1;
        } else if !is_buried(oracle.solid, &own) {
            let bounds = own.bounds();
            lost = Some(lost.map_or((bounds, 1), |(first, n)| (first, n + 1)));
        }
    }
    match lost {
        None => Ok(cavities),
        Some((bounds, parts)) => Err(SampleError::LostParts {
            parts,
            of: oracle.part_count(),
            spacing,
            near: bounds.center(),
            advice: (0.4 * bounds.size().min_element()).min(0.5 * spacing),
        }),
    }
}

/// Whether a part lies inside another one, so that no edge has to leave the body there.
fn is_buried(solid: &Solid, part: &Mesh) -> bool {
    let first = part.triangles[0].map(|v| part.vertices[v as usize]);
    let normal = part.area_vector(0).normalize_or_zero();
    let step = 1e-3 * part.bounds().diagonal();
    let middle = (first[0] + first[1] + first[2]) / 3.0;
    solid.contains(middle + step * normal)
}

/// Pieces of tetrahedra connected through nodes.
fn count_pieces(nodes: usize, tetrahedra: &[[u32; 4]]) -> usize {
    let mut root: Vec<u32> = (0..nodes).map(crate::mesh::index).collect();
    let mut pieces = nodes;
    for t in tetrahedra {
        for &other in &t[1..] {
            let (a, b) = (find(&mut root, t[0]), find(&mut root, other));
            if a != b {
                root[a.max(b) as usize] = a.min(b);
                pieces -= 1;
            }
        }
    }
    pieces
}

/// Share of the input's vertices farther than `spacing` from the sampled surface.
#[allow(clippy::cast_precision_loss, reason = "counts")]
fn missed_share(input: &Mesh, sampled: &Mesh, spacing: f64) -> f64 {
    use rayon::prelude::*;
    let hierarchy = crate::hierarchy::Hierarchy::new(sampled);
    let far = input
        .vertices
        .par_iter()
        .filter(|v| {
            hierarchy
                .closest(**v)
                .is_none_or(|c| c.distance_squared > spacing * spacing)
        })
        .count();
    far as f64 / input.vertices.len() as f64
}

/// The boundary of a body as triangles: the input of a mesh, else that of a stuffing at `spacing`.
///
/// # Errors
/// As [`sample_tetrahedra`].
pub fn surface_mesh(solid: &Solid, spacing: f64) -> Result<Mesh, SampleError> {
    if let Some(mesh) = solid.mesh() {
        return Ok(mesh.clone());
    }
    let settings = SampleSettings {
        target: Target::Spacing(spacing),
        ..SampleSettings::default()
    };
    let oracle = Oracle::new(solid);
    let cell = spacing / MEAN_EDGE;
    let lattice = lattice_for(solid, cell, settings.largest_lattice)?;
    let stuffed = stuff_at(&oracle, &lattice, cell)?;
    let triangles = boundary_triangles(&stuffed.tetrahedra, |v| stuffed.on_surface[v as usize]);
    let mesh = Mesh {
        vertices: stuffed.positions,
        triangles,
    };
    Ok(mesh.compacted())
}
