//! A rigid sphere pressed into a block: `phyxel-integrate`'s contact and static solver on
//! `phyxel-elastic`'s forces, against finite elements of the same block, and against Hertz.
use super::Proof;
use crate::problems::indentation::{Press, SMALL, SPHERES, cube, graded, half_space, hertz_radius};
use crate::problems::reference::{Known, Reference};
use glam::DVec3;

/// Relative errors against the reference; supports carry what acts on the tool.
fn errors(mut press: Press, known: &[Known]) -> Vec<f64> {
    let mut errors = Vec::new();
    for ((radius, depth), known) in SPHERES.into_iter().zip(known) {
        let found = press.press(radius / SMALL, depth * SMALL, 1e-10).unwrap();
        let error = found.force / (known.force * SMALL) - 1.0;
        let reaction: DVec3 = found.report.reactions.iter().map(|(_, f)| *f).sum();
        let off = (reaction.z - found.force).abs();
        assert!(off < 1e-8 * found.force, "{reaction} {}", found.force);
        let last = found.report.steps.last().unwrap();
        assert!(last.relative_residual() < 1e-10, "{last:?}");
        errors.push(error);
    }
    errors
}

pub(super) fn indentation(proof: &mut Proof) {
    let mut reference = Reference::new([12, 16]).unwrap();
    let known = SPHERES.map(|(radius, depth)| reference.press(radius, depth).unwrap());
    for known in &known {
        // The finer lattice has six to nine of its nodes' distances in the contact radius; what is left of
        // it in the extrapolated force is some of what was taken off.
        proof.within("fine reference", known.fine / known.force, 1.0, 0.02);
        proof.within("coarse reference", known.coarse / known.force, 1.0, 0.05);
    }
    // The extrapolated force is trusted to half of what extrapolation took off the finer lattice's.
    let doubts = known
        .each_ref()
        .map(|known| 0.5 * (known.fine / known.force - 1.0).abs());
    let within = |proof: &mut Proof, name: &str, errors: &[f64], bound: f64| {
        for (error, doubt) in errors.iter().zip(&doubts) {
            proof.below(format!("error, {name}"), error.abs(), bound + doubt);
        }
    };
    let found = errors(cube(14).unwrap(), &known);
    within(proof, "even, 14 cells", &found, 0.05);
    let found = errors(cube(17).unwrap(), &known);
    within(proof, "even, 17 cells", &found, 0.03);
    for cells in [[10, 10, 10], [10, 10, 12], [11, 11, 11]] {
        let found = errors(graded(cells).unwrap(), &known);
        within(proof, &format!("graded {cells:?}"), &found, 0.03);
    }
}

pub(super) fn hertz_quarter(proof: &mut Proof) {
    let depth = 0.001;
    let spacing = 1.5 * hertz_radius(depth) / 8.0;
    let mut forces = Vec::new();
    for coarse in [9, 10] {
        // Cells of very unequal size: round-off of the far ones is above 1e-10 of the force.
        let found = half_space(depth, spacing, [8, coarse], 1.8, 1e-8).unwrap();
        proof.below("force off Hertz", (found.force - 1.0).abs(), 0.03);
        let contact = found.moment_radius - 1.0;
        proof.below("contact radius off Hertz", contact.abs(), 0.03);
        for ring in &found.rings[..3] {
            let error = ring.pressure / ring.expected - 1.0;
            // 6.0 and 5.3 % at most, in the two blocks: a ring is 1.3 to 1.6 cells wide.
            proof.below("pressure of a ring off Hertz", error.abs(), 0.07);
        }
        forces.push(found.force);
    }
    // The far sides' share falls with the size or faster (1.8 times here): what is left of it at the
    // larger block is at most 1.25 times what this enlargement took.
    let left = 1.25 * (forces[0] / forces[1] - 1.0);
    proof.below("share of the far sides", left.abs(), 0.01);
}
