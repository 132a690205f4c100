//! How much two nodes still know of each other: one factor per pair, updated as a cut grows.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::bounds::Bounds;
use crate::cut_rule::CutRule;
use crate::cuts::Cuts;
use crate::graph::{Graph, InfluenceRadius};
use crate::index32;
use crate::path::PathScratch;
use crate::rule::Rule;

/// How far nodes are coupled, and by what rule a cut weakens a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorSettings {
    /// How far a node is coupled.
    pub influence_radius: InfluenceRadius,
    /// The rule.
    pub rule: Rule,
}

impl Default for FactorSettings {
    /// Influence radius of twice the mean length of a node's pairs, diffraction.
    fn default() -> Self {
        Self {
            influence_radius: InfluenceRadius::Neighbors(CutRule::INFLUENCE_RADIUS),
            rule: Rule::Diffraction,
        }
    }
}

/// One factor in `0..=1` for each directed pair of a symmetric graph, equal in both directions.
///
/// A pair that no cut crosses keeps exactly 1. One that a cut crosses has `f = W(L/h) / W(r/h)`, `W(q) = (1 − q²)³`
/// (Aras 2014, eq. (15) and fig. 18), with the length L of the shortest path around the cut's edges, the direct
/// distance r and the influence radius h; exactly 0 where L ≥ h. That is the diffraction criterion (Organ, Fleming,
/// Terry, Belytschko 1996) with exponent 1. No factor ever rises, and a cut leaves the same factors grown piece by
/// piece or made at once.
///
/// A path bends at free edges, kinks, folds and joints of the triangles, any number of times: at edges whose unit
/// directions into the triangles add up to 0.05 or more. It counts if it crosses no triangle with its bends moved
/// outward by 0.05 h, and these lie in the body: that severs pairs at T joints and along a cut that overshoots the
/// body by a little. Its length is over the edges themselves, or farther outside where another part of the cut is in
/// between.
///
/// Only pairs that a cut crosses are held: at most [`PairFactors::BYTES_PER_PAIR`] for each, and
/// [`PairFactors::BYTES_PER_CONORMAL`] besides for those that are bent around its front.
///
/// # Examples
/// ```
/// use phyxel_enrich::glam::{DMat3, DVec3};
/// use phyxel_enrich::{CutSettings, Cuts, FactorSettings, Graph, PairFactors};
///
/// // Two nodes and a through cut between them.
/// let graph = Graph::new(&[DVec3::ZERO, DVec3::X], &[0, 1, 2], &[1, 0])?;
/// let mut factors = PairFactors::new(&graph, &FactorSettings::default());
/// let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
/// let stroke = cuts.start(&[DVec3::new(0.5, -9.0, -9.0), DVec3::new(0.5, -9.0, 9.0)])?;
/// let new = cuts.append(stroke, &[DVec3::new(0.5, 9.0, -9.0), DVec3::new(0.5, 9.0, 9.0)])?;
/// let touched = factors.update(&graph, &cuts, new, &|_| true);
/// assert_eq!(factors.to_vec(), [0.0, 0.0]);
/// assert_eq!(touched, [0, 1]);
/// assert_eq!(factors.crossed(&graph).collect::<Vec<_>>(), [(0, 1, 0.0)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct PairFactors {
    settings: FactorSettings,
    node_count: usize,
    pair_count: usize,
    /// Distance (m) from a node beyond which a triangle changes none of its pairs; the largest of all nodes.
    span: f64,
    /// Factors below 1 by directed pair.
    crossed: BTreeMap<u32, f64>,
    /// Directions out of the cut of the paths of those that are bent around its front, by directed pair.
    conormals: BTreeMap<u32, DVec3>,
}

/// Candidates from which an update is spread over threads, and how many one thread takes at least: a path
/// takes 10 to 20 µs, as long as handing over a few of them.
const PARALLEL: usize = 16;
const TOGETHER: usize = 4;

impl PairFactors {
    /// At most what one directed pair that a cut crosses takes (bytes): 12 in leaves of 144 for 5 to
    /// 11 of them, and the search tree above, 240 for every 5 or more leaves.
    pub const BYTES_PER_PAIR: usize = 41;

    /// The same of what a directed pair that is bent around a cut's front takes besides: 28 in leaves of 320 for 5 to
    /// 11 of them, and the search tree above, 416 for every 5 or more leaves.
    pub const BYTES_PER_CONORMAL: usize = 81;

