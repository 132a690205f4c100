//! The force kernel of before stencils were factored, for comparison until the next release: a pair has
//! a gradient and a weight of its own in either direction. Neo-Hookean nodes of full rows with
//! zero-energy control and nothing else; f64 or f32 pairs.
#![allow(
    clippy::needless_range_loop,
    reason = "lanes and axes are walked in step over several arrays"
)]

use std::hint::black_box;

use glam::{DMat3, DVec3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Nodes per unit of parallel work.
const CHUNK: usize = 256;
/// Nodes evaluated together.
const BLOCK: usize = 16;

type Plane = [f64; BLOCK];

/// Storage of pairs and matrices.
pub(crate) trait Real:
    Copy
    + Send
    + Sync
    + std::ops::Add<Output = Self>
    + std::ops::AddAssign
    + std::ops::Mul<Output = Self>
    + 'static
{
    /// Nothing.
    const ZERO: Self;
    /// Rounds.
    fn of(value: f64) -> Self;
    /// Back.
    fn wide(self) -> f64;
}

impl Real for f64 {
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        self
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;

    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "rounding is meant")]
    fn of(value: f64) -> Self {
        value as Self
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        self.into()
    }
}

#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Anchored([f64; 8]);

#[derive(Clone, Copy)]
#[repr(C, align(16))]
struct Pair<T>([T; 4]);

#[derive(Clone, Copy)]
#[repr(C, align(32))]
struct Matrix<T>([[T; 8]; 3]);

/// Constants of a node.
#[derive(Clone, Copy)]
struct Control {
    offset: DVec3,
    inverse: DMat3,
}

/// A body with the former kernel.
pub(crate) struct Previous<T> {
    offsets: Vec<u32>,
    indices: Vec<u32>,
    pairs: Vec<Pair<T>>,
    incoming: Vec<Pair<T>>,
    rest: Vec<DVec3>,
    volumes: Vec<f64>,
    self_gradients: Vec<DVec3>,
    controls: Vec<Control>,
    states: Vec<Anchored>,
    matrices: Vec<Matrix<T>>,
    deformation: Vec<DMat3>,
    partial: Vec<f64>,
    mu: f64,
    lambda: f64,
    arch: Arch,
}

/// What a body is made of.
pub(crate) struct Parts<'a> {
    /// Row starts and neighbours.
    pub(crate) graph: (&'a [u32], &'a [u32]),
    /// Pair that runs the other way.
    pub(crate) reverse: &'a [u32],
    /// `g_ij`.
    pub(crate) gradients: &'a [DVec3],
    /// `w_ij`.
    pub(crate) weights: &'a [f64],
    /// `X_i`.
    pub(crate) rest: &'a [DVec3],
    /// `V_i`.
    pub(crate) volumes: &'a [f64],
}

impl<T: Real> Previous<T> {
    /// A body of Lamé's `mu`, `lambda` (Pa) with control `alpha`.
    #[must_use]
    pub(crate) fn new(parts: &Parts<'_>, (mu, lambda): (f64, f64), alpha: f64) -> Self {
        let (offsets, indices) = parts.graph;
        let n = parts.rest.len();
        let pair = |p: usize| {
            let g = parts.gradients[p];
            Pair([g.x, g.y, g.z, parts.weights[p]].map(T::of))
        };
        let all = 0..indices.len();
        let mut body = Self {
            offsets: offsets.to_vec(),
            indices: indices.to_vec(),
            pairs: all.clone().map(pair).collect(),
            incoming: all.map(|p| pair(parts.reverse[p] as usize)).collect(),
            rest: parts.rest.to_vec(),
            volumes: parts.volumes.to_vec(),
            self_gradients: Vec::with_capacity(n),
            controls: Vec::with_capacity(n),
            states: Vec::with_capacity(n),
            matrices: vec![Matrix([[T::ZERO; 8]; 3]); n],
            deformation: vec![DMat3::IDENTITY; n],
            partial: vec![0.0; n.div_ceil(CHUNK)],
            mu,
            lambda,
            arch: Arch::new(),
        };
        for i in 0..n {
            let mut own = DVec3::ZERO;
            let mut offset = DVec3::ZERO;
            let mut moment = DMat3::ZERO;
            for p in offsets[i] as usize..offsets[i + 1] as usize {
                let x = parts.rest[indices[p] as usize] - parts.rest[i];
                let [a, b, c, w] = body.pairs[p].0.map(Real::wide);
                own -= DVec3::new(a, b, c);
                offset += x * w;
                moment += DMat3::from_cols(x * x.x, x * x.y, x * x.z) * w;
            }
            let spread = moment.x_axis.x + moment.y_axis.y + moment.z_axis.z;
            let x = parts.rest[i];
            let stiffness = alpha * mu * parts.volumes[i] / spread;
            body.self_gradients.push(own);
            body.controls.push(Control {
                offset,
                inverse: moment.inverse() * stiffness,
            });
            let state = [0.0, 0.0, 0.0, stiffness, x.x, x.y, x.z, 0.0];
            body.states.push(Anchored(state));
        }
        body
    }

