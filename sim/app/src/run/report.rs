//! The closing table for people.

use std::fmt::{self, Write};
use std::path::Path;

use super::Summary;

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

fn row(text: &mut String, name: &str, value: fmt::Arguments<'_>) -> fmt::Result {
    writeln!(text, "{name:>20}  {value}")
}

fn write_table(text: &mut String, summary: &Summary, folder: &Path) -> fmt::Result {
    for body in &summary.bodies {
        row(text, "body", format_args!("{}", body.name))?;
        row(
            text,
            "size",
            format_args!(
                "{} nodes, {} pairs, {} tetrahedra, {} nodes held, {:.2} mm apart",
                body.nodes,
                body.pairs,
                body.tetrahedra,
                body.supported,
                1e3 * body.spacing
            ),
        )?;
        row(
            text,
            "mass",
            format_args!(
                "{:.6} kg before, {:.6} kg after (change {:+.1e}); {:.2} % moved by a neighbour at first",
                body.mass_before,
                body.mass_after,
                body.mass_after / body.mass_before - 1.0,
                1e2 * body.moved_mass
            ),
        )?;
        row(
            text,
            "volume",
            format_args!(
                "{:.4} l before, {:.4} l after (change {:+.1e}){}",
                1e3 * body.volume_before,
                1e3 * body.volume_after,
                body.volume_after / body.volume_before - 1.0,
                body.volume_error.map_or(String::new(), |error| format!(
                    "; {:+.2} % off the body's",
                    1e2 * error
                ))
            ),
        )?;
        row(text, "pieces", format_args!("{}", body.pieces))?;
        let energy = &body.energy;
        row(
            text,
            "energy",
            format_args!(
                "kinetic {:.3e} J, elastic {:.3e} J, work {:.3e} J, damped {:.3e} J, released by cuts {:.3e} J",
                energy.kinetic,
                energy.elastic,
                energy.external_work,
                energy.dissipated,
                energy.released_by_cuts
            ),
        )?;
        if energy.added_by_cuts > 0.0 {
            row(
                text,
                "",
                format_args!(
                    "of it {:.1e} J added, at most {:.1e} of what was stored by one update",
                    energy.added_by_cuts, energy.largest_cut_addition
                ),
            )?;
        }
        if energy.numerical != 0.0 {
            let taken = energy.numerical;
            row(
                text,
                "scheme",
                format_args!("{taken:.3e} J taken by implicit steps"),
            )?;
        }
        if energy.relaxed != 0.0 {
            let (stored, lost) = (energy.viscous, energy.relaxed);
            row(
                text,
                "viscosity",
                format_args!("{stored:.3e} J stored, {lost:.3e} J lost"),
            )?;
        }
        row(
            text,
            "audit",
            format_args!(
                "{}; |sum f|/sum |f| {:.1e}; det F >= {:.3}",
                if energy.moved {
                    format!(
                        "energy unexplained {:.1e} of what is stored or damped",
                        energy.imbalance
                    )
                } else {
                    "nothing moved".to_owned()
                },
                body.momentum_error,
                body.smallest_determinant
            ),
        )?;
    }
    let stepping = &summary.stepping;
    row(
        text,
        "steps",
        format_args!(
            "{} ({} to settle{}), {:.2} s simulated",
            stepping.steps,
            stepping.settling_steps,
            if stepping.rested {
                ""
            } else {
                ", not at rest yet"
            },
            stepping.simulated
        ),
    )?;
    row(
        text,
        "step size",
        format_args!("{:.3} ms: {}", 1e3 * stepping.step, stepping.chosen),
    )?;
    if let Some(cuts) = &summary.cuts {
        row(
            text,
            "cuts",
            format_args!(
                "{} captures, {} updates, {} triangles, {} pairs weakened, {} severed; stiffness x{:.2}, {} deficient nodes",
                cuts.captures,
                cuts.updates,
                cuts.triangles,
                cuts.weakened_pairs,
                cuts.severed_pairs,
                cuts.eigenvalue_growth,
                cuts.weak_nodes
            ),
        )?;
        for stroke in cuts.strokes.iter().take(MOST_STROKES) {
            row(
                text,
                "stroke",
                format_args!(
                    "{} of {}: {} captures, {} updates; released by cuts {:.3e} J, added {:.1e} J, retained {:+.1e} J",
                    stroke.cut,
                    stroke.body,
                    stroke.captures,
                    stroke.updates,
                    stroke.released,
                    stroke.added,
                    stroke.decay
                ),
            )?;
        }
        if let more @ 1.. = cuts.strokes.len().saturating_sub(MOST_STROKES) {
            row(text, "", format_args!("and {more} more in summary.json"))?;
        }
    }
    if let Some((lattices, pairs)) = summary
        .cuts
        .as_ref()
        .and_then(|cuts| cuts.lattices.zip(cuts.pairs_without_lattice))
    {
        row(
            text,
            "grids",
            format_args!("{lattices} lattices; {pairs} pairs without one, by Diffraction"),
        )?;
    }
    for tool in &summary.tools {
        row(
            text,
            "tool",
            format_args!(
                "{}: at most {:.3} N and {:.3} mm deep; {:.3} N at the end; work on it {:.3e} J",
                tool.name,
                tool.largest_force,
                1e3 * tool.deepest_penetration,
                tool.force,
                tool.work
            ),
        )?;
    }
    if let Some(contact) = &summary.contact {
        row(
            text,
            "contact",
            format_args!(
                "{:.3} N on {:.3} cm² and {:.3} mm deep at the end; {:.3e} J stored, friction took {:.3e} J, offsets did {:.1e} J",
                contact.force,
                1e4 * contact.area,
                1e3 * contact.penetration,
                contact.energy,
                contact.dissipated,
                contact.offset_work
            ),
        )?;
    }
    if let Some(pictures) = &summary.pictures {
        row(
            text,
            "pictures",
            format_args!(
                "{} frames of {}x{}, {} surfels and {} of cuts",
                pictures.frames,
                pictures.width,
                pictures.height,
                pictures.surfels,
                pictures.skin_surfels
            ),
        )?;
    }
    for warning in &summary.warnings {
        row(text, "warning", format_args!("{warning}"))?;
    }
    let timings = &summary.timings;
    row(
        text,
        "speed",
        format_args!(
            "{:.3} ms a step, {:.2} simulated seconds per second of stepping on {} threads",
            timings.milliseconds_per_step, timings.real_time_factor, timings.threads
        ),
    )?;
    if let Some(latency) = &timings.update_to_step {
        row(
            text,
            "blade to step",
            format_args!(
                "median {:.2} ms, worst {:.2} ms from {} updates to the first step with them",
                latency.median, latency.worst, latency.count
            ),
        )?;
    }
    row(
        text,
        "phase",
        format_args!("{:>10} {:>12} {:>10}", "total s", "ms a call", "calls"),
    )?;
    for phase in timings.phases.iter().filter(|phase| phase.calls > 0) {
        row(
            text,
            phase.phase,
            format_args!(
                "{:>10.3} {:>12.3} {:>10}",
                phase.seconds, phase.milliseconds_per_call, phase.calls
            ),
        )?;
    }
    row(text, "whole run", format_args!("{:.1} s", timings.wall))?;
    row(
        text,
        "files",
        format_args!("{}: {}", folder.display(), summary.files.join(", ")),
    )
}
