//! The closing table for people.

use std::fmt::{Display, Write};
use std::path::Path;

use super::summary::{BodySummary, CutSummary, Summary, Timings};

/// Strokes that get a line of their own; `summary.json` has all.
const MOST_STROKES: usize = 8;

/// The table in the making.
#[derive(Default)]
struct Rows(String);

impl Rows {
    /// Adds a row: its name and what is said.
    fn add(&mut self, name: &str, said: impl Display) {
        // Writing into a string cannot fail.
        let _ = writeln!(self.0, "{name:>20}  {said}");
    }
}

/// The summary as lines of text, with the folder of the results.
#[must_use]
pub fn table(summary: &Summary, folder: &Path) -> String {
    let mut rows = Rows::default();
    for body in &summary.bodies {
        add_body(&mut rows, body);
    }
    let stepping = &summary.stepping;
    let (steps, settling, time) = (stepping.steps, stepping.settling_steps, stepping.simulated);
    let rested = if stepping.rested {
        ""
    } else {
        ", not at rest yet"
    };
    let said = format!("{steps} ({settling} to settle{rested}), {time:.2} s simulated");
    rows.add("steps", said);
    let (step, chosen) = (1e3 * stepping.step, &stepping.chosen);
    rows.add("step size", format_args!("{step:.3} ms: {chosen}"));
    if let Some(cuts) = &summary.cuts {
        add_cuts(&mut rows, cuts);
    }
    add_touched(&mut rows, summary);
    for warning in &summary.warnings {
        rows.add("warning", warning);
    }
    add_timings(&mut rows, &summary.timings);
    let (folder, files) = (folder.display(), summary.files.join(", "));
    rows.add("files", format_args!("{folder}: {files}"));
    rows.0
}

fn add_body(rows: &mut Rows, body: &BodySummary) {
    rows.add("body", &body.name);
    let (nodes, pairs, tetrahedra) = (body.nodes, body.pairs, body.tetrahedra);
    let (held, apart) = (body.supported, 1e3 * body.spacing);
    let said = format!(
        "{nodes} nodes, {pairs} pairs, {tetrahedra} tetrahedra, {held} nodes fixed, {apart:.2} mm apart"
    );
    rows.add("size", said);
    let (before, after) = (body.mass_before, body.mass_after);
    let change = after / before - 1.0;
    let said = format!("{before:.6} kg before, {after:.6} kg after (change {change:+.1e})");
    rows.add("mass", said);
    let [before, after] = [body.volume_before, body.volume_after].map(|volume| 1e3 * volume);
    let change = body.volume_after / body.volume_before - 1.0;
    let off = body.volume_error.map_or(String::new(), |error| {
        format!("; tetrahedra {:+.2} % off the body's", 1e2 * error)
    });
    let said = format!("{before:.4} l before, {after:.4} l after (change {change:+.1e}){off}");
    rows.add("volume", said);
    rows.add("pieces", body.pieces);
    let energy = &body.energy;
    let (kinetic, elastic, work) = (energy.kinetic, energy.elastic, energy.external_work);
    let (damped, released) = (energy.dissipated, energy.released_by_cuts);
    let said = format!(
        "kinetic {kinetic:.3e} J, elastic {elastic:.3e} J, work {work:.3e} J, damped {damped:.3e} J, \
         released by cuts {released:.3e} J"
    );
    rows.add("energy", said);
    let (added, most) = (energy.added_by_cuts, energy.largest_cut_addition);
    if added > 0.0 {
        let said = format!(
            "of it {added:.1e} J added, at most {most:.1e} of what was stored by one update"
        );
        rows.add("", said);
    }
    let (taken, stored, lost) = (energy.numerical, energy.viscous, energy.relaxed);
    if taken != 0.0 {
        let said = format!("{taken:.3e} J taken by implicit steps");
        rows.add("scheme", said);
    }
    if lost != 0.0 {
        let said = format!("{stored:.3e} J stored, {lost:.3e} J lost");
        rows.add("viscosity", said);
    }
    let balance = if energy.moved {
        let off = energy.imbalance;
        format!("energy unexplained {off:.1e} of what is stored or dissipated")
    } else {
        "nothing moved".to_owned()
    };
    let (error, smallest) = (body.momentum_error, body.smallest_determinant);
    let said = format!("{balance}; |sum f|/sum |f| {error:.1e}; det F >= {smallest:.3}");
    rows.add("audit", said);
}

