//! Control of the zero-energy modes at a crack front.
//!
//! Beside a front, rows of nodes on the two sides of a cut can slide along it against the rows next to
//! them: gradients of one-sided rows hardly see that, and the weak control that serves all other nodes
//! lets it be. Cracks that slide are then 15 to 25 % too soft at 4 to 8 spacings. What tells this mode
//! from a crack that opens and slides as it should is that it lives in the leftovers along the front's
//! conormal, so the few nodes at a front have a stronger control of those:
//!
//! `E_i = k_i / (1 + tr N_i) Σ_j w_ij e_ij · N_i e_ij`, `N_i = G_i M_i G_iᵀ`,
//! `k_i = β μ V_i / Σ_j w_ij |X_ij|²`
//!
//! with the weights `w_ij` and leftovers `e_ij = u_ij − (G_i − I) X_ij` of the zero-energy control,
//! `G_i = I + (Σ_j w_ij u_ij ⊗ X_ij) A_i⁻¹` the linear field nearest to the neighbours' and
//! `M_i = Σ ν νᵀ / count` of the unit conormals ν of the front at rest. At small strain it is
//! `k_i/2 Σ_j w_ij e_ij · M_i e_ij`. It turns with the body, vanishes for linear fields, and a
//! stretch of the front does not stiffen it beyond a factor of 2.

use glam::{DMat3, DVec3};

use crate::body::{Body, inverse_moment};
use crate::error::ElasticError;
use crate::kernel::Lanes;
use crate::law::{double_dot, outer};
use crate::model::{Elastic, with_table};
use crate::rows::Rows;

/// `β`, in units of the shear modulus. From 2.5 to 5 the work of sliding cracks at 4 spacings falls by
/// 7 to 8 %, that of opening ones by 0.6 %, that of tearing ones not at all.
const STRENGTH: f64 = 4.0;

/// Nodes at crack fronts, rising; empty for a body without any.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fronts(Vec<Front>);

#[derive(Debug, Clone)]
struct Front {
    node: u32,
    /// `1 / Σ_j w_ij |X_ij|²`.
    spread_inverse: f64,
    /// `M_i`.
    conormals: DMat3,
    links: Box<[Link]>,
    /// `G_i` where the forces were evaluated last.
    gradient: DMat3,
}

#[derive(Debug, Clone, Copy)]
struct Link {
    neighbor: u32,
    /// `w_ij`.
    weight: f64,
    /// `X_ij` (m).
    offset: DVec3,
    /// `Y_ij = A_i⁻¹ X_ij` (1/m), so that `G_i = I + Σ_j w_ij u_ij ⊗ Y_ij`.
    dual: DVec3,
    /// `e_ij` (m) where the forces were evaluated last.
    leftover: DVec3,
}

/// What the energy at a front and its derivatives share.
struct Sums {
    /// `G M`.
    gm: DMat3,
    /// `N = G M Gᵀ`.
    n: DMat3,
    /// `S = Σ w e eᵀ`.
    s: DMat3,
    /// `1 / (1 + tr N)`.
    share: f64,
    /// `S : N / (1 + tr N)`.
    mean: f64,
}

fn trace(a: DMat3) -> f64 {
    a.x_axis.x + a.y_axis.y + a.z_axis.z
}

impl Front {
    fn new<L: Lanes>(
        rows: &Rows<L>,
        rest: &[DVec3],
        node: u32,
        conormals: &[DVec3],
    ) -> Option<Self> {
        let row = rows.row(node as usize);
        let mut links = Vec::with_capacity(row.indices.len());
        let mut moment = DMat3::ZERO;
        for (&neighbor, pair) in row.indices.iter().zip(row.pairs) {
            let weight = L::weight(pair);
            if weight > 0.0 {
                let offset = rest[neighbor as usize] - rest[node as usize];
                moment += outer(offset, offset) * weight;
                links.push(Link {
                    neighbor,
                    weight,
                    offset,
                    dual: DVec3::ZERO,
                    leftover: DVec3::ZERO,
                });
            }
        }
        let [xx, yy, zz, yz, zx, xy] = inverse_moment(moment)?;
        let inverse = DMat3::from_cols(
            DVec3::new(xx, xy, zx),
            DVec3::new(xy, yy, yz),
            DVec3::new(zx, yz, zz),
        );
        for link in &mut links {
            link.dual = inverse * link.offset;
        }
        let mut sum = DMat3::ZERO;
        for &conormal in conormals {
            sum += outer(conormal, conormal);
        }
        #[allow(clippy::cast_precision_loss, reason = "a few per node")]
        let count = conormals.len() as f64;
        Some(Self {
            node,
            spread_inverse: trace(moment).recip(),
            conormals: sum * count.recip(),
            links: links.into(),
            gradient: DMat3::IDENTITY,
        })
    }

