//! Polygons of a file cut into triangles.

use glam::{DVec2, DVec3};

use super::{RawMesh, ReadError, unsupported};
use crate::mesh::area_vector;

/// Most corners of a polygon that is not convex: cutting it takes up to their cube.
const MOST_CORNERS: usize = 1000;

/// Divides again the polygons that a fan from their first corner does not cover: those of which a
/// triangle of the fan looks the other way. A fan whose triangles all look the same way covers a
/// plane polygon once.
pub(super) fn mend(raw: &mut RawMesh) -> Result<(), ReadError> {
    for (first, corners, place) in std::mem::take(&mut raw.fans) {
        let places: Vec<DVec3> = corners.iter().map(|v| raw.vertices[*v as usize]).collect();
        // The sum of the fan's area vectors is the polygon's, plane or not (Newell).
        let fan = |k: usize| area_vector([places[0], places[k], places[k + 1]]);
        let normal: DVec3 = (1..places.len() - 1).map(fan).sum();
        if (1..places.len() - 1).all(|k| fan(k).dot(normal) >= 0.0) {
            continue;
        }
        if places.len() > MOST_CORNERS {
            let what = "faces of more than 1,000 corners that are not convex";
            return Err(unsupported(what, "triangulate the mesh first", place));
        }
        let flat = project(&places, normal);
        for (k, triangle) in clip_ears(&flat).into_iter().enumerate() {
            raw.triangles[first + k] = triangle.map(|c| corners[c]);
        }
    }
    Ok(())
}

/// The polygon in the plane of its normal, counter-clockwise.
fn project(places: &[DVec3], normal: DVec3) -> Vec<DVec2> {
    let (u, v) = normal.normalize_or(DVec3::Z).any_orthonormal_pair();
    places
        .iter()
        .map(|p| DVec2::new((*p - places[0]).dot(u), (*p - places[0]).dot(v)))
        .collect()
}

/// Triangles of a simple polygon, two fewer than corners, by cutting off ears (Meisters 1975). Of one
/// that is not simple the last corners make a fan.
fn clip_ears(flat: &[DVec2]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..flat.len()).collect();
    let mut triangles = Vec::with_capacity(flat.len().saturating_sub(2));
    let (mut at, mut tried) = (0, 0);
    while left.len() > 3 && tried < left.len() {
        let n = left.len();
        let [a, b, c] = [at + n - 1, at, at + 1].map(|k| left[k % n]);
        if is_ear(flat, &left, [a, b, c]) {
            triangles.push([a, b, c]);
            left.remove(at);
            at = at.saturating_sub(1) % left.len();
            tried = 0;
        } else {
            at = (at + 1) % n;
            tried += 1;
        }
    }
    for k in 1..left.len() - 1 {
        triangles.push([left[0], left[k], left[k + 1]]);
    }
    triangles
}

/// Whether the corner in the middle is convex and no other corner lies in its triangle.
fn is_ear(flat: &[DVec2], left: &[usize], ear: [usize; 3]) -> bool {
    let [a, b, c] = ear.map(|k| flat[k]);
    let turn = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - a);
    turn(a, b, c) > 0.0
        && left.iter().filter(|k| !ear.contains(k)).all(|&k| {
            let p = flat[k];
            // Corners at the ear's own positions, as where a face goes around a hole, do not count.
            p == a
                || p == b
                || p == c
                || turn(a, b, p) < 0.0
                || turn(b, c, p) < 0.0
                || turn(c, a, p) < 0.0
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(flat: &[DVec2], triangles: &[[usize; 3]]) -> f64 {
        let twice = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|k| flat[k]);
            (b - a).perp_dot(c - a)
        };
        assert!(
            triangles.iter().all(|t| twice(t) >= 0.0),
            "no triangle is turned over: {triangles:?}"
        );
        triangles.iter().map(twice).sum::<f64>() / 2.0
    }

    #[test]
    fn ears_cover_a_polygon_once() {
        // A comb of many teeth, and a star; from every first corner.
        let mut comb = vec![DVec2::new(9.0, -1.0), DVec2::new(9.0, 0.0)];
        for tooth in (0..9).rev() {
            comb.push(DVec2::new(f64::from(tooth) + 0.5, 3.0));
            comb.push(DVec2::new(f64::from(tooth), 0.0));
        }
        comb.push(DVec2::new(0.0, -1.0));
        let star = (0..10).map(|k| {
            let angle = f64::from(k) * std::f64::consts::PI / 5.0;
            DVec2::from_angle(angle) * if k % 2 == 0 { 2.0 } else { 0.5 }
        });
        let star: Vec<DVec2> = star.collect();
        for (name, polygon) in [("comb", comb), ("star", star)] {
            let n = polygon.len();
            let shoelace = |p: &[DVec2]| -> f64 {
                (0..n).map(|k| p[k].perp_dot(p[(k + 1) % n])).sum::<f64>() / 2.0
            };
            for first in 0..n {
                let turned: Vec<DVec2> = (0..n).map(|k| polygon[(first + k) % n]).collect();
                let triangles = clip_ears(&turned);
                assert_eq!(triangles.len(), n - 2, "{name} from {first}");
                let (found, exact) = (area(&turned, &triangles), shoelace(&turned));
                assert!((found - exact).abs() < 1e-12, "{name}: {found} for {exact}");
            }
        }
    }
}
