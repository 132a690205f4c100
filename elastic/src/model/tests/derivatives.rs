//! Forces, tangents, invariances and bits of the default model.

use super::*;

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
    let x = shaken(&block, 0.01, 4);
    let energy = |material_of: &dyn Fn(usize) -> bool| {
        let of_node: Vec<u32> = (0..n).map(|i| u32::from(material_of(i))).collect();
        let materials = Materials::PerNode {
            list: &list,
            of_node: &of_node,
        };
        let mut body = try_built(&block, &materials, &Settings::default()).expect("fine");
        evaluated(&mut body, &x).0
    };
    let (first, split) = (energy(&|_| false), energy(&|i| i % 2 == 0));
    let (sum, halves) = (first + energy(&|_| true), split + energy(&|i| i % 2 > 0));
    assert_within("energies of nodes add up", sum, halves, 1e-12 * sum);
    assert!(first < split);
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
        let (_, f) = evaluated(&mut body, &x);
        let stress = body.first_piola_kirchhoff(0);
        for (i, f) in f.iter().enumerate() {
            let expected = -(stress * block.boundary_vectors[i]);
            assert_below("traction", (*f - expected).length(), 1e-12);
        }
    }
}
