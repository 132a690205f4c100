//! Masses moved between neighbours, for longer explicit steps.

use crate::eigenvalue::{EigenvalueError, EigenvalueSettings, largest_eigenvalue, radial_start};
use crate::supports::BoundaryConditions;
use glam::{DMat3, DVec3};

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
/// Fraction of its mass that a node keeps whatever its neighbours need.
const KEPT: f64 = 0.8;

/// What was moved.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct MassScaling {
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
/// Each round takes the stiffest mode and gives to node `i` the fraction `0.1 p_i` of its mass, with its kinetic
/// energy `p_i` in the mode over the largest, from its neighbours in proportion to what they can spare; none
/// falls below 0.8 of its mass. It ends before more than `most` is moved; masses that
/// do not lower the eigenvalue in the end are not adopted. Mass stays within its group (a material),
/// and what moved it off a group's centre of mass is undone by a factor linear in the position, so
/// that weight acts where it did.
///
/// A body that is turned or moved is scaled alike, to round-off.
///
/// * `masses` -- nodal masses (kg), shape `(n)`, positive; changed, sum and first moment of each group to
///   round-off not.
/// * `positions` -- at rest (m), shape `(n)`.
/// * `groups` -- group of each node, shape `(n)`, or empty for one.
/// * `offsets`, `indices` -- neighbours as CSR, `n + 1` and all pairs.
/// * `stiffness` -- writes `K v` (N/m · v), as [`largest_eigenvalue`] wants it.
/// * `most` -- largest fraction of the sum to move.
///
/// # Errors
/// As [`largest_eigenvalue`].
///
/// # Panics
/// If the slices do not fit each other.
pub fn scale_masses(
    masses: &mut [f64],
    (positions, groups): (&[DVec3], &[u32]),
    supports: &BoundaryConditions,
    offsets: &[u32],
    indices: &[u32],
    mut stiffness: impl FnMut(&[DVec3], &mut [DVec3]),
    most: f64,
) -> Result<MassScaling, EigenvalueError> {
    let n = masses.len();
    assert_eq!(offsets.len(), n + 1, "one row of neighbours per node");
    assert_eq!(positions.len(), n, "one position per node");
    assert!(
        groups.is_empty() || groups.len() == n,
        "one group per node, or none"
    );
    let mut mode = radial_start(positions);
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
    let mut mass_scaling = MassScaling {
        moved: 0.0,
        nodes: 0,
        eigenvalues: [first; 2],
    };
    let mut now = before.clone();
    for _ in 0..ROUNDS {
        let mut next = now.clone();
        give(&mut next, &before, &mode, groups, offsets, indices);
        center(&mut next, &before, positions, groups);
        let gains = next
            .iter()
            .zip(&before)
            .map(|(next, then)| (next - then).max(0.0));
        let moved = gains.sum::<f64>() / total;
        if moved > most || next == now {
            break;
        }
        mass_scaling.moved = moved;
        now = next;
        find(&now, &mut mode, PRODUCTS)?;
    }
    let last = find(&now, &mut mode, LAST_PRODUCTS)?.rayleigh;
    if last < first {
        let pairs = now.iter().zip(&before);
        mass_scaling.nodes = pairs.filter(|(now, then)| now > then).count();
        mass_scaling.eigenvalues[1] = last;
        masses.copy_from_slice(&now);
    } else {
        mass_scaling.moved = 0.0;
    }
    Ok(mass_scaling)
}

