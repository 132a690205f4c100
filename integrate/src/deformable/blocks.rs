//! How far nodes may move before two samples that no list has as a pair could meet.

use super::disks::{ContactDisks, DiskSample, index};
use glam::{DMat3, DVec3};
use std::ops::Range;

/// Radius (spacings) of a block.
const RADIUS: f64 = 2.0;
/// Part of the room up to which it is enough to know by how much nodes moved otherwise than their block.
const BY_NODES: f64 = 0.5;
/// Determinant of a block's inertia, over the cube of its trace, below which nodes do not tell how it turns.
const LEAST_INERTIA: f64 = 1e-6;

/// Samples of a body near each other, each of which has a node in common with another.
#[derive(Debug, Clone)]
struct Block {
    body: u32,
    samples: Range<usize>,
    nodes: Range<usize>,
    /// A sphere (m) around the samples.
    middle: DVec3,
    radius: f64,
    /// Largest of the samples' reaches and thicknesses (m).
    reach: f64,
    thickness: f64,
    /// How much farther than its nodes a sample may move.
    amplification: f64,
    /// Mean of the nodes' positions (m), and the inverse of their inertia (1/m²).
    mean: DVec3,
    inverse: DMat3,
}

/// Motion of a block as if it was rigid and turned a little, `x + drift + turn × (x − middle)`, and how far (m) samples may be
/// from that.
struct Motion {
    drift: DVec3,
    turn: DVec3,
    off: f64,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Blocks {
    blocks: Vec<Block>,
    /// Of one block after the other.
    samples: Vec<u32>,
    nodes: Vec<u32>,
}

impl Blocks {
    /// Blocks of samples at places (m) and with reaches (m), on nodes at `positions` (m). Those near at rest are together: however
    /// a body crumples, there are as many.
    pub(super) fn new(
        disks: &ContactDisks,
        (places, reaches): (&[DVec3], &[f64]),
        positions: &[DVec3],
        widest: f64,
    ) -> Self {
        let row = |sample: usize| &disks.nodes[disks.row(sample)];
        let mut of_node = vec![Vec::new(); positions.len()];
        // What touches nothing is in no block.
        let is_inert = |sample: &DiskSample| sample.area == 0.0;
        let samples = disks.samples.iter().take(places.len());
        let mut is_taken: Vec<bool> = samples.map(is_inert).collect();
        for (sample, _) in is_taken.iter().enumerate().filter(|(_, taken)| !**taken) {
            for node in row(sample) {
                of_node[*node as usize].push(index(sample));
            }
        }
        let mut all = Self::default();
        let mut last = vec![usize::MAX; positions.len()];
        for seed in 0..places.len() {
            if std::mem::replace(&mut is_taken[seed], true) {
                continue;
            }
            let (first, first_node) = (all.samples.len(), all.nodes.len());
            let mut next = first;
            all.samples.push(index(seed));
            while let Some(sample) = all.samples.get(next) {
                next += 1;
                for node in row(*sample as usize) {
                    if std::mem::replace(&mut last[*node as usize], seed) == seed {
                        continue;
                    }
                    all.nodes.push(*node);
                    for &other in &of_node[*node as usize] {
                        let at = other as usize;
                        let [one, own] = [at, seed].map(|sample| &disks.samples[sample]);
                        let apart = one.position.distance_squared(own.position);
                        let is_near = apart < (RADIUS * widest).powi(2) && one.body == own.body;
                        if is_near && !is_taken[at] {
                            is_taken[at] = true;
                            all.samples.push(other);
                        }
                    }
                }
            }
            let nodes = first_node..all.nodes.len();
            let block = all.block(
                first..all.samples.len(),
                nodes,
                disks,
                (places, reaches, positions),
            );
            all.blocks.push(block);
        }
        all
    }

