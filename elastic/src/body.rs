//! What belongs to nodes: rest state, materials, and the state last evaluated.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::bond::Bonds;
use crate::completion::{RowKind, Span, row_kind};
use crate::dilatation::MeanDilatation;
use crate::error::ElasticError;
use crate::evaluate::{CHUNK, PARALLEL_CHUNK};
use crate::front::Fronts;
use crate::kernel::{Anchored, Lanes, Move};
use crate::law::Prepared;
use crate::material::Material;
use crate::model::{Settings, Stencils};
use crate::offset::Continuation;
use crate::rows::Rows;
use crate::still::Still;
use crate::viscosity::Viscosity;
use crate::watch::Watch;

#[derive(Debug, Clone)]
pub(crate) struct Body {
    pub(crate) settings: Settings,
    pub(crate) rest: Vec<DVec3>,
    pub(crate) volumes: Vec<f64>,
    /// `V_i`, 0 at weak nodes.
    pub(crate) elastic_volumes: Vec<f64>,
    pub(crate) materials: Vec<Material>,
    pub(crate) prepared: Vec<Prepared>,
    /// Empty if there is one material for all.
    pub(crate) material_of: Vec<u32>,
    /// Fiber directions, empty if the materials' own hold.
    pub(crate) fiber_directions: Vec<DVec3>,
    /// Whether any law has `ln J` in it.
    pub(crate) logarithm: bool,
    /// No viscosity and no fiber directions of their own.
    pub(crate) plain: bool,
    pub(crate) viscosity: Option<Viscosity>,
    pub(crate) dilatation: Option<MeanDilatation>,
    /// Factors on `alpha` per node; empty where all are 1.
    control_scales: Vec<f64>,
    /// Offsets of rebuilt rows.
    pub(crate) continuation: Continuation,
    /// Weak nodes.
    pub(crate) bonds: Bonds,
    /// `1 / m_i`; empty unless stiffness is watched.
    pub(crate) inverse_masses: Vec<f64>,
    /// `sum_j |g_ij|²/m_j`, `j = i` included; empty unless stiffness is watched.
    pub(crate) gradient_squares: Vec<f64>,
    /// `g_ii`.
    pub(crate) self_gradients: Vec<DVec3>,
    /// What zero-energy control needs; empty without.
    control: Vec<Control>,
    /// Nodes whose row is not full, rising.
    spans: Vec<(u32, Span)>,
    pub(crate) ranks: Vec<u8>,
    /// Nodes with nothing to compute.
    pub(crate) still: Still,
    /// Nodes at crack fronts.
    pub(crate) fronts: Fronts,
    // Computed by an evaluation.
    /// Empty under zero-energy control.
    pub(crate) moves: Vec<Move>,
    /// Empty without zero-energy control.
    pub(crate) anchored: Vec<Anchored>,
    pub(crate) deformation: Vec<DMat3>,
    pub(crate) partial_energies: Vec<f64>,
    pub(crate) watches: Vec<Watch>,
}

/// Zero-energy control of a node; all zero where the row is deficient.
#[derive(Debug, Clone, Copy, Default)]
struct Control {
    /// `sum_j y_ij`, `y_ij = w_ij X_ij`.
    offset: DVec3,
    /// `A_i⁻¹`: xx, yy, zz, yz, zx, xy.
    moment_inverse: [f64; 6],
    /// `1 / sum_j w_ij |X_ij|²`.
    spread_inverse: f64,
}

impl Body {
    pub(crate) fn new(
        settings: &Settings,
        rest: &[DVec3],
        volumes: &[f64],
        (materials, material_of): (Vec<Material>, Vec<u32>),
    ) -> Self {
        let n = rest.len();
        let viscosity = Viscosity::new(&materials, n);
        let controlled = settings.zero_energy_control > 0.0;
        let anchored = |x: &DVec3| Anchored([0.0, 0.0, 0.0, 0.0, x.x, x.y, x.z, 0.0]);
        let n_controlled = if controlled { n } else { 0 };
        let prepared: Vec<Prepared> = materials.iter().map(Prepared::new).collect();
        Self {
            logarithm: prepared.iter().any(Prepared::has_logarithm),
            control_scales: Vec::new(),
            continuation: Continuation::default(),
            bonds: Bonds::default(),
            inverse_masses: Vec::new(),
            gradient_squares: Vec::new(),
            plain: viscosity.is_none(),
            viscosity,
            settings: *settings,
            rest: rest.to_vec(),
            volumes: volumes.to_vec(),
            elastic_volumes: volumes.to_vec(),
            prepared,
            materials,
            material_of,
            fiber_directions: Vec::new(),
            dilatation: None,
            self_gradients: vec![DVec3::ZERO; n],
            control: vec![Control::default(); n_controlled],
            spans: Vec::new(),
            ranks: vec![3; n],
            still: Still::default(),
            fronts: Fronts::default(),
            moves: vec![[0.0; 3]; n - n_controlled],
            anchored: rest[..n_controlled].iter().map(anchored).collect(),
            deformation: vec![DMat3::IDENTITY; n],
            partial_energies: vec![0.0; n.div_ceil(CHUNK)],
            watches: vec![Watch::NOTHING; n.div_ceil(CHUNK)],
        }
    }

