//! From points to a hanging, cut and settled body with the crates below the world.

use phyxel_discretize::{Primitive, SampleSettings, Solid, sample_tetrahedra, tetrahedra_edges};
use phyxel_elastic::{
    CutInput, CutPolicy, Elastic, Material, Materials, Nodes, Settings, Stencils, glam::DVec3,
};
use phyxel_enrich::{CutSettings, Cuts, FactorSettings, Graph, PairFactors};
use phyxel_integrate::{
    BoundaryConditions, ClosureLaw, NewtonSettings, SolveError, StaticLoad, solve_static,
};
use phyxel_mls::{ConservativeSettings, GradientStencils, Neighborhoods, inverse_square_weights};

/// The stencils of one crate as the other reads them.
fn rows<'a>(graph: &'a Neighborhoods, stencils: &'a GradientStencils) -> Stencils<'a> {
    let (weights, matrices) = (&stencils.weights, &stencils.matrices);
    Stencils::plain(graph.offsets(), graph.indices(), weights, matrices)
        .with_multipliers(&stencils.scales, &stencils.multipliers)
}

/// Lets a body come to rest under a load; how far (mm) its lowest node is below the origin then.
fn settle(
    body: &mut Elastic,
    at: &mut [DVec3],
    supports: &BoundaryConditions,
    load: &[DVec3],
) -> Result<f64, SolveError> {
    let mut law = ClosureLaw::of(body, Elastic::forces_into, Elastic::tangent_product_into);
    let (load, settings) = (StaticLoad::of(load), NewtonSettings::default());
    solve_static(&mut law, at, supports, &load, &settings)?;
    Ok(at.iter().fold(0.0, |low, x| x.z.min(low)) * -1e3)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Nodes of a block of 4 x 4 x 8 cm, who is coupled with whom, and gradient stencils.
    let half_extents = DVec3::new(0.02, 0.02, 0.04);
    let block = Solid::from(Primitive::Box { half_extents });
    let nodes = sample_tetrahedra(&block, &SampleSettings::nodes(1000))?;
    let (x, volumes, b) = (&nodes.positions, &nodes.volumes, &nodes.boundary_vectors);
    let (offsets, indices) = tetrahedra_edges(x.len(), &nodes.tetrahedra);
    let graph = Neighborhoods::from_graph(offsets, indices)?;
    let w = inverse_square_weights(x, &graph);
    let settings = ConservativeSettings::for_cutting();
    let stencils = GradientStencils::conservative(x, volumes, b, &graph, w, &settings)?;
    let mut stencils = stencils.converged()?;

    // A soft material of 1000 kg/m^3, held at the top, under its weight.
    let soft = Materials::Uniform(Material::neo_hookean(2e4, 0.4));
    let (rest, settings) = (Nodes::new(x, volumes), Settings::default());
    let mut body = Elastic::new(&rows(&graph, &stencils), &rest, &soft, &settings)?;
    let top = BoundaryConditions::fixed_where(x, |x| x.z > 0.0399);
    let weight: Vec<DVec3> = volumes.iter().map(|v| DVec3::Z * (-9.81e3 * v)).collect();
    let mut at = x.clone();
    let hung = settle(&mut body, &mut at, &top, &weight)?;

    // A blade goes half through from the side; touched rows follow, and the body sags on.
    let pairs = Graph::new(x, graph.offsets(), graph.indices())?;
    let mut factors = PairFactors::new(&pairs, &FactorSettings::default());
    let mut cuts = Cuts::new(&CutSettings::for_spacing(0.005));
    let blade = |x: f64| [-0.03, 0.03].map(|y| DVec3::new(x, y, 0.0013));
    let stroke = cuts.start(&blade(-0.03))?;
    let new = cuts.append(stroke, &blade(0.0))?;
    let touched = factors.update(&pairs, &cuts, new, &|x| block.contains(x));
    let factor = |pair| factors.factor(pair);
    stencils.update_rows(x, &graph, factor, &touched)?;
    let front = |&node: &u32| factors.front_matrix(&pairs, node as usize);
    let fronts: Vec<_> = touched.iter().map(front).collect();
    let energy = body.apply_cut(
        &CutInput {
            touched: &touched,
            stencils: &rows(&graph, &stencils),
            left: &factor,
            fronts: &fronts,
            positions: &at,
        },
        &CutPolicy::default(),
    )?;
    assert!(energy.total() <= 0.0);
    // What the cut retained of strains decays; a body in motion takes a step in between.
    for _ in 0..20 {
        body.decay(0.5, &x);
    }
    let cut = settle(&mut body, &mut at, &top, &weight)?;

    // A slender bar would hang down by rho g L^2 / 2 E = 1.57 mm.
    println!("hangs {:.2} mm, cut {:.2} mm", hung - 40.0, cut - 40.0);
    assert!((hung - 41.57).abs() < 0.1 && (cut - hung - 3.7).abs() < 0.4);
    Ok(())
}
