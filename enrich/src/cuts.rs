//! Cuts in space: triangle strips that grow as blades move.

use std::ops::{ControlFlow, Range};

use glam::DVec3;

use crate::bounds::Bounds;
use crate::cut_rule::CutRule;
use crate::edges::Edges;
use crate::error::CutError;
use crate::face::nearest_on_triangle;
use crate::forest::Forest;
use crate::front::SKIN;
use crate::index32;
use crate::polyline::span;
use crate::predicate::{normal_signs, segment_crosses_triangle};

/// Lengths that a cut needs to know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutSettings {
    /// A new point this near to a vertex becomes that vertex (m). Closes the gap between two strokes and lets a
    /// blade that stands still make no triangles.
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
            weld_tolerance: SKIN * spacing,
            influence_radius: CutRule::INFLUENCE_RADIUS * spacing,
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
struct CutStroke {
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
/// close by leaves no gap. Triangles without area and triangles that are there already are ignored.
///
/// In the plane: nodes at z = 0 and upright blades that are longer than nodes are coupled.
///
/// Crossings are exact under one rule for ties: all query points are thought moved by the same infinitesimal
/// vector `(e, e², e³)`. A node exactly on a cut belongs to the side of larger x; where the cut contains the x
/// direction, of larger y, then z. Crossings do not depend on the order or direction of triangles.
///
/// Not joined: faces. A stroke that is to end at an older face must reach it or go through it; one that stops a little short
/// of it may leave pairs between, which [`Cuts::carry_through`] closes. A cut holds about 1 kB per triangle.
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
    triangles: Vec<[u32; 3]>,
    strokes: Vec<CutStroke>,
    pub(crate) edges: Edges,
    vertex_index: Forest,
    pub(crate) forest: Forest,
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
        self.strokes.push(CutStroke {
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
            self.strokes[stroke].blade = start.into_iter().map(|p| self.welded(p)).collect();
        }
        let old = self.strokes[stroke].blade.clone();
        let new: Vec<u32> = blade.iter().map(|&p| self.welded(p)).collect();
        let first = self.triangles.len();
        let by_length = old.len() != new.len();
        let [before, now] = [&old, &new].map(|line| self.placed(line, by_length));
        span(&before, &now, |corners| self.add(corners));
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
        let mut places = vertices.to_vec();
        self.add_welded(&mut places, triangles, (&[], 0.0))
    }

    /// As [`Cuts::add_surface`]; the vertices become the positions that they came to. To some vertices (m) points weld only within
    /// a distance (m) of their own.
    pub(crate) fn add_welded(
        &mut self,
        vertices: &mut [DVec3],
        triangles: &[[u32; 3]],
        own: (&[DVec3], f64),
    ) -> Result<Range<usize>, CutError> {
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
        let welded: Vec<u32> = vertices.iter().map(|&p| self.welded_but(p, own)).collect();
        for corners in triangles {
            self.add(corners.map(|c| welded[c as usize]));
        }
        for (vertex, welded) in vertices.iter_mut().zip(welded) {
            *vertex = self.edges.vertices[welded as usize];
        }
        Ok(first..self.triangles.len())
    }

