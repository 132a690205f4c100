//! The two loops over pairs, for either precision, with and without zero-energy control. Everything
//! else is linear in the number of nodes.
//!
//! A pair carries four numbers, `g_ij` and `w_ij`; what zero-energy control adds to it,
//! `y_ij = w_ij X_ij`, follows from rest positions, which lie in cache when the numbers do not. Both
//! together, `z_ij = (g_ij, w_ij, y_ij, 0)`, fill two registers of four f64 or one of eight f32. A
//! node carries a 3×8 matrix in the same lanes.
//!
//! The loops are written over lanes and left to the compiler, once for the baseline of the target
//! and once with what the processor at hand offers (`pulp`). They hand back whole lanes: told to
//! return sums over lanes, the compiler pairs axes instead and shuffles in every step. No lane's
//! order of operations depends on the width of a register, so neither do the bits.

use std::fmt::Debug;

use glam::{DMat3, DVec3};

use crate::body::Body;

pub(crate) mod bare;
pub(crate) mod controlled;

/// Displacement `u_i` (m) of a node without zero-energy control.
pub(crate) type Move = [f64; 3];

/// `u_i` (m), `c_i` (Pa m), `X_i` (m), nothing: one cache line of a node with zero-energy control.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Anchored(pub(crate) [f64; 8]);

/// One row: the node, its neighbours and what its pairs store.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row<'a, P> {
    pub(crate) node: usize,
    pub(crate) indices: &'a [u32],
    pub(crate) pairs: &'a [P],
}

/// Type in which pairs and matrices are stored and the sums over one row are made.
pub(crate) trait Real:
    Copy
    + Debug
    + Send
    + Sync
    + PartialEq
    + std::ops::Add<Output = Self>
    + std::ops::AddAssign
    + std::ops::Mul<Output = Self>
    + 'static
{
    const ZERO: Self;
    /// Relative difference up to which weights of one pair count as equal.
    const WEIGHT_TOLERANCE: f64;
    /// Displacements (m) below this count as none: subnormal products, as ahead of a wave, cost a
    /// hundred times a normal one.
    const LEAST_DISPLACEMENT: f64;
    /// Entries of a vector below this share of its length are stored as zero, for the same reason.
    const LEAST_SHARE: f64;
    fn of(value: f64) -> Self;
    fn wide(self) -> f64;
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const WEIGHT_TOLERANCE: f64 = 1e-12;
    const LEAST_DISPLACEMENT: f64 = 0.0;
    const LEAST_SHARE: f64 = 0.0;

    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        self
    }
}

/// Differences of positions are taken in f64 before they are rounded, so a body may move far without
/// losing strain. What is left is a relative 1e-7 per row.
impl Real for f32 {
    const ZERO: Self = 0.0;
    const WEIGHT_TOLERANCE: f64 = 1e-6;
    const LEAST_DISPLACEMENT: f64 = 1e-20;
    const LEAST_SHARE: f64 = 1e-12;

    #[inline(always)]
    #[allow(
        clippy::cast_possible_truncation,
        reason = "rounding to f32 is this storage's purpose"
    )]
    fn of(value: f64) -> Self {
        value as Self
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        self.into()
    }
}

/// A vector as it is stored.
fn stored<T: Real>(v: DVec3) -> [T; 3] {
    let floor = T::LEAST_SHARE * v.length();
    v.to_array()
        .map(|c| T::of(if c.abs() < floor { 0.0 } else { c }))
}

/// Columns of three lanes from `at` on.
#[inline(always)]
fn columns<T: Real, const N: usize>(lanes: &[[T; N]; 3], at: usize) -> DMat3 {
    let column = |row: &[T; N]| DVec3::new(row[at].wide(), row[at + 1].wide(), row[at + 2].wide());
    DMat3::from_cols(column(&lanes[0]), column(&lanes[1]), column(&lanes[2]))
}

/// How pairs and node matrices are stored, and the loops over them.
pub(crate) trait Lanes: Copy + Debug + Send + Sync + 'static {
    /// Whether pairs carry weights and the loops zero-energy control.
    const CONTROLLED: bool;
    type Number: Real;
    /// What is gathered from a node besides its matrix.
    type State: Copy + Debug + Send + Sync;
    /// `g_ij` and, under control, `w_ij`.
    type Pair: Copy + Debug + Send + Sync;
    /// What a node multiplies the `z` of its neighbours with.
    type Matrix: Copy + Debug + Send + Sync;

    /// The body's states of this kind.
    fn states(body: &Body) -> &[Self::State];
    fn pair(gradient: DVec3, weight: f64) -> Self::Pair;
    /// From the transposes of what multiplies `g` and `y`: their columns are the rows stored.
    fn matrix(on_gradient: DMat3, on_offset: DMat3) -> Self::Matrix;
    fn gradient(pair: &Self::Pair) -> DVec3;
    /// `y_ij` of a pair `x` apart, as the loops see it; zero without control.
    fn offset(pair: &Self::Pair, x: DVec3) -> DVec3;
    /// `w_ij`; zero without control.
    fn weight(pair: &Self::Pair) -> f64;
    /// False for a severed pair, given both directions.
    fn linked(pair: &Self::Pair, back: &Self::Pair) -> bool;

    /// `(sum_j u_ij ⊗ g_ij)ᵀ` and `(sum_j u_ij ⊗ y_ij)ᵀ` of one node.
    fn gather_gradient(row: Row<'_, Self::Pair>, states: &[Self::State]) -> (DMat3, DMat3);

    /// `sum_j [ M_j z_ji + (c_i + c_j) w_ij u_ij ]` of one node.
    fn gather_force(
        row: Row<'_, Self::Pair>,
        states: &[Self::State],
        matrices: &[Self::Matrix],
    ) -> DVec3;
}
