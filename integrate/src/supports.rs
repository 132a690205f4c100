//! Which nodes are fixed, along which directions, and which follow a path.

use crate::trajectory::Trajectory;
use glam::{DMat3, DVec3};

const FREE: u32 = u32::MAX;

/// One fixed node.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NodeSupport {
    /// Index of the node.
    pub node: u32,
    /// Projector on the directions in which it may still move.
    pub free: DMat3,
    /// Path along the fixed directions, an index into [`BoundaryConditions::paths`].
    pub path: Option<u32>,
    /// Position (m) that the path displaces and turns about the origin.
    pub origin: DVec3,
}

impl NodeSupport {
    /// The fixed part of a vector.
    #[must_use]
    pub fn held(&self, vector: DVec3) -> DVec3 {
        vector - self.free * vector
    }
}

/// Fixed and driven nodes, per direction; a node without an entry is free.
///
/// Several conditions on one node add up: a node on two symmetry planes keeps their common line.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BoundaryConditions {
    entry: Vec<u32>,
    supports: Vec<NodeSupport>,
    paths: Vec<Trajectory>,
}

impl BoundaryConditions {
    /// All of `node_count` nodes free.
    #[must_use]
    pub fn free(node_count: usize) -> Self {
        Self {
            entry: vec![FREE; node_count],
            supports: Vec::new(),
            paths: Vec::new(),
        }
    }

    /// Holds the listed nodes in all directions.
    #[must_use]
    pub fn fixed(node_count: usize, nodes: &[u32]) -> Self {
        let mut supports = Self::free(node_count);
        for &node in nodes {
            supports.fix(node);
        }
        supports
    }

    /// Holds the nodes in all directions whose position (m) satisfies a condition.
    #[must_use]
    pub fn fixed_where(positions: &[DVec3], held: impl Fn(DVec3) -> bool) -> Self {
        let nodes = (0_u32..).zip(positions).filter(|(_, x)| held(**x));
        let nodes: Vec<u32> = nodes.map(|(node, _)| node).collect();
        Self::fixed(positions.len(), &nodes)
    }

    /// The supports of a range of nodes, which are then counted from its start.
    ///
    /// # Panics
    /// If the range goes beyond the nodes.
    #[must_use]
    pub fn part(&self, nodes: std::ops::Range<usize>) -> Self {
        let mut part = Self::free(nodes.len());
        part.paths.clone_from(&self.paths);
        for support in &self.supports {
            let node = support.node as usize;
            if nodes.contains(&node) {
                part.entry[node - nodes.start] = index(part.supports.len());
                part.supports.push(NodeSupport {
                    node: index(node - nodes.start),
                    ..*support
                });
            }
        }
        part
    }

    /// Heap bytes of the entries, their paths and the table that finds them by node.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let keys: usize = self.paths.iter().map(Trajectory::bytes).sum();
        keys + size_of_val(&*self.entry) + size_of_val(&*self.supports) + size_of_val(&*self.paths)
    }

    /// Number of nodes, free or not.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.entry.len()
    }

    /// Fixed nodes, in the order in which they were first named.
    #[must_use]
    pub fn entries(&self) -> &[NodeSupport] {
        &self.supports
    }

    /// Nodes that stay where they are, in the order in which they were first named.
    #[must_use]
    pub fn fixed_nodes(&self) -> Vec<u32> {
        let supports = self.supports.iter();
        let fixed =
            supports.filter(|support| support.free == DMat3::ZERO && support.path.is_none());
        fixed.map(|support| support.node).collect()
    }

    /// Paths that driven nodes follow.
    #[must_use]
    pub fn paths(&self) -> &[Trajectory] {
        &self.paths
    }

    /// The entry of a node, if it is fixed in any direction.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    #[inline]
    pub fn of(&self, node: usize) -> Option<&NodeSupport> {
        // `FREE` lies behind any entry, so that one lookup answers both questions.
        self.supports.get(self.entry[node] as usize)
    }

    /// Holds a node in all directions.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn fix(&mut self, node: u32) {
        self.entry_mut(node).free = DMat3::ZERO;
    }

    /// Holds a node along the axes marked `true`.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn fix_axes(&mut self, node: u32, axes: [bool; 3]) {
        for (held, axis) in axes.iter().zip(DVec3::AXES) {
            if *held {
                self.hold(node, axis);
            }
        }
    }

    /// Keeps a node on the plane through it with this normal (any length): a symmetry plane or a
    /// frictionless wall.
    ///
    /// # Panics
    /// If there is no such node, or the normal is zero or not finite.
    pub fn slide(&mut self, node: u32, normal: DVec3) {
        let normal = normal.try_normalize();
        assert!(
            normal.is_some(),
            "a plane's normal must be finite and not zero"
        );
        if let Some(normal) = normal {
            self.hold(node, normal);
        }
    }

    /// Moves nodes along a path, rigidly together: from `positions` X (m, of all nodes) to `R X + u`; directions not
    /// in `axes` stay as they are.
    ///
    /// # Panics
    /// If there is no such node, or `positions` is not as long as there are nodes.
    pub fn drive(&mut self, nodes: &[u32], axes: [bool; 3], path: Trajectory, positions: &[DVec3]) {
        assert_eq!(positions.len(), self.entry.len(), "one position per node");
        let index = index(self.paths.len());
        self.paths.push(path);
        for &node in nodes {
            self.fix_axes(node, axes);
            let entry = self.entry_mut(node);
            entry.path = Some(index);
            entry.origin = positions[node as usize];
        }
    }

    /// Sets the fixed part of each vector to zero.
    ///
    /// # Panics
    /// If `vectors` is not as long as there are nodes.
    pub fn project(&self, vectors: &mut [DVec3]) {
        assert_eq!(vectors.len(), self.entry.len(), "one vector per node");
        for support in &self.supports {
            let vector = &mut vectors[support.node as usize];
            *vector = support.free * *vector;
        }
    }

    /// Gives the fixed part of each of `positions` (m) the value that it has in `kept` (m).
    ///
    /// # Panics
    /// If a slice is not as long as there are nodes.
    pub fn keep(&self, kept: &[DVec3], positions: &mut [DVec3]) {
        assert_eq!(kept.len(), self.entry.len(), "one kept position per node");
        assert_eq!(positions.len(), self.entry.len(), "one position per node");
        for support in &self.supports {
            let node = support.node as usize;
            positions[node] = kept[node] + support.free * (positions[node] - kept[node]);
        }
    }

    /// Moves driven nodes to where their paths are at `time` (s).
    ///
    /// # Panics
    /// If `positions` is not as long as there are nodes.
    pub fn place(&self, time: f64, positions: &mut [DVec3]) {
        assert_eq!(positions.len(), self.entry.len(), "one position per node");
        for support in &self.supports {
            if let Some((target, _)) = self.target(support, time) {
                let x = &mut positions[support.node as usize];
                *x = support.free * *x + support.held(target);
            }
        }
    }

    /// Position (m) and velocity (m/s) of a driven node; only their fixed parts count.
    pub(crate) fn target(&self, support: &NodeSupport, time: f64) -> Option<(DVec3, DVec3)> {
        let path = self.paths.get(support.path? as usize)?;
        Some(path.place(support.origin, time))
    }

    fn hold(&mut self, node: u32, direction: DVec3) {
        let entry = self.entry_mut(node);
        let rest = entry.free * direction;
        let length = rest.length();
        // Below this, the direction is held already, up to round-off.
        if length > 1e-9 {
            let unit = rest / length;
            let outer = DMat3::from_cols(unit * unit.x, unit * unit.y, unit * unit.z);
            entry.free -= outer;
        }
    }

    fn entry_mut(&mut self, node: u32) -> &mut NodeSupport {
        let slot = &mut self.entry[node as usize];
        if *slot == FREE {
            *slot = index(self.supports.len());
            self.supports.push(NodeSupport {
                node,
                free: DMat3::IDENTITY,
                path: None,
                origin: DVec3::ZERO,
            });
        }
        &mut self.supports[*slot as usize]
    }
}

