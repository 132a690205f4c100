//! What an explicit scheme monitors while a body moves: how stiff it has become, and whether a node
//! turns inside out.
//!
//! A bound on what a node's own strain energy adds to the largest eigenvalue of `M⁻¹ K` is
//! `r_i = V_i c(F_i) s_i`, `s_i = sum_j |g_ij|²/m_j` with `j = i` included, `c` a bound on the
//! eigenvalues of `d²W/dF²`, times `|I + A|²` where a gradient is kept over a rebuild. It is too large to be a step's limit, but it
//! rises when the limit falls, at once and at every node, which an estimate by products with an earlier vector does not.

use glam::{DMat3, DVec3};

use crate::kernel::fixed::Tables;
use crate::kernel::lanes::wide;
use crate::kernel::nodes::Model;
use crate::kernel::planes::ZERO;
use crate::kernel::prestrain::Prestrain;
use crate::kernel::storage::{BLOCK, Plane};
use crate::kernel::worst::Watch;
use crate::law::tensor::volume_ratio;

/// What is seen of the nodes that are evaluated in lanes.
#[derive(Debug, Clone)]
pub(crate) struct Watching {
    watched: bool,
    /// `V_i` of the block at hand; zero in lanes with nothing to see.
    volumes: Plane,
    /// `s_i` times what offsets add, of the block at hand.
    squares: Plane,
    ratios: Plane,
    stiffness: Plane,
}

impl Watching {
    pub(crate) fn new(model: &Model) -> Self {
        Self {
            watched: !model.gradient_squares.is_empty(),
            volumes: ZERO,
            squares: ZERO,
            ratios: Plane::of(Watch::NOTHING.ratio),
            stiffness: Plane::of(Watch::NOTHING.stiffness),
        }
    }

    /// Takes the constants of the nodes from `first` on.
    #[inline(always)]
    pub(crate) fn load(
        &mut self,
        model: &Model,
        prestrain: &Prestrain,
        first: usize,
        count: usize,
    ) {
        self.volumes = wide(&model.elastic_volumes, first, count);
        if self.watched {
            self.squares = wide(&model.gradient_squares, first, count);
            for &node in prestrain.among(first..first + count) {
                self.squares[node as usize - first] *= prestrain.gain(node as usize);
            }
        }
    }

    /// Leaves a node out.
    pub(crate) fn skip(&mut self, lane: usize) {
        self.volumes[lane] = 0.0;
    }

    /// Takes in `J` and the bounds on the tangent modulus of a block.
    #[inline(always)]
    pub(crate) fn see(&mut self, ratios: &Plane, bounds: &Plane) {
        for lane in 0..BLOCK {
            let carries = self.volumes[lane] > 0.0;
            let ratio = if carries { ratios[lane] } else { f64::INFINITY };
            self.ratios[lane] = self.ratios[lane].min(ratio);
            let stiffness = self.volumes[lane] * self.squares[lane] * bounds[lane];
            self.stiffness[lane] = self.stiffness[lane].max(stiffness);
        }
    }

    /// What [`Watching::see`] takes in of the block at hand alone.
    pub(crate) fn of_block(&self, ratios: &Plane, bounds: &Plane) -> Watch {
        let mut alone = Self {
            ratios: Plane::of(Watch::NOTHING.ratio),
            stiffness: Plane::of(Watch::NOTHING.stiffness),
            ..self.clone()
        };
        alone.see(ratios, bounds);
        alone.worst(Watch::NOTHING)
    }

    /// The worst of all that was seen, and of what was seen elsewhere.
    pub(crate) fn worst(&self, elsewhere: Watch) -> Watch {
        let lanes = self.ratios.iter().zip(&*self.stiffness);
        lanes.fold(elsewhere, |worst, (&ratio, &stiffness)| {
            worst.and(Watch { ratio, stiffness })
        })
    }
}

/// `r_i` of a node at `f`, 0 where nobody monitors.
#[inline(always)]
pub(crate) fn indicator(model: &Model, node: usize, f: DMat3) -> f64 {
    match model.gradient_squares.get(node) {
        None => 0.0,
        Some(square) => model.elastic_volumes[node] * square * model.law(node).tangent_bound(f),
    }
}

/// `sum_j |g_ij|²/m_j`, `j = i` included.
pub(crate) fn gradient_square(model: &Model, tables: &Tables, node: usize) -> f64 {
    let (mut own, mut sum) = (DVec3::ZERO, 0.0);
    for (j, _, _, g) in tables.row(node, model.pairs.row(node)) {
        own -= g;
        sum += g.length_squared() * model.inverse_masses[j as usize];
    }
    sum + own.length_squared() * model.inverse_masses[node]
}

/// What is monitored of a node.
pub(crate) fn watch_node((model, prestrain): (&Model, &Prestrain), node: usize, f: DMat3) -> Watch {
    if model.elastic_volumes[node] > 0.0 {
        Watch {
            ratio: volume_ratio(f),
            stiffness: indicator(model, node, f) * prestrain.gain(node),
        }
    } else {
        Watch::NOTHING
    }
}
