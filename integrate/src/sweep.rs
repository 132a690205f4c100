//! The two passes over nodes of an explicit step.
//!
//! A pass goes through the nodes block by block, and through a block once per quantity, so that each
//! loop is short, has no branch and leaves its block in cache for the next. Loops that treat all
//! components alike run over plain numbers.

use std::ops::Range;

use bytemuck::{cast_slice, cast_slice_mut};
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::nodes::NodeConstants;
use crate::vector::{CHUNK, dot_in_order, sum_in_order, weighted_squares};

/// Nodes per block, whose vectors stay in the first cache. Divides the chunk.
const BLOCK: usize = 128;

/// Below this many nodes a pass takes less time than sharing it: some 10 µs, and 4 ns a node.
pub(crate) const PARALLEL_FROM: usize = 4 * CHUNK;

/// What a pass reads. Slices are empty where a motion has no such forces.
#[derive(Clone, Copy)]
pub(crate) struct PassInput<'a> {
    pub(crate) nodes: &'a NodeConstants,
    pub(crate) gravity: DVec3,
    pub(crate) forces: &'a [DVec3],
    pub(crate) applied: &'a [DVec3],
}

/// Kick and decay of one pass, and the step (s) it belongs to.
#[derive(Clone, Copy)]
pub(crate) struct Kick {
    /// Time (s) for which forces act.
    pub(crate) time: f64,
    /// What is left of velocities after damping.
    pub(crate) decay: f64,
    /// The whole step (s).
    pub(crate) step: f64,
}

/// Forces of the step before, against which work is counted.
#[derive(Clone, Copy)]
pub(crate) struct Before<'a> {
    pub(crate) forces: &'a [DVec3],
    pub(crate) applied: &'a [DVec3],
    pub(crate) viscous: &'a [DVec3],
    /// Viscosity over step.
    pub(crate) viscosity: f64,
}

/// Sums over nodes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sums {
    pub(crate) kinetic: f64,
    pub(crate) momentum: DVec3,
    pub(crate) dissipated: f64,
    pub(crate) applied: f64,
    pub(crate) potential: f64,
    /// [`crate::State::lag`] (J).
    pub(crate) lag: f64,
    pub(crate) bad: bool,
}

impl Sums {
    pub(crate) fn add(mut self, other: Self) -> Self {
        self.kinetic += other.kinetic;
        self.momentum += other.momentum;
        self.dissipated += other.dissipated;
        self.applied += other.applied;
        self.potential += other.potential;
        self.lag += other.lag;
        self.bad |= other.bad;
        self
    }
}

/// A range in blocks.
fn blocks(range: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = range.end;
    range
        .step_by(BLOCK)
        .map(move |from| from..end.min(from + BLOCK))
}

/// A slice's part, nothing of an empty one.
fn part<'a>(slice: &'a [DVec3], at: &Range<usize>) -> &'a [DVec3] {
    slice.get(at.clone()).unwrap_or_default()
}

/// `a = f(a, b)`, number by number, as far as both go.
#[inline(always)]
fn combine(a: &mut [DVec3], b: &[DVec3], f: impl Fn(f64, f64) -> f64) {
    let (a, b): (&mut [f64], &[f64]) = (cast_slice_mut(a), cast_slice(b));
    let len = a.len().min(b.len());
    let (a, b) = (&mut a[..len], &b[..len]);
    for k in 0..len {
        a[k] = f(a[k], b[k]);
    }
}

