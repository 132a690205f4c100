//! How much two nodes still know of each other: one factor per pair, updated as a cut grows.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use crate::index::Bounds;
use crate::node_grid::NodeGrid;
use crate::obstacle::{Obstacle, index32};
use crate::rule::{Rule, Scratch};

/// How far nodes are coupled, and by what rule a cut weakens a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorSettings {
    /// Coupling distance of a node as a multiple of the mean length of its pairs; that of a pair is
    /// the mean of its two nodes'. 2.0 was found best for edges of tetrahedra and of triangles
    /// (1.8 and 2.2 move the opening of an edge crack by about 1 %).
    pub reach_scale: f64,
    /// The rule.
    pub rule: Rule,
}

impl Default for FactorSettings {
    fn default() -> Self {
        Self {
            reach_scale: 2.0,
            rule: Rule::Detour,
        }
    }
}

/// What an update changed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Touched {
    /// Pairs whose factor fell, sorted; with `(i, j)` always also `(j, i)`.
    pub pairs: Vec<u32>,
    /// Nodes of these pairs, sorted.
    pub nodes: Vec<u32>,
}

/// One factor in `0..=1` for each directed pair of a symmetric graph, equal in both directions.
///
/// A pair that no cut crosses keeps exactly 1, a severed pair has exactly 0, and no factor ever
/// rises. See the crate's page for the rule.
///
/// # Examples
/// ```
/// use glam::DVec3;
/// use phyxel_enrich::{CutSettings, Cuts, FactorSettings, PairFactors};
///
/// // Two nodes and a through cut between them.
/// let x = [DVec3::ZERO, DVec3::X];
/// let mut factors = PairFactors::new(&x, &[0, 1, 2], &[1, 0], &FactorSettings::default());
/// let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
/// let stroke = cuts.start(&[DVec3::new(0.5, -9.0, -9.0), DVec3::new(0.5, -9.0, 9.0)])?;
/// let new = cuts.append(stroke, &[DVec3::new(0.5, 9.0, -9.0), DVec3::new(0.5, 9.0, 9.0)])?;
/// let touched = factors.update(&cuts, new, &|_| true);
/// assert_eq!(factors.factors(), [0.0, 0.0]);
/// assert_eq!(touched.nodes, [0, 1]);
/// # Ok::<(), phyxel_enrich::CutError>(())
/// ```
#[derive(Debug, Clone)]
pub struct PairFactors {
    rule: Rule,
    positions: Vec<DVec3>,
    offsets: Vec<u32>,
    indices: Vec<u32>,
    factors: Vec<f64>,
    /// Coupling distance of each node (m).
    reach: Vec<f64>,
    /// Distance from each node beyond which a piece can change none of its pairs (m).
    span: Vec<f64>,
    largest_span: f64,
    grid: NodeGrid,
    crossed: usize,
}

/// Candidates from which an update is spread over threads.
const PARALLEL: usize = 256;

impl PairFactors {
    /// All factors 1, with the coupling distance `reach_scale` times the mean length of a node's
    /// pairs, frozen from here on.
    ///
    /// # Arguments
    /// * `positions` -- rest positions (m), shape `(n)`, finite.
    /// * `offsets`, `indices` -- the graph's rows, shape `(n + 1)` and `(pairs)`; rows sorted,
    ///   symmetric, without self.
    ///
    /// # Panics
    /// If the graph is not as stated or the scale is not positive.
    #[must_use]
    pub fn new(
        positions: &[DVec3],
        offsets: &[u32],
        indices: &[u32],
        settings: &FactorSettings,
    ) -> Self {
        assert!(
            settings.reach_scale > 0.0 && settings.reach_scale.is_finite(),
            "reach scale of {} is not positive",
            settings.reach_scale
        );
        assert_graph(positions.len(), offsets, indices);
        let reach = positions
            .iter()
            .enumerate()
            .map(|(i, x)| {
                let row = &indices[offsets[i] as usize..offsets[i + 1] as usize];
                let total: f64 = row.iter().map(|&j| x.distance(positions[j as usize])).sum();
                #[allow(clippy::cast_precision_loss, reason = "a row is short")]
                let count = row.len().max(1) as f64;
                settings.reach_scale * total / count
            })
            .collect();
        Self::with_reach(positions, offsets, indices, reach, settings.rule)
    }

