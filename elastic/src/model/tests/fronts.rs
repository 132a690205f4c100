//! Control of a cut's front: derivatives, invariances, what it leaves alone.

use super::*;

/// Nodes of the block's middle with unit directions of two kinds, one of them a mean of three.
fn fronts(random: &mut Random) -> (Vec<u32>, Vec<DMat3>) {
    let mut square = || {
        let v = random.vector(1.0).normalize();
        outer(v, v)
    };
    let matrix = |k| match k % 2 {
        0 => square(),
        _ => (square() + square() + square()) * (1.0 / 3.0),
    };
    ((20..30).collect(), (0..10).map(matrix).collect())
}

fn with_fronts(block: &Block, settings: &Settings) -> (Elastic, Vec<u32>) {
    let mut body = built(block, Material::neo_hookean(1000.0, 0.4), settings);
    let (nodes, matrices) = fronts(&mut Random::new(5));
    body.set_fronts(&nodes, &matrices);
    assert_eq!(body.fronts().len(), nodes.len());
    (body, nodes)
}

#[test]
fn forces_of_a_front_are_the_gradient_and_the_tangent_is_theirs() {
    let block = block();
    for settings in [Settings::default(), mean()] {
        let (mut body, nodes) = with_fronts(&block, &settings);
        let x = shaken(&block, 0.03, 3);
        // What the fronts add is not lost in the rest.
        let held = body.front_energy(&nodes, &x);
        let mut without = built(&block, Material::neo_hookean(1000.0, 0.4), &settings);
        let added = evaluated(&mut body, &x).0 - evaluated(&mut without, &x).0;
        assert_within("energy", added / held, 1.0, 1e-9);
        assert!(held > 0.01 * evaluated(&mut without, &x).0, "{held}");
        check_derivatives("front", &mut body, &x, 1e-3, 1.0);
    }
}

#[test]
fn a_front_does_not_feel_linear_fields() {
    let block = block();
    let (mut body, nodes) = with_fronts(&block, &Settings::default());
    let mut without = model(&block, Material::neo_hookean(1000.0, 0.4), 0.1);
    let f = DMat3::from_cols(
        DVec3::new(1.2, 0.1, -0.3),
        DVec3::new(0.2, 0.9, 0.1),
        DVec3::new(-0.1, 0.3, 1.1),
    );
    let x: Vec<DVec3> = block.positions.iter().map(|x| f * *x + DVec3::Y).collect();
    let (there, expected) = (evaluated(&mut body, &x), evaluated(&mut without, &x));
    assert_below("held", body.front_energy(&nodes, &x), 1e-20 * expected.0);
    assert_within("energy", there.0, expected.0, 1e-12 * expected.0);
    let most = largest(&expected.1);
    for (found, expected) in there.1.iter().zip(&expected.1) {
        assert_below("force", (*found - *expected).length(), 1e-10 * most);
    }
}

#[test]
fn a_front_turns_with_the_body_and_pulls_at_nothing_outside() {
    let block = block();
    let (mut body, nodes) = with_fronts(&block, &Settings::default());
    let x = shaken(&block, 0.03, 9);
    let (energy, forces) = evaluated(&mut body, &x);
    let held = body.front_energy(&nodes, &x);
    assert!(held > 0.0);
    let turn = DQuat::from_axis_angle(DVec3::new(0.3, -1.0, 0.6).normalize(), 2.1);
    let turned: Vec<DVec3> = x.iter().map(|x| turn * *x + DVec3::X).collect();
    let (same, there) = evaluated(&mut body, &turned);
    assert_within("energy", same, energy, 1e-12 * energy);
    let most = largest(&forces);
    for (found, force) in there.iter().zip(&forces) {
        assert_below("force", (*found - turn * *force).length(), 1e-10 * most);
    }
    let [momentum, angular] = momenta(&x, &forces);
    assert_below("momentum", momentum, 1e-12 * most);
    assert_below("angular momentum", angular, 1e-12 * most);
}

#[test]
fn a_body_without_a_front_is_as_before_to_the_bit_and_pays_nothing() {
    let block = block();
    let settings = Settings::default();
    let mut without = built(&block, Material::neo_hookean(1000.0, 0.4), &settings);
    let bytes = without.bytes();
    let (mut body, nodes) = with_fronts(&block, &settings);
    let x = shaken(&block, 0.03, 4);
    assert_ne!(evaluated(&mut body, &x), evaluated(&mut without, &x));
    body.set_fronts(&nodes, &vec![DMat3::ZERO; nodes.len()]);
    assert!(body.fronts().is_empty());
    assert_eq!(evaluated(&mut body, &x), evaluated(&mut without, &x));
    without.set_fronts(&nodes, &vec![DMat3::ZERO; nodes.len()]);
    assert_eq!((without.bytes(), bytes.cuts), (bytes, 0));
    // None without hourglass stabilization, whose constants it needs.
    let mut bare = model(&block, Material::neo_hookean(1000.0, 0.4), 0.0);
    bare.set_fronts(&nodes, &vec![DMat3::IDENTITY; nodes.len()]);
    assert!(bare.fronts().is_empty());
}

