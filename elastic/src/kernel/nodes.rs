//! What belongs to nodes: rest state, materials, what their rows see; what an evaluation leaves; and
//! what it needs while it runs.

use glam::{DMat3, DVec3};
use pulp::Arch;

use crate::input::Settings;
use crate::kernel::completion::Span;
use crate::kernel::dilatation::{Means, Pressures};
use crate::kernel::inactive::{Asleep, Inactive};
use crate::kernel::pairs::Pairs;
use crate::kernel::prestrain::Prestrain;
use crate::kernel::stale::Stale;
use crate::kernel::storage::{Move, bytes_of};
use crate::kernel::worst::Watch;
use crate::law::coefficients::Coefficients;
use crate::law::material::Material;
use crate::law::viscosity::Viscosity;

/// What is constant between cuts.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(crate) settings: Settings,
    pub(crate) pairs: Pairs,
    /// What the processor offers to the loops.
    pub(crate) arch: Arch,
    pub(crate) rest: Vec<DVec3>,
    pub(crate) volumes: Vec<f64>,
    /// `V_i`, 0 at deficient nodes.
    pub(crate) elastic_volumes: Vec<f64>,
    pub(crate) materials: Vec<Material>,
    pub(crate) coefficients: Vec<Coefficients>,
    /// Empty if there is one material for all.
    pub(crate) material_of: Vec<u32>,
    /// Whether any law has `ln J` in it.
    pub(crate) logarithm: bool,
    /// Whether all laws are what the passes evaluate in place.
    pub(crate) plain: bool,
    /// Factors on `alpha` per node; empty where all are 1.
    pub(crate) control_scales: Vec<f64>,
    /// `1 / m_i`; empty unless stiffness is monitored.
    pub(crate) inverse_masses: Vec<f64>,
    /// `sum_j |g_ij|²/m_j`, `j = i` included; empty unless stiffness is monitored.
    pub(crate) gradient_squares: Vec<f64>,
    /// Nodes whose row is not full, ascending.
    spans: Vec<(u32, Span)>,
    pub(crate) ranks: Vec<u8>,
    /// Nodes with nothing to compute.
    pub(crate) inactive: Inactive,
    /// Mean dilatation.
    pub(crate) means: Option<Means>,
}

/// What the last evaluation left, besides deformation gradients, and what went before it.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub(crate) viscosity: Option<Viscosity>,
    pub(crate) pressures: Option<Pressures>,
    /// Offsets of rebuilt rows.
    pub(crate) prestrain: Prestrain,
    /// What was seen of chunks of nodes.
    pub(crate) watches: Vec<Watch>,
}

/// What passes write for each other.
#[derive(Debug, Clone)]
pub(crate) struct Scratch {
    /// Displacements, or the vector of a tangent product.
    pub(crate) moves: Vec<Move>,
    /// Energies of chunks of nodes.
    pub(crate) partial: Vec<f64>,
    /// What is not as the last evaluation left it.
    pub(crate) stale: Stale,
    /// Of chunks of nodes, what need not be evaluated again.
    pub(crate) asleep: Vec<Asleep>,
    /// Changes of `J_i` and of `V_i_el / V_i U'(J̄_i)`; with mean dilatation.
    pub(crate) changes: [Vec<f64>; 2],
}

impl Model {
    pub(crate) fn new(
        settings: &Settings,
        pairs: Pairs,
        rest: &[DVec3],
        volumes: &[f64],
        (materials, material_of): (Vec<Material>, Vec<u32>),
    ) -> Self {
        let coefficients: Vec<Coefficients> = materials.iter().map(Coefficients::new).collect();
        Self {
            logarithm: coefficients.iter().any(Coefficients::has_logarithm),
            plain: coefficients.iter().all(Coefficients::is_plain),
            control_scales: Vec::new(),
            inverse_masses: Vec::new(),
            gradient_squares: Vec::new(),
            settings: *settings,
            pairs,
            arch: Arch::new(),
            rest: rest.to_vec(),
            volumes: volumes.to_vec(),
            elastic_volumes: volumes.to_vec(),
            coefficients,
            materials,
            material_of,
            spans: Vec::new(),
            ranks: vec![3; rest.len()],
            inactive: Inactive::default(),
            means: None,
        }
    }

    pub(crate) fn node_count(&self) -> usize {
        self.rest.len()
    }

    pub(crate) fn controlled(&self) -> bool {
        self.settings.stabilization > 0.0
    }

    #[inline]
    pub(crate) fn material_index(&self, node: usize) -> usize {
        self.material_of.get(node).map_or(0, |&m| m as usize)
    }

    pub(crate) fn material(&self, node: usize) -> &Material {
        &self.materials[self.material_index(node)]
    }

    #[inline(always)]
    pub(crate) fn span(&self, node: usize) -> Option<&Span> {
        if self.ranks[node] == 3 {
            None
        } else {
            self.find_span(node)
        }
    }

    #[cold]
    fn find_span(&self, node: usize) -> Option<&Span> {
        self.place_of_span(node).ok().map(|k| &self.spans[k].1)
    }

