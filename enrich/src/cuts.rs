//! Cuts in space: triangle strips that grow as blades move.

use std::ops::{ControlFlow, Range};

use glam::DVec3;

use crate::edges::Edges;
use crate::error::CutError;
use crate::forest::Forest;
use crate::index::{Bounds, BoxIndex};
use crate::obstacle::{DiffractionPoint, Obstacle, index32, share_to_zero};
use crate::predicate::{normal_signs, segment_crosses_triangle};

/// Lengths that a cut needs to know.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CutSettings {
    /// A new point this near to a vertex becomes that vertex, and one this near to a face of an earlier
    /// piece goes a little through that face (m). Closes the gap between two strokes and lets a blade that
    /// stands still make no triangles. Strokes may have tolerances of their own.
    pub weld_tolerance: f64,
    /// Smallest cell of the spatial index (m); a few node spacings.
    pub index_cell: f64,
}

impl CutSettings {
    /// Settings for nodes `spacing` apart (m): welding within a tenth of it, which is 0.05 of the
    /// distance over which nodes are coupled.
    #[must_use]
    pub fn for_spacing(spacing: f64) -> Self {
        Self {
            weld_tolerance: 0.1 * spacing,
            index_cell: 2.0 * spacing,
        }
    }

    /// What both kinds of cuts ask of their settings.
    ///
    /// # Panics
    /// If the index cell is not positive or the weld tolerance is negative, infinite or NaN.
    pub(crate) fn check(&self) {
        assert!(
            self.index_cell > 0.0 && self.index_cell.is_finite(),
            "index cell of {} is not positive",
            self.index_cell
        );
        check_tolerance(self.weld_tolerance);
    }
}

fn check_tolerance(weld_tolerance: f64) {
    assert!(
        weld_tolerance >= 0.0 && weld_tolerance.is_finite(),
        "weld tolerance of {weld_tolerance} is not a length"
    );
}

/// Triangles that were not taken, by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Triangles of exactly zero area, most of them because two corners were welded.
    pub zero_area: usize,
    /// Triangles that were there already.
    pub duplicate: usize,
}

#[derive(Debug, Clone)]
struct Stroke {
    /// Where the blade was put in (m); empty once it has moved.
    start: Vec<DVec3>,
    /// Vertices of the last blade edge, from its first move on.
    blade: Vec<u32>,
    weld_tolerance: f64,
    ended: bool,
}

/// How far a cut had grown, to go back to ([`Cuts::go_back`]).
#[derive(Debug, Clone)]
pub struct CutsMark {
    vertices: usize,
    triangles: usize,
    strokes: usize,
    /// Strokes that were open, whose blades may have moved since.
    open: Vec<(usize, Stroke)>,
    settings: CutSettings,
    dropped: Dropped,
}

impl CutsMark {
    /// Number of triangles there were.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangles
    }
}

/// All cuts of one body, as one set of triangles in material coordinates.
///
/// Several strokes may be open at once; they may cross, branch, close, fold and leave the body. See
/// the crate's page for what a stroke is.
///
/// # Examples
/// ```
/// use glam::DVec3;
/// use phyxel_enrich::{CutSettings, Cuts};
///
/// let mut cuts = Cuts::new(&CutSettings::for_spacing(0.1));
/// let blade = |x: f64| [DVec3::new(x, 0.0, -1.0), DVec3::new(x, 0.0, 1.0)];
/// let stroke = cuts.start(&blade(0.0))?;
/// assert_eq!(cuts.append(stroke, &blade(1.0))?, 0..2);
/// cuts.end(stroke)?;
/// assert!(cuts.crosses(DVec3::new(0.5, -0.1, 0.0), DVec3::new(0.5, 0.1, 0.0)));
/// # Ok::<(), phyxel_enrich::CutError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Cuts {
    settings: CutSettings,
    pub(crate) vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    stroke_of: Vec<u32>,
    strokes: Vec<Stroke>,
    edges: Edges,
    pub(crate) vertex_index: BoxIndex,
    forest: Forest,
    dropped: Dropped,
}

