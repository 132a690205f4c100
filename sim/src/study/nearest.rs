//! The block of 1,408 nodes with 16 neighbours, built as the dissertation did and moved without a
//! scene.

use std::time::Instant;

use glam::DVec3;
use phyxel_elastic::{Elastic, Stencils};
use phyxel_enrich::{CutSettings, Cuts, FactorSettings, Graph, PairFactors};
use phyxel_integrate::{
    EigenvalueSettings, Motion, MotionSettings, Supports, critical_step, largest_eigenvalue,
};
use phyxel_mls::{ConservativeStencils, Neighborhoods};

use super::StudyError;
use super::block::{Block, lattice};
use super::cut::middle;
use super::hanging::{Care, STATES, State, THEN};
use super::model::{ElasticBody, Solid};

const SOLID: Solid = Solid {
    youngs_modulus: 1.0e4,
    poissons_ratio: 0.4,
    density: 1000.0,
};
const SPACING: f64 = 0.01;
/// Damping (1/s) under which the block sags.
const DAMPING: f64 = 10.0;
/// Time (s) over which it sags before it is measured, and between cuts.
const SAGGING: f64 = 0.15;
/// Share of the critical step that is taken.
const STEP_FACTOR: f64 = 0.5;

fn block() -> Result<Block, StudyError> {
    let size = DVec3::new(7.0, 7.0, 21.0) * SPACING;
    let (nodes, tetrahedra) = lattice([7, 7, 21], |s| (s - 0.5) * size);
    Block::ordered(&nodes, &tetrahedra)
}

/// Levels (m) of the two cuts and where they end along x (m): half through, and through.
const CUTS: [[f64; 2]; 2] = [[0.02, 0.0], [-0.06, 0.07]];

pub(super) fn measure(care: Care) -> Result<Vec<State>, StudyError> {
    let block = block()?.with_nearest(16)?;
    let (graph, mut stencils) = (block.graph.clone(), block.stencils.clone());
    let body = ElasticBody::on(block, SOLID, 0.1)?;
    let mut hung = Hung::new(body, graph.pair_count())?;
    let mut cuts = Cuts::new(&CutSettings::for_spacing(SPACING));
    let rest = hung.rest.clone();
    let coupled = Graph::trusted(&rest, graph.offsets(), graph.indices());
    let mut factors = PairFactors::new(&coupled, &FactorSettings::default());
    let mut found = Vec::new();
    for (k, state) in STATES.into_iter().enumerate() {
        if let Some([level, end]) = k.checked_sub(1).map(|cut| CUTS[cut]) {
            // Blades in the material: a hanging block hardly turns.
            let edge = |x: f64| [-0.06, 0.06].map(|y| DVec3::new(x, y, level + 0.0013));
            let stroke = cuts.start(&edge(-0.06))?;
            let triangles = cuts.append(stroke, &edge(end))?;
            cuts.end(stroke)?;
            let half = DVec3::new(3.5, 3.5, 10.5) * SPACING;
            let inside = |p: DVec3| p.abs().cmple(half).all();
            let touched = factors.update(&coupled, &cuts, triangles, &inside);
            hung.cut(&graph, &mut stencils, &factors, &touched.nodes)?;
        }
        let severed = factors.severed_count();
        found.push(hung.measure("block, 16 neighbours", state, severed, care)?);
    }
    let even = self::block()?;
    let body = ElasticBody::dissertation(&even.rest, &even.tetrahedra, SOLID)?;
    let pairs = body.elastic.pair_count();
    let mut hung = Hung::new(body, pairs)?;
    found.push(hung.measure("block, dissertation's model", STATES[0], 0, care)?);
    Ok(found)
}

/// A block in motion.
struct Hung {
    rest: Vec<DVec3>,
    pairs: usize,
    elastic: Elastic,
    motion: Motion,
    step: f64,
}

impl Hung {
    fn new(mut body: ElasticBody, pairs: usize) -> Result<Self, StudyError> {
        let top = body.nodes(|x| x.z > 10.4 * SPACING);
        let supports = Supports::fixed(body.rest.len(), &top);
        let elastic = &mut body.elastic;
        elastic.forces_into(&body.rest, &mut vec![DVec3::ZERO; body.rest.len()]);
        let eigenvalue = largest_eigenvalue(
            &body.masses,
            &supports,
            |v, out| elastic.tangent_product_into(v, out),
            &mut Vec::new(),
            &EigenvalueSettings::default(),
        )?;
        let settings = MotionSettings {
            damping: DAMPING,
            gravity: DVec3::new(0.0, 0.0, -9.81),
            ..MotionSettings::default()
        };
        Ok(Self {
            motion: Motion::new(&body.rest, &body.masses, supports, settings)?,
            rest: body.rest,
            pairs,
            elastic: body.elastic,
            step: STEP_FACTOR * critical_step(eigenvalue.value, 0.0),
        })
    }

    fn cut(
        &mut self,
        graph: &Neighborhoods,
        stencils: &mut ConservativeStencils,
        factors: &PairFactors,
        touched: &[u32],
    ) -> Result<(), StudyError> {
        let factor = |pair| factors.factor(pair);
        stencils.update_rows(&self.rest, graph, factor, touched)?;
        let rows = Stencils {
            offsets: graph.offsets(),
            indices: graph.indices(),
            weights: &stencils.weights,
            matrices: &stencils.matrices,
            scales: &stencils.scales,
            multipliers: &stencils.multipliers,
        };
        self.elastic.update_rows(touched, &rows)?;
        let elastic = &mut self.elastic;
        self.motion.refresh(|x, f| elastic.forces_into(x, f))?;
        Ok(())
    }

    fn measure(
        &mut self,
        body: &'static str,
        state: &'static str,
        severed: usize,
        care: Care,
    ) -> Result<State, StudyError> {
        let end = self.motion.time() + SAGGING;
        let mut steps = Vec::new();
        while self.motion.time() < end || steps.len() < care.steps as usize {
            let elastic = &mut self.elastic;
            let start = Instant::now();
            self.motion
                .step(self.step, |x, f| elastic.forces_into(x, f))?;
            steps.push(start.elapsed().as_secs_f64());
        }
        let lowest = |x: &[DVec3]| x.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
        Ok(State {
            body,
            state,
            nodes: self.rest.len(),
            pairs: self.pairs,
            step: self.step,
            seconds: middle(&mut steps),
            drawing: None,
            severed,
            sag: lowest(&self.rest) - lowest(self.motion.positions()),
            then: THEN[0],
        })
    }
}
