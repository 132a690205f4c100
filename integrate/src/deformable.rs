//! Contact of deformable surfaces with each other and with themselves: a penalty with a learned offset, and friction.

pub(crate) mod disks;
mod grid;
#[cfg(test)]
mod tests;

use disks::{ContactDisks, Placed, REACH, index};
use glam::DVec3;
use grid::candidates;
use rayon::prelude::*;

/// Points that a task of the parallel loop takes.
const CHUNK: usize = 64;
/// Gap (spacings) above which a pair plays no part.
const NEAR: f64 = 0.5;
/// Penetration (spacings) beyond which a pair is taken for one that is not in contact.
const DEEPEST: f64 = 1.0;
/// Largest cosine between the normals of a pair: they face each other. At -0.2 the sides of a block that tilts by 12
/// degrees meet what lies on it, as if that had come from beside.
const FACING: f64 = -0.5;
/// Largest learned offset (spacings).
const LARGEST_OFFSET: f64 = 0.25;
/// Sum of the disks' weights, over that amid an unbounded sheet, from which they are normalised. Half of it is opposite
/// a straight rim.
const FULL: f64 = 0.5;
/// Displacement (spacings) that lists of pairs leave room for.
const MARGIN: f64 = 0.75;
/// Products with the stiffness, and room above the power iteration's estimate, which comes from below.
const PRODUCTS: usize = 24;
const EIGENVALUE_MARGIN: f64 = 1.2;
/// Samples of one body that are closer than this at rest (spacings) and do not face each other across a gap are
/// neighbours in the tissue and never in contact.
const NEIGHBORS: f64 = 3.0;

/// How deformable surfaces resist.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableSettings {
    /// Pressure over penetration, in units of the softer body's Young's modulus over its spacing.
    pub penalty: f64,
    /// Coulomb's coefficient of friction, 0 for none.
    pub friction: f64,
    /// Fraction of the mean gap that the offset learns in a step. It follows a gap that swings with a lag and so
    /// feeds the swing: amplitudes grow by half of this a step where nothing damps them. Over a step this must be less
    /// than the damping (1/s) of what touches; 0 learns nothing.
    pub learning: f64,
}

impl Default for DeformableSettings {
    fn default() -> Self {
        Self {
            penalty: 2.0,
            friction: 0.0,
            learning: 2e-4,
        }
    }
}

/// What a contact remembers between steps, and its sums of energy since the start.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DeformableState {
    /// Learned offset (m) of each point; below 0 where it began within the other surface.
    pub offsets: Vec<f64>,
    /// Elastic slip (m) of each point, in its own tangents; empty without friction.
    pub slips: Vec<[f64; 2]>,
    /// Energy (J) of the springs at the last step.
    pub energy: f64,
    /// Energy (J) that friction dissipated; never falls.
    pub dissipated: f64,
    /// Work (J) of the offsets on the springs.
    pub offset_work: f64,
    /// Where nodes (m) were when pairs were listed; empty before.
    pub listed_at: Vec<DVec3>,
}

/// Sum over the pairs of one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct DeformableForce {
    /// Sum of the normal forces' amounts (N).
    pub normal: f64,
    /// Sum of the frictional forces' amounts (N).
    pub friction: f64,
    /// Area (m²) under pressure, at rest.
    pub area: f64,
    /// Deepest gap (m), positive where surfaces penetrate.
    pub penetration: f64,
}

/// Contact of all samples of some surfaces with each other.
///
/// Every point `p` of area `a` meets disks `q`. With `ξ* = (TᵀT)⁻¹Tᵀ(x_p − x_q)`, its foot on the disk's plane, and the
/// gap `g = n_q·(x_p − x_q)` the energy is `½ Σ_p a_p Σ_q φ̂(ξ*) (k/2) ⟨s_p − g⟩²`: half, as both sides have points. The
/// weights `φ = (1 − |ξ*|²/R²)²` sum to 1 amid a sheet. All forces are derivatives of this energy, so momentum and
/// angular momentum of each pair are kept. The penalty is `k = κE/h`. Each point's offset `s_p` learns the mean gap
/// step by step (Uzawa 1958; an augmented Lagrangian), so that pressed surfaces meet.
/// Friction is Coulomb's, by return mapping of the slip `T dξ*`.
#[derive(Debug, Clone)]
pub struct DeformableContact {
    disks: ContactDisks,
    settings: DeformableSettings,
    /// Whether bodies may touch: `body · count + other`.
    allowed: Vec<bool>,
    state: DeformableState,
    /// Room (spacings) of the lists.
    margin: f64,
    /// Points with candidates, and their ranges in `lists`.
    points: Vec<(u32, [u32; 2])>,
    lists: Vec<u32>,
    /// All samples in lists, ascending, and each sample's position in it.
    near: Vec<u32>,
    slots: Vec<u32>,
    amplification: f64,
    rebuilds: u64,
}

