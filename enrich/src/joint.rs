//! Where a blade's new edge joins what is cut already.

use glam::DVec3;

use crate::bounds::Bounds;
use crate::cuts::Cuts;
use crate::face::{nearest_on_segment, nearest_on_triangle};
use crate::index32;
use crate::predicate::segment_crosses_triangle;

/// A point that joins a face goes through it by this fraction of the weld tolerance, by default 0.03 spacings,
/// so that no pair finds a gap of round-off, nor one where the older sheet bends a little between two
/// points of the edge: two faces a spacing wide at 6 degrees leave 0.025 spacings.
const THROUGH: f64 = 0.3;

impl Cuts {
    /// Vertices of a blade's edge, welded to what is there.
    ///
    /// # Arguments
    /// * `edge` -- the edge's points (m).
    /// * `other` -- the edge at the other side of the strip that the stroke is about to span (m).
    pub(crate) fn welded(&mut self, stroke: usize, edge: &[DVec3], other: &[DVec3]) -> Vec<u32> {
        edge.iter()
            .map(|&point| self.weld(stroke, point, other))
            .collect()
    }

    /// The nearest vertex within the tolerance; else a new one, through the nearest face that the stroke
    /// would stop short of by less than the tolerance.
    fn weld(&mut self, stroke: usize, point: DVec3, other: &[DVec3]) -> u32 {
        let tolerance = self.weld_tolerance();
        let vertex = self.vertex_near(point, tolerance);
        if tolerance == 0.0 || vertex.is_some_and(|v| !self.is_in_front(stroke, v)) {
            return vertex.unwrap_or_else(|| self.new_vertex(point));
        }
        let from = nearest_on_polyline(other, point);
        let Some((face, crossed)) = self.face_near(stroke, from, point, tolerance) else {
            return vertex.unwrap_or_else(|| self.new_vertex(point));
        };
        let gap = face.distance(point);
        if let Some(v) = vertex {
            // The blade has moved less than the tolerance: only if it comes nearer to the face, and is
            // not through it, is there something to join.
            let before = self.face_near(stroke, from, self.vertices[v as usize], tolerance);
            if crossed
                || before.is_some_and(|(face, _)| {
                    face.distance(self.vertices[v as usize]) <= gap.max(THROUGH * tolerance)
                })
            {
                return v;
            }
        }
        if crossed {
            return self.new_vertex(point);
        }
        let along = if gap > 1e-3 * THROUGH * tolerance {
            face - point
        } else {
            point - from
        };
        self.new_vertex(face + THROUGH * tolerance * along.normalize_or_zero())
    }

    /// The nearest point, within the tolerance, of a face that does not hang on the stroke's last edge;
    /// and whether the path from `from` to the point crosses such a face there.
    fn face_near(
        &self,
        stroke: usize,
        from: DVec3,
        point: DVec3,
        tolerance: f64,
    ) -> Option<(DVec3, bool)> {
        let mut best: Option<(f64, u32, DVec3)> = None;
        let mut crossed = false;
        self.faces_in(&Bounds::of(&[point]).grown(tolerance), |number| {
            if self.hangs_on_front(stroke, number) {
                return;
            }
            let [p, q, r] = self.triangle(number as usize);
            let at = nearest_on_triangle([p, q, r], point);
            let distance = at.distance(point);
            if distance <= tolerance {
                crossed |= segment_crosses_triangle(from, point, p, q, r);
                if best.is_none_or(|(d, k, _)| (distance, number) < (d, k)) {
                    best = Some((distance, number, at));
                }
            }
        });
        best.map(|(_, _, at)| (at, crossed))
    }

    /// The nearest vertex within the tolerance.
    pub(crate) fn vertex_near(&self, point: DVec3, tolerance: f64) -> Option<u32> {
        let mut best: Option<(f64, u32)> = None;
        let near = Bounds::of(&[point]).grown(tolerance);
        self.vertex_index.in_box(&near, |vertex| {
            let distance = self.vertices[vertex as usize].distance(point);
            if distance <= tolerance && best.is_none_or(|found| (distance, vertex) < found) {
                best = Some((distance, vertex));
            }
        });
        best.map(|(_, vertex)| vertex)
    }

    pub(crate) fn new_vertex(&mut self, point: DVec3) -> u32 {
        let vertex = index32(self.vertices.len());
        self.vertices.push(point);
        self.vertex_index.insert(vertex, [point; 3]);
        vertex
    }
}

fn nearest_on_polyline(line: &[DVec3], point: DVec3) -> DVec3 {
    line.windows(2)
        .map(|ends| nearest_on_segment([ends[0], ends[1]], point))
        .min_by(|p, q| p.distance(point).total_cmp(&q.distance(point)))
        .unwrap_or(point)
}
