//! Contact of deformable surfaces with each other and with themselves: a penalty with a learned offset, and friction.

mod blocks;
mod bodies;
pub(crate) mod disks;
mod drag;
mod kept;
mod lists;
mod press;
mod sums;
#[cfg(test)]
mod tests;

use crate::{BoundaryConditions, EigenvalueSettings};
use blocks::{Blocks, Room};
pub use bodies::TouchingNodes;
use disks::ContactDisks;
use drag::RigidMotions;
use glam::DVec3;
use press::{ChunkForces, Touch};
use rayon::prelude::*;
pub use sums::DeformableForce;
use sums::sum_of;

/// Points that a task of the parallel loop takes.
const CHUNK: usize = 64;
/// Penetration (spacings) beyond which a pair is taken for one that is not in contact.
const DEEPEST: f64 = 1.0;
/// Largest cosine between the normals of a pair: they face each other. At -0.2 the sides of a block that tilts by 12
/// degrees meet what lies on it, as if that had come from beside.
const FACING: f64 = -0.5;
/// Cosine from which on they do so in full. Weights that end at once fed a ball in a ring by a quarter of what was stored.
const FACING_IN_FULL: f64 = -0.9;
/// Gap (spacings) above which a pair plays no part.
const NEAR: f64 = 0.5;
/// Gap (spacings) over which weights fade towards [`NEAR`]: from the largest offset on, so that no spring is in it.
const FADE: f64 = 0.25;
/// Depth (spacings) over which they fade towards [`DEEPEST`]. Pairs that were dropped at once, one spacing deep, took and gave a
/// cut soft liver that crumples more than all that it stored. It (`random --all`, seed 72, scene 012) does not end with 0.125,
/// a fade that is stiffer than the step; with 0.25 and 0.5 it does in 1,271 and 1,254 steps, 0.15 and 0.2 % unexplained.
const SINKING: f64 = 0.5;
/// Displacement (spacings) that lists of pairs leave room for. Contact of a liver with one incision takes 0.36, 0.33 and
/// 0.55 of the time of forces with 0.5, 0.75 and 1.5.
const MARGIN: f64 = 0.75;
/// Largest fraction of the mean gap that is learned in a step (Uzawa's iteration needs less than 2).
const MOST_LEARNING: f64 = 0.03;
/// Residual at which the eigenvalue is taken. At 0.02, enough for a body, one estimate in seventy ends at another cluster
/// of points, a fifth too low.
const EIGENVALUE_TOLERANCE: f64 = 1e-4;

/// How deformable surfaces resist.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableSettings {
    /// Pressure over penetration, in units of the softer body's Young's modulus over its spacing.
    pub penalty: f64,
    /// Rate (1/s) at which the offset learns the mean gap. It follows a gap that swings with a lag and so feeds the
    /// swing, whose energy grows by less than this rate where nothing damps it. 0 learns nothing.
    pub learning: f64,
    /// Drag `χ` (s/m) of free pieces that press each other by `N`: `χ N` times the relative velocity of their rigid
    /// motions. One that lies by its weight `mg` loses the speed at which it bounces at the rate `χ g`.
    pub drag: f64,
}

impl Default for DeformableSettings {
    /// Penalty 2, and neither learning nor drag.
    fn default() -> Self {
        Self {
            penalty: 2.0,
            learning: 0.0,
            drag: 0.0,
        }
    }
}

