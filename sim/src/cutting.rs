//! Blades that pass through a body: from the edge in the world to rows of the model.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use phyxel_elastic::{CrackFront, CutInput, CutPolicy};
use phyxel_enrich::{
    Blade, CutError, CutSettings, Cuts, DeformedBody, FactorSettings, Factors, Graph, Sweep,
    connected_pieces, is_parted,
};
use phyxel_integrate::CutEnergy;
use phyxel_mls::MaterialMap;

use crate::body::Body;
use crate::cut_state::{CapturedEdge, Cutting};
use crate::error::BodyProblem;
use crate::input::StrokePhase;
use crate::model::elastic_stencils;
use crate::stiffness::PRODUCTS;

/// Radius around a front, in spacings, in which its energy release rate is taken. With 3, 4 and 5 a tear
/// (`benches -- griffith --quick`) ends at 0.81, 0.86 and 0.91 of the toughness.
const FRONT: f64 = 4.0;
/// Round-off of a diffraction point's position, as a fraction of the body's size. One in a face of the body lies 1e-17
/// outside as often as inside; without this its path around the cut would be lost.
const ROUND_OFF: f64 = 1e-9;

/// A captured edge, which is in the surface of its cut; no pair, row or force knows of it yet.
#[derive(Debug)]
pub(crate) struct Capture {
    pub(crate) edge: Arc<CapturedEdge>,
    /// Vertices and triangles of the surface before.
    before: (usize, usize),
    /// The blade where its edge is now.
    blade: Blade,
    missed: usize,
}

/// What a captured edge adds to a cut and weakens, computed from a body as it is; no row of the body has it yet.
#[derive(Debug)]
pub(crate) struct CutUpdate {
    /// New triangles, corners in material coordinates (m).
    pub(crate) triangles: Vec<[DVec3; 3]>,
    /// Nodes of the pairs whose factor changed.
    pub(crate) touched: Vec<u32>,
    /// Place of the stroke among all so far.
    stroke: usize,
}

impl Cutting {
    /// Prepares an uncut body.
    fn new(body: &Body) -> Result<Self, BodyProblem> {
        let spacing = body.spacing;
        // The map looks as far as cuts do by default.
        let (graph, reach) = (graph_of(body), FactorSettings::default().influence_radius);
        let radii: Vec<f64> = (0..body.rest.len())
            .map(|node| reach.of(&graph, node))
            .collect();
        let map = MaterialMap::new(&body.rest, &radii, &body.neighborhoods)?;
        Ok(Self {
            cuts: Cuts::new(&CutSettings::for_spacing(spacing)),
            factors: Factors::new(body.cut_rule, &graph, radii, spacing),
            map,
            pieces: Vec::new(),
            strokes: Vec::new(),
            missed_pairs: 0,
            growth: 1.0,
            energy: CutEnergy::default(),
            by_stroke: Vec::new(),
        })
    }

    /// Applies an update to the body, the one place where a cut changes it: rows of stencils, map and model.
    fn apply(&mut self, body: &mut Body, update: &CutUpdate) -> Result<(), BodyProblem> {
        let touched = &update.touched;
        self.by_stroke[update.stroke].updates += 1;
        let factor = |pair| self.factors.factor(pair);
        body.stencils
            .update_rows(&body.rest, &body.neighborhoods, factor, touched)?;
        self.map.update_rows(factor, touched);
        let graph = graph_of(body);
        let front = |&node: &u32| self.factors.front_matrix(&graph, node as usize);
        let fronts: Vec<DMat3> = touched.iter().map(front).collect();
        let (elastic, motion) = body.whole.cut(touched);
        let input = CutInput {
            touched,
            stencils: &elastic_stencils(&body.stencils, &body.neighborhoods),
            left: &factor,
            fronts: &fronts,
            positions: motion.positions(),
        };
        elastic.apply_cut(&input, &CutPolicy::default())?;
        let (graph, weights) = (&body.neighborhoods, &body.stencils.weights);
        let (offsets, indices) = (graph.offsets(), graph.indices());
        if self.pieces.is_empty() || is_parted(offsets, indices, weights, touched, &self.pieces) {
            self.pieces = connected_pieces(offsets, indices, weights).piece;
            motion.set_pieces(&self.pieces);
        }
        Ok(())
    }

