//! Energy, stress and records of neo-Hookean nodes, several nodes at a time.
//!
//! What belongs to a node costs as much as all its pairs when it is computed node by node: one long
//! chain through a logarithm and a division. Laid out by component, with nodes in the lanes, the
//! compiler turns the same operations into vector ones. Nodes of another kind (other laws, deficient
//! rows, almost no volume left) sit in their lanes unused and are computed one by one; what follows
//! from their stress runs over lanes again.

#![allow(
    clippy::needless_range_loop,
    reason = "components and lanes are walked in step over several arrays"
)]

use glam::DMat3;

use crate::kernel::fixed::{BlockConstants, Fixed};
use crate::kernel::gather::{ONE, PairSums, Record, sums};
use crate::kernel::nodes::Model;
use crate::kernel::planes::{ZERO, add, product, subtract, weave};
use crate::kernel::prestrain::Prestrain;
use crate::kernel::storage::{BLOCK, Move, Plane, Planes, Sixteen, at};
use crate::law::arithmetic::Arithmetic;
use crate::law::coefficients::{EXTENSION_VOLUME_RATIO, barrier, ln};

/// `2 c10`, the volumetric law `a`, `b`, `l`, `k` and its barrier, and the volume of a block's nodes.
#[derive(Debug, Clone)]
pub(crate) struct Laws {
    pub(crate) law: [Plane; 6],
    pub(crate) volume: Plane,
}

impl Laws {
    pub(crate) fn new(model: &Model) -> Self {
        let law = model.coefficients[0].plain_constants();
        Self {
            law: law.map(Plane::of),
            volume: ZERO,
        }
    }

    /// Takes the laws and volumes of the nodes from `first` on; none is in the lanes after them.
    #[inline(always)]
    pub(crate) fn load(&mut self, model: &Model, first: usize, count: usize) {
        self.volume = wide(&model.elastic_volumes, first, count);
        if !model.material_of.is_empty() {
            for lane in 0..count {
                self.set_law(model, first + lane, lane);
            }
        }
    }

    /// Takes the law and volume of one node.
    pub(crate) fn load_one(&mut self, model: &Model, node: usize, lane: usize) {
        self.volume[lane] = model.elastic_volumes[node];
        self.set_law(model, node, lane);
    }

    #[inline(always)]
    fn set_law(&mut self, model: &Model, node: usize, lane: usize) {
        let law = model.law(node).plain_constants();
        for (plane, value) in self.law.iter_mut().zip(law) {
            plane[lane] = value;
        }
    }
}

/// Numbers of the nodes from `first` on, zero in the lanes after them.
#[inline(always)]
pub(crate) fn wide(of: &[f64], first: usize, count: usize) -> Plane {
    if let Some(whole) = of
        .get(first..first + BLOCK)
        .and_then(|of| of.try_into().ok())
    {
        return Sixteen(whole);
    }
    let mut lanes = ZERO;
    lanes[..count].copy_from_slice(&of[first..first + count]);
    lanes
}

/// What the gathers of a block's nodes give and what follows from it.
#[derive(Debug, Clone)]
pub(crate) struct Block<const L: usize> {
    /// Sums of pass one.
    sums: [[Plane; L]; 4],
    /// `X`, one, `μ`.
    place: [Plane; L],
    /// `u`.
    moved: [Plane; 3],
    /// `F`, row by row; in a tangent product its change, without what completes it.
    pub(crate) deformation: [Plane; 9],
    /// `F` of the state at which a tangent product is taken.
    pub(crate) at: [Plane; 9],
    /// `V P` of what the rows see.
    pub(crate) stress: [Plane; 9],
    /// `V W - V P : (F - I) / 2`.
    pub(crate) work: Plane,
    /// `J`.
    pub(crate) ratio: Plane,
    /// Bound on the tangent modulus, as `Coefficients::tangent_bound`.
    pub(crate) bound: Plane,
    /// Rows of `(Q, q)` and of `(R, 0)`.
    record: [[[Plane; 4]; 2]; 3],
    /// What a node's own row gives itself.
    force: [Plane; 3],
}