/// What a contact remembers between steps, and its sums of energy since the start.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableState {
    /// Learned offset (m) of each point; below 0 where it began within the other surface.
    pub offsets: Vec<f64>,
    /// Elastic slip of each point in its own tangents, times the root of its spring's stiffness (√J): energy is kept where
    /// stiffness changes. Empty without friction.
    pub slips: Vec<[f64; 2]>,
    /// Energy (J) of the springs at the last step, by the offsets learned there.
    pub energy: f64,
    /// Energy (J) that friction dissipated; never falls.
    pub dissipated: f64,
    /// Work (J) of the offsets, and of cuts, on the springs.
    pub offset_work: f64,
    /// Work (J) on the nodes, by the trapezoidal rule.
    pub work: f64,
    /// Forces (N) on the nodes at the last step; empty before the first.
    pub forces: Vec<DVec3>,
    /// Where nodes (m) were when pairs were listed; empty before.
    pub listed_at: Vec<DVec3>,
    /// Samples of which they were listed again, ascending, and where nodes (m) were then; empty if there are none.
    pub restless: Vec<u32>,
    /// See `restless`.
    pub listed_again_at: Vec<DVec3>,
    /// Where nodes (m) were when lists were last found to hold; empty since they were made.
    pub held_at: Vec<DVec3>,
    /// Last bound (1/s²) of what contact adds to the largest eigenvalue, and whether it is that of the lists that there are.
    pub bound: f64,
    /// See `bound`.
    pub is_bounded: bool,
}

impl DeformableState {
    /// Energy (J) that nothing explains: what it gave to the nodes, holds and dissipated, less what offsets and cuts put in. 0
    /// for an exact solution.
    #[must_use]
    pub fn energy_error(&self) -> f64 {
        self.work + self.energy + self.dissipated - self.offset_work
    }
}

/// What nodes did in a step.
#[derive(Debug, Clone, Copy)]
pub struct Moved<'a> {
    /// Where they are at its end (m).
    pub positions: &'a [DVec3],
    /// By how much they moved (m).
    pub by: &'a [DVec3],
    /// Their masses (kg).
    pub masses: &'a [f64],
    /// Number of each node's free piece, from 0 on; [`u32::MAX`] for a node of none.
    pub pieces: &'a [u32],
    /// The step (s).
    pub step: f64,
}

/// Contact of all samples of some surfaces with each other.
///
/// Every point `p` of area `a` meets disks `q`. With `ξ* = (TᵀT)⁻¹Tᵀ(x_p − x_q)`, its foot on the disk's plane, and the
/// gap `g = n_q·(x_p − x_q)` the energy is `½ Σ_p a_p Σ_q φ̂(ξ*) (k/2) ⟨s_p − g⟩²`: half, as both sides have points. The
/// weights `φ = (1 − |ξ*|²/R²)² w(n_p·n_q) c(g/h)` sum to 1 amid a sheet. Of them `w` fades as normals turn away from each
/// other, and `c` towards a gap of half a spacing and a depth of one. All forces are derivatives of this energy, so momentum and
/// angular momentum of each pair are kept. The penalty is `k = κE/h`. Each point's offset `s_p` learns the mean gap
/// step by step (Uzawa 1958; an augmented Lagrangian), so that pressed surfaces meet.
/// Friction is Coulomb's, by return mapping of the slip `T dξ*`. Drag damps what lies on something.
#[derive(Debug, Clone)]
pub struct DeformableContact {
    disks: ContactDisks,
    settings: DeformableSettings,
    /// Number of bodies, and friction of those that may touch: `body · count + other`.
    bodies: usize,
    frictions: Vec<Option<f64>>,
    /// Whether any rub.
    rubs: bool,
    state: DeformableState,
    /// Room (spacings) of the lists.
    margin: f64,
    /// Largest spacing (m) of the samples.
    widest: f64,
    /// Samples that are near each other, as they were when pairs were listed.
    blocks: Blocks,
    room: Room,
    /// All samples in lists, ascending; lists name their positions in it.
    near: Vec<u32>,
    /// Points with candidates, and their ranges in `lists`.
    points: Vec<(u32, [u32; 2])>,
    lists: Vec<u32>,
    /// Sums of the last step.
    between: Vec<DeformableForce>,
    /// Energies (J) of points while their samples are taken out.
    stored: Vec<f64>,
}