    /// What an update that was applied does to a body in motion: forces and the jump of the energy; then the largest
    /// eigenvalue of the part that the cut touched, for the step. Elsewhere nothing changed.
    ///
    /// Nothing that is given to a capture makes this fail, nor [`Cutting::apply`]: with factors between 0 and 1 and
    /// finite positions of nodes only a bug does, and it leaves some rows with the cut and others without.
    fn follow(&mut self, body: &mut Body, update: &CutUpdate) -> Result<(), BodyProblem> {
        let (elastic, motion) = body.whole.cut(&[]);
        let stored = motion.audit().elastic;
        let jump = motion.refresh(|x, f| elastic.forces_again(x, f))?;
        let round_off = body.energy_round_off();
        self.energy.record(jump, stored, round_off);
        let stroke = &mut self.by_stroke[update.stroke];
        stroke.energy.record(jump, stored, round_off);
        if body.is_explicit() {
            let around = body.neighborhoods.around(&update.touched);
            let part = body.elastic().part(&around.collect::<Vec<_>>());
            let mut mode = Vec::new();
            let found = body.part_eigenvalue(&part, &mut mode, PRODUCTS)?;
            let largest = found.max(body.current_eigenvalue());
            self.growth = self.growth.max(largest / body.eigenvalue.value);
            body.take_part_eigenvalue(&part, found, &mode);
        }
        Ok(())
    }

    /// Computes how a blade's edge in the world (m) moves the front of its cut to where it is in the tissue of a body, by
    /// its number: all of a capture that can fail. On an error nothing has changed, and [`Body::take_back`] undoes it.
    pub(crate) fn sweep(
        &mut self,
        body: (&Body, usize),
        cut: (usize, Option<f64>),
        edge: &[DVec3],
        phase: StrokePhase,
    ) -> Result<Capture, BodyProblem> {
        let (spacing, positions) = (body.0.spacing, body.0.motion().positions());
        let blade = self
            .open_blade(cut.0)
            .filter(|_| phase != StrokePhase::Start);
        let blade = blade.cloned();
        let blade = blade.unwrap_or_else(|| Blade::new(edge, spacing, positions));
        let ends = phase == StrokePhase::End;
        self.drive(body, cut, (blade, phase), |blade, cuts, body| {
            blade.sweep(edge, cuts, body, ends)
        })
    }

    /// Whether a stroke's front is somewhere where more energy (J/m²) would be released than `toughness`.
    pub(crate) fn tears(&self, body: &Body, cut: usize, toughness: f64) -> bool {
        let tears = |front| exceeds(body, front, toughness);
        self.open_blade(cut)
            .is_some_and(|blade| blade.tears(&tears))
    }

    /// Computes how a stroke's cut runs ahead of its blade, as [`Cutting::sweep`] does with what a blade cuts.
    pub(crate) fn tear(
        &mut self,
        body: (&Body, usize),
        cut: (usize, Option<f64>),
        toughness: f64,
    ) -> Result<Option<Capture>, BodyProblem> {
        let Some(blade) = self.open_blade(cut.0).cloned() else {
            return Ok(None);
        };
        let tears = |front| exceeds(body.0, front, toughness);
        let stroke = (blade, StrokePhase::Update);
        let torn = self.drive(body, cut, stroke, |blade, cuts, body| {
            Ok((blade.tear(cuts, &tears, body.inside)?, 0))
        })?;
        Ok(Some(torn).filter(|torn| !torn.edge.sweep.patches.is_empty()))
    }