impl PassInput<'_> {
    /// First pass: decay, kick, drift.
    pub(crate) fn drift(&self, viscous: &[DVec3], kick: Kick, x: &mut [DVec3], v: &mut [DVec3]) {
        let arch = Arch::new();
        let body = |(chunk, (x, v)): (usize, (&mut [DVec3], &mut [DVec3]))| {
            arch.dispatch(Drift {
                sweep: self,
                viscous,
                kick,
                first: chunk * CHUNK,
                x,
                v,
            });
        };
        if x.len() >= PARALLEL_FROM {
            let chunks = x.par_chunks_mut(CHUNK).zip(v.par_chunks_mut(CHUNK));
            chunks.enumerate().with_max_len(1).for_each(body);
        } else {
            let chunks = x.chunks_mut(CHUNK).zip(v.chunks_mut(CHUNK));
            chunks.enumerate().for_each(body);
        }
    }

    /// Second pass: viscous forces, work, kick, decay, and the sums of the audit. `viscous` is empty
    /// without viscosity. Velocities of a block whose energy is not finite stay as they were. The sums are
    /// those of chunks, in order.
    pub(crate) fn finish(
        &self,
        before: Before<'_>,
        kick: Kick,
        x: &[DVec3],
        v: &mut [DVec3],
        viscous: &mut [DVec3],
    ) -> Vec<Sums> {
        let arch = Arch::new();
        let body = |(chunk, (v, viscous)): (usize, (&mut [DVec3], &mut [DVec3]))| {
            arch.dispatch(Finish {
                sweep: self,
                before,
                kick,
                first: chunk * CHUNK,
                x,
                v,
                viscous,
            })
        };
        let parallel = v.len() >= PARALLEL_FROM;
        let mut viscous = viscous.chunks_mut(CHUNK);
        let chunks = v.chunks_mut(CHUNK);
        let chunks = chunks.map(|v| (v, viscous.next().unwrap_or_default()));
        if parallel {
            let chunks: Vec<_> = chunks.enumerate().collect();
            chunks.into_par_iter().with_max_len(1).map(body).collect()
        } else {
            chunks.enumerate().map(body).collect()
        }
    }

    #[inline(always)]
    fn finish_block(
        &self,
        before: Before<'_>,
        kick: Kick,
        nodes: Range<usize>,
        x: &[DVec3],
        (v, viscous): (&mut [DVec3], &mut [DVec3]),
        [new, momenta]: &mut [[DVec3; BLOCK]; 2],
    ) -> Sums {
        let (new, momenta) = (&mut new[..v.len()], &mut momenta[..v.len()]);
        let half = 0.5 * kick.step;
        let mut sums = Sums::default();
        if !viscous.is_empty() {
            viscous.copy_from_slice(&self.forces[nodes.clone()]);
            let old = &before.forces[nodes.clone()];
            combine(viscous, old, |now, old| (now - old) * before.viscosity);
            let old = part(before.viscous, &nodes);
            sums.dissipated -= half * (dot_in_order(viscous, v) + dot_in_order(old, v));
        }
        let applied = part(self.applied, &nodes);
        if !applied.is_empty() {
            let old = part(before.applied, &nodes);
            sums.applied += half * (dot_in_order(applied, v) + dot_in_order(old, v));
        }
        self.kick(&nodes, viscous, half, new);
        let masses = &self.nodes.masses[nodes.clone()];
        // The second kick of symplectic Euler is in the next step's first.
        let is_kicked = kick.time > 0.0;
        if is_kicked {
            combine(new, v, |gained, v| v + gained);
        } else {
            let pairs = masses.iter().zip(v.iter().zip(&*new));
            sums.lag = -pairs
                .map(|(m, (v, gained))| m * v.dot(*gained))
                .sum::<f64>();
            new.copy_from_slice(v);
        }
        self.nodes
            .mobility
            .project(&self.nodes.supports, nodes.start, new);
        for ((p, v), m) in momenta.iter_mut().zip(&*new).zip(masses) {
            *p = *v * *m;
        }
        let kinetic = 0.5 * dot_in_order(momenta, new);
        let left = kick.decay * kick.decay;
        sums.bad = !kinetic.is_finite();
        sums.kinetic = kinetic * left;
        sums.dissipated += kinetic * (1.0 - left);
        sums.momentum = sum_in_order(momenta) * kick.decay;
        if is_kicked {
            sums.lag = 0.5 * weighted_squares(masses, new, v);
        }
        if !sums.bad {
            combine(v, new, |_, new| new * kick.decay);
        }
        sums.potential = -dot_in_order(part(&self.nodes.loads, &nodes), part(x, &nodes));
        if self.gravity != DVec3::ZERO {
            let weighted = x[nodes].iter().zip(masses).map(|(x, m)| *x * *m);
            sums.potential -= weighted.sum::<DVec3>().dot(self.gravity);
        }
        sums
    }

    /// What nodes gain in velocity in a time (s) under all forces, `viscous` given for these
    /// nodes alone. Fixed parts of partly fixed nodes are still in it.
    #[inline(always)]
    fn kick(&self, nodes: &Range<usize>, viscous: &[DVec3], time: f64, gained: &mut [DVec3]) {
        let (forces, loads) = (&self.forces[nodes.clone()], part(&self.nodes.loads, nodes));
        if loads.is_empty() {
            gained.copy_from_slice(forces);
        } else {
            let sums = cast_slice_mut::<_, f64>(gained).iter_mut();
            let (forces, loads): (&[f64], &[f64]) = (cast_slice(forces), cast_slice(loads));
            for ((sum, force), load) in sums.zip(forces).zip(loads) {
                *sum = force + load;
            }
        }
        for more in [part(self.applied, nodes), viscous] {
            combine(gained, more, |sum, more| sum + more);
        }
        if self.gravity != DVec3::ZERO {
            for (sum, m) in gained.iter_mut().zip(&self.nodes.masses[nodes.clone()]) {
                *sum += self.gravity * *m;
            }
        }
        for (sum, inverse) in gained
            .iter_mut()
            .zip(&self.nodes.mobility.inverse[nodes.clone()])
        {
            *sum *= inverse * time;
        }
    }
}