    /// Bytes that it holds.
    #[must_use]
    pub(crate) fn bytes(&self) -> usize {
        let node = 2 * size_of::<DVec3>()
            + size_of::<f64>()
            + 80
            + size_of::<Anchored>()
            + size_of::<Matrix<T>>()
            + size_of::<DMat3>();
        self.rest.len() * (node + 13) + self.pairs.len() * (2 * size_of::<Pair<T>>() + 4)
    }

    /// Forces (N) at `positions` (m); returns the energy (J).
    pub(crate) fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        for ((state, x), rest) in self.states.iter_mut().zip(positions).zip(&self.rest) {
            [state.0[0], state.0[1], state.0[2]] = (*x - *rest).to_array();
        }
        let mut matrices = std::mem::take(&mut self.matrices);
        let mut deformation = std::mem::take(&mut self.deformation);
        let mut partial = std::mem::take(&mut self.partial);
        let body = &*self;
        matrices
            .par_chunks_mut(CHUNK)
            .zip(deformation.par_chunks_mut(CHUNK))
            .zip(forces.par_chunks_mut(CHUNK))
            .zip(&mut partial)
            .enumerate()
            .for_each(|(chunk, (((matrices, deformation), forces), sum))| {
                body.arch.dispatch(First {
                    body,
                    first: chunk * CHUNK,
                    matrices,
                    deformation,
                    forces,
                    sum,
                });
            });
        forces
            .par_chunks_mut(CHUNK)
            .zip(&mut partial)
            .enumerate()
            .for_each(|(chunk, (forces, sum))| {
                body.arch.dispatch(Second {
                    body,
                    matrices: &matrices,
                    first: chunk * CHUNK,
                    forces,
                    sum,
                });
            });
        let energy = partial.iter().sum();
        self.matrices = matrices;
        self.deformation = deformation;
        self.partial = partial;
        energy
    }

    #[inline(always)]
    fn row<'a>(&'a self, node: usize, pairs: &'a [Pair<T>]) -> (&'a [u32], &'a [Pair<T>]) {
        let at = self.offsets[node] as usize..self.offsets[node + 1] as usize;
        (&self.indices[at.clone()], &pairs[at])
    }
}

struct First<'a, T> {
    body: &'a Previous<T>,
    first: usize,
    matrices: &'a mut [Matrix<T>],
    deformation: &'a mut [DMat3],
    forces: &'a mut [DVec3],
    sum: &'a mut f64,
}