impl Cuts {
    /// No cut yet.
    ///
    /// # Panics
    /// If the index cell is not positive or the weld tolerance is negative, infinite or NaN.
    #[must_use]
    pub fn new(settings: &CutSettings) -> Self {
        settings.check();
        Self {
            settings: *settings,
            vertices: Vec::new(),
            triangles: Vec::new(),
            stroke_of: Vec::new(),
            strokes: Vec::new(),
            edges: Edges::default(),
            vertex_index: BoxIndex::new(settings.index_cell.max(settings.weld_tolerance)),
            forest: Forest::default(),
            dropped: Dropped::default(),
        }
    }

    /// From now on a new point this near to a vertex (m) becomes that vertex.
    ///
    /// # Panics
    /// If the tolerance is negative, infinite or NaN.
    pub fn set_weld_tolerance(&mut self, tolerance: f64) {
        self.settings.weld_tolerance = tolerance;
        self.settings.check();
    }

    /// Starts a stroke with the blade edge at this place and gives its number.
    ///
    /// # Arguments
    /// * `blade` -- polyline along the blade's edge in material coordinates (m), at least 2 points.
    ///
    /// # Errors
    /// [`CutError::TooFewPoints`] and [`CutError::NotFinite`].
    pub fn start(&mut self, blade: &[DVec3]) -> Result<usize, CutError> {
        self.start_within(blade, self.settings.weld_tolerance)
    }

    /// The same for a stroke with a weld tolerance of its own (m), in place of that of the settings.
    ///
    /// # Errors
    /// [`CutError::TooFewPoints`] and [`CutError::NotFinite`].
    ///
    /// # Panics
    /// If the tolerance is negative, infinite or NaN.
    pub fn start_within(
        &mut self,
        blade: &[DVec3],
        weld_tolerance: f64,
    ) -> Result<usize, CutError> {
        check_tolerance(weld_tolerance);
        check_points(blade)?;
        if blade.len() < 2 {
            return Err(CutError::TooFewPoints { found: blade.len() });
        }
        self.strokes.push(Stroke {
            start: blade.to_vec(),
            blade: Vec::new(),
            weld_tolerance,
            ended: false,
        });
        Ok(self.strokes.len() - 1)
    }

    /// Moves the blade of a stroke and spans the strip between its last place and this one.
    ///
    /// Polylines of the same number of points are joined point by point, others by their lengths.
    ///
    /// # Returns
    /// The new triangles, possibly none: a blade that moved less than the weld tolerance has not
    /// moved.
    ///
    /// # Errors
    /// [`CutError::TooFewPoints`], [`CutError::NotFinite`], [`CutError::UnknownStroke`] and
    /// [`CutError::StrokeEnded`]; the cut is then unchanged.
    pub fn append(&mut self, stroke: usize, blade: &[DVec3]) -> Result<Range<usize>, CutError> {
        check_points(blade)?;
        if blade.len() < 2 {
            return Err(CutError::TooFewPoints { found: blade.len() });
        }
        self.open(stroke)?;
        let start = std::mem::take(&mut self.strokes[stroke].start);
        if !start.is_empty() {
            // Only now it is known to which side of a face near by the stroke goes.
            self.strokes[stroke].blade = self.welded(stroke, &start, blade);
        }
        let old = self.strokes[stroke].blade.clone();
        let places: Vec<DVec3> = old.iter().map(|&v| self.vertices[v as usize]).collect();
        let new = self.welded(stroke, blade, &places);
        let first = self.triangles.len();
        let (along_old, along_new) = (self.parameters(&old), self.parameters(&new));
        let (mut i, mut j) = (0, 0);
        while i + 1 < old.len() || j + 1 < new.len() {
            let move_old = if j + 1 == new.len() {
                true
            } else if i + 1 == old.len() {
                false
            } else if old.len() == new.len() {
                i == j
            } else {
                along_old[i + 1] <= along_new[j + 1]
            };
            if move_old {
                self.add(stroke, [old[i], old[i + 1], new[j]]);
                i += 1;
            } else {
                self.add(stroke, [new[j], old[i], new[j + 1]]);
                j += 1;
            }
        }
        self.strokes[stroke].blade = new;
        Ok(first..self.triangles.len())
    }

