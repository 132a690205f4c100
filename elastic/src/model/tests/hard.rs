//! Torn, collapsed and one-way neighbourhoods; bad input.

use super::*;

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
        update(&mut body, &touched, &torn);
        let mut ranks = [0; 4];
        for node in 0..body.node_count() {
            ranks[usize::from(body.model.ranks[node])] += 1;
        }
        // The sheet has 25; 6 more lost their third direction beside the line and the lone node.
        assert_eq!(ranks, [1, 5, 31, 88]);
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 1.0, 0.3).normalize(), 1.9);
        let (energy, f) = evaluated(&mut body, &turned(turn, &torn.positions));
        assert_within("energy of a rotation", energy, 0.0, 1e-14);
        assert_below("force", largest(&f), 1e-14);
        let x = shaken(&torn, 0.015, 6);
        check_derivatives("torn", &mut body, &x, 1e-3, 1e-3);

        // An updated model equals one built from the torn rows.
        let bits = |body: &mut Elastic| {
            let (energy, forces) = evaluated(body, &x);
            (energy.to_bits(), forces)
        };
        assert!(bits(&mut body) == bits(&mut model(&torn, material, 0.1)));
        // And going back restores the first one.
        update(&mut body, &touched, &whole);
        assert!(bits(&mut body) == bits(&mut model(&whole, material, 0.1)));
    }
}

/// A turned body far from where it was has no more energy than round-off, and a little strain has.
#[test]
fn round_off_bounds_the_energy_of_rigid_motions() {
    let block = Block::new([5, 4, 4], DVec3::splat(0.4), 0.2, 3);
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.3).normalize(), 2.3);

    for poissons_ratio in [0.3, 0.49] {
        let material = Material::stable_neo_hookean(1e4, poissons_ratio);
        let mut body = model(&block, material, 0.1);
        let mut at = |place: &dyn Fn(DVec3) -> DVec3| {
            let x: Vec<DVec3> = block.positions.iter().map(|x| place(*x)).collect();
            (evaluated(&mut body, &x).0, body.energy_round_off(&x))
        };
        for far in [1.0, 1e3, 1e6] {
            let (energy, bound) = at(&|x| turn * x + far);
            assert_below("energy of a rigid motion", energy.abs(), bound);
        }
        let (energy, bound) = at(&|x| x * 1.01);
        assert!(energy > 10.0 * bound, "{energy} J, round-off {bound} J");
    }
}

#[test]
fn collapsed_neighborhoods_stay_finite() {
    let (torn, _) = torn();
    let mut body = model(&torn, Material::neo_hookean(1.0, 0.4), 0.1);
    let n = body.node_count();
    let v = shaken(&torn, 1.0, 4);
    for x in [
        vec![DVec3::ZERO; n],
        torn.positions.iter().map(|x| DVec3::X * x.x).collect(),
        torn.positions.iter().map(|x| -*x).collect(),
    ] {
        let (energy, f) = evaluated(&mut body, &x);
        let kv = product(&mut body, &v);
        assert!(energy.is_finite());
        assert!(f.iter().chain(&kv).all(|f| f.is_finite()));
    }
}

#[test]
fn bad_input_is_named() {
    type Case<'a> = (&'a dyn Fn(&mut Block), &'a str);
    let good = block();
    let (material, usual) = (Material::neo_hookean(1.0, 0.3), Settings::default());
    let (nodes, pairs) = (good.node_count(), good.indices.len());
    let short = format!("{} weights where {pairs} are needed", pairs - 1);
    let long = format!("{} volumes where {nodes} are needed", nodes + 1);
    let end = format!("offset {} at position {nodes} ", pairs - 1);
    let cases: [Case<'_>; 10] = [
        (&|bad| bad.volumes[3] = 0.0, "volume of node 3 is 0"),
        (
            &|bad| bad.positions[5].y = f64::NAN,
            "rest position of node 5 ",
        ),
        (
            &|bad| bad.matrices[0] *= 1.1,
            "gradient row of node 0 misses",
        ),
        (&|bad| bad.indices.swap(0, 1), "row of node 0 must list"),
        (&|bad| bad.weights[0] *= 2.0, "pair (0, "),
        (
            &|bad| bad.matrices[2].x_axis.x = f64::INFINITY,
            "matrix of node 2 ",
        ),
        (&|bad| bad.weights.truncate(pairs - 1), &short),
        (&|bad| bad.volumes.push(1.0), &long),
        (&|bad| bad.offsets[0] = 1, "offset 1 at position 0 "),
        (&|bad| bad.offsets[nodes] -= 1, &end),
    ];
    for (change, named) in cases {
        let mut bad = good.clone();
        change(&mut bad);
        let refused = try_built(&bad, &Materials::Uniform(material), &usual);
        let told = refused.expect_err(named).to_string();
        assert!(told.starts_with(named), "{told}");
    }
    let materials = Materials::PerNode {
        list: &[material],
        of_node: &vec![1; nodes],
    };
    let told = try_built(&good, &materials, &usual).expect_err("no such material");
    let told = told.to_string();
    assert_eq!(told, "node 0 names material 1, but there are 1");
    built(&good, material, &usual);
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
    let material = Material::saint_venant_kirchhoff(1000.0, 0.3);
    // One-way pairs are fine without control.
    let mut body = model(&block, material, 0.0);
    let x = shaken(&block, 0.01, 3);
    check_derivatives("one-way", &mut body, &x, 1e-3, 1.0);
    let (energy, f) = evaluated(&mut body, &x);
    let (expected, g) = brute_force(&block, material, 0.0, &x);
    assert_within("energy", energy, expected, 1e-12 * expected);
    assert!(f.iter().zip(&g).all(|(f, g)| f.abs_diff_eq(*g, 1e-10)));
    let with_control = try_built(&block, &Materials::Uniform(material), &Settings::default());
    let refused = with_control.expect_err("a pair has no other");
    assert!(matches!(refused, ElasticError::AsymmetricPair { .. }));
}