    /// All factors 1.
    ///
    /// # Panics
    /// If the influence radius is not positive.
    #[must_use]
    pub fn new(graph: &Graph<'_>, settings: &FactorSettings) -> Self {
        let (InfluenceRadius::Neighbors(size) | InfluenceRadius::Length(size)) =
            settings.influence_radius;
        let (is_positive, radius) = (size > 0.0 && size.is_finite(), settings.influence_radius);
        assert!(is_positive, "influence radius {radius:?} is not positive");
        Self {
            settings: *settings,
            node_count: graph.positions.len(),
            span: settings.influence_radius.span(graph),
            pair_count: graph.indices.len(),
            crossed: BTreeMap::new(),
            conormals: BTreeMap::new(),
        }
    }

    /// Brings the factors up to date with new pieces of a cut.
    ///
    /// Only pairs near the new pieces are looked at: those that a new piece crosses, and those
    /// already crossed whose path may pass there. The work does not depend on the length of the
    /// cut so far.
    ///
    /// # Arguments
    /// * `graph` -- what the factors were made for.
    /// * `cut` -- all pieces, the new ones among them.
    /// * `new` -- numbers of the pieces that came since the last update.
    /// * `inside` -- whether a point of material coordinates lies in the uncut body: a path must.
    ///
    /// # Returns
    /// The nodes of the pairs whose factor fell, ascending.
    ///
    /// # Panics
    /// If `new` names pieces that are not there, or the graph has other numbers of nodes and pairs
    /// than that of the start.
    pub fn update(
        &mut self,
        graph: &Graph<'_>,
        cut: &Cuts,
        new: Range<usize>,
        inside: &(dyn Fn(DVec3) -> bool + Sync),
    ) -> Vec<u32> {
        self.check_same(graph);
        let (end, all) = (new.end, cut.triangle_count());
        assert!(end <= all, "triangle {end} of {all}");
        let candidates = self.candidates(graph, cut, new);
        let FactorSettings {
            influence_radius,
            rule,
        } = self.settings;
        let evaluate = |scratch: &mut PathScratch, &(i, pair): &(u32, u32)| {
            let (i, j) = (i as usize, graph.indices[pair as usize] as usize);
            let (a, b) = (graph.positions[i], graph.positions[j]);
            let radius = influence_radius.of_pair(graph, i, j);
            rule.crossed_factor(cut, a, b, radius, inside, scratch)
        };
        let values: Vec<(f64, DVec3)> = if candidates.len() < PARALLEL {
            let scratch = &mut PathScratch::default();
            candidates
                .iter()
                .map(|pair| evaluate(scratch, pair))
                .collect()
        } else {
            candidates
                .par_iter()
                .with_min_len(TOGETHER)
                .map_init(PathScratch::default, evaluate)
                .collect()
        };
        let mut touched = Vec::new();
        for (&(i, pair), (value, outward)) in candidates.iter().zip(values) {
            if value >= self.factor(pair as usize) {
                continue;
            }
            let j = graph.indices[pair as usize];
            let back = index32(graph.pair(j, i));
            for pair in [pair, back] {
                self.crossed.insert(pair, value);
                if outward == DVec3::ZERO {
                    self.conormals.remove(&pair);
                } else {
                    self.conormals.insert(pair, outward);
                }
            }
            touched.extend([i, j]);
        }
        touched.sort_unstable();
        touched.dedup();
        touched
    }

    /// Factor of a directed pair, by its position in the graph's indices.
    #[must_use]
    pub fn factor(&self, pair: usize) -> f64 {
        self.crossed.get(&index32(pair)).copied().unwrap_or(1.0)
    }

    /// The factors of all directed pairs, in the graph's order.
    #[must_use]
    pub fn to_vec(&self) -> Vec<f64> {
        let mut factors = vec![1.0; self.pair_count];
        for (&pair, &factor) in &self.crossed {
            factors[pair as usize] = factor;
        }
        factors
    }

    /// How a cut ends beside a node: the mean of `ν νᵀ` over those pairs of the node that are bent around its front, with
    /// the unit directions `ν` out of the cut of their paths, the front's outward conormals. Zero at nodes without such
    /// pairs, and with [`Rule::Visibility`], which knows no paths.
    ///
    /// It changes in an update at nodes that the update touched alone.
    ///
    /// # Panics
    /// If there is no such node, or the graph has other numbers of nodes and pairs than that of the start.
    #[must_use]
    pub fn front_matrix(&self, graph: &Graph<'_>, node: usize) -> DMat3 {
        self.check_same(graph);
        let (mut sum, mut count) = (DMat3::ZERO, 0.0);
        let row = graph.offsets[node]..graph.offsets[node + 1];
        for (_, &outward) in self.conormals.range(row) {
            let [x, y, z] = outward.to_array().map(|axis| outward * axis);
            sum += DMat3::from_cols(x, y, z);
            count += 1.0;
        }
        if count > 0.0 {
            sum * f64::recip(count)
        } else {
            sum
        }
    }

