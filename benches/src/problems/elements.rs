//! Finite elements to compare with: boxes of linear elasticity, of order 1 and 2, on lines along the axes.

use std::ops::Range;

use glam::{DMat3, DVec3};
use phyxel_discretize::boundary_triangles;
use phyxel_integrate::{BoundaryConditions, ForceLaw, NewtonSettings, StaticLoad, solve_static};
use rayon::prelude::*;

use super::block::lattice_on;
use super::solid::Solid;
use crate::StudyError;

/// Degree of an element's shape functions along each axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Trilinear, 8 nodes.
    Linear,
    /// Triquadratic, 27 nodes.
    Quadratic,
}

impl Order {
    fn degree(self) -> usize {
        match self {
            Self::Linear => 1,
            Self::Quadratic => 2,
        }
    }
}

/// Points and weights of Gauss's rule on -1..=1, exact to degree 5: enough for products of quadratics.
const GAUSS: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];

/// A box of linear elastic elements, fully integrated (Hughes 2000, The Finite Element Method, chapter 3).
///
/// Small strain: forces are `-K (x - X)` at any size of motion.
#[derive(Debug, Clone)]
pub struct Elements {
    /// Rest positions (m), along x first.
    pub rest: Vec<DVec3>,
    /// Surface triangles between the nodes, anticlockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    lines: [Vec<f64>; 3],
    order: Order,
    /// Nodes whose motion changes the force on a node, itself among them, ascending: rows in CSR.
    starts: Vec<usize>,
    indices: Vec<u32>,
    /// Blocks (N/m) of the stiffness, in the same order.
    blocks: Vec<DMat3>,
}

impl Elements {
    /// Elements between `lines` (m), ascending, on which the nodes lie along each axis; elements of order 2
    /// take two intervals each.
    ///
    /// # Panics
    /// If an axis has no interval, or an odd number of them for order 2.
    pub fn new(lines: [Vec<f64>; 3], order: Order, solid: Solid) -> Self {
        let degree = order.degree();
        let cells = lines.each_ref().map(|line| line.len() - 1);
        let whole = |cells: &usize| *cells > 0 && cells.is_multiple_of(degree);
        assert!(cells.iter().all(whole), "whole elements along each axis");
        let (rest, tetrahedra) = lattice_on(lines.each_ref().map(Vec::as_slice));
        let grid = Grid {
            counts: cells.map(|cells| cells + 1),
            degree,
        };
        let nodes = rest.len();
        let mut starts = vec![0];
        let mut indices = Vec::new();
        for node in 0..nodes {
            let [x, y, z] = grid.near(node);
            for k in z {
                for j in y.clone() {
                    for i in x.clone() {
                        indices.push(narrow(grid.index([i, j, k])));
                    }
                }
            }
            starts.push(indices.len());
        }
        let mut found = Self {
            rest,
            triangles: boundary_triangles(&tetrahedra, |_| true),
            blocks: vec![DMat3::ZERO; indices.len()],
            starts,
            indices,
            lines,
            order,
        };
        found.assemble(&grid, solid);
        found
    }

    /// A cube or box of as many intervals along each axis, from `low` to `high` (m).
    pub fn even(cells: [u32; 3], low: DVec3, high: DVec3, order: Order, solid: Solid) -> Self {
        let line = |axis: usize| {
            let part = |k: u32| f64::from(k) / f64::from(cells[axis]);
            let along = (0..=cells[axis]).map(part);
            along
                .map(|s| low[axis] + (high[axis] - low[axis]) * s)
                .collect()
        };
        Self::new([line(0), line(1), line(2)], order, solid)
    }

