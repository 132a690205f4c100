//! Samples of deformable surfaces: points, and the affine disks around them.

use glam::{DMat3, DVec3};
use std::collections::{HashMap, HashSet};
use std::ops::Range;

/// Pivot, relative to the weighted mean square, below which nodes do not determine a direction.
const LEAST_PIVOT: f64 = 0.02;
/// Most nodes of a sample.
const MOST_NODES: usize = 16;
/// Nodes on its own side from which on a flank hangs on them alone, twice as many as a linear fit asks for. With 1, rows of three nodes
/// moved ten times as far as these (`random --all`, seed 3002, scene 003: 72 % of the energy came from nowhere); with 4, 6 and
/// 8 flanks of `prove touch` press equally deep.
const LEAST_OWN: usize = 8;
/// Largest thickness (spacings): a surface farther from its row turns with nothing, and is in no contact. On crumbs of a cut
/// ellipsoid (`random --all`, seed 102, scene 068) some lay 2.8 spacings off; lists with room for both sides' would name
/// nearly all pairs. With 0.5 and 1 that scene ends in 34,903 and 32,406 steps, 0.08 and 0.04 % unexplained.
const THICKEST: f64 = 1.0;
/// Least cosine between the normals of the surface and of a triangle, `√⅔`, from which on it may stand in front of that. A triangle on a
/// sphere whose radius is as long as its edges has it. Triangles that cut off a crease face elsewhere. With 0 a fold of
/// `prove touch` presses 0.43 spacings deep for 0.19.
const ALIKE: f64 = 0.816;
/// Distance across the normal (spacings) within which nodes bear what presses a flank. With 1.1, 1.3, 1.5 and 2 the force of a pressed
/// block of 1,000 nodes (`contact`) is 1.4, 0.8, 0.4 and 3.0 % above the uncut block's, of mere points 0.1, 0.2, 1.2 and 0.6 %.
const BEARING: f64 = 1.3;
/// Part of a whole face, as it is near a sample, that cuts have to have opened; fitted rows else, as at a front and at rims. With 0.3,
/// 0.6, 0.8 and 1 flanks of the scene `wound` press 0.51, 0.45, 0.35 and 0.33 spacings deep while it is cut; with 0.3, 0.7
/// and 0.8 the block's force is 0.1, 0.5 and 0.8 % off.
const OPEN: f64 = 0.8;
/// Largest distance (spacings) of a flank from where the volumes of its nodes end. Where faces of several cuts open the same nodes it is
/// more, and rows there are fitted: without, crossing cuts (`prove touch`) press 0.37 spacings deep, with 0.4 0.24.
const FLUSH: f64 = 0.4;
/// Radius of a disk over the distance of samples: every point has some eight disks opposite.
pub(crate) const REACH: f64 = 1.6;

/// One sample of a surface at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiskSample {
    /// Position (m).
    pub position: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
    /// Area (m²); 0 for a sample that is in contact with nothing.
    pub area: f64,
    /// Whether it lies on a cut. Behind such a sample near it at rest there is tissue, up to the uncut surface that faces the
    /// other way: the two are never in contact.
    pub flank: bool,
    /// Number of the body.
    pub body: u32,
    /// Young's modulus of the body over the spacing of its nodes (N/m³).
    pub stiffness: f64,
    /// Spacing of the body's nodes (m).
    pub spacing: f64,
}

