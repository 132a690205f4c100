//! Cantilevers.

use glam::{DMat3, DVec3};
use phyxel_discretize::{Bounds, Mesh, SampleSettings, Solid, sample_tetrahedra};
use phyxel_elastic::{Dilatation, Material, Settings};
use phyxel_integrate::{BoundaryConditions, ForceLaw};
use testkit::cloud::BOX_FACES;

use super::Proof;
use crate::problems::block::Block;
use crate::problems::cantilever::{self as beams, UNIT, beam, body, on_cube, settle, tip_error};
use crate::problems::lanes::Lanes;
use crate::problems::model::{dissertation, law};

pub(super) fn cantilever(proof: &mut Proof) {
    let tip = |block: &Block, settings: &Settings, nu: f64| {
        let mut elastic = body(block, Material::neo_hookean(1.0, nu), settings);
        tip_error(block, nu, 1e-6, &mut law(&mut elastic))
    };
    for (name, cells, jitter, bar) in [
        ("lattice 525", [20, 4, 4], 0.0, 3.0),
        ("jittered 525", [20, 4, 4], 0.25, 3.0),
        ("lattice 1519", [30, 6, 6], 0.0, 1.5),
    ] {
        let block = beam(cells, jitter);
        for (nu, bar) in [(0.3, bar), (0.45, bar), (0.499, 5.0)] {
            let error = tip(&block, &Settings::default(), nu).abs();
            proof.below(format!("tip of {name}, nu {nu}, %"), error, bar);
        }
        if cells[0] > 20 {
            continue;
        }
        let mean = Settings {
            dilatation: Dilatation::Mean,
            ..Settings::default()
        };
        let error = tip(&block, &mean, 0.499).abs();
        proof.below("mean dilatation at .499", error, 5.0);
        // Measured: -69 and -64; -14 and -17. Far off is what they are, by how much is not the subject.
        let svk = Material::saint_venant_kirchhoff(1.0, 0.3);
        let (mut model, _) = dissertation(&block.rest, svk, 1.0).unwrap();
        let paper = tip_error(&block, 0.3, 1e-6, &mut law(&mut model));
        proof.below("dissertation's model, %", paper, -50.0);
        let mut tetrahedra = Lanes::tetrahedra(&block.rest, &block.tetrahedra, UNIT);
        let linear = tip_error(&block, 0.3, 1e-6, &mut tetrahedra);
        proof.below("linear tetrahedra, %", linear, -10.0);
    }
    let slant = DVec3::new(1.0, 2.0, 3.0).normalize();
    for degrees in [17.0, 45.0] {
        let angle = f64::to_radians(degrees);
        for (axis, turn) in [
            ("y", DMat3::from_rotation_y(angle)),
            ("a slant", DMat3::from_axis_angle(slant, angle)),
        ] {
            for (cells, nu, bar) in [
                (5.0, 0.3, 4.0),
                (5.0, 0.45, 4.0),
                (8.0, 0.3, 2.5),
                (8.0, 0.45, 2.5),
                (12.0, 0.3, 1.5),
            ] {
                let error = turned_error(turn, cells, nu).abs();
                let what = format!(
                    "bending of a mesh turned by {degrees} about {axis}, {cells} cells, nu {nu}, %"
                );
                proof.below(what, error, bar);
            }
        }
    }
}

/// A beam given as a mesh, turned to the axes, `cells` over its depth: error in per cent of its stiffness in pure bending, by the energy
/// where a tenth at either end is bent as it should.
fn turned_error(turn: DMat3, cells: f64, nu: f64) -> f64 {
    let size = DVec3::new(1.0, 0.2, 0.2);
    let corners = Bounds::new(DVec3::ZERO, size).corners();
    let mesh = Mesh {
        vertices: corners.map(|v| turn * v).to_vec(),
        triangles: BOX_FACES
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
    };
    // Edges of a body-centred lattice: three of one cell for four of half its diagonal.
    let edge = (3.0 + 4.0 * 0.75_f64.sqrt()) / 7.0;
    let settings = SampleSettings::spacing(size.z / cells * edge);
    let found = sample_tetrahedra(&Solid::from_mesh(mesh), &settings).unwrap();
    let block = Block::sampled(found).unwrap();
    let small = 1e-4;
    let (ends, middle) = (0.1..=0.9, 0.5 * size);
    let local: Vec<DVec3> = block.rest.iter().map(|x| turn.transpose() * *x).collect();
    let bent = local.iter().zip(&block.rest);
    let bent = bent.map(|(x, rest)| *rest + turn * pure_bending(*x - middle, nu) * small);
    let mut x: Vec<DVec3> = bent.collect();
    let held =
        BoundaryConditions::fixed_where(&block.rest, |x| !ends.contains(&(turn.transpose() * x).x));
    let mut elastic = body(&block, Material::neo_hookean(1.0, nu), &Settings::default());
    let mut law = law(&mut elastic);
    settle(&mut law, &mut x, &held, &[], 1e-7);
    let energy = law.forces_into(&x, &mut vec![DVec3::ZERO; x.len()]);
    let exact = 0.5 * size.x * size.y * size.z.powi(3) / 12.0 * small * small;
    100.0 * (energy / exact - 1.0)
}

