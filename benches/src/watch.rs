//! Running a scene and watching every step of it.

use std::collections::VecDeque;
use std::time::Instant;

use glam::DVec3;
use phyxel::scene::Scene;
use phyxel::{Body, CutEnergy, Cutting, World, WorldError};
use phyxel_cli::cli::load;
use phyxel_enrich::{SMALLEST_PART, connected_pieces};

use crate::eigenvalue::largest_eigenvalue;
use crate::row::{Place, Row};

/// How often a triangle is divided into four to tell what of it lies in the body: the parts are a tenth
/// of a spacing.
pub(crate) const DIVISIONS: u32 = 3;

/// Steps between two independent estimates of the largest eigenvalue.
const STEPS_PER_ESTIMATE: u64 = 50;
/// Products of one such estimate.
const PRODUCTS: usize = 80;
/// A run that needs this many times the steps that its first step size promises is given up.
const MOST_STEPS: f64 = 30.0;

/// Steps that may be rolled back together.
const LONGEST_STRETCH: usize = 50;

/// How a scene is monitored.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Options {
    /// Whether the step is checked against an independent estimate of the largest eigenvalue; a run
    /// takes about three times as long then.
    pub eigenvalues: bool,
}

/// Runs a scene to its end, or to its failure, without pictures and files.
pub fn run(name: &str, scene: Scene, options: Options) -> Row {
    run_with(name, scene, options, |_| {})
}

/// As [`run`]; `seen` looks at the world after every step.
pub fn run_with(
    name: &str,
    mut scene: Scene,
    options: Options,
    mut seen: impl FnMut(&World),
) -> Row {
    scene.pictures = None;
    let begun = Instant::now();
    let outcome = World::new(scene).map(|mut world| {
        let load = load(&world);
        let mut watch = Watch::new(&world, options);
        let outcome = watch.course(&mut world, &mut seen);
        let mut row = watch.row(&world);
        row.load = load;
        (row, outcome)
    });
    let (mut row, error) = match outcome {
        Ok((row, Ok(()))) => (row, String::new()),
        Ok((row, Err(stop))) => (row, stop),
        Err(error) => (Row::unbuilt(), error.to_string()),
    };
    row.ended = error.is_empty();
    row.error = error;
    name.clone_into(&mut row.scene);
    row.wall = begun.elapsed().as_secs_f64();
    row
}

/// Energies (J) of a body between two steps.
#[derive(Debug, Clone, Copy, Default)]
struct Energies {
    /// Added so far by those updates of cuts that added any.
    added: f64,
    elastic: f64,
}

impl Energies {
    fn of(body: &Body) -> Self {
        Self {
            added: cut_energy(body).added,
            elastic: body.motion().audit().elastic,
        }
    }
}

fn cut_energy(body: &Body) -> CutEnergy {
    let cutting = body.cutting.as_ref();
    cutting.map_or(CutEnergy::default(), |cutting| cutting.energy)
}

/// What updates of one stroke did.
#[derive(Debug, Clone, Copy, Default)]
struct Stroke {
    added: f64,
    stored: f64,
}

/// Who is linked with whom in one body, as its cuts leave it.
#[derive(Debug, Default)]
struct Links {
    updates: usize,
    offsets: Vec<usize>,
    /// Neighbour and squared distance (m²) at rest.
    links: Vec<(u32, f64)>,
    debris: Vec<bool>,
}

impl Links {
    fn of(body: &Body) -> Self {
        let graph = &body.neighborhoods;
        let factors = (0..graph.pair_count()).map(|pair| body.factor(pair));
        let factors: Vec<f64> = factors.collect();
        let pieces = connected_pieces(graph.offsets(), graph.indices(), &factors);
        let piece = pieces.piece.iter();
        let debris = piece.map(|&piece| (pieces.sizes[piece as usize] as usize) < SMALLEST_PART);
        let (mut offsets, mut links) = (vec![0], Vec::new());
        for node in 0..body.rest.len() {
            for pair in graph.pairs(node) {
                if factors[pair] > 0.0 {
                    let other = graph.indices()[pair];
                    let rest = body.rest[node].distance_squared(body.rest[other as usize]);
                    links.push((other, rest));
                }
            }
            offsets.push(links.len());
        }
        Self {
            updates: updates(body),
            debris: debris.collect(),
            offsets,
            links,
        }
    }

