//! The embedded liver's cuts over node counts, captures and steps: how flat their surfaces are, what they
//! sever, and how far they open.

use glam::DVec3;
use phyxel::scene::{Capture, Scene, Target};
use phyxel::{Body, Cutting, World};
use serde::Serialize;
use std::collections::BTreeSet;

use crate::batch::Case;
use crate::error::StudyError;
use crate::matrix::plain;
use crate::report::median;
use crate::row::Row;
use crate::watch::{DIVISIONS, Options, run_with, within};

/// Most that the area of a cut inside the body may be over the length of its area vector.
pub const FLATNESS: f64 = 1.02;
/// The node counts; captures and step factors are tried at the first.
pub const NODES: [u32; 3] = [3000, 6000, 12_000];
/// Ways (m) of the blade between two captures.
pub const CAPTURES: [f64; 4] = [1e-3, 2e-3, 4e-3, 8e-3];
/// Shares of the stable step.
pub const STEP_FACTORS: [f64; 3] = [0.25, 0.5, 0.85];
/// Those of the first scene, which others are compared with. The embedded liver has this capture and 0.8.
const CAPTURE: f64 = 4e-3;
const STEP_FACTOR: f64 = 0.85;
/// Scene time (s) between two readings of the incision's opening.
const READING: f64 = 0.1;
/// Scene time (s) between the incision and the resection, until which the incision's opening is read.
const BETWEEN: f64 = 1.75;
/// Scene time (s) at which the tip is off.
const END: f64 = 2.85;
/// Pairs that still link and are stretched this much are ligaments that a piece hangs on.
const TIE: f64 = 3.0;

/// What was found of one scene: a line of the table of incisions.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Finding {
    scene: String,
    /// Area inside the body of the incision's surface, and of the resection's, over the length of its area vector: 1 if it
    /// is flat.
    incision_ratio: f64,
    resection_ratio: f64,
    /// Area (m²) whose normal points against the vector.
    incision_backwards: f64,
    resection_backwards: f64,
    /// Pairs that the incision severed; times the square of the spacing (m²), which is the same whatever the nodes.
    severed_pairs: usize,
    severed_area: f64,
    /// Fraction of the pairs severed here or in the first scene that are severed here and there, if the nodes are the same.
    overlap: Option<f64>,
    /// Largest opening (m) of the incision right before the resection.
    opening: f64,
    /// How far its openings over time are off the first scene's: the root mean square of the difference, over that of the
    /// first's.
    opening_difference: Option<f64>,
    /// Pairs that blades passed and that no surface crosses.
    missed: usize,
    /// Linked pairs stretched threefold at the end.
    ties: usize,
    /// Pieces at the end, and nodes of the second largest.
    pieces: usize,
    second_piece: u32,
    /// Median time (s) from a blade's edge to the end of its step.
    latency: f64,
    /// Pairs that the incision severed, lower node first.
    #[serde(skip)]
    severed: BTreeSet<[u32; 2]>,
    /// Largest opening (m) of the incision at every multiple of 0.1 s of the scene's time before the resection.
    #[serde(skip)]
    openings: Vec<f64>,
    /// Nodes of the pieces at the end, largest first.
    #[serde(skip)]
    sizes: Vec<u32>,
    /// The run's figures.
    #[serde(skip)]
    row: Row,
}

impl Finding {
    /// Sets what is read at the end of a run.
    fn end(&mut self, world: &World, body: &Body, cutting: &Cutting) {
        let graph = &body.neighborhoods;
        self.sizes = body.pieces().sizes;
        self.sizes.sort_unstable_by(|a, b| b.cmp(a));
        self.pieces = self.sizes.len();
        self.second_piece = self.sizes.get(1).copied().unwrap_or(0);
        let x = body.motion().positions();
        self.ties = 0;
        for i in 0..body.rest.len() {
            for pair in graph.pairs(i) {
                let j = graph.indices()[pair] as usize;
                let stretch = x[i].distance(x[j]) / body.rest[i].distance(body.rest[j]);
                let links = cutting.factors.factor(pair) > 0.0;
                self.ties += usize::from(j > i && links && stretch > TIE);
            }
        }
        self.missed = cutting.missed_pairs;
        self.latency = median(world.latencies()).map_or(self.latency, |median| 1e-3 * median);
    }

    /// Sets what is found beside the first scene's.
    fn compare(&mut self, first: &Self) {
        let square = |sum: f64, x: f64| sum + x * x;
        let both = self.openings.iter().zip(&first.openings);
        let off = both.map(|(a, b)| a - b).fold(0.0, square);
        let whole = first.openings.iter().copied().fold(0.0, square);
        self.opening_difference = Some((off / whole).sqrt());
        let both = self.severed.intersection(&first.severed).count() as f64;
        let either = self.severed.union(&first.severed).count() as f64;
        let alike = self.row.nodes == first.row.nodes && either > 0.0;
        self.overlap = alike.then(|| both / either);
    }
}

