//! One deformed state of the body, ready to be asked.

use glam::{DMat3, DVec3};

use super::{ENLARGED, MaterialMap};
use crate::parallel::to_u32;
use crate::search::PointRuns;
use crate::symmetric::outer;
use crate::{MapError, kernel, kernel_slope};

/// Newton's method stops when a step is below this fraction of the support radius of the start node.
const TOLERANCE: f64 = 1e-12;

/// Most steps of Newton's method; smooth deformations take three.
const STEP_LIMIT: usize = 12;

/// Sum of weights below which a point counts as outside all supports.
const LEAST_WEIGHT: f64 = 1e-9;

/// Distance, in support radii of the start node, over which one set of nodes serves.
const SLACK: f64 = 0.25;

/// Nodes from which [`MapFrame::preimage`] starts at most: enough that both flanks of a cut have one
/// among them.
const STARTS: usize = 8;

/// Answer of [`MapFrame::preimage`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Preimage {
    /// Material position X (m).
    pub position: DVec3,
    /// `∂x/∂X` there.
    pub jacobian: DMat3,
    /// Node from whose side it is seen.
    pub start_node: u32,
}

/// A [`MaterialMap`] with the positions and deformation gradients of one instant.
#[derive(Debug)]
pub struct MapFrame<'a> {
    pub(super) map: &'a MaterialMap,
    pub(super) positions: &'a [DVec3],
    pub(super) gradients: &'a [DMat3],
    pub(super) runs: PointRuns,
}

/// The forward map at one material point.
pub(super) struct Forward {
    /// World position (m) from that of the start node on.
    pub(super) way: DVec3,
    pub(super) jacobian: DMat3,
}

impl MaterialMap {
    /// Takes the state of one instant; puts boxes around runs of nodes at their current positions, one
    /// pass over the nodes.
    ///
    /// # Arguments
    /// * `positions` -- current positions x (m), shape `(n)`.
    /// * `deformation_gradients` -- `F_i = I + ∇u_i`, shape `(n)`.
    ///
    /// # Errors
    /// [`MapError`] for a list of the wrong length and for positions or gradients that are not finite.
    pub fn frame<'a>(
        &'a self,
        positions: &'a [DVec3],
        deformation_gradients: &'a [DMat3],
    ) -> Result<MapFrame<'a>, MapError> {
        let nodes = &self.neighborhoods;
        nodes.check_nodes("positions", positions.len())?;
        nodes.check_nodes("deformation gradients", deformation_gradients.len())?;
        if let Some(node) = deformation_gradients.iter().position(|f| !f.is_finite()) {
            return Err(MapError::DeformationGradient { node });
        }
        let runs = PointRuns::new(positions)?;
        Ok(MapFrame {
            map: self,
            positions,
            gradients: deformation_gradients,
            runs,
        })
    }
}

