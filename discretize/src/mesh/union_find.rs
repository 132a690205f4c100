//! Groups of what is joined.

use crate::mesh::index;

/// Root of a union-find tree, halving the path.
pub(crate) fn find(root: &mut [u32], mut v: u32) -> u32 {
    while root[v as usize] != v {
        root[v as usize] = root[root[v as usize] as usize];
        v = root[v as usize];
    }
    v
}

/// Number of the group of each entry, in the order of their first entries, and how many there are.
pub(crate) fn group(root: &mut [u32]) -> (Vec<u32>, usize) {
    let mut number = vec![u32::MAX; root.len()];
    let mut count = 0;
    let groups = (0..root.len())
        .map(|t| {
            let r = find(root, index(t)) as usize;
            if number[r] == u32::MAX {
                number[r] = index(count);
                count += 1;
            }
            number[r]
        })
        .collect();
    (groups, count)
}
