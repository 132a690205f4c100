//! Blades that pass through a body: from the edge in the world to rows of the model.

use glam::{DMat3, DVec3};
use phyxel_enrich::{Bounds, CutSettings, Cuts, Graph, connected_pieces, nodes_in_small_pieces};
use phyxel_mls::{MapSettings, MaterialMap, mean_neighbor_distance};
use serde::{Deserialize, Serialize};

use super::body::Body;
use super::energy::{CutEnergy, StrokeEnergy};
use super::error::BodyProblem;
use super::factors::Factors;
use super::state::Incision;

/// A node that a cut took neighbours from and left fewer than this, or a moment matrix of a larger
/// condition, has no strain of its own any more.
const FEWEST_NEIGHBORS: usize = 6;
const LARGEST_CONDITION: f64 = 5.0;
/// Growth of the condition by which a cut has to do with it.
const CONDITION_GROWTH: f64 = 1.2;
/// Factor on the zero-energy control of nodes that a cut touched, whose rows see less.
const TOUCHED_CONTROL: f64 = 3.0;
/// Pieces of fewer nodes are debris and count as weak.
const SMALLEST_PIECE: usize = 12;
/// Products with the stiffness of the part round a cut per estimate.
const ESTIMATE_PRODUCTS: usize = 16;
/// Support radius of the world-to-material map, in mean distances to the neighbours.
const MAP_SUPPORT: f64 = 2.0;
/// Round-off of a bend's place, as a share of the body's size. A bend in a face of the body lies 1e-17
/// outside as often as inside; without this its way round the cut would be lost.
const ROUND_OFF: f64 = 1e-9;

/// What one body needs once a blade has touched it; a body that no blade touches has none.
#[derive(Debug, Clone)]
pub struct Cutting {
    cuts: Cuts,
    factors: Factors,
    map: MaterialMap,
    /// Neighbours and condition of each node before any cut.
    uncut: Vec<(usize, f64)>,
    strokes: Vec<Stroke>,
    /// Length (m) into which a blade's edge is divided before it is mapped.
    division: f64,
    growth: f64,
    energy: CutEnergy,
    by_stroke: Vec<StrokeEnergy>,
    captures: usize,
    updates: usize,
}

#[derive(Debug, Clone)]
struct Stroke {
    cut: usize,
    id: usize,
    /// Place among all strokes so far.
    number: usize,
}

/// What a capture changed.
#[derive(Debug, Clone, Default)]
pub struct Capture {
    /// New triangles, corners in material coordinates (m).
    pub triangles: Vec<[DVec3; 3]>,
    /// Whether any pair factor changed.
    pub changed: bool,
}

/// When in a stroke the edge is taken up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Moment {
    /// The stroke starts.
    Start,
    /// The blade has moved.
    Update,
    /// The stroke ends.
    End,
}

impl Cutting {
    /// Prepares an uncut body.
    pub(super) fn new(body: &Body) -> Result<Self, BodyProblem> {
        let spacing = body.spacing;
        let edges = mean_neighbor_distance(&body.rest, &body.neighborhoods);
        let radii: Vec<f64> = edges.iter().map(|edge| MAP_SUPPORT * edge).collect();
        let map = MaterialMap::new(
            &body.rest,
            &radii,
            &body.neighborhoods,
            &MapSettings::default(),
        )?;
        Ok(Self {
            cuts: Cuts::new(&CutSettings::for_spacing(spacing)),
            factors: Factors::new(body.cut_rule, &graph_of(body), radii, spacing),
            map,
            uncut: supports_of_rows(body),
            strokes: Vec::new(),
            division: spacing,
            growth: 1.0,
            energy: CutEnergy::default(),
            by_stroke: Vec::new(),
            captures: 0,
            updates: 0,
        })
    }

    /// The cut surface, in material coordinates.
    #[must_use]
    pub fn cuts(&self) -> &Cuts {
        &self.cuts
    }

    /// Factors on the pairs.
    #[must_use]
    pub fn factors(&self) -> &Factors {
        &self.factors
    }

