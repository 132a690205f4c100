//! Blades that pass through a body: from the edge in the world to rows of the model.

use glam::DVec3;
use phyxel_elastic::StiffnessCap;
use phyxel_enrich::{CutSettings, Cuts, Graph, nodes_in_small_pieces};
use phyxel_mls::{MapSettings, MaterialMap, mean_neighbor_distance};
use serde::{Deserialize, Serialize};

use super::body::Body;
use super::error::BodyProblem;
use super::factors::Factors;
use super::state::Incision;

/// Growth of the largest eigenvalue in one update above which the cap is strengthened.
const ALLOWED_GROWTH: f64 = 1.05;
/// Strengths of the stiffness cap, from none; the next is taken when the eigenvalue no longer fits.
const CAPS: [f64; 3] = [1.0, 0.5, 0.3];
/// A node that a cut leaves fewer neighbours, or a moment matrix of a larger condition, has no strain
/// of its own any more: a few neighbours turn inside out under load, and no penalty holds them.
const FEWEST_NEIGHBORS: usize = 6;
const LARGEST_CONDITION: f64 = 5.0;
/// Strength of the cap on such nodes.
const WEAK_CAP: f64 = 0.005;
/// Pieces of fewer nodes are debris and count as weak.
const SMALLEST_PIECE: usize = 12;
/// Products with the stiffness of the part round a cut per estimate.
const ESTIMATE_PRODUCTS: usize = 16;
/// Support radius of the world-to-material map, in mean distances to the neighbours.
const MAP_SUPPORT: f64 = 2.0;

/// What one body needs once a blade has touched it; a body that no blade touches has none.
#[derive(Debug)]
pub struct Cutting {
    cuts: Cuts,
    factors: Factors,
    map: MaterialMap,
    cap: StiffnessCap,
    strokes: Vec<Stroke>,
    /// Length (m) into which a blade's edge is divided before it is mapped.
    division: f64,
    growth: f64,
    capped: Vec<bool>,
    /// Every node that a cut has touched, rising.
    touched: Vec<u32>,
    /// Index into [`CAPS`].
    level: usize,
    captures: usize,
    updates: usize,
}

