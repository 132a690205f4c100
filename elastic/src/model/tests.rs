//! The model as a whole: derivatives, invariances, patch test, threads, cuts.

use glam::{DMat3, DQuat, DVec3};
use rayon::ThreadPoolBuilder;
use testkit::block::Block;
use testkit::cloud::Random;
use testkit::derivative::central_sweep;
use testkit::tol::{assert_below, assert_within};

use super::*;
use crate::bound::StiffnessCap;
use crate::fiber::Fiber;
use crate::viscosity::PronyTerm;

fn stencils(block: &Block) -> Stencils<'_> {
    Stencils {
        offsets: &block.offsets,
        indices: &block.indices,
        gradients: &block.gradients,
        self_gradients: &block.self_gradients,
        weights: &block.weights,
    }
}

fn model(block: &Block, material: Material, alpha: f64) -> Elastic {
    let nodes = Nodes {
        rest_positions: &block.positions,
        volumes: &block.volumes,
    };
    let settings = Settings {
        zero_energy_control: alpha,
        ..Settings::default()
    };
    Elastic::new(
        &stencils(block),
        &nodes,
        &Materials::Uniform(material),
        &settings,
    )
    .expect("the test block is sound")
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
    .expect("the test block is sound")
}

fn mean() -> Settings {
    Settings {
        dilatation: Dilatation::Mean,
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

#[test]
fn forces_are_the_gradient_and_the_tangent_is_theirs() {
    let block = block();
    for material in [
        Material::neo_hookean(1000.0, 0.4),
        Material::saint_venant_kirchhoff(1000.0, 0.3).with_volume_constant(300.0),
        Material::mooney_rivlin(1000.0, 0.45, 0.3),
        fibrous(Material::neo_hookean(1000.0, 0.4)),
    ] {
        for alpha in [0.0, 0.1] {
            let mut body = model(&block, material, alpha);
            let mut x = shaken(&block, 0.015, 3);
            if material.fiber.is_some() {
                // Stretched so far that no fiber goes slack within a step: their energy is twice
                // differentiable only there.
                for x in &mut x {
                    *x *= 1.6;
                }
            }
            check_derivatives(&format!("{material:?}"), &mut body, &x, 1e-3, 1.0);
        }
    }
}

#[test]
fn per_node_materials_are_those_of_the_nodes() {
    let block = block();
    let list = [
        Material::neo_hookean(1000.0, 0.4),
        Material::neo_hookean(5000.0, 0.2),
    ];
    let n = block.node_count();
    let nodes = Nodes {
        rest_positions: &block.positions,
        volumes: &block.volumes,
    };
    let x = shaken(&block, 0.01, 4);
    let mut f = vec![DVec3::ZERO; n];
    let mut energy = |of_node: &[u32]| {
        let materials = Materials::PerNode {
            list: &list,
            of_node,
        };
        let mut body = Elastic::new(&stencils(&block), &nodes, &materials, &Settings::default())
            .expect("fine");
        body.forces_into(&x, &mut f)
    };
    let first: Vec<u32> = vec![0; n];
    let second: Vec<u32> = vec![1; n];
    let split: Vec<u32> = (0..n).map(|i| u32::from(i % 2 == 0)).collect();
    let other: Vec<u32> = split.iter().map(|m| 1 - m).collect();
    let sum = energy(&first) + energy(&second);
    let halves = energy(&split) + energy(&other);
    assert_within("energies of nodes add up", sum, halves, 1e-12 * sum);
    assert!(energy(&first) < energy(&split));
}

#[test]
fn rigid_motion_costs_nothing() {
    let block = block();
    for material in [
        Material::neo_hookean(1.0, 0.4),
        Material::saint_venant_kirchhoff(1.0, 0.3),
        Material::mooney_rivlin(1.0, 0.4, 0.3),
    ] {
        let mut body = model(&block, material, 0.1);
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 2.4);
        let x: Vec<DVec3> = block
            .positions
            .iter()
            .map(|x| turn * *x + DVec3::new(0.3, -0.8, 1.0))
            .collect();
        let mut f = vec![DVec3::ZERO; x.len()];
        let energy = body.forces_into(&x, &mut f);
        let volume: f64 = block.volumes.iter().sum();
        assert_within("energy", energy, 0.0, 1e-12 * volume);
        // A stress of 1 Pa on a cell's face.
        let face = 0.01;
        for f in &f {
            assert_below("force", f.length(), 1e-12 * face);
        }
        let energy = body.forces_into(&block.positions, &mut f);
        assert_within("energy at rest", energy, 0.0, 1e-15);
        for f in &f {
            assert_below("force at rest", f.length(), 1e-15 * face);
        }

        let shaken = shaken(&block, 0.01, 8);
        let e0 = body.forces_into(&shaken, &mut f);
        let turned: Vec<DVec3> = shaken.iter().map(|x| turn * *x).collect();
        let mut g = f.clone();
        let e1 = body.forces_into(&turned, &mut g);
        assert_within("turned energy", e0, e1, 1e-12 * e0);
        for (f, g) in f.iter().zip(&g) {
            assert_below("turned force", (turn * *f - *g).length(), 1e-12 * face);
        }
    }
}

#[test]
fn internal_forces_keep_momentum() {
    let block = block();
    for alpha in [0.0, 0.1] {
        let mut body = model(&block, Material::neo_hookean(1.0, 0.4), alpha);
        let x = shaken(&block, 0.02, 9);
        let mut f = vec![DVec3::ZERO; x.len()];
        body.forces_into(&x, &mut f);
        let scale: f64 = f.iter().map(|f| f.length()).sum();
        let total: DVec3 = f.iter().sum();
        let torque: DVec3 = x.iter().zip(&f).map(|(x, f)| x.cross(*f)).sum();
        assert_below("momentum", total.length(), 1e-13 * scale);
        assert_below("angular momentum", torque.length(), 1e-13 * scale);
    }
}

/// Affine motion of all nodes leaves the inner ones without force: the patch test's core.
#[test]
fn affine_motion_leaves_inner_nodes_in_balance() {
    let a = DMat3::from_cols(
        DVec3::new(1.15, 0.1, -0.05),
        DVec3::new(0.2, 0.9, 0.1),
        DVec3::new(0.0, -0.1, 1.05),
    );
    for jitter in [0.0, 0.3] {
        let block = Block::new([5, 4, 4], DVec3::new(1.0, 0.8, 0.8), jitter, 2);
        let mut body = model(&block, Material::neo_hookean(1.0, 0.45), 0.1);
        let x: Vec<DVec3> = block.positions.iter().map(|x| a * *x).collect();
        let mut f = vec![DVec3::ZERO; x.len()];
        body.forces_into(&x, &mut f);
        let stress = body.first_piola_kirchhoff(0);
        for (i, f) in f.iter().enumerate() {
            let expected = -(stress * block.boundary_vectors[i]);
            assert_below("traction", (*f - expected).length(), 1e-12);
        }
    }
}

#[test]
fn any_thread_count_gives_the_same_bits() {
    let block = Block::new([13, 12, 12], DVec3::splat(1.0), 0.2, 5);
    assert!(block.node_count() > 2 * evaluate::PARALLEL_NODES);
    let x = shaken(&block, 0.01, 1);
    let v = shaken(&block, 0.5, 2);
    let run = |threads: usize| {
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| {
            let mut body = model(&block, Material::neo_hookean(1.0, 0.4), 0.1);
            let mut f = vec![DVec3::ZERO; x.len()];
            let mut kv = f.clone();
            let energy = body.forces_into(&x, &mut f);
            body.tangent_product_into(&v, &mut kv);
            (energy.to_bits(), f, kv)
        })
    };
    let serial = run(1);
    for threads in [2, 3, 7] {
        assert!(run(threads) == serial, "{threads} threads differ");
    }
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
            grad += crate::law::outer(u(p), block.gradients[p]);
            moment += crate::law::outer(big, big) * w;
            s += crate::law::outer(u(p), big) * w;
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

#[test]
fn gathers_equal_the_definition() {
    let block = block();
    let material = Material::neo_hookean(2.0, 0.4);
    for alpha in [0.0, 0.1, 1.0] {
        let mut body = model(&block, material, alpha);
        let x = shaken(&block, 0.02, 17);
        let mut f = vec![DVec3::ZERO; x.len()];
        let energy = body.forces_into(&x, &mut f);
        let (expected, g) = brute_force(&block, material, alpha, &x);
        assert_within("energy", energy, expected, 1e-12 * expected);
        let scale = g.iter().map(|g| g.length()).fold(0.0, f64::max);
        for (f, g) in f.iter().zip(&g) {
            assert_below("force", (*f - *g).length(), 1e-13 * scale);
        }
    }
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
            moment += crate::law::outer(x, x) * block.weights[p];
        }
        let inverse = truncated_inverse(moment);
        let mut sum = DVec3::ZERO;
        for p in block.row(i) {
            block.gradients[p] = inverse * block.offset(i, p) * block.weights[p];
            sum += block.gradients[p];
        }
        block.self_gradients[i] = -sum;
    }
    touched
}