    /// Heap bytes of all that a cut needs.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.cuts.bytes() + self.factors.bytes() + self.map.bytes() + size_of_val(&*self.uncut)
    }

    /// Blade edges taken up, and how many of them changed the connectivity.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        (self.captures, self.updates)
    }

    /// Number of undirected pairs whose factor is 0.
    #[must_use]
    pub fn severed_pairs(&self) -> usize {
        self.factors.severed_count()
    }

    /// Largest estimate of the largest eigenvalue so far, relative to the uncut body's.
    #[must_use]
    pub fn growth(&self) -> f64 {
        self.growth
    }

    /// What cuts did to the energy.
    #[must_use]
    pub fn energy(&self) -> CutEnergy {
        self.energy
    }

    /// The same, stroke by stroke, in the order in which they began.
    #[must_use]
    pub fn by_stroke(&self) -> &[StrokeEnergy] {
        &self.by_stroke
    }

    pub(super) fn set_energy(&mut self, energy: CutEnergy, by_stroke: &[CutEnergy]) {
        self.energy = energy;
        // Strokes that have begun since have changed nothing.
        for (stroke, energy) in self.by_stroke.iter_mut().zip(by_stroke) {
            stroke.energy = *energy;
        }
    }

    pub(super) fn add_decay(&mut self, work: f64) {
        self.energy.decay += work;
        let mut strokes = self.by_stroke.iter_mut().rev();
        if let Some(last) = strokes.find(|stroke| stroke.updates > 0) {
            last.energy.decay += work;
        }
    }

    /// A blade's edge in the world (m), mapped into the material.
    pub(super) fn edge_in_material(
        &self,
        body: &Body,
        edge: &[DVec3],
    ) -> Result<Vec<DVec3>, BodyProblem> {
        let gradients = body.elastic.deformation_gradients();
        let frame = self.map.frame(body.motion.positions(), &gradients)?;
        let reach = reach_of(body.motion.positions());
        let world = divided(edge, self.division, &reach);
        Ok(world
            .iter()
            .map(|&point| frame.to_material(point).position)
            .collect())
    }

    /// Takes up an edge in material coordinates: spans the new piece of the cut, and changes
    /// factors, rows, stiffness and the stable step where it passes. `weld_tolerance` is that of the cut (m),
    /// if it has its own.
    pub(super) fn capture(
        &mut self,
        body: &mut Body,
        cut: usize,
        weld_tolerance: Option<f64>,
        edge: &[DVec3],
        moment: Moment,
    ) -> Result<Capture, BodyProblem> {
        let (capture, touched, number) = self.grow(body, cut, weld_tolerance, edge, moment)?;
        if capture.changed {
            let stored = body.motion.audit().elastic;
            let jump = body.reload()?;
            self.energy.book(jump, stored);
            self.by_stroke[number].energy.book(jump, stored);
            if body.is_explicit() {
                self.fit_step(body, &touched)?;
            }
        }
        Ok(capture)
    }

    /// Does again what [`Cutting::capture`] did with an edge, but for what depends on the motion.
    pub(super) fn replay(
        &mut self,
        body: &mut Body,
        weld_tolerance: Option<f64>,
        incision: &Incision,
    ) -> Result<Capture, BodyProblem> {
        let Incision {
            cut, edge, moment, ..
        } = incision;
        let (capture, ..) = self.grow(body, *cut, weld_tolerance, edge, *moment)?;
        Ok(capture)
    }

    pub(super) fn set_growth(&mut self, growth: f64) {
        self.growth = growth;
    }

    /// Spans the piece of the cut between the last edge and this one; the nodes it touched and the
    /// stroke's number.
    fn grow(
        &mut self,
        body: &mut Body,
        cut: usize,
        weld_tolerance: Option<f64>,
        edge: &[DVec3],
        moment: Moment,
    ) -> Result<(Capture, Vec<u32>, usize), BodyProblem> {
        self.captures += 1;
        let open = self.strokes.iter().find(|stroke| stroke.cut == cut);
        let (stroke, number) = match open {
            Some(stroke) => (stroke.id, stroke.number),
            None => {
                let id = match weld_tolerance {
                    Some(tolerance) => self.cuts.start_within(edge, tolerance)?,
                    None => self.cuts.start(edge)?,
                };
                let number = self.by_stroke.len();
                self.by_stroke.push(StrokeEnergy::of(cut));
                self.strokes.push(Stroke { cut, id, number });
                self.factors.start(&graph_of(body), id, edge);
                (id, number)
            }
        };
        self.by_stroke[number].captures += 1;
        if moment == Moment::Start {
            return Ok((Capture::default(), Vec::new(), number));
        }
        let new = self.cuts.append(stroke, edge)?;
        if moment == Moment::End {
            self.cuts.end(stroke)?;
            self.strokes.retain(|stroke| stroke.cut != cut);
        }
        let triangles: Vec<[DVec3; 3]> = new.clone().map(|t| self.cuts.triangle(t)).collect();
        let round_off = ROUND_OFF * body.solid.bounds().size().max_element();
        let inside = |point| body.solid.contains_within(point, round_off);
        let graph = graph_of(body);
        let touched = self
            .factors
            .update(&graph, &self.cuts, new, (stroke, edge), &inside);
        let changed = !touched.is_empty();
        if changed {
            self.updates += 1;
            self.by_stroke[number].updates += 1;
            self.reconnect(body, &touched)?;
        }
        Ok((Capture { triangles, changed }, touched, number))
    }

    /// Carries changed factors into stencils, map and model. Deformation gradients go on from what they
    /// were; nodes that are left without a strain of their own get bonds.
    fn reconnect(&mut self, body: &mut Body, touched: &[u32]) -> Result<(), BodyProblem> {
        let before = |&i: &u32| body.elastic.deformation_gradient(i as usize);
        let before: Vec<DMat3> = touched.iter().map(before).collect();
        let factor = |pair| self.factors.factor(pair);
        body.stencils
            .update_rows(&body.rest, &body.neighborhoods, factor, touched)?;
        self.map.update_rows(factor, touched);
        let elastic = &mut body.elastic;
        elastic.update_rows(touched, &body.stencils.view(&body.neighborhoods))?;
        elastic.scale_control(touched, TOUCHED_CONTROL);
        let weak = self.weak_nodes(body, touched);
        let positions = body.motion.positions();
        body.elastic.weaken(&weak, positions, &factor);
        body.elastic
            .continue_deformation(touched, &before, positions);
        let (graph, weights) = (&body.neighborhoods, body.stencils.weights());
        let pieces = connected_pieces(graph.offsets(), graph.indices(), weights);
        body.motion.set_pieces(&pieces.piece);
        Ok(())
    }

    /// Estimates the largest eigenvalue of the part that the cut touched, for the step. Elsewhere
    /// nothing changed.
    fn fit_step(&mut self, body: &mut Body, touched: &[u32]) -> Result<(), BodyProblem> {
        let part = body.elastic.part(&with_neighbors(body, touched));
        let found = body.part_eigenvalue(&part, Vec::new(), ESTIMATE_PRODUCTS)?;
        let largest = found.value.max(body.current_eigenvalue());
        self.growth = self.growth.max(largest / body.eigenvalue.value);
        body.take_part_eigenvalue(&part, &found);
        Ok(())
    }

    /// Those of the touched nodes that cuts have left without a strain of their own, by what they took:
    /// a node that had no more from the start keeps its stiffness.
    fn weak_nodes(&self, body: &Body, touched: &[u32]) -> Vec<u32> {
        let (graph, weights) = (&body.neighborhoods, body.stencils.weights());
        let ranks = body.stencils.ranks();
        let (offsets, indices) = (graph.offsets(), graph.indices());
        let debris = nodes_in_small_pieces(offsets, indices, weights, touched, SMALLEST_PIECE);
        let is_weak = |node: &u32| {
            let at = *node as usize;
            let (neighbors, condition) = self.uncut[at];
            let left = linked_count(&weights[graph.pairs(at)]);
            let now = &ranks[at];
            (left < FEWEST_NEIGHBORS && left < neighbors)
                || now.rank < 3
                || (now.condition > LARGEST_CONDITION
                    && now.condition > CONDITION_GROWTH * condition)
                || debris.binary_search(node).is_ok()
                || body.elastic.weak_nodes().binary_search(node).is_ok()
        };
        touched.iter().copied().filter(is_weak).collect()
    }
}

