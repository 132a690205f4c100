//! Nodes that a cut left weak, and their bonds.

use super::cuts::law;
use super::*;

/// The torn block whose nodes with fewer than six pairs are weak, at `x`.
fn weakened(x: &[DVec3], material: Material) -> (Block, Elastic, Vec<u32>) {
    let whole = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    let (torn, touched) = torn();
    let mut body = model(&whole, material, 0.1);
    evaluated(&mut body, x);
    update(&mut body, &touched, &torn);
    let left = |node: &u32| {
        let row = &torn.weights[torn.row(*node as usize)];
        row.iter().filter(|w| **w > 0.0).count()
    };
    let weak: Vec<u32> = touched.iter().copied().filter(|i| left(i) < 9).collect();
    body.weaken(&weak, x, &|p| if torn.weights[p] > 0.0 { 1.0 } else { 0.0 });
    (torn, body, weak)
}

#[test]
fn bonds_are_exact_gradients_and_conserve_momenta() {
    let rest = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    let x = shaken(&rest, 0.02, 6);
    let (_, mut body, weak) = weakened(&x, law());
    assert!(weak.len() > 20 && weak.len() < x.len(), "{}", weak.len());
    assert_eq!(body.deficient_nodes(), weak);
    let volumes = &body.model.elastic_volumes;
    assert!(weak.iter().all(|&i| volumes[i as usize] == 0.0));
    let there = shaken(&rest, 0.05, 7);
    check_derivatives("weak", &mut body, &there, 1e-3, 1e-3);
    let (_, f) = evaluated(&mut body, &there);
    let size: f64 = f.iter().map(|f| f.length()).sum();
    let [momentum, angular] = momenta(&there, &f);
    assert_below("momentum", momentum / size, 1e-14);
    assert_below("angular momentum", angular / size, 1e-14);
}

#[test]
fn bonds_are_objective_and_hold_however_far_a_node_is_moved() {
    let rest = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 1.0, 0.3).normalize(), 1.9);
    let (_, mut body, weak) = weakened(&rest.positions, law());
    let mut x = turned(turn, &rest.positions);
    let (energy, _) = evaluated(&mut body, &x);
    assert_within("energy of a rotation", energy, 0.0, 1e-14);
    // A deficient node that has bonds is drawn back, from any side and through its neighbours too.
    let node = *weak.iter().find(|&&i| i != 124).expect("some") as usize;
    for far in [DVec3::X, -DVec3::Y, DVec3::new(0.3, -0.2, 0.9)] {
        x[node] += far;
        let (_, f) = evaluated(&mut body, &x);
        assert!(f[node].dot(far) < 0.0, "{} along {far}", f[node]);
        x[node] -= far;
    }
    // The sheet, the line and the lone node hang on nothing valid.
    assert_eq!(body.loose_nodes(), 31);
}

#[test]
fn weakening_never_adds_energy_and_its_decay_is_booked() {
    let rest = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    for by in [0.003, 0.03, 0.15] {
        let x = shaken(&rest, by, 5);
        let (torn, touched) = torn();
        let mut f = vec![DVec3::ZERO; x.len()];
        // The same rows, with and without their strain: rows change the energy, weakening lowers it.
        let mut kept = model(&rest, law(), 0.1);
        kept.forces_into(&x, &mut f);
        update(&mut kept, &touched, &torn);
        let before = kept.forces_into(&x, &mut f);
        let weak = touched.clone();
        let share = |p: usize| f64::from(u8::from(torn.weights[p] > 0.0));
        kept.weaken(&weak, &x, &share);
        let after = kept.forces_into(&x, &mut f);
        assert!(after <= before, "{after} from {before} at {by}");
        // Where they were drawn out, bonds keep their length.
        let work = kept.decay(0.98, &x).sums()[1];
        assert_within("work on what is drawn", work, 0.0, 0.0);
        // Elsewhere some are slack: at fixed positions, the work of a decay is what the energy changes by.
        let x = shaken(&rest, by, 6);
        let start = kept.forces_into(&x, &mut f);
        let (mut energy, mut work) = (start, 0.0);
        for _ in 0..400 {
            work += kept.decay(0.98, &x).sums()[1];
            let next = kept.forces_into(&x, &mut f);
            assert!(next <= energy * (1.0 + 1e-14), "{next} from {energy}");
            energy = next;
            work += kept.decay_works().sums()[1];
        }
        assert!(work < -1e-3 * start, "{work} of {start}");
        assert_within("work of the decay", work, energy - start, 1e-12 * start);
        // Named again, the bonds are those that they were.
        let offsets = kept.bond_offsets();
        kept.weaken(&weak, &x, &share);
        assert_eq!(kept.bond_offsets(), offsets);
    }
}

