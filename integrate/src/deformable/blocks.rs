//! How far nodes may move before two samples that no list has as a pair could meet.

use super::CHUNK;
use super::disks::{ContactDisks, index};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::ops::Range;

/// Radius (spacings) of a block.
const RADIUS: f64 = 2.0;
/// Part of the room up to which it is enough to know by how much nodes moved otherwise than their block.
const BY_NODES: f64 = 0.5;
/// Pairs of blocks that are looked at alone while others have more room. With 32, 64 and 512 contact takes 0.95, 0.95 to 1.02 and
/// 1.01 of the time of forces in the run of a cut liver with contact, which is as much as two runs of one differ.
const CLOSEST: usize = 64;
/// Determinant of a block's inertia, over the cube of its trace, below which nodes do not tell how it turns.
const LEAST_INERTIA: f64 = 1e-6;

/// Samples of a body near each other at rest, each of which has a node in common with another.
#[derive(Debug, Clone)]
struct SampleBlock {
    body: u32,
    samples: Range<usize>,
    nodes: Range<usize>,
    /// Whether pairs of its samples were listed again since all were.
    is_restless: bool,
    /// How much farther than its nodes a sample may move.
    amplification: f64,
}

/// A block where pairs were listed.
#[derive(Debug, Clone)]
struct Listed {
    /// A sphere (m) around the samples.
    middle: DVec3,
    radius: f64,
    /// Largest of the samples' reaches and thicknesses (m).
    reach: f64,
    thickness: f64,
    /// Mean of the nodes' positions (m), and the inverse of their inertia (1/m²).
    mean: DVec3,
    inverse: DMat3,
}

/// Motion of a block as if it was rigid and turned a little, `x + drift + turn × (x − middle)`, and how far (m) samples may be
/// from that.
#[derive(Default)]
struct Motion {
    drift: DVec3,
    turn: DVec3,
    off: f64,
    /// How far (m) a sample may have come from where it was listed.
    way: f64,
}

/// How far (m) each node may move before lists lack a pair.
#[derive(Debug, Clone, Default)]
pub(super) struct Room {
    /// Of the closest pairs of blocks, ascending, and before others are as close.
    pub(super) pairs: Vec<(f64, [usize; 2])>,
    pub(super) others: f64,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Blocks {
    blocks: Vec<SampleBlock>,
    /// As all pairs were listed, and as those of restless blocks were.
    listed: [Vec<Listed>; 2],
    /// Of one block after the other.
    samples: Vec<u32>,
    nodes: Vec<u32>,
}

impl Blocks {
    /// However a body crumples, there are as many.
    pub(super) fn new(disks: &ContactDisks, widest: f64) -> Self {
        let row = |sample: usize| &disks.nodes[disks.row(sample)];
        // What touches nothing is in no block.
        let mut is_taken: Vec<bool> = disks.samples.iter().map(|s| s.area == 0.0).collect();
        let open = || (0..disks.len()).filter(|sample| disks.samples[*sample].area > 0.0);
        let count = open()
            .flat_map(row)
            .max()
            .map_or(0, |last| *last as usize + 1);
        let mut of_node = vec![Vec::new(); count];
        for sample in open() {
            for node in row(sample) {
                of_node[*node as usize].push(index(sample));
            }
        }
        let mut all = Self::default();
        let mut last = vec![usize::MAX; count];
        for seed in 0..disks.len() {
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
            let block = all.samples[first..].iter().map(|sample| *sample as usize);
            let most = |of: &dyn Fn(usize) -> f64| block.clone().map(of).fold(0.0, f64::max);
            all.blocks.push(SampleBlock {
                body: disks.samples[seed].body,
                is_restless: false,
                amplification: most(&|sample| disks.amplification(sample)),
                samples: first..all.samples.len(),
                nodes: first_node..all.nodes.len(),
            });
        }
        all
    }

    /// Makes some blocks restless and those with a sample that is, with all their samples, and no others.
    pub(super) fn rouse(&mut self, blocks: &[usize], is_restless: &mut [bool]) {
        for (number, block) in self.blocks.iter_mut().enumerate() {
            let samples = &self.samples[block.samples.clone()];
            block.is_restless = blocks.contains(&number)
                || samples.iter().any(|sample| is_restless[*sample as usize]);
            for sample in samples {
                is_restless[*sample as usize] = block.is_restless;
            }
        }
    }

