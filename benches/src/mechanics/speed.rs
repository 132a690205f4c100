//! Processor time of one thread, and the rows of speed alone: a step of the hanging block, forces of larger lattices.

use std::time::{Duration, Instant};

use glam::DVec3;
use phyxel::World;
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings, Stencils};
use testkit::block::Block;
use testkit::cloud::Random;

use super::Row;
use crate::StudyError;
use crate::problems::block::lattice;
use crate::problems::lanes::Lanes;
use crate::studies::embedded;

/// Least time of a measurement, and how many there are.
const SHORTEST: Duration = Duration::from_millis(60);
const REPEATS: usize = 5;

/// Processor time (s) of this thread so far, where the system has it; else wall time.
fn now(start: Instant) -> f64 {
    let of_thread = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = of_thread.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

/// Processor time (s) of `work`: the least mean of several measurements, after one that is not counted.
pub(super) fn processor_seconds(
    mut work: impl FnMut() -> Result<(), StudyError>,
) -> Result<f64, StudyError> {
    let start = Instant::now();
    let mut best = f64::INFINITY;
    for repeat in 0..=REPEATS {
        let (begin, cpu, mut count) = (Instant::now(), now(start), 0.0);
        while begin.elapsed() < SHORTEST {
            work()?;
            count += 1.0;
        }
        if repeat > 0 {
            best = best.min((now(start) - cpu) / count);
        }
    }
    Ok(best)
}

/// A step of the dissertation's block of 1,408 nodes; forces of lattices of 5,832 and 97,336 nodes, stretched by 2 % and shaken.
pub(super) fn rows(
    each: &mut impl FnMut(&Row) -> Result<(), StudyError>,
) -> Result<(), StudyError> {
    let mut world = World::new(embedded(
        "block-1408",
        &["cuts=[]", "integration.settle=None"],
    )?)?;
    each(&Row {
        task: "step",
        poissons_ratio: 0.4,
        method: "phyxel",
        nodes: world.bodies()[0].rest.len(),
        seconds: Some(processor_seconds(|| Ok(world.step()?))?),
        step: Some(world.step_size()),
        ..Row::default()
    })?;
    for side in [18, 46_u32] {
        let solid = super::Task::solid(0.4);
        let mut add = |method, nodes: usize, seconds| {
            let (task, poissons_ratio, seconds) = ("forces", 0.4, Some(seconds));
            each(&Row {
                task,
                poissons_ratio,
                method,
                nodes,
                seconds,
                ..Row::default()
            })
        };
        let block = Block::eighteen([side as usize; 3], 0.1);
        let (weights, matrices) = (&block.weights, &block.matrices);
        let stencils = Stencils::plain(&block.offsets, &block.indices, weights, matrices)
            .with_multipliers(&block.scales, &block.multipliers);
        let nodes = Nodes::new(&block.positions, &block.volumes);
        let material = Material::neo_hookean(solid.youngs_modulus, solid.poissons_ratio);
        let materials = Materials::Uniform(material);
        let mut elastic = Elastic::new(&stencils, &nodes, &materials, &Settings::default())?;
        let mut random = Random::new(1);
        let mut shaken = |rest: &[DVec3]| -> Vec<DVec3> {
            rest.iter()
                .map(|x| *x * 1.02 + random.vector(0.002))
                .collect()
        };
        let x = shaken(&block.positions);
        let mut forces = x.clone();
        let seconds = processor_seconds(|| {
            elastic.forces_into(&x, &mut forces);
            Ok(())
        })?;
        add("phyxel", x.len(), seconds)?;
        let cells = [side - 1; 3];
        let (rest, tetrahedra) = lattice(cells, |s| s * f64::from(side - 1) * 0.1);
        let x = shaken(&rest);
        for (method, body) in [
            ("hexahedra", Lanes::hexahedra(&rest, cells, solid)),
            (
                "corotational tetrahedra",
                Lanes::tetrahedra(&rest, &tetrahedra, solid),
            ),
        ] {
            let seconds = processor_seconds(|| {
                body.explicit_into(&x, &mut forces);
                Ok(())
            })?;
            add(method, x.len(), seconds)?;
        }
    }
    Ok(())
}