    /// The blade of an open stroke.
    fn open_blade(&self, cut: usize) -> Option<&Blade> {
        let open = self.strokes.iter().find(|open| open.cut == cut);
        open.and_then(|open| open.blade.as_ref())
    }

    /// Computes what a blade adds to its cut `by` what it does in the body as it lies.
    fn drive(
        &mut self,
        (body, index): (&Body, usize),
        (cut, weld_tolerance): (usize, Option<f64>),
        (mut blade, phase): (Blade, StrokePhase),
        by: impl FnOnce(&mut Blade, &mut Cuts, &DeformedBody<'_>) -> Result<(Sweep, usize), CutError>,
    ) -> Result<Capture, BodyProblem> {
        self.set_weld_tolerance(body, weld_tolerance);
        let positions = body.motion().positions();
        let gradients = body.elastic().deformation_gradients();
        let frame = self.map.frame(positions, &gradients)?;
        let graph = &body.neighborhoods;
        let deformed = DeformedBody {
            rest: &body.rest,
            present: Graph::new_unchecked(positions, graph.offsets(), graph.indices()),
            spacing: body.spacing,
            inside: &|point| body.solid.contains(point),
            preimage: &|world, seen| {
                let found = frame.preimage(world, seen)?;
                Some((found.position, found.jacobian))
            },
            nearest: &|world, reach| frame.nearest_node(world, reach),
            known: &|pair| self.factors.factor(pair) < 1.0,
        };
        let (vertices, triangles) = self.cuts.surface();
        let before = (vertices.len(), triangles.len());
        let swept = by(&mut blade, &mut self.cuts, &deformed);
        let (sweep, missed) = swept.inspect_err(|_| self.cuts.truncate(before.0, before.1))?;
        let edge = CapturedEdge {
            steps: body.steps(),
            body: index,
            cut,
            phase,
            sweep,
        };
        Ok(Capture {
            edge: Arc::new(edge),
            before,
            blade,
            missed,
        })
    }

    /// Takes a blade to where its edge is now, weakens the pairs that the new part of a cut crosses, and ends the stroke
    /// with its last edge.
    fn weaken(
        &mut self,
        body: &Body,
        first: usize,
        edge: &CapturedEdge,
        blade: Option<Blade>,
    ) -> CutUpdate {
        let stroke = self.lead(edge.cut, edge.phase, blade);
        let new = first..self.cuts.triangle_count();
        let triangles = new.clone().map(|t| self.cuts.triangle(t)).collect();
        let mut touched = Vec::new();
        if !new.is_empty() {
            let round_off = ROUND_OFF * body.solid.bounds().size().max_element();
            let inside = |point| body.solid.contains_within(point, round_off);
            let front = (stroke, edge.sweep.ends);
            touched = self
                .factors
                .update(&graph_of(body), &self.cuts, new, front, &inside);
        }
        // Where tissue tears, a cut may run on until the next stroke of this number begins.
        if edge.phase == StrokePhase::End && body.toughness.is_none() {
            self.strokes.retain(|open| open.cut != edge.cut);
        }
        CutUpdate {
            triangles,
            touched,
            stroke,
        }
    }

    /// Takes a stroke's weld tolerance (m), or the usual one of the body.
    fn set_weld_tolerance(&mut self, body: &Body, tolerance: Option<f64>) {
        let usual = CutSettings::for_spacing(body.spacing).weld_tolerance;
        self.cuts.set_weld_tolerance(tolerance.unwrap_or(usual));
    }
}

/// Whether the energy release rate at a front is above a toughness (J/m²).
fn exceeds(body: &Body, [at, ahead, along]: [DVec3; 3], toughness: f64) -> bool {
    let front = CrackFront { at, ahead, along };
    let inside = |point| body.solid.contains(point);
    let rate = body
        .elastic()
        .energy_release_rate(&front, FRONT * body.spacing, inside);
    rate > toughness
}

/// The body's nodes and pairs, as the factors read them.
pub(crate) fn graph_of(body: &Body) -> Graph<'_> {
    Graph::new_unchecked(
        &body.rest,
        body.neighborhoods.offsets(),
        body.neighborhoods.indices(),
    )
}

