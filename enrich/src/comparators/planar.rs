//! Cuts in the plane: polylines that grow point by point.

use std::ops::ControlFlow;

use glam::{DVec2, DVec3};

use crate::cuts::{CutSettings, Dropped};
use crate::error::CutError;
use crate::index::{Bounds, BoxIndex, CellMap};
use crate::obstacle::{DiffractionPoint, Obstacle, index32, outward, share_to_zero};
use crate::predicate::segments_cross;

#[derive(Debug, Clone)]
struct Corner {
    at: DVec2,
    /// Ends of the segments that start here.
    others: Vec<u32>,
    outward: DVec3,
}

/// All cuts of one plane body, as one set of segments in material coordinates.
///
/// The same rules as [`Cuts`](crate::Cuts). Where arguments are points in space, z is ignored.
///
/// # Examples
/// ```
/// use glam::{DVec2, DVec3};
/// use phyxel_enrich::{CutSettings, Obstacle, PlanarCuts};
///
/// let mut cuts = PlanarCuts::new(&CutSettings::for_spacing(0.1));
/// let stroke = cuts.start(DVec2::ZERO)?;
/// assert_eq!(cuts.append(stroke, DVec2::X)?, Some(0));
/// assert!(cuts.crosses(DVec3::new(0.5, -0.1, 0.0), DVec3::new(0.5, 0.1, 0.0)));
/// # Ok::<(), phyxel_enrich::CutError>(())
/// ```
#[derive(Debug, Clone)]
pub struct PlanarCuts {
    settings: CutSettings,
    corners: Vec<Corner>,
    segments: Vec<[u32; 2]>,
    /// Last corner of each stroke and whether it has ended.
    strokes: Vec<(u32, bool)>,
    known: CellMap<[u32; 2], ()>,
    corner_index: BoxIndex,
    segment_index: BoxIndex,
    dropped: Dropped,
}

impl PlanarCuts {
    /// No cut yet.
    ///
    /// # Panics
    /// If the index cell is not positive or the weld tolerance is negative, infinite or NaN.
    #[must_use]
    pub fn new(settings: &CutSettings) -> Self {
        settings.check();
        Self {
            settings: *settings,
            corners: Vec::new(),
            segments: Vec::new(),
            strokes: Vec::new(),
            known: CellMap::default(),
            corner_index: BoxIndex::new(settings.index_cell.max(settings.weld_tolerance)),
            segment_index: BoxIndex::new(settings.index_cell),
            dropped: Dropped::default(),
        }
    }

    /// Starts a stroke at a point (m) and gives its number.
    ///
    /// # Errors
    /// [`CutError::NotFinite`].
    pub fn start(&mut self, point: DVec2) -> Result<usize, CutError> {
        check(point)?;
        let corner = self.weld(point);
        self.strokes.push((corner, false));
        Ok(self.strokes.len() - 1)
    }

    /// Moves the blade of a stroke to a point (m) and gives the number of the new segment, if the
    /// blade has moved more than the weld tolerance and the segment is not there yet.
    ///
    /// # Errors
    /// [`CutError::NotFinite`], [`CutError::UnknownStroke`] and [`CutError::StrokeEnded`].
    pub fn append(&mut self, stroke: usize, point: DVec2) -> Result<Option<usize>, CutError> {
        check(point)?;
        let last = self.open(stroke)?;
        let corner = self.weld(point);
        self.strokes[stroke].0 = corner;
        if corner == last {
            self.dropped.zero_area += 1;
            return Ok(None);
        }
        let key = [corner.min(last), corner.max(last)];
        if self.known.insert(key, ()).is_some() {
            self.dropped.duplicate += 1;
            return Ok(None);
        }
        let segment = self.segments.len();
        self.segments.push([last, corner]);
        let ends = self.segment(segment).map(|p| p.extend(0.0));
        self.segment_index
            .insert(index32(segment), Bounds::of(&ends));
        self.corners[last as usize].others.push(corner);
        self.corners[corner as usize].others.push(last);
        for c in [last, corner] {
            let at = self.corners[c as usize].at.extend(0.0);
            let others = &self.corners[c as usize].others;
            let mut inward: Vec<(DVec3, DVec3)> = others
                .iter()
                .map(|&o| self.corners[o as usize].at.extend(0.0))
                .map(|other| (other, other - at))
                .collect();
            self.corners[c as usize].outward = outward(&mut inward, self.settings.index_cell);
        }
        Ok(Some(segment))
    }

    /// Ends a stroke; its segments stay.
    ///
    /// # Errors
    /// [`CutError::UnknownStroke`] and [`CutError::StrokeEnded`].
    pub fn end(&mut self, stroke: usize) -> Result<(), CutError> {
        self.open(stroke)?;
        self.strokes[stroke].1 = true;
        Ok(())
    }

    /// Adds a whole polyline as a stroke of its own and gives the new segments.
    ///
    /// # Errors
    /// [`CutError::NotFinite`] and [`CutError::TooFewPoints`]; the cut is then unchanged.
    pub fn add_polyline(&mut self, points: &[DVec2]) -> Result<std::ops::Range<usize>, CutError> {
        for (point, &at) in points.iter().enumerate() {
            check(at).map_err(|_| CutError::NotFinite {
                point,
                position: at.extend(0.0),
            })?;
        }
        let (Some(&first), true) = (points.first(), points.len() > 1) else {
            return Err(CutError::TooFewPoints {
                found: points.len(),
            });
        };
        let before = self.segments.len();
        let stroke = self.start(first)?;
        for &point in &points[1..] {
            self.append(stroke, point)?;
        }
        self.end(stroke)?;
        Ok(before..self.segments.len())
    }