    /// The node farthest from all that it is linked to, with the squared ratio to rest, if above
    /// `least`.
    fn farthest(&self, positions: &[DVec3], mut least: f64) -> Option<(usize, f64)> {
        let mut found = None;
        for (node, x) in positions.iter().enumerate() {
            if self.debris[node] {
                continue;
            }
            let mut nearest = f64::INFINITY;
            for &(other, rest) in &self.links[self.offsets[node]..self.offsets[node + 1]] {
                nearest = nearest.min(x.distance_squared(positions[other as usize]) / rest);
                if nearest <= least {
                    break;
                }
            }
            if nearest > least && nearest.is_finite() {
                least = nearest;
                found = Some((node, nearest));
            }
        }
        found
    }
}

/// Updates of the connectivity so far.
fn updates(body: &Body) -> usize {
    let cutting = body.cutting.as_ref();
    cutting.map_or(0, |cutting| cutting.counts().1)
}

struct Watch {
    options: Options,
    most_steps: u64,
    before: Vec<Energies>,
    links: Vec<Links>,
    strokes: Vec<Stroke>,
    /// Energy (J) below which there is none.
    round_off: f64,
    /// Energy (J) lost to damping when the connectivity first changed.
    damped_before: Option<f64>,
    extremes: Extremes,
    /// Extremes before each of the last steps, the oldest first.
    recent: VecDeque<Extremes>,
    /// Stretches of steps that were retried.
    retaken: u64,
    row: Row,
}

/// What was largest or smallest so far, over steps that were not rolled back.
#[derive(Debug, Clone, Copy)]
struct Extremes {
    elastic: f64,
    dissipated: f64,
    unexplained: f64,
    step: f64,
    determinant: (f64, Place),
    inverted: Option<Place>,
    /// Squared ratio of the distance to linked nodes to that at rest.
    distance: (f64, Place),
    step_to_limit: Option<(f64, u64)>,
}

impl Extremes {
    const NONE: Self = Self {
        elastic: 0.0,
        dissipated: 0.0,
        unexplained: 0.0,
        step: f64::INFINITY,
        determinant: (f64::INFINITY, Place { node: 0, step: 0 }),
        inverted: None,
        distance: (1.0, Place { node: 0, step: 0 }),
        step_to_limit: None,
    };
}

impl Watch {
    fn new(world: &World, options: Options) -> Self {
        let integration = &world.scene().integration;
        let settling = integration.settle.map_or(0.0, |settle| settle.limit);
        let expected = (integration.duration + settling) / world.first_step();
        let most_steps = (MOST_STEPS * expected) as u64;
        // An energy density is a difference of terms of the size of the modulus.
        let bodies = world.bodies().iter();
        let round_off = bodies.map(|body| body.elastic().energy_round_off(&body.rest));
        Self {
            options,
            most_steps,
            round_off: round_off.sum(),
            damped_before: None,
            before: world.bodies().iter().map(Energies::of).collect(),
            links: world.bodies().iter().map(Links::of).collect(),
            strokes: vec![Stroke::default(); world.scene().cuts.len()],
            extremes: Extremes::NONE,
            recent: VecDeque::new(),
            retaken: 0,
            row: Row::unbuilt(),
        }
    }

    /// Settles and plays; the error in words.
    fn course(&mut self, world: &mut World, seen: &mut impl FnMut(&World)) -> Result<(), String> {
        let said = |error: WorldError| error.to_string();
        while world.is_settling() {
            self.step(world)?;
            seen(world);
        }
        if world.scene_time().is_none() {
            world.start_scene().map_err(said)?;
        }
        let duration = world.scene().integration.duration;
        while world.scene_time().is_some_and(|time| time < duration) {
            self.step(world)?;
            seen(world);
        }
        Ok(())
    }

    fn step(&mut self, world: &mut World) -> Result<(), String> {
        world.step().map_err(|error| error.to_string())?;
        self.note(world);
        if world.steps() > self.most_steps {
            return Err(format!(
                "given up after {} steps at {:.4} s: {MOST_STEPS} times the steps that the first step \
                 size promised",
                world.steps(),
                world.time()
            ));
        }
        Ok(())
    }

