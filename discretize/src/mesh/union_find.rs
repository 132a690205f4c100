//! Groups of what is joined.

use crate::mesh::index;

/// Entries in groups: a union-find forest whose roots are the groups' smallest entries.
pub(crate) struct Groups(Vec<u32>);

impl Groups {
    /// Entries each in a group of its own.
    pub(crate) fn new(entries: usize) -> Self {
        Self((0..entries).map(index).collect())
    }

    /// Smallest entry of a group, halving the path to it.
    pub(crate) fn find(&mut self, mut v: u32) -> u32 {
        let root = &mut self.0;
        while root[v as usize] != v {
            root[v as usize] = root[root[v as usize] as usize];
            v = root[v as usize];
        }
        v
    }

    /// Joins the groups of two entries; whether they were two.
    pub(crate) fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
        a != b
    }

    /// Number of the group of each of some entries, in the order in which groups come first, and how many
    /// there are.
    pub(crate) fn numbers(&mut self, of: impl Iterator<Item = u32>) -> (Vec<u32>, usize) {
        let mut number = vec![u32::MAX; self.0.len()];
        let mut count = 0;
        let mut numbers = Vec::with_capacity(of.size_hint().0);
        for v in of {
            let number = &mut number[self.find(v) as usize];
            if *number == u32::MAX {
                *number = index(count);
                count += 1;
            }
            numbers.push(*number);
        }
        (numbers, count)
    }
}