impl MapFrame<'_> {
    /// Node nearest to a world point (m), the one of lower index at equal distance, if one is no farther than `reach` (m).
    #[must_use]
    pub fn nearest_node(&self, world: DVec3, reach: f64) -> Option<u32> {
        let mut buffer = Vec::with_capacity(2);
        self.runs
            .nearest_into(self.positions, world, reach, 1, &mut buffer);
        buffer.first().map(|&(_, node)| node)
    }

    /// Material point of a world point (m) where tissue is: Newton's method on `X + u(X) − x = 0` from
    /// `X_i + F_i⁻¹ (x − x_i)` at a near node i.
    ///
    /// The search starts at the nearest nodes, one after the other, until an answer is good: it is
    /// seen from its start node, `det ∂x/∂X` is above 0, and the start node is no farther
    /// than its support radius. Nodes that have turned inside out take no part.
    ///
    /// # Arguments
    /// * `world` -- the asked point (m).
    /// * `seen` -- whether a material point is seen from the node's rest position: false where a cut
    ///   is between them.
    ///
    /// # Returns
    /// `None` next to tissue and between the flanks of an open cut. In tissue that is pressed flat the Jacobian may be as good
    /// as singular.
    ///
    /// # Panics
    /// If `world` is not finite.
    #[must_use]
    pub fn preimage(&self, world: DVec3, seen: &dyn Fn(u32, DVec3) -> bool) -> Option<Preimage> {
        assert!(world.is_finite(), "the asked world point must be finite");
        let mut near = Vec::with_capacity(2 * STARTS);
        self.runs
            .nearest_into(self.positions, world, self.map.reach, STARTS, &mut near);
        let starts = near.iter().filter(|&&(squared, node)| {
            let radius = self.map.support_radii[node as usize];
            squared <= radius * radius && self.gradients[node as usize].determinant() > 0.0
        });
        let mut hidden: Vec<DVec3> = Vec::with_capacity(STARTS);
        for &(_, start_node) in starts {
            // What is not seen from one node of a flank is not seen from its neighbours there.
            if hidden.iter().any(|&tried| seen(start_node, tried)) {
                continue;
            }
            let Some((position, forward)) = self.newton(world, start_node) else {
                continue;
            };
            if !seen(start_node, position) {
                hidden.push(self.map.rest_positions[start_node as usize]);
            } else if forward.jacobian.determinant() > 0.0 {
                return Some(Preimage {
                    position,
                    jacobian: forward.jacobian,
                    start_node,
                });
            }
        }
        None
    }

    /// Nodes whose supports hold a point within `slack` of `material` and that the start node
    /// reaches over pairs that are not severed, through nodes near the point. Ascending.
    pub(super) fn connected(&self, material: DVec3, slack: f64, start: u32) -> Vec<u32> {
        let map = self.map;
        let mut marks = NodeMarks::new(map.rest_positions.len());
        let mut missing = 0;
        for node in map.runs.near(material, map.reach + slack).flatten() {
            let radius = map.support_radii[node] + slack;
            if (material - map.rest_positions[node]).length_squared() < radius * radius {
                *marks.of(node) = WANTED;
                missing += 1;
            }
        }
        let is_near = |node: usize| {
            let (x, radius) = (map.rest_positions[node], map.support_radii[node] * ENLARGED);
            let (low, high) = (material - slack, material + slack);
            (x - radius).cmple(high).all() && (x + radius).cmpge(low).all()
        };
        let mut reached = Vec::new();
        let mut come = |node: u32, reached: &mut Vec<u32>| {
            let mark = marks.of(node as usize);
            if *mark & TRIED == 0 {
                *mark |= TRIED;
                if is_near(node as usize) {
                    missing -= usize::from(*mark & WANTED);
                    reached.push(node);
                }
            }
            missing
        };
        let mut left = come(start, &mut reached);
        let mut next = 0;
        // Near nodes come first, so the walk ends early where nothing is severed.
        while next < reached.len() && left > 0 {
            let node = reached[next] as usize;
            next += 1;
            let neighbors = map.neighborhoods.row(node);
            for (pair, &other) in map.neighborhoods.pairs(node).zip(neighbors) {
                if !map.severed[pair] {
                    left = come(other, &mut reached);
                }
            }
        }
        reached.retain(|&node| *marks.of(node as usize) & WANTED != 0);
        reached.sort_unstable();
        reached
    }

    /// Forward map and its Jacobian over some nodes, `way` (m) in the material from a start node on; `None` if their
    /// weights vanish. All that is added up is as small as the supports, so that a body may lie anywhere.
    pub(super) fn forward(&self, start: u32, way: DVec3, nodes: &[u32]) -> Option<Forward> {
        let map = self.map;
        let (rest_start, start) = (
            map.rest_positions[start as usize],
            self.positions[start as usize],
        );
        let mut weight = 0.0;
        let mut weight_gradient = DVec3::ZERO;
        let mut displacement = DVec3::ZERO;
        let mut gradient = DMat3::ZERO;
        let mut coupling = DMat3::ZERO;
        for &node in nodes {
            let i = node as usize;
            let h = map.support_radii[i];
            let apart = map.rest_positions[i] - rest_start;
            let from = way - apart;
            let r = from.length();
            let w = kernel(r / h);
            if w <= 0.0 {
                continue;
            }
            let slope = if r > 0.0 {
                kernel_slope(r / h) / (h * r)
            } else {
                0.0
            };
            let stretch = self.gradients[i] - DMat3::IDENTITY;
            let u = self.positions[i] - start - apart + stretch * from;
            weight += w;
            weight_gradient += from * slope;
            displacement += u * w;
            gradient += stretch * w;
            coupling += outer(u, from * slope);
        }
        if weight < LEAST_WEIGHT || weight.is_nan() {
            return None;
        }
        let u = displacement / weight;
        let slope = (gradient + coupling - outer(u, weight_gradient)) * weight.recip();
        Some(Forward {
            way: way + u,
            jacobian: DMat3::IDENTITY + slope,
        })
    }

    /// Newton's method with step halving; `None` if it does not converge. Nodes that have turned
    /// inside out take no part.
    fn newton(&self, world: DVec3, start: u32) -> Option<(DVec3, Forward)> {
        let map = self.map;
        let around = |centre: DVec3, slack: f64| {
            let mut nodes = self.connected(centre, slack, start);
            nodes.retain(|&node| self.gradients[node as usize].determinant() > 0.0);
            nodes
        };
        let i = start as usize;
        let (rest_start, h) = (map.rest_positions[i], map.support_radii[i]);
        let bound = TOLERANCE * h;
        let asked = world - self.positions[i];
        let mut way = invert(&self.gradients[i])? * asked;
        // One set of nodes serves all iterates that stay near its centre.
        let slack = SLACK * h;
        let mut centre = way;
        let mut nodes = around(rest_start + centre, slack);
        let mut forward = self.forward(start, way, &nodes)?;
        for _ in 0..STEP_LIMIT {
            let residual = forward.way - asked;
            let step = invert(&forward.jacobian)? * residual;
            let mut damping = 1.0;
            let next = loop {
                let trial = way - step * damping;
                if (trial - centre).length_squared() > slack * slack {
                    centre = trial;
                    nodes = around(rest_start + centre, slack);
                }
                let found = self.forward(start, trial, &nodes);
                let better = found.filter(|f| {
                    let left = (f.way - asked).length();
                    left <= residual.length() || step.length() * damping <= bound
                });
                if let Some(found) = better {
                    break (trial, found);
                }
                damping *= 0.5;
                if damping < 0.05 {
                    return None;
                }
            };
            (way, forward) = next;
            // Newton doubles the digits: what is left after a step s is of order |s|²/h, so a step
            // below the square root of the tolerance was the last one needed.
            let step = (step * damping).length();
            let left = (forward.way - asked).length();
            if step <= bound || (damping > 0.9 && step * step <= bound * h && left <= bound) {
                return Some((rest_start + way, forward));
            }
        }
        None
    }
}

/// A node whose support holds the point that is asked for.
const WANTED: u8 = 1;
/// A node that the walk has come to.
const TRIED: u8 = 2;

/// Marks of nodes, few of which are used.
struct NodeMarks {
    /// Where those of each run of nodes begin; `u32::MAX` while none is used.
    first: Vec<u32>,
    marks: Vec<u8>,
}

impl NodeMarks {
    /// Nodes in a run.
    const RUN: usize = 64;

    fn new(nodes: usize) -> Self {
        Self {
            first: vec![u32::MAX; nodes.div_ceil(Self::RUN)],
            marks: Vec::new(),
        }
    }

    fn of(&mut self, node: usize) -> &mut u8 {
        let first = &mut self.first[node / Self::RUN];
        if *first == u32::MAX {
            *first = to_u32(self.marks.len());
            self.marks.resize(self.marks.len() + Self::RUN, 0);
        }
        &mut self.marks[*first as usize + node % Self::RUN]
    }
}

/// Inverse, `None` where the determinant is zero or the inverse is not finite.
fn invert(matrix: &DMat3) -> Option<DMat3> {
    let determinant = matrix.determinant();
    let inverse = matrix.inverse();
    (determinant != 0.0 && inverse.is_finite()).then_some(inverse)
}
