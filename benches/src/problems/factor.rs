//! A sparse Cholesky factor of a law's tangent as preconditioner of static solves.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use glam::{DMat3, DVec3};
use phyxel_integrate::{BoundaryConditions, ForceLaw};

/// Preconditioned residuals after which a factor is made again.
const FACTOR_LASTS: usize = 20;

/// Nodes whose motion changes the force on a node, itself among them, ascending: rows in CSR.
#[derive(Debug, Clone)]
pub(crate) struct Pattern {
    pub(crate) starts: Vec<usize>,
    pub(crate) indices: Vec<u32>,
}

impl Pattern {
    pub(crate) fn row(&self, node: usize) -> &[u32] {
        &self.indices[self.starts[node]..self.starts[node + 1]]
    }

    fn node_count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Nodes by colour such that no row has two of one colour: greedy, in order.
    fn colors(&self) -> Vec<Vec<usize>> {
        let n = self.node_count();
        let mut colors = vec![usize::MAX; n];
        let mut taken: Vec<usize> = Vec::new();
        let mut classes: Vec<Vec<usize>> = Vec::new();
        for node in 0..n {
            for &row in self.row(node) {
                for &other in self.row(row as usize) {
                    if let Some(mark) = taken.get_mut(colors[other as usize]) {
                        *mark = node + 1;
                    }
                }
            }
            let free = taken.iter().position(|mark| *mark != node + 1);
            let color = free.unwrap_or(taken.len());
            if color == taken.len() {
                taken.push(0);
                classes.push(Vec::new());
            }
            colors[node] = color;
            classes[color].push(node);
        }
        classes
    }
}

/// A law that answers [`ForceLaw::precondition`] by a factor of its tangent on `pattern`; without a
/// pattern, or where the tangent is not positive definite, not at all.
#[derive(Debug)]
pub(crate) struct Factored<'a, L> {
    pub(crate) law: L,
    pattern: Option<Arc<Pattern>>,
    supports: &'a BoundaryConditions,
    factor: Option<Factor>,
    /// Residuals preconditioned since the forces were last evaluated.
    uses: usize,
}

impl<'a, L: ForceLaw> Factored<'a, L> {
    pub(crate) fn new(
        law: L,
        pattern: Option<Arc<Pattern>>,
        supports: &'a BoundaryConditions,
    ) -> Self {
        Self {
            law,
            pattern,
            supports,
            factor: None,
            uses: 0,
        }
    }
}

impl<L: ForceLaw> ForceLaw for Factored<'_, L> {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        if self.uses > FACTOR_LASTS {
            self.factor = None;
        }
        self.uses = 0;
        self.law.forces_into(positions, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        self.law.tangent_product_into(vector, product);
    }

    fn tangent_blocks_into(&mut self, blocks: &mut [DMat3]) -> bool {
        self.law.tangent_blocks_into(blocks)
    }

    fn precondition(&mut self, residual: &[DVec3], out: &mut [DVec3]) -> bool {
        let Some(pattern) = &self.pattern else {
            return false;
        };
        // Once for each state: what failed there fails again.
        if self.factor.is_none() && self.uses == 0 {
            let law = &mut self.law;
            let product = |v: &[DVec3], out: &mut [DVec3]| law.tangent_product_into(v, out);
            self.factor = Factor::new(pattern, self.supports, product);
        }
        self.uses += 1;
        let Some(factor) = &mut self.factor else {
            return false;
        };
        factor.solve(residual, out);
        self.supports.project(out);
        true
    }
}

/// `L Lᵀ = A` on the free directions; held ones have a stiffness of their own.
#[derive(Debug)]
struct Factor {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    right: Vec<f64>,
}

impl Factor {
    /// Factors the matrix whose products `apply` gives, one per axis and colour of the pattern (Curtis
    /// 1974). `None` if it is not positive definite. All on one thread.
    fn new(
        pattern: &Pattern,
        supports: &BoundaryConditions,
        apply: impl FnMut(&[DVec3], &mut [DVec3]),
    ) -> Option<Self> {
        let blocks = blocks(pattern, apply);
        let n = pattern.node_count();
        let free = |i: usize| supports.of(i).map_or(DMat3::IDENTITY, |s| s.free);
        let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for j in 0..n {
            let begin = pattern.starts[j];
            let row = pattern.row(j);
            let own = row.partition_point(|i| (*i as usize) < j);
            let diagonal = blocks[begin + own];
            let mean = (diagonal.x_axis.x + diagonal.y_axis.y + diagonal.z_axis.z) / 3.0;
            let fill = if mean > 0.0 { mean } else { 1.0 };
            for axis in 0..3 {
                for (slot, &i) in row.iter().enumerate().skip(own) {
                    let i = i as usize;
                    let mut block = free(i) * blocks[begin + slot] * free(j);
                    if i == j {
                        block += (DMat3::IDENTITY - free(j)) * fill;
                    }
                    let column = block.col(axis);
                    let first = if i == j { axis } else { 0 };
                    for k in first..3 {
                        rows.push(3 * i + k);
                        values.push(column[k]);
                    }
                }
                starts.push(rows.len());
            }
        }
        let shape = SymbolicSparseColMatRef::new_checked(3 * n, 3 * n, &starts, None, &rows);
        let matrix = SparseColMatRef::new(shape, values.as_slice());
        let (side, order, params) = (Side::Lower, Default::default(), Default::default());
        let symbolic = factorize_symbolic_cholesky(shape, side, order, params).ok()?;
        let mut factor = vec![0.0; symbolic.len_val()];
        let params = Default::default();
        let need = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, params);
        let mut memory = MemBuffer::try_new(need).ok()?;
        let stack = MemStack::new(&mut memory);
        let (none, params) = (Default::default(), Default::default());
        let values = &mut factor;
        symbolic
            .factorize_numeric_llt(values, matrix, side, none, Par::Seq, stack, params)
            .ok()?;
        Some(Self {
            symbolic,
            values: factor,
            right: vec![0.0; 3 * n],
        })
    }

    /// Solves `A x = b`; fixed directions of `b` must be zero.
    fn solve(&mut self, b: &[DVec3], x: &mut [DVec3]) {
        for (to, from) in self.right.chunks_exact_mut(3).zip(b) {
            to.copy_from_slice(&from.to_array());
        }
        let n = self.right.len();
        let need = self.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        let mut memory = MemBuffer::new(need);
        let right = MatMut::from_column_major_slice_mut(&mut self.right, n, 1);
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            right,
            Par::Seq,
            MemStack::new(&mut memory),
        );
        for (to, from) in x.iter_mut().zip(self.right.chunks_exact(3)) {
            *to = DVec3::new(from[0], from[1], from[2]);
        }
    }
}

/// Blocks (i, j) of the matrix in row j of the pattern: its columns are what moves when j does.
fn blocks(pattern: &Pattern, mut apply: impl FnMut(&[DVec3], &mut [DVec3])) -> Vec<DMat3> {
    let n = pattern.node_count();
    let mut blocks = vec![DMat3::ZERO; pattern.indices.len()];
    let mut moved = vec![DVec3::ZERO; n];
    let mut image = vec![DVec3::ZERO; n];
    for nodes in &pattern.colors() {
        for axis in 0..3 {
            for &j in nodes {
                moved[j] = DVec3::AXES[axis];
            }
            apply(&moved, &mut image);
            for &j in nodes {
                moved[j] = DVec3::ZERO;
                let begin = pattern.starts[j];
                for (slot, &i) in pattern.row(j).iter().enumerate() {
                    *blocks[begin + slot].col_mut(axis) = image[i as usize];
                }
            }
        }
    }
    blocks
}