impl DeformableContact {
    /// Contact between those bodies that have a coefficient of friction, a body with itself included.
    ///
    /// # Arguments
    /// * `friction` -- Coulomb's coefficient of a pair of bodies, the lower number first; 0 for none, `None` if they do not
    ///   touch.
    ///
    /// # Panics
    /// If a setting or coefficient is negative or not finite, or the penalty 0.
    #[must_use]
    pub fn new(
        disks: ContactDisks,
        settings: DeformableSettings,
        bodies: u32,
        friction: impl Fn(u32, u32) -> Option<f64>,
    ) -> Self {
        let DeformableSettings {
            penalty,
            learning,
            drag,
        } = settings;
        let pairs = (0..bodies).flat_map(|a| (0..bodies).map(move |b| (a, b)));
        let frictions: Vec<Option<f64>> =
            pairs.map(|(a, b)| friction(a.min(b), a.max(b))).collect();
        let sound = (frictions.iter().flatten())
            .chain(&[penalty, learning, drag])
            .all(|x| x.is_finite() && *x >= 0.0);
        assert!(
            sound && penalty > 0.0,
            "finite settings, none negative, a positive penalty"
        );
        let mut contact = Self {
            disks: ContactDisks::default(),
            settings,
            rubs: frictions.iter().flatten().any(|friction| *friction > 0.0),
            bodies: bodies as usize,
            frictions,
            state: DeformableState::default(),
            margin: MARGIN,
            widest: 0.0,
            blocks: Blocks::default(),
            room: Room::default(),
            points: Vec::new(),
            lists: Vec::new(),
            near: Vec::new(),
            between: Vec::new(),
            stored: Vec::new(),
        };
        contact.set_disks(disks, &[], &[]);
        contact
    }

    /// The samples.
    #[must_use]
    pub fn disks(&self) -> &ContactDisks {
        &self.disks
    }

    /// What it remembers.
    #[must_use]
    pub fn state(&self) -> &DeformableState {
        &self.state
    }

    /// Goes back to a snapshot.
    ///
    /// # Panics
    /// If the state is for another number of samples.
    pub fn restore(&mut self, state: DeformableState) {
        let fits = state.offsets.len() == self.disks.len();
        assert!(fits, "a state of {} samples", self.disks.len());
        self.state = state;
        self.between.clear();
        self.list();
    }

    /// Whether a state is one of these samples on so many nodes. One that comes from a file may not be.
    #[must_use]
    pub fn fits(&self, state: &DeformableState, node_count: usize) -> bool {
        let n = self.disks.len();
        let slips = if self.rubs { n } else { 0 };
        let numbers = [
            state.energy,
            state.dissipated,
            state.offset_work,
            state.work,
            state.bound,
        ];
        state.bound >= 0.0
            && state.offsets.len() == n
            && state.slips.len() == slips
            && ([
                &state.listed_at,
                &state.listed_again_at,
                &state.held_at,
                &state.forces,
            ]
            .into_iter())
            .all(|list| [0, node_count].contains(&list.len()) && list.iter().all(|x| x.is_finite()))
            && (state.slips.iter().flatten().chain(&numbers)).all(|x| x.is_finite())
            && state.restless.iter().all(|sample| (*sample as usize) < n)
            && (state.restless.is_empty() || state.listed_again_at.len() == state.listed_at.len())
            && (state.offsets.iter()).all(|x| x.is_nan() || x.is_finite())
    }

    /// Takes the samples out, to be changed and given back by [`DeformableContact::set_disks`] before nodes move from
    /// where they are (m).
    ///
    /// # Panics
    /// If there are fewer positions than the samples' nodes require.
    #[must_use]
    pub fn take_disks(&mut self, positions: &[DVec3]) -> ContactDisks {
        self.stored = self.energies(positions);
        std::mem::take(&mut self.disks)
    }

