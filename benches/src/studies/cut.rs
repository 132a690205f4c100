//! Cutting: what a blade update costs.

use super::embedded;
use crate::report::{Cell, Report, Series, Table, median, plots, row};
use crate::{Effort, StudyError};
use phyxel::Phase;
use phyxel::World;

/// Time (s) in which the timed blade passes: short, so that few steps are taken besides.
const PASSING: f64 = 0.02;

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let (updates, by_triangles, by_nodes) = updates(effort)?;
    let plots = plots![
        "triangles" "Time of a blade update against the triangles of the cut",
            log "triangles of the finished cut", log "median time of an update (ms)" => by_triangles;
        "nodes" "Time of a blade update against the body's nodes",
            log "nodes", log "time of an update (ms)" => by_nodes;
    ];
    let words = "Updates: the embedded block (7 x 7 x 21 cm) is cut through by a level blade, in as \
                 many captures as give the triangles; an update maps the edge, spans the new piece, finds \
                 the crossed pairs, rebuilds rows of stencils and stiffness and the stable step. The \
                 latency is from the update's begin to the end of the step after it.";
    Ok(Report::new(&[words], vec![updates], plots))
}

type Measured = (Table, Vec<Series>, Vec<Series>);

fn updates(effort: Effort) -> Result<Measured, StudyError> {
    let (nodes, captures): (&[u32], &[u32]) = effort.choose(
        (&[1_408, 6_000, 25_000, 100_000], &[5, 10, 20, 40, 80]),
        (&[500, 1_408], &[4, 12]),
    );
    // Index of the number of captures that the plot over nodes shows.
    let shown = effort.choose(2, 1);
    let (mut rows, mut by_triangles) = (Vec::new(), Vec::new());
    let (mut medians, mut latencies) = (Vec::new(), Vec::new());
    for &nodes in nodes {
        let mut points = Vec::new();
        for (index, &captures) in captures.iter().enumerate() {
            // The largest body once: its captures cost what those of the others do.
            if nodes > 50_000 && index != 2 {
                continue;
            }
            let row = update(nodes, captures)?;
            let [nodes, triangles, median, latency] =
                [0, 2, 4, 6].map(|at: usize| row[at].number().unwrap_or(f64::NAN));
            rows.push(row);
            points.push((triangles, median));
            if index == shown {
                medians.push((nodes, median));
                latencies.push((nodes, latency));
            }
        }
        by_triangles.push(Series::line(format!("{nodes} nodes"), points));
    }
    let by_nodes = vec![
        Series::line("update, median", medians),
        Series::line("update and the step after it, median", latencies),
    ];
    let table = Table::new(
        "updates",
        "Time of blade updates",
        "nodes (1); captures (1); triangles (1); severed pairs (1); median (ms); worst (ms); \
         latency, median (ms)",
        rows,
    );
    Ok((table, by_triangles, by_nodes))
}

/// The embedded block of about `nodes` nodes, cut half through in `captures` pieces: the row of it.
fn update(nodes: u32, captures: u32) -> Result<Vec<Cell>, StudyError> {
    // From outside to the block's far side.
    let distance = 0.095 / f64::from(captures);
    let changes: [&str; 4] = [
        &format!("bodies[0].sampling.target=Nodes({nodes})"),
        "integration.settle=None",
        "gravity=None",
        &format!(
            "cuts=[(edge: [(0, -0.06, 0), (0, 0.06, 0)], path: [(time: 0, position: (-0.06, 0, \
             0.0213)), (time: {PASSING}, position: (0.035, 0, 0.0213))], capture: \
             Distance({distance}))]"
        ),
    ];
    let mut world = World::new(embedded("block", &changes)?)?;
    let mut times = Vec::new();
    let mut changed = 0;
    while world.scene_time().is_some_and(|now| now <= PASSING) {
        let before = world.phases().of(Phase::Cut).seconds;
        world.step()?;
        let after = world.phases().of(Phase::Cut).seconds;
        // Captures that change nothing, outside the body, do not count.
        let count = world.latencies().len();
        if count > changed {
            times.push(1e3 * (after - before));
        }
        changed = count;
    }
    let body = &world.bodies()[0];
    let cutting = body.cutting.as_ref();
    Ok(row![
        body.rest.len(),
        cutting.map_or(0, |cutting| cutting.counts().0),
        cutting.map_or(0, |cutting| cutting.cuts.triangle_count()),
        cutting.map_or(0, phyxel::Cutting::severed_pairs),
        median(&times).unwrap_or(0.0),
        times.iter().copied().fold(0.0, f64::max),
        median(world.latencies()).unwrap_or(0.0)
    ])
}
