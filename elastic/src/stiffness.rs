//! The stiffest nodes of a body, as they were in the last evaluation.

use glam::{DMat3, DVec3};

use crate::kernel::stale::Stale;
use crate::kernel::storage::{CHUNK, parallel, share_out};
use crate::kernel::watch::gradient_square;
use crate::kernel::worst::Watch;
use crate::law::tensor::cofactor;
use crate::model::Elastic;

/// Nodes of a run of which the largest indicator is reported.
pub const WATCHED_NODES: usize = CHUNK;

/// By what fraction of it `r_i` may differ as seen in an evaluation and as computed from a stored `F_i`: single precision
/// rounds that to 6e-8, and `c(F_i)` multiplies it by some `1/J` where tissue is pressed to `J`.
const INDICATOR_ROUND_OFF: f64 = 0.01;

/// A node that makes a body stiff, and the way in which it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StiffNode {
    /// The node.
    pub node: u32,
    /// `r_i` (1/s²), see [`Elastic::stiffness_indicators`].
    pub indicator: f64,
    /// Unit vector along which it resists most: the longest column of `cof F`.
    pub direction: DVec3,
}

impl Elastic {
    /// Begins to monitor the stiffness of nodes with these masses (kg); an empty slice ends it.
    ///
    /// # Panics
    /// If `masses` is neither empty nor one per node.
    pub fn watch_stiffness(&mut self, masses: &[f64]) {
        let n = self.node_count();
        let fit = masses.is_empty() || masses.len() == n;
        assert!(fit, "one mass per node, or none");
        self.scratch.stale = Stale::everything();
        self.model.inverse_masses = masses.iter().map(|m| m.recip()).collect();
        self.model.gradient_squares = vec![0.0; masses.len()];
        self.refresh_squares(0..masses.len());
    }

    pub(crate) fn refresh_squares(&mut self, nodes: impl Iterator<Item = usize>) {
        let model = &mut self.model;
        if model.inverse_masses.is_empty() {
            return;
        }
        for node in nodes {
            model.gradient_squares[node] = gradient_square(model, &self.tables, node);
        }
    }

    /// The largest of all nodes.
    #[cfg(test)]
    pub(crate) fn stiffness_indicator(&self) -> f64 {
        self.watched().stiffness
    }

    /// Largest `r_i = V_i c(F_i) sum_j |g_ij|²/m_j` (1/s²) of each run of [`WATCHED_NODES`] nodes at the state last
    /// evaluated, `c` a bound on the tangent modulus: it rises with the largest eigenvalue of `M⁻¹ K` and is at least of
    /// its size, without fibers, viscosity, control and bonds. 0 unless [`Elastic::watch_stiffness`] was called.
    /// One maximum over a body hides that its second stiffest part has become the stiffest: `r_i` bounds
    /// the eigenvalues of different positions by different factors.
    pub fn stiffness_indicators(&self) -> impl ExactSizeIterator<Item = f64> {
        self.state.watches.iter().map(|watch| watch.stiffness)
    }

    /// Smallest `det F` of the state last evaluated, over nodes that carry strain energy, infinite
    /// without any.
    #[must_use]
    pub fn smallest_volume_ratio(&self) -> f64 {
        self.watched().ratio
    }

    fn watched(&self) -> Watch {
        let chunks = self.state.watches.iter();
        chunks.fold(Watch::NOTHING, |worst, chunk| worst.and(*chunk))
    }

    /// The `count` nodes of largest `r_i` at the state last evaluated, of all or of some runs of [`WATCHED_NODES`] nodes,
    /// the stiffest first; of equal ones the first. Empty unless [`Elastic::watch_stiffness`] was called.
    #[must_use]
    pub fn stiffest_nodes(&self, count: usize, runs: Option<&[usize]>) -> Vec<StiffNode> {
        if let Some(runs) = runs {
            return self.stiffest_of(count, runs.iter().copied());
        }
        // `count` runs have nodes at least as stiff as the worst of theirs: a run with none of that has none of them.
        let mut falling: Vec<f64> = self.stiffness_indicators().collect();
        falling.sort_unstable_by(|a, b| b.total_cmp(a));
        let least = falling.get(count.saturating_sub(1)).copied();
        let least = least.map_or(0.0, |least| least * (1.0 - INDICATOR_ROUND_OFF));
        let runs = self.stiffness_indicators().enumerate();
        let runs = runs.filter(|(_, stiffness)| *stiffness >= least);
        let found = self.stiffest_of(count, runs.map(|(run, _)| run));
        // Rows that changed since may have taken from what was seen.
        if found.last().is_some_and(|last| last.indicator >= least) {
            return found;
        }
        self.stiffest_of(count, 0..self.state.watches.len())
    }

    fn stiffest_of(&self, count: usize, runs: impl Iterator<Item = usize>) -> Vec<StiffNode> {
        let model = &self.model;
        if model.gradient_squares.is_empty() {
            return Vec::new();
        }
        let indicator = |node: usize| {
            let square = model.gradient_squares[node];
            let f = self.deformation_gradient(node);
            let bound = model.law(node).tangent_bound(f);
            let gain = self.state.prestrain.gain(node);
            model.elastic_volumes[node] * bound * square * gain
        };
        let n = self.node_count();
        let nodes = runs.flat_map(|run| run * WATCHED_NODES..n.min((run + 1) * WATCHED_NODES));
        let mut nodes: Vec<(f64, usize)> = nodes.map(|node| (0.0, node)).collect();
        let set = |_, nodes: &mut [(f64, usize)]| {
            for (value, node) in nodes {
                *value = indicator(*node);
            }
        };
        share_out(parallel(nodes.len()), nodes.chunks_mut(CHUNK), set);
        let order = |a: &(f64, usize), b: &(f64, usize)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        let count = count.min(nodes.len());
        if count < nodes.len() && count > 0 {
            nodes.select_nth_unstable_by(count - 1, order);
        }
        nodes.truncate(count);
        nodes.sort_unstable_by(order);
        let stiff = nodes.into_iter().map(|(indicator, node)| StiffNode {
            node: u32::try_from(node).unwrap_or(u32::MAX),
            indicator,
            direction: stiffest_direction(self.deformation_gradient(node)),
        });
        stiff.collect()
    }
}

fn stiffest_direction(f: DMat3) -> DVec3 {
    let cof = cofactor(f);
    let mut longest = cof.x_axis;
    for column in [cof.y_axis, cof.z_axis] {
        if column.length_squared() > longest.length_squared() {
            longest = column;
        }
    }
    longest.normalize_or(DVec3::X)
}