impl<const L: usize> Block<L> {
    /// Multiplies the deformation gradient of a lane, or its change, if its node has an offset.
    pub(crate) fn carry(&mut self, prestrain: &Prestrain, node: usize, lane: usize) {
        if let Some(factor) = prestrain.factor(node) {
            let f = self.matrix(&self.deformation, lane);
            self.set_deformation(lane, f * factor);
        }
    }

    /// Turns the stress of a lane, or its change, into what its row sees, if its node has an offset.
    pub(crate) fn pull(&mut self, prestrain: &Prestrain, node: usize, lane: usize) {
        if let Some(factor) = prestrain.factor(node) {
            let stress = self.matrix(&self.stress, lane);
            self.set_stress(lane, stress * factor.transpose());
        }
    }

    pub(crate) fn new() -> Self {
        Self {
            sums: [[ZERO; L]; 4],
            place: [ZERO; L],
            moved: [ZERO; 3],
            deformation: [ZERO; 9],
            at: [ZERO; 9],
            stress: [ZERO; 9],
            work: ZERO,
            ratio: ZERO,
            bound: ZERO,
            record: [[[ZERO; 4]; 2]; 3],
            force: [ZERO; 3],
        }
    }

    /// Takes a node's sums, coordinates and displacement into a lane.
    #[inline(always)]
    pub(crate) fn take(
        &mut self,
        lane: usize,
        sums: &PairSums<L>,
        anchor: &[f64; L],
        moved: &Move,
    ) {
        // No more numbers than a node has: what is not read is not moved.
        for r in 0..4 {
            for k in 0..L {
                if k < L - L / 8 && (k != ONE || r < 3) {
                    self.sums[r][k][lane] = sums[r][k];
                }
            }
        }
        for k in 0..L {
            if k % 4 != ONE {
                self.place[k][lane] = anchor[k];
            }
        }
        for r in 0..3 {
            self.moved[r][lane] = moved[r];
        }
    }

    /// `F` from the sums taken: `I + S Bᵀ + s T`; without the identity for `one = 0`.
    #[inline(always)]
    pub(crate) fn gradients<A: Arithmetic>(&mut self, constants: BlockConstants<'_>, one: f64) {
        for r in 0..3 {
            let s = &self.sums[r];
            for c in 0..3 {
                let b = &constants.matrix[3 * c..3 * c + 3];
                let mut sum = Plane::of(if r == c { one } else { 0.0 });
                if let (true, Some(scale)) = (L > 4, constants.scale) {
                    sum = add::<A>(&s[(ONE + 1 + c) % L], scale, &sum);
                }
                sum = add::<A>(&s[2], &b[2], &sum);
                sum = add::<A>(&s[1], &b[1], &sum);
                self.deformation[3 * r + c] = add::<A>(&s[0], &b[0], &sum);
            }
        }
    }

    /// Whether the node in a lane is one for which the lanes hold.
    #[inline(always)]
    pub(crate) fn holds(&self, model: &Model, node: usize, lane: usize) -> bool {
        model.is_plain(node)
            && (self.ratio[lane] >= EXTENSION_VOLUME_RATIO || !model.law(node).has_logarithm())
    }

    /// Whether the lanes hold for all nodes from `first` on.
    #[inline(always)]
    pub(crate) fn all_hold(&self, model: &Model, first: usize, count: usize) -> bool {
        let full = model.ranks[first..first + count].iter();
        let mut all = model.plain & full.fold(true, |all, rank| all & (*rank == 3));
        if model.logarithm {
            for lane in 0..count {
                all &= self.ratio[lane] >= EXTENSION_VOLUME_RATIO;
            }
        }
        all
    }

    /// Energies and stresses of neo-Hookean nodes from `F`.
    #[inline(always)]
    pub(crate) fn stresses<A: Arithmetic>(&mut self, laws: &Laws, logarithm: bool) {
        if logarithm {
            self.stresses_of::<A, true>(laws);
        } else {
            self.stresses_of::<A, false>(laws);
        }
    }

