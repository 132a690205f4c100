//! What collections take on the heap.

use rstar::{ParentNode, RTree, RTreeObject};
use std::collections::HashMap;

/// Bytes of a hash table: a slot and a byte of control for each position, of which it fills seven of eight at most.
/// What values hold elsewhere is not counted.
pub(crate) fn map_bytes<K, V>(map: &HashMap<K, V>) -> usize {
    map.capacity() / 7 * 8 * (size_of::<(K, V)>() + 1)
}

/// Bytes of a search tree, about: an entry is as large as an inner node, lists of up to seven are two thirds full,
/// and there is an inner node for every four entries.
pub(crate) fn tree_bytes<T: RTreeObject>(tree: &RTree<T>) -> usize {
    let entry = size_of::<T>().max(size_of::<ParentNode<T>>()) + 8;
    tree.size() * entry * 15 / 8
}