/// Samples of the surfaces of all bodies, bound to nodes.
///
/// A sample is a point `x = Σ W_b x_b` with an area, and the affine disk `y(ξ) = x + ξ₁ t₁ + ξ₂ t₂`, with
/// `t = Σ S_b x_b`, around it. Weights and slopes are those of a linear fit by weighted least squares to the
/// sample's nodes (Lancaster and Salkauskas 1981), so that both follow linear fields exactly. On flanks weights are in
/// proportion to the area vectors that the cut opened at nodes, so that pressed flanks bear a uniform stress; slopes make them follow
/// fields that are linear along the disk.
#[derive(Debug, Clone, Default)]
pub struct ContactDisks {
    pub(crate) samples: Vec<DiskSample>,
    /// Nodes of each sample, of the [`MOST_NODES`] entries that it has in the lists below.
    counts: Vec<u32>,
    pub(crate) nodes: Vec<u32>,
    pub(crate) weights: Vec<f64>,
    pub(crate) slopes: Vec<[f64; 2]>,
    /// Distance (m) of the surface outside the row's position, where the nodes do not determine it.
    pub(crate) thickness: Vec<f64>,
    /// Radius (m) of the disk; 0 for what is no disk.
    pub(crate) reach: Vec<f64>,
}

/// A sample where its nodes are. What rules a pair out is in the first line of cache.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub(crate) struct Placed {
    pub(crate) x: DVec3,
    pub(crate) n: DVec3,
    pub(crate) thickness: f64,
    pub(crate) spacing: f64,
    pub(crate) t: [DVec3; 2],
    pub(crate) reach: f64,
    /// `(TᵀT)⁻¹`: its entries 11, 12 and 22.
    pub(crate) inverse: [f64; 3],
    /// `|t₁ × t₂|`: its area over that at rest.
    pub(crate) area: f64,
}

impl Placed {
    /// `(TᵀT)⁻¹ v`.
    pub(crate) fn solve(&self, v: [f64; 2]) -> [f64; 2] {
        let [a, b, c] = self.inverse;
        [a * v[0] + b * v[1], b * v[0] + c * v[1]]
    }
}

impl ContactDisks {
    /// Adds a sample on the first 16 of `nodes` of the body, among nodes at rest at `rest` (m). Nodes that occur twice
    /// count once. With `areas`, the area vector (m², outward) that cuts have opened at each of `nodes`, it is on the 16 of
    /// them that bear most of it, if these open to its normal; without any it is fitted to the first. A flank with areas hangs
    /// on nodes on its own side of its plane where eight are there, and touches nothing where none is. Its distance from its row
    /// stays as it is at rest, as of a curved surface in front of a triangle. Where a triangle cuts off a crease it has none. One
    /// that is more than a spacing off is in contact with nothing.
    ///
    /// # Panics
    /// If a node is not there, there is none, or areas are of another number.
    pub fn push(&mut self, sample: DiskSample, (nodes, areas): (&[u32], &[DVec3]), rest: &[DVec3]) {
        self.samples.push(sample);
        self.counts.push(0);
        self.thickness.push(0.0);
        self.reach.push(0.0);
        let room = self.samples.len() * MOST_NODES;
        self.nodes.resize(room, 0);
        self.weights.resize(room, 0.0);
        self.slopes.resize(room, [0.0; 2]);
        self.set(self.samples.len() - 1, sample, (nodes, areas), rest);
    }

