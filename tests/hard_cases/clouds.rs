//! Hard cases that no sampled body has: clouds given as they are, to the six crates.

use glam::{DMat3, DQuat, DVec3};
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings, Stencils};
use phyxel_mls::{GradientStencils, Neighborhoods, inverse_square_weights};

/// 10 kPa on a cubic millimetre (J) and on a square one (N).
const WORK: f64 = 1e4 * 1e-9;
const PUSH: f64 = 1e4 * 1e-6;

struct Cloud {
    points: Vec<DVec3>,
    stencils: GradientStencils,
    model: Elastic,
}

impl Cloud {
    /// Every node the neighbour of every other, with a cubic millimetre each.
    fn new(points: Vec<DVec3>) -> Self {
        let count = u32::try_from(points.len()).expect("a few points");
        let offsets = (0..=count).map(|k| k * (count - 1)).collect();
        let others = |i: u32| (0..count).filter(move |&j| j != i);
        let graph = Neighborhoods::from_graph(offsets, (0..count).flat_map(others).collect());
        let graph = graph.expect("it is a graph");
        let weights = inverse_square_weights(&points, &graph);
        let stencils =
            GradientStencils::plain(&points, &graph, weights, 1e-3).expect("it is finite");
        let model = Elastic::new(
            &Stencils {
                offsets: graph.offsets(),
                indices: graph.indices(),
                weights: &stencils.weights,
                matrices: &stencils.matrices,
                scales: &[],
                multipliers: &[],
            },
            &Nodes {
                rest_positions: &points,
                volumes: &vec![1e-9; points.len()],
            },
            &Materials::Uniform(Material::neo_hookean(1e4, 0.4)),
            &Settings::default(),
        );
        Self {
            model: model.expect("every cloud has a model"),
            stencils,
            points,
        }
    }

    fn has_rank(&self, rank: u8) {
        let found: Vec<u8> = self.stencils.ranks.iter().map(|r| r.rank).collect();
        assert!(
            found.iter().all(|&r| r == rank),
            "ranks {found:?}, not {rank}"
        );
    }

    /// Energy (J) and largest force (N) after a map of space.
    fn after(&mut self, map: impl Fn(DVec3) -> DVec3) -> (f64, f64) {
        let moved: Vec<DVec3> = self.points.iter().map(|&x| map(x)).collect();
        let mut forces = vec![DVec3::ZERO; moved.len()];
        let energy = self.model.forces_into(&moved, &mut forces);
        let sum: DVec3 = forces.iter().sum();
        let size: f64 = forces.iter().map(|f| f.length()).sum();
        assert!(
            energy.is_finite() && size.is_finite(),
            "{energy} J, {size} N"
        );
        assert!(
            sum.length() <= 1e-12 * (size + PUSH),
            "forces sum to {sum} of {size} N"
        );
        (
            energy,
            forces.iter().map(|f| f.length()).fold(0.0, f64::max),
        )
    }

    /// No energy and no force in a turned and shifted cloud; `stretched` of both where it is strained
    /// by a tenth along `axis`.
    fn is_sound(&mut self, axis: DVec3, stretched: bool) {
        let turn = DQuat::from_scaled_axis(DVec3::new(0.7, -1.9, 0.4));
        let (energy, force) = self.after(|x| turn * x + DVec3::new(3.0, -2.0, 5.0));
        assert!(
            energy < 1e-12 * WORK && force < 1e-11 * PUSH,
            "turned: {energy} J, {force} N"
        );
        let strain = DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z) * 0.1;
        let (energy, force) = self.after(|x| x + strain * x);
        if stretched {
            assert!(
                energy > 1e-4 * WORK && force > 1e-4 * PUSH,
                "{energy} J, {force} N"
            );
        } else {
            assert!(
                energy < 1e-12 * WORK && force < 1e-11 * PUSH,
                "{energy} J, {force} N"
            );
        }
    }
}

fn grid(counts: [u32; 3]) -> Vec<DVec3> {
    let mut points = Vec::new();
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            for k in 0..counts[2] {
                points.push(DVec3::new(f64::from(i), f64::from(j), f64::from(k)) * 1e-3);
            }
        }
    }
    points
}

#[test]
fn a_coplanar_cloud_resists_in_its_plane_alone() {
    let turn = DQuat::from_scaled_axis(DVec3::new(0.3, 0.5, -0.2));
    let points = grid([4, 4, 1]).into_iter().map(|x| turn * x).collect();
    let mut cloud = Cloud::new(points);
    cloud.has_rank(2);
    cloud.is_sound(turn * DVec3::X, true);
    cloud.is_sound(turn * DVec3::Z, false);
}

#[test]
fn a_collinear_cloud_resists_along_its_line_alone() {
    let line = DVec3::new(1.0, 2.0, -2.0) / 3.0;
    let mut cloud = Cloud::new((0..6).map(|k| line * (1e-3 * f64::from(k))).collect());
    cloud.has_rank(1);
    cloud.is_sound(line, true);
    cloud.is_sound(line.any_orthonormal_vector(), false);
}

#[test]
fn one_node_has_neither_strain_nor_force() {
    let mut cloud = Cloud::new(vec![DVec3::new(0.1, 0.2, 0.3)]);
    cloud.has_rank(0);
    cloud.is_sound(DVec3::X, false);
}

/// Two nodes at one position carry no direction to each other; all others see both.
#[test]
fn duplicated_nodes_take_part_and_do_not_break_the_cloud() {
    let mut points = grid([3, 3, 3]);
    points.extend_from_within(10..14);
    let mut cloud = Cloud::new(points);
    cloud.has_rank(3);
    cloud.is_sound(DVec3::new(0.6, 0.0, 0.8), true);
    // All at one position: nothing that gives directions, and nothing that resists.
    let mut heap = Cloud::new(vec![DVec3::ONE; 5]);
    heap.has_rank(0);
    heap.is_sound(DVec3::Y, false);
}
