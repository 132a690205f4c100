//! Control of crack fronts: a block slit half through.

use super::*;

const CONORMALS: [DVec3; 2] = [DVec3::X, DVec3::new(0.6, 0.0, 0.8)];

/// A block whose pairs across the middle of z are severed up to the middle of x, and the nodes at the
/// end of the cut; every third has two conormals.
fn slit() -> (Block, Vec<u32>, Vec<u32>) {
    let mut block = Block::new([6, 4, 4], DVec3::new(0.6, 0.4, 0.4), 0.2, 3);
    let x = block.positions.clone();
    let front = |i: usize| (x[i].x - 0.3).abs() < 0.14 && (x[i].z - 0.2).abs() < 0.14;
    let touched = cut(&mut block, |i, j| {
        let across = (x[i].z < 0.2) != (x[j].z < 0.2);
        !(across && x[i].x < 0.3 && x[j].x < 0.3)
    });
    let nodes = (0_u32..).zip(0..x.len()).filter(|&(_, i)| front(i));
    let nodes = nodes.map(|(node, _)| node).collect();
    (block, nodes, touched)
}

fn rows(nodes: &[u32]) -> (Vec<u32>, Vec<DVec3>) {
    let (mut offsets, mut conormals) = (vec![0], Vec::new());
    for &node in nodes {
        let count = if node % 3 == 0 { 2 } else { 1 };
        conormals.extend_from_slice(&CONORMALS[..count]);
        offsets.push(u32::try_from(conormals.len()).expect("small"));
    }
    (offsets, conormals)
}

fn with_fronts(block: &Block, nodes: &[u32], material: Material) -> Elastic {
    let mut body = model(block, material, 0.1);
    let (offsets, conormals) = rows(nodes);
    body.set_fronts(nodes, &offsets, &conormals)
        .expect("sound conormals");
    assert!(body.front_count() > 10, "{} fronts", body.front_count());
    body
}

#[test]
fn forces_are_the_gradient_and_the_tangent_is_theirs_at_a_front() {
    let (block, nodes, _) = slit();
    let mut body = with_fronts(&block, &nodes, Material::neo_hookean(1000.0, 0.4));
    // Far from rest, so that the conormals turn and stretch.
    let turn = DQuat::from_axis_angle(DVec3::new(0.3, 1.0, 0.2).normalize(), 1.1);
    let x: Vec<DVec3> = shaken(&block, 0.02, 3)
        .iter()
        .map(|x| turn * (*x * DVec3::new(1.5, 0.9, 1.1)))
        .collect();
    check_derivatives("front", &mut body, &x, 1e-3, 1.0);
}

#[test]
fn a_front_is_objective_and_keeps_momentum() {
    let (block, nodes, _) = slit();
    let mut body = with_fronts(&block, &nodes, Material::neo_hookean(1.0, 0.4));
    let mut bare = model(&block, Material::neo_hookean(1.0, 0.4), 0.1);
    let x = shaken(&block, 0.02, 8);
    let mut f = vec![DVec3::ZERO; x.len()];
    let mut g = f.clone();
    let e0 = body.forces_into(&x, &mut f);
    assert!(e0 > 1.0001 * bare.forces_into(&x, &mut g), "no control");
    let scale: f64 = f.iter().map(|f| f.length()).sum();
    let total: DVec3 = f.iter().sum();
    let torque: DVec3 = x.iter().zip(&f).map(|(x, f)| x.cross(*f)).sum();
    assert_below("momentum", total.length(), 1e-13 * scale);
    assert_below("angular momentum", torque.length(), 1e-13 * scale);
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 2.4);
    let turned: Vec<DVec3> = x.iter().map(|x| turn * *x).collect();
    let e1 = body.forces_into(&turned, &mut g);
    assert_within("turned energy", e0, e1, 1e-12 * e0);
    for (f, g) in f.iter().zip(&g) {
        assert_below("turned force", (turn * *f - *g).length(), 1e-12 * scale);
    }
}

#[test]
fn a_front_does_nothing_to_linear_fields() {
    let (block, nodes, _) = slit();
    let mut body = with_fronts(&block, &nodes, Material::neo_hookean(1.0, 0.4));
    let mut bare = model(&block, Material::neo_hookean(1.0, 0.4), 0.1);
    let a = DMat3::from_cols(
        DVec3::new(1.15, 0.1, -0.05),
        DVec3::new(0.2, 0.9, 0.1),
        DVec3::new(0.0, -0.1, 1.05),
    );
    let x: Vec<DVec3> = block.positions.iter().map(|x| a * *x).collect();
    let mut f = vec![DVec3::ZERO; x.len()];
    let mut g = f.clone();
    let (e0, e1) = (body.forces_into(&x, &mut f), bare.forces_into(&x, &mut g));
    assert_within("energy", e0, e1, 1e-13 * e1);
    for (f, g) in f.iter().zip(&g) {
        assert_below("force", (*f - *g).length(), 1e-14);
    }
    let at_rest = body.forces_into(&block.positions, &mut f);
    assert!(at_rest == 0.0 && f.iter().all(|f| *f == DVec3::ZERO));
}

