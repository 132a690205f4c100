//! What each part of the model costs.

use std::mem::size_of_val;

use crate::phases::Phase;
use crate::{Member, World};

/// A part of the model of one body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct PartCost {
    /// Name in reports.
    pub name: &'static str,
    /// Heap bytes; 0 where the scene does not need it.
    pub bytes: usize,
    /// The phase whose time is this part's alone; `None` if it shares its phase with others.
    pub phase: Option<Phase>,
}

impl Member {
    /// Every part that a body's model can have, in the order of a step, those that are off included.
    #[must_use]
    pub fn parts(&self) -> Vec<PartCost> {
        let body = &self.body;
        let part = |name, bytes, phase| PartCost { name, bytes, phase };
        let moving = body.motion.bytes();
        let graph = &body.neighborhoods;
        let elastic = body.elastic.bytes();
        vec![
            part(
                "nodes",
                size_of_val(&*body.rest)
                    + size_of_val(&*body.volumes)
                    + size_of_val(&*body.masses)
                    + size_of_val(&*body.tetrahedra),
                None,
            ),
            part(
                "neighbours",
                size_of_val(graph.offsets()) + size_of_val(graph.indices()),
                None,
            ),
            part("stencils", body.stencils.bytes(), None),
            part(
                "elasticity",
                elastic.all - elastic.held - elastic.cuts - elastic.watch - elastic.viscosity,
                Some(Phase::Forces),
            ),
            part("viscosity", elastic.viscosity, None),
            part(
                "motion",
                moving.state + size_of_val(&*body.eigenvector) + elastic.watch,
                Some(Phase::Integration),
            ),
            part("supports", moving.supports + elastic.held, None),
            part("gravity", moving.loads, None),
            part("viscous damping", moving.viscous, None),
            part(
                "contact",
                self.contact_bytes() + moving.applied,
                Some(Phase::Contact),
            ),
            part(
                "cuts",
                self.cutting.as_ref().map_or(0, crate::Cutting::bytes) + elastic.cuts,
                Some(Phase::Cut),
            ),
        ]
    }
}

impl World {
    /// Parts of all bodies together.
    #[must_use]
    pub fn parts(&self) -> Vec<PartCost> {
        let mut members = self.members.iter().map(Member::parts);
        let mut all = members.next().unwrap_or_default();
        for parts in members {
            for (sum, part) in all.iter_mut().zip(parts) {
                sum.bytes += part.bytes;
            }
        }
        let contact = self.deformable.as_ref().map_or(0, |all| all.bytes());
        let own = all.iter_mut().find(|part| part.name == "contact");
        own.into_iter().for_each(|part| part.bytes += contact);
        all
    }
}
