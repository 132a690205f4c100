//! Nodes that a cut left without a strain of their own.
//!
//! A deformation gradient needs neighbours on all sides. Where a cut leaves a node too few, the little
//! that its row still sees turns inside out under load and no penalty holds it. Such a *deficient* node
//! carries no strain energy; along each pair that is left acts a bond, as in bond-based peridynamics
//! (Silling 2000), with the energy
//!
//! `E_b = k/2 (|x|_e - |X|_e - d)²`, `|x|_e = sqrt(x·x + e² X·X)`, `k = kappa mu V_i f_ij / (n_i X·X) max(1, 3 / Σ_j f_ij)`,
//!
//! `n_i` the pairs that the node had, `f_ij` the fraction that the cut left of one; together they hold as three whole pairs at
//! least. It is objective, conserves momenta, is bounded in stiffness and has no state that it could invert from. `d` begins
//! where the bonds hold no more energy than the node's strain did, takes up what a bond gains in stiffness, and decays
//! where that lowers the bond's energy: one that is drawn out stays so until it slackens.

use glam::{DMat3, DVec3};

use crate::kernel::storage::{Planes, bytes_of, gradient, set_gradient};
use crate::kernel::subset::place_among;
use crate::law::tensor::outer;

/// `kappa`: a full neighbourhood of bonds then resists shear a third as much as the tissue did
/// (15 would be equal: the mean of `(n·E n)²` over directions is `2/15 E:E`), so that fragments never are
/// what limits the step. On 21 hard rows of `benches -- matrix` 15, 22, 18 and 14 acceptance limits are missed with 1.25,
/// 2.5, 5 and 10: no trend.
pub(crate) const STIFFNESS: f64 = 5.0;
/// Least `Σ_j f_ij`, three whole pairs: as few as hold a node in all directions. A node that hung on a single pair of a fraction of
/// 0.016 was drawn out to four times its rest distance (`liver 3000 front` of `benches -- matrix`). With 1 that row holds as
/// well, but a block of 2 kPa does not end; with 6 steps of a factor of 0.8 release 2.7 % less (1 asked by `prove invariance`).
pub(crate) const LEAST_SUM: f64 = 3.0;
/// `e`: bonds keep a direction when they are pressed to nothing. With 0.1 and 0.4 `prove matrix`, `griffith` and `cracks --quick` have
/// the same figures within 1 %.
const SOFTENING: f64 = 0.2;
/// Fraction of a bond's rest length below which what is left of `d` is dropped. With 1e-5 `prove matrix` keeps its limits.
const SMALLEST_OFFSET: f64 = 1e-4;

/// A bond of a deficient node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bond {
    pub(crate) node: u32,
    pub(crate) other: u32,
    /// `k` (N/m).
    pub(crate) stiffness: f64,
    /// `X·X` (m²).
    pub(crate) rest_squared: f64,
    /// `|X|_e` (m), rounded as `|x|_e` is: a bond at rest has no energy, not that of round-off.
    pub(crate) natural: f64,
    /// `d` (m).
    pub(crate) offset: f64,
    /// Change of `d` by the last decay (m).
    pub(crate) decayed: f64,
    /// Where `other` is from `node` (m), at the state last evaluated.
    pub(crate) x: DVec3,
    /// `|x|_e` (m).
    pub(crate) length: f64,
    /// Force (N) on `node` there; on `other` its opposite.
    pub(crate) pull: DVec3,
}

impl Bond {
    pub(crate) fn new(
        [node, other]: [u32; 2],
        stiffness: f64,
        rest_squared: f64,
        x: DVec3,
    ) -> Self {
        Self {
            node,
            other,
            stiffness,
            rest_squared,
            natural: softened(rest_squared, rest_squared),
            offset: 0.0,
            decayed: 0.0,
            x,
            length: softened(x.length_squared(), rest_squared),
            pull: DVec3::ZERO,
        }
    }

    pub(crate) fn set_x(&mut self, x: DVec3) {
        self.x = x;
        self.length = softened(x.length_squared(), self.rest_squared);
    }