    /// Takes samples, of which the first are those of before, `changed` ones with other rows, as after a cut. Points remember
    /// their slips, and the energies of their springs by offsets that follow the gaps of the new rows: nothing pushes that
    /// did not, and a cut adds no energy. New ones begin without a push.
    ///
    /// # Panics
    /// If there are fewer samples than before, or of more bodies than there are.
    pub fn set_disks(&mut self, disks: ContactDisks, changed: &[usize], positions: &[DVec3]) {
        let known = |sample: &disks::DiskSample| (sample.body as usize) < self.bodies;
        assert!(disks.samples.iter().all(known), "{} bodies", self.bodies);
        assert!(
            disks.len() >= self.state.offsets.len(),
            "no sample vanishes"
        );
        let known = self.state.offsets.len();
        self.state.offsets.resize(disks.len(), f64::NAN);
        if self.rubs {
            self.state.slips.resize(disks.len(), [0.0; 2]);
        }
        self.disks = disks;
        let spacings = self.disks.samples.iter().map(|sample| sample.spacing);
        self.widest = spacings.fold(0.0, f64::max);
        self.renew_blocks();
        if !self.state.listed_at.is_empty() {
            let mut is_restless = self.is_restless();
            is_restless[known..].fill(true);
            changed
                .iter()
                .for_each(|sample| is_restless[*sample] = true);
            self.list_again(is_restless, &[], positions);
            self.keep_energies(positions);
        }
    }

    /// Coefficient of friction of two bodies, if they may touch.
    fn between_bodies(&self, a: u32, b: u32) -> Option<f64> {
        self.frictions[a as usize * self.bodies + b as usize]
    }

    /// Changes [`DeformableSettings::learning`] (1/s) and [`DeformableSettings::drag`] (s/m) from the next step on.
    ///
    /// # Panics
    /// If one is negative or not finite.
    pub fn set_rates(&mut self, learning: f64, drag: f64) {
        let sound = [learning, drag].iter().all(|x| x.is_finite() && *x >= 0.0);
        assert!(sound, "finite rates, none negative");
        (self.settings.learning, self.settings.drag) = (learning, drag);
    }

    /// Candidate pairs in the lists.
    #[must_use]
    pub fn listed_pairs(&self) -> usize {
        self.lists.len()
    }