    /// Ends a stroke; its triangles stay.
    ///
    /// # Errors
    /// [`CutError::UnknownStroke`] and [`CutError::StrokeEnded`].
    pub fn end(&mut self, stroke: usize) -> Result<(), CutError> {
        self.open(stroke)?;
        self.strokes[stroke].ended = true;
        Ok(())
    }

    /// Adds any triangles at once, as a stroke of their own.
    ///
    /// # Returns
    /// The new triangles.
    ///
    /// # Errors
    /// [`CutError::NotFinite`] and [`CutError::VertexOutOfRange`]; the cut is then unchanged.
    pub fn add_surface(
        &mut self,
        vertices: &[DVec3],
        triangles: &[[u32; 3]],
    ) -> Result<Range<usize>, CutError> {
        Ok(self.add_welded(vertices, triangles)?.0)
    }

    /// As [`Cuts::add_surface`]; also the places (m) that the vertices came to.
    pub(crate) fn add_welded(
        &mut self,
        vertices: &[DVec3],
        triangles: &[[u32; 3]],
    ) -> Result<(Range<usize>, Vec<DVec3>), CutError> {
        check_points(vertices)?;
        for (triangle, corners) in triangles.iter().enumerate() {
            for &vertex in corners {
                if vertex as usize >= vertices.len() {
                    return Err(CutError::VertexOutOfRange {
                        triangle,
                        vertex,
                        vertices: vertices.len(),
                    });
                }
            }
        }
        let first = self.triangles.len();
        let weld_tolerance = self.settings.weld_tolerance;
        let welded: Vec<u32> = vertices
            .iter()
            .map(|&p| {
                self.vertex_near(p, weld_tolerance)
                    .unwrap_or_else(|| self.new_vertex(p))
            })
            .collect();
        self.strokes.push(Stroke {
            start: Vec::new(),
            blade: Vec::new(),
            weld_tolerance,
            ended: true,
        });
        for corners in triangles {
            self.add(self.strokes.len() - 1, corners.map(|c| welded[c as usize]));
        }
        let places = welded.iter().map(|&v| self.vertices[v as usize]);
        Ok((first..self.triangles.len(), places.collect()))
    }

    /// How far the cut has grown so far.
    #[must_use]
    pub fn mark(&self) -> CutsMark {
        let strokes = self.strokes.iter().enumerate();
        let open = strokes.filter(|(_, stroke)| !stroke.ended);
        CutsMark {
            vertices: self.vertices.len(),
            triangles: self.triangles.len(),
            strokes: self.strokes.len(),
            open: open.map(|(k, stroke)| (k, stroke.clone())).collect(),
            settings: self.settings,
            dropped: self.dropped,
        }
    }