    fn place_of_span(&self, node: usize) -> Result<usize, usize> {
        self.spans
            .binary_search_by_key(&node, |(at, _)| *at as usize)
    }

    pub(crate) fn set_span(&mut self, node: usize, span: Option<&Span>) {
        match (span, self.place_of_span(node)) {
            (Some(span), Ok(at)) => self.spans[at].1 = *span,
            (Some(span), Err(at)) => {
                let id = u32::try_from(node).unwrap_or(u32::MAX);
                self.spans.insert(at, (id, *span));
            }
            (None, Ok(at)) => {
                self.spans.remove(at);
            }
            (None, Err(_)) => {}
        }
        self.ranks[node] = span.map_or(3, |span| span.rank);
    }

    /// `F` from `sum_j u_ij ⊗ g_ij`.
    pub(crate) fn deformation_gradient(&self, node: usize, h: DMat3) -> DMat3 {
        match self.span(node) {
            None => DMat3::IDENTITY + h,
            Some(span) => span.complete(span.projector() + h),
        }
    }

    /// Change of `F` for a change of `sum_j u_ij ⊗ g_ij`.
    pub(crate) fn deformation_change(&self, node: usize, f: DMat3, dh: DMat3) -> DMat3 {
        match self.span(node) {
            None => dh,
            Some(span) => span.complete_change(f, dh),
        }
    }

    /// The law's part that viscosity follows: without what resists a change of volume alone.
    pub(crate) fn followed(&self, node: usize) -> Coefficients {
        let mut law = *self.law(node);
        law.split_volumetric();
        law
    }

    /// Energy density and stress of a node at `F`, without mean dilatation: law, fibers, viscosity.
    #[inline(never)]
    pub(crate) fn energy_and_stress(
        &self,
        viscosity: Option<&Viscosity>,
        node: usize,
        f: DMat3,
    ) -> (f64, DMat3) {
        let (mut energy, mut stress) = self.law(node).energy_and_stress(f);
        if let Some(viscosity) = viscosity {
            let part = self.followed(node).energy_and_stress(f);
            let (more, over) =
                viscosity.energy_and_stress(node, self.material_index(node), f, part);
            energy += more;
            stress += over;
        }
        (energy, stress)
    }

    pub(crate) fn stress_change(
        &self,
        viscosity: Option<&Viscosity>,
        node: usize,
        f: DMat3,
        df: DMat3,
    ) -> DMat3 {
        let change = self.law(node).stress_change(f, df);
        viscosity.map_or(change, |viscosity| {
            let part = self.followed(node).stress_change(f, df);
            change + viscosity.stress_change(node, self.material_index(node), df, part)
        })
    }

    /// The part of a stress that works on what the node's row sees.
    pub(crate) fn seen_stress(&self, node: usize, f: DMat3, stress: DMat3) -> DMat3 {
        match self.span(node) {
            None => stress,
            Some(span) => span.project(f, stress),
        }
    }

    /// Its change; `stress` is asked for where it is needed.
    pub(crate) fn seen_change(
        &self,
        node: usize,
        f: DMat3,
        dh: DMat3,
        change: DMat3,
        stress: impl FnOnce() -> DMat3,
    ) -> DMat3 {
        match self.span(node) {
            None => change,
            Some(span) => span.project_change(f, dh, stress(), change),
        }
    }

    /// True if a node's stress is its material's neo-Hookean one and nothing else.
    #[inline(always)]
    pub(crate) fn is_plain(&self, node: usize) -> bool {
        self.ranks[node] == 3 && self.law(node).is_plain()
    }

    #[inline(always)]
    pub(crate) fn law(&self, node: usize) -> &Coefficients {
        &self.coefficients[self.material_index(node)]
    }

    /// Heap bytes that only bodies hold whose stiffness is monitored.
    pub(crate) fn watch_bytes(&self) -> usize {
        bytes_of(&self.inverse_masses) + bytes_of(&self.gradient_squares)
    }

    pub(crate) fn bytes(&self) -> usize {
        bytes_of(&self.rest)
            + bytes_of(&self.volumes)
            + bytes_of(&self.elastic_volumes)
            + bytes_of(&self.materials)
            + bytes_of(&self.coefficients)
            + bytes_of(&self.material_of)
            + bytes_of(&self.control_scales)
            + self.watch_bytes()
            + bytes_of(&self.spans)
            + bytes_of(&self.ranks)
            + self.pairs.bytes()
            + self.inactive.bytes()
            + self.means.as_ref().map_or(0, Means::bytes)
    }
}

impl State {
    pub(crate) fn bytes(&self) -> usize {
        self.viscosity.as_ref().map_or(0, Viscosity::bytes)
            + self.pressures.as_ref().map_or(0, Pressures::bytes)
            + self.prestrain.bytes()
            + bytes_of(&self.watches)
    }
}

impl Scratch {
    pub(crate) fn bytes(&self) -> usize {
        bytes_of(&self.moves)
            + bytes_of(&self.partial)
            + bytes_of(&self.changes[0])
            + bytes_of(&self.changes[1])
            + bytes_of(&self.asleep)
            + self.stale.bytes()
    }
}
