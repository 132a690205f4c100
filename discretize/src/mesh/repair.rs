//! From a surface as it comes to the boundary of a solid, with a report.

use std::collections::{HashMap, HashSet};
use std::fmt;

use glam::DVec3;

use crate::mesh::{
    Bounds, Hierarchy, Mesh, RepairError, SortedSides, boundary_loops, index, orient,
    self_intersections, winding_number,
};

/// Points of a part that are asked whether they lie in another one.
const SAMPLES: usize = 5;

/// What [`repair()`] may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RepairSettings {
    /// Vertices nearer than this fraction of the box's diagonal become one.
    pub weld_tolerance: f64,
    /// Holes up to this perimeter, as a fraction of the box's diagonal, are closed.
    pub largest_hole: f64,
    /// Parts of less volume than this fraction of the largest are specks and dropped.
    pub smallest_part: f64,
    /// Whether to look for self-intersections (they are reported, not repaired).
    pub find_self_intersections: bool,
}

impl Default for RepairSettings {
    /// Welding at 1e-9, holes up to 0.2 diagonals, parts above 1e-7 of the largest; crossings are looked for.
    fn default() -> Self {
        Self {
            weld_tolerance: 1e-9,
            largest_hole: 0.2,
            smallest_part: 1e-7,
            find_self_intersections: true,
        }
    }
}

/// What was found and done.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct MeshReport {
    /// Vertices and triangles given.
    pub given: (usize, usize),
    /// Vertices and triangles left.
    pub kept: (usize, usize),
    /// Vertices of no triangle, dropped.
    pub unused_vertices: usize,
    /// Vertices joined to an earlier one.
    pub welded_vertices: usize,
    /// Triangles with two equal corners, dropped.
    pub degenerate_triangles: usize,
    /// Triangles with the corners of an earlier one, dropped.
    pub duplicate_triangles: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Triangles turned to agree with their neighbours.
    pub turned_triangles: usize,
    /// Parts that were inside out and were turned.
    pub turned_parts: usize,
    /// Holes closed.
    pub closed_holes: usize,
    /// Perimeter of the largest hole closed.
    pub largest_hole: f64,
    /// Connected parts of the surface, specks included.
    pub parts: usize,
    /// Parts dropped because they are specks against the largest.
    pub dropped_specks: usize,
    /// Parts dropped because they add nothing to the body: they lie in its inside and look outward, or
    /// bound a cavity where there is no body.
    pub dropped_buried: usize,
    /// Parts that bound a cavity in another part.
    pub cavities: usize,
    /// Sum of the parts' genus; `None` if edges are not manifold.
    pub genus: Option<usize>,
    /// Triangles that cross another one; `None` if not looked for.
    pub self_intersecting: Option<usize>,
    /// Signed volume as given (before turning parts and closing holes).
    pub given_volume: f64,
    /// Volume after repair.
    pub volume: f64,
    /// Area after repair.
    pub area: f64,
    /// Lower corner of the box.
    pub min: DVec3,
    /// Upper corner of the box.
    pub max: DVec3,
}

impl fmt::Display for MeshReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} vertices, {} triangles (given {} and {})",
            self.kept.0, self.kept.1, self.given.0, self.given.1
        )?;
        let done = [
            (self.unused_vertices, "unused vertices dropped"),
            (self.welded_vertices, "vertices welded"),
            (self.degenerate_triangles, "degenerate triangles dropped"),
            (self.duplicate_triangles, "duplicate triangles dropped"),
            (self.turned_triangles, "triangles turned"),
            (self.turned_parts, "inside-out part(s) turned"),
            (self.closed_holes, "hole(s) closed"),
            (self.dropped_specks, "speck(s) dropped"),
            (
                self.dropped_buried,
                "part(s) inside another one dropped, which they add nothing to",
            ),
            (self.non_manifold_edges, "non-manifold edges"),
            (
                self.self_intersecting.unwrap_or(0),
                "self-intersecting triangles",
            ),
        ];
        for (count, what) in done.into_iter().filter(|(count, _)| *count > 0) {
            write!(f, "; {count} {what}")?;
        }
        write!(f, "\n{} part(s), {} cavity(ies)", self.parts, self.cavities)?;
        if let Some(genus) = self.genus {
            write!(f, ", genus {genus}")?;
        }
        writeln!(f, "; volume {:.7e}, area {:.7e}", self.volume, self.area)?;
        write!(
            f,
            "box ({:.5}, {:.5}, {:.5}) to ({:.5}, {:.5}, {:.5})",
            self.min.x, self.min.y, self.min.z, self.max.x, self.max.y, self.max.z
        )
    }
}

