//! Surfels that lie closer together where the surface is more curved.

use crate::cast::{count, index};
use crate::tissue::{NodeTree, point_tree, shape_operators};
use glam::DVec3;
use rstar::primitives::GeomWithData;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Rejection distance of the first sweep, over the spacing of a hexagonal packing.
const FIRST: f64 = 0.82;
/// What is left of the distance in each further sweep.
const SHRINK: f64 = 0.95;
/// Samples nearer than this, over the same spacing, count as one.
const LEAST: f64 = 0.05;
/// Most that the spacing grows with distance: wide disks keep off positions of narrow ones.
const GRADING: f64 = 0.5;
/// Samples beside each one that its spacing bounds.
const BESIDE: usize = 8;

/// Chooses `wanted` of evenly spread surface samples so that their spacing follows curvature.
///
/// A disk of radius r on a surface of curvature κ is off by `κ r² / 2`. The mean square of that over
/// the surface is least, for a given number of disks that just cover it, where `r ∝ κ^(-1/3)`; the
/// samples are chosen with that spacing, which grows by no more than half the distance from narrower
/// positions, by dart throwing with a distance that shrinks until there are enough. Curvature is the
/// Frobenius norm of the shape operator. The radii to go with them are [`crate::covering_radii`].
///
/// # Arguments
/// * `positions`, `normals`, `areas` -- samples (m), unit normals and areas (m²); several times as
///   many as wanted.
/// * `wanted` -- how many to choose.
/// * `range` -- the widest spacing over the narrowest (1): flat parts have no curvature to follow.
///
/// # Returns
/// Indices, ascending, fewer than `wanted` only if there are not as many samples apart; and the area
/// (m²) that each stands for, its own and that of the samples nearest to it.
///
/// # Panics
/// If the slices differ in length or `range` is below 1.
#[must_use]
pub fn follow_curvature(
    positions: &[DVec3],
    normals: &[DVec3],
    areas: &[f64],
    wanted: usize,
    range: f64,
) -> (Vec<u32>, Vec<f64>) {
    assert!(range >= 1.0, "the widest spacing over the narrowest");
    assert_eq!(positions.len(), areas.len(), "one area per position");
    if wanted >= positions.len() {
        return ((0..count(positions.len())).collect(), areas.to_vec());
    }
    // The unit of spacings for which hexagonal packing gives the wanted number.
    let unit = |spacings: &[f64]| {
        let share = spacings.iter().zip(areas).map(|(h, area)| area / (h * h));
        (share.sum::<f64>() / wanted as f64 * 2.0 / 3.0_f64.sqrt()).sqrt()
    };
    let mut spacings = spacings(positions, normals, range);
    let slope = GRADING / unit(&spacings);
    grade(&mut spacings, positions, slope);
    let packed = unit(&spacings);
    let mut kept = NodeTree::new();
    let mut taken = vec![false; positions.len()];
    // Neighbours in the list are often neighbours in space: the darts must not come in order.
    let mut order: Vec<usize> = (0..positions.len()).collect();
    order.sort_by_key(|&i| scatter(count(i)));
    let mut distance = FIRST * packed;
    while kept.size() < wanted && distance > LEAST * packed {
        for &i in &order {
            if kept.size() == wanted {
                break;
            }
            if taken[i] {
                continue;
            }
            let x = positions[i];
            let own = distance * spacings[i];
            let crowded = kept
                .locate_within_distance(x.to_array(), own * own)
                .any(|other| normals[index(other.data)].dot(normals[i]) > 0.0);
            if !crowded {
                taken[i] = true;
                kept.insert(GeomWithData::new(x.to_array(), count(i)));
            }
        }
        distance *= SHRINK;
    }
    let chosen: Vec<u32> = (0..count(positions.len()))
        .filter(|&i| taken[index(i)])
        .collect();
    let shares = shares(&kept, positions, normals, areas);
    let shares = chosen.iter().map(|&i| shares[index(i)]).collect();
    (chosen, shares)
}

/// The area (m²) of the samples nearest to each of those kept.
fn shares(kept: &NodeTree, positions: &[DVec3], normals: &[DVec3], areas: &[f64]) -> Vec<f64> {
    let mut shares = vec![0.0; positions.len()];
    for ((&x, &n), area) in positions.iter().zip(normals).zip(areas) {
        let near = kept.nearest_neighbor_iter(x.to_array());
        let mut near = near.map(|p| index(p.data));
        // Not the other side of a thin part, if one of the same side is near.
        let nearest = near.next();
        let facing = nearest.into_iter().chain(near.take(BESIDE));
        let own = facing.into_iter().find(|&j| normals[j].dot(n) > 0.0);
        if let Some(j) = own.or(nearest) {
            shares[j] += area;
        }
    }
    shares
}

