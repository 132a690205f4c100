//! Linear viscoelasticity: a Prony series on the second Piola–Kirchhoff stress.

use glam::DMat3;

use crate::law::material::Material;
use crate::law::prony::MAX_PRONY_TERMS;

/// Symmetric tensor: xx, yy, zz, xy, yz, zx.
type Symmetric = [f64; 6];

const _: () = assert!(
    MAX_PRONY_TERMS < 6,
    "a row holds the energies of the law and of each term"
);

/// Overstresses and what a step makes of them.
///
/// With `S(F)` the long-term second Piola–Kirchhoff stress without what resists a change of volume alone, term k obeys
/// `dQ_k/dt + Q_k/tau_k = beta_k dS/dt` (Simo 1987; Holzapfel 2000, ch. 6.10). A step of length dt
/// from `S_n`, `Q_k,n` gives `Q_k = e_k Q_k,n + beta_k a_k (S(F) - S_n)`, `e_k = exp(-dt/tau_k)`,
/// `a_k = exp(-dt/(2 tau_k))`. Within the step that is a potential: what the terms add, `(m - 1) P(F) + F H`, derives
/// from `(m - 1) W(F) + H : E`, `m = 1 + sum beta_k a_k`, `H = sum e_k Q_k,n - beta_k a_k S_n`, with `W` and `P` of that
/// part of the law. (With `S` of all of it, tissue that had relaxed under a tension of a few shear moduli had `m W + H : E`
/// without a lower bound: it could be sheared for ever.)
///
/// What term k stores, `Y_k`, obeys `dY_k/dt = Q_k : dE/dt - 2 Y_k/tau_k`; the last term is the loss. A step gives
/// `Y_k = e_k² Y_k,n + a_k w_k` with the exact work of the term,
/// `w_k = beta_k a_k (W - W_n) + (e_k Q_k,n - beta_k a_k S_n) : (E - E_n)`. The energy density within a step is
/// that of the law and `sum e_k² Y_k,n + (m - 1) (W - W_n) + H : (E - E_n)`, between steps `sum Y_k`.
///
/// For a law linear in `E`, `Y_k = beta_k/2 x : C : x` with the term's own strain `x = e_k x_n + a_k (E - E_n)`, and
/// no step gains. Beyond that a term that followed a law which softens could give more than it took: it ends, `Q_k = 0` and
/// `Y_k = 0`, in the step in which it has given all, and begins again. What the step gave too much, of the order of its
/// square, is a negative loss. (Without, a drawn-out strand of a viscous body made ten times what was stored.)
#[derive(Debug, Clone)]
pub(crate) struct Viscosity {
    terms: usize,
    /// `m` per material.
    factors: Vec<f64>,
    /// `e_k`, `beta_k a_k` per material and term.
    decays: Vec<[(f64, f64); MAX_PRONY_TERMS]>,
    /// `H` per node.
    held: Vec<Symmetric>,
    /// Constant of the energy density per node.
    base: Vec<f64>,
    /// Per node: `S_n`, then `Q_k,n` for each term, `E_n`, and `W_n` followed by the `Y_k,n`.
    history: Vec<Symmetric>,
}

impl Viscosity {
    /// `None` if no material has a viscous part.
    pub(crate) fn new(materials: &[Material], node_count: usize) -> Option<Self> {
        let terms = materials.iter().map(Material::prony_count).max()?;
        (terms > 0).then(|| Self {
            terms,
            factors: vec![1.0; materials.len()],
            decays: vec![[(0.0, 0.0); MAX_PRONY_TERMS]; materials.len()],
            held: vec![[0.0; 6]; node_count],
            base: vec![0.0; node_count],
            history: vec![[0.0; 6]; node_count * (terms + 3)],
        })
    }

    fn stride(&self) -> usize {
        self.terms + 3
    }

    /// `sum Y_k` of a node.
    pub(crate) fn stored(&self, node: usize) -> f64 {
        let [_, stored @ ..] = self.history[(node + 1) * self.stride() - 1];
        stored.iter().sum()
    }