    /// Replaces the sample `at`, as [`ContactDisks::push`] adds one.
    ///
    /// # Panics
    /// As [`ContactDisks::push`], and if the sample is not there.
    pub fn set(
        &mut self,
        at: usize,
        mut sample: DiskSample,
        (mut nodes, mut areas): (&[u32], &[DVec3]),
        rest: &[DVec3],
    ) {
        assert!(!nodes.is_empty(), "at least one node per sample");
        let fits = areas.is_empty() || areas.len() == nodes.len();
        assert!(fits, "an area per node");
        // Near the front of a cut a flank sees both sides. What has no nodes on its own is no tissue that could press.
        let own;
        if sample.flank && !areas.is_empty() {
            own = own_side(&sample, (nodes, areas), rest);
            if own.0.len() >= LEAST_OWN {
                (nodes, areas) = (&own.0, &own.1);
            } else if own.0.is_empty() {
                sample.area = 0.0;
            }
        }
        let shares = shares(&sample, (nodes, areas), rest);
        let mut own: Vec<u32> = shares.iter().map(|(_, node)| *node).collect();
        for node in nodes {
            if own.len() < MOST_NODES && !own.contains(node) {
                own.push(*node);
            }
        }
        let (t, n) = (tangents(sample.normal), sample.normal);
        let arm = |node: &u32| rest[*node as usize] - sample.position;
        let farthest = own
            .iter()
            .map(|node| arm(node).length())
            .fold(0.0, f64::max);
        let scale = (1.1 * farthest).max(f64::MIN_POSITIVE);
        let term = |node: &u32| {
            let arm = arm(node) / scale;
            let weight = (1.0 - arm.length_squared()).max(0.0).powi(2);
            ([1.0, arm.dot(t[0]), arm.dot(t[1]), arm.dot(n)], weight)
        };
        let mut moment = [[0.0; 4]; 4];
        for (r, weight) in own.iter().map(term) {
            for (row, a) in moment.iter_mut().zip(r) {
                for (entry, b) in row.iter_mut().zip(r) {
                    *entry += weight * a * b;
                }
            }
        }
        let (rows, found) = solve(moment);
        let begin = at * MOST_NODES;
        let of_shares = |(share, node): &(f64, u32)| arm(node) * *share;
        let off: DVec3 = shares.iter().map(of_shares).sum();
        let (mut middle, mut along) = (DVec3::ZERO, [DVec3::ZERO; 2]);
        for ((k, node), entry) in own.iter().enumerate().zip(begin..) {
            let (r, weight) = term(node);
            let [fitted, s, u] = rows.map(|row| weight * dot(row, r));
            let slope = [s / scale, u / scale];
            let share = shares.get(k).map_or(0.0, |(share, _)| *share);
            let borne = share - slope[0] * off.dot(t[0]) - slope[1] * off.dot(t[1]);
            let w = if shares.is_empty() { fitted } else { borne };
            self.nodes[entry] = *node;
            self.weights[entry] = w;
            self.slopes[entry] = slope;
            middle += arm(node) * w;
            along[0] += arm(node) * slope[0];
            along[1] += arm(node) * slope[1];
        }
        self.counts[at] = index(own.len());
        let facing = along[0].cross(along[1]).normalize_or_zero().dot(n);
        let is_crease = own.len() == 3 && facing < ALIKE;
        self.thickness[at] = if is_crease { 0.0 } else { -middle.dot(n) };
        let is_carried = self.thickness[at].abs() <= THICKEST * sample.spacing;
        self.reach[at] = if found[1] && found[2] && is_carried {
            REACH * sample.area.sqrt()
        } else {
            0.0
        };
        let area = if is_carried { sample.area } else { 0.0 };
        self.samples[at] = DiskSample { area, ..sample };
    }

