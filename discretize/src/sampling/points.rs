//! Nodes without tetrahedra: the centres of a lattice's or octree's cells, and points of the surface.

use std::fmt;

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::{Field, Mesh, index, vtk_points};
use crate::sampling::{
    Frame, Measures, Near, Octree, SampleError, SampleSettings, SampleTarget, Slimness, Solid,
    boundary_vectors, last_jumps, sample_surfels, space_filling_order, surface_triangles,
};

/// Cell centres nearer to the surface than this fraction of their cell give way to surface nodes.
const LEAST_DEPTH: f64 = 0.45;
/// Nearest two surface nodes may come, over the cell there.
const SURFACE_GAP: f64 = 0.8;
/// Surface triangles of an implicit body are this much smaller than the cells.
const SURFACE_DETAIL: f64 = 0.7;
/// Samples along each edge of a cell at the surface, odd so that one is the cell's centre.
const SAMPLES: usize = 3;
/// Rounds of the search for a number of nodes, and those of them that do not shift the cells.
const ROUNDS: usize = 24;
const STILL_ROUNDS: usize = 8;

/// Smallest cell that is tried over the first guess.
const LEAST_CELL: f64 = 0.4;
/// The search for more nodes than this begins with cells this much larger: cheap rounds tell how the
/// count grows.
const MANY_NODES: f64 = 2e4;
const FIRST_COARSENING: f64 = 4.0;

/// Nodes with volumes and boundary vectors, in space-filling order, without tetrahedra.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PointSampling {
    /// Rest positions (m), shape `(n)`.
    pub positions: Vec<DVec3>,
    /// Nodal volumes (m³), positive, sum = volume of the body.
    pub volumes: Vec<f64>,
    /// Nodal boundary vectors (m²): `sum b_i = 0`, `sum b_i (x) X_i = V I`.
    pub boundary_vectors: Vec<DVec3>,
    /// Whether each node lies on the surface.
    pub on_surface: Vec<bool>,
    /// Edge of the cells at the surface (m).
    pub spacing: f64,
    /// What came out.
    pub report: PointReport,
}

/// What a sampling without tetrahedra is like.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PointReport {
    /// Nodes.
    pub nodes: usize,
    /// Nodes on the surface.
    pub surface_nodes: usize,
    /// Volume of the body (m³): of the input surface, or of an implicit body's triangles.
    pub volume: f64,
    /// `(volume - V) / V` against the body's volume V ([`Solid::volume`]); `None` where a function alone gives the body.
    pub volume_error: Option<f64>,
    /// Area of that surface (m²).
    pub area: f64,
    /// `V / sum V_i - 1` before the volumes were scaled to sum to V.
    pub correction: f64,
    /// Smallest nodal volume over the mean.
    pub smallest_volume: f64,
    /// Largest support radius of the boundary vectors' shape functions over the spacing.
    pub largest_support: f64,
}

impl fmt::Display for PointReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} nodes ({} on the surface), no tetrahedra",
            self.nodes, self.surface_nodes
        )?;
        writeln!(f, "volume {:.6e}, area {:.6e}", self.volume, self.area)?;
        write!(
            f,
            "smallest nodal volume {:.3} of the mean, volumes corrected by {:+.3} %",
            self.smallest_volume,
            100.0 * self.correction
        )
    }
}

impl PointSampling {
    /// Nodes with volumes and boundary vectors as binary legacy VTK.
    #[must_use]
    pub fn to_vtk(&self) -> Vec<u8> {
        let fields = [
            ("volume", Field::Scalars(&self.volumes)),
            ("boundary_vector", Field::Vectors(&self.boundary_vectors)),
        ];
        vtk_points(&self.positions, &fields)
    }
}

/// About how many nodes [`sample_points`] makes in a volume (m³) at one spacing (m): one in each cube of it;
/// more with nodes on the surface.
#[must_use]
pub fn estimate_point_nodes(volume: f64, spacing: f64) -> f64 {
    volume / (spacing * spacing * spacing)
}