    /// Goes back to a mark of this cut, as if nothing had been added since. What finds triangles by place is built
    /// anew, which takes as long as adding what stays; a mark itself takes no time.
    ///
    /// # Panics
    /// If the mark is one of a longer cut.
    pub fn go_back(&mut self, mark: &CutsMark) {
        assert!(
            mark.vertices <= self.vertices.len()
                && mark.triangles <= self.triangles.len()
                && mark.strokes <= self.strokes.len(),
            "a mark of this cut"
        );
        if (mark.vertices, mark.triangles) != (self.vertices.len(), self.triangles.len()) {
            let points = std::mem::take(&mut self.vertices);
            let triangles = std::mem::take(&mut self.triangles);
            let strokes = std::mem::take(&mut self.stroke_of);
            let mut kept = Self {
                strokes: std::mem::take(&mut self.strokes),
                vertex_index: self.vertex_index.emptied(),
                ..Self::new(&mark.settings)
            };
            for &point in &points[..mark.vertices] {
                kept.new_vertex(point);
            }
            let whole = triangles.iter().zip(&strokes).take(mark.triangles);
            for (&corners, &stroke) in whole {
                kept.push(stroke, corners);
            }
            *self = kept;
        }
        self.strokes.truncate(mark.strokes);
        for (k, stroke) in &mark.open {
            self.strokes[*k] = stroke.clone();
        }
        self.settings = mark.settings;
        self.dropped = mark.dropped;
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Corners of a triangle (m, material coordinates), in the order of the strip.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[must_use]
    pub fn triangle(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Vertices (m) and triangles as numbers of vertices, for drawing and files.
    #[must_use]
    pub fn surface(&self) -> (&[DVec3], &[[u32; 3]]) {
        (&self.vertices, &self.triangles)
    }

    /// Unit normal of a triangle, by its corners' order; zero if it is too thin to have one.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[must_use]
    pub fn normal(&self, triangle: usize) -> DVec3 {
        let [p, q, r] = self.triangle(triangle);
        (q - p).cross(r - p).normalize_or_zero()
    }

    /// Area of a triangle (m²).
    ///
    /// # Panics
    /// If there is no such triangle.
    #[must_use]
    pub fn area(&self, triangle: usize) -> f64 {
        let [p, q, r] = self.triangle(triangle);
        0.5 * (q - p).cross(r - p).length()
    }

    /// Number of the stroke that made a triangle.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[must_use]
    pub fn stroke(&self, triangle: usize) -> usize {
        self.stroke_of[triangle] as usize
    }

    /// Number of strokes started, and whether one of them is still open.
    #[must_use]
    pub fn strokes(&self) -> (usize, bool) {
        (
            self.strokes.len(),
            self.strokes.iter().any(|stroke| !stroke.ended),
        )
    }

    /// End points of all edges at which the cut ends (m): those with one triangle.
    pub fn free_edges(&self) -> impl Iterator<Item = [DVec3; 2]> + '_ {
        self.edges.free(&self.vertices)
    }

    /// The edge at which the cut ends that is nearest to a point, and its point there, if there is one
    /// within a distance. Of edges that meet at that point it is the one most across the way to it.
    pub(crate) fn nearest_free_edge(
        &self,
        point: DVec3,
        within: f64,
    ) -> Option<([DVec3; 2], DVec3)> {
        self.edges.nearest_free(&self.vertices, point, within)
    }

    /// Triangles that were not taken so far.
    #[must_use]
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    /// Whether the segment `ab` (m, material coordinates) crosses the cut.
    ///
    /// Exact, and true for all coordinates that are finite: no tolerance is involved.
    #[must_use]
    pub fn crosses(&self, a: DVec3, b: DVec3) -> bool {
        self.forest.crossed(a, b)
    }

    /// Numbers of the triangles that the segment `ab` crosses, sorted; replaces what `out` held.
    pub(crate) fn crossed_into(&self, a: DVec3, b: DVec3, out: &mut Vec<u32>) {
        out.clear();
        let _ = self.forest.on_segment(a, b, |triangle, &[p, q, r]| {
            if segment_crosses_triangle(a, b, p, q, r) {
                out.push(triangle);
            }
            ControlFlow::Continue(())
        });
        out.sort_unstable();
    }

    /// Bytes held on the heap, about.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.vertices.capacity() * 24
            + self.triangles.capacity() * 16
            + self.edges.bytes()
            + self.vertex_index.bytes()
            + self.forest.bytes()
    }

    fn open(&self, stroke: usize) -> Result<(), CutError> {
        match self.strokes.get(stroke) {
            None => Err(CutError::UnknownStroke {
                stroke,
                started: self.strokes.len(),
            }),
            Some(found) if found.ended => Err(CutError::StrokeEnded { stroke }),
            Some(_) => Ok(()),
        }
    }

    pub(crate) fn stroke_tolerance(&self, stroke: usize) -> f64 {
        self.strokes[stroke].weld_tolerance
    }

    /// Whether a vertex is one of the stroke's last edge.
    pub(crate) fn is_in_front(&self, stroke: usize, vertex: u32) -> bool {
        self.strokes[stroke].blade.contains(&vertex)
    }