    /// Takes over places (m) and reaches (m) of samples, on nodes at `positions` (m), where pairs are listed.
    pub(super) fn list(
        &mut self,
        again: bool,
        disks: &ContactDisks,
        (places, reaches): (&[DVec3], &[f64]),
        positions: &[DVec3],
    ) {
        let list = |block: &SampleBlock| {
            let all = || self.samples(block);
            let most = |of: &dyn Fn(usize) -> f64| all().map(of).fold(0.0, f64::max);
            let middle = all().map(|s| places[s]).sum::<DVec3>() / block.samples.len() as f64;
            let at =
                || (self.nodes[block.nodes.clone()].iter()).map(|node| positions[*node as usize]);
            let mean = at().sum::<DVec3>() / block.nodes.len() as f64;
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
            Listed {
                middle,
                radius: most(&|sample| places[sample].distance(middle)),
                reach: most(&|sample| reaches[sample]),
                thickness: most(&|sample| disks.thickness[sample].abs()),
                mean,
                inverse,
            }
        };
        let listed = self.blocks.iter().map(list).collect();
        if again {
            self.listed[1] = listed;
        } else {
            self.listed = [listed, Vec::new()];
        }
    }

    fn samples(&self, block: &SampleBlock) -> impl Iterator<Item = usize> + use<'_> {
        let samples = &self.samples[block.samples.clone()];
        samples.iter().map(|sample| *sample as usize)
    }

    /// How far (m) each node may move from `positions` before lists lack a pair that meets, negative if they may do so by now, and
    /// blocks to be listed again then: as the `closest` pairs of blocks have it, or as all do, of which it finds the closest.
    /// Nodes were `from` where all pairs were listed, and where those of restless blocks were.
    pub(super) fn room_left(
        &self,
        (disks, from): (&ContactDisks, [&[DVec3]; 2]),
        positions: &[DVec3],
        (margin, far, may_meet): (f64, impl Fn(f64, f64) -> f64, impl Fn(u32, u32) -> bool),
        closest: Option<&[(f64, [usize; 2])]>,
    ) -> (Room, Vec<usize>) {
        // Of restless blocks all pairs were listed again.
        let asks = |which: usize, block: &SampleBlock| {
            closest.is_none() && (which == 1 || !block.is_restless)
        };
        let mut moves = [0, 1].map(|which| -> Vec<bool> {
            let listed = self.blocks.iter().zip(&self.listed[which]);
            listed.map(|(block, _)| asks(which, block)).collect()
        });
        for &(_, pair) in closest.into_iter().flatten() {
            for number in pair {
                moves[self.listing(pair)][number] = true;
            }
        }
        let motions = [0, 1].map(|which| -> Vec<Motion> {
            let motion = |number: usize| {
                let at = (&self.blocks[number], &self.listed[which][number]);
                self.motion(at, (disks, from[which]), positions, margin)
            };
            let blocks = moves[which].par_iter().with_min_len(CHUNK).enumerate();
            let motion = |(number, moves): (usize, &bool)| moves.then(|| motion(number));
            blocks
                .map(|block| motion(block).unwrap_or_default())
                .collect()
        });
        let pairs = closest.map_or_else(
            || self.pairs_within(&motions, far(0.0, 0.0), margin),
            |closest| closest.iter().map(|(_, pair)| *pair).collect(),
        );
        let (mut rooms, mut spent) = (Vec::new(), Vec::new());
        for pair in pairs {
            let [block, other] = pair.map(|number| &self.blocks[number]);
            if !may_meet(block.body, other.body) {
                continue;
            }
            let left = self.left(pair, &motions, margin, &far);
            rooms.push((left / (block.amplification + other.amplification), pair));
            if left < 0.0 && self.listing(pair) == 0 {
                let [own, its] = pair.map(|number| motions[0][number].way);
                spent.push(pair[usize::from(own < its)]);
            }
        }
        let by_room = |a: &(f64, _), b: &(f64, _)| a.0.total_cmp(&b.0);
        let mut others = margin;
        if rooms.len() > CLOSEST {
            let (_, (next, _), _) = rooms.select_nth_unstable_by(CLOSEST, by_room);
            others = others.min(*next);
            rooms.truncate(CLOSEST);
        }
        rooms.sort_unstable_by(by_room);
        let pairs = rooms;
        (Room { pairs, others }, spent)
    }

    /// Which listing a pair of blocks is in.
    fn listing(&self, [a, b]: [usize; 2]) -> usize {
        usize::from(self.blocks[a].is_restless || self.blocks[b].is_restless)
    }

    /// Pairs of blocks that leave nodes less than `most` (m), and others; what has neither reach nor thickness is in no list from
    /// `far` (m) on.
    fn pairs_within(&self, motions: &[Vec<Motion>; 2], far: f64, most: f64) -> Vec<[usize; 2]> {
        let spheres = [0, 1].map(|which| -> Vec<(DVec3, f64)> {
            let all = (self.blocks.iter().zip(&self.listed[which])).zip(&motions[which]);
            let sphere = |((block, at), own): ((&SampleBlock, &Listed), &Motion)| {
                let span = own.way + at.radius + at.thickness + at.reach;
                (at.middle, span + 0.5 * far + block.amplification * most)
            };
            all.map(sphere).collect()
        });
        let mut pairs = Vec::new();
        for number in 0..self.blocks.len() {
            for second in 0..=number {
                let spheres = &spheres[self.listing([number, second])];
                let [(x, own), (y, its)] = [spheres[number], spheres[second]];
                if x.distance_squared(y) < (own + its).powi(2) {
                    pairs.push([number, second]);
                }
            }
        }
        pairs
    }