/// Pairs of a row that still link.
fn linked_count(row: &[f64]) -> usize {
    row.iter().filter(|&&weight| weight > 0.0).count()
}

/// Neighbours and condition of each node.
fn supports_of_rows(body: &Body) -> Vec<(usize, f64)> {
    let weights = body.stencils.weights();
    let ranks = body.stencils.ranks().iter().enumerate();
    ranks
        .map(|(node, rank)| {
            let count = linked_count(&weights[body.neighborhoods.pairs(node)]);
            (count, rank.condition)
        })
        .collect()
}

/// The body's nodes and pairs, as the factors read them.
fn graph_of(body: &Body) -> Graph<'_> {
    Graph::trusted(
        &body.rest,
        body.neighborhoods.offsets(),
        body.neighborhoods.indices(),
    )
}

/// Some nodes and their neighbours, in any order.
fn with_neighbors(body: &Body, nodes: &[u32]) -> Vec<u32> {
    let rows = nodes
        .iter()
        .map(|&node| body.neighborhoods.row(node as usize));
    rows.flatten().chain(nodes).copied().collect()
}

/// The box round some points, grown on every side by its diagonal: farther off nothing is cut.
fn reach_of(points: &[DVec3]) -> Bounds {
    let bounds = Bounds::of(points);
    bounds.grown(bounds.low.distance(bounds.high))
}