/// Lowers spacings until they grow by no more than `slope` times the distance from sample to sample.
fn grade(spacings: &mut [f64], positions: &[DVec3], slope: f64) {
    let tree = point_tree(positions);
    // Bits of positive floats are ordered as the floats are.
    let key = |h: f64, i: usize| Reverse((h.to_bits(), i));
    let mut front: BinaryHeap<_> = spacings.iter().zip(0..).map(|(&h, i)| key(h, i)).collect();
    while let Some(Reverse((bits, i))) = front.pop() {
        if bits != spacings[i].to_bits() {
            continue;
        }
        let x = positions[i];
        for near in tree.nearest_neighbor_iter(x.to_array()).take(BESIDE + 1) {
            let j = index(near.data);
            let most = spacings[i] + slope * x.distance(positions[j]);
            if most < spacings[j] {
                spacings[j] = most;
                front.push(key(most, j));
            }
        }
    }
}

/// A permutation of 32-bit numbers that leaves no order.
pub(super) fn scatter(i: u32) -> u32 {
    let mut h = i.wrapping_mul(0x9e37_79b9);
    h ^= h >> 16;
    h = h.wrapping_mul(0x85eb_ca6b);
    h ^= h >> 13;
    h = h.wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

/// Relative spacings, 1 where curvature is greatest.
fn spacings(positions: &[DVec3], normals: &[DVec3], range: f64) -> Vec<f64> {
    let curvatures: Vec<f64> = shape_operators(positions, normals)
        .iter()
        .map(|s| (s.x * s.x + 2.0 * s.y * s.y + s.z * s.z).sqrt())
        .collect();
    let greatest = curvatures.iter().copied().fold(0.0, f64::max);
    let share = |k: f64| if greatest > 0.0 { k / greatest } else { 1.0 };
    curvatures
        .iter()
        .map(|&k| share(k).max(range.powi(-3)).powf(-1.0 / 3.0))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Even samples of a cylinder of 1 m with round ends of 0.2 m, its normals and areas.
    fn capsule() -> (Vec<DVec3>, Vec<DVec3>, Vec<f64>) {
        let (half, radius, n) = (1.0, 0.2, 40_000);
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        for i in 0..n {
            // Equal heights have equal areas, on the ends as on the side.
            let z = (half + radius) * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0);
            let beyond = z - z.clamp(-half, half);
            let ring = (radius * radius - beyond * beyond).sqrt();
            let (sine, cosine) = (2.399_963_229_728_653 * f64::from(i)).sin_cos();
            let out = DVec3::new(ring * cosine, ring * sine, beyond) / radius;
            positions.push(radius * out + DVec3::Z * (z - beyond));
            normals.push(out);
        }
        let area = 4.0 * std::f64::consts::PI * radius * (half + radius);
        (positions, normals, vec![area / f64::from(n); n as usize])
    }

    #[test]
    fn spacing_follows_the_cube_root_of_curvature() {
        let (x, n, areas) = capsule();
        let (chosen, shares) = follow_curvature(&x, &n, &areas, 2_000, 3.0);
        assert_eq!(chosen.len(), 2_000);
        let (all, shared): (f64, f64) = (areas.iter().sum(), shares.iter().sum());
        assert!((shared / all - 1.0).abs() < 1e-12, "{shared} of {all} m²");
        assert!(chosen.is_sorted(), "ascending");
        // Shares of surfels by area on the middle and near the poles: the Frobenius norms there are
        // 1/r and √2/r, so that densities are as 2^(1/3) = 1.26.
        let density = |keep: &dyn Fn(f64) -> bool| {
            let all = x.iter().filter(|p| keep(p.z.abs())).count();
            let kept = chosen.iter().filter(|&&i| keep(x[index(i)].z.abs()));
            kept.count() as f64 / all as f64
        };
        let ratio = density(&|z| z > 1.05) / density(&|z| z < 0.9);
        // 220 surfels on the ends: three standard deviations of a count are below 20 %.
        assert!((ratio / 2.0_f64.cbrt() - 1.0).abs() < 0.1, "{ratio}");
    }

    #[test]
    fn flat_is_even_and_few_are_all() {
        let n = 30;
        let x: Vec<DVec3> = (0..n * n)
            .map(|i| DVec3::new(f64::from(i % n), f64::from(i / n), 0.0))
            .collect();
        let normals = vec![DVec3::Z; x.len()];
        let areas = vec![1.0; x.len()];
        let (chosen, shares) = follow_curvature(&x, &normals, &areas, 100, 3.0);
        // A cell of the hexagonal packing is 9 m²; each sample is 1 m².
        let even = shares.iter().all(|a| (3.0..=20.0).contains(a));
        assert!(even, "{shares:?}");
        assert_eq!(chosen.len(), 100);
        for (k, &i) in chosen.iter().enumerate() {
            for &j in &chosen[..k] {
                // The hexagonal spacing of 100 on 900 m² is 3.2 m.
                let apart = x[index(i)].distance(x[index(j)]);
                assert!(apart >= 2.0, "{i} and {j} are {apart} m apart");
            }
        }
        let (few, own) = follow_curvature(&x, &normals, &areas, 1_000, 3.0);
        assert_eq!((few.len(), own), (x.len(), areas));
    }
}