/// Makes a surface the boundary of a solid: drops unused vertices, degenerate and duplicate
/// triangles, welds, orients, closes small holes, turns inside-out parts. What was done is
/// reported; what cannot be done is refused.
///
/// A part inside another one keeps its sense relative to it: inward it is a cavity. An outward one adds
/// nothing where the body is already, so it is dropped and reported.
///
/// # Errors
/// [`RepairError`] with the position.
pub fn repair(mesh: &Mesh, settings: &RepairSettings) -> Result<(Mesh, MeshReport), RepairError> {
    validate(mesh)?;
    let mut work = mesh.clone().compacted();
    let diagonal = work.bounds().diagonal();
    if !(1e-90..1e90).contains(&diagonal) {
        return Err(RepairError::Scale { diagonal });
    }
    let mut report = MeshReport {
        given: (mesh.vertices.len(), mesh.triangles.len()),
        unused_vertices: mesh.vertices.len() - work.vertices.len(),
        given_volume: work.volume(),
        ..MeshReport::default()
    };
    // Welding may join sheets that pass through each other and hide that they are one side.
    orient(&mut work.clone(), &SortedSides::new(&work)).map_err(|t| one_sided(&work, t))?;
    report.welded_vertices = weld(&mut work, settings.weld_tolerance * diagonal);
    (report.degenerate_triangles, report.duplicate_triangles) = drop_bad(&mut work);
    if work.triangles.is_empty() {
        let dropped = report.degenerate_triangles + report.duplicate_triangles;
        return Err(RepairError::Empty { dropped });
    }
    let given = work.compacted();
    let mut work = given.clone();
    let edges = SortedSides::new(&given);
    report.non_manifold_edges = edges.non_manifold();
    report.turned_triangles = orient(&mut work, &edges).map_err(|t| one_sided(&given, t))?;
    let largest = settings.largest_hole;
    (report.closed_holes, report.largest_hole) = close_holes(&mut work, largest, diagonal)?;
    let (part_of, parts) = SortedSides::new(&work).parts(work.triangles.len());
    report.parts = parts;
    let buried = turn_parts(&mut work, &part_of, &mut report);
    (report.dropped_specks, report.dropped_buried) =
        drop_parts(&mut work, &part_of, &buried, settings.smallest_part);
    let work = work.compacted();
    let edges = SortedSides::new(&work);
    if let Some((count, [a, b])) = edges.unbalanced() {
        return Err(RepairError::Unbalanced {
            edges: count,
            near: 0.5 * (work.vertices[a as usize] + work.vertices[b as usize]),
        });
    }
    let (volume, area) = (work.volume(), work.area());
    if volume <= 1e-12 * area * area.sqrt() {
        return Err(RepairError::NoVolume { volume, area });
    }
    (report.volume, report.area) = (volume, area);
    report.kept = (work.vertices.len(), work.triangles.len());
    (report.min, report.max) = (work.bounds().min, work.bounds().max);
    if edges.non_manifold() == 0 {
        let kept = parts - report.dropped_specks - report.dropped_buried;
        report.genus = edges.genus(&work, kept);
    }
    if settings.find_self_intersections {
        let crossing = self_intersections(&work, &Hierarchy::new(&work));
        report.self_intersecting = Some(crossing.len());
    }
    Ok((work, report))
}

/// The error of a surface that comes back to itself turned over at a triangle.
fn one_sided(mesh: &Mesh, triangle: u32) -> RepairError {
    let corners = mesh.corners(triangle as usize);
    RepairError::OneSided {
        near: corners.into_iter().sum::<DVec3>() / 3.0,
    }
}