    /// All factors 1, with a given coupling distance per node (m), shape `(n)`.
    ///
    /// # Panics
    /// If the graph is not as [`PairFactors::new`] states, or `reach` is not one finite length per
    /// node.
    #[must_use]
    pub fn with_reach(
        positions: &[DVec3],
        offsets: &[u32],
        indices: &[u32],
        reach: Vec<f64>,
        rule: Rule,
    ) -> Self {
        assert_graph(positions.len(), offsets, indices);
        assert_eq!(reach.len(), positions.len(), "one reach per node");
        assert!(
            reach.iter().all(|r| r.is_finite() && *r >= 0.0),
            "reach is a length"
        );
        let mut span = vec![0.0_f64; positions.len()];
        let mut lengths = 0.0;
        for i in 0..positions.len() {
            for &j in &indices[offsets[i] as usize..offsets[i + 1] as usize] {
                let j = j as usize;
                let length = positions[i].distance(positions[j]);
                lengths += length;
                let around = 0.5 * length + Rule::MARGIN * 0.5 * (reach[i] + reach[j]);
                span[i] = span[i].max(around).max(length);
            }
        }
        #[allow(clippy::cast_precision_loss, reason = "only a cell size")]
        let cell = 1.5 * lengths / indices.len().max(1) as f64;
        let cell = if cell > 0.0 { cell } else { 1.0 };
        Self {
            rule,
            grid: NodeGrid::new(positions, cell),
            positions: positions.to_vec(),
            offsets: offsets.to_vec(),
            factors: vec![1.0; indices.len()],
            indices: indices.to_vec(),
            reach,
            largest_span: span.iter().fold(0.0, |a: f64, &b| a.max(b)),
            span,
            crossed: 0,
        }
    }

    /// Brings the factors up to date with new pieces of a cut.
    ///
    /// Only pairs near the new pieces are looked at: those that a new piece crosses, and those
    /// already crossed whose detour may pass there. The work does not depend on the length of the
    /// cut so far.
    ///
    /// # Arguments
    /// * `cut` -- all pieces, the new ones among them.
    /// * `new` -- numbers of the pieces that came since the last update.
    /// * `inside` -- whether a point of material coordinates lies in the uncut body: a detour must.
    ///
    /// # Panics
    /// If `new` names pieces that are not there.
    pub fn update<C: Obstacle>(
        &mut self,
        cut: &C,
        new: Range<usize>,
        inside: &(dyn Fn(DVec3) -> bool + Sync),
    ) -> Touched {
        assert!(
            new.end <= cut.piece_count(),
            "piece {} of {}",
            new.end,
            cut.piece_count()
        );
        let candidates = self.candidates(cut, new);
        let evaluate = |scratch: &mut Scratch, &(i, pair): &(u32, u32)| {
            let (a, b, reach) = self.pair_geometry(i as usize, pair as usize);
            self.rule.factor(cut, a, b, reach, inside, scratch)
        };
        let values: Vec<f64> = if candidates.len() < PARALLEL {
            let mut scratch = Scratch::default();
            candidates
                .iter()
                .map(|candidate| evaluate(&mut scratch, candidate))
                .collect()
        } else {
            candidates
                .par_iter()
                .with_min_len(64)
                .map_init(Scratch::default, evaluate)
                .collect()
        };
        let mut touched = Touched::default();
        for (&(i, pair), value) in candidates.iter().zip(values) {
            let old = self.factors[pair as usize];
            if value >= old {
                continue;
            }
            let back = self.pair_of(self.indices[pair as usize], i);
            self.crossed += usize::from(old >= 1.0);
            self.factors[pair as usize] = value;
            self.factors[back] = value;
            touched.pairs.extend([pair, index32(back)]);
            touched.nodes.extend([i, self.indices[pair as usize]]);
        }
        touched.pairs.sort_unstable();
        touched.nodes.sort_unstable();
        touched.nodes.dedup();
        touched
    }

    /// The factors, one per directed pair, in the graph's order.
    #[must_use]
    pub fn factors(&self) -> &[f64] {
        &self.factors
    }

    /// Coupling distance of each node (m); that of a pair is the mean of its two nodes'.
    #[must_use]
    pub fn reach(&self) -> &[f64] {
        &self.reach
    }

    /// Number of undirected pairs that a cut crosses.
    #[must_use]
    pub fn crossed_count(&self) -> usize {
        self.crossed
    }

    /// Puts back factors that were read before, for a run that goes on from a file.
    ///
    /// # Errors
    /// The first pair whose value is not in `0..=1` or differs from that of the opposite direction.
    ///
    /// # Panics
    /// If there is not one factor per pair.
    pub fn restore(&mut self, factors: &[f64]) -> Result<(), FactorError> {
        assert_eq!(factors.len(), self.factors.len(), "one factor per pair");
        let mut crossed = 0;
        for i in 0..self.positions.len() {
            for pair in self.offsets[i] as usize..self.offsets[i + 1] as usize {
                let value = factors[pair];
                let back = factors[self.pair_of(self.indices[pair], index32(i))];
                if !(0.0..=1.0).contains(&value) || value.to_bits() != back.to_bits() {
                    return Err(FactorError { pair, value });
                }
                crossed += usize::from(value < 1.0);
            }
        }
        self.factors.copy_from_slice(factors);
        self.crossed = crossed / 2;
        Ok(())
    }

