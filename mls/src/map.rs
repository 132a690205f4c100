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

use crate::error::{CloudError, MapError};
use crate::neighborhoods::Neighborhoods;
use crate::search::{BallTree, check, positive};
pub use frame::{MapFrame, Preimage};

/// Connection to the start node is followed through nodes whose support, enlarged by this factor,
/// holds the point: paths around a notch count if they stay this near.
const ENLARGED: f64 = 1.5;

/// The part of the map that does not move: rest positions, supports and who is connected to whom.
///
/// Only nodes that the start node reaches without leaving the neighbourhood and over pairs that are
/// not severed take part in an answer, so the two flanks of an open cut do not mix.
#[derive(Debug, Clone)]
pub struct MaterialMap {
    rest_positions: Vec<DVec3>,
    support_radii: Vec<f64>,
    neighborhoods: Neighborhoods,
    severed: Vec<bool>,
    /// Supports enlarged by [`ENLARGED`].
    supports: BallTree,
}

impl MaterialMap {
    /// Heap bytes held, but for the search tree's, which takes some 80 a node more.
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
        check(rest_positions)?;
        Ok(Self {
            rest_positions: rest_positions.to_vec(),
            support_radii: support_radii.to_vec(),
            neighborhoods: neighborhoods.clone(),
            severed: vec![false; neighborhoods.pair_count()],
            supports: BallTree::new(rest_positions, support_radii.iter().map(|h| h * ENLARGED)),
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
