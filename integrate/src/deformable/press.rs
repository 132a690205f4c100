//! Forces of one point and the disks opposite of it.

use super::disks::{Placed, REACH};
use super::drag::{Drag, RigidMotions};
use super::sums::{DeformableForce, sum_of};
use super::{
    CHUNK, DEEPEST, DeformableContact, FACING, FACING_IN_FULL, FADE, MOST_LEARNING, Moved, NEAR,
    SINKING,
};
use glam::DVec3;
use rayon::prelude::*;

/// How fast an offset is forgotten, over how fast it learns: pressure ends at that of a penalty `1 + 1/LEAK` times as
/// stiff. There are more points than nodes, so that gaps cannot all close: without it offsets drift against each other
/// for ever, and a sixth of the area under a pad let go within 4 s; at 0.1 a twentieth. At 0.1 pressed blocks carry 0.7 %
/// less than one block.
pub(super) const LEAK: f64 = 0.05;
/// Largest learned offset (spacings).
const LARGEST_OFFSET: f64 = 0.25;
/// Sum of the disks' weights, over that amid an unbounded sheet, from which they are normalised. Half of it is opposite
/// a straight rim.
const LEAST: f64 = 0.5 * std::f64::consts::PI * REACH * REACH / 3.0;

/// Area of a disk, over that at rest, at which it presses and is pressed no longer, and up to which it does so in full: feet
/// on a disk that collapses run away as the inverse of the square of its area. Without, a crumpled mesh in contact (`random --all`,
/// seed 93, scene 083) kept 14 % of its energy; with it all but 0.02 %.
const COLLAPSED: f64 = 0.1;
const WHOLE: f64 = 0.3;

/// What a disk gets of a point: the force and those conjugate to its tangents.
pub(super) struct Touch {
    pub(super) slot: u32,
    pub(super) load: (DVec3, [DVec3; 2]),
}

#[derive(Default)]
pub(super) struct ChunkForces {
    pub(super) touches: Vec<Touch>,
    pub(super) points: Vec<Pressed>,
    pub(super) drags: Vec<Drag>,
    pub(super) between: Vec<DeformableForce>,
}

/// What became of a point.
pub(super) struct Pressed {
    pub(super) point: u32,
    pub(super) slot: u32,
    pub(super) force: DVec3,
    pub(super) offset: f64,
    pub(super) slip: [f64; 2],
    pub(super) energy: f64,
    pub(super) dissipated: f64,
    pub(super) offset_work: f64,
}

/// A pair in reach.
pub(super) struct PairInReach {
    pub(super) slot: u32,
    pub(super) stiffness: f64,
    pub(super) xi: [f64; 2],
    /// Between the rows' positions, and between the surfaces (m).
    pub(super) raw: f64,
    pub(super) gap: f64,
    /// `1 − |ξ|²/R²`, and by how much the normals face each other, with its derivative by their cosine.
    pub(super) inside: f64,
    pub(super) facing: [f64; 2],
    /// By how much it is near enough and not too deep, with its derivative by the gap (1/m).
    pub(super) close: [f64; 2],
    /// By how much the point's disk and the other are whole, with its derivatives by their areas.
    pub(super) whole: (f64, [f64; 2]),
    pub(super) phi: f64,
    /// Coefficient of friction.
    pub(super) friction: f64,
}

/// Forces of an energy that is a pair's weight times a number.
struct ByWeight {
    /// Along the disk, over the foot's coordinates: −∂E/∂ξ of the weight alone, as gaps do not depend on where the foot is.
    slope: f64,
    /// Along the disk's normal (N).
    fade: f64,
    /// Conjugate to the cosine of the normals, and to the areas of the point's disk and the other (J).
    bend: f64,
    spread: [f64; 2],
}