fn add_cuts(rows: &mut Rows, cuts: &CutSummary) {
    let (captures, updates, triangles) = (cuts.captures, cuts.updates, cuts.triangles);
    let (weakened, severed) = (cuts.weakened_pairs, cuts.severed_pairs);
    let (growth, deficient) = (cuts.eigenvalue_growth, cuts.weak_nodes);
    let said = format!(
        "{captures} captures, {updates} updates, {triangles} triangles, {weakened} pairs weakened, {severed} \
         severed; stiffness x{growth:.2}, {deficient} deficient nodes"
    );
    rows.add("cuts", said);
    for stroke in cuts.strokes.iter().take(MOST_STROKES) {
        let (cut, body) = (&stroke.cut, &stroke.body);
        let (captures, updates) = (stroke.captures, stroke.updates);
        let energy = &stroke.energy;
        let (released, added, decay) = (energy.released, energy.added, energy.decay);
        let said = format!(
            "{cut} of {body}: {captures} captures, {updates} updates; released by cuts {released:.3e} J, added \
             {added:.1e} J, retained {decay:+.1e} J"
        );
        rows.add("stroke", said);
    }
    if let more @ 1.. = cuts.strokes.len().saturating_sub(MOST_STROKES) {
        rows.add("", format_args!("and {more} more in summary.json"));
    }
    if let Some((lattices, pairs)) = cuts.lattices.zip(cuts.pairs_without_lattice) {
        let said = format!("{lattices} lattices; {pairs} pairs without one, by Diffraction");
        rows.add("grids", said);
    }
}

/// Tools, contact and pictures.
fn add_touched(rows: &mut Rows, summary: &Summary) {
    for tool in &summary.tools {
        let (name, force, work) = (&tool.name, tool.force, tool.work);
        let (largest, deepest) = (tool.largest_force, 1e3 * tool.deepest_penetration);
        let said = format!(
            "{name}: at most {largest:.3} N and {deepest:.3} mm deep; {force:.3} N at the end; work on it {work:.3e} J"
        );
        rows.add("tool", said);
    }
    if let Some(contact) = &summary.contact {
        let (force, energy, lost) = (contact.force, contact.energy, contact.dissipated);
        let (area, depth) = (1e4 * contact.area, 1e3 * contact.penetration);
        let offsets = contact.offset_work;
        let said = format!(
            "{force:.3} N on {area:.3} cm² and {depth:.3} mm deep at the end; {energy:.3e} J stored, friction took \
             {lost:.3e} J, offsets did {offsets:.1e} J"
        );
        rows.add("contact", said);
    }
    if let Some(pictures) = &summary.pictures {
        let (frames, width, height) = (pictures.frames, pictures.width, pictures.height);
        let (surfels, skin) = (pictures.surfels, pictures.skin_surfels);
        let said =
            format!("{frames} frames of {width}x{height}, {surfels} surfels and {skin} of cuts");
        rows.add("pictures", said);
    }
}

fn add_timings(rows: &mut Rows, timings: &Timings) {
    let (step, factor) = (timings.milliseconds_per_step, timings.real_time_factor);
    let threads = timings.threads;
    let said = format!(
        "{step:.3} ms a step, {factor:.2} simulated seconds per second of stepping on \
         {threads} threads"
    );
    rows.add("speed", said);
    if let Some(latency) = &timings.update_to_step {
        let (median, worst, count) = (latency.median, latency.worst, latency.count);
        let said = format!(
            "median {median:.2} ms, worst {worst:.2} ms from {count} updates to the first step with them"
        );
        rows.add("blade to step", said);
    }
    let said = format!("{:>10} {:>12} {:>10}", "total s", "ms a call", "calls");
    rows.add("phase", said);
    for phase in timings.phases.iter().filter(|phase| phase.calls > 0) {
        let (seconds, call, calls) = (phase.seconds, phase.milliseconds_per_call, phase.calls);
        let said = format!("{seconds:>10.3} {call:>12.3} {calls:>10}");
        rows.add(phase.phase, said);
    }
    rows.add("whole run", format_args!("{:.1} s", timings.wall));
}