    /// Some samples alone, on nodes numbered as they first occur, and these nodes.
    pub(crate) fn alone(&self, samples: &[u32]) -> (Self, Vec<u32>) {
        let (mut disks, mut nodes) = (Self::default(), Vec::new());
        let mut numbers = HashMap::new();
        for &sample in samples {
            let at = sample as usize;
            let first = disks.nodes.len();
            let entries = at * MOST_NODES..(at + 1) * MOST_NODES;
            disks.samples.push(self.samples[at]);
            disks.counts.push(self.counts[at]);
            disks.thickness.push(self.thickness[at]);
            disks.reach.push(self.reach[at]);
            disks
                .weights
                .extend_from_slice(&self.weights[entries.clone()]);
            disks
                .slopes
                .extend_from_slice(&self.slopes[entries.clone()]);
            disks
                .nodes
                .extend(self.nodes[self.row(at)].iter().map(|node| {
                    *numbers.entry(*node).or_insert_with(|| {
                        nodes.push(*node);
                        index(nodes.len() - 1)
                    })
                }));
            disks.nodes.resize(first + MOST_NODES, 0);
        }
        (disks, nodes)
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Bytes of the arrays.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.samples)
            + size_of_val(&*self.counts)
            + size_of_val(&*self.nodes)
            + size_of_val(&*self.weights)
            + size_of_val(&*self.slopes)
            + size_of_val(&*self.thickness)
            + size_of_val(&*self.reach)
    }

    pub(crate) fn row(&self, sample: usize) -> Range<usize> {
        let begin = sample * MOST_NODES;
        begin..begin + self.counts[sample] as usize
    }

    /// Whether two samples have a node in common. Those of an uncut surface then have no gap between them that nodes could open or
    /// close, as in a crease of a mesh finer than the spacing.
    pub(crate) fn share_nodes(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|sample| &self.nodes[self.row(sample as usize)]);
        a.iter().any(|node| b.contains(node))
    }

    /// Sum of the weights' amounts: how much farther than its nodes a sample may move.
    pub(crate) fn amplification(&self, sample: usize) -> f64 {
        self.weights[self.row(sample)].iter().map(|w| w.abs()).sum()
    }

    /// A vector field of the nodes at a sample.
    pub(crate) fn point(&self, sample: usize, field: &[DVec3]) -> DVec3 {
        let entries = self
            .row(sample)
            .map(|entry| (self.nodes[entry], self.weights[entry]));
        entries.fold(DVec3::ZERO, |x, (node, weight)| {
            x + field[node as usize] * weight
        })
    }

    /// The same, and its derivatives along the disk.
    pub(crate) fn gather(&self, sample: usize, field: &[DVec3]) -> (DVec3, [DVec3; 2]) {
        let (mut x, mut t) = (DVec3::ZERO, [DVec3::ZERO; 2]);
        for entry in self.row(sample) {
            let y = field[self.nodes[entry] as usize];
            x += y * self.weights[entry];
            let slope = self.slopes[entry];
            t[0] += y * slope[0];
            t[1] += y * slope[1];
        }
        (x, t)
    }

    /// Where a sample is (m), and how far (m) its disk reaches as it is stretched, at least as at rest.
    pub(crate) fn stretched(&self, sample: usize, positions: &[DVec3]) -> (DVec3, f64) {
        let (x, [a, b]) = self.gather(sample, positions);
        let (aa, ab, bb) = (a.length_squared(), a.dot(b), b.length_squared());
        let most = 0.5 * (aa + bb) + (0.25 * (aa - bb).powi(2) + ab * ab).sqrt();
        (x, self.reach[sample] * most.sqrt().max(1.0))
    }

    pub(crate) fn place(&self, sample: usize, positions: &[DVec3]) -> Placed {
        let (x, t) = self.gather(sample, positions);
        let at = Placed {
            x,
            n: self.samples[sample].normal,
            thickness: self.thickness[sample],
            spacing: self.samples[sample].spacing,
            reach: self.reach[sample],
            area: 1.0,
            ..Placed::default()
        };
        if at.reach == 0.0 {
            return at;
        }
        let (a, b, c) = (t[0].length_squared(), t[0].dot(t[1]), t[1].length_squared());
        let determinant = (a * c - b * b).max(f64::MIN_POSITIVE);
        let normal = t[0].cross(t[1]);
        Placed {
            t,
            n: normal.normalize_or_zero(),
            area: normal.length(),
            inverse: [c / determinant, -b / determinant, a / determinant],
            ..at
        }
    }

    /// Adds a force (N) at a sample and those conjugate to its tangents to the nodes' forces.
    pub(crate) fn scatter(&self, sample: usize, (f, m): (DVec3, [DVec3; 2]), forces: &mut [DVec3]) {
        for entry in self.row(sample) {
            let slope = self.slopes[entry];
            forces[self.nodes[entry] as usize] +=
                f * self.weights[entry] + m[0] * slope[0] + m[1] * slope[1];
        }
    }
}