/// Pure bending with a curvature of 1, an exact solution of small-strain elasticity.
fn pure_bending(x: DVec3, nu: f64) -> DVec3 {
    DVec3::new(
        x.x * x.z,
        -nu * x.y * x.z,
        -0.5 * (x.x * x.x + nu * (x.z * x.z - x.y * x.y)),
    )
}

/// Dead tip load 2.5e-4, neo-Hookean, nu 0.3; reference: hex27, two meshes (0.2 %).
pub(super) fn large_deflection(proof: &mut Proof) {
    for (name, jitter) in [("lattice", 0.0), ("jittered", 0.25)] {
        let block = beam([20, 4, 4], jitter);
        let neo = Material::neo_hookean(1.0, 0.3);
        let mut elastic = body(&block, neo, &Settings::default());
        let pull = DVec3::new(0.0, 0.0, -2.5e-4);
        let tip = beams::cantilever(&block, pull, 1e-8, &mut law(&mut elastic));
        let (ex, ez) = (tip.x / -0.1493 - 1.0, tip.z / -0.4893 - 1.0);
        proof.below(format!("u_x of the {name}"), ex.abs(), 0.025);
        proof.below(format!("u_z of the {name}"), ez.abs(), 0.01);
    }
}

/// Pure bending, prescribed all around.
pub(super) fn bending(proof: &mut Proof) {
    let nu = 0.3;
    let exact = |x: DVec3| pure_bending(x, nu);
    // Measured: 2.03 and 1.63.
    for (jitter, bar) in [(0.0, 1.9), (0.25, 1.5)] {
        let mut errors = Vec::new();
        for cells in [4, 8, 12] {
            let block = Block::jittered([cells; 3], DVec3::ONE, jitter, 5);
            let mut elastic = body(&block, Material::neo_hookean(1.0, nu), &Settings::default());
            let small = 1e-5;
            let rest = &block.rest;
            let held = BoundaryConditions::fixed_where(rest, on_cube);
            let shift = |x: DVec3| exact(x) * if on_cube(x) { small } else { 0.0 };
            let mut x: Vec<DVec3> = rest.iter().map(|x| *x + shift(*x)).collect();
            settle(&mut law(&mut elastic), &mut x, &held, &[], 1e-8);
            errors.push(block.norm(&x, |x, rest| (x - rest) / small - exact(rest)));
        }
        let order = (errors[0] / errors[2]).ln() / 3.0_f64.ln();
        proof.above(format!("order, jitter {jitter}"), order, bar);
    }
}

/// How much the one coefficient of hourglass stabilization matters: tip deflection of the jittered beam.
pub(super) fn control(proof: &mut Proof) {
    let block = beam([20, 4, 4], 0.25);
    let mut before = f64::INFINITY;
    for alpha in [0.02, 0.05, 0.1, 0.2, 0.5] {
        let settings = Settings {
            stabilization: alpha,
            ..Settings::default()
        };
        let mut elastic = body(&block, Material::neo_hookean(1.0, 0.3), &settings);
        let error = tip_error(&block, 0.3, 1e-6, &mut law(&mut elastic));
        proof.below(format!("tip, control {alpha}, %"), error, before);
        before = error;
        if (0.05..=0.2).contains(&alpha) {
            // Measured: 1.8, 1.4 and 0.6.
            proof.below(format!("tip, control {alpha}, %"), error.abs(), 2.0);
        }
    }
}
