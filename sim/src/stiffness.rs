//! The largest eigenvalue of a body as it moves, for the step: where stiffness rises it is estimated again.

use glam::DVec3;
use phyxel_elastic::{Part, StiffNode};
use phyxel_integrate::{Alarm, EigenvalueSettings, largest_eigenvalue_within};

use crate::body::Body;
use crate::error::BodyProblem;

/// Nodes around which the largest eigenvalue is looked for, two rings of neighbours each.
const STIFFEST_NODES: usize = 8;
/// Products with the stiffness of a part per estimate, and with that of a body that is another than at the last one.
pub(crate) const PRODUCTS: usize = 16;

/// Room above the power iteration's estimate, which comes from below.
const MARGIN: f64 = 0.05;

/// How an eigenvalue is estimated: by so many products, by as many as it takes of a body at rest.
pub(crate) fn estimate(products: Option<usize>) -> EigenvalueSettings {
    let usual = EigenvalueSettings::default();
    EigenvalueSettings {
        iterations: products.unwrap_or(usual.iterations),
        margin: MARGIN,
        ..usual
    }
}

impl Body {
    /// Estimates the largest eigenvalue where the body is now: by products with the whole, from the
    /// vector of the last time, and by those with what surrounds its stiffest nodes.
    pub(crate) fn estimate_eigenvalue(&mut self, products: usize) -> Result<(), BodyProblem> {
        let found = self.whole_eigenvalue(&estimate(Some(products)))?;
        self.stiffness.take_whole(found.value);
        let stiffest = self.stiffest_nodes(STIFFEST_NODES, None);
        self.estimate_around(&stiffest)
    }

    /// Estimates again where stiffness has risen since the last estimate, or everywhere when it has fallen;
    /// whether either is so.
    pub(crate) fn follow_stiffness(&mut self) -> Result<bool, BodyProblem> {
        let indicators = self.stiffness_indicators();
        let stiffest = match self.stiffness.follow(indicators) {
            None => return Ok(false),
            Some(Alarm::Fell) => self.stiffest_nodes(STIFFEST_NODES, None),
            Some(Alarm::Rose(runs)) => self.stiffest_nodes(STIFFEST_NODES, Some(&runs)),
        };
        self.estimate_around(&stiffest)?;
        Ok(true)
    }

    /// Estimates the largest eigenvalue of what surrounds stiff nodes, all others held: where
    /// stiffness rises it does so at few nodes, and the vector of the whole may know nothing of them.
    /// What was found elsewhere stays.
    fn estimate_around(&mut self, stiffest: &[StiffNode]) -> Result<(), BodyProblem> {
        if stiffest.is_empty() {
            return Ok(());
        }
        let (part, mut vector) = self.whole.part_around(stiffest);
        let found = self.part_eigenvalue(&part, &mut vector, PRODUCTS)?;
        self.stiffness.take_local(found);
        Ok(())
    }

    /// Estimates the largest eigenvalue (1/s²) of a part where the body is now, all other nodes fixed, from a vector with
    /// one entry per node of the part, or none, and leaves its mode there.
    pub(crate) fn part_eigenvalue(
        &mut self,
        part: &Part,
        vector: &mut Vec<DVec3>,
        products: usize,
    ) -> Result<f64, BodyProblem> {
        let (elastic, motion) = self.whole.as_it_is();
        let found = largest_eigenvalue_within(
            part.nodes(),
            &self.masses,
            motion.supports(),
            |v, out| elastic.tangent_product_within(part, v, out),
            vector,
            &estimate(Some(products)),
        )?;
        Ok(found.value)
    }

    /// Takes the eigenvalue (1/s²) of a part for the step if it is above that of the whole as last estimated;
    /// the next estimate of the whole then starts with the part's mode in it.
    pub(crate) fn take_part_eigenvalue(&mut self, part: &Part, eigenvalue: f64, mode: &[DVec3]) {
        if eigenvalue <= self.current_eigenvalue() {
            return;
        }
        self.stiffness.estimates[1] = eigenvalue;
        let vector = self.whole.eigenvector_mut();
        for (&node, part) in part.nodes().iter().zip(mode) {
            // A snapshot may have no vector.
            if let Some(whole) = vector.get_mut(node as usize) {
                *whole += *part;
            }
        }
    }
}