impl<T: Real> WithSimd for First<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut block = Block::new();
        let mut first = self.first;
        *self.sum = 0.0;
        for ((matrices, deformation), forces) in self
            .matrices
            .chunks_mut(BLOCK)
            .zip(self.deformation.chunks_mut(BLOCK))
            .zip(self.forces.chunks_mut(BLOCK))
        {
            let count = forces.len();
            for lane in 0..count {
                gather(self.body, first + lane, lane, &mut block);
            }
            block.evaluate(self.body, first, count);
            for lane in 0..count {
                for r in 0..3 {
                    for k in 0..3 {
                        let at = 3 * r + k;
                        matrices[lane].0[r][k] = T::of(block.stress[at][lane]);
                        matrices[lane].0[r][4 + k] = T::of(block.control[at][lane]);
                    }
                }
                let h = DMat3::from_cols_array(&std::array::from_fn(|i| block.gradient[i][lane]));
                deformation[lane] = (DMat3::IDENTITY + h).transpose();
                forces[lane] = DVec3::from_array(std::array::from_fn(|r| block.force[r][lane]));
                *self.sum += block.work[lane];
            }
            first += BLOCK;
        }
    }
}

/// `(g, w, w X, 0)` of a pair whose states differ by `d = (u, c, X, 0)`.
#[inline(always)]
fn lanes<T: Real>(pair: &Pair<T>, d: &[T; 8]) -> [T; 8] {
    let mut z = [T::ZERO; 8];
    for k in 0..4 {
        z[k] = pair.0[k];
        z[4 + k] = d[4 + k] * pair.0[3];
    }
    z
}

#[inline(always)]
fn gather<T: Real>(body: &Previous<T>, node: usize, lane: usize, block: &mut Block) {
    let own = body.states[node].0;
    let (indices, pairs) = body.row(node, &body.pairs);
    let mut sum = [[T::ZERO; 8]; 3];
    for (&j, pair) in indices.iter().zip(pairs) {
        let other = &body.states[j as usize].0;
        let mut d = [T::ZERO; 8];
        for k in 0..8 {
            d[k] = T::of(other[k] - own[k]);
        }
        let z = lanes(pair, &d);
        for r in 0..3 {
            for k in 0..8 {
                sum[r][k] += d[r] * z[k];
            }
        }
    }
    let sum = black_box(sum);
    for r in 0..3 {
        for k in 0..3 {
            block.gradient[3 * r + k][lane] = sum[r][k].wide();
            block.offset[3 * r + k][lane] = sum[r][4 + k].wide();
        }
    }
}

struct Second<'a, T> {
    body: &'a Previous<T>,
    matrices: &'a [Matrix<T>],
    first: usize,
    forces: &'a mut [DVec3],
    sum: &'a mut f64,
}

impl<T: Real> WithSimd for Second<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (node, force) in (self.first..).zip(self.forces) {
            let own = self.body.states[node].0;
            let (indices, pairs) = self.body.row(node, &self.body.incoming);
            let mut sum = [[T::ZERO; 8]; 3];
            let mut direct = [0.0; 4];
            for (&j, pair) in indices.iter().zip(pairs) {
                let (other, m) = (&self.body.states[j as usize].0, &self.matrices[j as usize]);
                let mut d = [0.0; 8];
                for k in 0..8 {
                    d[k] = own[k] - other[k];
                }
                let z = lanes(pair, &d.map(T::of));
                for r in 0..3 {
                    for k in 0..8 {
                        sum[r][k] += m.0[r][k] * z[k];
                    }
                }
                let stiffness = (own[3] + other[3]) * pair.0[3].wide();
                for r in 0..4 {
                    direct[r] -= stiffness * d[r];
                }
            }
            let (sum, direct) = black_box((sum, direct));
            let mut given = [0.0; 3];
            for r in 0..3 {
                let [a, b, c, _, d, e, f, _] = sum[r].map(Real::wide);
                given[r] = ((a + b) + c) + ((d + e) + f) + direct[r];
            }
            *force += DVec3::from_array(given);
            *self.sum -= 0.5 * DVec3::new(own[0], own[1], own[2]).dot(*force);
        }
    }
}

/// Sixteen nodes by component.
struct Block {
    gradient: [Plane; 9],
    offset: [Plane; 9],
    stress: [Plane; 9],
    control: [Plane; 9],
    force: [Plane; 3],
    work: Plane,
    volume: Plane,
    own: [Plane; 6],
    inverse: [Plane; 6],
}