/// Samples a body with the centres of cubic cells, and with surface points a cell apart if
/// `on_surface` is set (nodes that all lie inside cost ten times the error in bending).
///
/// With one spacing the cells form a regular lattice, else an octree (see [`crate::Grading`]).
/// Volumes: the part of the body nearest to each node, by samples, scaled to the body's volume.
/// Boundary vectors: `b_i = sum_q phi_i(x_q) n_q a_q` over the surface with linear
/// moving-least-squares shape functions. [`SampleSettings::smoothing_sweeps`] has no meaning here.
///
/// # Errors
/// [`SampleError`]: target or grading out of range, body thinner than the spacing, count missed.
pub fn sample_points(
    solid: &Solid,
    settings: &SampleSettings,
    on_surface: bool,
) -> Result<PointSampling, SampleError> {
    settings.grading.check()?;
    if let Some((frame, upright)) = Frame::upright(solid) {
        let found = sample_points(upright, &frame.settings(settings), on_surface);
        let mut found = found.map_err(|error| frame.error(error))?;
        frame.place_all(&mut found.positions, &mut found.boundary_vectors);
        return Ok(found);
    }
    let Some((frame, inside)) = Frame::of(solid) else {
        return place(solid, settings, on_surface);
    };
    let placed = place(&inside, &frame.settings(settings), on_surface);
    let mut found = placed.map_err(|error| frame.error(error))?;
    let length = frame.length;
    let (volume, area) = solid.mesh().map_or((0.0, 0.0), |m| (m.volume(), m.area()));
    // Rounding to the frame's grain changed the volume a little.
    let scale = volume / found.report.volume;
    frame.place_all(&mut found.positions, &mut found.boundary_vectors);
    found.volumes.iter_mut().for_each(|v| *v *= scale);
    found.spacing *= length;
    (found.report.volume, found.report.area) = (volume, area);
    Ok(found)
}

fn place(
    solid: &Solid,
    settings: &SampleSettings,
    on_surface: bool,
) -> Result<PointSampling, SampleError> {
    let places = match settings.target {
        SampleTarget::Spacing(spacing) => {
            Places::new(solid, spacing, DVec3::ZERO, settings, on_surface)
        }
        SampleTarget::NodeCount(wanted) => search(solid, wanted, settings, on_surface),
    };
    finish(solid, places?)
}

/// Nodes before they have volumes.
struct Places {
    cell: f64,
    octree: Octree,
    surface: Mesh,
    positions: Vec<DVec3>,
    /// Edge of the cell at each node.
    size: Vec<f64>,
    /// Number of those that are cell centres; surface nodes follow.
    inside: usize,
    /// Node at the centre of each leaf, or `u32::MAX`.
    node_of_leaf: Vec<u32>,
}

impl Places {
    fn new(
        solid: &Solid,
        cell: f64,
        shift: DVec3,
        settings: &SampleSettings,
        on_surface: bool,
    ) -> Result<Self, SampleError> {
        if !(cell.is_finite() && cell > 0.0) {
            return Err(SampleError::Spacing { spacing: cell });
        }
        let bounds = solid.bounds();
        let (cells, start) = if solid.is_box && shift == DVec3::ZERO {
            let count = (bounds.size() / cell).round().max(DVec3::ONE);
            (bounds.size() / count, bounds.min)
        } else {
            (DVec3::splat(cell), bounds.min - shift.fract() * cell)
        };
        let largest = settings.largest_octree();
        let octree = Octree::build(solid, cells, start, &settings.grading, largest)?;
        let surface = surface_triangles(solid, SURFACE_DETAIL * cell, &settings.grading)?;
        let leaves = octree.leaves();
        let depth = if on_surface { LEAST_DEPTH } else { 0.0 };
        let inside: Vec<bool> = leaves
            .par_iter()
            .with_min_len(64)
            .map(|leaf| {
                let center = leaf.min + 0.5 * leaf.size;
                let limit = -depth * leaf.size.min_element();
                if depth > 0.0 && leaf.at_surface {
                    solid.signed_distance(center) < limit
                } else {
                    solid.contains(center)
                }
            })
            .collect();
        let (mut positions, mut size) = (Vec::new(), Vec::new());
        let mut node_of_leaf = vec![u32::MAX; leaves.len()];
        for (k, leaf) in leaves.iter().enumerate().filter(|(k, _)| inside[*k]) {
            node_of_leaf[k] = index(positions.len());
            positions.push(leaf.min + 0.5 * leaf.size);
            size.push(leaf.size.element_sum() / 3.0);
        }
        let inside = positions.len();
        if on_surface {
            for p in surface_nodes(solid, &surface, &octree, cell, settings) {
                size.push(octree.size_at(p));
                positions.push(p);
            }
        }
        Ok(Self {
            cell,
            octree,
            surface,
            positions,
            size,
            inside,
            node_of_leaf,
        })
    }
}

