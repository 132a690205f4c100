//! Energy of a neo-Hookean block of 1,331 nodes that is stretched evenly, beside its closed form `V W(F)`, and the
//! largest force on a node inside, which is zero in the continuum.
//! `cargo run --release --example stretch`
#![allow(clippy::print_stdout, reason = "prints a table")]

use phyxel_elastic::glam::{DMat3, DVec3};
use phyxel_elastic::{Elastic, ElasticError, Material, Materials, Nodes, Settings, Stencils};

/// Nodes along each edge, and their distance (m).
const N: u32 = 11;
const H: f64 = 0.01;

fn main() -> Result<(), ElasticError> {
    let cell = |i: u32| [i % N, i / N % N, i / (N * N)];
    let x: Vec<DVec3> = (0..N * N * N)
        .map(|i| DVec3::from_array(cell(i).map(f64::from)) * H)
        .collect();
    // Neighbours: the up to 26 nodes around, with weight 1; B is the inverse of the moment matrix.
    let (mut offsets, mut indices, mut matrices) = (vec![0], Vec::new(), Vec::new());
    for i in 0..N * N * N {
        let near =
            |&j: &u32| j != i && (0..3).all(|axis| cell(i)[axis].abs_diff(cell(j)[axis]) < 2);
        let row: Vec<u32> = (0..N * N * N).filter(near).collect();
        let outer = |d: DVec3| DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        let moment = |sum, &j: &u32| sum + outer(x[j as usize] - x[i as usize]);
        matrices.push(row.iter().fold(DMat3::ZERO, moment).inverse());
        indices.extend(row);
        offsets.push(u32::try_from(indices.len()).expect("few pairs"));
    }
    let weights = vec![1.0; indices.len()];
    let volumes = vec![H.powi(3); x.len()];
    let stencils = Stencils::plain(&offsets, &indices, &weights, &matrices);
    let soft = Materials::Uniform(Material::neo_hookean(1e4, 0.4));
    let nodes = Nodes::new(&x, &volumes);
    let mut body = Elastic::new(&stencils, &nodes, &soft, &Settings::default())?;

    let (mu, lambda) = (1e4 / 2.8, 4e3 / (1.4 * 0.2));
    let volume: f64 = volumes.iter().sum();
    println!("stretch  energy, J  closed form, J  largest force inside, N");
    for stretch in [0.8, 0.9, 1.1, 1.5, 2.0_f64] {
        let moved: Vec<DVec3> = x
            .iter()
            .map(|x| *x * DVec3::new(stretch, 1.0, 1.0))
            .collect();
        let mut forces = vec![DVec3::ZERO; x.len()];
        let energy = body.forces_into(&moved, &mut forces);
        let log = stretch.ln();
        let density = mu / 2.0 * (stretch * stretch - 1.0) - mu * log + lambda / 2.0 * log * log;
        // Two layers from the surface all rows are alike.
        let inside = (0..N * N * N).filter(|&i| cell(i).iter().all(|c| (2..N - 2).contains(c)));
        let force = inside
            .map(|i| forces[i as usize].length())
            .fold(0.0, f64::max);
        println!(
            "{stretch:7}  {energy:9.6}  {:14.6}  {force:23.1e}",
            volume * density
        );
    }
    Ok(())
}
