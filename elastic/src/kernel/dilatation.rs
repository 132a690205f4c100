//! Near-incompressibility: volume ratios averaged over neighbourhoods.
//!
//! `J̄_i = sum_j S_ij J_j`, `E = sum_i V_i [W_dev(F_i) + U(J̄_i)]`, with `S` symmetric in the inner
//! product of the volumes (`V_i S_ij = V_j S_ji = s_ij`, rows sum to 1), so that a constant pressure
//! stays constant and the patch test survives. The averaging takes volume constraints away that a
//! node-by-node law would stack up beyond the number of unknowns (volumetric locking).
//!
//! `s_ij = f_ij min(V_i / n_i, V_j / n_j)` over the pairs of the graph with `n_i` the neighbours of i
//! and `f_ij` the factor that cuts left of a pair's weight, the remainder of `V_i` on the diagonal. It
//! needs no tetrahedra, and on the edges of tetrahedra it does as well as a mean over them (clamped cube at nu 0.49 and 0.499:
//! 2.2 and 5.3 % too stiff, against 7.4 and 9.5 % without; three quarters of it leaves 3.6 %).

use crate::kernel::pairs::Pairs;
use crate::kernel::storage::bytes_of;
use crate::law::coefficients::Volumetric;

/// What is constant between cuts.
#[derive(Debug, Clone)]
pub(crate) struct Means {
    /// `U` per material.
    laws: Vec<Volumetric>,
    /// `V_i / n_i`.
    shares: Vec<f64>,
    /// Weights of the uncut pairs; empty where they differ by direction, and cuts then count only when
    /// they sever.
    uncut: Vec<f32>,
}

/// What an evaluation leaves.
#[derive(Debug, Clone)]
pub(crate) struct Pressures {
    /// `J_i`.
    pub(crate) ratios: Vec<f64>,
    /// `J̄_i`.
    pub(crate) means: Vec<f64>,
    /// `V_i_el / V_i U'(J̄_i)`.
    pub(crate) pressures: Vec<f64>,
}

impl Pressures {
    pub(crate) fn new(node_count: usize) -> Self {
        Self {
            ratios: vec![1.0; node_count],
            means: vec![1.0; node_count],
            pressures: vec![0.0; node_count],
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        bytes_of(&self.ratios) + bytes_of(&self.means) + bytes_of(&self.pressures)
    }
}

impl Means {
    pub(crate) fn new(laws: Vec<Volumetric>, volumes: &[f64], pairs: &Pairs) -> Self {
        let share = |(node, volume): (usize, &f64)| {
            let count = pairs.row(node).len().max(1);
            #[allow(clippy::cast_precision_loss, reason = "a node has few neighbours")]
            let count = count as f64;
            volume / count
        };
        let uncut = match pairs.is_symmetric() {
            true => pairs.weights().collect(),
            false => Vec::new(),
        };
        Self {
            laws,
            uncut,
            shares: volumes.iter().enumerate().map(share).collect(),
        }
    }

    /// `U` of a material.
    #[inline]
    pub(crate) fn law(&self, material: usize) -> &Volumetric {
        &self.laws[material]
    }

    /// `V_j p_j = sum_i s_ij V_i_el / V_i U'(J̄_i)`, or the same of their changes.
    pub(crate) fn pressure(
        &self,
        pairs: &Pairs,
        (node, volume): (usize, f64),
        pressures: &[f64],
    ) -> f64 {
        volume * pressures[node] + self.spread(pairs, node, pressures)
    }

    /// `sum_j s_ij (values_j - values_i)`.
    pub(crate) fn spread(&self, pairs: &Pairs, node: usize, values: &[f64]) -> f64 {
        let (own, share) = (values[node], self.shares[node]);
        let mut sum = 0.0;
        // The graph is symmetric here: both rows list the same nodes.
        let both = pairs.incoming(node).iter().zip(pairs.row(node));
        for (at, (back, pair)) in pairs.range(node).zip(both) {
            let j = pair.to as usize;
            if pair.weight > 0.0 || back.weight > 0.0 {
                let factor = match self.uncut.get(at) {
                    Some(&uncut) if uncut > 0.0 => f64::from(pair.weight) / f64::from(uncut),
                    _ => 1.0,
                };
                sum += factor * (share.min(self.shares[j]) * (values[j] - own));
            }
        }
        sum
    }

    pub(crate) fn bytes(&self) -> usize {
        bytes_of(&self.shares) + bytes_of(&self.uncut) + bytes_of(&self.laws)
    }
}