    pub(crate) fn node_count(&self) -> usize {
        self.rest.len()
    }

    pub(crate) fn controlled(&self) -> bool {
        self.settings.zero_energy_control > 0.0
    }

    #[inline]
    pub(crate) fn material_index(&self, node: usize) -> usize {
        self.material_of.get(node).map_or(0, |&m| m as usize)
    }

    pub(crate) fn material(&self, node: usize) -> &Material {
        &self.materials[self.material_index(node)]
    }

    /// `c_i` of a node.
    pub(crate) fn control(&self, node: usize) -> f64 {
        self.anchored.get(node).map_or(0.0, |state| state.0[3])
    }

    /// `sum_j y_ij` of a node.
    #[inline(always)]
    pub(crate) fn offset(&self, node: usize) -> DVec3 {
        self.control
            .get(node)
            .map_or(DVec3::ZERO, |control| control.offset)
    }

    /// `A_i⁻¹` of a node.
    #[inline(always)]
    pub(crate) fn moment_inverse(&self, node: usize) -> DMat3 {
        self.control.get(node).map_or(DMat3::ZERO, |control| {
            let [xx, yy, zz, yz, zx, xy] = control.moment_inverse;
            DMat3::from_cols(
                DVec3::new(xx, xy, zx),
                DVec3::new(xy, yy, yz),
                DVec3::new(zx, yz, zz),
            )
        })
    }

    /// `sum_j y_ij`, `A_i⁻¹` and `c_i` of a node under control.
    #[inline(always)]
    pub(crate) fn control_constants(&self, node: usize) -> (DVec3, [f64; 6], f64) {
        let control = &self.control[node];
        let stiffness = self.anchored[node].0[3];
        (control.offset, control.moment_inverse, stiffness)
    }

    /// `(c_i H_i)ᵀ` from `(sum_j u_ij ⊗ y_ij)ᵀ`, `H_i` the linear field nearest to the neighbours'
    /// displacements.
    #[inline(always)]
    pub(crate) fn control_stress(&self, node: usize, s: DMat3) -> DMat3 {
        match self.anchored.get(node) {
            None => DMat3::ZERO,
            Some(state) => self.moment_inverse(node) * (s * state.0[3]),
        }
    }

    /// Sets displacements (or any vectors) in parallel over chunks of nodes.
    pub(crate) fn set_moves(&mut self, parallel: bool, of: impl Fn(usize) -> DVec3 + Sync) {
        let first = |chunk: usize| chunk * PARALLEL_CHUNK;
        let set = |(chunk, moves): (usize, &mut [Move])| {
            for (node, m) in (first(chunk)..).zip(moves) {
                *m = of(node).to_array();
            }
        };
        let set_anchored = |(chunk, states): (usize, &mut [Anchored])| {
            for (node, state) in (first(chunk)..).zip(states) {
                [state.0[0], state.0[1], state.0[2]] = of(node).to_array();
            }
        };
        let (moves, anchored) = (&mut self.moves, &mut self.anchored);
        if parallel {
            let chunks = moves.par_chunks_mut(PARALLEL_CHUNK);
            chunks.enumerate().for_each(set);
            let chunks = anchored.par_chunks_mut(PARALLEL_CHUNK);
            chunks.enumerate().for_each(set_anchored);
        } else {
            moves.chunks_mut(PARALLEL_CHUNK).enumerate().for_each(set);
            let chunks = anchored.chunks_mut(PARALLEL_CHUNK);
            chunks.enumerate().for_each(set_anchored);
        }
    }

    /// Sets the displacement (or any vector) of one node.
    pub(crate) fn set_move(&mut self, node: usize, to: DVec3) {
        match self.anchored.get_mut(node) {
            Some(state) => [state.0[0], state.0[1], state.0[2]] = to.to_array(),
            None => self.moves[node] = to.to_array(),
        }
    }