#[derive(Debug)]
struct Stroke {
    cut: usize,
    id: usize,
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
    pub(super) fn new(body: &Body, weld_tolerance: Option<f64>) -> Result<Self, BodyProblem> {
        let spacing = body.spacing;
        let mut settings = CutSettings::for_spacing(spacing);
        if let Some(tolerance) = weld_tolerance {
            settings.weld_tolerance = tolerance;
        }
        let edges = mean_neighbor_distance(&body.rest, &body.neighborhoods);
        let radii: Vec<f64> = edges.iter().map(|edge| MAP_SUPPORT * edge).collect();
        let map = MaterialMap::new(
            &body.rest,
            &radii,
            &body.neighborhoods,
            &MapSettings::default(),
        )?;
        Ok(Self {
            cuts: Cuts::new(&settings),
            factors: Factors::new(body.cut_rule, &graph_of(body), radii, spacing),
            map,
            cap: StiffnessCap::new(&body.elastic, &body.masses),
            strokes: Vec::new(),
            division: spacing,
            growth: 1.0,
            capped: vec![false; body.rest.len()],
            touched: Vec::new(),
            level: 0,
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
        self.cuts.bytes()
            + self.factors.bytes()
            + self.map.bytes()
            + size_of_val(&*self.capped)
            + size_of_val(&*self.touched)
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

    /// Nodes whose stiffness was capped at least once.
    #[must_use]
    pub fn capped_count(&self) -> usize {
        self.capped.iter().filter(|&&capped| capped).count()
    }

    /// A blade's edge in the world (m), mapped into the material.
    pub(super) fn edge_in_material(
        &self,
        body: &Body,
        edge: &[DVec3],
    ) -> Result<Vec<DVec3>, BodyProblem> {
        let frame = self.map.frame(
            body.motion.positions(),
            body.elastic.deformation_gradients(),
        )?;
        let world = divided(edge, self.division);
        Ok(world
            .iter()
            .map(|&point| frame.to_material(point).position)
            .collect())
    }

    /// Takes up an edge in material coordinates: spans the new piece of the cut, and changes
    /// factors, rows, stiffness and the stable step where it passes.
    pub(super) fn capture(
        &mut self,
        body: &mut Body,
        cut: usize,
        edge: &[DVec3],
        moment: Moment,
    ) -> Result<Capture, BodyProblem> {
        let (capture, touched) = self.grow(body, cut, edge, moment)?;
        if capture.changed {
            self.fit_stiffness(body, &touched)?;
        }
        Ok(capture)
    }

    /// Does again what [`Cutting::capture`] did with an edge, but for what depends on the motion.
    pub(super) fn replay(
        &mut self,
        body: &mut Body,
        incision: &Incision,
    ) -> Result<Capture, BodyProblem> {
        let (capture, touched) = self.grow(body, incision.cut, &incision.edge, incision.moment)?;
        if capture.changed {
            self.limit_stiffness(body, &touched);
            while self.level < incision.level.min(CAPS.len() - 1) {
                self.strengthen(body);
            }
            self.note_capped(body, &touched);
        }
        Ok(capture)
    }

    /// Index of the cap's strength.
    pub(super) fn level(&self) -> usize {
        self.level
    }

    pub(super) fn set_growth(&mut self, growth: f64) {
        self.growth = growth;
    }

    /// Spans the piece of the cut between the last edge and this one; the nodes it touched.
    fn grow(
        &mut self,
        body: &mut Body,
        cut: usize,
        edge: &[DVec3],
        moment: Moment,
    ) -> Result<(Capture, Vec<u32>), BodyProblem> {
        self.captures += 1;
        let stroke = match self.strokes.iter().find(|stroke| stroke.cut == cut) {
            Some(stroke) => stroke.id,
            None => {
                let id = self.cuts.start(edge)?;
                self.strokes.push(Stroke { cut, id });
                self.factors.start(id, edge);
                id
            }
        };
        if moment == Moment::Start {
            return Ok((Capture::default(), Vec::new()));
        }
        let new = self.cuts.append(stroke, edge)?;
        if moment == Moment::End {
            self.cuts.end(stroke)?;
            self.strokes.retain(|stroke| stroke.cut != cut);
        }
        let triangles: Vec<[DVec3; 3]> = new.clone().map(|t| self.cuts.triangle(t)).collect();
        let inside = |point| body.solid.contains(point);
        let graph = graph_of(body);
        let touched = self
            .factors
            .update(&graph, &self.cuts, new, (stroke, edge), &inside)?;
        let changed = !touched.is_empty();
        if changed {
            self.updates += 1;
            self.reconnect(body, &touched)?;
        }
        Ok((Capture { triangles, changed }, touched))
    }

    /// Carries changed factors into stencils, map and model.
    fn reconnect(&mut self, body: &mut Body, touched: &[u32]) -> Result<(), BodyProblem> {
        let factor = |pair| self.factors.factor(pair);
        body.stencils
            .update_rows(&body.rest, &body.neighborhoods, factor, touched)?;
        self.map.update_rows(factor, touched);
        body.elastic
            .update_rows(touched, &body.stencils.view(&body.neighborhoods))?;
        self.touched.extend_from_slice(touched);
        self.touched.sort_unstable();
        self.touched.dedup();
        Ok(())
    }

    /// Estimates the largest eigenvalue of the part that the cut touched and strengthens the cap on
    /// touched nodes until it leaves room for the step. Elsewhere nothing changed.
    fn fit_stiffness(&mut self, body: &mut Body, touched: &[u32]) -> Result<(), BodyProblem> {
        let before = body.current_eigenvalue;
        self.limit_stiffness(body, touched);
        let part = body.elastic.part(&with_neighbors(body, touched));
        let found = loop {
            body.reload();
            let found = body.part_eigenvalue(&part, ESTIMATE_PRODUCTS)?;
            let largest = found.value.max(before);
            self.growth = self.growth.max(largest / body.eigenvalue.value);
            if found.value <= ALLOWED_GROWTH * before || self.level + 1 == CAPS.len() {
                break found;
            }
            self.strengthen(body);
        };
        body.take_part_eigenvalue(&part, &found);
        self.note_capped(body, touched);
        Ok(())
    }

    /// Applies the cap at its present strength.
    fn limit_stiffness(&self, body: &mut Body, touched: &[u32]) {
        body.elastic
            .cap_stiffness(&self.cap, touched, CAPS[self.level]);
        self.release_weak(body, touched);
    }

    /// Applies the next strength to all that cuts have touched.
    fn strengthen(&mut self, body: &mut Body) {
        self.level += 1;
        self.limit_stiffness(body, &self.touched);
    }

    fn note_capped(&mut self, body: &Body, touched: &[u32]) {
        for &node in touched {
            let node = node as usize;
            self.capped[node] |= body.elastic.elastic_volumes()[node] < body.volumes[node];
        }
    }

    /// Takes the elastic energy from nodes that a cut left too few neighbours to have a strain of
    /// their own. Their neighbours' energies, which depend on them too, still hold them in place.
    fn release_weak(&self, body: &mut Body, touched: &[u32]) {
        let (graph, weights) = (&body.neighborhoods, body.stencils.weights());
        let ranks = body.stencils.ranks();
        let (offsets, indices) = (graph.offsets(), graph.indices());
        let debris = nodes_in_small_pieces(offsets, indices, weights, touched, SMALLEST_PIECE);
        let weak: Vec<u32> = touched
            .iter()
            .copied()
            .filter(|&node| {
                let row = &weights[graph.pairs(node as usize)];
                let live = row.iter().filter(|&&weight| weight > 0.0).count();
                let spread = &ranks[node as usize];
                live < FEWEST_NEIGHBORS
                    || spread.rank < 3
                    || spread.condition > LARGEST_CONDITION
                    || debris.binary_search(&node).is_ok()
            })
            .collect();
        body.elastic.cap_stiffness(&self.cap, &weak, WEAK_CAP);
    }
}

/// The body's nodes and pairs, as the factors read them.
fn graph_of(body: &Body) -> Graph<'_> {
    Graph {
        positions: &body.rest,
        offsets: body.neighborhoods.offsets(),
        indices: body.neighborhoods.indices(),
    }
}

/// Some nodes and their neighbours, in any order.
fn with_neighbors(body: &Body, nodes: &[u32]) -> Vec<u32> {
    let rows = nodes
        .iter()
        .map(|&node| body.neighborhoods.row(node as usize));
    rows.flatten().chain(nodes).copied().collect()
}

/// Divides a polyline into pieces not longer than `length` (m).
fn divided(line: &[DVec3], length: f64) -> Vec<DVec3> {
    let mut points = Vec::new();
    for pair in line.windows(2) {
        let pieces = (pair[0].distance(pair[1]) / length).ceil().max(1.0);
        let mut piece = 0.0;
        while piece < pieces {
            points.push(pair[0].lerp(pair[1], piece / pieces));
            piece += 1.0;
        }
    }
    points.extend(line.last());
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_divided_line_keeps_its_corners_and_has_no_long_piece() {
        let line = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 0.25, 0.0)];
        let points = divided(&line, 0.3);
        for corner in line {
            assert!(points.contains(&corner), "{corner} is lost");
        }
        for pair in points.windows(2) {
            assert!(pair[0].distance(pair[1]) <= 0.3, "{pair:?} is too long");
        }
        assert_eq!(points.len(), 6, "4 pieces and 1");
    }
}
