//! Normals of points that have none.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::eigen::symmetric_eigen;
use super::tree::point_tree;
use crate::cast::count;
use crate::error::SurfelError;

/// Points whose plane gives a normal, the point itself included: fewer follow noise, more round off edges.
const NEAREST: usize = 12;
/// Spread across a line, as a fraction of that along it, below which points have no plane.
const LINE: f64 = 1e-12;

/// Unit normals of points (m) that lie on closed surfaces, shape `(n)`, turned outward.
///
/// A normal is the direction in which the 12 nearest points spread least (Hoppe et al. 1992, section
/// 3.1). Signs follow a spanning tree of near points with near normals (section 3.3), from the point
/// that is farthest from the centroid of what is connected. Sheets closer to each other than their
/// points are can be turned wrongly, and edges are rounded.
///
/// # Errors
/// [`SurfelError::BadSurfel`] for a point that is not finite, [`SurfelError::NoPlane`] if the points
/// nearest to one coincide or lie on a line.
///
/// # Examples
/// ```
/// use phyxel_splat::{Surfel, estimate_normals, glam::DVec3};
///
/// let around = |k: u32| 2.399_963 * f64::from(k);
/// let height = |k: u32| 1.0 - f64::from(2 * k + 1) / 500.0;
/// let ball: Vec<DVec3> = (0..500).map(|k| {
///     let (sin, cos) = around(k).sin_cos();
///     (DVec3::new(cos, sin, 0.0) * (1.0 - height(k).powi(2)).sqrt()).with_z(height(k))
/// }).collect();
/// let normals = estimate_normals(&ball)?;
/// assert!(ball.iter().zip(&normals).all(|(x, normal)| x.dot(*normal) > 0.99));
/// let surfels = Surfel::covering(&ball, &normals)?;
/// # Ok::<(), phyxel_splat::SurfelError>(())
/// ```
pub fn estimate_normals(points: &[DVec3]) -> Result<Vec<DVec3>, SurfelError> {
    if let Some(surfel) = points.iter().position(|x| !x.is_finite()) {
        return Err(SurfelError::BadSurfel { surfel });
    }
    let tree = point_tree(points);
    let nearest = |x: &DVec3| {
        let near = tree.nearest_neighbor_iter(x.to_array()).take(NEAREST);
        near.map(|entry| entry.data).collect()
    };
    let near: Vec<Vec<u32>> = points.par_iter().map(nearest).collect();
    let normals = near.par_iter().enumerate().map(|(point, near)| {
        let near = near.iter().map(|&k| points[k as usize]);
        normal_of_plane(near).ok_or(SurfelError::NoPlane { point })
    });
    // In two passes: on threads any of several errors would be the one returned.
    let normals: Vec<_> = normals.collect();
    let mut normals = normals.into_iter().collect::<Result<Vec<_>, _>>()?;
    turn_outward(points, near, &mut normals);
    Ok(normals)
}

/// The direction of least spread; `None` for points on a line.
fn normal_of_plane(near: impl ExactSizeIterator<Item = DVec3> + Clone) -> Option<DVec3> {
    let centre = centroid(near.clone());
    let spread = near.fold(DMat3::ZERO, |sum, x| {
        let d = x - centre;
        sum + DMat3::from_cols(d * d.x, d * d.y, d * d.z)
    });
    let (values, axes) = symmetric_eigen(spread);
    (values.y > LINE * values.z).then_some(axes.x_axis)
}

fn centroid(points: impl ExactSizeIterator<Item = DVec3>) -> DVec3 {
    let count = points.len() as f64;
    points.sum::<DVec3>() / count
}

