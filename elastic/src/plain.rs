//! Energy, stress and zero-energy control of neo-Hookean nodes, several nodes at a time.
//!
//! What belongs to a node costs as much as all its pairs when it is computed node by node: one long
//! chain through a logarithm and a division. Laid out by component, with nodes in the lanes, the
//! compiler turns the same operations into vector ones. Nodes of another kind (other laws, deficient
//! rows, almost no volume left) sit in their lanes unused and are computed one by one.

#![allow(
    clippy::needless_range_loop,
    reason = "components and lanes are walked in step over several arrays"
)]

use crate::body::Body;
use crate::law::{EXTENSION_VOLUME_RATIO, ln};

/// Nodes at a time; divides the chunk of parallel work.
pub(crate) const BLOCK: usize = 16;

/// Numbers of a block's nodes, by component.
pub(crate) type Plane = [f64; BLOCK];

/// What the gathers of a block's nodes give and what follows from it. Matrices are transposed: their
/// rows are stored one after the other.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    /// `sum_j u_ij ⊗ g_ij`.
    pub(crate) gradient: [Plane; 9],
    /// `sum_j u_ij ⊗ y_ij`.
    pub(crate) offset: [Plane; 9],
    /// `-V P`.
    pub(crate) stress: [Plane; 9],
    /// `c H`.
    pub(crate) control: [Plane; 9],
    /// What a node's own row gives itself.
    pub(crate) force: [Plane; 3],
    /// `V W - V P : (F - I) / 2`.
    pub(crate) work: Plane,
    /// `det F`.
    pub(crate) ratio: Plane,
    /// Bound on the tangent modulus, as `Prepared::tangent_bound`.
    pub(crate) bound: Plane,
    constants: Constants,
}

/// `2 c10`, the volumetric law and `V` of nodes, and what control needs.
#[derive(Debug, Clone)]
struct Constants {
    law: [Plane; 5],
    volume: Plane,
    self_gradient: [Plane; 3],
    own_offset: [Plane; 3],
    /// `c A⁻¹`: xx, yy, zz, yz, zx, xy.
    inverse: [Plane; 6],
}

const ZERO: Plane = [0.0; BLOCK];

impl Block {
    pub(crate) fn new() -> Self {
        Self {
            gradient: [ZERO; 9],
            offset: [ZERO; 9],
            stress: [ZERO; 9],
            control: [ZERO; 9],
            force: [ZERO; 3],
            work: ZERO,
            ratio: ZERO,
            bound: ZERO,
            constants: Constants {
                law: [ZERO; 5],
                volume: ZERO,
                self_gradient: [ZERO; 3],
                own_offset: [ZERO; 3],
                inverse: [ZERO; 6],
            },
        }
    }

    /// Whether the node in a lane is one for which [`Block::evaluate`] holds.
    #[inline(always)]
    pub(crate) fn holds(&self, body: &Body, node: usize, lane: usize) -> bool {
        body.is_plain(node)
            && (self.ratio[lane] >= EXTENSION_VOLUME_RATIO
                || !body.law_shared(node).has_logarithm())
    }

    /// Takes the constants of the nodes from `first` on into the first `count` lanes.
    #[inline(always)]
    fn load<const CONTROLLED: bool>(&mut self, body: &Body, first: usize, count: usize) {
        let c = &mut self.constants;
        for lane in 0..count {
            let node = first + lane;
            let law = body.law_shared(node).plain_constants();
            for (plane, value) in c.law.iter_mut().zip(law) {
                plane[lane] = value;
            }
            c.volume[lane] = body.elastic_volumes[node];
            let g = body.self_gradients[node].to_array();
            for (plane, value) in c.self_gradient.iter_mut().zip(g) {
                plane[lane] = value;
            }
            if CONTROLLED {
                let (offset, inverse, stiffness) = body.control_constants(node);
                for (plane, value) in c.own_offset.iter_mut().zip(offset.to_array()) {
                    plane[lane] = value;
                }
                for (plane, value) in c.inverse.iter_mut().zip(inverse) {
                    plane[lane] = value * stiffness;
                }
            }
        }
    }

