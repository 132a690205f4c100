//! The two loops over pairs. Everything else is linear in the number of nodes.
//!
//! A pair is one weight and one index. What its stencil needs besides, `X` and `μ`, lies with the
//! nodes. Pass one sums `w_ij u_j ⊗ (X_ij, 1, μ_ij)` and `w_ij (X_ij, 1, μ_ij)`, with no difference of
//! `u` in the loop; what a node's own `u` adds follows from the second sum. Pass two sums `w_ij` times
//! what each neighbour recorded.
//!
//! The loops are written over lanes and left to the compiler, once for the baseline of the target
//! and once with what the processor at hand offers (`pulp`). They hand back whole lanes: asked to
//! return sums over lanes, the compiler pairs axes instead and shuffles in every step.
#![allow(
    clippy::needless_range_loop,
    reason = "lanes and axes are walked in step over several arrays"
)]

use std::hint::black_box;

use pulp::Simd;

use crate::kernel::pairs::Pair;
use crate::kernel::storage::{Move, Sixteen, at};
use crate::law::arithmetic::Arithmetic;

/// Whether the instructions behind `S` round products and sums once: AVX2 and wider ones of x86 do,
/// and those of 64-bit Arm.
pub(crate) const fn fuses<S: Simd>() -> bool {
    !S::IS_SCALAR
        && cfg!(any(
            target_arch = "x86",
            target_arch = "x86_64",
            target_arch = "aarch64"
        ))
}

/// Whether the registers behind `S` hold 64 sums and what they are made of.
pub(crate) const fn holds_sums_twice<S: Simd>() -> bool {
    S::REGISTER_COUNT * S::F64_LANES >= 128
}

/// Makes a pass with `run::<Arithmetic>` one that instructions are chosen for: [`Fused`] or [`FusedInFew`] where
/// they round products and sums once, else [`Separate`].
macro_rules! choose_arithmetic {
    ($pass:ident) => {
        impl<const L: usize> pulp::WithSimd for $pass<'_, L> {
            type Output = ();

            #[inline(always)]
            fn with_simd<V: pulp::Simd>(self, _: V) {
                // Chosen before code is made: else the compiler writes all three into each and drops two.
                if const {
                    $crate::kernel::gather::fuses::<V>()
                        && $crate::kernel::gather::holds_sums_twice::<V>()
                } {
                    self.run::<$crate::law::arithmetic::Fused>();
                } else if const { $crate::kernel::gather::fuses::<V>() } {
                    self.run::<$crate::law::arithmetic::FusedInFew>();
                } else {
                    self.run::<$crate::law::arithmetic::Separate>();
                }
            }
        }
    };
}
pub(crate) use choose_arithmetic;

/// Sums of pass one over a node's pairs: `sum_j w_ij u_ij ⊗ (X_ij, 1, μ_ij, 0)` in three rows, then
/// `sum_j w_ij (X_ij, 1, μ_ij, 0)`. Without multipliers the lanes end after the one.
pub(crate) type PairSums<const L: usize> = [[f64; L]; 4];

/// Lane of the one.
pub(crate) const ONE: usize = 3;

/// Pass one for one node.
#[inline(always)]
pub(crate) fn sums<A: Arithmetic, const L: usize>(
    node: usize,
    row: &[Pair],
    anchors: &[Sixteen<[f64; L]>],
    moves: &[Move],
) -> PairSums<L> {
    let own = at(anchors, node);
    let mut here = *own;
    here[ONE] = 0.0;
    let (mut even, mut odd) = ([[0.0; L]; 4], [[0.0; L]; 4]);
    let (twos, last) = row.as_chunks::<2>();
    if A::HOLDS_SUMS {
        for [a, b] in twos {
            add_pair::<A, L>(a, &here, anchors, moves, &mut even);
            add_pair::<A, L>(b, &here, anchors, moves, &mut odd);
        }
    } else {
        for [a, _] in twos {
            add_pair::<A, L>(a, &here, anchors, moves, &mut even);
        }
        for [_, b] in twos {
            add_pair::<A, L>(b, &here, anchors, moves, &mut odd);
        }
    }
    for pair in last {
        add_pair::<A, L>(pair, &here, anchors, moves, &mut even);
    }
    let mut sum = plus(&even, &odd);
    let u = &moves[node];
    for r in 0..3 {
        for k in 0..L {
            sum[r][k] = A::add(-u[r], sum[3][k], sum[r][k]);
        }
    }
    // Else what takes numbers one by one takes the lanes apart by shuffles, or the loop.
    out_of_sight(sum)
}

