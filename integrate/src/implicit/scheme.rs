//! Forces and tangents as an implicit scheme takes them.

use crate::law::ForceLaw;
use glam::{DMat3, DVec3};

/// A force law as a scheme takes it, by positions at the end: as it is, or with forces at the middle, which
/// are the gradient of twice the energy there.
pub(super) struct SchemeLaw<'a> {
    pub(super) law: &'a mut dyn ForceLaw,
    pub(super) start: Option<&'a [DVec3]>,
    pub(super) middle: Vec<DVec3>,
    /// Forces (N) last evaluated.
    pub(super) forces: Vec<DVec3>,
}

impl ForceLaw for SchemeLaw<'_> {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let Some(start) = self.start else {
            return self.law.forces_into(positions, forces);
        };
        let pairs = positions.iter().zip(start);
        self.middle.clear();
        self.middle
            .extend(pairs.map(|(x, start)| x.midpoint(*start)));
        let energy = self.law.forces_into(&self.middle, forces);
        self.forces.clear();
        self.forces.extend_from_slice(forces);
        2.0 * energy
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        self.law.tangent_product_into(vector, product);
        if self.start.is_some() {
            crate::vector::scale_by(product, 0.5);
        }
    }

    fn tangent_blocks_into(&mut self, blocks: &mut [DMat3]) -> bool {
        let known = self.law.tangent_blocks_into(blocks);
        if known && self.start.is_some() {
            blocks.iter_mut().for_each(|block| *block *= 0.5);
        }
        known
    }
}