impl PairInReach {
    /// Those of `per_weight` (J) on a disk that reaches so far (m).
    fn by_weight(&self, per_weight: f64, reach: f64) -> ByWeight {
        let (whole, spread) = self.whole;
        let all = per_weight * whole;
        ByWeight {
            slope: 4.0 * self.inside * self.facing[0] * self.close[0] / reach.powi(2) * all,
            fade: -all * self.inside.powi(2) * self.facing[0] * self.close[1],
            bend: -all * self.inside.powi(2) * self.facing[1] * self.close[0],
            spread: spread.map(|by_area| {
                -per_weight * self.inside.powi(2) * self.facing[0] * self.close[0] * by_area
            }),
        }
    }
}

impl ByWeight {
    /// Adds what turns and spreads the disks of a pair, each with its slot.
    fn turn(&self, [own, other]: [(u32, &Placed); 2], touches: &mut Vec<Touch>) {
        if self.bend == 0.0 && self.spread.iter().all(|load| *load == 0.0) {
            return;
        }
        let both = [(own, other, self.spread[0]), (other, own, self.spread[1])];
        touches.extend(both.map(|((slot, disk), (_, across), spread)| Touch {
            slot,
            load: (DVec3::ZERO, turning(disk, across.n * self.bend, spread)),
        }));
    }
}

/// A smooth step from 0 at `none` to 1 at `full`, and its derivative.
fn smooth_step(x: f64, none: f64, full: f64) -> [f64; 2] {
    let width = full - none;
    let u = ((x - none) / width).clamp(0.0, 1.0);
    [u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) / width]
}

/// Forces conjugate to the tangents of a disk of one that is conjugate to its normal, and of a number (J) conjugate to its
/// area.
fn turning(disk: &Placed, force: DVec3, spread: f64) -> [DVec3; 2] {
    let [a, b] = disk.t;
    let bent = (force - disk.n * force.dot(disk.n)) / disk.area.max(f64::MIN_POSITIVE);
    let bent = bent + disk.n * spread;
    [b.cross(bent), bent.cross(a)]
}

/// How the pairs of a point share friction: by their weights times their coefficients.
#[derive(Clone, Copy)]
struct Rubbing {
    /// Largest coefficient.
    most: f64,
    /// Sum of weights times coefficients over it.
    sum: f64,
}

impl Rubbing {
    fn of(pairs: &[PairInReach]) -> Self {
        let most = pairs.iter().map(|pair| pair.friction).fold(0.0, f64::max);
        let mut all = Self { most, sum: 0.0 };
        let weights = pairs.iter().map(|pair| all.weight(pair) * pair.phi);
        all.sum = weights.sum::<f64>().max(f64::MIN_POSITIVE);
        all
    }

    /// Coefficient over the largest.
    fn weight(self, pair: &PairInReach) -> f64 {
        pair.friction / self.most.max(f64::MIN_POSITIVE)
    }

    fn share(self, pair: &PairInReach) -> f64 {
        self.weight(pair) * pair.phi / self.sum
    }
}

/// What weights of pairs are divided by.
pub(super) fn norm(pairs: &[PairInReach]) -> f64 {
    pairs.iter().map(|pair| pair.phi).sum::<f64>().max(LEAST)
}

/// Energy (J) of a slip ([`super::DeformableState::slips`]).
fn energy_of([a, b]: [f64; 2]) -> f64 {
    0.5 * (a * a + b * b)
}