    /// Unit normals of the cut near some nodes, as rows: those of the triangles that cross a pair of
    /// the node, or of one of its neighbours, without repetition of a triangle.
    ///
    /// What the restoration of the integration constraint on cut faces needs.
    ///
    /// # Panics
    /// If a node is out of range.
    #[must_use]
    pub fn normals_near(&self, cut: &crate::Cuts, nodes: &[u32]) -> (Vec<u32>, Vec<DVec3>) {
        let (mut offsets, mut normals) = (vec![0], Vec::new());
        let (mut found, mut all) = (Vec::new(), Vec::new());
        for &node in nodes {
            all.clear();
            for near in std::iter::once(node).chain(self.row(node as usize).iter().copied()) {
                let i = near as usize;
                for pair in self.offsets[i] as usize..self.offsets[i + 1] as usize {
                    if self.factors[pair] < 1.0 {
                        let other = self.positions[self.indices[pair] as usize];
                        cut.crossed_into(self.positions[i], other, &mut found);
                        all.extend_from_slice(&found);
                    }
                }
            }
            all.sort_unstable();
            all.dedup();
            normals.extend(all.iter().map(|&t| cut.normal(t as usize)));
            offsets.push(index32(normals.len()));
        }
        (offsets, normals)
    }

    /// Bytes held on the heap, about.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.positions.len() * (24 + 4 + 8 + 8 + 4 + 8) + self.indices.len() * (4 + 8)
    }

    fn row(&self, node: usize) -> &[u32] {
        &self.indices[self.offsets[node] as usize..self.offsets[node + 1] as usize]
    }

    fn pair_of(&self, node: u32, neighbor: u32) -> usize {
        let place = self.row(node as usize).binary_search(&neighbor);
        self.offsets[node as usize] as usize + place.expect("checked to be symmetric when built")
    }

    /// End points and coupling distance of a pair, the node of lower number first.
    fn pair_geometry(&self, i: usize, pair: usize) -> (DVec3, DVec3, f64) {
        let j = self.indices[pair] as usize;
        let reach = 0.5 * (self.reach[i] + self.reach[j]);
        (self.positions[i], self.positions[j], reach)
    }

    /// Undirected pairs `(i, pair)`, with `i` the lower number, that the new pieces may change.
    fn candidates<C: Obstacle>(&self, cut: &C, new: Range<usize>) -> Vec<(u32, u32)> {
        let mut candidates = Vec::new();
        for piece in new {
            let bounds = cut.piece_bounds(piece);
            self.grid
                .for_nodes(&bounds.grown(self.largest_span), |node| {
                    let i = node as usize;
                    if bounds.distance(self.positions[i]) > self.span[i] {
                        return;
                    }
                    for pair in self.offsets[i] as usize..self.offsets[i + 1] as usize {
                        if self.indices[pair] < node {
                            continue;
                        }
                        let factor = self.factors[pair];
                        let (a, b, reach) = self.pair_geometry(i, pair);
                        let look = if factor >= 1.0 {
                            Bounds::of(&[a, b]).meets(&bounds) && cut.piece_crosses(piece, a, b)
                        } else {
                            factor > 0.0 && bounds.distance(a.midpoint(b)) <= Rule::MARGIN * reach
                        };
                        if look {
                            candidates.push((node, index32(pair)));
                        }
                    }
                });
        }
        candidates.sort_unstable_by_key(|&(_, pair)| pair);
        candidates.dedup();
        candidates
    }
}

/// A factor that cannot be one, see [`PairFactors::restore`].
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("factor {value} of pair {pair} is outside 0..=1 or differs from the opposite direction's")]
pub struct FactorError {
    /// Place of the pair in the graph's indices.
    pub pair: usize,
    /// Its factor.
    pub value: f64,
}

fn assert_graph(nodes: usize, offsets: &[u32], indices: &[u32]) {
    assert_eq!(offsets.len(), nodes + 1, "one row per node, and the end");
    assert_eq!(
        offsets[nodes] as usize,
        indices.len(),
        "rows fill the indices"
    );
    for i in 0..nodes {
        assert!(
            offsets[i] <= offsets[i + 1],
            "row {i} ends before it starts"
        );
        let row = &indices[offsets[i] as usize..offsets[i + 1] as usize];
        assert!(
            row.windows(2).all(|w| w[0] < w[1]),
            "row {i} is not sorted or has a neighbour twice"
        );
        for &j in row {
            assert!(
                (j as usize) < nodes && j as usize != i,
                "row {i} names node {j}"
            );
            let (from, to) = (offsets[j as usize], offsets[j as usize + 1]);
            assert!(
                indices[from as usize..to as usize]
                    .binary_search(&index32(i))
                    .is_ok(),
                "pair ({i}, {j}) has no opposite"
            );
        }
    }
}