    /// Whether a triangle has a corner on the stroke's last edge.
    pub(crate) fn hangs_on_front(&self, stroke: usize, triangle: u32) -> bool {
        self.triangles[triangle as usize]
            .iter()
            .any(|&v| self.is_in_front(stroke, v))
    }

    /// Calls `f` with the number of each triangle whose box meets `near`.
    pub(crate) fn faces_in(&self, near: &Bounds, f: impl FnMut(u32)) {
        self.forest.in_box(near, f);
    }

    /// Lengths along a polyline as shares of the whole.
    fn parameters(&self, line: &[u32]) -> Vec<f64> {
        let at = |k: usize| self.vertices[line[k] as usize];
        let mut lengths = vec![0.0];
        for k in 1..line.len() {
            lengths.push(lengths[k - 1] + at(k).distance(at(k - 1)));
        }
        let total = lengths[line.len() - 1];
        if total > 0.0 {
            for length in &mut lengths {
                *length /= total;
            }
        }
        lengths
    }

    fn add(&mut self, stroke: usize, corners: [u32; 3]) {
        let [p, q, r] = corners.map(|v| self.vertices[v as usize]);
        if normal_signs(p, q, r) == [0; 3] {
            self.dropped.zero_area += 1;
            return;
        }
        if self.edges.has(&self.vertices, corners) {
            self.dropped.duplicate += 1;
            return;
        }
        self.push(index32(stroke), corners);
    }

    fn push(&mut self, stroke: u32, corners: [u32; 3]) {
        let triangle = index32(self.triangles.len());
        self.triangles.push(corners);
        self.stroke_of.push(stroke);
        let places = corners.map(|v| self.vertices[v as usize]);
        self.forest.insert(triangle, places);
        self.edges
            .add(&self.vertices, corners, self.settings.index_cell);
    }
}

fn check_points(points: &[DVec3]) -> Result<(), CutError> {
    match points.iter().position(|p| !p.is_finite()) {
        Some(point) => Err(CutError::NotFinite {
            point,
            position: points[point],
        }),
        None => Ok(()),
    }
}

impl Obstacle for Cuts {
    fn piece_count(&self) -> usize {
        self.triangles.len()
    }

    fn piece_bounds(&self, piece: usize) -> Bounds {
        Bounds::of(&self.triangle(piece))
    }

    fn piece_crosses(&self, piece: usize, a: DVec3, b: DVec3) -> bool {
        let [p, q, r] = self.triangle(piece);
        Bounds::of(&[a, b]).meets(&Bounds::of(&[p, q, r]))
            && segment_crosses_triangle(a, b, p, q, r)
    }

    fn crosses(&self, a: DVec3, b: DVec3) -> bool {
        Self::crosses(self, a, b)
    }

    fn crossings(&self, a: DVec3, b: DVec3) -> usize {
        let mut count = 0;
        let _ = self.forest.on_segment(a, b, |_, &[p, q, r]| {
            count += usize::from(segment_crosses_triangle(a, b, p, q, r));
            ControlFlow::Continue(())
        });
        count
    }

    fn diffraction_edges_into(&self, near: &Bounds, out: &mut Vec<u32>) -> bool {
        self.edges.diffraction_edges_into(near, out)
    }

    fn diffraction_point(&self, edge: u32, a: DVec3, b: DVec3) -> DiffractionPoint {
        self.edges.diffraction_point(&self.vertices, edge, a, b)
    }

    fn pieces_into(&self, near: &Bounds, out: &mut Vec<u32>) {
        out.clear();
        self.forest.in_box(near, |triangle| out.push(triangle));
        out.sort_unstable();
    }

    fn meeting_point(&self, piece: usize, a: DVec3, b: DVec3) -> DVec3 {
        let [p, q, r] = self.triangle(piece);
        let normal = (q - p).cross(r - p);
        let (to_a, to_b) = (normal.dot(a - p), normal.dot(b - p));
        a.lerp(b, share_to_zero(to_a, to_b))
    }

    fn edge_distance(&self, edge: u32, point: DVec3) -> f64 {
        self.edges.distance(&self.vertices, edge, point)
    }
}
