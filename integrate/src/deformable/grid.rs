//! Candidate pairs by a grid of cells.

use super::disks::index;
use glam::DVec3;

/// Cells along an axis at most.
const MOST_CELLS: f64 = 64.0;

/// Points with others that they meet, as ranges of the second list; both ascending.
///
/// # Arguments
/// * `open` -- whether a point may meet others at all.
/// * `far` -- distance (m) beyond which nothing meets.
/// * `meets` -- whether a point meets another.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "from 0 to MOST_CELLS"
)]
pub(super) fn candidates(
    points: &[DVec3],
    open: &[bool],
    far: f64,
    meets: impl Fn(u32, u32) -> bool,
) -> (Vec<(u32, [u32; 2])>, Vec<u32>) {
    let all = || {
        (0_u32..)
            .zip(points)
            .zip(open)
            .filter(|(_, open)| **open)
            .map(|(point, _)| point)
    };
    let low = all().map(|(_, x)| *x).fold(DVec3::INFINITY, DVec3::min);
    let high = all().map(|(_, x)| *x).fold(DVec3::NEG_INFINITY, DVec3::max);
    let (mut found, mut lists) = (Vec::new(), Vec::new());
    if !(low.is_finite() && high.is_finite()) {
        return (found, lists);
    }
    let side = far
        .max((high - low).max_element() / MOST_CELLS)
        .max(f64::MIN_POSITIVE);
    let cell = |x: DVec3| ((x - low) / side).floor().to_array().map(|c| c as usize);
    let [nx, ny, nz] = cell(high).map(|last| last + 1);
    let mut starts = vec![0_usize; nx * ny * nz + 1];
    let number = |[i, j, k]: [usize; 3]| (k * ny + j) * nx + i;
    for (_, x) in all() {
        starts[number(cell(*x)) + 1] += 1;
    }
    for c in 1..starts.len() {
        starts[c] += starts[c - 1];
    }
    let (mut next, mut members) = (starts.clone(), vec![0_u32; points.len()]);
    for (point, x) in all() {
        let at = &mut next[number(cell(*x))];
        members[*at] = point;
        *at += 1;
    }
    for (point, x) in all() {
        let begin = lists.len();
        let [i, j, k] = cell(*x);
        let around = |c: usize, n: usize| c.saturating_sub(1)..=(c + 1).min(n - 1);
        for c in around(k, nz) {
            for b in around(j, ny) {
                for a in around(i, nx) {
                    let cell = number([a, b, c]);
                    let others = &members[starts[cell]..starts[cell + 1]];
                    lists.extend(
                        others
                            .iter()
                            .filter(|&&other| other != point && meets(point, other)),
                    );
                }
            }
        }
        if lists.len() > begin {
            lists[begin..].sort_unstable();
            found.push((point, [index(begin), index(lists.len())]));
        }
    }
    (found, lists)
}
