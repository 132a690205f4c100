//! A model of some of a body's nodes, in the body's frame, says of them what the body's says, bit for bit.

use std::collections::BTreeSet;

use super::*;
use crate::WATCHED_NODES;

/// The nodes of a block's first run and two layers around them, ascending, and those of the second layer, whose rows are
/// cut off.
fn cutout(block: &Block) -> (Vec<usize>, Vec<usize>) {
    let mut nodes: Vec<usize> = (0..WATCHED_NODES).collect();
    let mut outer = Vec::new();
    for _ in 0..2 {
        let around = nodes.iter().flat_map(|&node| block.row(node));
        let around: BTreeSet<usize> = around.map(|pair| block.indices[pair] as usize).collect();
        outer = around
            .into_iter()
            .filter(|at| !nodes.contains(at))
            .collect();
        nodes.extend_from_slice(&outer);
    }
    nodes.sort_unstable();
    (nodes, outer)
}

/// The model of a cutout, in the frame of the whole.
fn part(block: &Block, whole: &Elastic, (nodes, outer): &(Vec<usize>, Vec<usize>)) -> Elastic {
    let (mut offsets, mut indices, mut weights) = (vec![0_u32], Vec::new(), Vec::new());
    let id = |at: usize| u32::try_from(at).expect("a small block");
    for &node in nodes {
        for pair in block.row(node) {
            if let Ok(other) = nodes.binary_search(&(block.indices[pair] as usize)) {
                indices.push(id(other));
                weights.push(block.weights[pair]);
            }
        }
        offsets.push(id(indices.len()));
    }
    let each = |list: &[DVec3]| -> Vec<DVec3> { nodes.iter().map(|&at| list[at]).collect() };
    let volumes: Vec<f64> = nodes.iter().map(|&at| block.volumes[at]).collect();
    let rows = nodes.iter().map(|at| match outer.contains(at) {
        true => (DMat3::ZERO, 0.0),
        false => (block.matrices[*at], block.scales[*at]),
    });
    let (matrices, scales): (Vec<DMat3>, Vec<f64>) = rows.unzip();
    let (rest, multipliers) = (each(&block.positions), each(&block.multipliers));
    let stencils = Stencils {
        offsets: &offsets,
        indices: &indices,
        weights: &weights,
        matrices: &matrices,
        scales: &scales,
        multipliers: &multipliers,
    };
    let (nodes, material) = (Nodes::new(&rest, &volumes), *whole.material(0));
    let materials = Materials::Uniform(material);
    Elastic::new(&stencils, &nodes, &materials, whole.settings()).expect("rows are valid or empty")
}

#[test]
fn a_part_in_the_frame_of_the_whole_has_its_bits() {
    let block = Block::new([12, 8, 8], DVec3::new(1.2, 0.8, 0.8), 0.2, 5);
    let cutout = cutout(&block);
    let (nodes, outer) = &cutout;
    assert!(outer.len() > 50 && nodes.len() < block.positions.len());
    let mut whole = model(&block, Material::stable_neo_hookean(1000.0, 0.4), 0.1);
    let mut part = part(&block, &whole, &cutout);
    let x = shaken(&block, 0.02, 3);
    let (_, forces) = evaluated(&mut whole, &x);
    let places: Vec<DVec3> = nodes.iter().map(|&at| x[at]).collect();
    let (_, found) = evaluated(&mut part, &places);
    assert_eq!(
        found[..WATCHED_NODES],
        forces[..WATCHED_NODES],
        "the forces"
    );
    let energies = [part.energies().0[0], whole.energies().0[0]];
    assert_eq!(energies[0].to_bits(), energies[1].to_bits(), "the energy");
}

#[test]
fn energies_of_runs_and_bonds_are_the_energy() {
    let block = Block::new([12, 8, 8], DVec3::new(1.2, 0.8, 0.8), 0.2, 5);
    let mut body = model(&block, Material::stable_neo_hookean(1000.0, 0.4), 0.1);
    let x = shaken(&block, 0.02, 3);
    evaluated(&mut body, &x);
    body.weaken(&[40, 400], &x, &|_| 1.0);
    let (energy, _) = evaluated(&mut body, &shaken(&block, 0.02, 4));
    let (runs, bonds) = body.energies();
    let runs: f64 = runs.iter().sum();
    let of_bonds = bonds.iter().fold(0.0, |sum, (_, energy)| sum + energy);
    assert!(of_bonds > 0.0 && bonds.iter().all(|(node, _)| [40, 400].contains(node)));
    assert_eq!((runs + of_bonds).to_bits(), energy.to_bits());
}
