//! Node order: along a Hilbert curve, or layer by layer through a graph.

use glam::DVec3;

use crate::mesh::{Bounds, index};

/// Bits per axis of the curve.
const BITS: u32 = 20;

/// An order of points with its map both ways.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct NodeOrder {
    /// Old index of each new position.
    pub old_of_new: Vec<u32>,
    /// New position of each old index.
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
    both_ways(keyed.into_iter().map(|(_, i)| i).collect())
}

/// Orders the nodes of a graph layer by layer from one of its ends to the other, each layer in the order in
/// which the one before it reaches it, nodes of few neighbours first, and all of it backwards (reverse
/// Cuthill-McKee: Cuthill 1969, George 1971), part after part. What rows name is then a few runs of nodes
/// that move on with the row, which processors fetch ahead; along a Hilbert curve it is nearer, and anywhere.
///
/// # Arguments
/// * `offsets`, `indices` -- neighbours as symmetric CSR, `n + 1` and all pairs.
///
/// # Panics
/// If an index is out of range.
#[must_use]
pub fn layered_order(offsets: &[u32], indices: &[u32]) -> NodeOrder {
    let n = offsets.len().saturating_sub(1);
    let row = |node: u32| {
        let node = node as usize;
        &indices[offsets[node] as usize..offsets[node + 1] as usize]
    };
    let mut near = Vec::new();
    // Appends what a node reaches over nodes that are not `done` yet.
    let mut walk = |start: u32, done: &mut [bool], order: &mut Vec<u32>| {
        let mut next = order.len();
        order.push(start);
        done[start as usize] = true;
        while let Some(&node) = order.get(next) {
            next += 1;
            near.clear();
            near.extend(
                row(node)
                    .iter()
                    .filter(|&&other| !done[other as usize])
                    .copied(),
            );
            near.sort_unstable_by_key(|&other| (row(other).len(), other));
            for &other in &near {
                done[other as usize] = true;
            }
            order.extend_from_slice(&near);
        }
    };
    let mut done = vec![false; n];
    let mut old_of_new: Vec<u32> = Vec::with_capacity(n);
    let mut part = Vec::new();
    for node in 0..index(n) {
        if done[node as usize] {
            continue;
        }
        // What is found last is an end; it begins.
        part.clear();
        walk(node, &mut done, &mut part);
        for &node in &part {
            done[node as usize] = false;
        }
        let end = part.last().copied().unwrap_or(node);
        walk(end, &mut done, &mut old_of_new);
    }
    old_of_new.reverse();
    both_ways(old_of_new)
}

/// An order from the old index of each new position.
fn both_ways(old_of_new: Vec<u32>) -> NodeOrder {
    let mut new_of_old = vec![0; old_of_new.len()];
    for (new, &old) in old_of_new.iter().enumerate() {
        new_of_old[old as usize] = index(new);
    }
    NodeOrder {
        old_of_new,
        new_of_old,
    }
}

#[allow(clippy::cast_possible_truncation, reason = "scaled to 0..2^20 before")]
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
    use crate::mesh::rows;
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

    /// Neighbours on a lattice of `sides` whose nodes are named by `name`, as CSR.
    fn lattice_edges(sides: [usize; 3], name: &[u32]) -> (Vec<u32>, Vec<u32>) {
        let steps = [1, sides[0], sides[0] * sides[1]];
        let mut edges = Vec::new();
        for (k, &a) in name.iter().enumerate() {
            for (step, side) in steps.into_iter().zip(sides) {
                if k / step % side + 1 < side {
                    let b = name[k + step];
                    edges.extend([(a, b), (b, a)]);
                }
            }
        }
        edges.sort_unstable();
        let (offsets, indices) = rows(name.len(), edges.into_iter());
        (offsets.into_iter().map(index).collect(), indices)
    }

    /// Numbers in no order.
    fn shuffled(count: usize) -> Vec<u32> {
        let mut keyed: Vec<(u64, u32)> = uniform(count, 1.0, 9)
            .iter()
            .zip(0..)
            .map(|(x, i)| (x.x.to_bits(), i))
            .collect();
        keyed.sort_unstable();
        keyed.into_iter().map(|(_, i)| i).collect()
    }

    /// Neighbours in a bar are within two of its cross-sections' diagonal layers, however its nodes were named.
    #[test]
    fn layers_follow_each_other() {
        let sides = [3, 4, 50];
        let (offsets, indices) = lattice_edges(sides, &shuffled(600));
        let order = layered_order(&offsets, &indices);
        let mut farthest = 0;
        for (old, row) in offsets.windows(2).enumerate() {
            for &other in &indices[row[0] as usize..row[1] as usize] {
                let (a, b) = (order.new_of_old[old], order.new_of_old[other as usize]);
                farthest = farthest.max(a.abs_diff(b));
            }
        }
        assert!(farthest <= 2 * 12, "a row names a node {farthest} away");
        let again = layered_order(&offsets, &indices);
        assert_eq!(order, again, "the same every time");
    }

    #[test]
    fn parts_follow_each_other_and_lone_nodes_are_kept() {
        // Two paths and a node without neighbours: 0-2-4, 1-5, 3.
        let (offsets, indices) = ([0, 1, 2, 4, 4, 5, 6], [2, 5, 0, 4, 2, 1]);
        let order = layered_order(&offsets, &indices);
        assert_eq!(order.old_of_new, [3, 1, 5, 0, 2, 4]);
        assert_eq!(order.apply(&order.new_of_old.clone()).len(), 6);
        for (old, &new) in order.new_of_old.iter().enumerate() {
            assert_eq!(order.old_of_new[new as usize] as usize, old);
        }
        assert_eq!(layered_order(&[0], &[]).old_of_new, [0_u32; 0]);
    }
}