    /// Fills `stress`, `control`, `force` and `work` from `gradient` and `offset`.
    #[inline(always)]
    pub(crate) fn evaluate<const CONTROLLED: bool, const LOGARITHM: bool>(
        &mut self,
        body: &Body,
        first: usize,
        count: usize,
    ) {
        self.load::<CONTROLLED>(body, first, count);
        let c = &self.constants;
        for k in 0..BLOCK {
            let h = |i: usize| self.gradient[i][k];
            let (a, b, d) = (
                [h(0) + 1.0, h(1), h(2)],
                [h(3), h(4) + 1.0, h(5)],
                [h(6), h(7), h(8) + 1.0],
            );
            let cof = [cross(b, d), cross(d, a), cross(a, b)];
            let j = dot(a, cof[0]);
            let (twice, log, log_squared) = (c.law[0][k], c.law[1][k], c.law[2][k]);
            let (linear, constant) = (c.law[3][k], c.law[4][k]);
            // As `Volumetric::at`.
            let off = j - 1.0;
            let (mut volumetric, mut slope) = (
                off * (0.5 * constant * off - linear),
                constant * off - linear,
            );
            let mut curvature = constant;
            if LOGARITHM {
                // A lane below the extension is not used; one without logarithm takes that of one.
                let has = log.abs() + log_squared.abs() > 0.0;
                let safe = if has { j } else { 1.0 };
                let (l, inverse) = (ln(safe), safe.recip());
                volumetric += l * (0.5 * log_squared * l - log);
                slope += (log_squared * l - log) * inverse;
                curvature += (log + log_squared * (1.0 - l)) * inverse * inverse;
            }
            let squares = dot(a, a) + dot(b, b) + dot(d, d);
            let energy = 0.5 * twice * (squares - 3.0) + volumetric;
            let volume = c.volume[k];
            let (p, q) = (-volume * twice, -volume * slope);
            // Written out: an array's `map` is not always inlined, and then no lane is filled.
            let stress = [
                scaled_sum(a, p, cof[0], q),
                scaled_sum(b, p, cof[1], q),
                scaled_sum(d, p, cof[2], q),
            ];
            let g = triple(&c.self_gradient, k);
            let mut force = [dot(stress[0], g), dot(stress[1], g), dot(stress[2], g)];
            let mut work = 0.0;
            for r in 0..3 {
                for i in 0..3 {
                    self.stress[3 * r + i][k] = stress[r][i];
                    work += stress[r][i] * h(3 * r + i);
                }
            }
            if CONTROLLED {
                let y = triple(&c.own_offset, k);
                let inverse = |i: usize| c.inverse[i][k];
                let (xx, yy, zz) = (inverse(0), inverse(1), inverse(2));
                let (yz, zx, xy) = (inverse(3), inverse(4), inverse(5));
                for r in 0..3 {
                    let offset = |i: usize| self.offset[3 * r + i][k];
                    let s = [offset(0), offset(1), offset(2)];
                    let row = [
                        dot([xx, xy, zx], s),
                        dot([xy, yy, yz], s),
                        dot([zx, yz, zz], s),
                    ];
                    force[r] -= dot(row, y);
                    for i in 0..3 {
                        self.control[3 * r + i][k] = row[i];
                    }
                }
            }
            for r in 0..3 {
                self.force[r][k] = force[r];
            }
            self.work[k] = volume * energy + 0.5 * work;
            self.ratio[k] = j;
            let cofactors = dot(cof[0], cof[0]) + dot(cof[1], cof[1]) + dot(cof[2], cof[2]);
            self.bound[k] = twice + curvature.max(0.0) * cofactors + slope.abs() * squares.sqrt();
        }
    }
}

/// The numbers of lane `k`.
#[inline(always)]
fn triple(planes: &[Plane; 3], k: usize) -> [f64; 3] {
    [planes[0][k], planes[1][k], planes[2][k]]
}

/// `p a + q b`.
#[inline(always)]
fn scaled_sum(a: [f64; 3], p: f64, b: [f64; 3], q: f64) -> [f64; 3] {
    [
        a[0] * p + b[0] * q,
        a[1] * p + b[1] * q,
        a[2] * p + b[2] * q,
    ]
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