    /// Removes what was added since the cut had so many vertices and triangles ([`Cuts::surface`]): the cut answers
    /// and grows as it would have then. Strokes that have moved since are ended. As slow as adding what stays.
    ///
    /// # Panics
    /// If the cut has fewer of them.
    pub fn truncate(&mut self, vertices: usize, triangles: usize) {
        if (vertices, triangles) == (self.edges.vertices.len(), self.triangles.len()) {
            return;
        }
        let old = std::mem::replace(self, Self::new(&self.settings));
        for &point in &old.edges.vertices[..vertices] {
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
        self.triangles[triangle].map(|v| self.edges.vertices[v as usize])
    }

    /// Vertices (m) and triangles as numbers of vertices, for drawing and files.
    #[must_use]
    pub fn surface(&self) -> (&[DVec3], &[[u32; 3]]) {
        (&self.edges.vertices, &self.triangles)
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

    /// Nearest point (m) of the cut within a distance, and its distance (m).
    pub(crate) fn nearest(&self, point: DVec3, within: f64) -> Option<(DVec3, f64)> {
        let mut near = Vec::new();
        let around = Bounds::of(&[point]).grown(within);
        self.forest.in_box(&around, |triangle| near.push(triangle));
        near.sort_unstable();
        let mut best: Option<(f64, f64, DVec3)> = None;
        for triangle in near {
            let at = nearest_on_triangle(self.triangle(triangle as usize), point);
            let distance = at.distance(point);
            if distance > within {
                continue;
            }
            // Of several triangles that share the nearest point the one seen most from above
            // decides: near an edge the others are seen from behind.
            let normal = self.normal(triangle as usize);
            let height = (point - at).normalize_or_zero().dot(normal).abs();
            let nearer = best.is_none_or(|(d, h, _)| {
                let tie = 1e-12 * (d + distance);
                distance < d - tie || (distance <= d + tie && height > h)
            });
            if nearer {
                best = Some((distance, height, at));
            }
        }
        best.map(|(distance, _, at)| (at, distance))
    }

    /// Whether the segment `ab` crosses one triangle.
    pub(crate) fn triangle_crosses(&self, triangle: usize, a: DVec3, b: DVec3) -> bool {
        let [p, q, r] = self.triangle(triangle);
        Bounds::of(&[a, b]).meets(&Bounds::of(&[p, q, r]))
            && segment_crosses_triangle(a, b, p, q, r)
    }

    /// Bytes held on the heap, about.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.triangles.capacity() * 12
            + self.edges.bytes()
            + self.vertex_index.bytes()
            + self.forest.bytes()
    }

    /// Distance of the nodes (m), about.
    pub(crate) fn spacing(&self) -> f64 {
        0.5 * self.settings.influence_radius
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

    /// The nearest vertex within the tolerance; else a new one.
    pub(crate) fn welded(&mut self, point: DVec3) -> u32 {
        self.welded_but(point, (&[], 0.0))
    }

    fn welded_but(&mut self, point: DVec3, (own, least): (&[DVec3], f64)) -> u32 {
        let tolerance = self.settings.weld_tolerance;
        let mut best: Option<(f64, u32)> = None;
        let near = Bounds::of(&[point]).grown(tolerance);
        self.vertex_index.in_box(&near, |vertex| {
            let place = self.edges.vertices[vertex as usize];
            let distance = place.distance(point);
            let joins = distance <= tolerance && (distance <= least || !own.contains(&place));
            if joins && best.is_none_or(|found| (distance, vertex) < found) {
                best = Some((distance, vertex));
            }
        });
        best.map_or_else(|| self.new_vertex(point), |(_, vertex)| vertex)
    }

    fn new_vertex(&mut self, point: DVec3) -> u32 {
        let vertex = index32(self.edges.vertices.len());
        self.edges.vertices.push(point);
        self.vertex_index.insert(vertex, [point; 3]);
        vertex
    }

    /// Vertices of a polyline with their positions along it: by length, as fractions of the whole, or by number.
    fn placed(&self, line: &[u32], by_length: bool) -> Vec<(f64, u32)> {
        if !by_length {
            return (0..).map(f64::from).zip(line.iter().copied()).collect();
        }
        let at = |vertex: u32| self.edges.vertices[vertex as usize];
        let mut placed: Vec<(f64, u32)> = vec![(0.0, line[0])];
        for pair in line.windows(2) {
            let passed = placed[placed.len() - 1].0;
            placed.push((passed + at(pair[1]).distance(at(pair[0])), pair[1]));
        }
        let total = placed[placed.len() - 1].0;
        if total > 0.0 {
            placed.iter_mut().for_each(|(length, _)| *length /= total);
        }
        placed
    }

    pub(crate) fn add(&mut self, corners: [u32; 3]) {
        let [p, q, r] = corners.map(|v| self.edges.vertices[v as usize]);
        if normal_signs(p, q, r) != [0; 3] && !self.edges.has(corners) {
            self.push(corners);
        }
    }

    fn push(&mut self, corners: [u32; 3]) {
        let triangle = index32(self.triangles.len());
        self.triangles.push(corners);
        let places = corners.map(|v| self.edges.vertices[v as usize]);
        self.forest.insert(triangle, places);
        self.edges.add(corners, self.settings.influence_radius);
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