    #[inline(always)]
    fn stresses_of<A: Arithmetic, const LOGARITHM: bool>(&mut self, laws: &Laws) {
        let f = &self.deformation;
        for k in 0..BLOCK {
            let (a, b, d) = (
                [f[0][k], f[1][k], f[2][k]],
                [f[3][k], f[4][k], f[5][k]],
                [f[6][k], f[7][k], f[8][k]],
            );
            let cof = [cross::<A>(b, d), cross::<A>(d, a), cross::<A>(a, b)];
            let j = dot::<A>(a, cof[0], 0.0);
            let twice = laws.law[0][k];
            let [volumetric, slope, curvature] = volumetric::<A, LOGARITHM>(laws, k, j);
            let squares = dot::<A>(d, d, dot::<A>(b, b, dot::<A>(a, a, -3.0)));
            let energy = A::add(0.5 * twice, squares, volumetric);
            let volume = laws.volume[k];
            let (p, q) = (volume * twice, volume * slope);
            let mut work = 0.0;
            let rows = [a, b, d];
            for r in 0..3 {
                let mut row = [0.0; 3];
                for c in 0..3 {
                    row[c] = A::add(rows[r][c], p, cof[r][c] * q);
                }
                let [x, y, z] = row;
                let mut off = rows[r];
                off[r] -= 1.0;
                work = dot::<A>([x, y, z], off, work);
                self.stress[3 * r][k] = x;
                self.stress[3 * r + 1][k] = y;
                self.stress[3 * r + 2][k] = z;
            }
            self.work[k] = A::add(volume, energy, -0.5 * work);
            self.ratio[k] = j;
            let cofactors = dot::<A>(
                cof[0],
                cof[0],
                dot::<A>(cof[1], cof[1], dot::<A>(cof[2], cof[2], 0.0)),
            );
            let bend = A::add(curvature.max(0.0), cofactors, twice);
            self.bound[k] = A::add(slope.abs(), (squares + 3.0).sqrt(), bend);
        }
    }

    /// Changes of the stresses of neo-Hookean nodes from `F` and its change.
    #[inline(always)]
    pub(crate) fn stress_changes<A: Arithmetic>(&mut self, laws: &Laws, logarithm: bool) {
        if logarithm {
            self.changes_of::<A, true>(laws);
        } else {
            self.changes_of::<A, false>(laws);
        }
    }

    #[inline(always)]
    fn changes_of<A: Arithmetic, const LOGARITHM: bool>(&mut self, laws: &Laws) {
        let (f, df) = (&self.at, &self.deformation);
        for k in 0..BLOCK {
            let (a, b, d) = (
                [f[0][k], f[1][k], f[2][k]],
                [f[3][k], f[4][k], f[5][k]],
                [f[6][k], f[7][k], f[8][k]],
            );
            let (da, db, dd) = (
                [df[0][k], df[1][k], df[2][k]],
                [df[3][k], df[4][k], df[5][k]],
                [df[6][k], df[7][k], df[8][k]],
            );
            let change = [da, db, dd];
            let cof = [cross::<A>(b, d), cross::<A>(d, a), cross::<A>(a, b)];
            let cof_change = [
                plus(cross::<A>(db, d), cross::<A>(b, dd)),
                plus(cross::<A>(dd, a), cross::<A>(d, da)),
                plus(cross::<A>(da, b), cross::<A>(a, db)),
            ];
            let j = dot::<A>(a, cof[0], 0.0);
            let twice = laws.law[0][k];
            let [_, slope, bend] = volumetric::<A, LOGARITHM>(laws, k, j);
            let along = dot::<A>(cof[0], da, dot::<A>(cof[1], db, dot::<A>(cof[2], dd, 0.0)));
            let volume = laws.volume[k];
            let (p, q, t) = (volume * twice, volume * bend * along, volume * slope);
            for r in 0..3 {
                let mut row = [0.0; 3];
                for c in 0..3 {
                    let bent = A::add(cof[r][c], q, cof_change[r][c] * t);
                    row[c] = A::add(change[r][c], p, bent);
                }
                let [x, y, z] = row;
                self.stress[3 * r][k] = x;
                self.stress[3 * r + 1][k] = y;
                self.stress[3 * r + 2][k] = z;
            }
            self.ratio[k] = j;
        }
    }

