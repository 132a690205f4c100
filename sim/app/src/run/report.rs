//! The closing table for people.

use std::fmt::{self, Write};
use std::path::Path;

use super::summary::{
    BodySummary, ContactSummary, CutSummary, EnergySummary, Latency, PictureSummary,
    SteppingSummary, StrokeSummary, Summary, Timings, ToolSummary,
};

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
    let SteppingSummary {
        steps,
        settling_steps,
        simulated,
        chosen,
        ..
    } = &summary.stepping;
    let rested = if summary.stepping.rested {
        ""
    } else {
        ", not at rest yet"
    };
    let step = 1e3 * summary.stepping.step;
    row!(
        text,
        "steps",
        "{steps} ({settling_steps} to settle{rested}), {simulated:.2} s simulated"
    );
    row!(text, "step size", "{step:.3} ms: {chosen}");
    if let Some(cuts) = &summary.cuts {
        write_cuts(text, cuts)?;
    }
    for tool in &summary.tools {
        let ToolSummary {
            name,
            largest_force,
            force,
            work,
            ..
        } = tool;
        let deepest = 1e3 * tool.deepest_penetration;
        row!(
            text,
            "tool",
            "{name}: at most {largest_force:.3} N and {deepest:.3} mm deep; {force:.3} N at the end; work on it {work:.3e} J"
        );
    }
    if let Some(contact) = &summary.contact {
        let ContactSummary {
            force,
            energy,
            dissipated,
            offset_work,
            ..
        } = contact;
        let (area, depth) = (1e4 * contact.area, 1e3 * contact.penetration);
        row!(
            text,
            "contact",
            "{force:.3} N on {area:.3} cm² and {depth:.3} mm deep at the end; {energy:.3e} J stored, friction took \
             {dissipated:.3e} J, offsets did {offset_work:.1e} J"
        );
    }
    if let Some(pictures) = &summary.pictures {
        let PictureSummary {
            frames,
            width,
            height,
            surfels,
            skin_surfels,
            ..
        } = pictures;
        row!(
            text,
            "pictures",
            "{frames} frames of {width}x{height}, {surfels} surfels and {skin_surfels} of cuts"
        );
    }
    for warning in &summary.warnings {
        row!(text, "warning", "{warning}");
    }
    let Timings {
        milliseconds_per_step,
        real_time_factor,
        threads,
        phases,
        wall,
        ..
    } = &summary.timings;
    row!(
        text,
        "speed",
        "{milliseconds_per_step:.3} ms a step, {real_time_factor:.2} simulated seconds per second of stepping on \
         {threads} threads"
    );
    if let Some(latency) = &summary.timings.update_to_step {
        let Latency {
            median,
            worst,
            count,
            ..
        } = latency;
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
    for phase in phases.iter().filter(|phase| phase.calls > 0) {
        let (seconds, call, calls) = (phase.seconds, phase.milliseconds_per_call, phase.calls);
        row!(
            text,
            phase.phase,
            "{seconds:>10.3} {call:>12.3} {calls:>10}"
        );
    }
    row!(text, "whole run", "{wall:.1} s");
    let (folder, files) = (folder.display(), summary.files.join(", "));
    row!(text, "files", "{folder}: {files}");
    Ok(())
}

fn write_body(text: &mut String, body: &BodySummary) -> fmt::Result {
    let BodySummary {
        name,
        nodes,
        pairs,
        tetrahedra,
        supported,
        mass_before,
        mass_after,
        pieces,
        energy,
        momentum_error,
        smallest_determinant,
        ..
    } = body;
    row!(text, "body", "{name}");
    let apart = 1e3 * body.spacing;
    row!(
        text,
        "size",
        "{nodes} nodes, {pairs} pairs, {tetrahedra} tetrahedra, {supported} nodes fixed, {apart:.2} mm apart"
    );
    let (change, moved) = (mass_after / mass_before - 1.0, 1e2 * body.moved_mass);
    row!(
        text,
        "mass",
        "{mass_before:.6} kg before, {mass_after:.6} kg after (change {change:+.1e}); {moved:.2} % moved by a neighbour at first"
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
    row!(text, "pieces", "{pieces}");
    let EnergySummary {
        kinetic,
        elastic,
        external_work,
        dissipated,
        numerical,
        viscous,
        relaxed,
        released_by_cuts,
        added_by_cuts,
        largest_cut_addition,
        imbalance,
        moved,
    } = *energy;
    row!(
        text,
        "energy",
        "kinetic {kinetic:.3e} J, elastic {elastic:.3e} J, work {external_work:.3e} J, damped {dissipated:.3e} J, \
         released by cuts {released_by_cuts:.3e} J"
    );
    if added_by_cuts > 0.0 {
        row!(
            text,
            "",
            "of it {added_by_cuts:.1e} J added, at most {largest_cut_addition:.1e} of what was stored by one update"
        );
    }
    if numerical != 0.0 {
        row!(text, "scheme", "{numerical:.3e} J taken by implicit steps");
    }
    if relaxed != 0.0 {
        row!(
            text,
            "viscosity",
            "{viscous:.3e} J stored, {relaxed:.3e} J lost"
        );
    }
    let balance = if moved {
        format!("energy unexplained {imbalance:.1e} of what is stored or dissipated")
    } else {
        "nothing moved".to_owned()
    };
    row!(
        text,
        "audit",
        "{balance}; |sum f|/sum |f| {momentum_error:.1e}; det F >= {smallest_determinant:.3}"
    );
    Ok(())
}

fn write_cuts(text: &mut String, cuts: &CutSummary) -> fmt::Result {
    let CutSummary {
        captures,
        updates,
        triangles,
        weakened_pairs,
        severed_pairs,
        eigenvalue_growth,
        weak_nodes,
        strokes,
        ..
    } = cuts;
    row!(
        text,
        "cuts",
        "{captures} captures, {updates} updates, {triangles} triangles, {weakened_pairs} pairs weakened, {severed_pairs} \
         severed; stiffness x{eigenvalue_growth:.2}, {weak_nodes} deficient nodes"
    );
    for stroke in strokes.iter().take(MOST_STROKES) {
        let StrokeSummary {
            cut,
            body,
            captures,
            updates,
            released,
            added,
            decay,
            ..
        } = stroke;
        row!(
            text,
            "stroke",
            "{cut} of {body}: {captures} captures, {updates} updates; released by cuts {released:.3e} J, added \
             {added:.1e} J, retained {decay:+.1e} J"
        );
    }
    if let more @ 1.. = strokes.len().saturating_sub(MOST_STROKES) {
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