/// Turns all normals of what is connected as the one of its outermost point, which points away from the centroid.
fn turn_outward(points: &[DVec3], mut near: Vec<Vec<u32>>, normals: &mut [DVec3]) {
    // Who sees whom is made mutual.
    for point in 0..points.len() {
        for k in 0..near[point].len().min(NEAREST) {
            let other = near[point][k] as usize;
            near[other].push(count(point));
        }
    }
    let mut seen = vec![false; points.len()];
    let mut turned = vec![false; points.len()];
    for seed in 0..points.len() {
        let connected = connected(seed, &near, &mut seen);
        let at = |&k: &usize| points[k];
        let centre = centroid(connected.iter().map(at));
        let distance = |k: &usize| points[*k].distance_squared(centre);
        let outermost = connected
            .iter()
            .max_by(|a, b| distance(a).total_cmp(&distance(b)));
        let Some(&root) = outermost else { continue };
        turn_along(&mut normals[root], points[root] - centre);
        turned[root] = true;
        // Prim's tree: who differs least from one that is turned is turned next.
        let mut next = BinaryHeap::new();
        add_near(root, &near, normals, &mut next);
        while let Some((_, Reverse(point), from)) = next.pop() {
            if !std::mem::replace(&mut turned[point], true) {
                let model = normals[from];
                turn_along(&mut normals[point], model);
                add_near(point, &near, normals, &mut next);
            }
        }
    }
}

/// By how much two normals differ (bits of a number that is not negative), and of whom.
type Next = (Reverse<u64>, Reverse<usize>, usize);

fn add_near(from: usize, near: &[Vec<u32>], normals: &[DVec3], next: &mut BinaryHeap<Next>) {
    for point in near[from].iter().map(|&k| k as usize) {
        let differ = (1.0 - normals[from].dot(normals[point]).abs()).max(0.0);
        next.push((Reverse(differ.to_bits()), Reverse(point), from));
    }
}

fn turn_along(normal: &mut DVec3, model: DVec3) {
    if normal.dot(model) < 0.0 {
        *normal = -*normal;
    }
}

/// What is connected with a point and was not seen; nothing for one that was.
fn connected(seed: usize, near: &[Vec<u32>], seen: &mut [bool]) -> Vec<usize> {
    let mut found = Vec::new();
    let mut open = vec![seed];
    while let Some(point) = open.pop() {
        if !std::mem::replace(&mut seen[point], true) {
            found.push(point);
            open.extend(near[point].iter().map(|&k| k as usize));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::TAU;
    use testkit::strategies;

    /// Points of a ball or of a tube bent to a ring, with their true normals.
    fn surface(ring: bool) -> Vec<(DVec3, DVec3)> {
        let at = |k: u32| {
            let (u, v) = (f64::from(k) / 1500.0, TAU * 0.618_034 * f64::from(k));
            let (sin, cos) = v.sin_cos();
            if ring {
                let out = DVec3::new((TAU * u).cos(), (TAU * u).sin(), 0.0);
                let normal = out * cos + DVec3::Z * sin;
                return (out + normal * 0.4, normal);
            }
            let z = 1.0 - 2.0 * u;
            let normal = (DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt()).with_z(z);
            (normal, normal)
        };
        (0..1500).map(at).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Two bodies apart, stretched and turned, with noise of some hundredths of their points' distances.
        #[test]
        fn all_point_outward(
            ring in proptest::bool::ANY,
            turn in strategies::rotation(),
            stretch in strategies::vector(0.3),
            noise in proptest::collection::vec(strategies::vector(2e-3), 1500),
        ) {
            let stretch = DVec3::ONE + stretch;
            let place = |x: DVec3| turn * (stretch * x);
            let (mut points, mut truth) = (Vec::new(), Vec::new());
            for shift in [DVec3::ZERO, DVec3::X * 9.0] {
                for ((x, normal), noise) in surface(ring).into_iter().zip(&noise) {
                    points.push(place(x) + *noise + shift);
                    truth.push(turn * (normal / stretch).normalize());
                }
            }
            let normals = estimate_normals(&points).unwrap();
            for (found, truth) in normals.iter().zip(&truth) {
                prop_assert!(found.dot(*truth) > 0.9, "{found} where {truth} is");
            }
        }
    }

    #[test]
    fn points_without_a_plane_are_named() {
        let line: Vec<DVec3> = (0..20).map(|k| DVec3::X * f64::from(k)).collect();
        let error = estimate_normals(&line).unwrap_err();
        assert_eq!(error, SurfelError::NoPlane { point: 0 });
        let mut bad = line;
        bad[7].y = f64::NAN;
        let error = estimate_normals(&bad).unwrap_err();
        assert_eq!(error, SurfelError::BadSurfel { surfel: 7 });
        assert_eq!(estimate_normals(&[]), Ok(Vec::new()));
    }
}
