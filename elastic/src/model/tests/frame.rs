//! A model of some of a body's nodes, in the body's frame, says of them what the body's says, bit for bit.

use super::*;
use crate::WATCHED_NODES;

/// A block's nodes of one run, two layers around them, and padding before.
struct Cutout {
    /// Numbers in the block; `None` for padding.
    nodes: Vec<Option<usize>>,
    /// Local number of the first node of the run.
    first: usize,
    /// Nodes of the second layer, whose rows are cut off.
    outer: Vec<usize>,
}

fn cutout(block: &Block) -> Cutout {
    let own = WATCHED_NODES..2 * WATCHED_NODES;
    let round = |nodes: &[usize], known: &[usize]| {
        let all = nodes.iter().flat_map(|&node| block.row(node));
        let mut all: Vec<usize> = all.map(|pair| block.indices[pair] as usize).collect();
        all.sort_unstable();
        all.dedup();
        all.retain(|node| !own.contains(node) && !known.contains(node));
        all
    };
    let mine: Vec<usize> = own.clone().collect();
    let inner = round(&mine, &[]);
    let outer = round(&inner, &inner);
    let mut all = [mine, inner, outer.clone()].concat();
    all.sort_unstable();
    let below = all.partition_point(|&node| node < own.start);
    let padding = below.next_multiple_of(WATCHED_NODES) - below;
    let nodes = std::iter::repeat_n(None, padding).chain(all.into_iter().map(Some));
    Cutout {
        nodes: nodes.collect(),
        first: padding + below,
        outer,
    }
}

/// Takes a body and its block to the model of the cutout.
fn part(block: &Block, whole: &Elastic, cutout: &Cutout, material: Material) -> Elastic {
    let local = |node: u32| {
        let mut nodes = cutout.nodes.iter();
        let found = nodes.position(|at| *at == Some(node as usize));
        found.and_then(|at| u32::try_from(at).ok())
    };
    let (mut offsets, mut indices, mut weights) = (vec![0_u32], Vec::new(), Vec::new());
    for node in &cutout.nodes {
        for pair in node.iter().flat_map(|&node| block.row(node)) {
            if let Some(other) = local(block.indices[pair]) {
                indices.push(other);
                weights.push(block.weights[pair]);
            }
        }
        offsets.push(u32::try_from(indices.len()).expect("a small block"));
    }
    let sound = |node: &usize| !cutout.outer.contains(node);
    let each = |node: &Option<usize>| node.filter(sound);
    let matrix = |node: &Option<usize>| each(node).map_or(DMat3::ZERO, |at| block.matrices[at]);
    let scale = |node: &Option<usize>| each(node).map_or(0.0, |at| block.scales[at]);
    let multiplier = |node: &Option<usize>| node.map_or(DVec3::ZERO, |at| block.multipliers[at]);
    let of = |list: &dyn Fn(&Option<usize>) -> DVec3| cutout.nodes.iter().map(list).collect();
    let rest: Vec<DVec3> = of(&|node| node.map_or(DVec3::ZERO, |at| block.positions[at]));
    let volumes: Vec<f64> = (cutout.nodes.iter())
        .map(|node| node.map_or(1.0, |at| block.volumes[at]))
        .collect();
    let matrices: Vec<DMat3> = cutout.nodes.iter().map(matrix).collect();
    let scales: Vec<f64> = cutout.nodes.iter().map(scale).collect();
    let multipliers: Vec<DVec3> = of(&multiplier);
    let stencils = Stencils {
        offsets: &offsets,
        indices: &indices,
        weights: &weights,
        matrices: &matrices,
        scales: &scales,
        multipliers: &multipliers,
    };
    Elastic::in_frame(
        &whole.frame(),
        &stencils,
        &Nodes::new(&rest, &volumes),
        &Materials::Uniform(material),
        whole.settings(),
    )
    .expect("rows are valid or empty")
}

#[test]
fn a_part_in_the_frame_of_the_whole_has_its_bits() {
    let block = Block::new([12, 8, 8], DVec3::new(1.2, 0.8, 0.8), 0.2, 5);
    let cutout = cutout(&block);
    assert!(cutout.outer.len() > 50 && cutout.nodes.len() < block.positions.len() + WATCHED_NODES);
    let material = Material::stable_neo_hookean(1000.0, 0.4);

    let mut whole = model(&block, material, 0.1);
    let mut part = part(&block, &whole, &cutout, material);
    let x = shaken(&block, 0.02, 3);
    let (_, forces) = evaluated(&mut whole, &x);
    let place = |at: &Option<usize>| at.map_or(DVec3::ZERO, |at| x[at]);
    let places: Vec<DVec3> = cutout.nodes.iter().map(place).collect();
    let (_, found) = evaluated(&mut part, &places);
    let (own, run) = (cutout.first, cutout.first / WATCHED_NODES);
    let expected = &forces[WATCHED_NODES..2 * WATCHED_NODES];
    assert_eq!(&found[own..own + WATCHED_NODES], expected, "the forces");
    let energies = [part.run_energies()[run], whole.run_energies()[1]];
    assert_eq!(energies[0].to_bits(), energies[1].to_bits(), "the forces");
}

#[test]
fn energies_of_runs_and_bonds_are_the_energy() {
    let block = Block::new([12, 8, 8], DVec3::new(1.2, 0.8, 0.8), 0.2, 5);
    let mut body = model(&block, Material::stable_neo_hookean(1000.0, 0.4), 0.1);
    let x = shaken(&block, 0.02, 3);
    evaluated(&mut body, &x);
    body.weaken(&[40, 400], &x, &|_| 1.0);
    let (energy, _) = evaluated(&mut body, &shaken(&block, 0.02, 4));
    let runs: f64 = body.run_energies().iter().sum();
    let bonds = body.bond_energies();
    let of_bonds = bonds.iter().fold(0.0, |sum, (_, energy)| sum + energy);
    assert!(of_bonds > 0.0 && bonds.iter().all(|(node, _)| [40, 400].contains(node)));
    assert_eq!((runs + of_bonds).to_bits(), energy.to_bits());
}