    /// How far (m) the blocks of a pair, together, may move on. Displacements `a + ω × r` bring no two points nearer to each other,
    /// so blocks that turn together have all the room.
    fn left(
        &self,
        pair: [usize; 2],
        motions: &[Vec<Motion>; 2],
        margin: f64,
        far: &impl Fn(f64, f64) -> f64,
    ) -> f64 {
        let which = self.listing(pair);
        let [at, there] = pair.map(|number| &self.listed[which][number]);
        let [own, its] = pair.map(|number| &motions[which][number]);
        let arm = there.middle - at.middle;
        let far = far(at.reach.max(there.reach), at.thickness + there.thickness);
        let apart = arm.length() - at.radius - there.radius - far;
        let has = margin + apart.max(0.0);
        let by = its.drift - own.drift;
        let turned = (its.turn - own.turn).length();
        // Either may be the one that the other moves against.
        let against = ((by - own.turn.cross(arm)).length() + turned * there.radius)
            .min((by - its.turn.cross(arm)).length() + turned * at.radius);
        (has - own.way - its.way).max(has - own.off - its.off - against)
    }

    /// All pairs of samples, of which one is restless if these are listed `again`, that are as near as `far` of the larger reach
    /// and both thicknesses (m), as `found` has them of their squared distance (m²). Samples are where they were last listed.
    pub(super) fn near_samples<T: Send>(
        &self,
        again: bool,
        places: &[DVec3],
        far: impl Fn(f64, f64) -> f64 + Sync,
        found: impl Fn(usize, usize, f64, &mut Vec<T>) + Sync,
    ) -> Vec<T> {
        let listed = &self.listed[usize::from(again)];
        let placed = self.samples.iter().map(|&sample| {
            let sample = sample as usize;
            (sample, places[sample])
        });
        let placed: Vec<(usize, DVec3)> = placed.collect();
        let of = |number: usize| {
            let (block, at) = (&self.blocks[number], &listed[number]);
            let mut all = Vec::new();
            for (other, there) in self.blocks.iter().zip(listed).take(number + 1) {
                let far = far(at.reach.max(there.reach), at.thickness + there.thickness);
                let is_far = |x: DVec3, radius: f64| {
                    x.distance_squared(there.middle) >= (radius + there.radius + far).powi(2)
                };
                let is_new = !again || block.is_restless || other.is_restless;
                if !is_new || is_far(at.middle, at.radius) {
                    continue;
                }
                for n in block.samples.clone() {
                    let (p, x) = placed[n];
                    if is_far(x, 0.0) {
                        continue;
                    }
                    for &(q, y) in &placed[other.samples.start..n.min(other.samples.end)] {
                        let square = x.distance_squared(y);
                        if square < far * far {
                            found(p, q, square, &mut all);
                        }
                    }
                }
            }
            all
        };
        let all: Vec<Vec<T>> = (0..self.blocks.len()).into_par_iter().map(of).collect();
        all.into_iter().flatten().collect()
    }

    fn motion(
        &self,
        (block, at): (&SampleBlock, &Listed),
        (disks, from): (&ContactDisks, &[DVec3]),
        positions: &[DVec3],
        margin: f64,
    ) -> Motion {
        let nodes = &self.nodes[block.nodes.clone()];
        let moves = || {
            nodes.iter().map(|&node| {
                let x = from[node as usize];
                (x - at.mean, positions[node as usize] - x)
            })
        };
        let zero = (DVec3::ZERO, DVec3::ZERO);
        let sum = moves().fold(zero, |sum, (r, u)| (sum.0 + u, sum.1 + r.cross(u)));
        let (drift, turn) = (sum.0 / nodes.len() as f64, at.inverse * sum.1);
        let off = |(r, u): (DVec3, DVec3)| (u - drift - turn.cross(r)).length_squared();
        let most = moves().map(off).fold(0.0, f64::max).sqrt();
        let mut off_rigid = block.amplification * most;
        if off_rigid > BY_NODES * 0.5 * margin {
            let of_sample = self.samples(block).map(|sample| {
                if disks.row(sample).len() <= 3 {
                    return (disks.amplification(sample) * most).powi(2);
                }
                let [x, now] = [from, positions].map(|x| disks.point(sample, x));
                off((x - at.mean, now - x))
            });
            off_rigid = of_sample.fold(0.0, f64::max).sqrt();
        }
        let drift = drift + turn.cross(at.middle - at.mean);
        Motion {
            drift,
            turn,
            off: off_rigid,
            way: off_rigid + drift.length() + turn.length() * at.radius,
        }
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.blocks)
            + size_of_val(&*self.listed[0])
            + size_of_val(&*self.listed[1])
            + size_of_val(&*self.samples)
            + size_of_val(&*self.nodes)
    }
}