impl DeformableContact {
    /// Disks, of a list, that a point is opposite of, no farther above them than `near` (spacings).
    pub(super) fn find_pairs(
        &self,
        point: u32,
        list: &[u32],
        placed: &[Placed],
        near: f64,
        pairs: &mut Vec<PairInReach>,
    ) {
        pairs.clear();
        let p = &placed[point as usize];
        let [own, own_slope] = smooth_step(p.area, COLLAPSED, WHOLE);
        for &slot in list {
            let q = &placed[slot as usize];
            let cosine = p.n.dot(q.n);
            // Where a smooth step begins.
            if cosine >= FACING {
                continue;
            }
            let arm = p.x - q.x;
            let raw = q.n.dot(arm);
            let gap = raw - p.thickness - q.thickness;
            let spacing = p.spacing.min(q.spacing);
            let depth = gap / spacing;
            if depth >= near || depth <= -DEEPEST {
                continue;
            }
            let xi = q.solve([q.t[0].dot(arm), q.t[1].dot(arm)]);
            let inside = 1.0 - (xi[0] * xi[0] + xi[1] * xi[1]) / (q.reach * q.reach);
            let [opposite, slope] = smooth_step(q.area, COLLAPSED, WHOLE);
            let whole = (own * opposite, [own_slope * opposite, own * slope]);
            if inside > 0.0 && whole.0 > 0.0 {
                let faces = smooth_step(cosine, FACING, FACING_IN_FULL);
                let [out, slope_out] = smooth_step(depth, near, near - FADE);
                let [deep, slope_deep] = smooth_step(depth, -DEEPEST, SINKING - DEEPEST);
                let close = [out * deep, (slope_out * deep + out * slope_deep) / spacing];
                let phi = inside * inside * faces[0] * close[0] * whole.0;
                let [point, other] = [point, slot].map(|slot| self.near[slot as usize]);
                let stiffness = self.stiffness(point, other);
                let friction = if self.rubs {
                    let bodies = [point, other].map(|s| self.disks.samples[s as usize].body);
                    self.between_bodies(bodies[0], bodies[1]).unwrap_or(0.0)
                } else {
                    0.0
                };
                pairs.push(PairInReach {
                    slot,
                    stiffness,
                    xi,
                    raw,
                    gap,
                    inside,
                    facing: faces,
                    close,
                    whole,
                    phi,
                    friction,
                });
            }
        }
    }

    /// What the pairs of each listed point are where samples are.
    pub(super) fn each_point(
        &self,
        placed: &[Placed],
        mut visit: impl FnMut(usize, &[PairInReach]),
    ) {
        let mut pairs = Vec::new();
        for (slot, range) in &self.points {
            self.find_pairs(*slot, self.listed(range), placed, NEAR, &mut pairs);
            visit(self.near[*slot as usize] as usize, &pairs);
        }
    }

    /// All samples in lists where nodes are (m).
    pub(super) fn place(&self, positions: &[DVec3]) -> Vec<Placed> {
        let place = |&sample: &u32| self.disks.place(sample as usize, positions);
        let near = self.near.par_iter().with_min_len(CHUNK);
        near.map(place).collect()
    }

    /// Energy (J) and normal force (N) of the springs of a point with an offset (m). Half, as the other side has points,
    /// too.
    pub(super) fn springs(&self, point: usize, pairs: &[PairInReach], offset: f64) -> [f64; 2] {
        self.weighted_springs(point, pairs, offset, |_| 1.0)
    }

    /// The same with a weight of each pair's force.
    fn weighted_springs(
        &self,
        point: usize,
        pairs: &[PairInReach],
        offset: f64,
        weight: impl Fn(&PairInReach) -> f64,
    ) -> [f64; 2] {
        let half = 0.5 * self.disks.samples[point].area / norm(pairs);
        pairs.iter().fold([0.0; 2], |[energy, force], pair| {
            let depth = (offset - pair.gap).max(0.0);
            let tension = half * pair.phi * pair.stiffness * depth;
            [
                energy + 0.5 * tension * depth,
                force + tension * weight(pair),
            ]
        })
    }

