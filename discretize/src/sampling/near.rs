//! Points found by position.

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::mesh::index;

type NearEntry = GeomWithData<[f64; 3], u32>;

/// Numbered points in a tree of boxes.
#[derive(Default)]
pub(crate) struct Near(RTree<NearEntry>);

impl Near {
    /// Numbers the points from 0.
    pub(crate) fn new(points: &[DVec3]) -> Self {
        let numbered = points.iter().enumerate();
        let entries = numbered.map(|(k, p)| NearEntry::new(p.to_array(), index(k)));
        Self(RTree::bulk_load(entries.collect()))
    }

    pub(crate) fn insert(&mut self, p: DVec3, id: u32) {
        self.0.insert(NearEntry::new(p.to_array(), id));
    }

    /// Points within a radius, in no order.
    pub(crate) fn within(&self, p: DVec3, radius: f64) -> impl Iterator<Item = u32> + '_ {
        let found = self.0.locate_within_distance(p.to_array(), radius * radius);
        found.map(|entry| entry.data)
    }

    /// Ids of the points within a radius, ascending.
    pub(crate) fn within_into(&self, p: DVec3, radius: f64, out: &mut Vec<u32>) {
        out.clear();
        out.extend(self.within(p, radius));
        out.sort_unstable();
    }

    /// The nearest point, the one of smaller id where two are equally near; `u32::MAX` if there is none.
    pub(crate) fn nearest(&self, p: DVec3) -> u32 {
        let nearest = self.0.nearest_neighbors(&p.to_array());
        let ids = nearest.into_iter().map(|entry| entry.data);
        ids.min().unwrap_or(u32::MAX)
    }

    /// The nearest points, at most so many, the nearest first and of equally near ones that of smaller id.
    pub(crate) fn several(&self, p: DVec3, most: usize) -> Vec<u32> {
        let mut found: Vec<(f64, u32)> = Vec::new();
        for (entry, distance) in self.0.nearest_neighbor_iter_with_distance_2(p.to_array()) {
            if found.len() >= most && found.last().is_some_and(|last| last.0 < distance) {
                break;
            }
            found.push((distance, entry.data));
        }
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.truncate(most);
        found.into_iter().map(|(_, id)| id).collect()
    }

    /// All points, the nearest first.
    pub(crate) fn ascending(&self, p: DVec3) -> impl Iterator<Item = u32> + '_ {
        let found = self.0.nearest_neighbor_iter(p.to_array());
        found.map(|entry| entry.data)
    }
}