fn truncated_inverse(moment: DMat3) -> DMat3 {
    let (values, vectors) = crate::completion::symmetric_eigen(moment);
    let most = values.iter().fold(0.0_f64, |m, v| m.max(*v));
    let mut inverse = DMat3::ZERO;
    for (value, vector) in values.into_iter().zip(vectors) {
        if value > 1e-3 * most && value > 0.0 {
            inverse += crate::law::outer(vector, vector) * value.recip();
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

#[test]
fn sheets_lines_and_lone_nodes_are_objective_and_exact() {
    let (torn, touched) = torn();
    let whole = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    for material in [
        Material::neo_hookean(1.0, 0.4),
        Material::saint_venant_kirchhoff(1.0, 0.3).with_volume_constant(0.5),
        Material::mooney_rivlin(1.0, 0.4, 0.4),
    ] {
        let mut body = model(&whole, material, 0.1);
        body.update_rows(&touched, &stencils(&torn))
            .expect("rows are projectors");
        let mut ranks = [0; 4];
        for node in 0..body.node_count() {
            ranks[usize::from(body.rank(node))] += 1;
        }
        // The sheet has 25; 6 more lost their third direction beside the line and the lone node.
        assert_eq!(ranks, [1, 5, 31, 88]);
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 1.0, 0.3).normalize(), 1.9);
        let x: Vec<DVec3> = torn.positions.iter().map(|x| turn * *x).collect();
        let mut f = vec![DVec3::ZERO; x.len()];
        let energy = body.forces_into(&x, &mut f);
        assert_within("energy of a rotation", energy, 0.0, 1e-14);
        for (i, f) in f.iter().enumerate() {
            assert_below(&format!("force on {i}"), f.length(), 1e-14);
        }
        let x = shaken(&torn, 0.015, 6);
        check_derivatives("torn", &mut body, &x, 1e-3, 1e-3);

        // An updated model equals one built from the torn rows.
        let mut fresh = model(&torn, material, 0.1);
        let mut g = f.clone();
        let e0 = body.forces_into(&x, &mut f);
        let e1 = fresh.forces_into(&x, &mut g);
        assert!(e0.to_bits() == e1.to_bits() && f == g);
        // And going back restores the first one.
        body.update_rows(&touched, &stencils(&whole))
            .expect("whole");
        let mut intact = model(&whole, material, 0.1);
        assert!(body.forces_into(&x, &mut f).to_bits() == intact.forces_into(&x, &mut g).to_bits());
        assert!(f == g);
    }
}

#[test]
fn collapsed_neighborhoods_stay_finite() {
    let (torn, _) = torn();
    let mut body = model(&torn, Material::neo_hookean(1.0, 0.4), 0.1);
    let n = body.node_count();
    let mut f = vec![DVec3::ZERO; n];
    let mut kv = f.clone();
    let v = shaken(&torn, 1.0, 4);
    for x in [
        vec![DVec3::ZERO; n],
        torn.positions.iter().map(|x| DVec3::X * x.x).collect(),
        torn.positions.iter().map(|x| -*x).collect(),
    ] {
        let energy = body.forces_into(&x, &mut f);
        body.tangent_product_into(&v, &mut kv);
        assert!(energy.is_finite());
        assert!(f.iter().chain(&kv).all(|f| f.is_finite()));
    }
}

fn largest_eigenvalue(body: &mut Elastic, masses: &[f64]) -> f64 {
    let n = masses.len();
    let mut random = Random::new(1);
    let mut v: Vec<DVec3> = (0..n).map(|_| random.vector(1.0)).collect();
    let mut kv = v.clone();
    let mut value = 0.0;
    for _ in 0..300 {
        body.tangent_product_into(&v, &mut kv);
        for (k, m) in kv.iter_mut().zip(masses) {
            *k /= *m;
        }
        let size = dot(&kv, &kv).sqrt();
        value = size / dot(&v, &v).sqrt();
        v.clone_from(&kv);
        for v in &mut v {
            *v /= size;
        }
    }
    value
}

#[test]
fn bound_is_above_the_largest_eigenvalue_and_not_far() {
    for (jitter, alpha, nu) in [(0.0, 0.1, 0.3), (0.25, 0.1, 0.45), (0.25, 0.0, 0.3)] {
        let block = Block::new([6, 5, 5], DVec3::new(1.2, 1.0, 1.0), jitter, 3);
        let mut body = model(&block, Material::neo_hookean(1.0, nu), alpha);
        let masses: Vec<f64> = block.volumes.iter().map(|v| 1000.0 * v).collect();
        let value = largest_eigenvalue(&mut body, &masses);
        let ratio = value / body.eigenvalue_bound(&masses);
        assert!(ratio < 1.0 && ratio > 0.25, "eigenvalue / bound = {ratio}");
    }
}

#[test]
fn cap_brings_a_stiffened_node_back() {
    let mut block = Block::new([6, 6, 6], DVec3::splat(1.0), 0.25, 3);
    let masses: Vec<f64> = block.volumes.iter().map(|v| 1000.0 * v).collect();
    let mut body = model(&block, Material::neo_hookean(1.0, 0.3), 0.1);
    let uncut = largest_eigenvalue(&mut body, &masses);
    let cap = StiffnessCap::new(&body, &masses);
    // One inner node keeps neighbours on a thin sliver only.
    let node = 3 + 7 * (3 + 7 * 3);
    let x = block.positions.clone();
    let touched = cut(&mut block, |i, j| {
        let thin = |a: usize, b: usize| a != node || (x[b].z - x[a].z).abs() < 0.05;
        thin(i, j) && thin(j, i)
    });
    body.update_rows(&touched, &stencils(&block)).expect("fine");
    let cut = largest_eigenvalue(&mut body, &masses);
    assert!(cut > 1.5 * uncut, "the sliver is stiff: {uncut} -> {cut}");
    let mut before = f64::INFINITY;
    for kappa in [1.0, 0.5, 0.3] {
        let lowered = body.cap_stiffness(&cap, &touched, kappa);
        assert!(lowered > 0 && lowered < block.node_count() / 2, "{lowered}");
        let now = largest_eigenvalue(&mut body, &masses);
        assert!(now < before, "{now} at {kappa}");
        before = now;
    }
    assert!(before < 1.25 * uncut, "{uncut} -> {cut} -> {before}");
    assert_eq!(body.cap_stiffness(&cap, &touched, f64::INFINITY), 0);
    assert!(body.elastic_volumes() == block.volumes);
}

#[test]
fn bad_input_is_named() {
    let good = block();
    let build = |block: &Block| {
        let nodes = Nodes {
            rest_positions: &block.positions,
            volumes: &block.volumes,
        };
        let material = Materials::Uniform(Material::neo_hookean(1.0, 0.3));
        Elastic::new(&stencils(block), &nodes, &material, &Settings::default()).map(|_| ())
    };
    let mut bad = good.clone();
    bad.volumes[3] = 0.0;
    assert!(matches!(
        build(&bad),
        Err(ElasticError::NonPositiveVolume { node: 3, .. })
    ));
    let mut bad = good.clone();
    bad.positions[5].y = f64::NAN;
    assert!(matches!(
        build(&bad),
        Err(ElasticError::NotFinite { node: 5, .. })
    ));
    let mut bad = good.clone();
    bad.gradients[0] *= 1.1;
    assert!(matches!(
        build(&bad),
        Err(ElasticError::InconsistentRow { node: 0, .. })
    ));
    let mut bad = good.clone();
    bad.indices.swap(0, 1);
    assert!(matches!(
        build(&bad),
        Err(ElasticError::BadRow { node: 0, .. })
    ));
    let mut bad = good.clone();
    bad.weights[0] *= 2.0;
    assert!(matches!(
        build(&bad),
        Err(ElasticError::AsymmetricPair { node: 0, .. })
    ));
    let mut bad = good.clone();
    let q = bad.row(2).start;
    bad.gradients[q].x = f64::INFINITY;
    assert!(matches!(
        build(&bad),
        Err(ElasticError::NotFinite { node: 2, .. })
    ));
    let nodes = Nodes {
        rest_positions: &good.positions,
        volumes: &good.volumes,
    };
    let of_node = vec![1; good.node_count()];
    let list = [Material::neo_hookean(1.0, 0.3)];
    let materials = Materials::PerNode {
        list: &list,
        of_node: &of_node,
    };
    assert!(matches!(
        Elastic::new(&stencils(&good), &nodes, &materials, &Settings::default()),
        Err(ElasticError::UnknownMaterial {
            node: 0,
            material: 1,
            count: 1
        })
    ));
    build(&good).expect("the block itself is good");
}

#[test]
fn mean_dilatation_is_an_energy_of_its_own() {
    let (torn, touched) = torn();
    let whole = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    for material in [
        Material::neo_hookean(1000.0, 0.45),
        Material::mooney_rivlin(1000.0, 0.45, 0.3).with_volume_constant(500.0),
    ] {
        let mut body = built(&whole, material, &mean());
        let x = shaken(&whole, 0.01, 3);
        check_derivatives("mean dilatation", &mut body, &x, 1e-3, 1.0);
        body.update_rows(&touched, &stencils(&torn)).expect("fine");
        check_derivatives("mean dilatation, torn", &mut body, &x, 1e-3, 1.0);
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 1.0, 0.3).normalize(), 1.9);
        let turned: Vec<DVec3> = torn.positions.iter().map(|x| turn * *x).collect();
        let mut f = vec![DVec3::ZERO; turned.len()];
        let energy = body.forces_into(&turned, &mut f);
        assert_within("energy of a rotation", energy, 0.0, 1e-11);
    }
    let block = block();
    let nodes = Nodes {
        rest_positions: &block.positions,
        volumes: &block.volumes,
    };
    let material = Materials::Uniform(Material::saint_venant_kirchhoff(1.0, 0.3));
    assert!(matches!(
        Elastic::new(&stencils(&block), &nodes, &material, &mean()),
        Err(ElasticError::NoVolumetricPart { material: 0 })
    ));
}