/// The liver under every sampling, capture and step factor.
pub fn cases() -> Result<Vec<Case>, StudyError> {
    let mut cases = Vec::new();
    for nodes in NODES {
        cases.push(case(nodes, CAPTURE, STEP_FACTOR)?);
    }
    for way in CAPTURES.into_iter().filter(|way| *way != CAPTURE) {
        cases.push(case(NODES[0], way, STEP_FACTOR)?);
    }
    for factor in STEP_FACTORS
        .into_iter()
        .filter(|factor| *factor != STEP_FACTOR)
    {
        cases.push(case(NODES[0], CAPTURE, factor)?);
    }
    Ok(cases)
}

fn case(nodes: u32, way: f64, factor: f64) -> Result<Case, StudyError> {
    let mut scene = plain("liver")?;
    scene.bodies[0].sampling.target = Target::Nodes(nodes);
    for cut in &mut scene.cuts {
        cut.capture = Capture::Distance(way);
    }
    scene.integration.step_factor = factor;
    scene.integration.duration = END;
    Ok(Case {
        name: format!("{nodes} nodes, every {} mm, step {factor}", 1e3 * way),
        scene,
    })
}

/// Runs one of [`cases`]; `first` is what the first of them gave.
pub fn measure(name: &str, scene: Scene, first: Option<&Finding>) -> Finding {
    let starts: Vec<f64> = scene.cuts.iter().map(phyxel::scene::Cut::start).collect();
    let mut parts: [Vec<DVec3>; 2] = Default::default();
    let mut found = Finding {
        latency: f64::NAN,
        ..Finding::default()
    };
    let (mut seen, mut spacing) = (0, f64::NAN);
    let row = run_with(name, scene, Options::default(), |world| {
        let body = &world.bodies()[0];
        let (Some(cutting), Some(now)) = (&body.cutting, world.scene_time()) else {
            return;
        };
        let cuts = &cutting.cuts;
        let cut = starts.iter().rposition(|start| *start <= now).unwrap_or(0);
        let inside = |x: DVec3| body.solid.contains(x);
        for triangle in seen..cuts.triangle_count() {
            let triangle = cuts.triangle(triangle);
            within(triangle, DIVISIONS, &inside, &mut parts[cut.min(1)]);
        }
        seen = cuts.triangle_count().max(seen);
        let due = READING * (found.openings.len() + 1) as f64;
        if now >= due && due <= BETWEEN {
            let opening;
            (found.severed, opening) = severed(body, cutting);
            found.openings.push(opening);
        }
        if now + 2.0 * world.step_size() >= END {
            found.end(world, body, cutting);
            spacing = body.spacing;
        }
    });
    let [incision, resection] = parts.map(|vectors| {
        let sum: DVec3 = vectors.iter().sum();
        let area: f64 = vectors.iter().map(|vector| vector.length()).sum();
        let backwards = vectors.iter().filter(|vector| vector.dot(sum) < 0.0);
        let backwards: f64 = backwards.map(|vector| vector.length()).sum();
        (area / sum.length(), backwards)
    });
    found.scene.clone_from(&row.scene);
    (found.incision_ratio, found.incision_backwards) = incision;
    (found.resection_ratio, found.resection_backwards) = resection;
    found.severed_pairs = found.severed.len();
    found.severed_area = found.severed_pairs as f64 * spacing * spacing;
    found.opening = found.openings.last().copied().unwrap_or(0.0);
    found.row = row;
    if let Some(first) = first {
        found.compare(first);
    }
    found
}

/// Severed pairs of a body, and by how much (m) the farthest have come apart.
fn severed(body: &Body, cutting: &Cutting) -> (BTreeSet<[u32; 2]>, f64) {
    let graph = &body.neighborhoods;
    let x = body.motion().positions();
    let (mut pairs, mut opening) = (BTreeSet::new(), 0.0_f64);
    for (i, lower) in (0..body.rest.len()).zip(0_u32..) {
        for pair in graph.pairs(i) {
            let upper = graph.indices()[pair];
            if upper > lower && cutting.factors.factor(pair) <= 0.0 {
                let j = upper as usize;
                let apart = x[i].distance(x[j]) - body.rest[i].distance(body.rest[j]);
                opening = opening.max(apart);
                pairs.insert([lower, upper]);
            }
        }
    }
    (pairs, opening)
}

/// What exceeds a limit, in words.
pub fn breaches(finding: &Finding) -> Vec<String> {
    let Finding { scene, row, .. } = finding;
    if !row.ended {
        return vec![format!("{scene}: does not end: {}", row.error)];
    }
    let mut found = Vec::new();
    for (what, ratio) in [
        ("incision", finding.incision_ratio),
        ("resection", finding.resection_ratio),
    ] {
        if ratio.is_nan() || ratio > FLATNESS {
            found.push(format!(
                "{scene}: the {what}'s area is {ratio:.4} of its vector's, at most {FLATNESS}"
            ));
        }
    }
    if finding.pieces < 2 || finding.ties > 0 {
        found.push(format!(
            "{scene}: the tip hangs on: {} pieces, {} ligaments",
            finding.pieces, finding.ties
        ));
    }
    found
}
