//! The model that the examples measure.

use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings, Stencils};
use testkit::block::Block;

/// A neo-Hookean block, E 10 kPa, nu 0.4, with the default control.
pub(crate) fn body(block: &Block) -> Elastic {
    let stencils = Stencils {
        offsets: &block.offsets,
        indices: &block.indices,
        weights: &block.weights,
        matrices: &block.matrices,
        scales: &block.scales,
        multipliers: &block.multipliers,
    };
    let nodes = Nodes {
        rest_positions: &block.positions,
        volumes: &block.volumes,
    };
    let material = Materials::Uniform(Material::neo_hookean(1e4, 0.4));
    Elastic::new(&stencils, &nodes, &material, &Settings::default()).expect("valid")
}