    /// Number of segments.
    #[must_use]
    pub fn segment_count(&self) -> usize {
        self.segments.len()
    }

    /// End points of a segment (m).
    ///
    /// # Panics
    /// If there is no such segment.
    #[must_use]
    pub fn segment(&self, segment: usize) -> [DVec2; 2] {
        self.segments[segment].map(|c| self.corners[c as usize].at)
    }

    /// Points at which the cut ends (m): those with one segment.
    pub fn tips(&self) -> impl Iterator<Item = DVec2> + '_ {
        self.corners
            .iter()
            .filter(|corner| corner.others.len() == 1)
            .map(|corner| corner.at)
    }

    /// Segments that were not taken so far; zero length is counted as zero area.
    #[must_use]
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    fn open(&self, stroke: usize) -> Result<u32, CutError> {
        match self.strokes.get(stroke) {
            None => Err(CutError::UnknownStroke {
                stroke,
                started: self.strokes.len(),
            }),
            Some((_, true)) => Err(CutError::StrokeEnded { stroke }),
            Some(&(corner, false)) => Ok(corner),
        }
    }

    fn weld(&mut self, point: DVec2) -> u32 {
        let tolerance = self.settings.weld_tolerance;
        let mut best: Option<(f64, u32)> = None;
        let at = Bounds::of(&[point.extend(0.0)]);
        let _ = self.corner_index.query(&at.grown(tolerance), |corner| {
            let distance = self.corners[corner as usize].at.distance(point);
            if distance <= tolerance && best.is_none_or(|found| (distance, corner) < found) {
                best = Some((distance, corner));
            }
            ControlFlow::Continue(())
        });
        if let Some((_, corner)) = best {
            return corner;
        }
        let corner = index32(self.corners.len());
        self.corners.push(Corner {
            at: point,
            others: Vec::new(),
            outward: DVec3::ZERO,
        });
        self.corner_index.insert(corner, at);
        corner
    }
}

fn check(point: DVec2) -> Result<(), CutError> {
    if point.is_finite() {
        Ok(())
    } else {
        Err(CutError::NotFinite {
            point: 0,
            position: point.extend(0.0),
        })
    }
}

impl Obstacle for PlanarCuts {
    fn piece_count(&self) -> usize {
        self.segments.len()
    }

    fn piece_bounds(&self, piece: usize) -> Bounds {
        Bounds::of(&self.segment(piece).map(|p| p.extend(0.0)))
    }

    fn piece_crosses(&self, piece: usize, a: DVec3, b: DVec3) -> bool {
        let [p, q] = self.segment(piece);
        segments_cross(a.truncate(), b.truncate(), p, q)
    }

    fn crosses(&self, a: DVec3, b: DVec3) -> bool {
        let (a, b) = (a.with_z(0.0), b.with_z(0.0));
        self.segment_index
            .query(&Bounds::of(&[a, b]), |segment| {
                if self.piece_crosses(segment as usize, a, b) {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            })
            .is_break()
    }

    fn crossings(&self, a: DVec3, b: DVec3) -> usize {
        let mut segments = Vec::new();
        self.segment_index
            .collect(&Bounds::of(&[a, b].map(|p| p.with_z(0.0))), &mut segments);
        segments
            .iter()
            .filter(|&&segment| self.piece_crosses(segment as usize, a, b))
            .count()
    }

    fn diffraction_edges_into(&self, near: &Bounds, out: &mut Vec<u32>) -> bool {
        let flat = Bounds {
            low: near.low.with_z(0.0),
            high: near.high.with_z(0.0),
        };
        self.corner_index.collect(&flat, out);
        let ends = out
            .iter()
            .any(|&corner| self.corners[corner as usize].others.len() % 2 == 1);
        out.retain(|&corner| self.corners[corner as usize].outward != DVec3::ZERO);
        ends
    }

    fn diffraction_point(&self, edge: u32, _a: DVec3, _b: DVec3) -> DiffractionPoint {
        let corner = &self.corners[edge as usize];
        DiffractionPoint {
            point: corner.at.extend(0.0),
            outward: corner.outward,
        }
    }

    fn pieces_into(&self, near: &Bounds, out: &mut Vec<u32>) {
        let flat = Bounds {
            low: near.low.with_z(0.0),
            high: near.high.with_z(0.0),
        };
        self.segment_index.collect(&flat, out);
    }

    fn meeting_point(&self, piece: usize, a: DVec3, b: DVec3) -> DVec3 {
        let [p, q] = self.segment(piece);
        let (to_a, to_b) = (
            (q - p).perp_dot(a.truncate() - p),
            (q - p).perp_dot(b.truncate() - p),
        );
        a.lerp(b, share_to_zero(to_a, to_b))
    }

    fn edge_distance(&self, edge: u32, point: DVec3) -> f64 {
        self.corners[edge as usize].at.distance(point.truncate())
    }
}