impl Block {
    fn new() -> Self {
        let zero = [0.0; BLOCK];
        Self {
            gradient: [zero; 9],
            offset: [zero; 9],
            stress: [zero; 9],
            control: [zero; 9],
            force: [zero; 3],
            work: zero,
            volume: zero,
            own: [zero; 6],
            inverse: [zero; 6],
        }
    }

    #[inline(always)]
    fn evaluate<T: Real>(&mut self, body: &Previous<T>, first: usize, count: usize) {
        for lane in 0..count {
            let node = first + lane;
            self.volume[lane] = body.volumes[node];
            let (g, control) = (body.self_gradients[node], &body.controls[node]);
            let (y, a) = (control.offset, &control.inverse);
            for (plane, value) in self.own.iter_mut().zip([g.x, g.y, g.z, y.x, y.y, y.z]) {
                plane[lane] = value;
            }
            let six = [
                a.x_axis.x, a.y_axis.y, a.z_axis.z, a.y_axis.z, a.z_axis.x, a.x_axis.y,
            ];
            for (plane, value) in self.inverse.iter_mut().zip(six) {
                plane[lane] = value;
            }
        }
        let (mu, lambda) = (body.mu, body.lambda);
        for k in 0..BLOCK {
            let h = |i: usize| self.gradient[i][k];
            let (a, b, d) = (
                [h(0) + 1.0, h(1), h(2)],
                [h(3), h(4) + 1.0, h(5)],
                [h(6), h(7), h(8) + 1.0],
            );
            let cof = [cross(b, d), cross(d, a), cross(a, b)];
            let j = dot(a, cof[0]);
            let (l, inverse) = (ln(j), j.recip());
            let energy = l * (0.5 * lambda * l - mu);
            let slope = (lambda * l - mu) * inverse;
            let squares = dot(a, a) + dot(b, b) + dot(d, d);
            let energy = 0.5 * mu * (squares - 3.0) + energy;
            let volume = self.volume[k];
            let (p, q) = (-volume * mu, -volume * slope);
            let stress = [0, 1, 2].map(|r| {
                let row = [a, b, d][r];
                [0, 1, 2].map(|i| row[i] * p + cof[r][i] * q)
            });
            let g = [0, 1, 2].map(|i| self.own[i][k]);
            let y = [0, 1, 2].map(|i| self.own[3 + i][k]);
            let [xx, yy, zz, yz, zx, xy] = [0, 1, 2, 3, 4, 5].map(|i| self.inverse[i][k]);
            let inverse = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]];
            let mut work = 0.0;
            for r in 0..3 {
                let s = [0, 1, 2].map(|i| self.offset[3 * r + i][k]);
                let row = inverse.map(|column| dot(column, s));
                self.force[r][k] = dot(stress[r], g) - dot(row, y);
                for i in 0..3 {
                    self.stress[3 * r + i][k] = stress[r][i];
                    self.control[3 * r + i][k] = row[i];
                    work += stress[r][i] * h(3 * r + i);
                }
            }
            self.work[k] = volume * energy + 0.5 * work;
        }
    }
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

/// `x = 2^e m`, `ln m = 2 artanh((m - 1)/(m + 1))`.
#[inline(always)]
fn ln(x: f64) -> f64 {
    const LOW: u64 = 0x3fe6_a09e_667f_3bcd;
    const ONE: u64 = 0x3ff0_0000_0000_0000;
    const UNITS: u64 = 0x4330_0000_0000_0000;
    const LN2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
    let bits = x.to_bits();
    let exponent = bits.wrapping_add(ONE - LOW) >> 52;
    let m = f64::from_bits(bits.wrapping_sub(exponent.wrapping_sub(1023) << 52));
    let e = f64::from_bits(UNITS | exponent) - (4_503_599_627_370_496.0 + 1023.0);
    let f = m - 1.0;
    let s = f / (m + 1.0);
    let z = s * s;
    let mut series = 1.0 / 21.0;
    for odd in [19.0, 17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0] {
        series = series * z + 1.0 / odd;
    }
    e * LN2[0] + (f + (s * (2.0 * z * series - f) + e * LN2[1]))
}
