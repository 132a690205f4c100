//! Cuts in space: triangle strips that grow as blades move.

use std::ops::{ControlFlow, Range};

use glam::DVec3;

use crate::bounds::Bounds;
use crate::edges::{DiffractionPoint, Edges};
use crate::error::CutError;
use crate::forest::Forest;
use crate::index32;
use crate::predicate::{normal_signs, segment_crosses_triangle};

/// Lengths that a cut needs to know.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CutSettings {
    /// A new point this near to a vertex becomes that vertex, and one this near to a face of an earlier
    /// piece goes a little through that face (m). Closes the gap between two strokes and lets a blade that
    /// stands still make no triangles.
    pub weld_tolerance: f64,
    /// Distance (m) over which nodes are coupled, about: paths bend around nearly flat edges of triangles
    /// that are smaller than an eighth of it.
    pub influence_radius: f64,
}

impl CutSettings {
    /// Settings for nodes `spacing` apart (m): welding within a tenth of it, which is 0.05 of the
    /// distance over which nodes are coupled.
    #[must_use]
    pub fn for_spacing(spacing: f64) -> Self {
        Self {
            weld_tolerance: 0.1 * spacing,
            influence_radius: 2.0 * spacing,
        }
    }

    fn check(&self) {
        let (radius, tolerance) = (self.influence_radius, self.weld_tolerance);
        let is_radius = radius > 0.0 && radius.is_finite();
        assert!(is_radius, "influence radius of {radius} is not positive");
        let is_length = tolerance >= 0.0 && tolerance.is_finite();
        assert!(is_length, "weld tolerance of {tolerance} is not a length");
    }
}

#[derive(Debug, Clone)]
struct Stroke {
    /// Where the blade was put in (m); empty once it has moved.
    start: Vec<DVec3>,
    /// Vertices of the last blade edge, from its first move on.
    blade: Vec<u32>,
    ended: bool,
}

/// All cuts of one body, as one set of triangles in material coordinates.
///
/// `start` puts a blade in, each `append` spans a strip from the blade's last position to its new one, `end` lifts
/// it. Several strokes may be open at once; they may cross, branch, close, fold and leave the body. Points within
/// the weld tolerance become one, so a blade that stands still makes nothing, and one that is lifted and put back
/// close by leaves no gap. A point that stops within the tolerance of a face of an earlier piece goes 0.3
/// tolerances through that face. Triangles without area and triangles that are there already are ignored.
///
/// In the plane: nodes at z = 0 and upright blades that are longer than nodes are coupled.
///
/// Crossings are exact under one rule for ties: all query points are thought moved by the same infinitesimal
/// vector `(e, e², e³)`. A node exactly on a cut belongs to the side of larger x; where the cut contains the x
/// direction, of larger y, then z. Crossings do not depend on the order or direction of triangles.
///
/// Not joined: an older cut whose end a newer face passes within the tolerance, as only new points move. They move
/// by up to 1.3 tolerances. A cut holds about 1 kB per triangle.
///
/// # Examples
/// ```
/// use phyxel_enrich::glam::DVec3;
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
    strokes: Vec<Stroke>,
    edges: Edges,
    pub(crate) vertex_index: Forest,
    forest: Forest,
}

