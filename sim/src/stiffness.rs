//! The largest eigenvalue of a body as it moves, for the step: where stiffness rises it is estimated again.

use glam::DVec3;
use phyxel_elastic::{Part, StiffNode};
use phyxel_integrate::{
    Alarm, Eigenvalue, EigenvalueError, EigenvalueSettings, largest_eigenvalue,
    largest_eigenvalue_within,
};

use crate::body::{Body, first_estimate};
use crate::error::BodyProblem;

/// Nodes around which the largest eigenvalue is looked for, two rings of neighbours each, and products
/// with the stiffness of that part.
const STIFFEST_NODES: usize = 8;
const LOCAL_PRODUCTS: usize = 12;

/// Stiffest mode of a part of a body.
#[derive(Debug)]
pub(crate) struct PartMode {
    /// Its eigenvalue (1/s²).
    pub(crate) value: f64,
    /// The vector, one entry per node of the part.
    vector: Vec<DVec3>,
}

/// An estimate by so many products.
fn estimate(products: usize) -> EigenvalueSettings {
    EigenvalueSettings {
        iterations: products,
        ..first_estimate()
    }
}

impl Body {
    /// Estimates the largest eigenvalue where the body is now: by products with the whole, from the
    /// vector of the last time, and by those with what surrounds its stiffest nodes.
    /// Shares that were handed what has changed here make the first.
    pub(crate) fn estimate_eigenvalue(&mut self, products: usize) -> Result<(), BodyProblem> {
        let settings = estimate(products);
        let found = match &mut self.shared {
            Some(shared) if shared.is_handed() => shared.estimate(&self.eigenvector, &settings)?,
            _ => {
                self.fetch_vector();
                self.turned_here();
                self.whole_eigenvalue(&settings)?
            }
        };
        self.stiffness.take_whole(found.value);
        let stiffest = self.stiffest_nodes(STIFFEST_NODES, None);
        self.estimate_around(&stiffest)
    }

    /// The same of the whole where the model was evaluated, from the vector of the last time.
    pub(crate) fn whole_eigenvalue(
        &mut self,
        settings: &EigenvalueSettings,
    ) -> Result<Eigenvalue, EigenvalueError> {
        let elastic = &mut self.elastic;
        largest_eigenvalue(
            &self.masses,
            self.motion.supports(),
            |v, out| elastic.tangent_product_into(v, out),
            &mut self.eigenvector,
            settings,
        )
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
        let mut around: Vec<u32> = Vec::new();
        let mut seeds = Vec::new();
        for stiff in stiffest {
            seeds.push((stiff.node, stiff.direction));
            for &near in self.neighborhoods.row(stiff.node as usize) {
                around.push(near);
                around.extend(self.neighborhoods.row(near as usize));
            }
            around.push(stiff.node);
        }
        if seeds.is_empty() {
            return Ok(());
        }
        let part = self.elastic.part(&around);
        self.fetch_part(&part);
        let start = self.seeded(&part, &seeds);
        let found = self.part_eigenvalue(&part, start, LOCAL_PRODUCTS)?;
        self.stiffness.take_local(found.value);
        Ok(())
    }

    /// Stiff nodes against their neighbours, one entry per node of a part.
    fn seeded(&self, part: &Part, seeds: &[(u32, DVec3)]) -> Vec<DVec3> {
        let weights = &self.stencils.weights;
        let mut start = vec![DVec3::ZERO; part.nodes().len()];
        let mut add = |node: u32, value: DVec3| {
            if let Ok(at) = part.nodes().binary_search(&node) {
                start[at] += value;
            }
        };
        for &(node, direction) in seeds {
            let row = &weights[self.neighborhoods.pairs(node as usize)];
            let sum: f64 = row.iter().sum();
            add(node, direction);
            for (&other, weight) in self.neighborhoods.row(node as usize).iter().zip(row) {
                if *weight > 0.0 {
                    add(other, -direction * (weight / sum));
                }
            }
        }
        start
    }

    /// Estimates the largest eigenvalue of a part where the body is now, all other nodes fixed, from a
    /// vector to start with, or none.
    pub(crate) fn part_eigenvalue(
        &mut self,
        part: &Part,
        mut vector: Vec<DVec3>,
        products: usize,
    ) -> Result<PartMode, BodyProblem> {
        let elastic = &mut self.elastic;
        let found = largest_eigenvalue_within(
            part.nodes(),
            &self.masses,
            self.motion.supports(),
            |v, out| elastic.tangent_product_within(part, v, out),
            &mut vector,
            &estimate(products),
        )?;
        Ok(PartMode {
            value: found.value,
            vector,
        })
    }

    /// Takes the eigenvalue of a part for the step if it is above that of the whole as last estimated;
    /// the next estimate of the whole then starts with the part's vector in it.
    pub(crate) fn take_part_eigenvalue(&mut self, part: &Part, mode: &PartMode) {
        if mode.value <= self.current_eigenvalue() {
            return;
        }
        self.stiffness.estimates[1] = mode.value;
        self.fetch_vector();
        self.turned_here();
        for (&node, part) in part.nodes().iter().zip(&mode.vector) {
            // A snapshot may have no vector.
            if let Some(whole) = self.eigenvector.get_mut(node as usize) {
                *whole += *part;
            }
        }
    }
}