    /// Adds `∫ λ ∂_i N_a ∂_j N_b + μ ∂_j N_a ∂_i N_b + μ δ_ij ∇N_a·∇N_b` of every element.
    fn assemble(&mut self, grid: &Grid, solid: Solid) {
        let (mu, lambda) = solid.lame();
        let degree = grid.degree;
        let per_axis: [Vec<Integrals>; 3] = self.lines.each_ref().map(|line| {
            let firsts = (0..line.len() - 1).step_by(degree);
            firsts
                .map(|k| Integrals::of(&line[k..=k + degree]))
                .collect()
        });
        let local = degree + 1;
        for ez in 0..per_axis[2].len() {
            for ey in 0..per_axis[1].len() {
                for ex in 0..per_axis[0].len() {
                    let element = [ex, ey, ez];
                    let along: [&Integrals; 3] =
                        [0, 1, 2].map(|axis| &per_axis[axis][element[axis]]);
                    let corner = element.map(|e| e * degree);
                    let split = |a: usize| [a % local, a / local % local, a / local / local];
                    for a in 0..local.pow(3) {
                        let at = split(a);
                        let row = grid.index([0, 1, 2].map(|x| corner[x] + at[x]));
                        for b in 0..local.pow(3) {
                            let to = split(b);
                            // ∫ ∂_i N_a ∂_j N_b, a product over the axes.
                            let part = |i: usize, j: usize| {
                                let axis = |x: usize| along[x].with(at[x], to[x], x == i, x == j);
                                axis(0) * axis(1) * axis(2)
                            };
                            let rows =
                                [0, 1, 2].map(|j| DVec3::new(part(0, j), part(1, j), part(2, j)));
                            let g = DMat3::from_cols(rows[0], rows[1], rows[2]);
                            let trace = g.x_axis.x + g.y_axis.y + g.z_axis.z;
                            let block = g * lambda
                                + g.transpose() * mu
                                + DMat3::from_diagonal(DVec3::splat(mu * trace));
                            let slot = grid.slot(row, [0, 1, 2].map(|x| corner[x] + to[x]));
                            self.blocks[self.starts[row] + slot] += block;
                        }
                    }
                }
            }
        }
    }

    /// Integral (m) of each shape function along an axis.
    fn lengths(&self, axis: usize) -> Vec<f64> {
        let (line, degree) = (&self.lines[axis], self.order.degree());
        let mut lengths = vec![0.0; line.len()];
        for first in (0..line.len() - 1).step_by(degree) {
            let found = Integrals::of(&line[first..=first + degree]);
            for a in 0..=degree {
                let row = (0..=degree).map(|b| found.with(a, b, false, false));
                lengths[first + a] += row.sum::<f64>();
            }
        }
        lengths
    }

    /// Integral (m³) of each shape function: times a force per volume, the nodes' shares of it.
    pub fn volumes(&self) -> Vec<f64> {
        let [x, y, z] = [0, 1, 2].map(|axis| self.lengths(axis));
        let rows = z.iter().flat_map(|z| y.iter().map(move |y| y * z));
        rows.flat_map(|area| x.iter().map(move |x| x * area))
            .collect()
    }

    fn row(&self, node: usize) -> &[u32] {
        &self.indices[self.starts[node]..self.starts[node + 1]]
    }

    /// Displacements (m) at rest under forces (N).
    pub fn solve(
        &mut self,
        supports: &BoundaryConditions,
        forces: &[DVec3],
    ) -> Result<Vec<DVec3>, StudyError> {
        let mut x = self.rest.clone();
        supports.place(0.0, &mut x);
        let settings = NewtonSettings::with_tolerance(1e-10);
        solve_static(self, &mut x, supports, &StaticLoad::of(forces), &settings)?;
        Ok(displacements(&x, &self.rest))
    }

    /// The field of nodal `values` at a point (m) in the box, by the shape functions.
    pub fn field_at(&self, values: &[DVec3], point: DVec3) -> DVec3 {
        let degree = self.order.degree();
        let along = [0, 1, 2].map(|axis| {
            let line = &self.lines[axis];
            let last = (line.len() - 1) / degree - 1;
            let after = line.partition_point(|x| *x < point[axis]);
            let first = (after.saturating_sub(1) / degree).min(last) * degree;
            let shape = (0..=degree).map(|a| value(&line[first..=first + degree], a, point[axis]));
            (first, shape.collect::<Vec<f64>>())
        });
        let counts = self.lines.each_ref().map(Vec::len);
        let mut sum = DVec3::ZERO;
        for (k, z) in along[2].1.iter().enumerate() {
            for (j, y) in along[1].1.iter().enumerate() {
                for (i, x) in along[0].1.iter().enumerate() {
                    let [i, j, k] = [along[0].0 + i, along[1].0 + j, along[2].0 + k];
                    sum += values[i + counts[0] * (j + counts[1] * k)] * (x * y * z);
                }
            }
        }
        sum
    }
}

/// Displacements (m) from rest.
pub(crate) fn displacements(positions: &[DVec3], rest: &[DVec3]) -> Vec<DVec3> {
    let pairs = positions.iter().zip(rest);
    pairs.map(|(x, rest)| *x - *rest).collect()
}

