//! Displacements as they are read.

use proptest::prelude::*;

use super::cuts::law;
use super::*;

/// From the definition, sum by sum; `see` says which nodes have a strain of their own.
fn by_definition(block: &Block, see: impl Fn(usize) -> bool, x: &[DVec3]) -> Vec<DVec3> {
    let read = |i: usize| {
        if !see(i) {
            return x[i];
        }
        let pairs = || {
            block
                .row(i)
                .map(|p| (p, block.weights[p], block.offset(i, p)))
        };
        let u = |p: usize| x[block.indices[p] as usize] - x[i] - block.offset(i, p);
        let power = |k: i32| -> f64 { pairs().map(|(_, w, x)| w * x.length().powi(k)).sum() };
        let sum = |of: &dyn Fn(usize, DVec3) -> DMat3| {
            pairs().fold(DMat3::ZERO, |sum, (p, w, x)| sum + of(p, x) * w)
        };
        let gradient = sum(&|p, x| outer(u(p), x)) * sum(&|_, x| outer(x, x)).inverse();
        let leftover: DVec3 = pairs().map(|(p, w, x)| (u(p) - gradient * x) * w).sum();
        let theta = 0.6 * power(0) * power(4) / power(2).powi(2);
        x[i] + leftover * (theta / power(0))
    };
    (0..x.len()).map(read).collect()
}

fn farthest(a: &[DVec3], b: &[DVec3]) -> f64 {
    let distances = a.iter().zip(b).map(|(a, b)| a.distance(*b));
    distances.fold(0.0, f64::max)
}

/// A block with a slit whose pairs keep `factor`, and the touched nodes.
fn slit(factor: f64) -> (Block, Vec<u32>) {
    let mut block = Block::new([4, 4, 4], DVec3::splat(0.4), 0.2, 3);
    let at = block.positions.clone();
    let mut touched = Vec::new();
    for i in 0..block.node_count() {
        let crossed =
            |j: usize| (at[i].z > 0.25) != (at[j].z > 0.25) && at[i].x.min(at[j].x) < 0.25;
        let crossing = block.row(i);
        let crossing = crossing.filter(|&p| crossed(block.indices[p] as usize));
        let crossing: Vec<usize> = crossing.collect();
        if crossing.is_empty() {
            continue;
        }
        touched.push(u32::try_from(i).expect("small"));
        for p in crossing {
            #[allow(
                clippy::cast_possible_truncation,
                reason = "weights have the digits of an f32"
            )]
            let weight = (block.weights[p] * factor) as f32;
            block.weights[p] = f64::from(weight);
        }
        rebuild(&mut block, i);
    }
    (block, touched)
}

#[test]
fn beside_a_cut_it_is_the_definition() {
    let whole = Block::new([4, 4, 4], DVec3::splat(0.4), 0.2, 3);
    let x = shaken(&whole, 0.03, 5);
    let before = model(&whole, law(), 0.1).smoothed_positions(&x);
    for factor in [0.0, 0.3, 1.0] {
        let (block, touched) = slit(factor);
        assert!(touched.len() > 20 && touched.len() < x.len() / 2);
        let mut body = model(&whole, law(), 0.1);
        update(&mut body, &touched, &block);
        let read = body.smoothed_positions(&x);
        let see = |node| body.model.ranks[node] == 3;
        let off = farthest(&read, &by_definition(&block, see, &x));
        assert!(off < 1e-14, "{factor}: {off}");
        let change = farthest(&read, &before);
        assert_eq!(change > 1e-4, factor < 1.0, "{factor}: {change}");
    }
}

#[test]
fn nodes_without_a_strain_of_their_own_stay() {
    let whole = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    let (torn, touched) = torn();
    let x = shaken(&whole, 0.03, 5);
    let mut body = model(&whole, law(), 0.1);
    update(&mut body, &touched, &torn);
    let weak = touched.iter().copied().filter(|i| i % 3 == 0);
    let weak: Vec<u32> = weak.collect();
    body.weaken(&weak, &x, &|p| f64::from(u8::from(torn.weights[p] > 0.0)));
    let see = |i: usize| body.model.ranks[i] == 3 && !weak.iter().any(|weak| *weak as usize == i);
    let read = body.smoothed_positions(&x);
    let off = farthest(&read, &by_definition(&torn, see, &x));
    assert!(off < 1e-14, "{off}");
    let still = (0..x.len()).filter(|&i| read[i] == x[i]);
    assert_eq!(still.count(), (0..x.len()).filter(|&i| !see(i)).count());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn affine_fields_stay_and_turns_turn_it(
        seed in any::<u64>(),
        factor in prop_oneof![Just(0.0), Just(0.3), Just(1.0)],
        axis in (-1.0..1.0_f64, -1.0..1.0_f64, 0.1..1.0_f64),
        angle in -3.0..3.0_f64,
    ) {
        let (block, touched) = slit(factor);
        let mut body = model(&Block::new([4, 4, 4], DVec3::splat(0.4), 0.2, 3), law(), 0.1);
        update(&mut body, &touched, &block);
        let mut random = Random::new(seed);
        let f = DMat3::from_cols(random.vector(1.0), random.vector(1.0), random.vector(1.0));
        let by = random.vector(1.0);
        let affine: Vec<DVec3> = block.positions.iter().map(|x| f * *x + by).collect();
        let off = farthest(&body.smoothed_positions(&affine), &affine);
        prop_assert!(off < 1e-14, "affine: {off}");
        let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::from(axis).normalize(), angle));
        let x = shaken(&block, 0.03, seed);
        let move_all = |x: &[DVec3]| -> Vec<DVec3> { x.iter().map(|x| turn * *x + by).collect() };
        let turned = body.smoothed_positions(&move_all(&x));
        let off = farthest(&turned, &move_all(&body.smoothed_positions(&x)));
        prop_assert!(off < 1e-14, "turned: {off}");
    }
}