    pub(crate) fn begin_step(
        &mut self,
        time_step: f64,
        materials: &[Material],
        material_of: impl Fn(usize) -> usize,
    ) {
        for (index, material) in materials.iter().enumerate() {
            let mut factor = 1.0;
            for (decay, term) in self.decays[index].iter_mut().zip(&material.prony) {
                let fade = (-time_step / term.relaxation_time).exp();
                let drive = term.ratio * (-0.5 * time_step / term.relaxation_time).exp();
                *decay = (fade, drive);
                factor += drive;
            }
            self.factors[index] = factor;
        }
        let (terms, stride) = (self.terms, self.stride());
        for (node, held) in self.held.iter_mut().enumerate() {
            let past = &self.history[node * stride..][..stride];
            let [law, stored @ ..] = &past[terms + 2];
            *held = [0.0; 6];
            let material = material_of(node);
            let mut base = law * (1.0 - self.factors[material]);
            let decays = self.decays[material].iter().zip(&past[1..=terms]);
            for (((fade, drive), overstress), stored) in decays.zip(stored) {
                for (k, held) in held.iter_mut().enumerate() {
                    *held += fade * overstress[k] - drive * past[0][k];
                }
                base += fade * fade * stored;
            }
            self.base[node] = base - contract(held, &past[terms + 1]);
        }
    }

    /// Ends a step at `F`: `energy` and `stress` are of the law's part, the second Piola–Kirchhoff stress.
    pub(crate) fn end_step(
        &mut self,
        node: usize,
        material: usize,
        f: DMat3,
        (energy, stress): (f64, DMat3),
    ) {
        let (now, strain) = (pack(stress), pack(green(f)));
        let (terms, stride) = (self.terms, self.stride());
        let past = &mut self.history[node * stride..][..stride];
        let (stresses, [last_strain, energies]) = past.split_at_mut(terms + 1) else {
            return;
        };
        let change: Symmetric = std::array::from_fn(|k| strain[k] - last_strain[k]);
        let Some((last, overstresses)) = stresses.split_first_mut() else {
            return;
        };
        let [law, stored @ ..] = energies;
        let decays = self.decays[material].iter().zip(overstresses);
        for (((fade, drive), overstress), stored) in decays.zip(stored) {
            let held: Symmetric = std::array::from_fn(|k| fade * overstress[k] - drive * last[k]);
            let work = drive * (energy - *law) + contract(&held, &change);
            *stored = fade * fade * *stored + fade.sqrt() * work;
            for k in 0..6 {
                overstress[k] = fade * overstress[k] + drive * (now[k] - last[k]);
            }
            if *stored < 0.0 {
                (*stored, *overstress) = (0.0, [0.0; 6]);
            }
        }
        (*last, *last_strain, *law) = (now, strain, energy);
    }

    /// What the terms add to the law's energy and stress, from those of its part.
    #[inline]
    pub(crate) fn energy_and_stress(
        &self,
        node: usize,
        material: usize,
        f: DMat3,
        (energy, stress): (f64, DMat3),
    ) -> (f64, DMat3) {
        let held = unpack(&self.held[node]);
        let factor = self.factors[material] - 1.0;
        let work = contract(&self.held[node], &pack(green(f)));
        let energy = energy * factor + work + self.base[node];
        (energy, stress * factor + f * held)
    }

    /// What they add to the change of the stress, from that of its part.
    #[inline]
    pub(crate) fn stress_change(
        &self,
        node: usize,
        material: usize,
        df: DMat3,
        change: DMat3,
    ) -> DMat3 {
        change * (self.factors[material] - 1.0) + df * unpack(&self.held[node])
    }

    pub(crate) fn history(&self) -> &[[f64; 6]] {
        &self.history
    }

    pub(crate) fn set_history(&mut self, history: &[[f64; 6]]) {
        let rows = self.history.len();
        assert_eq!(history.len(), rows, "history of another model");
        self.history.copy_from_slice(history);
    }

    pub(crate) fn bytes(&self) -> usize {
        (self.held.capacity() + self.history.capacity()) * size_of::<Symmetric>()
            + (self.factors.capacity() + self.base.capacity()) * size_of::<f64>()
            + self.decays.capacity() * size_of::<[(f64, f64); MAX_PRONY_TERMS]>()
    }
}

/// `E`.
fn green(f: DMat3) -> DMat3 {
    (f.transpose() * f - DMat3::IDENTITY) * 0.5
}

/// `A : B`.
fn contract(a: &Symmetric, b: &Symmetric) -> f64 {
    let product = |k: usize| a[k] * b[k];
    product(0) + product(1) + product(2) + 2.0 * (product(3) + product(4) + product(5))
}

fn pack(m: DMat3) -> Symmetric {
    [
        m.x_axis.x,
        m.y_axis.y,
        m.z_axis.z,
        0.5 * (m.x_axis.y + m.y_axis.x),
        0.5 * (m.y_axis.z + m.z_axis.y),
        0.5 * (m.z_axis.x + m.x_axis.z),
    ]
}

fn unpack(s: &Symmetric) -> DMat3 {
    let [xx, yy, zz, xy, yz, zx] = *s;
    DMat3::from_cols_array(&[xx, xy, zx, xy, yy, yz, zx, yz, zz])
}