    /// Records and own forces from stresses and sums.
    #[inline(always)]
    pub(crate) fn records<A: Arithmetic>(&mut self, constants: BlockConstants<'_>) {
        for r in 0..3 {
            self.record_row::<A>(r, constants);
        }
    }

    #[inline(always)]
    fn record_row<A: Arithmetic>(&mut self, r: usize, constants: BlockConstants<'_>) {
        let p = &self.stress[3 * r..3 * r + 3];
        let s = &self.sums[r];
        let b = constants.matrix;
        // `V P B - c S A⁻¹`.
        // Written out: over a loop of three, compilers take the three for lanes.
        let mut q = [
            product::<A>(p, [&b[0], &b[3], &b[6]]),
            product::<A>(p, [&b[1], &b[4], &b[7]]),
            product::<A>(p, [&b[2], &b[5], &b[8]]),
        ];
        let (mut along, mut force) = (ZERO, ZERO);
        if let Some(control) = constants.control {
            let h = match constants.inverse {
                Some([xx, yy, zz, yz, zx, xy]) => [
                    product::<A>(s, [xx, xy, zx]),
                    product::<A>(s, [xy, yy, yz]),
                    product::<A>(s, [zx, yz, zz]),
                ],
                // Without multipliers B is the inverse itself.
                None => [
                    product::<A>(s, [&b[0], &b[3], &b[6]]),
                    product::<A>(s, [&b[1], &b[4], &b[7]]),
                    product::<A>(s, [&b[2], &b[5], &b[8]]),
                ],
            };
            for k in 0..3 {
                q[k] = subtract::<A>(&h[k], control, &q[k]);
            }
            along = add::<A>(&self.moved[r], control, &along);
            force = add::<A>(&s[ONE], control, &force);
        }
        for k in 0..3 {
            along = add::<A>(&q[k], &self.place[k], &along);
            force = add::<A>(&q[k], &self.sums[3][k], &force);
        }
        let mut bent = [ZERO; 3];
        if let (true, Some(scale)) = (L > 4, constants.scale) {
            for k in 0..3 {
                let at = (ONE + 1 + k) % L;
                bent[k] = add::<A>(&p[k], scale, &ZERO);
                along = add::<A>(&bent[k], &self.place[at], &along);
                force = add::<A>(&bent[k], &self.sums[3][at], &force);
            }
        }
        self.force[r] = force;
        self.record[r][0] = [q[0], q[1], q[2], along];
        self.record[r][1] = [bent[0], bent[1], bent[2], ZERO];
    }

    /// Writes the records of all lanes as they are stored.
    #[inline(always)]
    pub(crate) fn write(&self, to: &mut Sixteen<Record<L>>) {
        for r in 0..3 {
            for half in 0..L / 4 {
                let woven = weave(&self.record[r][half]);
                for lane in 0..BLOCK {
                    to.0[lane][r][4 * half..4 * half + 4].copy_from_slice(&woven[lane]);
                }
            }
        }
    }

    /// The record of a lane as it is stored.
    pub(crate) fn record(&self, lane: usize) -> Record<L> {
        let mut record = [[0.0; L]; 3];
        for r in 0..3 {
            for k in 0..L {
                record[r][k] = self.record[r][k / 4][k % 4][lane];
            }
        }
        record
    }

    /// A matrix of a lane.
    #[inline(always)]
    pub(crate) fn matrix(&self, planes: &[Plane; 9], lane: usize) -> DMat3 {
        let p = |k: usize| planes[k][lane];
        DMat3::from_cols_array(&[p(0), p(3), p(6), p(1), p(4), p(7), p(2), p(5), p(8)])
    }

    /// Writes the deformation gradients.
    #[inline(always)]
    pub(crate) fn write_deformation(&self, to: &mut Planes) {
        *to = self.deformation;
    }

