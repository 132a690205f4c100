//! From world points back to material points, and forth.
//!
//! A deformed body carries a material point X to `x(X) = X + u(X)`,
//! `u(X) = Σ_i w_i(X) (u_i + (F_i − I)(X − X_i)) / Σ_i w_i(X)`, `w_i(X) = w(|X − X_i| / h_i)`
//! (Aras 2014, eqs. (60)–(61)). The inverse has the unknown X inside the weights, so Aras (2014)'s
//! one-shot solution (eq. (62)) is only a first guess: here Newton's method is run on
//! `X + u(X) − x = 0` to convergence.

mod frame;
#[cfg(test)]
mod tests;

use glam::DVec3;

use crate::search::{PointRuns, positive};
use crate::{CloudError, MapError, Neighborhoods};
pub use frame::{MapFrame, Preimage};

/// Connection to the start node is followed through nodes whose support, enlarged by this factor,
/// holds the point: paths around a notch count if they stay this near.
const ENLARGED: f64 = 1.5;

/// The part of the map that does not move: rest positions, supports and who is connected to whom.
///
/// Only nodes that the start node reaches without leaving the neighbourhood and over pairs that are
/// not severed take part in an answer, so the two flanks of an open cut do not mix.
///
/// # Examples
/// ```
/// use phyxel_mls::glam::{DMat3, DVec3};
/// use phyxel_mls::{MaterialMap, within_radius};
///
/// // A lattice of nodes, stretched twofold along x.
/// let at = |k: u32| DVec3::new(f64::from(k % 4), f64::from(k / 4 % 4), f64::from(k / 16));
/// let rest: Vec<DVec3> = (0..64).map(at).collect();
/// let map = MaterialMap::new(&rest, &[2.0; 64], &within_radius(&rest, 1.5)?)?;
/// let stretch = DMat3::from_diagonal(DVec3::new(2.0, 1.0, 1.0));
/// let world: Vec<DVec3> = rest.iter().map(|x| stretch * *x).collect();
/// let gradients = [stretch; 64];
/// let frame = map.frame(&world, &gradients)?;
/// let found = frame.preimage(DVec3::new(2.2, 1.3, 0.6), &|_, _| true);
/// assert!(found.is_some_and(|found| (found.position - DVec3::new(1.1, 1.3, 0.6)).length() < 1e-9));
/// assert!(frame.preimage(DVec3::splat(9.0), &|_, _| true).is_none()); // no tissue
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct MaterialMap {
    rest_positions: Vec<DVec3>,
    support_radii: Vec<f64>,
    neighborhoods: Neighborhoods,
    severed: Vec<bool>,
    /// The largest of the support radii.
    reach: f64,
    /// Around the rest positions.
    runs: PointRuns,
}

impl MaterialMap {
    /// Heap bytes held, but for the boxes around runs of nodes, which take a byte a node more.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.rest_positions)
            + size_of_val(&*self.support_radii)
            + size_of_val(self.neighborhoods.offsets())
            + size_of_val(self.neighborhoods.indices())
            + size_of_val(&*self.severed)
    }

    /// Prepares the map of an uncut cloud.
    ///
    /// # Arguments
    /// * `rest_positions` -- X (m), shape `(n)`.
    /// * `support_radii` -- h (m), shape `(n)`, positive. About twice the mean distance to the
    ///   neighbours ([`crate::mean_neighbor_distance`]) covers the body well.
    /// * `neighborhoods` -- who is connected to whom.
    ///
    /// # Errors
    /// [`MapError`] for an empty cloud, a list of the wrong length, a position that is not finite, or a
    /// radius that is not positive.
    pub fn new(
        rest_positions: &[DVec3],
        support_radii: &[f64],
        neighborhoods: &Neighborhoods,
    ) -> Result<Self, MapError> {
        neighborhoods.check_nodes("rest positions", rest_positions.len())?;
        neighborhoods.check_nodes("support radii", support_radii.len())?;
        if rest_positions.is_empty() {
            return Err(CloudError::Empty.into());
        }
        for &radius in support_radii {
            positive("a support radius", radius)?;
        }
        Ok(Self {
            rest_positions: rest_positions.to_vec(),
            support_radii: support_radii.to_vec(),
            neighborhoods: neighborhoods.clone(),
            severed: vec![false; neighborhoods.pair_count()],
            reach: support_radii.iter().copied().fold(0.0, f64::max),
            runs: PointRuns::new(rest_positions)?,
        })
    }

    /// Takes pair factors in: a pair with factor 0 no longer connects.
    ///
    /// `factor` is called for the pairs of the rows of `touched`.
    ///
    /// # Panics
    /// If a touched node is out of range.
    pub fn update_rows(&mut self, factor: impl Fn(usize) -> f64, touched: &[u32]) {
        for &node in touched {
            for pair in self.neighborhoods.pairs(node as usize) {
                self.severed[pair] = factor(pair) <= 0.0;
            }
        }
    }
}
