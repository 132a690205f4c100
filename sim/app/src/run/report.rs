//! The closing table for people.

use std::fmt::{self, Write};
use std::path::Path;

use super::summary::{BodySummary, CutSummary, Summary};

/// Strokes that get a line of their own; `summary.json` has all.
const MOST_STROKES: usize = 8;

/// The summary as lines of text, with the folder of the results.
#[must_use]
pub fn table(summary: &Summary, folder: &Path) -> String {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _ = write_table(&mut text, summary, folder);
    text
}

/// A line of the table: its name and what is said, as `writeln!` takes it.
macro_rules! row {
    ($text:ident, $name:expr, $($said:tt)*) => {
        writeln!($text, "{:>20}  {}", $name, format_args!($($said)*))?
    };
}

fn write_table(text: &mut String, summary: &Summary, folder: &Path) -> fmt::Result {
    for body in &summary.bodies {
        write_body(text, body)?;
    }
    let stepping = &summary.stepping;
    let (steps, settling, time) = (stepping.steps, stepping.settling_steps, stepping.simulated);
    let rested = if stepping.rested {
        ""
    } else {
        ", not at rest yet"
    };
    row!(
        text,
        "steps",
        "{steps} ({settling} to settle{rested}), {time:.2} s simulated"
    );
    let (step, chosen) = (1e3 * stepping.step, &stepping.chosen);
    row!(text, "step size", "{step:.3} ms: {chosen}");
    if let Some(cuts) = &summary.cuts {
        write_cuts(text, cuts)?;
    }
    for tool in &summary.tools {
        let (name, largest, deepest) = (
            &tool.name,
            tool.largest_force,
            1e3 * tool.deepest_penetration,
        );
        let (force, work) = (tool.force, tool.work);
        row!(
            text,
            "tool",
            "{name}: at most {largest:.3} N and {deepest:.3} mm deep; {force:.3} N at the end; work on it {work:.3e} J"
        );
    }
    if let Some(contact) = &summary.contact {
        let (force, energy, lost) = (contact.force, contact.energy, contact.dissipated);
        let (area, depth) = (1e4 * contact.area, 1e3 * contact.penetration);
        let offsets = contact.offset_work;
        row!(
            text,
            "contact",
            "{force:.3} N on {area:.3} cm² and {depth:.3} mm deep at the end; {energy:.3e} J stored, friction took \
             {lost:.3e} J, offsets did {offsets:.1e} J"
        );
    }
    if let Some(pictures) = &summary.pictures {
        let (frames, width, height) = (pictures.frames, pictures.width, pictures.height);
        let (surfels, skin) = (pictures.surfels, pictures.skin_surfels);
        row!(
            text,
            "pictures",
            "{frames} frames of {width}x{height}, {surfels} surfels and {skin} of cuts"
        );
    }
    for warning in &summary.warnings {
        row!(text, "warning", "{warning}");
    }
    let timings = &summary.timings;
    let (step, factor) = (timings.milliseconds_per_step, timings.real_time_factor);
    let threads = timings.threads;
    row!(
        text,
        "speed",
        "{step:.3} ms a step, {factor:.2} simulated seconds per second of stepping on \
         {threads} threads"
    );
    if let Some(latency) = &timings.update_to_step {
        let (median, worst, count) = (latency.median, latency.worst, latency.count);
        row!(
            text,
            "blade to step",
            "median {median:.2} ms, worst {worst:.2} ms from {count} updates to the first step with them"
        );
    }
    row!(
        text,
        "phase",
        "{:>10} {:>12} {:>10}",
        "total s",
        "ms a call",
        "calls"
    );
    for phase in timings.phases.iter().filter(|phase| phase.calls > 0) {
        let (seconds, call, calls) = (phase.seconds, phase.milliseconds_per_call, phase.calls);
        row!(
            text,
            phase.phase,
            "{seconds:>10.3} {call:>12.3} {calls:>10}"
        );
    }
    row!(text, "whole run", "{:.1} s", timings.wall);
    let (folder, files) = (folder.display(), summary.files.join(", "));
    row!(text, "files", "{folder}: {files}");
    Ok(())
}