    /// Tension (N).
    pub(crate) fn tension(&self) -> f64 {
        self.stiffness * (self.length - self.natural - self.offset)
    }

    pub(crate) fn energy(&self) -> f64 {
        let tension = self.tension();
        0.5 * tension * tension / self.stiffness
    }

    /// Multiplies `d` with a factor, but only as far as this takes tension or pressure from the bond: one that is drawn out
    /// keeps its length until it slackens, so that no decay adds energy. The first half of the work (J), at most 0.
    pub(crate) fn decay(&mut self, factor: f64) -> f64 {
        let stretch = self.length - self.natural;
        if self.offset == 0.0 || stretch / self.offset >= 1.0 {
            self.decayed = 0.0;
            return 0.0;
        }
        let mut next = self.offset * factor.max(stretch / self.offset);
        if next.abs() < SMALLEST_OFFSET * self.natural {
            next = 0.0;
        }
        self.decayed = next - self.offset;
        let work = -(0.5 * self.tension() * self.decayed);
        self.offset = next;
        work
    }

    /// The second half of the work (J) of the last decay.
    pub(crate) fn decay_work(&self) -> f64 {
        -0.5 * self.tension() * self.decayed
    }

    /// Stiffness between its ends (N/m).
    fn tangent(&self) -> DMat3 {
        let (length, tension) = (self.length, self.tension());
        let unit = self.x / length;
        outer(unit, unit) * (self.stiffness - tension / length)
            + DMat3::from_diagonal(DVec3::splat(tension / length))
    }
}

/// `|x|_e` (m) from `x·x` and `X·X` (m²).
pub(crate) fn softened(squared: f64, rest_squared: f64) -> f64 {
    (squared + SOFTENING * SOFTENING * rest_squared).sqrt()
}

/// Deficient nodes and their bonds; empty before the first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bonds {
    /// By node, then by other.
    pub(crate) list: Vec<Bond>,
    /// Deficient nodes, ascending.
    pub(crate) nodes: Vec<u32>,
    /// Deficient nodes with those, weak or not, from which their deformation is taken, nearest to sound
    /// ones first; those that hang on nothing valid have none.
    pub(crate) hosts: Vec<(u32, Vec<u32>)>,
}

/// A bond of a part: its position in the list and its ends' positions in the part.
pub(crate) type PartBond = (u32, Option<u32>, Option<u32>);

impl Bonds {
    /// Evaluates all bonds at positions (m); their energy (J).
    pub(crate) fn evaluate(&mut self, positions: &[DVec3]) -> f64 {
        let mut energy = 0.0;
        for bond in &mut self.list {
            bond.set_x(positions[bond.other as usize] - positions[bond.node as usize]);
            bond.pull = bond.x * (bond.tension() / bond.length);
            energy += bond.energy();
        }
        energy
    }

    /// Adds the forces (N) last evaluated.
    pub(crate) fn add_forces(&self, forces: &mut [DVec3]) {
        for bond in &self.list {
            forces[bond.node as usize] += bond.pull;
            forces[bond.other as usize] -= bond.pull;
        }
    }

    /// Gives deficient nodes the mean deformation of their hosts.
    pub(crate) fn set_gradients(&self, deformation: &mut [Planes]) {
        for (node, hosts) in &self.hosts {
            #[allow(clippy::cast_precision_loss, reason = "a node has few neighbours")]
            let share = (hosts.len() as f64).recip();
            let mut mean = DMat3::ZERO;
            for &host in hosts {
                mean += gradient(deformation, host as usize) * share;
            }
            if hosts.is_empty() {
                mean = DMat3::IDENTITY;
            }
            set_gradient(deformation, *node as usize, mean);
        }
    }

    /// Nodes at the ends of bonds, and those that take their deformation from others.
    pub(crate) fn ends(&self) -> impl Iterator<Item = u32> + '_ {
        let ends = self.list.iter().flat_map(|bond| [bond.node, bond.other]);
        ends.chain(self.nodes.iter().copied())
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    pub(crate) fn add_product(&self, vector: &[DVec3], product: &mut [DVec3]) {
        for bond in &self.list {
            let (i, j) = (bond.node as usize, bond.other as usize);
            let change = bond.tangent() * (vector[i] - vector[j]);
            product[i] += change;
            product[j] -= change;
        }
    }

