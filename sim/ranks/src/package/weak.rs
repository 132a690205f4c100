//! What cuts and corners leave in a rank's model beside its rows: deficient nodes and offsets of deformation gradients.

use glam::DVec3;
use phyxel::Body;
use phyxel_elastic::Elastic;
use serde::{Deserialize, Serialize};

use super::locals::Locals;

/// A deficient node.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Weak {
    node: u32,
    /// What cuts left of each of its pairs.
    shares: Vec<f64>,
    /// Offsets (m) of its bonds.
    offsets: Vec<f64>,
}

/// Weak ones of a rank's nodes, of some.
pub(super) fn weak_nodes(body: &Body, locals: &Locals, some: impl Fn(u32) -> bool) -> Vec<Weak> {
    let (_, bonds) = body.elastic().energies();
    let offsets = body.elastic().state().bonds;
    let mut weak = Vec::new();
    for &node in body
        .elastic()
        .deficient_nodes()
        .iter()
        .filter(|node| some(**node))
    {
        if let Some(local) = locals.whole(node) {
            let from = bonds.partition_point(|(of, _)| *of < node);
            let to = bonds.partition_point(|(of, _)| *of <= node);
            let pairs = body.neighborhoods.pairs(node as usize);
            weak.push(Weak {
                node: local,
                shares: pairs.map(|pair| body.factor(pair)).collect(),
                offsets: offsets[from..to].to_vec(),
            });
        }
    }
    weak
}

/// Takes the strain energy from deficient nodes of a rank's model.
pub(super) fn weaken(elastic: &mut Elastic, rest: &[DVec3], weak: &[Weak]) {
    if weak.is_empty() {
        return;
    }
    let nodes: Vec<u32> = weak.iter().map(|weak| weak.node).collect();
    let starts: Vec<usize> = nodes
        .iter()
        .map(|&node| elastic.pairs_of(node).start)
        .collect();
    let share = |pair: usize| {
        // Pairs are only asked for of these nodes.
        let at = starts.partition_point(|start| *start <= pair) - 1;
        weak[at]
            .shares
            .get(pair - starts[at])
            .copied()
            .unwrap_or(0.0)
    };
    elastic.weaken(&nodes, rest, &share);
    let (_, bonds) = elastic.energies();
    let mut state = elastic.state();
    for weak in weak {
        let from = bonds.partition_point(|(of, _)| *of < weak.node);
        let to = state.bonds.iter_mut().skip(from);
        for (to, offset) in to.zip(&weak.offsets) {
            *to = *offset;
        }
    }
    elastic.set_state(&state);
}