/// An affine motion has the same `J` everywhere: means change nothing.
#[test]
fn mean_dilatation_keeps_the_patch_test() {
    let block = Block::new([5, 4, 4], DVec3::new(1.0, 0.8, 0.8), 0.3, 2);
    let material = Material::neo_hookean(1.0, 0.499);
    let a = DMat3::from_cols(
        DVec3::new(1.1, 0.1, 0.0),
        DVec3::new(0.0, 0.95, 0.1),
        DVec3::new(0.05, 0.0, 1.02),
    );
    let x: Vec<DVec3> = block.positions.iter().map(|x| a * *x).collect();
    let mut f = vec![DVec3::ZERO; x.len()];
    let mut g = f.clone();
    let mut means = built(&block, material, &mean());
    let mut local = model(&block, material, 0.1);
    let e0 = means.forces_into(&x, &mut f);
    let e1 = local.forces_into(&x, &mut g);
    assert_within("energy", e0, e1, 1e-12 * e1);
    for (node, (f, g)) in f.iter().zip(&g).enumerate() {
        assert_below("force", (*f - *g).length(), 1e-10);
        let stress = means.first_piola_kirchhoff(node);
        assert!(stress.abs_diff_eq(local.first_piola_kirchhoff(node), 1e-9));
    }
}