    /// Forces of a point's pairs, and what it learns.
    pub(super) fn press(
        &self,
        slot: u32,
        pairs: &[PairInReach],
        (placed, motions): (&[Placed], &[(DVec3, [DVec3; 2])]),
        (moved, rigid): (&Moved<'_>, &RigidMotions),
        chunk: &mut ChunkForces,
    ) {
        let point = self.near[slot as usize];
        let at = &self.disks.samples[point as usize];
        let mut offset = self.state.offsets[point as usize];
        if offset.is_nan() {
            // No push before anything moves.
            offset = pairs.iter().map(|pair| pair.gap).fold(0.0, f64::min);
        }
        let largest = LARGEST_OFFSET * at.spacing;
        let learning = (self.settings.learning * moved.step).min(MOST_LEARNING);
        let mut pressed = self.unpressed([slot, point], (offset - learning * largest).max(0.0));
        if pairs.is_empty() {
            chunk.points.push(pressed);
            return;
        }
        // Half: the other side has points, too.
        let spring = |pair: &PairInReach| 0.5 * at.area * pair.stiffness;
        let sum: f64 = pairs.iter().map(|pair| pair.phi).sum();
        let norm = norm(pairs);
        let [mean, normal] = self.springs(point as usize, pairs, offset);
        let gap = pairs.iter().map(|pair| pair.phi * pair.gap).sum::<f64>() / sum;
        // The largest offset that learns nothing but to close.
        let learned = (offset - learning * (gap + LEAK * offset)).min(largest);
        pressed.offset = if gap > 0.0 { learned.max(0.0) } else { learned };
        pressed.energy = mean;
        pressed.offset_work = self.springs(point as usize, pairs, pressed.offset)[0] - mean;
        let stiffness = pairs
            .iter()
            .map(|pair| spring(pair) * pair.phi)
            .sum::<f64>()
            / norm;
        let rubbing = Rubbing::of(pairs);
        let (traction, held) = self.rub(
            &mut pressed,
            (normal, stiffness, offset),
            (pairs, rubbing),
            (placed, motions),
        );
        let mut normals = DVec3::ZERO;
        let is_pressed = pairs.iter().any(|pair| offset > pair.gap);
        for pair in pairs {
            let q = &placed[pair.slot as usize];
            let share = pair.phi / norm;
            let other = self.disks.samples[self.near[pair.slot as usize] as usize].body;
            let between = sum_of(&mut chunk.between, [at.body, other]);
            between.penetration = between.penetration.max(-gap * sum / norm);
            if !is_pressed {
                continue;
            }
            let deep = (offset - pair.gap).max(0.0);
            let stored = 0.5 * spring(pair) * deep * deep;
            if deep > 0.0 {
                between.area += 0.5 * at.area * share;
            }
            let per_weight = (stored - if norm > LEAST { mean } else { 0.0 }) / norm;
            let by_weight = pair.by_weight(per_weight, q.reach);
            let both = [(slot, &placed[slot as usize]), (pair.slot, q)];
            by_weight.turn(both, &mut chunk.touches);
            let tangential = rubbing.share(pair);
            let along =
                [0, 1].map(|k| by_weight.slope * pair.xi[k] + tangential * traction.dot(q.t[k]));
            let pressure = spring(pair) * share * deep;
            let normal_force = pressure + by_weight.fade;
            normals += q.n * normal_force;
            if normal_force == 0.0 && along[0] == 0.0 && along[1] == 0.0 {
                continue;
            }
            let [a, b] = q.solve(along);
            let force = q.n * normal_force + q.t[0] * a + q.t[1] * b;
            pressed.force += force;
            between.normal += pressure;
            between.friction += tangential * traction.length();
            between.push([at.body, other], force);
            let turn = q.n * pair.raw;
            let moments = [turn * a - force * pair.xi[0], turn * b - force * pair.xi[1]];
            chunk.touches.push(Touch {
                slot: pair.slot,
                load: (-force, moments),
            });
        }
        if self.settings.drag > 0.0 && normal > 0.0 {
            self.drag(
                &pressed,
                (normals.normalize_or_zero(), normal, held),
                pairs,
                (placed, motions),
                (moved, rigid),
                chunk,
            );
        }
        chunk.points.push(pressed);
    }

    /// What becomes of a point, by its slot and number, that nothing is opposite of: its offset (m) is forgotten, as if it
    /// were far, and its slip let go.
    fn unpressed(&self, [slot, point]: [u32; 2], offset: f64) -> Pressed {
        let slip = self.state.slips.get(point as usize);
        Pressed {
            point,
            slot,
            force: DVec3::ZERO,
            offset,
            slip: [0.0; 2],
            energy: 0.0,
            dissipated: slip.map_or(0.0, |slip| energy_of(*slip)),
            offset_work: 0.0,
        }
    }

    /// Drag at a point that is pressed by `normal` (N) and holds on to the other surface by `held` (N).
    fn drag(
        &self,
        pressed: &Pressed,
        (n, normal, held): (DVec3, f64, f64),
        pairs: &[PairInReach],
        (placed, motions): (&[Placed], &[(DVec3, [DVec3; 2])]),
        (moved, rigid): (&Moved<'_>, &RigidMotions),
        chunk: &mut ChunkForces,
    ) {
        let Some(nearest) = pairs.iter().max_by(|a, b| a.phi.total_cmp(&b.phi)) else {
            return;
        };
        let pieces = [pressed.point, self.near[nearest.slot as usize]]
            .map(|sample| self.piece_of(sample, moved));
        if pieces[0] == pieces[1] {
            return;
        }
        let at = placed[pressed.slot as usize].x;
        let (dx, dt) = motions[nearest.slot as usize];
        let own = rigid
            .at(pieces[0], at)
            .unwrap_or(motions[pressed.slot as usize].0);
        let other = rigid.at(pieces[1], at);
        let foot = || dx + dt[0] * nearest.xi[0] + dt[1] * nearest.xi[1];
        let by = own - other.unwrap_or_else(foot);
        let along = n * n.dot(by);
        let force = (along * normal + (by - along) * held) * (-self.settings.drag / moved.step);
        chunk.drags.push(Drag {
            pieces,
            own: pressed.slot,
            at,
            force,
            normal,
            taken: -force.dot(by),
            disk: (nearest.slot, nearest.xi),
        });
    }

    /// Frictional force (N) on a point that is pressed by `normal` (N), by return mapping, and as much of the latter as
    /// is not used up by it.
    fn rub(
        &self,
        pressed: &mut Pressed,
        (normal, stiffness, offset): (f64, f64, f64),
        (pairs, rubbing): (&[PairInReach], Rubbing),
        (placed, motions): (&[Placed], &[(DVec3, [DVec3; 2])]),
    ) -> (DVec3, f64) {
        if rubbing.most == 0.0 || normal <= 0.0 {
            return (DVec3::ZERO, 0.0);
        }
        let weight = |pair: &PairInReach| rubbing.weight(pair);
        let [_, rubbed] = self.weighted_springs(pressed.point as usize, pairs, offset, weight);
        let (p, (moves, _)) = (
            &placed[pressed.slot as usize],
            motions[pressed.slot as usize],
        );
        let mut moved = DVec3::ZERO;
        for pair in pairs {
            let (q, (dx, dt)) = (&placed[pair.slot as usize], motions[pair.slot as usize]);
            let along = moves - dx - dt[0] * pair.xi[0] - dt[1] * pair.xi[1];
            let rate = [0, 1].map(|k| q.t[k].dot(along) + pair.raw * dt[k].dot(q.n));
            let [a, b] = q.solve(rate);
            moved += (q.t[0] * a + q.t[1] * b) * rubbing.share(pair);
        }
        let first = p.t[0].normalize_or_zero();
        let second = p.n.cross(first);
        let root = stiffness.sqrt();
        let before = self.state.slips[pressed.point as usize].map(|x| x / root);
        let slip = [before[0] + first.dot(moved), before[1] + second.dot(moved)];
        let length = slip[0].hypot(slip[1]);
        let limit = rubbing.most * rubbed;
        let held = (limit / stiffness).min(length);
        let share = if length > 0.0 { held / length } else { 0.0 };
        pressed.slip = slip.map(|x| x * share * root);
        pressed.energy += energy_of(pressed.slip);
        pressed.dissipated = limit * (length - held);
        let spring = (first * pressed.slip[0] + second * pressed.slip[1]) * -root;
        let used = if rubbed > 0.0 {
            stiffness * held / rubbing.most * (normal / rubbed)
        } else {
            0.0
        };
        (spring, normal - used)
    }
}
