//! Points, to find the nearest of.

use crate::cast::count;
use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Search structure over points, each with its number.
pub(crate) type NodeTree = RTree<GeomWithData<[f64; 3], u32>>;

/// Bulk-loads a tree over finite points.
pub(crate) fn point_tree(points: &[DVec3]) -> NodeTree {
    let entry = |(i, p): (usize, &DVec3)| GeomWithData::new(p.to_array(), count(i));
    RTree::bulk_load(points.iter().enumerate().map(entry).collect())
}
