//! The model as a whole: derivatives, invariances, patch test, threads, cuts.

mod bonds;
mod cuts;
mod derivatives;
mod frame;
mod fronts;
mod hard;
mod machine;
mod options;
mod oracle;
mod properties;
mod smoothed;

use super::*;
use crate::law::fiber::Fiber;
use crate::law::prony::PronyTerm;
use glam::{DMat3, DQuat, DVec3};
use rayon::ThreadPoolBuilder;
use testkit::block::Block;
use testkit::cloud::Random;
use testkit::derivative::central_sweep;
use testkit::tol::{assert_below, assert_within};

fn stencils(block: &Block) -> Stencils<'_> {
    Stencils {
        offsets: &block.offsets,
        indices: &block.indices,
        weights: &block.weights,
        matrices: &block.matrices,
        scales: &block.scales,
        multipliers: &block.multipliers,
    }
}

fn model(block: &Block, material: Material, alpha: f64) -> Elastic {
    let nodes = Nodes {
        rest_positions: &block.positions,
        volumes: &block.volumes,
    };
    let settings = Settings {
        stabilization: alpha,
        ..Settings::default()
    };
    Elastic::new(
        &stencils(block),
        &nodes,
        &Materials::Uniform(material),
        &settings,
    )
    .expect("the test block is valid")
}

fn built(block: &Block, material: Material, settings: &Settings) -> Elastic {
    let nodes = Nodes {
        rest_positions: &block.positions,
        volumes: &block.volumes,
    };
    Elastic::new(
        &stencils(block),
        &nodes,
        &Materials::Uniform(material),
        settings,
    )
    .expect("the test block is valid")
}

fn mean() -> Settings {
    Settings {
        dilatation: Dilatation::Mean,
        ..Settings::default()
    }
}

fn bare() -> Settings {
    Settings {
        stabilization: 0.0,
        ..Settings::default()
    }
}

fn fibrous(material: Material) -> Material {
    material.with_fiber(Fiber {
        direction: DVec3::new(1.0, 0.5, -0.4),
        stiffness: 800.0,
        exponent: 1.0,
        dispersion: 0.1,
    })
}

fn block() -> Block {
    Block::new([4, 3, 3], DVec3::new(0.4, 0.35, 0.3), 0.25, 7)
}