    /// Sums with the leftovers kept.
    fn sums(&self) -> Sums {
        let gm = self.gradient * self.conormals;
        let n = gm * self.gradient.transpose();
        let mut s = DMat3::ZERO;
        for link in &self.links {
            s += outer(link.leftover, link.leftover) * link.weight;
        }
        let share = (1.0 + trace(n)).recip();
        let mean = share * double_dot(s, n);
        Sums {
            gm,
            n,
            s,
            share,
            mean,
        }
    }

    /// `Σ_j w_ij v_ij ⊗ Y_ij` of the differences `v_ij`.
    fn gradient_of(&self, of: impl Fn(u32) -> DVec3) -> DMat3 {
        let own = of(self.node);
        let mut sum = DMat3::ZERO;
        for link in &self.links {
            sum += outer(of(link.neighbor) - own, link.dual) * link.weight;
        }
        sum
    }

    /// Takes over the state at displacements (m) and returns the energy over `k_i`, with
    /// `(node, force over k_i)` given to `add`.
    ///
    /// With `c = 2/(1 + tr N)` and `B = (S − S:N/(1 + tr N)) G M` the derivative by `u_ij` is
    /// `c w_ij (N e_ij + B Y_ij)`: that of `e_ij` by `G_i` drops out, as `Σ_j w_ij e_ij ⊗ X_ij = 0`.
    fn evaluate(&mut self, moved: impl Fn(u32) -> DVec3, mut add: impl FnMut(u32, DVec3)) -> f64 {
        let h = self.gradient_of(&moved);
        self.gradient = DMat3::IDENTITY + h;
        let own = moved(self.node);
        for link in &mut self.links {
            link.leftover = (moved(link.neighbor) - own) - h * link.offset;
        }
        let Sums {
            gm,
            n,
            s,
            share,
            mean,
        } = self.sums();
        let b = (s - DMat3::from_diagonal(DVec3::splat(mean))) * gm;
        let mut sum = DVec3::ZERO;
        for link in &self.links {
            let t = (n * link.leftover + b * link.dual) * (2.0 * share * link.weight);
            sum += t;
            add(link.neighbor, -t);
        }
        add(self.node, sum);
        mean
    }

    /// Gives `(node, product over k_i)` of the energy's second derivative with a vector to `add`.
    fn product(&self, vector: impl Fn(u32) -> DVec3, mut add: impl FnMut(u32, DVec3)) {
        let Sums {
            gm,
            n,
            s,
            share,
            mean,
        } = self.sums();
        let dg = self.gradient_of(&vector);
        let own = vector(self.node);
        let leftover = |link: &Link| (vector(link.neighbor) - own) - dg * link.offset;
        let mut ds = DMat3::ZERO;
        for link in &self.links {
            let half = outer(leftover(link), link.leftover) * link.weight;
            ds += half + half.transpose();
        }
        let half = gm * dg.transpose();
        let dn = half + half.transpose();
        let dmean = share * (double_dot(ds, n) + double_dot(s, dn) - mean * trace(dn));
        let scalar = |value: f64| DMat3::from_diagonal(DVec3::splat(value));
        let b = (s - scalar(mean)) * gm;
        let db = (ds - scalar(dmean)) * gm + (s - scalar(mean)) * (dg * self.conormals);
        let (c, dc) = (2.0 * share, -2.0 * share * share * trace(dn));
        let mut sum = DVec3::ZERO;
        for link in &self.links {
            let t = n * link.leftover + b * link.dual;
            let dt = dn * link.leftover + n * leftover(link) + db * link.dual;
            let dt = (dt * c + t * dc) * link.weight;
            sum += dt;
            add(link.neighbor, dt);
        }
        add(self.node, -sum);
    }
}

impl Fronts {
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn place(&self, node: u32) -> Result<usize, usize> {
        self.0.binary_search_by(|front| front.node.cmp(&node))
    }

    /// Forgets the fronts at some nodes, whose rows have changed.
    pub(crate) fn forget(&mut self, nodes: &[u32]) {
        for &node in nodes {
            if let Ok(at) = self.place(node) {
                self.0.remove(at);
            }
        }
    }

    /// Heap bytes held.
    pub(crate) fn bytes(&self) -> usize {
        let links = |front: &Front| front.links.len() * size_of::<Link>();
        self.0.capacity() * size_of::<Front>() + self.0.iter().map(links).sum::<usize>()
    }
}