fn write_body(text: &mut String, body: &BodySummary) -> fmt::Result {
    row!(text, "body", "{}", body.name);
    let (nodes, pairs, tetrahedra) = (body.nodes, body.pairs, body.tetrahedra);
    let (held, apart) = (body.supported, 1e3 * body.spacing);
    row!(
        text,
        "size",
        "{nodes} nodes, {pairs} pairs, {tetrahedra} tetrahedra, {held} nodes fixed, {apart:.2} mm apart"
    );
    let (before, after) = (body.mass_before, body.mass_after);
    let (change, moved) = (after / before - 1.0, 1e2 * body.moved_mass);
    row!(
        text,
        "mass",
        "{before:.6} kg before, {after:.6} kg after (change {change:+.1e}); {moved:.2} % moved by a neighbour at first"
    );
    let [before, after] = [body.volume_before, body.volume_after].map(|volume| 1e3 * volume);
    let change = body.volume_after / body.volume_before - 1.0;
    let off = body.volume_error.map_or(String::new(), |error| {
        format!("; {:+.2} % off the body's", 1e2 * error)
    });
    row!(
        text,
        "volume",
        "{before:.4} l before, {after:.4} l after (change {change:+.1e}){off}"
    );
    row!(text, "pieces", "{}", body.pieces);
    let energy = &body.energy;
    let (kinetic, elastic, work) = (energy.kinetic, energy.elastic, energy.external_work);
    let (damped, released) = (energy.dissipated, energy.released_by_cuts);
    row!(
        text,
        "energy",
        "kinetic {kinetic:.3e} J, elastic {elastic:.3e} J, work {work:.3e} J, damped {damped:.3e} J, \
         released by cuts {released:.3e} J"
    );
    let (added, most) = (energy.added_by_cuts, energy.largest_cut_addition);
    if added > 0.0 {
        row!(
            text,
            "",
            "of it {added:.1e} J added, at most {most:.1e} of what was stored by one update"
        );
    }
    let (taken, stored, lost) = (energy.numerical, energy.viscous, energy.relaxed);
    if taken != 0.0 {
        row!(text, "scheme", "{taken:.3e} J taken by implicit steps");
    }
    if lost != 0.0 {
        row!(
            text,
            "viscosity",
            "{stored:.3e} J stored, {lost:.3e} J lost"
        );
    }
    let balance = if energy.moved {
        let off = energy.imbalance;
        format!("energy unexplained {off:.1e} of what is stored or dissipated")
    } else {
        "nothing moved".to_owned()
    };
    let (error, smallest) = (body.momentum_error, body.smallest_determinant);
    row!(
        text,
        "audit",
        "{balance}; |sum f|/sum |f| {error:.1e}; det F >= {smallest:.3}"
    );
    Ok(())
}

fn write_cuts(text: &mut String, cuts: &CutSummary) -> fmt::Result {
    let (captures, updates, triangles) = (cuts.captures, cuts.updates, cuts.triangles);
    let (weakened, severed) = (cuts.weakened_pairs, cuts.severed_pairs);
    let (growth, deficient) = (cuts.eigenvalue_growth, cuts.weak_nodes);
    row!(
        text,
        "cuts",
        "{captures} captures, {updates} updates, {triangles} triangles, {weakened} pairs weakened, {severed} \
         severed; stiffness x{growth:.2}, {deficient} deficient nodes"
    );
    for stroke in cuts.strokes.iter().take(MOST_STROKES) {
        let (cut, body) = (&stroke.cut, &stroke.body);
        let (captures, updates) = (stroke.captures, stroke.updates);
        let energy = &stroke.energy;
        let (released, added, decay) = (energy.released, energy.added, energy.decay);
        row!(
            text,
            "stroke",
            "{cut} of {body}: {captures} captures, {updates} updates; released by cuts {released:.3e} J, added \
             {added:.1e} J, retained {decay:+.1e} J"
        );
    }
    if let more @ 1.. = cuts.strokes.len().saturating_sub(MOST_STROKES) {
        row!(text, "", "and {more} more in summary.json");
    }
    if let Some((lattices, pairs)) = cuts.lattices.zip(cuts.pairs_without_lattice) {
        row!(
            text,
            "grids",
            "{lattices} lattices; {pairs} pairs without one, by Diffraction"
        );
    }
    Ok(())
}