fn validate(mesh: &Mesh) -> Result<(), RepairError> {
    if let Some(vertex) = mesh.vertices.iter().position(|v| !v.is_finite()) {
        return Err(RepairError::NotFinite { vertex });
    }
    let vertex_count = mesh.vertices.len();
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|v| **v as usize >= vertex_count) {
            return Err(RepairError::IndexOutOfRange {
                triangle,
                vertex,
                vertex_count,
            });
        }
    }
    if mesh.triangles.is_empty() {
        return Err(RepairError::Empty { dropped: 0 });
    }
    Ok(())
}

/// Joins vertices within `tolerance` of an earlier one; returns how many.
#[allow(
    clippy::cast_possible_truncation,
    reason = "cells of a grid, saturating"
)]
fn weld(mesh: &mut Mesh, tolerance: f64) -> usize {
    let cell = if tolerance > 0.0 {
        4.0 * tolerance
    } else {
        f64::MIN_POSITIVE
    };
    let origin = mesh.bounds().min;
    let mut grid: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut new_index = Vec::with_capacity(mesh.vertices.len());
    let mut vertices: Vec<DVec3> = Vec::new();
    for &p in &mesh.vertices {
        let key = |x: DVec3| ((x - origin) / cell).floor().to_array().map(|c| c as i64);
        let (low, high) = (key(p - tolerance), key(p + tolerance));
        let axis = |axis: usize| low[axis]..=high[axis];
        let cells =
            axis(0).flat_map(|x| axis(1).flat_map(move |y| axis(2).map(move |z| [x, y, z])));
        let near = cells.filter_map(|cell| grid.get(&cell)).flatten();
        let near =
            near.filter(|v| vertices[**v as usize].distance_squared(p) <= tolerance * tolerance);
        let found = near.min().copied().unwrap_or_else(|| index(vertices.len()));
        if found as usize == vertices.len() {
            vertices.push(p);
            grid.entry(key(p)).or_default().push(found);
        }
        new_index.push(found);
    }
    let welded = mesh.vertices.len() - vertices.len();
    mesh.vertices = vertices;
    for v in mesh.triangles.iter_mut().flatten() {
        *v = new_index[*v as usize];
    }
    welded
}

/// Drops triangles with equal corners, and repeated ones; returns how many of each.
fn drop_bad(mesh: &mut Mesh) -> (usize, usize) {
    let before = mesh.triangles.len();
    mesh.triangles
        .retain(|[a, b, c]| a != b && b != c && c != a);
    let degenerate = before - mesh.triangles.len();
    let mut seen = HashSet::with_capacity(mesh.triangles.len());
    mesh.triangles.retain(|corners| {
        let mut key = *corners;
        key.sort_unstable();
        seen.insert(key)
    });
    (degenerate, before - degenerate - mesh.triangles.len())
}

/// Closes holes up to a fraction of the box's diagonal round with a fan around their middle; returns how many, and the largest.
fn close_holes(mesh: &mut Mesh, share: f64, diagonal: f64) -> Result<(usize, f64), RepairError> {
    let limit = share * diagonal;
    let loops = boundary_loops(&SortedSides::new(mesh));
    let mut largest: (f64, DVec3) = (0.0, DVec3::ZERO);
    for ring in &loops {
        let perimeter: f64 = (0..ring.len())
            .map(|k| {
                let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
                mesh.vertices[a as usize].distance(mesh.vertices[b as usize])
            })
            .sum();
        if perimeter > largest.0 {
            largest = (perimeter, mesh.vertices[ring[0] as usize]);
        }
    }
    if largest.0 > limit {
        return Err(RepairError::Open {
            holes: loops.len(),
            perimeter: largest.0,
            near: largest.1,
            limit,
            share: largest.0 / diagonal,
        });
    }
    for ring in &loops {
        if let [a, b, c] = ring[..] {
            mesh.triangles.push([a, b, c]);
            continue;
        }
        let middle: DVec3 = ring.iter().map(|v| mesh.vertices[*v as usize]).sum();
        let middle = middle / ring.len() as f64;
        let center = index(mesh.vertices.len());
        mesh.vertices.push(middle);
        for (k, &a) in ring.iter().enumerate() {
            mesh.triangles.push([a, ring[(k + 1) % ring.len()], center]);
        }
    }
    Ok((loops.len(), largest.0))
}