    fn block(
        &self,
        samples: Range<usize>,
        nodes: Range<usize>,
        disks: &ContactDisks,
        (places, reaches, positions): (&[DVec3], &[f64], &[DVec3]),
    ) -> Block {
        let all = || (self.samples[samples.clone()].iter()).map(|sample| *sample as usize);
        let most = |of: &dyn Fn(usize) -> f64| all().map(of).fold(0.0, f64::max);
        let middle = all().map(|s| places[s]).sum::<DVec3>() / samples.len() as f64;
        let at = || (self.nodes[nodes.clone()].iter()).map(|node| positions[*node as usize]);
        let mean = at().sum::<DVec3>() / nodes.len() as f64;
        let inertia = at().fold(DMat3::ZERO, |sum, x| {
            let r = x - mean;
            let outer = DMat3::from_cols(r * r.x, r * r.y, r * r.z);
            sum + DMat3::from_diagonal(DVec3::splat(r.length_squared())) - outer
        });
        let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
        let inverse = if inertia.determinant() > LEAST_INERTIA * trace.powi(3) {
            inertia.inverse()
        } else {
            DMat3::ZERO
        };
        Block {
            body: disks.samples[self.samples[samples.start] as usize].body,
            middle,
            radius: most(&|sample| places[sample].distance(middle)),
            reach: most(&|sample| reaches[sample]),
            thickness: most(&|sample| disks.thickness[sample].abs()),
            amplification: most(&|sample| disks.amplification(sample)),
            mean,
            inverse,
            samples,
            nodes,
        }
    }

    /// How far (m) each node may move from `positions` before lists that were made where nodes were `from` lack a pair that meets;
    /// negative if they may do so by now.
    ///
    /// Displacements `a + ω × r` bring no two points nearer to each other, so blocks that turn together have all the room.
    pub(super) fn room_left(
        &self,
        (disks, from): (&ContactDisks, &[DVec3]),
        positions: &[DVec3],
        (margin, far, may_meet): (f64, impl Fn(f64, f64) -> f64, impl Fn(u32, u32) -> bool),
    ) -> f64 {
        let motions: Vec<Motion> = (self.blocks.iter())
            .map(|block| self.motion(block, (disks, from), positions, margin))
            .collect();
        let mut room = f64::MAX;
        for (number, (block, own)) in self.blocks.iter().zip(&motions).enumerate() {
            for (other, its) in self.blocks.iter().zip(&motions).take(number + 1) {
                if !may_meet(block.body, other.body) {
                    continue;
                }
                let (arm, by) = (other.middle - block.middle, its.drift - own.drift);
                let turned = (its.turn - own.turn).length();
                // Either may be the one that the other moves against.
                let against = ((by - own.turn.cross(arm)).length() + turned * other.radius)
                    .min((by - its.turn.cross(arm)).length() + turned * block.radius);
                let far = far(
                    block.reach.max(other.reach),
                    block.thickness + other.thickness,
                );
                let apart = arm.length() - block.radius - other.radius - far;
                let left = margin + apart.max(0.0) - own.off - its.off - against;
                room = room.min(left / (block.amplification + other.amplification));
            }
        }
        room
    }

    fn motion(
        &self,
        block: &Block,
        (disks, from): (&ContactDisks, &[DVec3]),
        positions: &[DVec3],
        margin: f64,
    ) -> Motion {
        let nodes = &self.nodes[block.nodes.clone()];
        let moves = || {
            nodes.iter().map(|&node| {
                let x = from[node as usize];
                (x - block.mean, positions[node as usize] - x)
            })
        };
        let zero = (DVec3::ZERO, DVec3::ZERO);
        let sum = moves().fold(zero, |sum, (r, u)| (sum.0 + u, sum.1 + r.cross(u)));
        let (drift, turn) = (sum.0 / nodes.len() as f64, block.inverse * sum.1);
        let off = |(r, u): (DVec3, DVec3)| (u - drift - turn.cross(r)).length_squared();
        let most = moves().map(off).fold(0.0, f64::max).sqrt();
        let mut motion = Motion {
            drift: drift + turn.cross(block.middle - block.mean),
            turn,
            off: block.amplification * most,
        };
        if motion.off > BY_NODES * 0.5 * margin {
            let of_sample = self.samples[block.samples.clone()].iter().map(|&sample| {
                let [x, now] = [from, positions].map(|x| disks.gather(sample as usize, x).0);
                off((x - block.mean, now - x))
            });
            motion.off = of_sample.fold(0.0, f64::max).sqrt();
        }
        motion
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.blocks) + size_of_val(&*self.samples) + size_of_val(&*self.nodes)
    }
}