/// `k_i`.
fn stiffness(body: &Body, front: &Front) -> f64 {
    let node = front.node as usize;
    STRENGTH * body.material(node).lame_mu() * body.elastic_volumes[node] * front.spread_inverse
}

/// Adds the forces (N) of the fronts at `positions` (m); returns their energy (J).
pub(crate) fn add_forces(body: &mut Body, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
    let mut fronts = std::mem::take(&mut body.fronts);
    let moved = |node: u32| positions[node as usize] - body.rest[node as usize];
    let mut energy = 0.0;
    for front in &mut fronts.0 {
        let k = stiffness(body, front);
        energy += k * front.evaluate(moved, |node, force| forces[node as usize] += force * k);
    }
    body.fronts = fronts;
    energy
}

/// Gives the rows of `K v` that are the fronts' to `add`, for the fronts at nodes that are `chosen`.
pub(crate) fn add_product(
    body: &Body,
    chosen: impl Fn(u32) -> bool,
    vector: impl Fn(u32) -> DVec3,
    mut add: impl FnMut(u32, DVec3),
) {
    for front in body.fronts.0.iter().filter(|front| chosen(front.node)) {
        let k = stiffness(body, front);
        front.product(&vector, |node, product| add(node, product * k));
    }
}

/// Per node the sum of absolute entries of a row of a matrix that is above the fronts' stiffness at
/// rest: `k_i Σ_j w_ij |u_ij|²` instead of the leftovers. Empty without fronts.
pub(crate) fn row_sums(body: &Body) -> Vec<f64> {
    if body.fronts.is_empty() {
        return Vec::new();
    }
    let mut sums = vec![0.0; body.node_count()];
    for front in &body.fronts.0 {
        let k = stiffness(body, front);
        for link in &front.links {
            for node in [front.node, link.neighbor] {
                sums[node as usize] += 2.0 * k * link.weight;
            }
        }
    }
    sums
}

impl Elastic {
    /// Says at which of some nodes a crack front passes, and with what conormals at rest; nodes
    /// not named stay as they are.
    ///
    /// A front passes at a node if a pair of it is weakened but not severed; its conormals are the
    /// directions, normal to the front and tangential to the cut, out of the cut, at the bends of
    /// these pairs' ways round it. Such a node has a stronger control of zero-energy modes along
    /// them, without which cracks that slide are 15 to 25 % too soft at 4 to 8 spacings. A node whose
    /// neighbours do not span space has none, nor has any node of a model without zero-energy
    /// control. [`Elastic::update_rows`] forgets the fronts at the nodes it is given: call this after
    /// it, and [`Elastic::forces_into`] before the next tangent product.
    ///
    /// # Arguments
    /// * `nodes` -- any nodes, each once.
    /// * `offsets` -- starts of their rows in `conormals`, from 0 on, shape `(nodes + 1)`; no front
    ///   passes at a node with an empty row.
    /// * `conormals` -- directions, of any length above zero.
    ///
    /// # Errors
    /// [`ElasticError::NotFinite`] if a conormal has no direction; nothing has changed then.
    ///
    /// # Panics
    /// If a node does not exist or the offsets do not fit.
    pub fn set_fronts(
        &mut self,
        nodes: &[u32],
        offsets: &[u32],
        conormals: &[DVec3],
    ) -> Result<(), ElasticError> {
        assert_eq!(offsets.len(), nodes.len() + 1, "offsets: nodes + 1");
        let mut unit = Vec::with_capacity(conormals.len());
        let rows = || nodes.iter().zip(offsets.windows(2));
        for (&node, row) in rows() {
            for conormal in &conormals[row[0] as usize..row[1] as usize] {
                let (what, node) = ("conormal", node as usize);
                let error = ElasticError::NotFinite { what, node };
                unit.push(conormal.try_normalize().ok_or(error)?);
            }
        }
        let body = &mut self.body;
        body.fronts.forget(nodes);
        if !body.controlled() {
            return Ok(());
        }
        with_table!(&self.pairs, table => {
            for (&node, row) in rows() {
                let row = &unit[row[0] as usize..row[1] as usize];
                if row.is_empty() || body.ranks[node as usize] < 3 {
                    continue;
                }
                let Some(front) = Front::new(&table.rows, &body.rest, node, row) else {
                    continue;
                };
                if let Err(at) = body.fronts.place(node) {
                    body.fronts.0.insert(at, front);
                }
            }
        });
        Ok(())
    }

    /// Number of nodes at which crack fronts are controlled; see [`Elastic::set_fronts`].
    #[must_use]
    pub fn front_count(&self) -> usize {
        self.body.fronts.0.len()
    }
}