    /// Takes the deformation gradients at which a tangent product is taken.
    #[inline(always)]
    pub(crate) fn set_at(&mut self, from: &Planes) {
        self.at = *from;
    }

    /// Takes one of them.
    pub(crate) fn set_matrix_at(&mut self, lane: usize, f: DMat3) {
        set_lane(&mut self.at, lane, f);
    }

    /// Replaces a lane's deformation gradient (or its change) and stress.
    pub(crate) fn set_matrix(&mut self, lane: usize, f: DMat3, stress: DMat3) {
        self.set_deformation(lane, f);
        self.set_stress(lane, stress);
    }

    /// Replaces a lane's deformation gradient, or its change.
    pub(crate) fn set_deformation(&mut self, lane: usize, f: DMat3) {
        set_lane(&mut self.deformation, lane, f);
    }

    /// Replaces a lane's stress, or its change.
    pub(crate) fn set_stress(&mut self, lane: usize, stress: DMat3) {
        set_lane(&mut self.stress, lane, stress);
    }

    /// What a node's own row gives itself.
    #[inline(always)]
    pub(crate) fn own_force(&self, lane: usize) -> [f64; 3] {
        let [x, y, z] = &self.force;
        [x[lane], y[lane], z[lane]]
    }
}

/// Sums of one node into a lane.
#[inline(always)]
pub(crate) fn gather<A: Arithmetic, const L: usize>(
    model: &Model,
    fixed: Fixed<'_, L>,
    moves: &[Move],
    node: usize,
    lane: usize,
    block: &mut Block<L>,
) {
    // Mean pressures reach nodes without strain, whose own row then counts.
    let found: PairSums<L> = if model.inactive.is_unstrained(node) && model.means.is_none() {
        [[0.0; L]; 4]
    } else {
        let row = model.pairs.row(node);
        sums::<A, L>(node, row, fixed.anchors, moves)
    };
    block.take(lane, &found, at(fixed.anchors, node), &moves[node]);
}

/// Replaces the matrix of a lane.
fn set_lane(planes: &mut Planes, lane: usize, m: DMat3) {
    for (plane, value) in planes.iter_mut().zip(m.transpose().to_cols_array()) {
        plane[lane] = value;
    }
}

/// Value and two derivatives of the volumetric energy, as `Volumetric::at` above its extension.
#[inline(always)]
fn volumetric<A: Arithmetic, const LOGARITHM: bool>(laws: &Laws, lane: usize, j: f64) -> [f64; 3] {
    let (log, log_squared) = (laws.law[1][lane], laws.law[2][lane]);
    let (linear, constant) = (laws.law[3][lane], laws.law[4][lane]);
    let off = j - 1.0;
    let part = barrier::<A>(j);
    let held = laws.law[5][lane];
    let slope = A::add(held, part[1], A::add(constant, off, -linear));
    let energy = A::add(held, part[0], off * A::add(0.5 * constant, off, -linear));
    let constant = A::add(held, part[2], constant);
    if !LOGARITHM {
        return [energy, slope, constant];
    }
    // A lane below the extension is not used; one without logarithm takes that of one.
    let has = log.abs() + log_squared.abs() > 0.0;
    let safe = if has { j } else { 1.0 };
    let (l, inverse) = (ln::<A>(safe), safe.recip());
    let slow = A::add(log_squared, l, -log);
    [
        A::add(l, A::add(-0.5 * log_squared, l, slow), energy),
        A::add(slow, inverse, slope),
        A::add((log_squared - slow) * inverse, inverse, constant),
    ]
}

#[inline(always)]
fn cross<A: Arithmetic>(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        A::add(a[1], b[2], -(a[2] * b[1])),
        A::add(a[2], b[0], -(a[0] * b[2])),
        A::add(a[0], b[1], -(a[1] * b[0])),
    ]
}

#[inline(always)]
fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a · b + c`.
#[inline(always)]
fn dot<A: Arithmetic>(a: [f64; 3], b: [f64; 3], c: f64) -> f64 {
    A::add(a[0], b[0], A::add(a[1], b[1], A::add(a[2], b[2], c)))
}
