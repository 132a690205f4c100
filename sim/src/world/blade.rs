//! Where a blade's edge lies in the material.

use glam::DVec3;
use phyxel_discretize::Solid;
use phyxel_enrich::Cuts;
use phyxel_mls::{MaterialMap, MaterialPoint};

use super::body::Body;
use super::error::BodyProblem;

/// Halvings of a segment that place the body's surface on it, to a thousandth of its length.
const BISECTIONS: usize = 10;
/// Deformation gradients with a smaller determinant are not inverted.
const SMALLEST_DETERMINANT: f64 = 0.2;

/// Faces of a cut closer to each other than this (spacings) touch.
const CLOSED: f64 = 0.25;

/// What a point of the edge is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Tissue,
    /// The gap that a cut has opened.
    Gap,
    Air,
}

/// The points of an edge in the world (m), mapped into the material; `last` is where they were before,
/// or empty.
///
/// Only tissue has a place in the material, but the map goes on past the faces of a cut that gapes and
/// past the body's surface, the worse the farther. So a point that comes to lie beyond a cut from the
/// node it is mapped by, where the other face does not touch, hangs in the gap: it meets no tissue and
/// stays where it last did. Points in the air follow from the edge's nearest point in tissue by the
/// deformation there, or stay with one in a gap. While all of the edge is in the air, its points are
/// mapped as they are.
pub(super) fn edge_in_material(
    body: &Body,
    map: &MaterialMap,
    cuts: &Cuts,
    world: &[DVec3],
    last: &[DVec3],
) -> Result<Vec<DVec3>, BodyProblem> {
    let gradients = body.elastic.deformation_gradients();
    let frame = map.frame(body.motion.positions(), gradients)?;
    let found: Vec<_> = world.iter().map(|&at| frame.to_material(at)).collect();
    let places: Vec<Place> = found
        .iter()
        .zip(world)
        .map(|(found, &at)| {
            let from = body.rest[found.start_node as usize];
            let end = last_inside(&body.solid, from, found.position);
            if cuts.crosses(from, end) && gapes(body, cuts, found, at) {
                Place::Gap
            } else if end == found.position {
                Place::Tissue
            } else {
                Place::Air
            }
        })
        .collect();
    let stay = |k: usize| last.get(k).copied().unwrap_or(found[k].position);
    let in_air = |k: usize| {
        let others = (0..places.len()).filter(|&j| places[j] != Place::Air);
        match others.min_by_key(|&j| j.abs_diff(k)) {
            Some(j) if places[j] == Place::Gap => stay(k),
            Some(j) => {
                let gradient = gradients[found[j].start_node as usize];
                if gradient.determinant() < SMALLEST_DETERMINANT {
                    return found[k].position;
                }
                found[j].position + gradient.inverse() * (world[k] - world[j])
            }
            None => found[k].position,
        }
    };
    Ok((0..found.len())
        .map(|k| match places[k] {
            Place::Tissue => found[k].position,
            Place::Gap => stay(k),
            Place::Air => in_air(k),
        })
        .collect())
}

/// Whether the other face of a cut is away from `at` (m), which was found beyond that cut: the face lies
/// where the nearest node of its side carries it. A crumb without a node of its own goes with the
/// side that the point was found from.
fn gapes(body: &Body, cuts: &Cuts, found: &MaterialPoint, at: DVec3) -> bool {
    let (rest, place) = (&body.rest, found.position);
    let distance = |node: usize| rest[node].distance_squared(place);
    let near = body.neighborhoods.row(found.start_node as usize).iter();
    let seeing = near
        .map(|&node| node as usize)
        .filter(|&node| !cuts.crosses(rest[node], place));
    let nearest = seeing.min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)));
    nearest.is_some_and(|node| {
        let arm = body.elastic.deformation_gradients()[node] * (place - rest[node]);
        let face = body.motion.positions()[node] + arm;
        face.distance(at) > CLOSED * body.spacing
    })
}

/// The end of the part of a segment that lies in a solid with its start, which does.
fn last_inside(solid: &Solid, from: DVec3, to: DVec3) -> DVec3 {
    if solid.contains(to) {
        return to;
    }
    let (mut inside, mut outside) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = f64::midpoint(inside, outside);
        if solid.contains(from.lerp(to, middle)) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    from.lerp(to, inside)
}

/// Divides a polyline into pieces not longer than `length` (m).
pub(super) fn divided(line: &[DVec3], length: f64) -> Vec<DVec3> {
    let mut points = Vec::new();
    for pair in line.windows(2) {
        let pieces = (pair[0].distance(pair[1]) / length).ceil().max(1.0);
        let mut piece = 0.0;
        while piece < pieces {
            points.push(pair[0].lerp(pair[1], piece / pieces));
            piece += 1.0;
        }
    }
    points.extend(line.last());
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_divided_line_keeps_its_corners_and_has_no_long_piece() {
        let line = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 0.25, 0.0)];
        let points = divided(&line, 0.3);
        for corner in line {
            assert!(points.contains(&corner), "{corner} is lost");
        }
        for pair in points.windows(2) {
            assert!(pair[0].distance(pair[1]) <= 0.3, "{pair:?} is too long");
        }
        assert_eq!(points.len(), 6, "4 pieces and 1");
    }
}