/// Forces `-K u` (N) of a linear law at displacements `u` (m), and its energy `u K u / 2` (J).
pub(crate) fn linear_forces(law: &mut impl ForceLaw, moved: &[DVec3], forces: &mut [DVec3]) -> f64 {
    law.tangent_product_into(moved, forces);
    let mut energy = 0.0;
    for (force, u) in forces.iter_mut().zip(moved) {
        energy += 0.5 * force.dot(*u);
        *force = -*force;
    }
    energy
}

impl ForceLaw for Elements {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let moved = displacements(positions, &self.rest);
        linear_forces(self, &moved, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        product.par_iter_mut().enumerate().for_each(|(i, sum)| {
            let row = self.row(i).iter().zip(&self.blocks[self.starts[i]..]);
            *sum = row.map(|(j, block)| *block * vector[*j as usize]).sum();
        });
    }

    fn tangent_blocks_into(&mut self, blocks: &mut [DMat3]) -> bool {
        for (i, block) in blocks.iter_mut().enumerate() {
            let own = self.row(i).partition_point(|j| (*j as usize) < i);
            *block = self.blocks[self.starts[i] + own];
        }
        true
    }
}

/// Where nodes are in the lattice.
struct Grid {
    counts: [usize; 3],
    degree: usize,
}

impl Grid {
    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.counts[0] * (j + self.counts[1] * k)
    }

    /// Places along each axis of the nodes that share an element with a node.
    fn near(&self, node: usize) -> [Range<usize>; 3] {
        let [nx, ny, _] = self.counts;
        let at = [node % nx, node / nx % ny, node / nx / ny];
        [0, 1, 2].map(|axis| {
            let (at, last) = (at[axis], self.counts[axis] - 1);
            let begins = at.is_multiple_of(self.degree);
            let element = at / self.degree * self.degree;
            let low = if begins {
                at.saturating_sub(self.degree)
            } else {
                element
            };
            low..(element + self.degree).min(last) + 1
        })
    }

    /// Place of a node in the row of another.
    fn slot(&self, row: usize, to: [usize; 3]) -> usize {
        let [x, y, z] = self.near(row);
        let at = [to[0] - x.start, to[1] - y.start, to[2] - z.start];
        at[0] + x.len() * (at[1] + y.len() * at[2])
    }
}

/// Integrals over one interval of products of its shape functions and their slopes.
struct Integrals {
    /// `[a][b][slope of a][slope of b]`.
    of: [[[[f64; 2]; 2]; 3]; 3],
}

impl Integrals {
    fn of(nodes: &[f64]) -> Self {
        let mut of = [[[[0.0; 2]; 2]; 3]; 3];
        let half = 0.5 * (nodes[nodes.len() - 1] - nodes[0]);
        for (at, weight) in GAUSS {
            let x = nodes[0] + half * (1.0 + at);
            for (a, row) in of.iter_mut().enumerate().take(nodes.len()) {
                for (b, entry) in row.iter_mut().enumerate().take(nodes.len()) {
                    let left = [value(nodes, a, x), slope(nodes, a, x)];
                    let right = [value(nodes, b, x), slope(nodes, b, x)];
                    for (row, left) in entry.iter_mut().zip(left) {
                        for (sum, right) in row.iter_mut().zip(right) {
                            *sum += weight * half * left * right;
                        }
                    }
                }
            }
        }
        Self { of }
    }

    fn with(&self, a: usize, b: usize, slope_a: bool, slope_b: bool) -> f64 {
        self.of[a][b][usize::from(slope_a)][usize::from(slope_b)]
    }
}

/// Lagrange's polynomial that is 1 at `nodes[a]` and 0 at the others.
fn value(nodes: &[f64], a: usize, x: f64) -> f64 {
    let others = nodes.iter().enumerate().filter(|(b, _)| *b != a);
    others.map(|(_, c)| (x - c) / (nodes[a] - c)).product()
}

/// Its slope.
fn slope(nodes: &[f64], a: usize, x: f64) -> f64 {
    let others = || nodes.iter().enumerate().filter(|(b, _)| *b != a);
    let term = |(b, c): (usize, &f64)| {
        let rest = others().filter(|(d, _)| *d != b);
        rest.map(|(_, c)| (x - c) / (nodes[a] - c)).product::<f64>() / (nodes[a] - c)
    };
    others().map(term).sum()
}