#[test]
fn threads_do_not_change_the_bits_of_any_option() {
    let block = Block::new([13, 12, 12], DVec3::splat(1.0), 0.2, 5);
    let x = shaken(&block, 0.005, 1);
    let v = shaken(&block, 0.5, 2);
    for settings in [
        mean(),
        Settings {
            precision: Precision::Single,
            ..Settings::default()
        },
    ] {
        let run = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(|| {
                let mut body = built(&block, Material::neo_hookean(1.0, 0.4), &settings);
                let mut f = vec![DVec3::ZERO; x.len()];
                let mut kv = f.clone();
                let energy = body.forces_into(&x, &mut f);
                body.tangent_product_into(&v, &mut kv);
                (energy.to_bits(), f, kv)
            })
        };
        assert!(run(1) == run(3), "{settings:?}");
    }
}

/// Whatever width the processor offers, every lane sees the same operations in the same order.
#[test]
fn the_processor_does_not_change_the_bits() {
    let block = Block::new([9, 8, 8], DVec3::splat(1.0), 0.2, 5);
    let x = shaken(&block, 0.005, 1);
    let v = shaken(&block, 0.5, 2);
    for (precision, zero_energy_control) in [
        (Precision::Double, 0.1),
        (Precision::Single, 0.1),
        (Precision::Double, 0.0),
        (Precision::Single, 0.0),
    ] {
        for dilatation in [Dilatation::Local, Dilatation::Mean] {
            let settings = Settings {
                zero_energy_control,
                precision,
                dilatation,
            };
            let run = |baseline: bool| {
                let mut body = built(&block, Material::neo_hookean(1.0, 0.4), &settings);
                if baseline {
                    with_table!(&mut body.pairs, table => table.rows.arch = pulp::Arch::Scalar);
                }
                let mut f = vec![DVec3::ZERO; x.len()];
                let mut kv = f.clone();
                let energy = body.forces_into(&x, &mut f);
                body.tangent_product_into(&v, &mut kv);
                (energy.to_bits(), f, kv)
            };
            assert!(run(false) == run(true), "{settings:?}");
        }
    }
}

