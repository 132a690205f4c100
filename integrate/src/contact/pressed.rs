//! A force law with contacts added.

use super::{Contact, ContactForce, Limit};
use crate::law::ForceLaw;
use crate::shape::{Pose, RigidShape};
use glam::{DMat3, DVec3};

/// A force law with contacts added, for static and implicit solutions.
///
/// Friction acts with the limits of the last [`Contact::lag_friction`] or
/// [`Contact::settle_friction`] (lagged, so that forces stay the gradient of a potential: Li 2020,
/// section 5); points that touched after that slide freely until the next.
#[derive(Debug)]
pub struct Pressed<'a, L> {
    /// The body's own law.
    pub law: L,
    /// Contact, shape and pose of each tool.
    pub contacts: Vec<(&'a mut Contact, RigidShape, Pose)>,
    /// Forces on the tools at the last evaluation.
    pub tool_forces: Vec<ContactForce>,
}

impl<'a, L: ForceLaw> Pressed<'a, L> {
    /// One body, one tool.
    pub fn new(law: L, contact: &'a mut Contact, shape: RigidShape, pose: Pose) -> Self {
        Self {
            law,
            contacts: vec![(contact, shape, pose)],
            tool_forces: Vec::new(),
        }
    }
}

impl<L: ForceLaw> ForceLaw for Pressed<'_, L> {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let mut energy = self.law.forces_into(positions, forces);
        self.tool_forces.clear();
        for (contact, shape, pose) in &mut self.contacts {
            let sum = contact.add_all(shape, pose, positions, forces, Some(Limit::Lagged));
            energy += sum.energy;
            self.tool_forces.push(sum);
        }
        energy
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        self.law.tangent_product_into(vector, product);
        for (contact, _, _) in &self.contacts {
            contact.add_tangent_product(vector, product);
        }
    }

    fn tangent_blocks_into(&mut self, blocks: &mut [DMat3]) -> bool {
        let known = self.law.tangent_blocks_into(blocks);
        if known {
            for (contact, _, _) in &self.contacts {
                contact.add_blocks(blocks);
            }
        }
        known
    }
}
