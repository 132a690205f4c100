//! The embedded liver's cuts over node counts, captures and steps: how flat their surfaces are, what they
//! sever, and how far they open.

use std::collections::BTreeSet;
use std::fmt;

use glam::DVec3;
use phyxel::scene::{Capture, Scene, Target};
use phyxel::{Member, World};
use serde::Serialize;

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

/// One cut's surface.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Sheet {
    /// Area (m²) inside the body.
    pub area: f64,
    /// Length (m²) of its area vector.
    pub vector: f64,
    /// Area (m²) whose normal points against the vector.
    pub backwards: f64,
}

impl Sheet {
    /// Area over the length of its vector: 1 if it is flat.
    pub fn ratio(&self) -> f64 {
        self.area / self.vector
    }
}

/// What was found of one scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Finding {
    /// The incision's surface, and the resection's.
    pub sheets: [Sheet; 2],
    /// Pairs that the incision severed, lower node first.
    pub severed: BTreeSet<[u32; 2]>,
    /// Largest opening (m) of the incision at every multiple of 0.1 s of the scene's time before the resection.
    pub openings: Vec<f64>,
    /// Pairs that blades passed and that no surface crosses.
    pub missed: usize,
    /// Linked pairs stretched threefold at the end.
    pub ties: usize,
    /// Nodes of the pieces at the end, largest first.
    pub pieces: Vec<u32>,
    /// Median time (s) from a blade's edge to the end of its step.
    pub latency: f64,
    /// Mean distance of neighbours (m).
    pub spacing: f64,
    /// The run's figures.
    pub row: Row,
}

impl Finding {
    /// Pairs that the incision severed times the square of the spacing (m²): the same whatever the nodes.
    pub fn severed_area(&self) -> f64 {
        let pairs = u32::try_from(self.severed.len()).map_or(f64::INFINITY, f64::from);
        pairs * self.spacing * self.spacing
    }

    /// Largest opening (m) of the incision right before the resection.
    pub fn opening(&self) -> f64 {
        self.openings.last().copied().unwrap_or(0.0)
    }

    /// How far its openings over time are off another's: the root mean square of the difference, over that of the
    /// other's.
    pub fn opening_difference(&self, other: &Self) -> f64 {
        let square = |sum: f64, x: f64| sum + x * x;
        let both = self.openings.iter().zip(&other.openings);
        let off = both.map(|(a, b)| a - b).fold(0.0, square);
        (off / other.openings.iter().copied().fold(0.0, square)).sqrt()
    }

    /// Fraction of the pairs severed here or there that are severed here and there, if the nodes are the same.
    pub fn overlap(&self, other: &Self) -> Option<f64> {
        let count = |n: usize| u32::try_from(n).map_or(f64::INFINITY, f64::from);
        let both = count(self.severed.intersection(&other.severed).count());
        let either = count(self.severed.union(&other.severed).count());
        (self.row.nodes == other.row.nodes && either > 0.0).then(|| both / either)
    }
}

/// A line of the table of incisions.
#[derive(Debug, Serialize)]
pub struct Line {
    scene: String,
    incision_ratio: f64,
    resection_ratio: f64,
    incision_backwards: f64,
    resection_backwards: f64,
    severed_pairs: usize,
    severed_area: f64,
    overlap: Option<f64>,
    opening: f64,
    opening_difference: Option<f64>,
    missed: usize,
    ties: usize,
    pieces: usize,
    second_piece: u32,
    latency: f64,
    #[serde(skip)]
    sizes: Vec<u32>,
    #[serde(skip)]
    wall: f64,
    /// What exceeds a limit, in words.
    #[serde(skip)]
    pub breaches: Vec<String>,
}

impl Line {
    /// What was found of a scene, beside what was found of the first one.
    pub fn new(finding: &Finding, first: Option<&Finding>) -> Self {
        let [incision, resection] = finding.sheets;
        Self {
            scene: finding.row.scene.clone(),
            incision_ratio: incision.ratio(),
            resection_ratio: resection.ratio(),
            incision_backwards: incision.backwards,
            resection_backwards: resection.backwards,
            severed_pairs: finding.severed.len(),
            severed_area: finding.severed_area(),
            overlap: first.and_then(|first| finding.overlap(first)),
            opening: finding.opening(),
            opening_difference: first.map(|first| finding.opening_difference(first)),
            missed: finding.missed,
            ties: finding.ties,
            pieces: finding.pieces.len(),
            second_piece: finding.pieces.get(1).copied().unwrap_or(0),
            latency: finding.latency,
            sizes: finding.pieces.clone(),
            wall: finding.row.wall,
            breaches: breaches(finding),
        }
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<34} area over vector area: incision {:.4}, resection {:.4}, backwards {:.3} and {:.3} cm2; incision: \
             {} pairs severed ({:.2} cm2), overlap {:.3}, opens {:.2} mm, over time {:.3} off the first; {} missed, {} ties, pieces {:?}, \
             blade to step {:.2} ms, {:.0} s",
            self.scene,
            self.incision_ratio,
            self.resection_ratio,
            1e4 * self.incision_backwards,
            1e4 * self.resection_backwards,
            self.severed_pairs,
            1e4 * self.severed_area,
            self.overlap.unwrap_or(f64::NAN),
            1e3 * self.opening,
            self.opening_difference.unwrap_or(f64::NAN),
            self.missed,
            self.ties,
            self.sizes,
            1e3 * self.latency,
            self.wall
        )
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