#[test]
fn what_hangs_on_little_is_held_as_by_whole_pairs_and_the_change_adds_no_energy() {
    let rest = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    let node = 62_usize;
    let row = rest.row(node);
    let last = row.start + 3;
    let other = rest.indices[last] as usize;
    let neighbor = move |p: usize, share: f64| if p == last { share } else { 0.0 };
    let pull = |share: f64| {
        let mut body = model(&rest, law(), 0.1);
        let mut x = rest.positions.clone();
        evaluated(&mut body, &x);
        body.weaken(&[62], &x, &|p| neighbor(p, share));
        // Along the pair, without its neighbours' strain.
        let along = rest.positions[other] - rest.positions[node];
        x[node] -= along;
        let (energy, _) = evaluated(&mut body, &x);
        x[node] += along;
        energy - evaluated(&mut body, &x).0
    };
    let [little, whole] = [0.016, 1.0].map(pull);
    assert_within("a small share of a pair", little, whole, 1e-12 * whole);
    let x = shaken(&rest, 0.1, 5);
    // Beside whole pairs one of which next to nothing is left holds next to nothing.
    let beside = |share: f64| {
        let mut body = model(&rest, law(), 0.1);
        evaluated(&mut body, &rest.positions);
        let left = |p: usize| if p == last { share } else { 1.0 };
        body.weaken(&[62], &rest.positions, &left);
        evaluated(&mut body, &x).0
    };
    let [severed, faint] = [0.0, 1e-9].map(beside);
    assert_within("a faint pair", faint, severed, 1e-9 * severed);
    // Bonds that others leave alone get stiffer; what they hold they keep.
    let mut body = model(&rest, law(), 0.1);
    evaluated(&mut body, &x);
    body.weaken(&[62], &x, &|p| if row.contains(&p) { 0.2 } else { 0.0 });
    for _ in 0..400 {
        body.decay(0.98, &x);
    }
    let (before, _) = evaluated(&mut body, &x);
    let held = body.energies().1[3].1;
    assert!(held > 0.0);
    let lost = body.weaken(&[62], &x, &|p| neighbor(p, 0.2));
    let (after, _) = evaluated(&mut body, &x);
    let last = body.energies().1[0].1;
    assert_within("the last bond", last, held, 1e-12 * held);
    assert_within("what was lost", lost, before - after, 1e-12 * before);
    assert!(lost > 0.0, "{lost}");
}

#[test]
fn part_products_see_bonds() {
    let rest = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    let x = shaken(&rest, 0.02, 6);
    let (_, mut body, weak) = weakened(&x, law());
    evaluated(&mut body, &shaken(&rest, 0.04, 8));
    for (_, found, expected) in products_of(&mut body, &weak[3..12]) {
        let off = (found - expected).length();
        assert_below("difference", off, 1e-13 * expected.length().max(1e-3));
    }
}

#[test]
fn a_part_is_told_of_its_state_to_the_bit() {
    let rest = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    let x = shaken(&rest, 0.02, 6);
    let (_, mut body, weak) = weakened(&x, law());
    let mut told = body.clone();
    let y = shaken(&rest, 0.04, 8);
    evaluated(&mut body, &y);
    for nodes in [&weak[3..12], &weak[..1]] {
        check_told(&mut body, &mut told, nodes, &y);
    }
}