    /// Displacement set last.
    #[inline(always)]
    pub(crate) fn displacement(&self, node: usize) -> DVec3 {
        match self.anchored.get(node) {
            Some(state) => DVec3::new(state.0[0], state.0[1], state.0[2]),
            None => DVec3::from_array(self.moves[node]),
        }
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
        let found = self
            .spans
            .binary_search_by(|(at, _)| (*at as usize).cmp(&node));
        found.ok().map(|k| &self.spans[k].1)
    }

    /// `F` from `sum_j u_ij ⊗ g_ij`.
    #[inline(always)]
    pub(crate) fn deformation_gradient(&self, node: usize, h: DMat3) -> DMat3 {
        match self.span(node) {
            None => DMat3::IDENTITY + h,
            Some(span) => span.complete(span.projector() + h),
        }
    }

    /// `sum_j u_ij ⊗ g_ij` back from `F`.
    pub(crate) fn displacement_gradient(&self, node: usize, f: DMat3) -> DMat3 {
        match self.span(node) {
            None => f - DMat3::IDENTITY,
            Some(span) => (f - DMat3::IDENTITY) * span.projector(),
        }
    }

    /// Change of `F` for a change of `sum_j u_ij ⊗ g_ij`.
    #[inline(always)]
    pub(crate) fn deformation_change(&self, node: usize, f: DMat3, dh: DMat3) -> DMat3 {
        match self.span(node) {
            None => dh,
            Some(span) => span.complete_change(f, dh),
        }
    }

    #[inline]
    pub(crate) fn law(&self, node: usize) -> LawAt<'_> {
        let prepared = &self.prepared[self.material_index(node)];
        match self.fiber_directions.get(node) {
            None => LawAt::Shared(prepared),
            Some(&direction) => LawAt::Turned(prepared.turned(direction)),
        }
    }

    /// Energy density and stress of a node at `F`, without mean dilatation: law, fibers, viscosity.
    #[inline(never)]
    pub(crate) fn energy_and_stress(&self, node: usize, f: DMat3) -> (f64, DMat3) {
        let (energy, stress) = self.law(node).get().energy_and_stress(f);
        match &self.viscosity {
            None => (energy, stress),
            Some(viscosity) => {
                viscosity.energy_and_stress(node, self.material_index(node), f, energy, stress)
            }
        }
    }

    #[inline]
    pub(crate) fn stress_change(&self, node: usize, f: DMat3, df: DMat3) -> DMat3 {
        let change = self.law(node).get().stress_change(f, df);
        match &self.viscosity {
            None => change,
            Some(viscosity) => viscosity.stress_change(node, self.material_index(node), df, change),
        }
    }

    /// The part of a stress that works on what the node's row sees.
    #[inline(always)]
    pub(crate) fn seen_stress(&self, node: usize, f: DMat3, stress: DMat3) -> DMat3 {
        match self.span(node) {
            None => stress,
            Some(span) => span.project(f, stress),
        }
    }

    /// True if a node's stress is its material's neo-Hookean one and nothing else.
    #[inline(always)]
    pub(crate) fn is_plain(&self, node: usize) -> bool {
        self.plain && self.ranks[node] == 3 && self.law_shared(node).is_plain()
    }

    #[inline(always)]
    pub(crate) fn law_shared(&self, node: usize) -> &Prepared {
        &self.prepared[self.material_index(node)]
    }

    /// Recomputes `c_i` after its volume or row changed.
    pub(crate) fn refresh_control(&mut self, node: usize) {
        let scale = self.control_scales.get(node).copied().unwrap_or(1.0);
        let alpha = self.settings.zero_energy_control * scale;
        let stiffness = alpha * self.material(node).lame_mu() * self.elastic_volumes[node];
        let control = self.control.get(node);
        if let (Some(state), Some(control)) = (self.anchored.get_mut(node), control) {
            state.0[3] = stiffness * control.spread_inverse;
        }
    }

    /// Multiplies `alpha` of some nodes.
    pub(crate) fn scale_control(&mut self, nodes: &[u32], factor: f64) {
        self.control_scales.resize(self.rest.len(), 1.0);
        for &node in nodes {
            self.control_scales[node as usize] = factor;
            self.refresh_control(node as usize);
        }
    }

    /// Reads a row of the stencils and everything that follows from it.
    pub(crate) fn set_row<L: Lanes>(
        &mut self,
        rows: &mut Rows<L>,
        node: usize,
        stencils: &Stencils<'_>,
    ) -> Result<(), ElasticError> {
        let sums = rows.set_row(node, stencils, &self.rest)?;
        let kind = row_kind(sums.consistency);
        if let RowKind::Inconsistent(residual) = kind {
            return Err(ElasticError::InconsistentRow { node, residual });
        }
        self.self_gradients[node] = sums.self_gradient;
        if let Some(control) = self.control.get_mut(node) {
            // Without a full row the leftover e_ij is not blind to rotations; the node is then
            // held by the control of its neighbours.
            let full = matches!(kind, RowKind::Full);
            *control = Control::default();
            if let Some(inverse) = inverse_moment(sums.moment).filter(|_| full) {
                let m = sums.moment;
                *control = Control {
                    offset: sums.offset,
                    moment_inverse: inverse,
                    spread_inverse: (m.x_axis.x + m.y_axis.y + m.z_axis.z).recip(),
                };
            }
        }
        self.set_span(node, &kind);
        self.refresh_control(node);
        Ok(())
    }

    fn set_span(&mut self, node: usize, kind: &RowKind) {
        let at = self
            .spans
            .binary_search_by(|(other, _)| (*other as usize).cmp(&node));
        if let RowKind::Deficient(span) = kind {
            self.ranks[node] = span.rank;
            match at {
                Ok(at) => self.spans[at].1 = *span,
                Err(at) => {
                    let id = u32::try_from(node).unwrap_or(u32::MAX);
                    self.spans.insert(at, (id, *span));
                }
            }
        } else {
            self.ranks[node] = 3;
            if let Ok(at) = at {
                self.spans.remove(at);
            }
        }
    }

    /// Heap bytes that only cut bodies hold.
    pub(crate) fn cut_bytes(&self) -> usize {
        self.control_scales.capacity() * size_of::<f64>()
            + self.continuation.bytes()
            + self.bonds.bytes()
    }

    /// Heap bytes that only bodies hold whose stiffness is watched.
    pub(crate) fn watch_bytes(&self) -> usize {
        (self.inverse_masses.capacity() + self.gradient_squares.capacity()) * size_of::<f64>()
    }

    /// Heap bytes held.
    pub(crate) fn bytes(&self) -> usize {
        fn of<T>(v: &Vec<T>) -> usize {
            v.capacity() * size_of::<T>()
        }
        of(&self.rest)
            + of(&self.volumes)
            + of(&self.elastic_volumes)
            + of(&self.materials)
            + of(&self.prepared)
            + of(&self.material_of)
            + of(&self.fiber_directions)
            + self.viscosity.as_ref().map_or(0, Viscosity::bytes)
            + self.dilatation.as_ref().map_or(0, MeanDilatation::bytes)
            + self.cut_bytes()
            + self.watch_bytes()
            + of(&self.self_gradients)
            + of(&self.control)
            + of(&self.spans)
            + of(&self.ranks)
            + self.still.bytes()
            + self.fronts.bytes()
            + of(&self.moves)
            + of(&self.anchored)
            + of(&self.deformation)
            + of(&self.partial_energies)
            + of(&self.watches)
    }
}

