//! From points to a hanging, cut and settled body with the leaves alone.

use phyxel_discretize::{SampleSettings, Shape, Solid, Target, sample_tetrahedra, tetrahedra_edges};
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings, Stencils, glam::DVec3};
use phyxel_enrich::{CutSettings, Cuts, FactorSettings, Graph, PairFactors};
use phyxel_integrate::{Law, NewtonSettings, SolveError, StaticLoad, Supports, solve_static};
use phyxel_mls::{ConservativeSettings, ConservativeStencils, Neighborhoods, inverse_square_weights};

/// The stencils of one crate as the other reads them.
fn rows<'a>(graph: &'a Neighborhoods, stencils: &'a ConservativeStencils) -> Stencils<'a> {
    Stencils {
        offsets: graph.offsets(),
        indices: graph.indices(),
        weights: &stencils.weights,
        matrices: &stencils.matrices,
        scales: &stencils.scales,
        multipliers: &stencils.multipliers,
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Nodes of a block of 4 x 4 x 8 cm, who is coupled with whom, and gradient stencils.
    let block = Solid::from(Shape::Box { half_extents: DVec3::new(0.02, 0.02, 0.04) });
    let settings = SampleSettings { target: Target::NodeCount(1000), ..Default::default() };
    let nodes = sample_tetrahedra(&block, &settings)?;
    let (x, volumes) = (&nodes.positions, &nodes.volumes);
    let (offsets, indices) = tetrahedra_edges(x.len(), &nodes.tetrahedra);
    let graph = Neighborhoods::from_graph(offsets, indices)?;
    let weights = inverse_square_weights(x, &graph);
    let b = &nodes.boundary_vectors;
    let settings = ConservativeSettings::for_cutting();
    let mut stencils = ConservativeStencils::new(x, volumes, b, &graph, weights, &settings)?.converged()?;

    // A soft material of 1000 kg/m^3, held at the top, under its weight.
    let material = Materials::Uniform(Material::neo_hookean(2e4, 0.4));
    let mut body = Elastic::new(&rows(&graph, &stencils), &Nodes { rest_positions: x, volumes }, &material, &Settings::default())?;
    let top: Vec<u32> = (0..).zip(x).filter(|(_, x)| x.z > 0.0399).map(|(node, _)| node).collect();
    let supports = Supports::fixed(x.len(), &top);
    let forces: Vec<DVec3> = volumes.iter().map(|v| DVec3::Z * (-9.81e3 * v)).collect();
    let mut at = x.clone();
    let mut settle = |body: &mut Elastic| -> Result<f64, SolveError> {
        let mut law = Law::of(body, Elastic::forces_into, Elastic::tangent_product_into);
        let load = StaticLoad { forces: &forces, ..StaticLoad::default() };
        solve_static(&mut law, &mut at, &supports, &load, &NewtonSettings::default())?;
        Ok(at.iter().map(|x| x.z).fold(0.0, f64::min))
    };
    let hung = settle(&mut body)?;

    // A blade goes half through from the side; touched rows follow, and the body sags on.
    let pairs = Graph::new(x, graph.offsets(), graph.indices())?;
    let mut factors = PairFactors::new(&pairs, &FactorSettings::default());
    let mut cuts = Cuts::new(&CutSettings::for_spacing(0.005));
    let blade = |x: f64| [-0.03, 0.03].map(|y| DVec3::new(x, y, 0.0013));
    let stroke = cuts.start(&blade(-0.03))?;
    let new = cuts.append(stroke, &blade(0.0))?;
    let touched = factors.update(&pairs, &cuts, new, &|x| block.contains(x)).nodes;
    stencils.update_rows(x, &graph, |pair| factors.factor(pair), &touched)?;
    body.update_rows(&touched, &rows(&graph, &stencils))?;
    let cut = settle(&mut body)?;

    // A slender bar would hang down by rho g L^2 / 2 E = 1.57 mm.
    println!("{} nodes: hangs {:.2} mm, cut {:.2} mm", x.len(), -1e3 * (hung + 0.04), -1e3 * (cut + 0.04));
    assert!((-hung - 0.04 - 1.5e-3).abs() < 0.2e-3 && cut < hung - 0.2e-3);
    Ok(())
}
