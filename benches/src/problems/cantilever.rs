//! Bodies to compare on one beam, and the error of the beam's tip, against quadratic finite elements.

use glam::DVec3;
use phyxel_elastic::{Elastic, Material, Settings};
use phyxel_integrate::{BoundaryConditions, ForceLaw, NewtonSettings, StaticLoad, solve_static};

use super::block::Block;
use super::solid::Solid;

/// What linear tetrahedra are of beside bodies of unit stiffness.
pub const UNIT: Solid = Solid {
    youngs_modulus: 1.0,
    poissons_ratio: 0.3,
    density: 1.0,
};

/// Whether a coordinate lies on a face of the box.
pub fn on(coordinate: f64, face: f64) -> bool {
    (coordinate - face).abs() < 1e-12
}

/// Whether a point lies on the surface of the unit cube.
pub fn on_cube(x: DVec3) -> bool {
    on(x.min_element(), 0.0) || on(x.max_element(), 1.0)
}

/// A body of the block's stencils.
///
/// # Panics
/// If the model does not take them.
pub fn body(block: &Block, material: Material, settings: &Settings) -> Elastic {
    let elastic = block.elastic(&block.stencils, material, settings);
    elastic.expect("valid rows")
}

/// Moves `x` (m) to rest under dead loads (N; none if empty), to a tolerance of [`NewtonSettings`].
///
/// # Panics
/// If no equilibrium is found.
pub fn settle(
    law: &mut dyn ForceLaw,
    x: &mut [DVec3],
    supports: &BoundaryConditions,
    load: &[DVec3],
    tolerance: f64,
) {
    let settings = NewtonSettings {
        tolerance,
        linear_iterations: 20 * x.len(),
        ..NewtonSettings::default()
    };
    solve_static(law, x, supports, &StaticLoad::of(load), &settings).expect("an equilibrium");
}

/// The beam: 1 m long, 0.2 m high and wide.
pub fn beam(cells: [usize; 3], jitter: f64) -> Block {
    Block::jittered(cells, DVec3::new(1.0, 0.2, 0.2), jitter, 4)
}

/// Clamp at x = 0, a total force `pull` spread over the face x = 1: mean displacement (m) of that face.
///
/// # Panics
/// If no equilibrium is found.
pub fn cantilever(block: &Block, pull: DVec3, tolerance: f64, law: &mut dyn ForceLaw) -> DVec3 {
    // Area of the face that belongs to each node.
    let tip = block.traction(|x| on(x.x, 1.0), DVec3::X);
    let tip: Vec<f64> = tip.iter().map(|area| area.x).collect();
    let total: f64 = tip.iter().sum();
    let load: Vec<DVec3> = tip.iter().map(|a| pull * (*a / total)).collect();
    let (rest, mut x) = (&block.rest, block.rest.clone());
    let clamp = BoundaryConditions::fixed_where(rest, |x| on(x.x, 0.0));
    settle(law, &mut x, &clamp, &load, tolerance);
    let moved = x.iter().zip(rest).zip(&tip);
    moved
        .map(|((x, rest), a)| (*x - *rest) * (*a / total))
        .sum()
}

/// Error in per cent of the small-strain tip deflection; references: hex27 finite elements, three
/// meshes extrapolated (tolerances 0.05, 0.15 and 0.5 %).
///
/// # Panics
/// If no equilibrium is found.
pub fn tip_error(block: &Block, nu: f64, tolerance: f64, law: &mut dyn ForceLaw) -> f64 {
    let reference = if nu < 0.4 {
        2544.2
    } else if nu < 0.47 {
        2506.8
    } else {
        2486.7
    };
    let pull = 1e-7;
    let tip = cantilever(block, DVec3::new(0.0, 0.0, -pull), tolerance, law);
    100.0 * (-tip.z / pull / reference - 1.0)
}