/// f32 pairs agree with f64 ones to their own rounding, also far from the origin.
#[test]
fn single_precision_follows_double() {
    let block = block();
    let single = Settings {
        precision: Precision::Single,
        ..Settings::default()
    };
    let material = fibrous(Material::neo_hookean(1.0, 0.4));
    let mut coarse = built(&block, material, &single);
    let mut fine = model(&block, material, 0.1);
    assert!(coarse.bytes() < fine.bytes());
    for shift in [0.0, 1e3] {
        let mut x = shaken(&block, 0.01, 3);
        for x in &mut x {
            x.y += shift;
        }
        let mut f = vec![DVec3::ZERO; x.len()];
        let mut g = f.clone();
        let e0 = coarse.forces_into(&x, &mut f);
        let e1 = fine.forces_into(&x, &mut g);
        let scale = g.iter().map(|g| g.length()).fold(0.0, f64::max);
        // 1e3 away the virtual work of round-off forces on u enters the energy.
        assert_within("energy", e0, e1, 1e-6 * e1 + 1e-6 * scale * shift);
        for (f, g) in f.iter().zip(&g) {
            assert_below("force", (*f - *g).length(), 2e-6 * scale);
        }
        coarse.tangent_product_into(&x, &mut f);
        fine.tangent_product_into(&x, &mut g);
        let scale = g.iter().map(|g| g.length()).fold(0.0, f64::max);
        for (f, g) in f.iter().zip(&g) {
            assert_below("product", (*f - *g).length(), 1e-5 * scale);
        }
    }
    let energy = coarse.forces_into(&block.positions, &mut vec![DVec3::ZERO; block.node_count()]);
    assert!(energy == 0.0, "at rest {energy}");
}