/// Turns outermost parts that are inside out, and what lies in them with them. A part adds to the body
/// if it parts inside from outside; whether each part adds nothing.
fn turn_parts(mesh: &mut Mesh, part_of: &[u32], report: &mut MeshReport) -> Vec<bool> {
    let parts = report.parts;
    let mut pieces: Vec<Mesh> = vec![Mesh::default(); parts];
    for (t, &part) in part_of.iter().enumerate() {
        let piece = &mut pieces[part as usize];
        let first = index(piece.vertices.len());
        piece.vertices.extend(mesh.corners(t));
        piece.triangles.push([first, first + 1, first + 2]);
    }
    let bounds: Vec<Bounds> = pieces.iter().map(Mesh::bounds).collect();
    let volumes: Vec<f64> = pieces.iter().map(Mesh::volume).collect();
    let contains = |outer: usize, inner: usize| {
        let (o, i) = (&bounds[outer], &bounds[inner]);
        o.min.cmple(i.min).all()
            && o.max.cmpge(i.max).all()
            && volumes[outer].abs() > volumes[inner].abs()
            && lies_in(&pieces[inner], &pieces[outer])
    };
    let around: Vec<Vec<usize>> = (0..parts)
        .map(|part| {
            let others = (0..parts).filter(|other| *other != part);
            others.filter(|other| contains(*other, part)).collect()
        })
        .collect();
    let turn: Vec<bool> = (0..parts)
        .map(|part| {
            // The outermost part around: the largest that contains this one.
            let root = around[part]
                .iter()
                .max_by(|a, b| volumes[**a].abs().total_cmp(&volumes[**b].abs()));
            volumes[root.copied().unwrap_or(part)] < 0.0
        })
        .collect();
    let outward = |part: usize| (volumes[part] < 0.0) == turn[part];
    let mut buried = vec![false; parts];
    for part in 0..parts {
        let winding: i32 = around[part]
            .iter()
            .map(|other| if outward(*other) { 1 } else { -1 })
            .sum();
        // Inside is where the winding number is 1 or more.
        let within = winding + if outward(part) { 1 } else { -1 };
        buried[part] = (winding >= 1) == (within >= 1);
        report.cavities += usize::from(!outward(part) && !buried[part]);
    }
    for (triangle, part) in mesh.triangles.iter_mut().zip(part_of) {
        if turn[*part as usize] {
            triangle.swap(1, 2);
        }
    }
    report.turned_parts = turn.iter().filter(|t| **t).count();
    buried
}

/// Whether most of a few points of one part lie inside another; single ones may lie on it.
fn lies_in(inner: &Mesh, outer: &Mesh) -> bool {
    let step = (inner.triangles.len() / SAMPLES).max(1);
    let inside = (0..SAMPLES)
        .map(|k| {
            let corners = inner.corners(k * step % inner.triangles.len());
            corners.into_iter().sum::<DVec3>() / 3.0
        })
        .filter(|p| winding_number(outer, *p).abs() > 0.5)
        .count();
    2 * inside > SAMPLES
}

/// Drops parts of less than `fraction` of the largest part's volume, and those that add nothing; returns
/// how many of each.
fn drop_parts(mesh: &mut Mesh, part_of: &[u32], buried: &[bool], fraction: f64) -> (usize, usize) {
    let origin = mesh.bounds().center();
    let mut volumes = vec![0.0; buried.len()];
    for (t, part) in part_of.iter().enumerate() {
        let [a, b, c] = mesh.corners(t).map(|p| p - origin);
        volumes[*part as usize] += a.dot(b.cross(c)) / 6.0;
    }
    let largest = volumes.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let is_speck = |part: usize| volumes[part].abs() < fraction * largest;
    let mut parts = part_of.iter().map(|part| *part as usize);
    let stays = |part: usize| !is_speck(part) && !buried[part];
    mesh.triangles.retain(|_| parts.next().is_some_and(stays));
    let specks = (0..buried.len()).filter(|part| is_speck(*part)).count();
    let others = (0..buried.len()).filter(|part| buried[*part] && !is_speck(*part));
    (specks, others.count())
}
