//! What a cut changes in what a rank was given.

use glam::{DMat3, DVec3};
use phyxel::{Body, BodyProblem, elastic_stencils};
use phyxel_elastic::{Elastic, Rows};
use serde::{Deserialize, Serialize};

use super::Package;
use super::locals::{Locals, of_rank, row};
use super::weak::{Weak, weak_nodes, weaken};

/// What a cut changes in a rank's model.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Change {
    /// Local nodes whose rows it has rebuilt, ascending.
    nodes: Vec<u32>,
    /// Weights of those rows, which have no more digits.
    weights: Vec<f32>,
    /// Matrices and scales, zero for rows that are not whole here.
    matrices: Vec<DMat3>,
    scales: Vec<f64>,
    /// Multipliers of nodes in those rows.
    multipliers: Vec<(u32, DVec3)>,
    /// What those nodes have, if anything; others of the rank stay as they are.
    control_scales: Vec<(u32, f64)>,
    fronts: Vec<(u32, DMat3)>,
    weak: Vec<Weak>,
    offsets_of_gradients: Vec<(u32, ([f64; 9], f64))>,
    carries: bool,
    /// Who is monitored from now on, as in a package; `None` for those of before.
    watched: Option<(Vec<(u32, u32)>, usize)>,
}

impl Change {
    /// The rank's part of a change of the rows of `nodes`, ascending; `watched` if others are than before.
    pub(crate) fn new(
        locals: &Locals,
        body: &Body,
        nodes: &[u32],
        watched: Option<&[u32]>,
    ) -> Self {
        let view = elastic_stencils(&body.stencils, &body.neighborhoods);
        let corrected = !view.multipliers.is_empty();
        let is_changed = |node: u32| nodes.binary_search(&node).is_ok();
        let state = body.of_model(Elastic::state);
        let mut change = Self {
            nodes: Vec::new(),
            weights: Vec::new(),
            matrices: Vec::new(),
            scales: Vec::new(),
            multipliers: Vec::new(),
            control_scales: of_rank(state.control, locals, is_changed),
            fronts: of_rank(state.fronts, locals, is_changed),
            weak: weak_nodes(body, locals, is_changed),
            offsets_of_gradients: of_rank(state.offsets, locals, is_changed),
            carries: body.of_model(Elastic::decays),
            watched: watched.map(|watched| (locals.watched(watched), watched.len())),
        };
        // Nodes in the rows, by their numbers in the body.
        let mut seen = Vec::new();
        for &node in nodes {
            let Some(local) = locals.local_of(node) else {
                continue;
            };
            let (at, whole) = (node as usize, !locals.is_cut_off(node));
            change.nodes.push(local);
            let weights = row(body, locals, node).map(|(_, pair)| view.weights[pair] as f32);
            change.weights.extend(weights);
            seen.push(node);
            if whole {
                seen.extend_from_slice(body.neighborhoods.row(at));
            }
            let matrix = if whole {
                view.matrices[at]
            } else {
                DMat3::ZERO
            };
            change.matrices.push(matrix);
            if corrected {
                change
                    .scales
                    .push(if whole { view.scales[at] } else { 0.0 });
            }
        }
        if corrected {
            seen.sort_unstable();
            seen.dedup();
            let known = seen.into_iter().filter_map(|node| {
                let local = locals.local_of(node)?;
                Some((local, view.multipliers[node as usize]))
            });
            change.multipliers = known.collect();
        }
        change
    }

    /// Takes it into the model.
    pub(crate) fn apply(
        self,
        elastic: &mut Elastic,
        package: &mut Package,
    ) -> Result<(), BodyProblem> {
        if let Some((watched, count)) = self.watched {
            package.watched = watched;
            package.watched_count = count;
        }
        package.carries = self.carries;
        if self.nodes.is_empty() {
            return Ok(());
        }
        let weights: Vec<f64> = self.weights.into_iter().map(f64::from).collect();
        elastic.take_rows(&Rows {
            nodes: &self.nodes,
            weights: &weights,
            matrices: &self.matrices,
            scales: &self.scales,
            multipliers: &self.multipliers,
        })?;
        weaken(elastic, &package.rest, &self.weak);
        let mut state = elastic.state();
        state.offsets = replaced(state.offsets, &self.nodes, self.offsets_of_gradients);
        state.control = replaced(state.control, &self.nodes, self.control_scales);
        state.fronts = replaced(state.fronts, &self.nodes, self.fronts);
        elastic.set_state(&state);
        Ok(())
    }
}

/// A list by nodes, ascending, with what `new` says of `nodes`.
fn replaced<T>(mut list: Vec<(u32, T)>, nodes: &[u32], new: Vec<(u32, T)>) -> Vec<(u32, T)> {
    list.retain(|(node, _)| nodes.binary_search(node).is_err());
    list.extend(new);
    list.sort_by_key(|(node, _)| *node);
    list
}
