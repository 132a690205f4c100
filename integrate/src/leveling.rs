//! Masses moved between neighbours, for longer explicit steps.

use crate::eigenvalue::{EigenvalueError, EigenvalueSettings, largest_eigenvalue};
use crate::supports::Supports;
use glam::DVec3;

/// Rounds at most.
const ROUNDS: usize = 60;
/// Products with the stiffness per round; the vector found last is the start of the next.
const PRODUCTS: usize = 6;
/// Products for what the eigenvalue is in the end.
const LAST_PRODUCTS: usize = 30;
/// Growth of the mass of the node that swings most, per round.
const GROWTH: f64 = 0.1;
/// Nodes that swing less than this, in energy over the largest, take no mass.
const LEAST: f64 = 0.05;
/// Share of its mass that a node keeps whatever its neighbours need.
const KEPT: f64 = 0.8;

/// What was moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leveled {
    /// Mass moved over mass of the body.
    pub moved: f64,
    /// Nodes that took mass.
    pub nodes: usize,
    /// Largest eigenvalue of `M⁻¹ K` (1/s²) before, and an estimate from below of what it is now.
    pub eigenvalues: [f64; 2],
}

/// Lets nodes that limit the explicit step take mass from their neighbours.
///
/// The stiffest modes of a scattered cloud live on a few light nodes. Lumping a body's mass on nodes is
/// a choice to begin with; moving some tenths of a percent of it by one neighbour lengthens the step by a
/// third and changes neither the sum nor, visibly, any mode that one sees (mass scaling, as Olovsson,
/// Simonsson, Unosson 2005, doi:10.1002/nme.1293, but nothing is added). Statics change only as far as
/// weight goes with mass.
///
/// Each round takes the stiffest mode and gives to node `i` the share `0.1 p_i` of its mass, with its kinetic
/// energy `p_i` in the mode over the largest, from its neighbours in proportion to what they can spare; none
/// falls below 0.8 of its mass. It ends before more than `most` is moved; masses that
/// do not lower the eigenvalue in the end are not taken over.
///
/// * `masses` -- nodal masses (kg), shape `(n)`, positive; changed, their sum to round-off not.
/// * `offsets`, `indices` -- neighbours as CSR, `n + 1` and all pairs.
/// * `stiffness` -- writes `K v` (N/m · v), as [`largest_eigenvalue`] wants it.
/// * `most` -- largest share of the sum to move.
///
/// # Errors
/// As [`largest_eigenvalue`].
///
/// # Panics
/// If the slices do not fit each other.
pub fn level_masses(
    masses: &mut [f64],
    supports: &Supports,
    offsets: &[u32],
    indices: &[u32],
    mut stiffness: impl FnMut(&[DVec3], &mut [DVec3]),
    most: f64,
) -> Result<Leveled, EigenvalueError> {
    let n = masses.len();
    assert_eq!(offsets.len(), n + 1, "one row of neighbours per node");
    let mut mode = Vec::new();
    let mut find = |masses: &[f64], mode: &mut Vec<DVec3>, iterations: usize| {
        let settings = EigenvalueSettings {
            iterations,
            margin: 0.0,
            ..EigenvalueSettings::default()
        };
        largest_eigenvalue(masses, supports, &mut stiffness, mode, &settings)
    };
    let first = find(masses, &mut mode, EigenvalueSettings::default().iterations)?.rayleigh;
    let before = masses.to_vec();
    let total: f64 = before.iter().sum();
    let mut leveled = Leveled {
        moved: 0.0,
        nodes: 0,
        eigenvalues: [first; 2],
    };
    let mut now = before.clone();
    for _ in 0..ROUNDS {
        let mut next = now.clone();
        give(&mut next, &before, &mode, offsets, indices);
        let gains = next
            .iter()
            .zip(&before)
            .map(|(next, then)| (next - then).max(0.0));
        let moved = gains.sum::<f64>() / total;
        if moved > most || next == now {
            break;
        }
        leveled.moved = moved;
        now = next;
        find(&now, &mut mode, PRODUCTS)?;
    }
    let last = find(&now, &mut mode, LAST_PRODUCTS)?.rayleigh;
    if last < first {
        let pairs = now.iter().zip(&before);
        leveled.nodes = pairs.filter(|(now, then)| now > then).count();
        leveled.eigenvalues[1] = last;
        masses.copy_from_slice(&now);
    } else {
        leveled.moved = 0.0;
    }
    Ok(leveled)
}