#[test]
fn own_fiber_directions_replace_the_material_ones() {
    let block = block();
    let along = |direction: DVec3| {
        Material::neo_hookean(1.0, 0.4).with_fiber(Fiber {
            direction,
            stiffness: 2.0,
            exponent: 1.0,
            dispersion: 0.0,
        })
    };
    let x = shaken(&block, 0.01, 3);
    let mut f = vec![DVec3::ZERO; x.len()];
    let mut g = f.clone();
    let mut turned = model(&block, along(DVec3::X), 0.1);
    turned
        .set_fiber_directions(&vec![DVec3::new(0.0, 2.0, 1.0); x.len()])
        .expect("unit after normalising");
    let mut plain = model(&block, along(DVec3::new(0.0, 2.0, 1.0)), 0.1);
    let e0 = turned.forces_into(&x, &mut f);
    let e1 = plain.forces_into(&x, &mut g);
    assert_within("energy", e0, e1, 1e-14);
    assert!(f.iter().zip(&g).all(|(f, g)| f.abs_diff_eq(*g, 1e-14)));
    assert!(
        turned
            .set_fiber_directions(&vec![DVec3::ZERO; x.len()])
            .is_err()
    );
}

/// A stretch held after a sudden step relaxes as the series says; a step is a potential.
#[test]
fn held_stretch_relaxes_along_the_prony_series() {
    let block = block();
    let terms = [
        PronyTerm {
            ratio: 0.8,
            relaxation_time: 0.5,
        },
        PronyTerm {
            ratio: 0.3,
            relaxation_time: 5.0,
        },
    ];
    let plain = Material::neo_hookean(1.0, 0.4);
    let mut body = model(&block, plain.with_prony(&terms), 0.1);
    let mut elastic = model(&block, plain, 0.1);
    assert!(
        elastic.bytes() < body.bytes(),
        "history must cost only who uses it"
    );
    let x: Vec<DVec3> = block
        .positions
        .iter()
        .map(|x| *x * DVec3::new(1.2, 0.95, 1.0))
        .collect();
    let n = x.len();
    let mut f = vec![DVec3::ZERO; n];
    elastic.forces_into(&x, &mut f);
    let settled = elastic.first_piola_kirchhoff(0).x_axis.x;
    let (jump, step) = (1e-9, 0.01);
    body.begin_viscous_step(jump);
    body.forces_into(&x, &mut f);
    let stress = |body: &Elastic| body.first_piola_kirchhoff(0).x_axis.x / settled;
    assert_within("at once", stress(&body), 1.0 + 0.8 + 0.3, 1e-8);
    body.end_viscous_step();
    let mut time = 0.0;
    for k in 0..300 {
        body.begin_viscous_step(step);
        body.forces_into(&x, &mut f);
        body.end_viscous_step();
        time += step;
        if k % 50 == 0 {
            let expected = 1.0 + 0.8 * (-time / 0.5_f64).exp() + 0.3 * (-time / 5.0_f64).exp();
            assert_within("relaxation", stress(&body), expected, 1e-7);
        }
    }
    // A checkpoint goes on with the same bits.
    let mut copy = model(&block, plain.with_prony(&terms), 0.1);
    copy.set_viscous_history(body.viscous_history());
    let moved = shaken(&block, 0.01, 3);
    let mut g = f.clone();
    for body in [&mut body, &mut copy] {
        body.begin_viscous_step(0.02);
    }
    assert!(
        body.forces_into(&moved, &mut f).to_bits() == copy.forces_into(&moved, &mut g).to_bits()
    );
    assert!(f == g);
    check_derivatives("viscous step", &mut body, &moved, 1e-3, 1e-3);
    // Rotating the body within the step costs nothing beyond what is stored.
    let turn = DQuat::from_axis_angle(DVec3::new(0.2, 1.0, 0.3).normalize(), 1.2);
    let turned: Vec<DVec3> = moved.iter().map(|x| turn * *x).collect();
    let e0 = body.forces_into(&moved, &mut f);
    let e1 = body.forces_into(&turned, &mut g);
    assert_within("turned energy", e0, e1, 1e-12 * e0.abs());
    for (f, g) in f.iter().zip(&g) {
        assert_below("turned force", (turn * *f - *g).length(), 1e-13);
    }
}