/// What a disk gets of a point: the force and those conjugate to its tangents.
struct Touch {
    slot: u32,
    load: (DVec3, [DVec3; 2]),
}

#[derive(Default)]
struct Chunk {
    touches: Vec<Touch>,
    points: Vec<Pressed>,
}

/// What became of a point.
struct Pressed {
    point: u32,
    slot: u32,
    force: DVec3,
    offset: f64,
    slip: [f64; 2],
    energy: f64,
    dissipated: f64,
    offset_work: f64,
    sum: DeformableForce,
}

/// A pair in reach.
struct Pair {
    slot: u32,
    stiffness: f64,
    xi: [f64; 2],
    /// Between the rows' positions, and between the surfaces (m).
    raw: f64,
    gap: f64,
    phi: f64,
}

impl DeformableContact {
    /// Contact between those bodies for which `allowed(a, b)` holds, a body with itself included.
    ///
    /// # Panics
    /// If a setting is negative or not finite, or the penalty 0.
    #[must_use]
    pub fn new(
        disks: ContactDisks,
        settings: DeformableSettings,
        bodies: u32,
        allowed: impl Fn(u32, u32) -> bool,
    ) -> Self {
        let DeformableSettings {
            penalty,
            friction,
            learning,
        } = settings;
        let sound = [penalty, friction, learning]
            .iter()
            .all(|x| x.is_finite() && *x >= 0.0);
        assert!(
            sound && penalty > 0.0,
            "finite settings, none negative, a positive penalty"
        );
        let pairs = (0..bodies).flat_map(|a| (0..bodies).map(move |b| (a, b)));
        let mut contact = Self {
            disks: ContactDisks::default(),
            settings,
            allowed: pairs.map(|(a, b)| allowed(a.min(b), a.max(b))).collect(),
            state: DeformableState::default(),
            margin: MARGIN,
            points: Vec::new(),
            lists: Vec::new(),
            near: Vec::new(),
            slots: Vec::new(),
            amplification: 1.0,
            rebuilds: 0,
        };
        contact.set_disks(disks);
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
        self.list_pairs();
    }

    /// Whether a state is one of these samples on so many nodes. One that comes from a file may not be.
    #[must_use]
    pub fn fits(&self, state: &DeformableState, node_count: usize) -> bool {
        let n = self.disks.len();
        let slips = if self.settings.friction > 0.0 { n } else { 0 };
        let sums = [state.energy, state.dissipated, state.offset_work];
        state.offsets.len() == n
            && state.slips.len() == slips
            && [0, node_count].contains(&state.listed_at.len())
            && state.listed_at.iter().all(|x| x.is_finite())
            && (state.slips.iter().flatten().chain(&sums)).all(|x| x.is_finite())
            && (state.offsets.iter()).all(|x| x.is_nan() || x.is_finite())
    }

    /// Takes the samples out, to be changed and given back by [`DeformableContact::set_disks`].
    #[must_use]
    pub fn take_disks(&mut self) -> ContactDisks {
        std::mem::take(&mut self.disks)
    }

    /// Takes samples, of which the first are those of before, perhaps with other rows, as after a cut. Points remember
    /// their offsets and slips; new ones begin without a push.
    ///
    /// # Panics
    /// If there are fewer samples than before, or of more bodies than there are.
    pub fn set_disks(&mut self, disks: ContactDisks) {
        let bodies = self.allowed.len().isqrt();
        let known = |sample: &disks::DiskSample| (sample.body as usize) < bodies;
        assert!(disks.samples.iter().all(known), "{bodies} bodies");
        assert!(
            disks.len() >= self.state.offsets.len(),
            "no sample vanishes"
        );
        self.state.offsets.resize(disks.len(), f64::NAN);
        if self.settings.friction > 0.0 {
            self.state.slips.resize(disks.len(), [0.0; 2]);
        }
        let amplifications = (0..disks.len()).map(|p| disks.amplification(p));
        self.amplification = amplifications.fold(1.0, f64::max);
        self.disks = disks;
        self.state.listed_at.clear();
    }

