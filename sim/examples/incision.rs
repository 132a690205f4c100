//! The embedded liver's cuts under other samplings, captures and steps: how flat their surfaces are,
//! what they sever, and how far they open.
//!
//! `cargo run --release -p phyxel --example incision -- [KEY=VALUE]...`, with keys as after `--set`;
//! `until=SECONDS` ends earlier.

#![allow(clippy::print_stdout, reason = "it prints what it found")]

use std::path::Path;

use glam::DVec3;
use phyxel::scene::{EMBEDDED, Override, Scene};
use phyxel::phases::Phase;
use phyxel::world::World;
use phyxel_enrich::connected_pieces;

/// Sums over the triangles of one cut that lie in the body.
#[derive(Default, Clone)]
struct Sheet {
    area: f64,
    vector: DVec3,
    triangles: Vec<DVec3>,
    outside: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut until = f64::INFINITY;
    let mut changes = Vec::new();
    for text in std::env::args().skip(1) {
        match text.split_once('=') {
            Some(("until", value)) => until = value.parse()?,
            Some(_) => changes.push(Override::parse(&text)?),
            None => return Err(format!("'{text}' is not KEY=VALUE").into()),
        }
    }
    let text = EMBEDDED[0].text;
    let mut scene = Scene::from_text(text, "liver", Path::new(""), &changes)?;
    scene.pictures = None;
    let cuts = scene.cuts.clone();
    let end = scene.integration.duration.min(until);
    let mut world = World::new(scene)?;
    world.settle()?;
    let mut sheets = vec![Sheet::default(); cuts.len()];
    let mut next_report = 0.25;
    println!(
        "{} nodes\n{:>6} {:>8} {:>8} {:>7} {:>10} {:>10}  pieces",
        world.members()[0].body.rest.len(),
        "time",
        "crossed",
        "severed",
        "missed",
        "opening mm",
        "step ms"
    );
    let mut failed = None;
    while world.scene_time().is_some_and(|now| now < end) {
        if let Err(problem) = world.step() {
            failed = Some(problem);
            break;
        }
        let now = world.scene_time().unwrap_or(0.0);
        for piece in world.take_new_pieces() {
            let Some(cut) = cuts.iter().rposition(|cut| cut.start() <= now) else {
                continue;
            };
            let body = &world.members()[piece.member].body;
            for triangle in piece.triangles {
                sheets[cut].add(triangle, 3, &|x| body.solid.contains(x));
            }
        }
        if now >= next_report || now >= end {
            next_report += 0.25;
            report(&world, now);
        }
    }
    for (cut, sheet) in cuts.iter().zip(&sheets) {
        let normal = sheet.vector.normalize_or_zero();
        let back = sheet.triangles.iter().filter(|v| v.dot(normal) < 0.0);
        println!(
            "{:>12}: {:.3} cm2 inside, over its vector area {:.4}, backwards {:.3} cm2, outside {:.2} cm2",
            cut.name,
            1e4 * sheet.area,
            sheet.area / sheet.vector.length(),
            1e4 * back.map(|v| v.length()).sum::<f64>(),
            1e4 * sheet.outside,
        );
    }
    let mut latencies = world.latencies().to_vec();
    latencies.sort_by(f64::total_cmp);
    if let (Some(median), Some(worst)) = (latencies.get(latencies.len() / 2), latencies.last()) {
        println!("blade to step {median:.2} ms in the median, {worst:.2} at worst");
    }
    let (captures, steps) = (world.members()[0].cutting.as_ref(), world.steps());
    let captures = captures.map_or(0, |cutting| cutting.counts().0);
    let phases = world.phases();
    let spent = |phase| 1e3 * phases.of(phase).seconds;
    #[allow(clippy::cast_precision_loss, reason = "counts of a run")]
    let [capture, step] = [
        spent(Phase::Cut) / captures.max(1) as f64,
        (spent(Phase::Forces) + spent(Phase::Integration)) / steps as f64,
    ];
    println!("a capture takes {capture:.2} ms in the mean, a step {step:.2}");
    ties(&world);
    if let Some(problem) = failed {
        println!("ended by: {problem}");
    }
    Ok(())
}

impl Sheet {
    fn add(&mut self, [p, q, r]: [DVec3; 3], divisions: u32, inside: &dyn Fn(DVec3) -> bool) {
        if divisions == 0 {
            let vector = 0.5 * (q - p).cross(r - p);
            if inside((p + q + r) / 3.0) {
                self.area += vector.length();
                self.vector += vector;
                self.triangles.push(vector);
            } else {
                self.outside += vector.length();
            }
            return;
        }
        let (a, b, c) = (p.midpoint(q), q.midpoint(r), r.midpoint(p));
        for part in [[p, a, c], [a, q, b], [c, b, r], [a, b, c]] {
            self.add(part, divisions - 1, inside);
        }
    }
}

/// Pairs that still link and are stretched threefold: what a piece hangs on.
fn ties(world: &World) {
    let member = &world.members()[0];
    let Some(cutting) = &member.cutting else {
        return;
    };
    let (body, graph) = (&member.body, &member.body.neighborhoods);
    let x = body.motion.positions();
    let mut ties = 0;
    for i in 0..body.rest.len() {
        for pair in graph.pairs(i) {
            let j = graph.indices()[pair] as usize;
            let stretch = x[i].distance(x[j]) / body.rest[i].distance(body.rest[j]);
            let factor = cutting.factors().factor(pair);
            if j > i && factor > 0.0 && stretch > 3.0 {
                ties += 1;
                let (a, b) = (body.rest[i], body.rest[j]);
                let sheet = cutting.cuts().nearest(a.midpoint(b), 0.02);
                println!(
                    "tie {i}-{j}: {:.4} to {:.4}, stretched {stretch:.1}, factor {factor:.3}, sheet at {:.2} spacings",
                    a,
                    b,
                    sheet.map_or(99.0, |s| s.distance / body.spacing),
                );
            }
        }
    }
    println!("{ties} ties");
}

fn report(world: &World, now: f64) {
    let member = &world.members()[0];
    let Some(cutting) = &member.cutting else {
        return;
    };
    let (body, graph) = (&member.body, &member.body.neighborhoods);
    let x = body.motion.positions();
    let mut opening = 0.0_f64;
    for i in 0..body.rest.len() {
        for pair in graph.pairs(i) {
            if cutting.factors().factor(pair) == 0.0 {
                let j = graph.indices()[pair] as usize;
                let apart = x[i].distance(x[j]) - body.rest[i].distance(body.rest[j]);
                opening = opening.max(apart);
            }
        }
    }
    let weights = body.stencils.weights();
    let mut pieces = connected_pieces(graph.offsets(), graph.indices(), weights).sizes;
    pieces.sort_unstable_by(|a, b| b.cmp(a));
    pieces.truncate(5);
    println!(
        "{now:>6.2} {:>8} {:>8} {:>7} {:>10.2} {:>10.3}  {pieces:?}",
        cutting.factors().crossed_count(),
        cutting.severed_pairs(),
        cutting.missed_pairs(),
        1e3 * opening,
        1e3 * world.step_size()
    );
}