fn shaken(block: &Block, by: f64, seed: u64) -> Vec<DVec3> {
    let mut random = Random::new(seed);
    block
        .positions
        .iter()
        .map(|x| *x + random.vector(by))
        .collect()
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn moved(x: &[DVec3], d: &[DVec3], t: f64) -> Vec<DVec3> {
    x.iter().zip(d).map(|(x, d)| *x + *d * t).collect()
}

/// Force and tangent against central differences of energy and force: order 2 down to 1e-8.
fn check_derivatives(what: &str, body: &mut Elastic, x: &[DVec3], step: f64, scale: f64) {
    let n = body.node_count();
    let mut random = Random::new(99);
    let mut f = vec![DVec3::ZERO; n];
    let mut g = vec![DVec3::ZERO; n];
    let mut kv = vec![DVec3::ZERO; n];
    let flat = |v: &[DVec3]| -> Vec<f64> { v.iter().flat_map(DVec3::to_array).collect() };
    let mut orders = 0;
    for _ in 0..3 {
        let d: Vec<DVec3> = (0..n).map(|_| random.vector(1.0)).collect();
        let v: Vec<DVec3> = (0..n).map(|_| random.vector(1.0)).collect();
        body.forces_into(x, &mut f);
        let slope = -dot(&f, &d);
        let sweep = central_sweep(
            |t| vec![body.forces_into(&moved(x, &d, t), &mut g)],
            &[slope],
            step,
            scale * 1e-3,
        );
        orders += sweep.assert_second_order(&format!("{what}: force"), 1e-8);
        body.forces_into(x, &mut f);
        body.tangent_product_into(&d, &mut kv);
        let sweep = central_sweep(
            |t| {
                body.forces_into(&moved(x, &d, t), &mut g);
                flat(&g).into_iter().map(|g| -g).collect()
            },
            &flat(&kv),
            step,
            0.0,
        );
        orders += sweep.assert_second_order(&format!("{what}: tangent"), 1e-8);
        let there = dot(&kv, &v);
        body.forces_into(x, &mut f);
        body.tangent_product_into(&v, &mut kv);
        let back = dot(&kv, &d);
        assert_within(what, there, back, 1e-12 * there.abs().max(scale / step));
    }
    assert!(orders >= 6, "{what}: only {orders} orders seen");
}

/// Straight from the definition, pair by pair, with scattered forces.
fn brute_force(block: &Block, material: Material, alpha: f64, x: &[DVec3]) -> (f64, Vec<DVec3>) {
    let mut energy = 0.0;
    let mut f = vec![DVec3::ZERO; x.len()];
    for i in 0..x.len() {
        let mut grad = DMat3::IDENTITY;
        let mut moment = DMat3::ZERO;
        let mut spread = 0.0;
        let mut s = DMat3::ZERO;
        let u = |p: usize| {
            let j = block.indices[p] as usize;
            x[j] - x[i] - block.offset(i, p)
        };
        for p in block.row(i) {
            let (big, w) = (block.offset(i, p), block.weights[p]);
            grad += crate::law::tensor::outer(u(p), block.gradients[p]);
            moment += crate::law::tensor::outer(big, big) * w;
            s += crate::law::tensor::outer(u(p), big) * w;
            spread += w * big.length_squared();
        }
        let (w, stress) = material.energy_and_stress(grad);
        energy += block.volumes[i] * w;
        let c = alpha * material.lame_mu() * block.volumes[i] / spread;
        let h = s * moment.inverse();
        for p in block.row(i) {
            let j = block.indices[p] as usize;
            let e = u(p) - h * block.offset(i, p);
            energy += 0.5 * c * block.weights[p] * e.length_squared();
            let t = stress * block.gradients[p] * block.volumes[i] + e * (c * block.weights[p]);
            f[j] -= t;
            f[i] += t;
        }
    }
    (energy, f)
}

/// Severs every pair for which `keep` is false and rebuilds rows with a truncated inverse.
fn cut(block: &mut Block, keep: impl Fn(usize, usize) -> bool) -> Vec<u32> {
    let mut touched = Vec::new();
    for i in 0..block.node_count() {
        let mut changed = false;
        for p in block.row(i) {
            if !keep(i, block.indices[p] as usize) {
                block.weights[p] = 0.0;
                changed = true;
            }
        }
        if !changed {
            continue;
        }
        touched.push(u32::try_from(i).expect("small"));
        let mut moment = DMat3::ZERO;
        for p in block.row(i) {
            let x = block.offset(i, p);
            moment += crate::law::tensor::outer(x, x) * block.weights[p];
        }
        block.matrices[i] = truncated_inverse(moment);
        if let Some(scale) = block.scales.get_mut(i) {
            *scale = 0.0;
        }
        block.set_gradients_from_factors([i]);
    }
    touched
}

fn truncated_inverse(moment: DMat3) -> DMat3 {
    let (values, vectors) = crate::kernel::completion::symmetric_eigen(moment);
    let most = values.iter().fold(0.0_f64, |m, v| m.max(*v));
    let mut inverse = DMat3::ZERO;
    for (value, vector) in values.into_iter().zip(vectors) {
        if value > 1e-3 * most && value > 0.0 {
            inverse += crate::law::tensor::outer(vector, vector) * value.recip();
        }
    }
    inverse
}

/// A lattice cut so that its middle layer is a sheet, one line is left and one node is alone.
fn torn() -> (Block, Vec<u32>) {
    let mut block = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    let cell = |i: usize| [i % 5, (i / 5) % 5, i / 25];
    let touched = cut(&mut block, |i, j| {
        let (a, b) = (cell(i), cell(j));
        // Layer k = 2 is severed from both sides: a sheet. Row j = 0 of layer 0 is a line.
        let sheet = (a[2] == 2) == (b[2] == 2);
        let line = (a[2] == 0 && a[1] == 0) == (b[2] == 0 && b[1] == 0);
        let alone = i != 124 && j != 124;
        sheet && line && alone
    });
    (block, touched)
}