#[test]
fn a_front_leaves_the_largest_eigenvalue_below_the_bound() {
    let (block, nodes, _) = slit();
    let largest = |body: &mut Elastic| {
        let n = body.node_count();
        let mut v = shaken(&block, 1.0, 5);
        let mut kv = vec![DVec3::ZERO; n];
        body.forces_into(&block.positions, &mut kv);
        let mut value = 0.0;
        for _ in 0..400 {
            body.tangent_product_into(&v, &mut kv);
            for (kv, m) in kv.iter_mut().zip(&block.volumes) {
                *kv /= *m;
            }
            value = dot(&kv, &kv).sqrt() / dot(&v, &v).sqrt();
            let size = dot(&kv, &kv).sqrt();
            for (v, kv) in v.iter_mut().zip(&kv) {
                *v = *kv / size;
            }
        }
        value
    };
    let material = Material::neo_hookean(1.0, 0.4);
    let bare = largest(&mut model(&block, material, 0.1));
    let mut body = with_fronts(&block, &nodes, material);
    let found = largest(&mut body);
    // The stiffest mode lies elsewhere: 1.003 here.
    assert_within("largest eigenvalue", found, bare, 0.02 * bare);
    let bound = body.eigenvalue_bound(&block.volumes);
    assert!(found <= bound, "{found} above {bound}");
    // With fronts at all nodes, which no cut makes.
    let all: Vec<u32> = (0..).take(block.node_count()).collect();
    let mut body = with_fronts(&block, &all, material);
    let (more, above) = (largest(&mut body), body.eigenvalue_bound(&block.volumes));
    assert!(
        more > found && more <= above && above > bound,
        "{more} {above}"
    );
}

#[test]
fn products_within_a_part_are_rows_of_those_of_the_whole() {
    let (block, nodes, _) = slit();
    let mut body = with_fronts(&block, &nodes, Material::neo_hookean(1.0, 0.4));
    let n = body.node_count();
    let mut f = vec![DVec3::ZERO; n];
    body.forces_into(&shaken(&block, 0.02, 2), &mut f);
    let chosen: Vec<u32> = (0..u32::try_from(n).expect("small"))
        .filter(|node| node % 3 > 0)
        .collect();
    let part = body.part(&chosen);
    let v: Vec<DVec3> = shaken(&block, 1.0, 6)[..chosen.len()].to_vec();
    let mut within = vec![DVec3::ZERO; chosen.len()];
    body.tangent_product_within(&part, &v, &mut within);
    let mut whole = vec![DVec3::ZERO; n];
    for (&node, v) in chosen.iter().zip(&v) {
        whole[node as usize] = *v;
    }
    let mut product = vec![DVec3::ZERO; n];
    body.tangent_product_into(&whole, &mut product);
    let scale = product.iter().map(|p| p.length()).fold(0.0, f64::max);
    for (&node, p) in chosen.iter().zip(&within) {
        let off = (product[node as usize] - *p).length();
        assert_below("row", off, 1e-12 * scale);
    }
}

#[test]
fn fronts_come_and_go_with_their_nodes() {
    let (block, nodes, touched) = slit();
    let material = Material::neo_hookean(1.0, 0.4);
    let mut bare = model(&block, material, 0.1);
    let mut body = with_fronts(&block, &nodes, material);
    assert!(body.bytes() > bare.bytes());
    let x = shaken(&block, 0.02, 8);
    let (mut f, mut g) = (vec![DVec3::ZERO; x.len()], vec![DVec3::ZERO; x.len()]);
    // Rows that change forget their fronts; an empty row takes one away.
    let before = body.front_count();
    body.update_rows(&touched, &stencils(&block)).expect("fine");
    assert!(body.front_count() < before);
    body.set_fronts(&nodes, &vec![0; nodes.len() + 1], &[])
        .expect("nothing to refuse");
    assert_eq!(body.front_count(), 0);
    let e0 = body.forces_into(&x, &mut f);
    assert!(e0.to_bits() == bare.forces_into(&x, &mut g).to_bits() && f == g);
    // Conormals without a direction are refused, and nothing changes.
    let error = body.set_fronts(&nodes[..1], &[0, 1], &[DVec3::ZERO]);
    assert!(matches!(error, Err(ElasticError::NotFinite { .. })));
    assert_eq!(body.front_count(), 0);
    // Without zero-energy control there are no weights to measure leftovers with.
    let mut loose = model(&block, material, 0.0);
    let (offsets, conormals) = rows(&nodes);
    loose
        .set_fronts(&nodes, &offsets, &conormals)
        .expect("sound conormals");
    assert_eq!(loose.front_count(), 0);
}