/// A node's law: the list's, or one with the node's own fiber direction.
pub(crate) enum LawAt<'a> {
    Shared(&'a Prepared),
    Turned(Prepared),
}

impl LawAt<'_> {
    #[inline]
    pub(crate) fn get(&self) -> &Prepared {
        match self {
            Self::Shared(law) => law,
            Self::Turned(law) => law,
        }
    }
}

/// `A⁻¹` (xx, yy, zz, yz, zx, xy); `None` unless `A` is safely positive definite.
pub(crate) fn inverse_moment(a: DMat3) -> Option<[f64; 6]> {
    let floor = 1e-12 * (a.x_axis.x + a.y_axis.y + a.z_axis.z);
    let root = |pivot: f64| (pivot > floor && pivot > 0.0).then(|| pivot.sqrt());
    let l00 = root(a.x_axis.x)?;
    let (l10, l20) = (a.x_axis.y / l00, a.x_axis.z / l00);
    let l11 = root(a.y_axis.y - l10 * l10)?;
    let l21 = (a.y_axis.z - l20 * l10) / l11;
    let l22 = root(a.z_axis.z - l20 * l20 - l21 * l21)?;
    let l = DMat3::from_cols(
        DVec3::new(l00, l10, l20),
        DVec3::new(0.0, l11, l21),
        DVec3::new(0.0, 0.0, l22),
    );
    // The columns of L⁻¹ are the directions in which A is one.
    let [x, y, z] = l.inverse().to_cols_array_2d().map(DVec3::from_array);
    Some([x.dot(x), y.dot(y), z.dot(z), y.dot(z), z.dot(x), x.dot(y)])
}