/// Nodes on a sample's side of its plane, each once, and their areas.
fn own_side(
    sample: &DiskSample,
    (nodes, areas): (&[u32], &[DVec3]),
    rest: &[DVec3],
) -> (Vec<u32>, Vec<DVec3>) {
    let mut known = HashSet::new();
    let side = |node: u32| (rest[node as usize] - sample.position).dot(sample.normal);
    let all = nodes.iter().copied().zip(areas.iter().copied());
    all.filter(|(node, _)| side(*node) <= 0.0 && known.insert(*node))
        .unzip()
}

/// Nodes that bear what presses a sample and the parts that they bear, the largest first, which sum to 1; none if cuts have opened no
/// face there.
fn shares(
    sample: &DiskSample,
    (nodes, areas): (&[u32], &[DVec3]),
    rest: &[DVec3],
) -> Vec<(f64, u32)> {
    let share = |(&node, area): (&u32, &DVec3)| {
        let across = (rest[node as usize] - sample.position).reject_from_normalized(sample.normal);
        let near = 1.0 - across.length_squared() / (BEARING * sample.spacing).powi(2);
        let share = area.dot(sample.normal) * near.max(0.0).powi(2);
        (share != 0.0).then_some((share, node))
    };
    let mut shares: Vec<(f64, u32)> = nodes.iter().zip(areas).filter_map(share).collect();
    shares.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()).then(a.1.cmp(&b.1)));
    shares.dedup();
    shares.truncate(MOST_NODES);
    let sum: f64 = shares.iter().map(|(share, _)| share).sum();
    let whole = std::f64::consts::FRAC_PI_3 * (BEARING * sample.spacing).powi(2);
    // A linear fit asks for four.
    if shares.len() < 4 || sum < OPEN * whole {
        return Vec::new();
    }
    for (share, _) in &mut shares {
        *share /= sum;
    }
    let above = |node: u32| (rest[node as usize] - sample.position).dot(sample.normal);
    let depth = shares.iter().map(|(share, node)| share * above(*node));
    if depth.sum::<f64>().abs() > FLUSH * sample.spacing {
        shares.clear();
    }
    shares
}

fn dot(a: [f64; 4], b: [f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Unit tangents with `t₁ × t₂` along the normal.
fn tangents(normal: DVec3) -> [DVec3; 2] {
    let (a, b) = normal.any_orthonormal_pair();
    let turned = DMat3::from_cols(a, b, normal).determinant() < 0.0;
    if turned { [b, a] } else { [a, b] }
}

/// Rows 0 to 2 of the inverse of a symmetric matrix, of which directions with too small a pivot are left out; which of
/// them are there.
fn solve(mut m: [[f64; 4]; 4]) -> ([[f64; 4]; 3], [bool; 4]) {
    let mut inverse = [[0.0; 4]; 4];
    let mut found = [false; 4];
    let total = m[0][0];
    let size = [1, 2, 3].map(|i| m[i][i]).iter().sum::<f64>() / 3.0;
    for (i, row) in inverse.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for k in 0..4 {
        let least = if k == 0 { 0.0 } else { LEAST_PIVOT * size };
        found[k] = m[k][k] > least && total > 0.0;
        let pivot = m[k][k];
        for i in 0..4 {
            if !found[k] {
                (m[k][i], m[i][k], inverse[k][i], inverse[i][k]) = (0.0, 0.0, 0.0, 0.0);
                continue;
            }
            if i == k {
                continue;
            }
            let factor = m[i][k] / pivot;
            for j in 0..4 {
                m[i][j] -= factor * m[k][j];
                inverse[i][j] -= factor * inverse[k][j];
            }
        }
        if found[k] {
            for j in 0..4 {
                m[k][j] /= pivot;
                inverse[k][j] /= pivot;
            }
        }
    }
    ([inverse[0], inverse[1], inverse[2]], found)
}

pub(crate) fn index(count: usize) -> u32 {
    u32::try_from(count).expect("fewer than 2^32 samples and weights")
}

#[cfg(test)]
#[path = "disks_tests.rs"]
mod tests;
