//! The model as a whole: derivatives, invariances, patch test, threads, cuts.

mod bonds;
mod cuts;
mod derivatives;
mod frame;
mod fronts;
mod hard;
mod machine;
mod options;
mod properties;
mod release;
mod smoothed;

use super::*;
use crate::law::fiber::Fiber;
use crate::law::prony::PronyTerm;
use crate::law::tensor::outer;
use glam::{DMat3, DQuat, DVec3};
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

fn try_built(
    block: &Block,
    materials: &Materials<'_>,
    settings: &Settings,
) -> Result<Elastic, ElasticError> {
    let nodes = Nodes::new(&block.positions, &block.volumes);
    Elastic::new(&stencils(block), &nodes, materials, settings)
}

fn built(block: &Block, material: Material, settings: &Settings) -> Elastic {
    let body = try_built(block, &Materials::Uniform(material), settings);
    body.expect("the test block is valid")
}

fn model(block: &Block, material: Material, alpha: f64) -> Elastic {
    built(block, material, &controlled(alpha))
}

fn mean() -> Settings {
    Settings {
        dilatation: Dilatation::Mean,
        ..Settings::default()
    }
}

fn controlled(stabilization: f64) -> Settings {
    Settings {
        stabilization,
        ..Settings::default()
    }
}

fn term(ratio: f64, relaxation_time: f64) -> PronyTerm {
    PronyTerm {
        ratio,
        relaxation_time,
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
    let shaken = block.positions.iter().map(|x| *x + random.vector(by));
    shaken.collect()
}

fn turned(turn: DQuat, x: &[DVec3]) -> Vec<DVec3> {
    x.iter().map(|x| turn * *x).collect()
}

/// Takes the rows of touched nodes over from a block.
fn update(body: &mut Elastic, touched: &[u32], block: &Block) {
    let updated = body.update_rows(touched, &stencils(block));
    updated.expect("rows are valid");
}

/// Energy and forces at some positions.
fn evaluated(body: &mut Elastic, x: &[DVec3]) -> (f64, Vec<DVec3>) {
    let mut forces = vec![DVec3::ZERO; x.len()];
    let energy = body.forces_into(x, &mut forces);
    (energy, forces)
}

fn product(body: &mut Elastic, vector: &[DVec3]) -> Vec<DVec3> {
    let mut product = vec![DVec3::ZERO; vector.len()];
    body.tangent_product_into(vector, &mut product);
    product
}

/// Products with a part's stiffness of a random vector, within it and of the whole: node, what is found and what is expected.
fn products_of(body: &mut Elastic, nodes: &[u32]) -> Vec<(u32, DVec3, DVec3)> {
    let part = body.part(nodes);
    let mut random = Random::new(3);
    let inside: Vec<DVec3> = part.nodes().iter().map(|_| random.vector(1.0)).collect();
    let mut whole = vec![DVec3::ZERO; body.node_count()];
    for (&node, v) in part.nodes().iter().zip(&inside) {
        whole[node as usize] = *v;
    }
    let expected = product(&mut body.clone(), &whole);
    let mut found = inside.clone();
    body.tangent_product_within(&part, &inside, &mut found);
    let all = part.nodes().iter().zip(found);
    all.map(|(&node, found)| (node, found, expected[node as usize]))
        .collect()
}

/// Reports to a model that was never evaluated there what another one found around a part at `x`.
fn check_told(body: &mut Elastic, told: &mut Elastic, nodes: &[u32], x: &[DVec3]) {
    let part = body.part(nodes);
    let mut random = Random::new(3);
    let v: Vec<DVec3> = nodes.iter().map(|_| random.vector(1.0)).collect();
    let (mut expected, mut found) = (v.clone(), v.clone());
    body.tangent_product_within(&part, &v, &mut expected);
    let gradient = |&node: &u32| body.deformation_gradient(node as usize);
    let gradients: Vec<DMat3> = part.rows().iter().map(gradient).collect();
    let ends: Vec<DVec3> = part.ends().iter().map(|&node| x[node as usize]).collect();
    assert!(!ends.is_empty(), "bonds of deficient nodes, or fronts");
    told.tangent_product_within(&part, &v, &mut found);
    assert_ne!(found, expected, "of another state");
    told.set_part_state(&part, &gradients, &ends);
    told.tangent_product_within(&part, &v, &mut found);
    assert_eq!(found, expected);
}

fn largest(v: &[DVec3]) -> f64 {
    v.iter().map(|v| v.length()).fold(0.0, f64::max)
}

/// Sizes of the sum of forces and of that of their moments.
fn momenta(x: &[DVec3], forces: &[DVec3]) -> [f64; 2] {
    let torque: DVec3 = x.iter().zip(forces).map(|(x, f)| x.cross(*f)).sum();
    [forces.iter().sum::<DVec3>().length(), torque.length()]
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
    let flat = |v: &[DVec3]| -> Vec<f64> { v.iter().flat_map(DVec3::to_array).collect() };
    let mut orders = 0;
    for _ in 0..3 {
        let d: Vec<DVec3> = (0..n).map(|_| random.vector(1.0)).collect();
        let v: Vec<DVec3> = (0..n).map(|_| random.vector(1.0)).collect();
        let slope = -dot(&evaluated(body, x).1, &d);
        let sweep = central_sweep(
            |t| vec![evaluated(body, &moved(x, &d, t)).0],
            &[slope],
            step,
            scale * 1e-3,
        );
        orders += sweep.assert_second_order(&format!("{what}: force"), 1e-8);
        evaluated(body, x);
        let kd = product(body, &d);
        let pull = |t: f64| {
            let (_, forces) = evaluated(body, &moved(x, &d, t));
            flat(&forces).into_iter().map(|f| -f).collect()
        };
        let sweep = central_sweep(pull, &flat(&kd), step, 0.0);
        orders += sweep.assert_second_order(&format!("{what}: tangent"), 1e-8);
        let there = dot(&kd, &v);
        evaluated(body, x);
        let back = dot(&product(body, &v), &d);
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
            grad += outer(u(p), block.gradients[p]);
            moment += outer(big, big) * w;
            s += outer(u(p), big) * w;
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
        rebuild(block, i);
    }
    touched
}

/// Gives a node whose weights changed the row of a truncated inverse, without multipliers.
fn rebuild(block: &mut Block, node: usize) {
    let moment = block.row(node).fold(DMat3::ZERO, |sum, p| {
        let x = block.offset(node, p);
        sum + outer(x, x) * block.weights[p]
    });
    let (values, vectors) = crate::kernel::completion::symmetric_eigen(moment);
    let most = values.iter().fold(0.0_f64, |m, v| m.max(*v));
    let mut inverse = DMat3::ZERO;
    for (value, vector) in values.into_iter().zip(vectors) {
        if value > 1e-3 * most && value > 0.0 {
            inverse += outer(vector, vector) * value.recip();
        }
    }
    block.matrices[node] = inverse;
    if let Some(scale) = block.scales.get_mut(node) {
        *scale = 0.0;
    }
    block.set_gradients_from_factors([node]);
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