impl Body {
    /// What cuts have left of a pair's weight.
    #[must_use]
    pub fn factor(&self, pair: usize) -> f64 {
        let cutting = self.cutting.as_ref();
        cutting.map_or(1.0, |cutting| cutting.factors.factor(pair))
    }

    /// Undoes [`Cutting::sweep`].
    pub(crate) fn take_back(&mut self, capture: &Capture) {
        if let Some(cutting) = &mut self.cutting {
            let (vertices, triangles) = capture.before;
            cutting.cuts.truncate(vertices, triangles);
        }
        self.forget_untouched();
    }

    /// A body that no capture has reached has no data of cuts.
    fn forget_untouched(&mut self) {
        self.cutting.take_if(|cutting| cutting.counts().0 == 0);
    }

    /// Applies a capture to the body and what touches it; also what it added to the cut. Only a bug makes it fail, see
    /// [`Cutting::follow`].
    pub(crate) fn apply(&mut self, capture: Capture) -> Result<CutUpdate, BodyProblem> {
        let update = self.with_cutting(|body, cutting| {
            // What viscosity lost in the last step is not the cut's.
            body.relax(0.0)?;
            cutting.missed_pairs += capture.missed;
            let (_, first) = capture.before;
            let update = cutting.weaken(body, first, &capture.edge, Some(capture.blade));
            if !update.touched.is_empty() {
                cutting.apply(body, &update)?;
                cutting.follow(body, &update)?;
            }
            Ok(update)
        })?;
        if !update.touched.is_empty() {
            self.tear_contacts()?;
        }
        Ok(update)
    }

    /// Does again what [`Cutting::sweep`] and [`Body::apply`] did, but for what depends on the motion.
    pub(crate) fn replay(&mut self, kept: &CapturedEdge) -> Result<CutUpdate, BodyProblem> {
        self.with_cutting(|body, cutting| {
            cutting.cuts.set_weld_tolerance(0.0);
            let first = cutting.cuts.triangle_count();
            for patch in &kept.sweep.patches {
                cutting
                    .cuts
                    .add_surface(&patch.vertices, &patch.triangles)?;
            }
            let update = cutting.weaken(body, first, kept, None);
            if !update.touched.is_empty() {
                cutting.apply(body, &update)?;
            }
            Ok(update)
        })
    }

    /// Takes their strain from nodes that lost it in a cut for where they were then, which [`Body::replay`] does not know.
    pub(crate) fn weaken_again(&mut self, deficient: &[u32]) {
        let Some(cutting) = &self.cutting else {
            return;
        };
        let (elastic, motion) = self.whole.rebuild();
        let (known, count) = (elastic.deficient_nodes(), elastic.node_count());
        let is_missing =
            |node: &u32| (*node as usize) < count && known.binary_search(node).is_err();
        let missing: Vec<u32> = deficient.iter().copied().filter(is_missing).collect();
        elastic.weaken(&missing, motion.positions(), &|pair| {
            cutting.factors.factor(pair)
        });
    }

    /// Works on the body with its data of cuts, which the first capture makes.
    pub(crate) fn with_cutting<T>(
        &mut self,
        work: impl FnOnce(&mut Self, &mut Cutting) -> Result<T, BodyProblem>,
    ) -> Result<T, BodyProblem> {
        let mut cutting = match self.cutting.take() {
            Some(cutting) => cutting,
            None => Cutting::new(self)?,
        };
        let result = work(self, &mut cutting);
        self.cutting = Some(cutting);
        if result.is_err() {
            self.forget_untouched();
        }
        result
    }
}