/// One round: nodes take mass by their part in the mode.
fn give(
    masses: &mut [f64],
    before: &[f64],
    mode: &[DVec3],
    groups: &[u32],
    offsets: &[u32],
    indices: &[u32],
) {
    let group = |node: usize| groups.get(node).copied().unwrap_or(0);
    let energies: Vec<f64> = mode.iter().map(|y| y.length_squared()).collect();
    let top = energies.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    for node in 0..masses.len() {
        let share = energies[node] / top;
        if share < LEAST {
            continue;
        }
        let row = &indices[offsets[node] as usize..offsets[node + 1] as usize];
        let spare = |masses: &[f64], j: usize| {
            if group(j) != group(node) {
                return 0.0;
            }
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

/// Multiplies the masses of each group with `1 + s + a · (x - c)`, so that their sum and first moment are
/// those of before; `c` their centre.
fn center(masses: &mut [f64], before: &[f64], positions: &[DVec3], groups: &[u32]) {
    let last = groups.iter().copied().max().unwrap_or(0);
    for group in 0..=last {
        let of = |node: &usize| groups.get(*node).is_none_or(|&g| g == group);
        let nodes: Vec<usize> = (0..masses.len()).filter(of).collect();
        let sum = |values: &[f64]| nodes.iter().map(|&i| values[i]).sum::<f64>();
        let moment =
            |values: &[f64]| -> DVec3 { nodes.iter().map(|&i| positions[i] * values[i]).sum() };
        let (now, then) = (sum(masses), sum(before));
        if now <= 0.0 {
            continue;
        }
        let c = moment(masses) / now;
        let mut second = DMat3::ZERO;
        for &i in &nodes {
            let arm = positions[i] - c;
            second += DMat3::from_cols(arm * arm.x, arm * arm.y, arm * arm.z) * masses[i];
        }
        let off = moment(before) - c * then;
        let trace = second.x_axis.x + second.y_axis.y + second.z_axis.z;
        // Nodes in a plane or on a line leave the other directions alone.
        let ridge = DMat3::from_diagonal(DVec3::splat(1e-12 * trace));
        let slope = if trace > 0.0 {
            (second + ridge).inverse() * off
        } else {
            DVec3::ZERO
        };
        let share = then / now - 1.0;
        for &i in &nodes {
            masses[i] *= 1.0 + share + slope.dot(positions[i] - c);
        }
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

    fn level(chain: &mut Chain, most: f64) -> MassScaling {
        let n = chain.masses.len();
        let (offsets, indices) = row(u32::try_from(n).unwrap());
        let mut masses = chain.masses.clone();
        let supports = BoundaryConditions::free(n);
        let product = |v: &[DVec3], out: &mut [DVec3]| chain.product(v, out);
        let places: Vec<DVec3> = (0..n).map(|i| DVec3::X * i as f64).collect();
        let cloud = (&places[..], &[][..]);
        let mass_scaling = scale_masses(
            &mut masses,
            cloud,
            &supports,
            &offsets,
            &indices,
            product,
            most,
        );
        chain.masses = masses;
        mass_scaling.unwrap()
    }

    #[test]
    fn a_light_node_no_longer_sets_the_step() {
        let mut chain = Chain::new(60, 100.0, 0.01);
        chain.masses[23] = 0.002;
        let (before, total) = (eigenvalue(&chain), chain.masses.iter().sum::<f64>());
        let mass_scaling = level(&mut chain, 0.01);
        let after = eigenvalue(&chain);
        assert!(after < 0.6 * before, "{after} of {before}");
        let moved = mass_scaling.moved;
        assert!(moved > 0.0 && moved <= 0.01, "{mass_scaling:?}");
        let ratio = mass_scaling.eigenvalues[1] / after;
        assert!((ratio - 1.0).abs() < 0.02, "{mass_scaling:?}, {after}");
        let sum: f64 = chain.masses.iter().sum();
        assert!((sum / total - 1.0).abs() < 1e-14, "{sum} of {total}");
        let least = chain.masses[22].min(chain.masses[24]);
        assert!(least >= 0.79 * 0.01, "a neighbour keeps {least}");
    }

    #[test]
    fn mass_keeps_its_centre_and_its_group() {
        let n = 40;
        let mut random = testkit::cloud::Random::new(3);
        let positions: Vec<DVec3> = (0..n).map(|_| random.vector(1.0)).collect();
        let groups: Vec<u32> = (0..n).map(|i| u32::from(i >= 25)).collect();
        let before: Vec<f64> = (0..n).map(|_| random.range(0.5, 1.0)).collect();
        let mode: Vec<DVec3> = (0..n).map(|_| random.vector(1.0)).collect();
        let (offsets, indices) = row(40);
        let mut masses = before.clone();
        give(&mut masses, &before, &mode, &groups, &offsets, &indices);
        let of = |values: &[f64], group: u32| -> (f64, DVec3) {
            let nodes = (0..values.len()).filter(|&i| groups[i] == group);
            nodes.fold((0.0, DVec3::ZERO), |(m, x), i| {
                (m + values[i], x + positions[i] * values[i])
            })
        };
        for group in [0, 1] {
            let (given, kept) = (of(&masses, group).0, of(&before, group).0);
            assert!((given / kept - 1.0).abs() < 1e-14, "group {group}");
        }
        center(&mut masses, &before, &positions, &groups);
        assert_ne!(masses, before);
        for group in [0, 1] {
            let ((m, x), (m0, x0)) = (of(&masses, group), of(&before, group));
            assert!((m / m0 - 1.0).abs() < 1e-13, "group {group}: {m}, {m0}");
            assert!((x - x0).length() < 1e-12, "group {group}: {x}, {x0}");
        }
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
            let mass_scaling = level(&mut chain, most);
            prop_assert!(mass_scaling.moved <= most, "{mass_scaling:?}");
            let moved: f64 = chain.masses.iter().zip(&masses).map(|(a, b)| (a - b).abs()).sum();
            prop_assert!((0.5 * moved / total - mass_scaling.moved).abs() < 1e-12, "{mass_scaling:?}");
            prop_assert!((chain.masses.iter().sum::<f64>() / total - 1.0).abs() < 1e-13);
            // What moves, moves by one neighbour, 1 m: the centre by at most `most` of it. A factor linear in the
            // position puts it back.
            let center = chain.rest.iter().zip(&masses).map(|(x, m)| *x * *m).sum::<DVec3>() / total;
            let arms = chain.rest.iter().map(|x| x.distance(center));
            let inertia = arms.clone().zip(&masses).map(|(arm, m)| m * arm * arm).sum::<f64>();
            let factor = 1.0 - most * total * arms.fold(0.0, f64::max) / inertia;
            prop_assert!(chain.masses.iter().zip(&masses).all(|(a, b)| *a >= KEPT * factor * b));
            let after = eigenvalue(&chain);
            prop_assert!(after <= 1.05 * before, "{after} from {before}, {mass_scaling:?}");
        }
    }
}