    /// How often lists of pairs were made.
    #[must_use]
    pub fn rebuilds(&self) -> u64 {
        self.rebuilds
    }

    /// Changes [`DeformableSettings::learning`] from the next step on.
    ///
    /// # Panics
    /// If it is negative or not finite.
    pub fn set_learning(&mut self, learning: f64) {
        let sound = learning.is_finite() && learning >= 0.0;
        assert!(sound, "a finite fraction, not negative");
        self.settings.learning = learning;
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
            + size_of_val(&*self.points)
            + size_of_val(&*self.lists)
            + size_of_val(&*self.near)
            + size_of_val(&*self.slots)
    }

    /// Estimate (1/s²) of what the contact adds to the largest eigenvalue of `M⁻¹K`: by power iteration, as if every point
    /// in the lists were pressed upon the disk nearest to it, and a fifth more.
    ///
    /// # Panics
    /// If `masses` (kg) is shorter than the samples' nodes require.
    #[must_use]
    pub fn largest_eigenvalue(&self, masses: &[f64]) -> f64 {
        let place = |&s: &u32| self.disks.place(s as usize, &self.state.listed_at);
        let placed: Vec<Placed> = self.near.iter().map(place).collect();
        let springs = self.points.iter().filter_map(|(point, [begin, end])| {
            let slot = |sample: u32| self.slots[sample as usize] as usize;
            let p = slot(*point);
            let far = |q: &u32| placed[slot(*q)].x.distance_squared(placed[p].x);
            let list = self.lists[*begin as usize..*end as usize].iter();
            let other = *list.min_by(|a, b| far(a).total_cmp(&far(b)))?;
            let area = self.disks.samples[*point as usize].area;
            let spring = 0.5 * area * self.stiffness(*point, other);
            Some((p, slot(other), spring, placed[slot(other)].n))
        });
        let springs: Vec<_> = springs.collect();
        let roots: Vec<f64> = masses.iter().map(|mass| mass.sqrt()).collect();
        let mut v = vec![DVec3::ZERO; masses.len()];
        let (mut found, mut product) = (0.0, v.clone());
        let mut loads: Vec<DVec3> = (placed.iter().enumerate())
            .map(|(k, at)| at.n * if k % 2 == 0 { 1.0 } else { -0.5 })
            .collect();
        for _ in 0..PRODUCTS {
            product.fill(DVec3::ZERO);
            for (&sample, load) in self.near.iter().zip(&loads) {
                for entry in self.disks.row(sample as usize) {
                    let node = self.disks.nodes[entry] as usize;
                    product[node] += *load * (self.disks.weights[entry] / roots[node]);
                }
            }
            found = product
                .iter()
                .map(|v| v.length_squared())
                .sum::<f64>()
                .sqrt();
            for (v, product) in v.iter_mut().zip(&product) {
                *v = *product / found.max(f64::MIN_POSITIVE);
            }
            let moved: Vec<DVec3> = (self.near.iter())
                .map(|&sample| {
                    let row = self.disks.row(sample as usize);
                    let node = |entry: usize| self.disks.nodes[entry] as usize;
                    row.map(|e| v[node(e)] * (self.disks.weights[e] / roots[node(e)]))
                        .sum()
                })
                .collect();
            loads.fill(DVec3::ZERO);
            for &(p, q, spring, n) in &springs {
                let force = n * (spring * n.dot(moved[p] - moved[q]));
                loads[p] += force;
                loads[q] -= force;
            }
        }
        EIGENVALUE_MARGIN * found
    }

    /// Lets two bodies, or a body and itself, touch from now on.
    ///
    /// # Panics
    /// If there is no such body.
    pub fn allow(&mut self, a: u32, b: u32) {
        let bodies = self.allowed.len().isqrt();
        for (a, b) in [(a, b), (b, a)] {
            let allowed = &mut self.allowed[a as usize * bodies + b as usize];
            if !std::mem::replace(allowed, true) {
                self.state.listed_at.clear();
            }
        }
    }

    fn stiffness(&self, a: u32, b: u32) -> f64 {
        let of = |sample: u32| self.disks.samples[sample as usize].stiffness;
        self.settings.penalty * of(a).min(of(b))
    }

