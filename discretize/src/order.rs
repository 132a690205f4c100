//! Node order along a Hilbert curve.

use glam::DVec3;

use crate::mesh::{Bounds, index};

/// Bits per axis of the curve.
const BITS: u32 = 20;

/// An order of points with its map both ways.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeOrder {
    /// Old index of each new place.
    pub old_of_new: Vec<u32>,
    /// New place of each old index.
    pub new_of_old: Vec<u32>,
}

impl NodeOrder {
    /// Puts an array into the new order.
    ///
    /// # Panics
    /// If `values` has another length than the order.
    #[must_use]
    pub fn apply<T: Copy>(&self, values: &[T]) -> Vec<T> {
        assert_eq!(values.len(), self.old_of_new.len(), "one value per point");
        self.old_of_new
            .iter()
            .map(|&o| values[o as usize])
            .collect()
    }
}

/// Orders points along a Hilbert curve through their cubic box (Skilling 2004), equal cells by
/// index, so that neighbours in space are near in memory.
#[must_use]
pub fn space_filling_order(points: &[DVec3]) -> NodeOrder {
    let bounds = Bounds::of(points.iter().copied());
    let edge = bounds.size().max_element();
    let scale = if edge > 0.0 {
        f64::from((1_u32 << BITS) - 1) / edge
    } else {
        0.0
    };
    let mut keyed: Vec<(u64, u32)> = points
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let at = (*p - bounds.min) * scale;
            (hilbert([cell(at.x), cell(at.y), cell(at.z)]), index(i))
        })
        .collect();
    keyed.sort_unstable();
    let old_of_new: Vec<u32> = keyed.into_iter().map(|(_, i)| i).collect();
    let mut new_of_old = vec![0; points.len()];
    for (new, &old) in old_of_new.iter().enumerate() {
        new_of_old[old as usize] = index(new);
    }
    NodeOrder {
        old_of_new,
        new_of_old,
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "scaled to 0..2^20 before"
)]
fn cell(x: f64) -> u32 {
    x as u32
}

/// Distance along the Hilbert curve (Skilling 2004, `AxestoTranspose`).
fn hilbert(mut x: [u32; 3]) -> u64 {
    let mut q = 1 << (BITS - 1);
    while q > 1 {
        let p = q - 1;
        for i in 0..3 {
            if x[i] & q != 0 {
                x[0] ^= p;
            } else {
                let t = (x[0] ^ x[i]) & p;
                x[0] ^= t;
                x[i] ^= t;
            }
        }
        q >>= 1;
    }
    x[1] ^= x[0];
    x[2] ^= x[1];
    let mut t = 0;
    let mut q = 1 << (BITS - 1);
    while q > 1 {
        if x[2] & q != 0 {
            t ^= q - 1;
        }
        q >>= 1;
    }
    let mut key = 0_u64;
    for bit in (0..BITS).rev() {
        for axis in x {
            key = key << 1 | u64::from((axis ^ t) >> bit & 1);
        }
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::cloud::uniform;

    /// On a full lattice of 8³ points a Hilbert curve goes from face neighbour to face neighbour; any
    /// other order of them, Morton's too, jumps.
    #[test]
    fn the_curve_never_jumps() {
        let lattice: Vec<DVec3> = (0..512_u32)
            .map(|i| DVec3::new(f64::from(i % 8), f64::from(i / 8 % 8), f64::from(i / 64)))
            .collect();
        for scale in [1e-6, 1.0, 3.7e5] {
            let placed: Vec<DVec3> = lattice.iter().map(|x| (*x - 2.3) * scale).collect();
            let path = space_filling_order(&placed).apply(&lattice);
            for pair in path.windows(2) {
                let step = pair[0].distance(pair[1]);
                assert!((step - 1.0).abs() < 1e-12, "{scale}: {pair:?}");
            }
        }
    }

    #[test]
    fn maps_lead_both_ways() {
        let mut points = uniform(777, 2.0, 5);
        points.extend_from_within(..50);
        let order = space_filling_order(&points);
        let back = NodeOrder {
            old_of_new: order.new_of_old.clone(),
            new_of_old: order.old_of_new.clone(),
        };
        assert_eq!(back.apply(&order.apply(&points)), points, "there and back");
        assert_eq!(order, space_filling_order(&points), "the same every time");
        for few in [&points[..0], &points[..1], &[DVec3::ONE; 3]] {
            let order = space_filling_order(few);
            let mut seen = order.old_of_new.clone();
            seen.sort_unstable();
            assert!(seen.iter().copied().eq(0..index(few.len())), "{few:?}");
        }
    }
}
