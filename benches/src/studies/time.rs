//! What a step costs as the body grows.

use std::time::Instant;

use super::embedded;
use crate::report::{Report, Series, Table, plots, row};
use crate::{Effort, StudyError};
use phyxel::World;

/// Batches of steps of which the median is taken, and steps in each.
const BATCHES: usize = 5;
const STEPS: u32 = 10;

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let sizes: &[u32] = effort.choose(
        &[500, 1_408, 3_000, 6_000, 12_000, 25_000, 50_000],
        &[300, 1_408],
    );
    let (mut rows, mut setup, mut steps) = (Vec::new(), Vec::new(), Vec::new());
    for &size in sizes {
        let target = format!("bodies[0].sampling.target=Nodes({size})");
        let scene = embedded("block", &[&target, "integration.settle=None", "cuts=[]"])?;
        let start = Instant::now();
        let mut world = World::new(scene)?;
        let built = start.elapsed().as_secs_f64();
        let mut batches = Vec::with_capacity(BATCHES);
        for batch in 0..=BATCHES {
            let start = Instant::now();
            for _ in 0..STEPS {
                world.step()?;
            }
            // The first batch warms up.
            if batch > 0 {
                batches.push(start.elapsed().as_secs_f64() / f64::from(STEPS));
            }
        }
        batches.sort_by(f64::total_cmp);
        let seconds = batches[BATCHES / 2];
        let spread = (batches[BATCHES - 1] - batches[0]) / seconds;
        let body = &world.bodies()[0];
        let (nodes, pairs) = (body.rest.len(), body.neighborhoods.pair_count());
        let (nodes_f, pairs_f) = (nodes as f64, pairs as f64);
        rows.push(row![
            nodes,
            pairs_f / nodes_f,
            built,
            1e3 * seconds,
            100.0 * spread,
            1e9 * seconds / pairs_f,
            1e3 * world.step_size(),
            world.step_size() / seconds
        ]);
        setup.push((nodes_f, 1e3 * built));
        steps.push((nodes_f, 1e3 * seconds));
    }
    let table = Table::new(
        "step",
        "Cost of a step",
        "nodes (1); neighbours (1); set-up (s); time of a step (ms); range (%); \
         time of a pair (ns); step (ms simulated); speed (simulated s per s)",
        rows,
    );
    let plots = plots![
        "nodes" "Time of a step and of the set-up against nodes",
            log "nodes", log "time (ms)" => vec![Series::line("step", steps), Series::line("set-up", setup)];
    ];
    Ok(Report::new(
        &[&format!(
            "The embedded scene `block` (E 10 kPa, nu 0.4, 1000 kg/m^3) uncut and without pictures, at \
                 several numbers of nodes. The step is half the largest stable one. Times of a step are \
                 medians of {BATCHES} batches of {STEPS} steps with the range of the batches beside them; \
                 all threads."
        )],
        vec![table],
        plots,
    ))
}