/// One round: nodes take mass by their share in the mode.
fn give(masses: &mut [f64], before: &[f64], mode: &[DVec3], offsets: &[u32], indices: &[u32]) {
    let energies: Vec<f64> = mode.iter().map(|y| y.length_squared()).collect();
    let top = energies.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    for node in 0..masses.len() {
        let share = energies[node] / top;
        if share < LEAST {
            continue;
        }
        let row = &indices[offsets[node] as usize..offsets[node + 1] as usize];
        let spare = |masses: &[f64], j: usize| {
            (masses[j] - KEPT * before[j]).max(0.0) * (1.0 - energies[j] / top)
        };
        let sum: f64 = row.iter().map(|&j| spare(masses, j as usize)).sum();
        let want = (GROWTH * share * masses[node]).min(0.5 * sum);
        if want <= 0.0 {
            continue;
        }
        for &j in row {
            let j = j as usize;
            masses[j] -= want * spare(masses, j) / sum;
        }
        masses[node] += want;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Chain;
    use proptest::prelude::*;

    /// Neighbours in a row.
    fn row(n: u32) -> (Vec<u32>, Vec<u32>) {
        let mut offsets = vec![0];
        let mut indices = Vec::new();
        for i in 0..n {
            indices.extend((i > 0).then(|| i - 1));
            indices.extend((i + 1 < n).then_some(i + 1));
            offsets.push(u32::try_from(indices.len()).unwrap());
        }
        (offsets, indices)
    }

    fn eigenvalue(chain: &Chain) -> f64 {
        let settings = EigenvalueSettings {
            iterations: 400,
            tolerance: 1e-6,
            margin: 0.0,
        };
        chain.eigenvalue(&settings, &mut Vec::new()).rayleigh
    }

    fn level(chain: &mut Chain, most: f64) -> Leveled {
        let n = chain.masses.len();
        let (offsets, indices) = row(u32::try_from(n).unwrap());
        let mut masses = chain.masses.clone();
        let supports = Supports::free(n);
        let product = |v: &[DVec3], out: &mut [DVec3]| chain.product(v, out);
        let leveled = level_masses(&mut masses, &supports, &offsets, &indices, product, most);
        chain.masses = masses;
        leveled.unwrap()
    }

    #[test]
    fn a_light_node_no_longer_sets_the_step() {
        let mut chain = Chain::new(60, 100.0, 0.01);
        chain.masses[23] = 0.002;
        let (before, total) = (eigenvalue(&chain), chain.masses.iter().sum::<f64>());
        let leveled = level(&mut chain, 0.01);
        let after = eigenvalue(&chain);
        assert!(after < 0.6 * before, "{after} of {before}");
        assert!(leveled.moved > 0.0 && leveled.moved <= 0.01, "{leveled:?}");
        assert!(
            (leveled.eigenvalues[1] / after - 1.0).abs() < 0.02,
            "{leveled:?}, {after}"
        );
        let sum: f64 = chain.masses.iter().sum();
        assert!((sum / total - 1.0).abs() < 1e-14, "{sum} of {total}");
        let least = chain.masses[22].min(chain.masses[24]);
        assert!(least >= 0.8 * 0.01, "a neighbour keeps {least}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn the_sum_stays_and_the_step_does_not_shorten(
            masses in prop::collection::vec(0.2_f64..1.0, 3..40),
            most in 0.0_f64..0.05,
        ) {
            let mut chain = Chain::new(masses.len(), 10.0, 1.0);
            chain.masses.clone_from(&masses);
            let (before, total) = (eigenvalue(&chain), masses.iter().sum::<f64>());
            let leveled = level(&mut chain, most);
            prop_assert!(leveled.moved <= most, "{leveled:?}");
            let moved: f64 = chain.masses.iter().zip(&masses).map(|(a, b)| (a - b).abs()).sum();
            prop_assert!((0.5 * moved / total - leveled.moved).abs() < 1e-12, "{leveled:?}");
            prop_assert!((chain.masses.iter().sum::<f64>() / total - 1.0).abs() < 1e-13);
            prop_assert!(chain.masses.iter().zip(&masses).all(|(a, b)| *a >= 0.8 * b));
            let after = eigenvalue(&chain);
            prop_assert!(after <= 1.05 * before, "{after} from {before}, {leveled:?}");
        }
    }
}