/// Points of the surface about as far apart as the cells there are wide.
fn surface_nodes(
    solid: &Solid,
    surface: &Mesh,
    octree: &Octree,
    cell: f64,
    settings: &SampleSettings,
) -> Vec<DVec3> {
    let finest = cell * settings.grading.smallest_factor();
    #[allow(clippy::cast_possible_truncation, reason = "a count")]
    let count = (surface.area() / (finest * finest)).ceil() as usize;
    let exact = solid.mesh().is_none().then_some(solid);
    let points = sample_surfels(surface, count, exact).positions;
    if settings.grading.smallest_factor() >= 1.0 {
        return points;
    }
    let mut tree = Near::default();
    let mut kept: Vec<DVec3> = Vec::new();
    for p in points {
        let gap = SURFACE_GAP * octree.size_at(p);
        if tree.within(p, gap).next().is_none() {
            tree.insert(p, index(kept.len()));
            kept.push(p);
        }
    }
    kept
}

/// Nodes at a cell size: one in each cell, and on each squared cell of the surface.
fn model(a: f64, volume: f64, area: f64) -> f64 {
    (volume / a + area) / (a * a)
}

/// The same without those on the surface.
fn model_inside(a: f64, volume: f64, _: f64) -> f64 {
    volume / (a * a * a)
}

/// Finds the cell that gives a number of nodes.
fn search(
    solid: &Solid,
    wanted: usize,
    settings: &SampleSettings,
    on_surface: bool,
) -> Result<Places, SampleError> {
    let target = wanted as f64;
    let largest = settings.largest_octree();
    let model = if on_surface { model } else { model_inside };
    let body = Slimness::new(solid, largest, wanted, model);
    body.check_count(wanted)?;
    let first = body.cell_of(target);
    let mut cell = first;
    let least = LEAST_CELL * cell;
    if target > MANY_NODES {
        cell *= FIRST_COARSENING;
    }
    let mut last: Option<(f64, f64)> = None;
    let (mut fine, mut coarse) = (0.0_f64, f64::INFINITY);
    let (mut nearest, mut accepted) = (0, None);
    let (mut vanished, mut spent) = (false, 0.0);
    for round in 0..ROUNDS {
        if cell < least || body.is_spent(&mut spent, cell) {
            break;
        }
        let shift = crate::sampling::counts::SHIFT * round.saturating_sub(STILL_ROUNDS) as f64;
        let places = match Places::new(solid, cell, shift, settings, on_surface) {
            Err(SampleError::Vanished { .. } | SampleError::Slender { .. }) => {
                // A round coarser than the nodes ask for says nothing about the body.
                if cell <= first && body.is_thin_for(cell) {
                    return Err(body.vanished(cell));
                }
                vanished |= cell <= first;
                cell *= 0.5;
                continue;
            }
            Err(SampleError::TooFine { .. }) if round + 1 < ROUNDS => {
                fine = fine.max(cell);
                cell *= 2.0;
                continue;
            }
            other => other?,
        };
        // Nodes on both sides of a plate and none between them have no thickness to bend.
        if places.inside == 0 && body.is_thin_for(cell) {
            if cell > first {
                cell = first.max(0.5 * cell);
                continue;
            }
            return Err(body.vanished(cell));
        }
        let nodes = places.positions.len();
        let miss = (nodes as f64 - target).abs();
        let tolerance = settings.count_tolerance * target;
        if miss <= tolerance {
            return Ok(places);
        }
        if nodes.abs_diff(wanted) < wanted.abs_diff(nearest) {
            nearest = nodes;
            accepted = (miss <= last_jumps(target) * tolerance).then_some(places);
        }
        if nodes < wanted {
            coarse = coarse.min(cell);
        } else {
            fine = fine.max(cell);
        }
        // The count's growth in the last two rounds, at first between a surface's and a volume's.
        let here = (cell, nodes.max(1) as f64);
        let growth = last.map(|(cell, nodes)| (nodes / here.1).ln() / (here.0 / cell).ln());
        let growth = growth.filter(|g| (1.8..3.2).contains(g));
        let step = (here.1 / target).powf(1.0 / growth.unwrap_or(2.5));
        cell *= step.clamp(0.5, 2.0);
        last = Some(here);
        if round < STILL_ROUNDS && coarse.is_finite() && !(cell > fine && cell < coarse) {
            cell = 0.5 * (fine + coarse);
        }
    }
    accepted.ok_or_else(|| body.missed(wanted, nearest, vanished, first))
}