/// Rows of the axes' and the faces' diagonals have the moments of a sphere: of a cubic field the stencil's gradient is
/// that of the field as it is read.
#[test]
fn the_gradient_of_cubic_fields_is_that_of_what_is_read() {
    let block = Block::eighteen([7, 7, 7], 0.1);
    let low = |x: &DVec3| x.min_element() < 0.15 || x.max_element() > 0.45;
    // u = (x³ + x y², x² y, z³) / 10, Δu = (8 x, 2 y, 6 z) / 10.
    let field = |x: DVec3| DVec3::new(x.x.powi(3) + x.x * x.y * x.y, x.x * x.x * x.y, x.z.powi(3));
    let bend = |x: DVec3| DVec3::new(8.0 * x.x, 2.0 * x.y, 6.0 * x.z);
    let slope = |x: DVec3| {
        let (xx, xy, yy) = (x.x * x.x, x.x * x.y, x.y * x.y);
        let first = DVec3::new(3.0 * xx + yy, 2.0 * xy, 0.0);
        let second = DVec3::new(2.0 * xy, xx, 0.0);
        DMat3::from_cols(first, second, DVec3::Z * (3.0 * x.z * x.z))
    };
    let moved = block.positions.iter().map(|x| *x + 0.1 * field(*x));
    let moved: Vec<DVec3> = moved.collect();
    let mut body = model(&block, law(), 0.1);
    body.forces_into(&moved, &mut vec![DVec3::ZERO; moved.len()]);
    let read = body.smoothed_positions(&moved);
    // m4 / (10 m2) of 6 pairs of h and 12 of √2 h that weigh 1/r².
    let share = 0.1 * (6.0 + 24.0) / 18.0 * 0.01;
    let of_bend = DMat3::from_diagonal(DVec3::new(8.0, 2.0, 6.0));
    for (i, &x) in block.positions.iter().enumerate().filter(|(_, x)| !low(x)) {
        let expected = x + 0.1 * (field(x) + share * bend(x));
        assert!(read[i].distance(expected) < 1e-9, "{} {expected}", read[i]);
        let found = body.deformation_gradient(i);
        let expected = DMat3::IDENTITY + (slope(x) + of_bend * share) * 0.1;
        assert!(found.abs_diff_eq(expected, 1e-8), "{found} {expected}");
    }
}

/// Conservative stencils on rows unlike from node to node: of a wave `u` they give the gradient of what is read,
/// `∇u + m4/(10 m2) ∇Δu`, rather than that of `u`.
#[test]
fn conservative_stencils_give_the_gradient_of_what_is_read() {
    let block = Block::new([12, 12, 12], DVec3::ONE, 0.0, 2);
    let (wave, along) = (DVec3::new(2.0, 1.3, 0.9), DVec3::new(1e-3, -2e-3, 1e-3));
    let phase = |x: DVec3| wave.dot(x) + 0.3;
    let moved = block.positions.iter().map(|x| *x + along * phase(*x).sin());
    let moved: Vec<DVec3> = moved.collect();
    let mut body = model(&block, law(), 0.1);
    body.forces_into(&moved, &mut vec![DVec3::ZERO; moved.len()]);
    let read = body.smoothed_positions(&moved);
    let (mut of_nodes, mut of_read, mut fields) = (0.0, 0.0, [0.0; 2]);
    for (i, &x) in block.positions.iter().enumerate() {
        if x.min_element() < 0.2 || x.max_element() > 0.8 {
            continue;
        }
        let power = |k: i32| -> f64 {
            let pairs = block.row(i);
            pairs
                .map(|p| block.weights[p] * block.offset(i, p).length().powi(k))
                .sum()
        };
        let bend = 0.1 * power(4) / power(2) * wave.length_squared();
        let slope = outer(along * phase(x).cos(), wave);
        let square = |m: DMat3| crate::law::tensor::double_dot(m, m);
        let found = body.deformation_gradient(i) - DMat3::IDENTITY;
        of_nodes += square(found - slope);
        of_read += square(found - slope * (1.0 - bend));
        let known = -along * (bend * phase(x).sin());
        fields[0] += (read[i] - moved[i] - known).length_squared();
        fields[1] += known.length_squared();
    }
    let (left, off) = (
        f64::sqrt(of_read / of_nodes),
        f64::sqrt(fields[0] / fields[1]),
    );
    assert!(left < 0.5, "{left} of the gradient's error is left");
    assert!(off < 0.1, "{off} off");
}