    /// The bonds that a part's nodes are in.
    pub(crate) fn of_part(&self, nodes: &[u32]) -> Vec<PartBond> {
        let place = |node: u32| place_among(nodes, node);
        let bonds = (0_u32..).zip(&self.list);
        bonds
            .map(|(at, bond)| (at, place(bond.node), place(bond.other)))
            .filter(|(_, node, other)| node.is_some() || other.is_some())
            .collect()
    }

    pub(crate) fn add_product_within(
        &self,
        part: &[PartBond],
        vector: &[DVec3],
        product: &mut [DVec3],
    ) {
        let at = |place: Option<u32>| place.map_or(DVec3::ZERO, |at| vector[at as usize]);
        for &(bond, node, other) in part {
            let change = self.list[bond as usize].tangent() * (at(node) - at(other));
            if let Some(node) = node {
                product[node as usize] += change;
            }
            if let Some(other) = other {
                product[other as usize] -= change;
            }
        }
    }

    /// Nodes at the ends of a part's bonds.
    pub(crate) fn ends_of(&self, part: &[PartBond]) -> Vec<u32> {
        let bonds = part.iter().map(|(bond, ..)| &self.list[*bond as usize]);
        bonds.flat_map(|bond| [bond.node, bond.other]).collect()
    }

    /// Adopts the positions (m) of the ends of a part's bonds.
    pub(crate) fn set_part(&mut self, part: &[PartBond], place: impl Fn(u32) -> DVec3) {
        for (bond, ..) in part {
            let bond = &mut self.list[*bond as usize];
            bond.set_x(place(bond.other) - place(bond.node));
        }
    }

    /// Orders deficient nodes by their distance in bonds from valid ones.
    pub(crate) fn find_hosts(&mut self) {
        let mut open = self.nodes.clone();
        self.hosts.clear();
        let weak = |node: &u32, open: &[u32]| open.binary_search(node).is_ok();
        while !open.is_empty() {
            let mut layer = Vec::new();
            for &node in &open {
                let from = self.list.partition_point(|bond| bond.node < node);
                let row = self.list[from..].iter();
                let row = row.take_while(|bond| bond.node == node);
                let others = row.map(|bond| bond.other);
                let hosts: Vec<u32> = others.filter(|other| !weak(other, &open)).collect();
                if !hosts.is_empty() {
                    layer.push((node, hosts));
                }
            }
            if layer.is_empty() {
                self.hosts.extend(open.iter().map(|&node| (node, vec![])));
                return;
            }
            open.retain(|node| layer.binary_search_by(|(at, _)| at.cmp(node)).is_err());
            self.hosts.append(&mut layer);
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        let hosts = self.hosts.iter().map(|(_, hosts)| size_of_val(&**hosts));
        let lists = bytes_of(&self.list) + bytes_of(&self.nodes) + bytes_of(&self.hosts);
        lists + hosts.sum::<usize>()
    }
}

/// New bonds at the positions of old ones: what is left of one continues, and one that is stiffer retains the energy that it had.
pub(crate) fn kept(mut row: Vec<Bond>, old: &[Bond]) -> Vec<Bond> {
    for bond in &mut row {
        if let Some(before) = old.iter().find(|before| before.other == bond.other) {
            bond.offset = before.offset;
            if bond.stiffness > before.stiffness {
                let left = (before.stiffness / bond.stiffness).sqrt();
                let stretch = bond.length - bond.natural;
                bond.offset = stretch - (stretch - before.offset) * left;
            }
        }
    }
    row
}

/// The first bonds of a node, which hold at most `energy` (J).
pub(crate) fn begun(mut row: Vec<Bond>, energy: f64) -> Vec<Bond> {
    let whole: f64 = row.iter().map(Bond::energy).sum();
    if whole > energy {
        let left = 1.0 - (energy / whole).sqrt();
        for bond in &mut row {
            bond.offset = left * (bond.length - bond.natural);
        }
    }
    row
}