fn finish(solid: &Solid, places: Places) -> Result<PointSampling, SampleError> {
    let (Measures { volume, area }, advice) = (solid.measures(), 0.5 * places.cell);
    let vanished = SampleError::Vanished {
        spacing: places.cell,
        advice,
        nodes: model(advice, volume, area),
    };
    if places.inside == 0 && places.positions.len() < 4 {
        return Err(vanished);
    }
    let tree = Near::new(&places.positions);
    let (volume, area) = (places.surface.volume(), places.surface.area());
    let mut volumes = cell_volumes(solid, &places, &tree);
    let sum: f64 = volumes.iter().sum();
    volumes.iter_mut().for_each(|v| *v *= volume / sum);
    let (vectors, largest_support) =
        boundary_vectors(&places.positions, &places.size, &places.surface, &tree)
            .ok_or(vanished)?;
    let order = space_filling_order(&places.positions);
    let n = places.positions.len();
    let mean = volume / n as f64;
    let on_surface: Vec<bool> = (0..n).map(|v| v >= places.inside).collect();
    Ok(PointSampling {
        report: PointReport {
            nodes: n,
            surface_nodes: n - places.inside,
            volume,
            volume_error: solid.volume().map(|v| (volume - v) / v),
            area,
            correction: volume / sum - 1.0,
            smallest_volume: volumes.iter().copied().fold(f64::INFINITY, f64::min) / mean,
            largest_support: largest_support / places.cell,
        },
        positions: order.apply(&places.positions),
        volumes: order.apply(&volumes),
        boundary_vectors: order.apply(&vectors),
        on_surface: order.apply(&on_surface),
        spacing: places.cell,
    })
}

/// Volume of the body nearest to each node: whole cells away from the surface, samples of the cells
/// at it. A node that no sample is nearest to gets one.
fn cell_volumes(solid: &Solid, places: &Places, tree: &Near) -> Vec<f64> {
    let n = SAMPLES * SAMPLES * SAMPLES;
    let shares: Vec<Vec<(u32, f64)>> = places
        .octree
        .leaves()
        .par_iter()
        .zip(&places.node_of_leaf)
        .with_min_len(64)
        .map(|(leaf, node)| {
            let volume = leaf.size.element_product();
            if !leaf.at_surface {
                let own = (*node != u32::MAX).then_some((*node, volume));
                return own.into_iter().collect();
            }
            let place = |k: usize| {
                let step = [k % SAMPLES, k / SAMPLES % SAMPLES, k / (SAMPLES * SAMPLES)];
                let step = DVec3::from_array(step.map(|s| s as f64)) + 0.5;
                leaf.min + leaf.size * step / SAMPLES as f64
            };
            let inside = (0..n).map(place).filter(|p| solid.contains(*p));
            inside
                .map(|p| (tree.nearest(p), volume / n as f64))
                .collect()
        })
        .collect();
    let mut volumes = vec![0.0; places.positions.len()];
    for (v, share) in shares.into_iter().flatten() {
        volumes[v as usize] += share;
    }
    for (volume, size) in volumes.iter_mut().zip(&places.size) {
        if *volume == 0.0 {
            *volume = size * size * size / n as f64;
        }
    }
    volumes
}
