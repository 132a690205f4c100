//! Sparse Cholesky factor of a tangent, found from its products.

use crate::coupling::Coupling;
use crate::supports::Supports;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// `L Lᵀ = A` on the free directions; held ones have a stiffness of their own.
#[derive(Debug, Clone)]
pub(crate) struct Factor {
    symbolic: Arc<SymbolicCholesky<usize>>,
    values: Vec<f64>,
    right: Vec<f64>,
}

impl Factor {
    /// Factors the matrix whose products `apply` gives. One product per axis and colour of the coupling
    /// finds its blocks (Curtis 1974). `None` if it is not positive definite.
    ///
    /// All runs on one thread, so that bits do not depend on their number.
    pub(crate) fn new(
        coupling: &Coupling,
        supports: &Supports,
        mut apply: impl FnMut(&[DVec3], &mut [DVec3]),
    ) -> Option<Self> {
        let n = coupling.node_count();
        let (colors, count) = coupling.colors();
        let mut of_color: Vec<Vec<usize>> = vec![Vec::new(); count as usize];
        for (node, color) in colors.iter().enumerate() {
            of_color[*color as usize].push(node);
        }
        let pairs = (0..n).map(|i| coupling.row(i).len()).sum();
        // Block (i, j) in row j: its columns are what moves when j does.
        let mut blocks = vec![DMat3::ZERO; pairs];
        let mut moved = vec![DVec3::ZERO; n];
        let mut image = vec![DVec3::ZERO; n];
        for nodes in &of_color {
            for axis in 0..3 {
                for &j in nodes {
                    moved[j] = DVec3::AXES[axis];
                }
                apply(&moved, &mut image);
                for &j in nodes {
                    moved[j] = DVec3::ZERO;
                    let begin = coupling.begin(j);
                    for (slot, &i) in coupling.row(j).iter().enumerate() {
                        *blocks[begin + slot].col_mut(axis) = image[i as usize];
                    }
                }
            }
        }
        let free = |i: usize| supports.of(i).map_or(DMat3::IDENTITY, |s| s.free);
        let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for j in 0..n {
            let begin = coupling.begin(j);
            let row = coupling.row(j);
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
        let pattern = SymbolicSparseColMatRef::new_checked(3 * n, 3 * n, &starts, None, &rows);
        let matrix = SparseColMatRef::new(pattern, values.as_slice());
        let (order, params) = (Default::default(), Default::default());
        let symbolic = factorize_symbolic_cholesky(pattern, Side::Lower, order, params).ok()?;
        let mut factor = vec![0.0; symbolic.len_val()];
        let params = Default::default();
        let need = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, params);
        let mut memory = MemBuffer::try_new(need).ok()?;
        let stack = MemStack::new(&mut memory);
        let (none, params) = (Default::default(), Default::default());
        symbolic
            .factorize_numeric_llt(
                &mut factor,
                matrix,
                Side::Lower,
                none,
                Par::Seq,
                stack,
                params,
            )
            .ok()?;
        Some(Self {
            symbolic: Arc::new(symbolic),
            values: factor,
            right: vec![0.0; 3 * n],
        })
    }

    /// Solves `A x = b`; held directions of `b` must be zero and stay so.
    pub(crate) fn solve(&mut self, b: &[DVec3], x: &mut [DVec3], supports: &Supports) {
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
        supports.project(x);
    }
}