#[test]
fn what_a_cut_severed_does_not_pull_at_a_front() {
    let mut block = Block::new([6, 5, 5], DVec3::splat(0.1), 0.2, 2);
    let settings = Settings::default();
    let mut body = built(&block, Material::neo_hookean(1000.0, 0.4), &settings);
    let at = block.positions.clone();
    let right = |i: usize| at[i].x > 0.05;
    let touched = cut(&mut block, |i, j| right(i) == right(j));
    update(&mut body, &touched, &block);
    body.set_fronts(&touched, &vec![DMat3::IDENTITY; touched.len()]);
    let mut x = shaken(&block, 0.003, 6);
    let held = body.front_energy(&touched, &x);
    assert!(touched.len() > 20 && held > 0.0, "{held}");
    let shift = DQuat::from_rotation_y(0.4);
    for (i, x) in x.iter_mut().enumerate() {
        if right(i) {
            *x = shift * *x + DVec3::X;
        }
    }
    assert_within("energy", body.front_energy(&touched, &x) / held, 1.0, 1e-11);
    // A node that turns deficient has none any more.
    body.weaken(&touched, &x, &|_| 0.0);
    assert_eq!(body.front_energy(&touched, &x).to_bits(), 0);
}

#[test]
fn products_of_a_part_and_evaluations_after_a_change_know_fronts() {
    let block = Block::new([6, 6, 60], DVec3::splat(0.1), 0.2, 3);
    let settings = Settings::default();
    let mut body = built(&block, Material::neo_hookean(1000.0, 0.4), &settings);
    let (n, x) = (block.node_count(), shaken(&block, 0.02, 8));
    let (mut energy, mut forces) = evaluated(&mut body, &x);
    let (nodes, matrices) = fronts(&mut Random::new(1));
    let none = vec![DMat3::ZERO; nodes.len()];
    for matrices in [matrices, none] {
        let before = energy;
        body.set_fronts(&nodes, &matrices);
        let changed = body.changed_chunks();
        let chosen = changed.iter().filter(|chosen| **chosen).count();
        assert!(2 * chosen < n.div_ceil(256), "{chosen}");
        energy = body.forces_again(&x, &mut forces);
        assert_ne!(before.to_bits(), energy.to_bits());
        assert_eq!(evaluated(&mut body.clone(), &x), (energy, forces.clone()));
    }
    let (nodes, matrices) = fronts(&mut Random::new(1));
    body.set_fronts(&nodes, &matrices);
    body.forces_into(&x, &mut forces);
    for (_, found, expected) in products_of(&mut body, &nodes[2..6]) {
        let off = (found - expected).length();
        assert_below("difference", off, 1e-13 * expected.length());
    }
}

#[test]
fn a_front_of_a_strained_body_holds_no_more_than_it_may() {
    let block = block();
    let (mut body, nodes) = with_fronts(&block, &Settings::default());
    let x = shaken(&block, 0.03, 7);
    let (_, matrices) = fronts(&mut Random::new(5));
    let whole = body.front_energy(&nodes, &x);
    for share in [0.0, 0.3, 1.0, 2.0] {
        body.set_fronts_within(&nodes, &matrices, share * whole, &x);
        let held = body.front_energy(&nodes, &x);
        assert_within("share", held / whole, f64::min(share, 1.0), 1e-12);
        assert_eq!(body.fronts().is_empty(), share == 0.0);
    }
    // Nothing to pay with, or at rest, where nothing is to be paid.
    body.set_fronts_within(&nodes, &matrices, -1.0, &x);
    assert!(body.fronts().is_empty());
    body.set_fronts_within(&nodes, &matrices, 0.0, &block.positions);
    assert_eq!(body.fronts().len(), nodes.len());
}

#[test]
fn kept_fronts_come_back_alone() {
    let block = block();
    let (mut body, nodes) = with_fronts(&block, &Settings::default());
    let x = shaken(&block, 0.03, 2);
    let (kept, expected) = (body.fronts(), evaluated(&mut body, &x));
    body.set_fronts(&[3, nodes[1]], &[DMat3::IDENTITY, DMat3::ZERO]);
    assert_ne!(evaluated(&mut body, &x), expected);
    body.restore_fronts(&kept);
    assert_eq!(body.fronts(), kept);
    assert_eq!(evaluated(&mut body, &x), expected);
}

#[test]
fn fronts_know_rows_that_have_changed() {
    let mut block = Block::new([6, 5, 5], DVec3::splat(0.1), 0.2, 2);
    let law = Material::neo_hookean(1000.0, 0.4);
    let (mut body, nodes) = with_fronts(&block, &Settings::default());
    let at = block.positions.clone();
    // Between the nodes of the fronts and others.
    let low = (at[20].x + at[29].x) / 2.0;
    let touched = cut(&mut block, |i, j| {
        (at[i].x > low && at[i].y > 0.04) == (at[j].x > low && at[j].y > 0.04)
    });
    assert!(nodes.iter().any(|node| touched.contains(node)));
    update(&mut body, &touched, &block);
    // As if it had been built with these rows.
    let (mut anew, _) = with_fronts(&block, &Settings::default());
    let x = shaken(&block, 0.003, 6);
    let (found, expected) = (evaluated(&mut body, &x), evaluated(&mut anew, &x));
    let without = evaluated(&mut built(&block, law, &Settings::default()), &x);
    assert!(expected.0 > 1.001 * without.0);
    assert_within("energy", found.0, expected.0, 1e-12 * expected.0);
}

#[test]
fn a_part_is_told_of_its_fronts_to_the_bit() {
    let block = block();
    let (mut body, nodes) = with_fronts(&block, &Settings::default());
    let mut told = body.clone();
    let x = shaken(&block, 0.03, 8);
    evaluated(&mut body, &x);
    check_told(&mut body, &mut told, &nodes[2..5], &x);
}