    /// Bytes of the arrays.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.disks.bytes()
            + size_of_val(&*self.state.offsets)
            + size_of_val(&*self.state.slips)
            + size_of_val(&*self.state.listed_at)
            + size_of_val(&*self.state.restless)
            + size_of_val(&*self.state.listed_again_at)
            + size_of_val(&*self.state.forces)
            + size_of_val(&*self.state.held_at)
            + self.blocks.bytes()
            + size_of_val(&*self.points)
            + size_of_val(&*self.lists)
            + size_of_val(&*self.near)
    }

    /// [`DeformableState::bound`], if lists were made since it was computed last; `None` if it is the same.
    ///
    /// # Panics
    /// If `masses` (kg) is shorter than the samples' nodes require.
    pub fn new_bound(&mut self, masses: &[f64]) -> Option<f64> {
        if std::mem::replace(&mut self.state.is_bounded, true) {
            return None;
        }
        self.state.bound = self.largest_eigenvalue(masses);
        Some(self.state.bound)
    }

    /// Estimate (1/s²) of what the contact adds to the largest eigenvalue of `M⁻¹K`: as if every point that is opposite
    /// of disks, where pairs were listed, were pressed, even those as far above as pairs may come before they are listed
    /// again; 0 where positions are not finite. Weights count as constant: a pair that fades, nearly a spacing deep, is stiffer
    /// by up to some 25 times.
    fn largest_eigenvalue(&self, masses: &[f64]) -> f64 {
        let placed = self.place(if self.state.restless.is_empty() {
            &self.state.listed_at
        } else {
            &self.state.listed_again_at
        });
        let (mut springs, mut pairs) = (Vec::new(), Vec::new());
        let mut is_in = vec![false; self.near.len()];
        for (slot, range) in &self.points {
            let list = self.listed(range);
            self.find_pairs(*slot, list, &placed, NEAR + MARGIN, &mut pairs);
            let point = self.near[*slot as usize] as usize;
            let half = 0.5 * self.disks.samples[point].area / press::norm(&pairs);
            is_in[*slot as usize] |= !pairs.is_empty();
            for pair in &pairs {
                is_in[pair.slot as usize] = true;
                let n = placed[pair.slot as usize].n;
                springs.push((
                    *slot,
                    pair.slot,
                    half * pair.phi * pair.stiffness,
                    n,
                    pair.xi,
                ));
            }
        }
        let slots = (0..).zip(&is_in).filter(|(_, is_in)| **is_in);
        let slots: Vec<u32> = slots.map(|(slot, _)| slot).collect();
        let samples: Vec<u32> = slots.iter().map(|slot| self.near[*slot as usize]).collect();
        let (disks, nodes) = self.disks.alone(&samples);
        let at = |slot: &u32| slots.partition_point(|other| other < slot);
        let springs: Vec<_> = (springs.iter())
            .map(|(p, q, spring, n, xi)| (at(p), at(q), *spring, *n, *xi))
            .collect();
        let mut loads = Vec::new();
        let product = |v: &[DVec3], out: &mut [DVec3]| {
            out.fill(DVec3::ZERO);
            loads.clear();
            loads.resize(disks.len(), (DVec3::ZERO, [DVec3::ZERO; 2]));
            let moves: Vec<_> = (0..disks.len())
                .map(|sample| disks.gather(sample, v))
                .collect();
            for &(p, q, spring, n, [a, b]) in &springs {
                let (x, t) = moves[q];
                let force = n * (spring * n.dot(moves[p].0 - x - t[0] * a - t[1] * b));
                loads[p].0 += force;
                loads[q].0 -= force;
                loads[q].1[0] -= force * a;
                loads[q].1[1] -= force * b;
            }
            for (sample, load) in loads.iter().enumerate() {
                disks.scatter(sample, *load, out);
            }
        };
        let free = BoundaryConditions::free(masses.len());
        let settings = EigenvalueSettings {
            tolerance: EIGENVALUE_TOLERANCE,
            iterations: 200,
            ..EigenvalueSettings::default()
        };
        let none = &mut Vec::new();
        let found =
            crate::largest_eigenvalue_within(&nodes, masses, &free, product, none, &settings);
        found.map_or(0.0, |found| found.value)
    }

    fn listed(&self, [begin, end]: &[u32; 2]) -> &[u32] {
        &self.lists[*begin as usize..*end as usize]
    }

    fn stiffness(&self, a: u32, b: u32) -> f64 {
        let of = |sample: u32| self.disks.samples[sample as usize].stiffness;
        self.settings.penalty * of(a).min(of(b))
    }

    /// [`Self::update_forces`], and adds them (N) to `forces`.
    ///
    /// # Panics
    /// If a slice is shorter than the samples' nodes require.
    pub fn add_forces(&mut self, moved: &Moved<'_>, forces: &mut [DVec3]) {
        self.update_forces(moved);
        for (sum, force) in forces.iter_mut().zip(&self.state.forces) {
            *sum += *force;
        }
    }

    /// Computes the contact's forces on nodes ([`DeformableState::forces`]), lets friction slide and offsets learn: to be
    /// called once a step.
    ///
    /// # Panics
    /// If a slice is shorter than the samples' nodes require.
    pub fn update_forces(&mut self, moved: &Moved<'_>) {
        let mut forces = std::mem::take(&mut self.state.forces);
        let half = |forces: &[DVec3]| 0.5 * crate::vector::dot(forces, moved.by);
        if !forces.is_empty() {
            self.state.work += half(&forces);
        }
        forces.clear();
        forces.resize(moved.positions.len(), DVec3::ZERO);
        self.find_forces(moved, &mut forces);
        self.state.work += half(&forces);
        self.state.forces = forces;
    }

    fn find_forces(&mut self, moved: &Moved<'_>, forces: &mut [DVec3]) {
        let positions = moved.positions;
        self.update_lists(positions);
        self.state.energy = 0.0;
        self.between.clear();
        if self.points.is_empty() {
            return;
        }
        let placed = self.place(positions);
        let motion = |&sample: &u32| self.disks.gather(sample as usize, moved.by);
        let motions: Vec<_> = if self.rubs || self.settings.drag > 0.0 {
            self.near
                .par_iter()
                .with_min_len(CHUNK)
                .map(motion)
                .collect()
        } else {
            Vec::new()
        };
        let rigid = if self.settings.drag > 0.0 {
            RigidMotions::of(moved)
        } else {
            RigidMotions::default()
        };
        let step = (moved, &rigid);
        let chunks: Vec<ChunkForces> = (self.points.par_chunks(CHUNK))
            .map(|points| {
                let (mut chunk, mut pairs) = (ChunkForces::default(), Vec::new());
                for (point, range) in points {
                    let list = self.listed(range);
                    self.find_pairs(*point, list, &placed, NEAR, &mut pairs);
                    self.press(*point, &pairs, (&placed, &motions), step, &mut chunk);
                }
                chunk
            })
            .collect();
        let state = &mut self.state;
        let mut loads = vec![(DVec3::ZERO, [DVec3::ZERO; 2]); self.near.len()];
        let drags = || chunks.iter().flat_map(|chunk| &chunk.drags);
        let share = rigid.share(drags(), self.settings.drag * moved.step);
        let mut wrenches = vec![(DVec3::ZERO, DVec3::ZERO); rigid.len()];
        for drag in drags() {
            state.dissipated += share * drag.taken;
            let slots = [drag.own, drag.disk.0];
            let bodies =
                slots.map(|slot| self.disks.samples[self.near[slot as usize] as usize].body);
            sum_of(&mut self.between, bodies).push(bodies, drag.force * share);
            for ((piece, slot), side) in drag.pieces.into_iter().zip(slots).zip([1.0, -1.0]) {
                let force = drag.force * (share * side);
                if let Some(wrench) = wrenches.get_mut(piece as usize) {
                    wrench.0 += force;
                    wrench.1 += drag.at.cross(force);
                    continue;
                }
                let load = &mut loads[slot as usize];
                load.0 += force;
                if side < 0.0 {
                    let [a, b] = drag.disk.1;
                    load.1[0] += force * a;
                    load.1[1] += force * b;
                }
            }
        }
        rigid.spread(&wrenches, moved, forces);
        for chunk in &chunks {
            for Touch { slot, load } in &chunk.touches {
                let sum = &mut loads[*slot as usize];
                sum.0 += load.0;
                sum.1[0] += load.1[0];
                sum.1[1] += load.1[1];
            }
            for pressed in &chunk.points {
                loads[pressed.slot as usize].0 += pressed.force;
                let point = pressed.point as usize;
                state.offsets[point] = pressed.offset;
                if self.rubs {
                    state.slips[point] = pressed.slip;
                }
                state.energy += pressed.energy + pressed.offset_work;
                state.dissipated += pressed.dissipated;
                state.offset_work += pressed.offset_work;
            }
            for part in &chunk.between {
                let sum = sum_of(&mut self.between, part.bodies);
                sum.force += part.force;
                sum.normal += part.normal;
                sum.friction += part.friction;
                sum.area += part.area;
                sum.penetration = sum.penetration.max(part.penetration);
            }
        }
        self.between.sort_unstable_by_key(|sum| sum.bodies);
        for (&sample, load) in self.near.iter().zip(loads) {
            if load.0 != DVec3::ZERO || load.1 != [DVec3::ZERO; 2] {
                self.disks.scatter(sample as usize, load, forces);
            }
        }
    }
}
