//! Linear viscoelasticity: a Prony series on the second Piola–Kirchhoff stress.

use glam::DMat3;

use crate::material::{MAX_PRONY_TERMS, Material};

/// One term of a Prony series: stress beyond that of the long term, `ratio · S`, which fades.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct PronyTerm {
    /// `beta`, stiffness of the term over that of the long term; 0 for no term.
    pub ratio: f64,
    /// `tau`: time (s) in which its stress falls to 1/e.
    #[cfg_attr(feature = "serde", serde(rename = "time"))]
    pub relaxation_time: f64,
}

impl PronyTerm {
    /// No term.
    pub const NONE: Self = Self {
        ratio: 0.0,
        relaxation_time: 1.0,
    };
}

/// Symmetric tensor: xx, yy, zz, xy, yz, zx.
type Symmetric = [f64; 6];

/// Overstresses and what a step makes of them.
///
/// With `S(F)` the long-term second Piola–Kirchhoff stress, term k obeys
/// `dQ_k/dt + Q_k/tau_k = beta_k dS/dt` (Simo 1987; Holzapfel 2000, ch. 6.10). A step of length dt
/// from `S_n`, `Q_k,n` gives `Q_k = e_k Q_k,n + beta_k a_k (S(F) - S_n)`, `e_k = exp(-dt/tau_k)`,
/// `a_k = exp(-dt/(2 tau_k))`. Within the step that is a potential: `P = m P_law(F) + F H` derives
/// from `m W(F) + H : E`, `m = 1 + sum beta_k a_k`, `H = sum e_k Q_k,n - beta_k a_k S_n`.
#[derive(Debug, Clone)]
pub(crate) struct Viscosity {
    terms: usize,
    /// `m` per material.
    factors: Vec<f64>,
    /// `e_k`, `beta_k a_k` per material and term.
    decays: Vec<[(f64, f64); MAX_PRONY_TERMS]>,
    /// `H` per node.
    held: Vec<Symmetric>,
    /// Per node: `S_n`, then `Q_k,n` for each term.
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
            history: vec![[0.0; 6]; node_count * (terms + 1)],
        })
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
        let stride = self.terms + 1;
        for (node, held) in self.held.iter_mut().enumerate() {
            let past = &self.history[node * stride..][..stride];
            *held = [0.0; 6];
            for ((fade, drive), overstress) in self.decays[material_of(node)].iter().zip(&past[1..])
            {
                for (k, held) in held.iter_mut().enumerate() {
                    *held += fade * overstress[k] - drive * past[0][k];
                }
            }
        }
    }

    /// Ends a step: `stress` is the long-term second Piola–Kirchhoff stress now.
    pub(crate) fn end_step(&mut self, node: usize, material: usize, stress: DMat3) {
        let now = pack(stress);
        let stride = self.terms + 1;
        let past = &mut self.history[node * stride..][..stride];
        let Some((last, overstresses)) = past.split_first_mut() else {
            return;
        };
        for ((fade, drive), overstress) in self.decays[material].iter().zip(overstresses) {
            for k in 0..6 {
                overstress[k] = fade * overstress[k] + drive * (now[k] - last[k]);
            }
        }
        *last = now;
    }

    #[inline]
    pub(crate) fn energy_and_stress(
        &self,
        node: usize,
        material: usize,
        f: DMat3,
        energy: f64,
        stress: DMat3,
    ) -> (f64, DMat3) {
        let held = unpack(&self.held[node]);
        let factor = self.factors[material];
        let green = (f.transpose() * f - DMat3::IDENTITY) * 0.5;
        let work = green.x_axis.dot(held.x_axis)
            + green.y_axis.dot(held.y_axis)
            + green.z_axis.dot(held.z_axis);
        (energy * factor + work, stress * factor + f * held)
    }

    #[inline]
    pub(crate) fn stress_change(
        &self,
        node: usize,
        material: usize,
        df: DMat3,
        change: DMat3,
    ) -> DMat3 {
        change * self.factors[material] + df * unpack(&self.held[node])
    }

    pub(crate) fn history(&self) -> &[[f64; 6]] {
        &self.history
    }

    pub(crate) fn set_history(&mut self, history: &[[f64; 6]]) {
        assert_eq!(
            history.len(),
            self.history.len(),
            "history of another model"
        );
        self.history.copy_from_slice(history);
    }

    pub(crate) fn bytes(&self) -> usize {
        (self.held.capacity() + self.history.capacity()) * size_of::<Symmetric>()
            + self.factors.capacity() * size_of::<f64>()
            + self.decays.capacity() * size_of::<[(f64, f64); MAX_PRONY_TERMS]>()
    }
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