    /// Takes the figures of the step that was taken.
    fn note(&mut self, world: &World) {
        let step = world.steps();
        self.forget_retaken(world.retaken().stretches);
        self.extremes.step = self.extremes.step.min(world.step_size());
        let stroke = self.stroke_of(world);
        let mut cut = false;
        let (mut elastic, mut dissipated, mut balance) = (0.0, 0.0, 0.0);
        for (index, body) in world.bodies().iter().enumerate() {
            let audit = body.motion().audit();
            elastic += audit.elastic;
            dissipated += audit.taken();
            balance += audit.energy_error();
            let (before, now) = (self.before[index], Energies::of(body));
            self.before[index] = now;
            if updates(body) != self.links[index].updates {
                self.links[index] = Links::of(body);
                cut = true;
                self.note_update(now.added - before.added, before.elastic, stroke, step);
            }
            self.note_nodes(index, body, step);
            if self.options.eigenvalues && step.is_multiple_of(STEPS_PER_ESTIMATE) {
                let largest = largest_eigenvalue(body, PRODUCTS, step);
                let viscosity = body.motion().settings().viscosity;
                let ratio = world.step_size() / damped_limit(largest, viscosity);
                let most = &mut self.extremes.step_to_limit;
                if most.is_none_or(|(most, _)| ratio.is_nan() || ratio > most) {
                    *most = Some((ratio, step));
                }
            }
        }
        if cut {
            self.damped_before.get_or_insert(dissipated);
        }
        let most = &mut self.extremes;
        most.elastic = most.elastic.max(elastic);
        most.dissipated = most.dissipated.max(dissipated);
        most.unexplained = most.unexplained.max(balance.abs());
    }

    /// Goes back to the extremes before the oldest step that may have been rolled back, if any was.
    fn forget_retaken(&mut self, stretches: u64) {
        if stretches != self.retaken {
            self.retaken = stretches;
            self.extremes = self.recent.front().copied().unwrap_or(self.extremes);
            self.recent.clear();
        }
        self.recent.push_back(self.extremes);
        if self.recent.len() > LONGEST_STRETCH {
            self.recent.pop_front();
        }
    }

    /// The stroke that the last step belongs to: the last one that has begun.
    fn stroke_of(&self, world: &World) -> Option<usize> {
        let time = world.scene_time()?;
        let cuts = world.scene().cuts.iter().enumerate();
        let begun = cuts.filter(|(_, cut)| cut.start() <= time);
        begun
            .max_by(|(_, a), (_, b)| a.start().total_cmp(&b.start()))
            .map(|(index, _)| index)
    }

    fn note_update(&mut self, jump: f64, stored: f64, stroke: Option<usize>, step: u64) {
        if let Some(stroke) = stroke {
            let most = &mut self.strokes[stroke].stored;
            *most = most.max(stored);
        }
        if jump <= 0.0 {
            return;
        }
        let share = jump / stored.max(self.round_off);
        if share > self.row.added {
            self.row.added = share;
            self.row.added_at = step;
        }
        if let Some(stroke) = stroke {
            self.strokes[stroke].added += jump;
        }
    }

    fn note_nodes(&mut self, index: usize, body: &Body, step: u64) {
        let gradients = body.elastic().deformation_gradients();
        let carrying = carrying(body);
        for (node, (f, carries)) in gradients.iter().zip(carrying).enumerate() {
            let determinant = f.determinant();
            let smallest = self.extremes.determinant.0;
            if carries && (determinant.is_nan() || determinant < smallest) {
                self.extremes.determinant = (determinant, Place { node, step });
                if determinant <= 0.0 {
                    self.extremes.inverted.get_or_insert(Place { node, step });
                }
            }
        }
        let most = self.extremes.distance.0;
        let found = self.links[index].farthest(body.motion().positions(), most);
        if let Some((node, ratio)) = found {
            self.extremes.distance = (ratio, Place { node, step });
        }
    }