/// Divides a polyline into pieces not longer than `length` (m) within `reach`; what lies beyond stays
/// as it is, however long.
fn divided(line: &[DVec3], length: f64, reach: &Bounds) -> Vec<DVec3> {
    let mut points = Vec::new();
    for pair in line.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let Some((start, end)) = within(from, to, reach) else {
            points.push(from);
            continue;
        };
        if start > 0.0 {
            points.push(from);
        }
        let pieces = ((end - start) * from.distance(to) / length).ceil().max(1.0);
        let mut piece = 0.0;
        while piece < pieces {
            points.push(from.lerp(to, start + (end - start) * (piece / pieces)));
            piece += 1.0;
        }
        if end < 1.0 {
            points.push(from.lerp(to, end));
        }
    }
    points.extend(line.last());
    points
}

/// The part of a way, from 0 to 1, that lies in a box, if any does.
fn within(from: DVec3, to: DVec3, reach: &Bounds) -> Option<(f64, f64)> {
    let (mut start, mut end) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        let (x, way) = (from[axis], to[axis] - from[axis]);
        let (low, high) = (reach.low[axis], reach.high[axis]);
        if way == 0.0 {
            if !(low..=high).contains(&x) {
                return None;
            }
            continue;
        }
        let (a, b) = ((low - x) / way, (high - x) / way);
        start = start.max(a.min(b));
        end = end.min(a.max(b));
    }
    (start < end).then_some((start, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_divided_line_keeps_its_corners_and_has_no_long_piece() {
        let line = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 0.25, 0.0)];
        let near = Bounds::of(&line).grown(1.0);
        let points = divided(&line, 0.3, &near);
        for corner in line {
            assert!(points.contains(&corner), "{corner} is lost");
        }
        for pair in points.windows(2) {
            assert!(pair[0].distance(pair[1]) <= 0.3, "{pair:?} is too long");
        }
        assert_eq!(points.len(), 6, "4 pieces and 1");
    }

    #[test]
    fn a_line_is_not_divided_far_from_the_body() {
        let body = reach_of(&[DVec3::ZERO, DVec3::ONE]);
        let middle = DVec3::splat(0.5);
        let line = [middle - 1e6 * DVec3::X, middle + 1e6 * DVec3::X, middle];
        let points = divided(&line, 0.1, &body);
        assert!(points.len() < 150, "{} points", points.len());
        for corner in line {
            assert!(points.contains(&corner), "{corner} is lost");
        }
        for pair in points.windows(2) {
            let near = within(pair[0], pair[1], &Bounds::of(&[DVec3::ZERO, DVec3::ONE]));
            let length = pair[0].distance(pair[1]);
            assert!(near.is_none() || length < 0.11, "{pair:?} is too long");
        }
        let away = [DVec3::splat(50.0), DVec3::splat(60.0)];
        assert_eq!(divided(&away, 0.1, &body), away);
    }
}
