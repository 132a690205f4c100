//! Blades' edges as polylines: where they are divided, and what they sweep.

use glam::DVec3;

use crate::bounds::Bounds;

/// Number of pieces of a length that is `ratio` of them.
#[allow(clippy::cast_possible_truncation, reason = "clamped to what fits")]
pub(crate) fn pieces(ratio: f64) -> u32 {
    // So that a length of a whole number of pieces is not one more, whatever the last bit says.
    let rounding = 1.0 - 1e-9;
    (ratio * rounding).ceil().clamp(1.0, 1e6) as u32
}

/// Fractions of a segment at which it is divided, its start included: `ratio` pieces would be its whole length.
pub(crate) fn shares(part: Option<(f64, f64)>, ratio: f64) -> Vec<f64> {
    let Some((start, end)) = part else {
        return vec![0.0];
    };
    let count = pieces((end - start) * ratio);
    let share = |piece: u32| start + (end - start) * (f64::from(piece) / f64::from(count));
    let mut shares: Vec<f64> = (0..count).map(share).collect();
    if start > 0.0 {
        shares.insert(0, 0.0);
    }
    if end < 1.0 {
        shares.push(end);
    }
    shares
}

/// Divides each segment of a polyline at its fractions.
pub(crate) fn divided(line: &[DVec3], shares: &[Vec<f64>]) -> Vec<DVec3> {
    let mut points = Vec::new();
    for (ends, shares) in line.windows(2).zip(shares) {
        points.extend(shares.iter().map(|&share| ends[0].lerp(ends[1], share)));
    }
    points.extend(line.last());
    points
}

/// Equally spaced points along a polyline (m), its ends included; the same point again and again where the
/// polyline has no length, none where it has no point.
#[must_use]
pub fn resampled(line: &[DVec3], count: usize) -> Vec<DVec3> {
    if line.len() < 2 {
        return line.iter().cycle().copied().take(count).collect();
    }
    let lengths = line.windows(2).map(|ends| ends[0].distance(ends[1]));
    let lengths: Vec<f64> = lengths.collect();
    let total: f64 = lengths.iter().sum();
    let mut points = Vec::with_capacity(count);
    let (mut segment, mut passed, mut reached) = (0, 0.0, 0.0);
    for k in 0..count {
        while segment + 1 < lengths.len() && passed + lengths[segment] < reached {
            passed += lengths[segment];
            segment += 1;
        }
        let length = lengths[segment];
        let share = if length > 0.0 {
            ((reached - passed) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        points.push(line[segment].lerp(line[segment + 1], share));
        if k + 1 < count {
            let next = (k + 1) as f64 / (count - 1) as f64;
            reached = total * next;
        }
    }
    points
}

/// Largest distance (m) of two points in the same position of two lines; 0 of none.
#[must_use]
pub fn largest_distance(from: &[DVec3], to: &[DVec3]) -> f64 {
    let moves = from.iter().zip(to).map(|(from, to)| from.distance(*to));
    moves.fold(0.0, f64::max)
}

/// The surface between two positions of a line: two triangles a segment.
pub(crate) fn swept_surface(from: &[DVec3], to: &[DVec3]) -> Vec<[DVec3; 3]> {
    let pairs = from.windows(2).zip(to.windows(2));
    pairs
        .flat_map(|(a, b)| [[a[0], a[1], b[0]], [b[0], a[1], b[1]]])
        .collect()
}

/// Spans the strip between two lines of vertices, each with its position along the line.
pub(crate) fn span<V: Copy>(old: &[(f64, V)], new: &[(f64, V)], mut add: impl FnMut([V; 3])) {
    let (mut i, mut j) = (0, 0);
    while i + 1 < old.len() || j + 1 < new.len() {
        let move_old = match (old.get(i + 1), new.get(j + 1)) {
            (Some(old), Some(new)) => old.0 <= new.0,
            (old, _) => old.is_some(),
        };
        if move_old {
            add([old[i].1, old[i + 1].1, new[j].1]);
            i += 1;
        } else {
            add([new[j].1, old[i].1, new[j + 1].1]);
            j += 1;
        }
    }
}

/// The part of a path, from 0 to 1, that lies in a box, if any does.
pub(crate) fn within(from: DVec3, to: DVec3, reach: &Bounds) -> Option<(f64, f64)> {
    let (mut start, mut end) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        let (x, way) = (from[axis], to[axis] - from[axis]);
        let (low, high) = (reach.low[axis], reach.high[axis]);
        if way == 0.0 {
            if !(low..=high).contains(&x) {
                return None;
            }
            continue;
        }
        let (a, b) = ((low - x) / way, (high - x) / way);
        start = start.max(a.min(b));
        end = end.min(a.max(b));
    }
    (start < end).then_some((start, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_resampled_evenly() {
        let line = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0)];
        let told = [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 0.5], [1.0, 1.0]];
        let points = resampled(&line, 5);
        assert_eq!(points.len(), 5, "as many as asked");
        for (point, [x, y]) in points.iter().zip(told) {
            assert!(point.distance(DVec3::new(x, y, 0.0)) < 1e-12, "{points:?}");
        }
        assert_eq!(resampled(&[DVec3::X, DVec3::X], 3), [DVec3::X; 3], "a dot");
        assert_eq!(resampled(&[DVec3::X], 2), [DVec3::X; 2], "a point");
        assert_eq!(resampled(&[], 2), [], "nothing");
    }

    #[test]
    fn a_way_lies_in_a_box_from_face_to_face() {
        let reach = Bounds::of(&[DVec3::ZERO, DVec3::ONE]);
        let at = |x: f64| DVec3::new(x, 0.5, 0.5);
        let (start, end) = within(at(-1.0), at(3.0), &reach).expect("it passes");
        assert!((start - 0.25).abs() < 1e-15 && (end - 0.5).abs() < 1e-15);
        assert_eq!(within(at(-2.0), at(-1.0), &reach), None, "before it");
        let beside = DVec3::new(0.5, 2.0, 0.5);
        assert_eq!(within(beside, beside + DVec3::X, &reach), None, "beside it");
    }
}