fn narrow(count: usize) -> u32 {
    u32::try_from(count).expect("fewer than 2^32 pairs")
}

pub(crate) mod checks {
    use super::*;

    const SOLID: Solid = Solid {
        youngs_modulus: 5.0,
        poissons_ratio: 0.3,
        density: 1.0,
    };

    fn uneven(order: Order) -> Elements {
        let lines = [
            vec![0.0, 0.3, 0.7, 1.2, 2.0],
            vec![-1.0, -0.2, 0.5],
            vec![0.0, 0.1, 0.5, 0.6, 1.0],
        ];
        Elements::new(lines, order, SOLID)
    }

    /// Held to a linear field at its surface, the inside follows it to rounding: the patch test.
    pub(crate) fn the_patch_test_is_passed_on_uneven_lines() {
        let gradient = DMat3::from_cols(
            DVec3::new(0.01, 0.02, -0.01),
            DVec3::new(0.03, -0.02, 0.01),
            DVec3::new(-0.02, 0.01, 0.015),
        );
        for order in [Order::Linear, Order::Quadratic] {
            let mut body = uneven(order);
            let low = body.rest.iter().copied().fold(DVec3::MAX, DVec3::min);
            let high = body.rest.iter().copied().fold(DVec3::MIN, DVec3::max);
            let outer = |x: DVec3| (0..3).any(|a| x[a] <= low[a] || x[a] >= high[a]);
            // What the surface's motion does to the inside, as forces there.
            let field: Vec<DVec3> = body.rest.iter().map(|x| gradient * *x).collect();
            let given = body.rest.iter().zip(&field);
            let given: Vec<DVec3> = given
                .map(|(x, u)| if outer(*x) { *u } else { DVec3::ZERO })
                .collect();
            let mut forces = vec![DVec3::ZERO; field.len()];
            body.tangent_product_into(&given, &mut forces);
            let supports = BoundaryConditions::fixed_where(&body.rest, outer);
            let forces: Vec<DVec3> = forces.iter().map(|f| -*f).collect();
            let inner = body.solve(&supports, &forces).unwrap();
            let mut free = 0;
            let nodes = body.rest.iter().zip(inner.iter().zip(&field));
            for (x, (inner, known)) in nodes.filter(|(x, _)| !outer(**x)) {
                free += 1;
                assert!(inner.distance(*known) < 1e-9, "{order:?}: {x} {inner}");
            }
            assert!(free >= 9, "{free}");
            let at = DVec3::new(1.1, 0.13, 0.77);
            let there = body.field_at(&field, at);
            assert!(there.distance(gradient * at) < 1e-12, "{there}");
        }
    }

    /// `w L⁴ / 8 E I + 3/5 w L² / G A` under a weight of `w` a length (Timoshenko), exact for a Poisson's ratio of 0 but for
    /// the clamped end's warping.
    pub(crate) fn a_cantilever_bends_as_theory_says() {
        let (length, thick, weight) = (1.0, 0.1, 1e-4);
        let solid = Solid {
            poissons_ratio: 0.0,
            ..SOLID
        };
        let area: f64 = thick * thick;
        let stiffness = solid.youngs_modulus * area * area / 12.0;
        let shear = 0.6 * weight * length * length / (0.5 * solid.youngs_modulus * area);
        let theory = weight * length.powi(4) / (8.0 * stiffness) + shear;
        let high = DVec3::new(length, thick, thick);
        let found = [Order::Linear, Order::Quadratic].map(|order| {
            let mut body = Elements::even([20, 2, 2], DVec3::ZERO, high, order, solid);
            let supports = BoundaryConditions::fixed_where(&body.rest, |x| x.x <= 0.0);
            let volumes = body.volumes();
            let whole: f64 = volumes.iter().sum();
            assert!((whole / (length * area) - 1.0).abs() < 1e-12, "{whole}");
            let forces = volumes.iter().map(|v| DVec3::Y * (weight * v / area));
            let moved = body.solve(&supports, &forces.collect::<Vec<_>>()).unwrap();
            body.field_at(&moved, high).y / theory
        });
        // Full integration locks linear elements as long as this: by (h/t)² (1/2) for ν = 0, `h = t / 2`.
        assert!((0.75..0.97).contains(&found[0]), "{found:?}");
        assert!((found[1] - 1.0).abs() < 5e-3, "{found:?}");
    }
}