impl Cuts {
    /// No cut yet.
    ///
    /// # Panics
    /// If the influence radius is not positive or the weld tolerance is negative, infinite or NaN.
    #[must_use]
    pub fn new(settings: &CutSettings) -> Self {
        settings.check();
        Self {
            settings: *settings,
            vertices: Vec::new(),
            triangles: Vec::new(),
            strokes: Vec::new(),
            edges: Edges::default(),
            vertex_index: Forest::default(),
            forest: Forest::default(),
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

    /// Starts a stroke with the blade edge at this position and gives its number.
    ///
    /// # Arguments
    /// * `blade` -- polyline along the blade's edge in material coordinates (m), at least 2 points.
    ///
    /// # Errors
    /// [`CutError::TooFewPoints`] and [`CutError::NotFinite`].
    pub fn start(&mut self, blade: &[DVec3]) -> Result<usize, CutError> {
        check_edge(blade)?;
        self.strokes.push(Stroke {
            start: blade.to_vec(),
            blade: Vec::new(),
            ended: false,
        });
        Ok(self.strokes.len() - 1)
    }

    /// Moves the blade of a stroke and spans the strip between its last position and this one.
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
        check_edge(blade)?;
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
                self.add([old[i], old[i + 1], new[j]]);
                i += 1;
            } else {
                self.add([new[j], old[i], new[j + 1]]);
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

    /// Adds any triangles at once.
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

    /// As [`Cuts::add_surface`]; also the positions (m) that the vertices came to.
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
        let weld = |&p: &DVec3| {
            let known = self.vertex_near(p, weld_tolerance);
            known.unwrap_or_else(|| self.new_vertex(p))
        };
        let welded: Vec<u32> = vertices.iter().map(weld).collect();
        for corners in triangles {
            self.add(corners.map(|c| welded[c as usize]));
        }
        let places = welded.iter().map(|&v| self.vertices[v as usize]);
        Ok((first..self.triangles.len(), places.collect()))
    }

    /// Removes what was added since the cut had so many vertices and triangles ([`Cuts::surface`]): the cut answers
    /// and grows as it would have then. Strokes that have moved since are ended. As slow as adding what stays.
    ///
    /// # Panics
    /// If the cut has fewer of them.
    pub fn truncate(&mut self, vertices: usize, triangles: usize) {
        if (vertices, triangles) == (self.vertices.len(), self.triangles.len()) {
            return;
        }
        let old = std::mem::replace(self, Self::new(&self.settings));
        for &point in &old.vertices[..vertices] {
            self.new_vertex(point);
        }
        for &corners in &old.triangles[..triangles] {
            self.push(corners);
        }
        self.strokes = old.strokes;
        for stroke in &mut self.strokes {
            stroke.ended |= stroke.blade.iter().any(|&v| v as usize >= vertices);
        }
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

    /// The edge at which the cut ends that is nearest to a point, and its point there, if there is one
    /// within a distance. Of edges that meet at that point it is the one most across the path to it.
    pub(crate) fn nearest_free_edge(
        &self,
        point: DVec3,
        within: f64,
    ) -> Option<([DVec3; 2], DVec3)> {
        self.edges.nearest_free(&self.vertices, point, within)
    }

    /// Whether the segment `ab` (m, material coordinates) crosses the cut.
    ///
    /// Exact, and true for all coordinates that are finite: no tolerance is involved.
    #[must_use]
    pub fn crosses(&self, a: DVec3, b: DVec3) -> bool {
        self.forest.crossed(a, b)
    }

    /// Number of triangles that the segment `ab` crosses.
    pub(crate) fn crossings(&self, a: DVec3, b: DVec3) -> usize {
        let mut count = 0;
        let _ = self.forest.on_segment(a, b, |_, &[p, q, r]| {
            count += usize::from(segment_crosses_triangle(a, b, p, q, r));
            ControlFlow::Continue(())
        });
        count
    }

    /// Whether the segment `ab` crosses one triangle.
    pub(crate) fn triangle_crosses(&self, triangle: usize, a: DVec3, b: DVec3) -> bool {
        let [p, q, r] = self.triangle(triangle);
        Bounds::of(&[a, b]).meets(&Bounds::of(&[p, q, r]))
            && segment_crosses_triangle(a, b, p, q, r)
    }

    /// Numbers of the edges that a path may bend around and that may meet the box, sorted, each once; replaces what
    /// `out` held. Gives whether the cut may end in the box: false only if an even number of triangles meets at each
    /// of its edges there.
    pub(crate) fn diffraction_edges_into(&self, near: &Bounds, out: &mut Vec<u32>) -> bool {
        self.edges.diffraction_edges_into(near, out)
    }

    /// The shortest path over one of these edges.
    pub(crate) fn diffraction_point(&self, edge: u32, a: DVec3, b: DVec3) -> DiffractionPoint {
        self.edges.diffraction_point(&self.vertices, edge, a, b)
    }

    /// Bytes held on the heap, about.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.vertices.capacity() * 24
            + self.triangles.capacity() * 12
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

    pub(crate) fn weld_tolerance(&self) -> f64 {
        self.settings.weld_tolerance
    }

    /// Whether a vertex is one of the stroke's last edge.
    pub(crate) fn is_in_front(&self, stroke: usize, vertex: u32) -> bool {
        self.strokes[stroke].blade.contains(&vertex)
    }

    /// Whether a triangle has a corner on the stroke's last edge.
    pub(crate) fn hangs_on_front(&self, stroke: usize, triangle: u32) -> bool {
        let mut corners = self.triangles[triangle as usize].iter();
        corners.any(|&v| self.is_in_front(stroke, v))
    }

    /// Calls `f` with the number of each triangle whose box meets `near`.
    pub(crate) fn faces_in(&self, near: &Bounds, f: impl FnMut(u32)) {
        self.forest.in_box(near, f);
    }

    /// Lengths along a polyline as fractions of the whole.
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

    fn add(&mut self, corners: [u32; 3]) {
        let [p, q, r] = corners.map(|v| self.vertices[v as usize]);
        if normal_signs(p, q, r) != [0; 3] && !self.edges.has(&self.vertices, corners) {
            self.push(corners);
        }
    }

    fn push(&mut self, corners: [u32; 3]) {
        let triangle = index32(self.triangles.len());
        self.triangles.push(corners);
        let places = corners.map(|v| self.vertices[v as usize]);
        self.forest.insert(triangle, places);
        self.edges
            .add(&self.vertices, corners, self.settings.influence_radius);
    }
}

fn check_edge(blade: &[DVec3]) -> Result<(), CutError> {
    check_points(blade)?;
    match blade.len() {
        found @ ..2 => Err(CutError::TooFewPoints { found }),
        _ => Ok(()),
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