    /// Makes lists of pairs again if nodes have moved too far since the last; whether it did. [`Self::add_forces`] does
    /// so by itself.
    pub fn update_lists(&mut self, positions: &[DVec3]) -> bool {
        let room = 0.5 * self.margin() / self.amplification;
        let stays = |(a, b): (&DVec3, &DVec3)| a.distance_squared(*b) < room * room;
        let same = self.state.listed_at.len() == positions.len();
        if same && positions.iter().zip(&self.state.listed_at).all(stays) {
            return false;
        }
        self.state.listed_at.clear();
        self.state.listed_at.extend_from_slice(positions);
        self.rebuilds += 1;
        self.list_pairs();
        true
    }

    fn widest(&self) -> f64 {
        let samples = self.disks.samples.iter();
        samples.map(|sample| sample.spacing).fold(0.0, f64::max)
    }

    fn margin(&self) -> f64 {
        self.margin * self.widest()
    }

    /// Lists pairs as nodes were at [`DeformableState::listed_at`].
    fn list_pairs(&mut self) {
        let positions = &self.state.listed_at;
        let all = 0..if positions.is_empty() {
            0
        } else {
            self.disks.len()
        };
        let places: Vec<DVec3> = all.map(|s| self.disks.gather(s, positions).0).collect();
        let samples = &self.disks.samples;
        let (bodies, margin) = (self.allowed.len().isqrt(), self.margin());
        let reach = self.disks.reach.iter().copied().fold(0.0, f64::max);
        let far = reach.hypot(DEEPEST * self.widest()) + margin;
        let mut boxes = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); bodies];
        for (sample, place) in samples.iter().zip(&places) {
            let (low, high) = &mut boxes[sample.body as usize];
            (*low, *high) = (low.min(*place), high.max(*place));
        }
        let allowed = |a: u32, b: u32| self.allowed[a as usize * bodies + b as usize];
        // Samples that lie near to another body, or touch their own.
        let is_open = |(sample, place): (&disks::DiskSample, &DVec3)| {
            let mut others = (0_u32..).zip(&boxes);
            sample.area > 0.0
                && others.any(|(body, (low, high))| {
                    allowed(sample.body, body)
                        && (body == sample.body
                            || place.cmpge(*low - far).all() && place.cmple(*high + far).all())
                })
        };
        let open: Vec<bool> = samples.iter().zip(&places).map(is_open).collect();
        let meets = |p: u32, q: u32| {
            let arm = places[p as usize] - places[q as usize];
            let (a, b) = (&samples[p as usize], &samples[q as usize]);
            let reach = self.disks.reach[q as usize];
            let spacing = a.spacing.max(b.spacing);
            let far = reach.hypot(DEEPEST * spacing) + margin;
            arm.length_squared() < far * far
                && reach > 0.0
                && allowed(a.body, b.body)
                && (a.body != b.body || !are_neighbors(a, b))
        };
        (self.points, self.lists) = candidates(&places, &open, far, meets);
        let is_near = |&sample: &u32| sample != u32::MAX;
        self.slots.clear();
        self.slots.resize(samples.len(), u32::MAX);
        for &sample in self
            .points
            .iter()
            .map(|(point, _)| point)
            .chain(&self.lists)
        {
            self.slots[sample as usize] = sample;
        }
        self.near = self.slots.iter().copied().filter(is_near).collect();
        for (slot, &sample) in self.near.iter().enumerate() {
            self.slots[sample as usize] = index(slot);
        }
    }

    /// Adds the contact's forces (N) on nodes at `positions` (m) to `forces`, lets friction slide by `moved` (m), the
    /// displacements of the step that ends here, and lets offsets learn: to be called once a step.
    ///
    /// # Panics
    /// If a slice is shorter than the samples' nodes require.
    pub fn add_forces(
        &mut self,
        positions: &[DVec3],
        moved: &[DVec3],
        forces: &mut [DVec3],
    ) -> DeformableForce {
        self.update_lists(positions);
        self.state.energy = 0.0;
        let mut total = DeformableForce::default();
        if self.points.is_empty() {
            return total;
        }
        let place = |&sample: &u32| self.disks.place(sample as usize, positions);
        let placed: Vec<Placed> = self
            .near
            .par_iter()
            .with_min_len(CHUNK)
            .map(place)
            .collect();
        let rubs = self.settings.friction > 0.0;
        let motion = |&sample: &u32| self.disks.gather(sample as usize, moved);
        let motions: Vec<_> = if rubs {
            self.near
                .par_iter()
                .with_min_len(CHUNK)
                .map(motion)
                .collect()
        } else {
            Vec::new()
        };
        let chunks: Vec<Chunk> = (self.points.par_chunks(CHUNK))
            .map(|points| {
                let (mut chunk, mut pairs) = (Chunk::default(), Vec::new());
                for (point, [begin, end]) in points {
                    let list = &self.lists[*begin as usize..*end as usize];
                    self.find_pairs(*point, list, &placed, &mut pairs);
                    self.press(*point, &pairs, &placed, &motions, &mut chunk);
                }
                chunk
            })
            .collect();
        let state = &mut self.state;
        let mut loads = vec![(DVec3::ZERO, [DVec3::ZERO; 2]); self.near.len()];
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
                if rubs {
                    state.slips[point] = pressed.slip;
                }
                state.energy += pressed.energy;
                state.dissipated += pressed.dissipated;
                state.offset_work += pressed.offset_work;
                total.normal += pressed.sum.normal;
                total.friction += pressed.sum.friction;
                total.area += pressed.sum.area;
                total.penetration = total.penetration.max(pressed.sum.penetration);
            }
        }
        for (&sample, load) in self.near.iter().zip(loads) {
            if load.0 != DVec3::ZERO || load.1 != [DVec3::ZERO; 2] {
                self.disks.scatter(sample as usize, load, forces);
            }
        }
        total
    }

    /// Disks that a point is opposite of.
    fn find_pairs(&self, point: u32, list: &[u32], placed: &[Placed], pairs: &mut Vec<Pair>) {
        pairs.clear();
        let p = &placed[self.slots[point as usize] as usize];
        let at = &self.disks.samples[point as usize];
        let thickness = self.disks.thickness[point as usize];
        for &other in list {
            let slot = self.slots[other as usize];
            let (q, on) = (&placed[slot as usize], &self.disks.samples[other as usize]);
            let arm = p.x - q.x;
            let raw = q.n.dot(arm);
            let gap = raw - thickness - self.disks.thickness[other as usize];
            let spacing = at.spacing.min(on.spacing);
            if gap > NEAR * spacing || gap < -DEEPEST * spacing || p.n.dot(q.n) > FACING {
                continue;
            }
            let xi = q.solve([q.t[0].dot(arm), q.t[1].dot(arm)]);
            let reach = self.disks.reach[other as usize];
            let inside = 1.0 - (xi[0] * xi[0] + xi[1] * xi[1]) / (reach * reach);
            if inside > 0.0 {
                let (phi, stiffness) = (inside * inside, self.stiffness(point, other));
                pairs.push(Pair {
                    slot,
                    stiffness,
                    xi,
                    raw,
                    gap,
                    phi,
                });
            }
        }
    }

    /// Forces of a point's pairs, and what it learns.
    fn press(
        &self,
        point: u32,
        pairs: &[Pair],
        placed: &[Placed],
        motions: &[(DVec3, [DVec3; 2])],
        chunk: &mut Chunk,
    ) {
        let at = &self.disks.samples[point as usize];
        let slot = self.slots[point as usize];
        let mut offset = self.state.offsets[point as usize];
        if offset.is_nan() {
            // No push before anything moves.
            offset = pairs.iter().map(|pair| pair.gap).fold(0.0, f64::min);
        }
        let largest = LARGEST_OFFSET * at.spacing;
        // Offsets of points that nothing is opposite of are forgotten, as if it were far.
        let mut pressed = Pressed {
            point,
            slot,
            force: DVec3::ZERO,
            offset: (offset - self.settings.learning * largest).max(0.0),
            slip: [0.0; 2],
            energy: 0.0,
            dissipated: 0.0,
            offset_work: 0.0,
            sum: DeformableForce::default(),
        };
        if pairs.is_empty() {
            chunk.points.push(pressed);
            return;
        }
        let depth = |pair: &Pair, offset: f64| (offset - pair.gap).max(0.0);
        // Half: the other side has points, too.
        let spring = |pair: &Pair| 0.5 * at.area * pair.stiffness;
        let energy = |pair: &Pair, s: f64| 0.5 * spring(pair) * depth(pair, s).powi(2);
        let reach = |pair: &Pair| self.disks.reach[self.near[pair.slot as usize] as usize];
        let sum: f64 = pairs.iter().map(|pair| pair.phi).sum();
        let least = FULL * std::f64::consts::PI * REACH * REACH / 3.0;
        let norm = sum.max(least);
        let mean = pairs
            .iter()
            .map(|pair| pair.phi * energy(pair, offset))
            .sum::<f64>()
            / norm;
        let gap = pairs.iter().map(|pair| pair.phi * pair.gap).sum::<f64>() / sum;
        // The largest offset that learns nothing but to close.
        let learned = (offset - self.settings.learning * gap).min(largest);
        pressed.offset = if gap > 0.0 { learned.max(0.0) } else { learned };
        let normal: f64 = pairs
            .iter()
            .map(|pair| spring(pair) * pair.phi * depth(pair, offset))
            .sum();
        let normal = normal / norm;
        let stiffness = pairs
            .iter()
            .map(|pair| spring(pair) * pair.phi)
            .sum::<f64>()
            / norm;
        let traction = self.rub(
            &mut pressed,
            (normal, stiffness, sum),
            pairs,
            placed,
            motions,
        );
        for pair in pairs {
            let q = &placed[pair.slot as usize];
            let share = pair.phi / norm;
            let deep = depth(pair, offset);
            let stored = energy(pair, offset);
            pressed.energy += share * stored;
            pressed.offset_work += share * (energy(pair, pressed.offset) - stored);
            pressed.sum.penetration = pressed.sum.penetration.max(-pair.gap);
            if deep > 0.0 {
                pressed.sum.area += 0.5 * at.area * share;
            }
            // −∂E/∂ξ: of the weight alone, as gaps do not depend on where the foot is.
            let per_weight = (stored - if sum > least { mean } else { 0.0 }) / norm;
            let slope = 4.0 * pair.phi.sqrt() / reach(pair).powi(2) * per_weight;
            let tangential = pair.phi / sum;
            let along = [0, 1].map(|k| slope * pair.xi[k] + tangential * traction.dot(q.t[k]));
            let normal_force = spring(pair) * share * deep;
            if normal_force == 0.0 && along[0] == 0.0 && along[1] == 0.0 {
                continue;
            }
            let [a, b] = q.solve(along);
            let force = q.n * normal_force + q.t[0] * a + q.t[1] * b;
            pressed.force += force;
            let turn = q.n * pair.raw;
            let moments = [turn * a - force * pair.xi[0], turn * b - force * pair.xi[1]];
            chunk.touches.push(Touch {
                slot: pair.slot,
                load: (-force, moments),
            });
        }
        pressed.sum.normal = normal;
        chunk.points.push(pressed);
    }

    /// Frictional force (N) on a point that is pressed by `normal` (N), by return mapping.
    fn rub(
        &self,
        pressed: &mut Pressed,
        (normal, stiffness, sum): (f64, f64, f64),
        pairs: &[Pair],
        placed: &[Placed],
        motions: &[(DVec3, [DVec3; 2])],
    ) -> DVec3 {
        if motions.is_empty() || normal <= 0.0 {
            return DVec3::ZERO;
        }
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
            moved += (q.t[0] * a + q.t[1] * b) * (pair.phi / sum);
        }
        let first = p.t[0].normalize_or_zero();
        let second = p.n.cross(first);
        let before = self.state.slips[pressed.point as usize];
        let slip = [before[0] + first.dot(moved), before[1] + second.dot(moved)];
        let length = slip[0].hypot(slip[1]);
        let limit = self.settings.friction * normal;
        let held = (limit / stiffness).min(length);
        let share = if length > 0.0 { held / length } else { 0.0 };
        pressed.slip = slip.map(|x| x * share);
        pressed.energy += 0.5 * stiffness * held * held;
        pressed.dissipated += limit * (length - held);
        pressed.sum.friction = stiffness * held;
        (first * pressed.slip[0] + second * pressed.slip[1]) * -stiffness
    }
}

/// Whether two samples of a body are joined by tissue at rest: they are near, and do not face each other across a gap.
fn are_neighbors(a: &disks::DiskSample, b: &disks::DiskSample) -> bool {
    let arm = a.position - b.position;
    let near = NEIGHBORS * a.spacing.max(b.spacing);
    let faces = a.normal.dot(b.normal) < FACING;
    // Behind the other: back to back, with tissue between.
    let behind = b.normal.dot(arm) < -0.05 * b.spacing;
    arm.length_squared() < near * near && (!faces || behind)
}