    /// The row of the world as it is now.
    fn row(mut self, world: &World) -> Row {
        let row = &mut self.row;
        row.steps = world.steps();
        row.retaken = world.retaken().stretches;
        row.unbalanced = world.retaken().unbalanced;
        row.time = world.time();
        row.first_step = world.first_step();
        let extremes = &self.extremes;
        row.shrink = world.first_step() / extremes.step;
        (row.smallest_determinant, row.smallest_determinant_at) = extremes.determinant;
        row.first_inverted_at = extremes.inverted;
        row.farthest = extremes.distance.0.sqrt();
        row.farthest_at = extremes.distance.1;
        row.step_to_limit = extremes.step_to_limit.map(|(ratio, _)| ratio);
        row.step_to_limit_at = extremes.step_to_limit.map(|(_, step)| step);
        let (mut balance, mut followers, mut debris) = (0.0, 0, 0);
        for (body, links) in world.bodies().iter().zip(&self.links) {
            let audit = body.motion().audit();
            row.nodes += body.rest.len();
            row.released -= audit.energy_correction + body.relaxed;
            row.decay += cut_energy(body).decay;
            row.elastic += audit.elastic;
            row.kinetic += audit.kinetic;
            row.dissipated += audit.taken();
            balance += audit.energy_error();
            let severed = body.cutting.as_ref().map_or(0, Cutting::severed_pairs);
            row.severed += severed;
            let cutting = body.cutting.as_ref();
            row.area += cutting.map_or(0.0, |cutting| area_within(cutting, body));
            for (node, (carries, &apart)) in carrying(body).zip(&links.debris).enumerate() {
                debris += usize::from(apart);
                // What a support holds follows nothing.
                let held = body.motion().supports().of(node).is_some();
                followers += usize::from(!carries && !apart && !held);
            }
        }
        row.followers = followers as f64 / row.nodes as f64;
        row.debris = debris as f64 / row.nodes as f64;
        row.damped = row.dissipated - self.damped_before.unwrap_or(row.dissipated);
        let scale = row.elastic.max(row.dissipated);
        row.imbalance = relative(balance.abs(), scale);
        let scale = extremes.elastic.max(extremes.dissipated);
        row.worst_imbalance = relative(extremes.unexplained, scale);
        row.most_elastic = extremes.elastic;
        let strokes = self.strokes.iter();
        row.added_by_stroke = strokes
            .map(|stroke| relative(stroke.added, stroke.stored.max(self.round_off)))
            .fold(0.0, f64::max);
        self.row
    }
}

/// Area (m²) of the cuts' surfaces in a body, in material coordinates.
fn area_within(cutting: &Cutting, body: &Body) -> f64 {
    let (cuts, inside) = (&cutting.cuts, |x: DVec3| body.solid.contains(x));
    let mut parts = Vec::new();
    for triangle in 0..cuts.triangle_count() {
        within(cuts.triangle(triangle), DIVISIONS, &inside, &mut parts);
    }
    parts.iter().map(|part| part.length()).sum()
}

/// Which nodes carry strain energy.
fn carrying(body: &Body) -> impl Iterator<Item = bool> + '_ {
    let weak = body.elastic().deficient_nodes();
    let nodes = 0..u32::try_from(body.rest.len()).unwrap_or(u32::MAX);
    nodes.map(|node| weak.binary_search(&node).is_err())
}

/// `part / whole`; 0 of nothing.
fn relative(part: f64, whole: f64) -> f64 {
    if part == 0.0 {
        0.0
    } else {
        part / whole.max(f64::MIN_POSITIVE)
    }
}

/// Largest stable step (s) of central differences whose viscous force `viscosity · df/dt` lags by half
/// a step: `2/ω (sqrt(1 + ξ²) − ξ)`, `ξ = viscosity ω / 2` (Belytschko, Liu, Moran 2000, section 6.2).
fn damped_limit(eigenvalue: f64, viscosity: f64) -> f64 {
    let omega = eigenvalue.sqrt();
    let xi = 0.5 * viscosity * omega;
    2.0 / omega * ((1.0 + xi * xi).sqrt() - xi)
}

impl Row {
    /// The row of a scene of which nothing is known.
    pub(crate) fn unbuilt() -> Self {
        Self {
            shrink: 1.0,
            smallest_determinant: f64::INFINITY,
            farthest: 1.0,
            ..Self::default()
        }
    }
}

/// Area vectors of the parts of a triangle that lie in the body.
pub(crate) fn within(
    [p, q, r]: [DVec3; 3],
    divisions: u32,
    inside: &dyn Fn(DVec3) -> bool,
    out: &mut Vec<DVec3>,
) {
    if divisions == 0 {
        if inside((p + q + r) / 3.0) {
            out.push(0.5 * (q - p).cross(r - p));
        }
        return;
    }
    let (a, b, c) = (p.midpoint(q), q.midpoint(r), r.midpoint(p));
    for part in [[p, a, c], [a, q, b], [c, b, r], [a, b, c]] {
        within(part, divisions - 1, inside, out);
    }
}
