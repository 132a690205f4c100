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

/// A turned body far from where it was has no more energy than round-off, and a little strain has.
#[test]
fn round_off_bounds_the_energy_of_rigid_motions() {
    let block = Block::new([5, 4, 4], DVec3::splat(0.4), 0.2, 3);
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.3).normalize(), 2.3);

    for poissons_ratio in [0.3, 0.49] {
        let settings = Settings::default();
        let material = Material::stable_neo_hookean(1e4, poissons_ratio);
        let mut body = built(&block, material, &settings);
        let mut f = vec![DVec3::ZERO; body.node_count()];
        for far in [1.0, 1e3, 1e6] {
            let x = block.positions.iter().map(|x| turn * *x + far);
            let x: Vec<DVec3> = x.collect();
            let energy = body.forces_into(&x, &mut f);
            let bound = body.energy_round_off(&x);
            assert_below("energy of a rigid motion", energy.abs(), bound);
        }
        let x = block.positions.iter().map(|x| *x * 1.01);
        let x: Vec<DVec3> = x.collect();
        let energy = body.forces_into(&x, &mut f);
        let bound = body.energy_round_off(&x);
        assert!(energy > 10.0 * bound, "{energy} J, round-off {bound} J");
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
    bad.matrices[0] *= 1.1;
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
    bad.matrices[2].x_axis.x = f64::INFINITY;
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
    let refused = |change: &dyn Fn(&mut Block)| {
        let mut bad = good.clone();
        change(&mut bad);
        build(&bad).unwrap_err()
    };
    let pairs = good.indices.len();
    let short = refused(&|bad| {
        bad.weights.pop();
    });
    let length = |what, found, expected| ElasticError::Length {
        what,
        found,
        expected,
    };
    assert_eq!(short, length("weights", pairs - 1, pairs));
    let volumes = refused(&|bad| bad.volumes.push(1.0));
    let nodes = good.node_count();
    assert_eq!(volumes, length("volumes", nodes + 1, nodes));
    let start = refused(&|bad| bad.offsets[0] = 1);
    assert_eq!(
        start,
        ElasticError::Offset {
            position: 0,
            value: 1
        }
    );
    let end = refused(&|bad| *bad.offsets.last_mut().unwrap() -= 1);
    assert!(matches!(end, ElasticError::Offset { position, .. } if position == nodes));
    build(&good).expect("the block itself is good");
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
        stabilization: 0.0,
        ..Settings::default()
    };
    let mut body = Elastic::new(
        &stencils(&block),
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