    /// Undirected pairs that a cut crosses as `(i, j, factor)`, `i < j`, ascending.
    ///
    /// # Panics
    /// If the graph has other numbers of nodes and pairs than that of the start.
    pub fn crossed<'a>(&'a self, graph: &Graph<'a>) -> impl Iterator<Item = (u32, u32, f64)> + 'a {
        self.check_same(graph);
        let (offsets, indices) = (graph.offsets, graph.indices);
        let mut i = 0;
        self.crossed.iter().filter_map(move |(&pair, &factor)| {
            while offsets[i + 1] <= pair {
                i += 1;
            }
            let (node, j) = (index32(i), indices[pair as usize]);
            (node < j).then_some((node, j, factor))
        })
    }

    /// Number of undirected pairs that a cut crosses.
    #[must_use]
    pub fn crossed_count(&self) -> usize {
        self.crossed.len() / 2
    }

    /// Number of undirected pairs whose factor is 0.
    #[must_use]
    pub fn severed_count(&self) -> usize {
        self.crossed.values().filter(|&&f| f <= 0.0).count() / 2
    }

    /// Bytes held on the heap, at most.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.crossed.len() * Self::BYTES_PER_PAIR + self.conormals.len() * Self::BYTES_PER_CONORMAL
    }

    pub(crate) fn check_same(&self, graph: &Graph<'_>) {
        let (nodes, pairs) = (self.node_count, self.pair_count);
        let found = (graph.positions.len(), graph.offsets.len());
        assert_eq!(found, (nodes, nodes + 1), "the nodes of the start");
        assert_eq!(graph.indices.len(), pairs, "the pairs of the start");
    }

    /// Lets nothing pass along a directed pair.
    pub(crate) fn sever(&mut self, pair: usize) {
        self.crossed.insert(index32(pair), 0.0);
        self.conormals.remove(&index32(pair));
    }

    /// Pairs of a node that a cut crosses, ascending, with their factors.
    pub(crate) fn crossed_in(
        &self,
        graph: &Graph<'_>,
        node: usize,
    ) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.crossed
            .range(graph.offsets[node]..graph.offsets[node + 1])
            .map(|(&pair, &factor)| (pair as usize, factor))
    }

    /// Undirected pairs `(i, pair)`, with `i` the lower number, that the new pieces may change.
    fn candidates(&self, graph: &Graph<'_>, cut: &Cuts, new: Range<usize>) -> Vec<(u32, u32)> {
        let reach = self.settings.influence_radius;
        let mut candidates = Vec::new();
        let bounds: Vec<Bounds> = new.clone().map(|t| Bounds::of(&cut.triangle(t))).collect();
        let Some(all) = bounds.iter().copied().reduce(Bounds::union) else {
            return candidates;
        };
        let x = graph.positions;
        let reach_of_all = all.grown(self.span);
        let mut beside: Vec<(usize, &Bounds)> = Vec::new();
        for i in (0..x.len()).filter(|&i| reach_of_all.contains(x[i])) {
            let triangles = new.clone().zip(&bounds);
            beside.clear();
            beside.extend(triangles.filter(|(_, bounds)| bounds.distance(x[i]) <= self.span));
            if beside.is_empty() {
                continue;
            }
            let mut crossed = self.crossed_in(graph, i).peekable();
            for pair in graph.pairs(i) {
                let known = crossed.next_if(|&(known, _)| known == pair);
                let j = graph.indices[pair] as usize;
                if j < i {
                    continue;
                }
                let look = match known {
                    None => {
                        let ends = Bounds::of(&[x[i], x[j]]);
                        beside.iter().any(|&(triangle, bounds)| {
                            ends.meets(bounds) && cut.triangle_crosses(triangle, x[i], x[j])
                        })
                    }
                    Some((_, factor)) if factor > 0.0 => {
                        let around = Rule::MARGIN * reach.of_pair(graph, i, j);
                        let middle = x[i].midpoint(x[j]);
                        (beside.iter()).any(|(_, bounds)| bounds.distance(middle) <= around)
                    }
                    Some(_) => false,
                };
                if look {
                    candidates.push((index32(i), index32(pair)));
                }
            }
        }
        candidates
    }
}