/// The dissertation's mode: one-way neighbours, no control.
#[test]
fn one_way_pairs_work_without_control() {
    let mut block = block();
    // Take one pair away in one direction only.
    let (i, p) = (30, block.row(30).start);
    block.indices.remove(p);
    block.weights.remove(p);
    for offset in &mut block.offsets[i + 1..] {
        *offset -= 1;
    }
    block.gradients = vec![DVec3::ZERO; block.indices.len()];
    block.use_plain_gradients();
    let nodes = Nodes {
        rest_positions: &block.positions,
        volumes: &block.volumes,
    };
    let material = Material::saint_venant_kirchhoff(1000.0, 0.3);
    let settings = Settings {
        zero_energy_control: 0.0,
        ..Settings::default()
    };
    let mut body = Elastic::new(
        &Stencils {
            weights: &[],
            ..stencils(&block)
        },
        &nodes,
        &Materials::Uniform(material),
        &settings,
    )
    .expect("one-way pairs are fine without control");
    let x = shaken(&block, 0.01, 3);
    check_derivatives("one-way", &mut body, &x, 1e-3, 1.0);
    let mut f = vec![DVec3::ZERO; x.len()];
    let energy = body.forces_into(&x, &mut f);
    let (expected, g) = brute_force(&block, material, 0.0, &x);
    assert_within("energy", energy, expected, 1e-12 * expected);
    assert!(f.iter().zip(&g).all(|(f, g)| f.abs_diff_eq(*g, 1e-10)));
    let with_control = Elastic::new(
        &stencils(&block),
        &nodes,
        &Materials::Uniform(material),
        &Settings::default(),
    );
    assert!(matches!(
        with_control,
        Err(ElasticError::AsymmetricPair { .. })
    ));
}

