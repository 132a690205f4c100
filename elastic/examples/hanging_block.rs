//! A block of 1,408 nodes hung by its top face: milliseconds a step and how much faster than real
//! time it runs at its own stable step, on one thread.
//! `cargo run --release -p phyxel-elastic --example hanging_block`
#![allow(clippy::print_stdout, reason = "prints a table")]

use std::time::Instant;

use glam::DVec3;
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings, Stencils};
use testkit::block::Block;
use testkit::cloud::Random;

const DENSITY: f64 = 1000.0;

fn main() {
    // 8 x 8 x 22 nodes, 10 mm apart; E 10 kPa, nu 0.4.
    let block = Block::new([7, 7, 21], DVec3::new(0.07, 0.07, 0.21), 0.0, 1);
    println!("| nodes | pairs/node | stable step, ms | ms a step | x real time | sag, mm |");
    println!("|---|---|---|---|---|---|");

    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.expect("one thread").install(|| run(&block));
}

/// A neo-Hookean block, E 10 kPa, nu 0.4, with the default control.
fn body(block: &Block) -> Elastic {
    let stencils = Stencils {
        offsets: &block.offsets,
        indices: &block.indices,
        weights: &block.weights,
        matrices: &block.matrices,
        scales: &block.scales,
        multipliers: &block.multipliers,
    };
    let nodes = Nodes {
        rest_positions: &block.positions,
        volumes: &block.volumes,
    };
    let material = Materials::Uniform(Material::neo_hookean(1e4, 0.4));
    Elastic::new(&stencils, &nodes, &material, &Settings::default()).expect("valid")
}

fn run(block: &Block) {
    let mut body = body(block);
    let masses: Vec<f64> = block.volumes.iter().map(|v| DENSITY * v).collect();
    let free: Vec<bool> = block.positions.iter().map(|x| x.z < 0.2099).collect();
    let eigenvalue = largest_eigenvalue(&mut body, &masses, &free);
    let critical = 2.0 / eigenvalue.sqrt();

    // Velocity Verlet at 0.9 of the critical step, lightly damped, for 0.3 s.
    let dt = 0.9 * critical;
    let mut x = block.positions.clone();
    let mut v = vec![DVec3::ZERO; x.len()];
    let mut f = v.clone();
    let mut times = Vec::new();
    let mut time = 0.0;
    while time < 0.3 {
        let start = Instant::now();
        body.forces_into(&x, &mut f);
        for i in 0..x.len() {
            if free[i] {
                let acceleration = f[i] / masses[i] - DVec3::Z * 9.81 - v[i] * 2.0;
                v[i] += acceleration * dt;
                x[i] += v[i] * dt;
            }
        }
        times.push(start.elapsed().as_secs_f64());
        time += dt;
    }
    times.sort_by(f64::total_cmp);
    let step = times[times.len() / 2];
    let lowest = x.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
    assert!(lowest < -0.005 && lowest > -0.1, "sag {lowest}");
    println!(
        "| {} | {:.1} | {:.3} | {:.3} | {:.1} | {:.1} |",
        x.len(),
        f64::from(u32::try_from(body.pair_count()).expect("small"))
            / f64::from(u32::try_from(x.len()).expect("small")),
        critical * 1e3,
        step * 1e3,
        dt / step,
        -lowest * 1e3
    );
}

/// 60 power iterations on `M⁻¹ K` of the free nodes, 5 % added.
fn largest_eigenvalue(body: &mut Elastic, masses: &[f64], free: &[bool]) -> f64 {
    let mut random = Random::new(1);
    let mut v: Vec<DVec3> = masses.iter().map(|_| random.vector(1.0)).collect();
    let mut kv = v.clone();
    let mut value = 0.0;
    for _ in 0..60 {
        let size = v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
        for (v, free) in v.iter_mut().zip(free) {
            *v = if *free { *v / size } else { DVec3::ZERO };
        }
        body.tangent_product_into(&v, &mut kv);
        for ((v, kv), mass) in v.iter_mut().zip(&kv).zip(masses) {
            *v = *kv / *mass;
        }
        value = v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
    }
    1.05 * value
}