fn index(count: usize) -> u32 {
    u32::try_from(count).expect("fewer than 2^32 supports, as node indices are u32")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::Trajectory;

    #[test]
    fn conditions_on_one_node_add_up() {
        let mut supports = BoundaryConditions::free(3);
        supports.slide(1, DVec3::new(1.0, 1.0, 0.0));
        supports.slide(1, DVec3::new(2.0, 2.0, 0.0));
        supports.slide(1, DVec3::new(1.0, -1.0, 0.0));
        let mut v = [DVec3::ONE; 3];
        supports.project(&mut v);
        assert_eq!(v[0], DVec3::ONE, "free node");
        assert!((v[1] - DVec3::Z).length() < 1e-15, "{}", v[1]);
        supports.fix_axes(2, [true, false, true]);
        supports.project(&mut v);
        assert_eq!(v[2], DVec3::Y, "exact for axes");
        let mut read = [DVec3::splat(7.0); 3];
        supports.keep(&v, &mut read);
        assert_eq!(read[0], DVec3::splat(7.0), "free node");
        assert_eq!(read[2], DVec3::new(v[2].x, 7.0, v[2].z), "exact for axes");
        supports.fix(1);
        supports.project(&mut v);
        assert_eq!(v[1], DVec3::ZERO, "fixed");
        assert_eq!(supports.entries().len(), 2, "one entry per node");
    }

    #[test]
    fn a_part_holds_what_the_whole_holds_there() {
        let x = [DVec3::ZERO; 5];
        let mut whole = BoundaryConditions::fixed(5, &[3, 0]);
        whole.slide(4, DVec3::ONE);
        let path = Trajectory::ramp(0.0, 1.0, DVec3::X).unwrap();
        whole.drive(&[2], [true, false, false], path, &x);
        let part = whole.part(2..5);
        assert_eq!(part.node_count(), 3);
        assert_eq!(part.paths(), whole.paths());
        assert_eq!(part.entries().len(), 3, "all but node 0");
        for node in 2..5 {
            let (mine, theirs) = (part.of(node - 2).unwrap(), whole.of(node).unwrap());
            assert_eq!(mine.node as usize + 2, node);
            assert_eq!((mine.free, mine.path), (theirs.free, theirs.path));
        }
        assert_eq!(
            whole.part(1..2),
            BoundaryConditions {
                paths: whole.paths.clone(),
                ..BoundaryConditions::free(1)
            }
        );
    }

    #[test]
    fn driven_nodes_keep_their_free_directions() {
        let mut supports = BoundaryConditions::free(2);
        let x = [DVec3::X, DVec3::Y];
        let path = Trajectory::ramp(0.0, 1.0, DVec3::new(9.0, 9.0, 2.0)).unwrap();
        supports.drive(&[1], [false, false, true], path, &x);
        let mut moved = [DVec3::X, DVec3::new(0.5, 0.5, 0.1)];
        supports.place(1.0, &mut moved);
        assert_eq!(moved[0], DVec3::X, "free node");
        assert_eq!(moved[1], DVec3::new(0.5, 0.5, 2.0), "driven along z");
    }
}