/// The value, in memory that the compiler does not look through. It starts a cache line: where the caller's stack put it
/// across two, a step of the liver took 17 % longer.
#[inline(always)]
fn out_of_sight<T>(value: T) -> T {
    #[repr(align(64))]
    struct Line<T>(T);
    black_box(Line(value)).0
}

/// What a pair adds to the sums.
#[inline(always)]
fn add_pair<A: Arithmetic, const L: usize>(
    pair: &Pair,
    here: &[f64; L],
    anchors: &[Sixteen<[f64; L]>],
    moves: &[Move],
    sum: &mut PairSums<L>,
) {
    let j = pair.to as usize;
    let (there, u) = (at(anchors, j), &moves[j]);
    let w = f64::from(pair.weight);
    let mut z = [0.0; L];
    for k in 0..L {
        z[k] = w * (there[k] - here[k]);
    }
    for r in 0..3 {
        for k in 0..L {
            sum[r][k] = A::add(u[r], z[k], sum[r][k]);
        }
    }
    for k in 0..L {
        sum[3][k] += z[k];
    }
}

/// Sums of every other pair each, so that an addition waits for half as many others, added.
#[inline(always)]
fn plus<const L: usize, const R: usize>(
    even: &[[f64; L]; R],
    odd: &[[f64; L]; R],
) -> [[f64; L]; R] {
    let mut sum = [[0.0; L]; R];
    for r in 0..R {
        for k in 0..L {
            sum[r][k] = even[r][k] + odd[r][k];
        }
    }
    sum
}

/// What a node records for its neighbours: three rows of `(Q, q, R, 0)`, without multipliers of `(Q, q)`.
pub(crate) type Record<const L: usize> = [[f64; L]; 3];

/// Pass two for one node: `sum_j w_ij record_j`.
#[inline(always)]
pub(crate) fn records<A: Arithmetic, const L: usize>(
    row: &[Pair],
    records: &[Sixteen<Record<L>>],
) -> Record<L> {
    let (mut even, mut odd) = ([[0.0; L]; 3], [[0.0; L]; 3]);
    let (twos, last) = row.as_chunks::<2>();
    if A::HOLDS_RECORDS {
        for [a, b] in twos {
            add_record::<A, L>(a, records, &mut even);
            add_record::<A, L>(b, records, &mut odd);
        }
    } else {
        for [a, _] in twos {
            add_record::<A, L>(a, records, &mut even);
        }
        for [_, b] in twos {
            add_record::<A, L>(b, records, &mut odd);
        }
    }
    for pair in last {
        add_record::<A, L>(pair, records, &mut even);
    }
    out_of_sight(plus(&even, &odd))
}

#[inline(always)]
fn add_record<A: Arithmetic, const L: usize>(
    pair: &Pair,
    records: &[Sixteen<Record<L>>],
    sum: &mut Record<L>,
) {
    let record = at(records, pair.to as usize);
    let w = f64::from(pair.weight);
    for r in 0..3 {
        for k in 0..L {
            sum[r][k] = A::add(w, record[r][k], sum[r][k]);
        }
    }
}

/// `sum_j w_ij (q_j - Q_j X_i - R_j μ_i)` from the summed records, `anchor` that of the node.
#[inline(always)]
pub(crate) fn received<A: Arithmetic, const L: usize>(
    sum: &Record<L>,
    anchor: &[f64; L],
) -> [f64; 3] {
    let mut share = [0.0; L];
    for k in 0..L {
        share[k] = if k % 4 == ONE { anchor[k] } else { -anchor[k] };
    }
    let mut forces = [0.0; 3];
    for r in 0..3 {
        let mut terms = [0.0; 4];
        for half in 0..L / 4 {
            for k in 0..4 {
                terms[k] = A::add(sum[r][4 * half + k], share[4 * half + k], terms[k]);
            }
        }
        // In a tree, so that no addition waits for more than three others; else the compiler takes two of the three
        // rows for lanes, and shuffles.
        let [a, b, c, d] = out_of_sight(terms);
        forces[r] = (a + b) + (c + d);
    }
    forces
}