/// Runs one of [`cases`].
pub fn measure(name: &str, scene: Scene) -> Finding {
    let starts: Vec<f64> = scene.cuts.iter().map(phyxel::scene::Cut::start).collect();
    let mut parts: [Vec<DVec3>; 2] = Default::default();
    let mut seen = 0;
    let mut found = Finding {
        latency: f64::NAN,
        spacing: f64::NAN,
        ..Finding::default()
    };
    let row = run_with(name, scene, Options::default(), |world| {
        let member = &world.members()[0];
        let (Some(cutting), Some(now)) = (&member.cutting, world.scene_time()) else {
            return;
        };
        let cuts = cutting.cuts();
        if cuts.triangle_count() > seen {
            let cut = starts.iter().rposition(|start| *start <= now).unwrap_or(0);
            let solid = &member.body.solid;
            for triangle in seen..cuts.triangle_count() {
                let inside = |x: DVec3| solid.contains(x);
                within(
                    cuts.triangle(triangle),
                    DIVISIONS,
                    &inside,
                    &mut parts[cut.min(1)],
                );
            }
            seen = cuts.triangle_count();
        }
        let due = READING * (found.openings.len() + 1) as f64;
        if now >= due && due <= BETWEEN {
            let opening;
            (found.severed, opening) = severed(member);
            found.openings.push(opening);
        }
        if now + 2.0 * world.step_size() >= END {
            finish(world, member, &mut found);
        }
    });
    found.sheets = parts.map(|vectors| {
        let sum: DVec3 = vectors.iter().sum();
        let backwards = vectors.iter().filter(|vector| vector.dot(sum) < 0.0);
        Sheet {
            area: vectors.iter().map(|vector| vector.length()).sum(),
            vector: sum.length(),
            backwards: backwards.map(|vector| vector.length()).sum(),
        }
    });
    found.row = row;
    found
}

/// What is read at the end.
fn finish(world: &World, member: &Member, found: &mut Finding) {
    let Some(cutting) = &member.cutting else {
        return;
    };
    let (body, graph) = (&member.body, &member.body.neighborhoods);
    found.missed = cutting.missed_pairs();
    found.spacing = body.spacing;
    found.pieces = member.pieces().sizes;
    found.pieces.sort_unstable_by(|a, b| b.cmp(a));
    let x = body.motion.positions();
    found.ties = 0;
    for i in 0..body.rest.len() {
        for pair in graph.pairs(i) {
            let j = graph.indices()[pair] as usize;
            let stretch = x[i].distance(x[j]) / body.rest[i].distance(body.rest[j]);
            let links = cutting.factors().factor(pair) > 0.0;
            found.ties += usize::from(j > i && links && stretch > TIE);
        }
    }
    if let Some(median) = median(world.latencies()) {
        found.latency = 1e-3 * median;
    }
}

/// Severed pairs of a body, and by how much (m) the farthest have come apart.
fn severed(member: &Member) -> (BTreeSet<[u32; 2]>, f64) {
    let Some(cutting) = &member.cutting else {
        return (BTreeSet::new(), 0.0);
    };
    let (body, graph) = (&member.body, &member.body.neighborhoods);
    let x = body.motion.positions();
    let (mut pairs, mut opening) = (BTreeSet::new(), 0.0_f64);
    for (i, lower) in (0..body.rest.len()).zip(0_u32..) {
        for pair in graph.pairs(i) {
            let upper = graph.indices()[pair];
            if upper > lower && cutting.factors().factor(pair) <= 0.0 {
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
fn breaches(finding: &Finding) -> Vec<String> {
    let (mut found, row) = (Vec::new(), &finding.row);
    if !row.ended {
        found.push(format!("{}: does not end: {}", row.scene, row.error));
        return found;
    }
    for (what, sheet) in ["incision", "resection"].iter().zip(&finding.sheets) {
        let ratio = sheet.ratio();
        if ratio.is_nan() || ratio > FLATNESS {
            found.push(format!(
                "{}: the {what}'s area is {ratio:.4} of its vector's, at most {FLATNESS}",
                row.scene
            ));
        }
    }
    if finding.pieces.len() < 2 || finding.ties > 0 {
        found.push(format!(
            "{}: the tip hangs on: {} pieces, {} ligaments",
            row.scene,
            finding.pieces.len(),
            finding.ties
        ));
    }
    found
}