/// First pass for a chunk, with the vector instructions that the processor offers: additions keep their order, so
/// bits do not depend on them.
struct Drift<'a> {
    sweep: &'a PassInput<'a>,
    viscous: &'a [DVec3],
    kick: Kick,
    first: usize,
    x: &'a mut [DVec3],
    v: &'a mut [DVec3],
}

impl WithSimd for Drift<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (sweep, kick) = (self.sweep, self.kick);
        let mut gained = [DVec3::ZERO; BLOCK];
        for at in blocks(0..self.v.len()) {
            let nodes = self.first + at.start..self.first + at.end;
            let (gained, x) = (&mut gained[..at.len()], &mut self.x[at.clone()]);
            let v = &mut self.v[at];
            sweep.kick(&nodes, part(self.viscous, &nodes), kick.time, gained);
            combine(v, gained, |v, gained| v * kick.decay + gained);
            let NodeConstants {
                mobility, supports, ..
            } = sweep.nodes;
            mobility.project(supports, nodes.start, v);
            combine(x, v, |x, v| x + v * kick.step);
        }
    }
}

/// Second pass for a chunk; see [`Drift`].
struct Finish<'a> {
    sweep: &'a PassInput<'a>,
    before: Before<'a>,
    kick: Kick,
    first: usize,
    x: &'a [DVec3],
    v: &'a mut [DVec3],
    viscous: &'a mut [DVec3],
}

impl WithSimd for Finish<'_> {
    type Output = Sums;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Sums {
        let mut sums = Sums::default();
        let mut buffers = [[DVec3::ZERO; BLOCK]; 2];
        for at in blocks(0..self.v.len()) {
            let nodes = self.first + at.start..self.first + at.end;
            let viscous = self.viscous.get_mut(at.clone()).unwrap_or_default();
            let out = (&mut self.v[at], viscous);
            let (before, kick) = (self.before, self.kick);
            let block = self.sweep;
            sums = sums.add(block.finish_block(before, kick, nodes, self.x, out, &mut buffers));
        }
        sums
    }
}

#[cfg(test)]
#[path = "sweep_tests.rs"]
mod tests;