/// What the README states: bytes per node and pair, and nothing for what is not used.
#[test]
fn memory_is_what_the_readme_states() {
    let block = Block::new([9, 9, 9], DVec3::ONE, 0.0, 1);
    let (n, pairs) = (block.node_count(), block.indices.len());
    let plain = Material::neo_hookean(1.0, 0.4);
    let single = Settings {
        precision: Precision::Single,
        ..Settings::default()
    };
    // Offsets, one material, one partial energy per chunk.
    let fixed = 1024;
    let within = |what: &str, bytes: usize, stated: usize| {
        assert!(
            (stated..stated + fixed).contains(&bytes),
            "{what}: {bytes} bytes, stated {stated}"
        );
    };
    let double = built(&block, plain, &Settings::default()).bytes();
    within("f64", double, 477 * n + 68 * pairs);
    let f32_bytes = built(&block, plain, &single).bytes();
    within("f32", f32_bytes, 381 * n + 36 * pairs);
    // Without zero-energy control there is nothing of it.
    let bare = |settings: Settings| Settings {
        zero_energy_control: 0.0,
        ..settings
    };
    let bytes = built(&block, plain, &bare(Settings::default())).bytes();
    within("f64, no control", bytes, 237 * n + 52 * pairs);
    let bytes = built(&block, plain, &bare(single)).bytes();
    within("f32, no control", bytes, 201 * n + 28 * pairs);
    let means = built(&block, plain, &mean()).bytes();
    within("mean dilatation", means - double, 112 * n);
    let term = PronyTerm {
        ratio: 1.0,
        relaxation_time: 1.0,
    };
    let viscous = built(&block, plain.with_prony(&[term]), &Settings::default()).bytes();
    within("one Prony term", viscous - double, 144 * n);
    let fibrous = built(&block, fibrous(plain), &Settings::default()).bytes();
    assert_eq!(
        fibrous, double,
        "fibers of a material take nothing per node"
    );
}

/// A product within a part against the whole product of the vector continued by zero: the same bits,
/// for any storage, at rank deficient rows and with mean dilatation.
#[test]
fn products_within_a_part_are_those_of_the_whole() {
    let mut random = Random::new(6);
    let (torn, _) = torn();
    for precision in [Precision::Double, Precision::Single] {
        for (alpha, dilatation) in [
            (0.0, Dilatation::Local),
            (0.1, Dilatation::Local),
            (0.1, Dilatation::Mean),
        ] {
            let settings = Settings {
                zero_energy_control: alpha,
                precision,
                dilatation,
            };
            let material = fibrous(Material::neo_hookean(1e4, 0.4));
            let mut body = built(&torn, material, &settings);
            let n = body.node_count();
            let mut f = vec![DVec3::ZERO; n];
            body.forces_into(&shaken(&torn, 0.01, 4), &mut f);
            for nodes in [
                vec![3],
                vec![17, 5, 6, 5, 40],
                (0..u32::try_from(n).expect("small")).collect(),
            ] {
                let part = body.part(&nodes);
                let v: Vec<DVec3> = part.nodes().iter().map(|_| random.vector(1.0)).collect();
                let (mut whole, mut expected) = (vec![DVec3::ZERO; n], vec![DVec3::ZERO; n]);
                for (&node, v) in part.nodes().iter().zip(&v) {
                    whole[node as usize] = *v;
                }
                body.tangent_product_into(&whole, &mut expected);
                let mut found = vec![DVec3::ZERO; v.len()];
                // What the last evaluation left must not matter.
                body.forces_into(&shaken(&torn, 0.01, 4), &mut f);
                body.tangent_product_within(&part, &v, &mut found);
                for (&node, found) in part.nodes().iter().zip(&found) {
                    assert_eq!(*found, expected[node as usize], "node {node}");
                }
            }
        }
    }
}
