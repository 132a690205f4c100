//! Trees of boxes and slabs over triangles that come one by one; an edge is a triangle without area.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3Swizzles};

use crate::bounds::Bounds;
use crate::predicate::segment_crosses_triangle;

/// Triangles per leaf.
const LEAF: usize = 8;
/// Triangles from which trees are no longer merged; bounds the work that one new triangle can cause.
const LARGEST: usize = 2048;
/// Round-off of a dot product with a unit vector, relative to the point's largest coordinate, with room
/// (the bound is `3 · sqrt(3) · 2^-53`, 5.8e-16).
const ROUND_OFF: f64 = 1e-14;

/// A box and a slab that both contain some points.
///
/// The slab is what makes it quick: points on one side of a nearly flat sheet are separated from it at
/// the root.
#[derive(Debug, Clone, Copy)]
struct Hull {
    bounds: Bounds,
    normal: DVec3,
    /// Range of the dot product with `normal`, with the round-off added.
    least: f64,
    most: f64,
}

/// What a query asks of a hull.
struct HullQuery {
    bounds: Bounds,
    a: DVec3,
    b: DVec3,
    middle: DVec3,
    half: DVec3,
    round_off: f64,
}

/// Round-off of the dot product of a unit vector with any point of the box.
fn round_off(bounds: &Bounds) -> f64 {
    ROUND_OFF * bounds.low.abs().max(bounds.high.abs()).max_element()
}

impl HullQuery {
    fn new(a: DVec3, b: DVec3) -> Self {
        let bounds = Bounds {
            low: a.min(b),
            high: a.max(b),
        };
        Self {
            round_off: round_off(&bounds),
            bounds,
            a,
            b,
            middle: 0.5 * (a + b),
            half: 0.5 * (b - a),
        }
    }

    /// Whether the segment certainly has no point in common with what the hull holds.
    fn misses(&self, hull: &Hull) -> bool {
        if !self.bounds.meets(&hull.bounds) {
            return true;
        }
        let (a, b) = (hull.normal.dot(self.a), hull.normal.dot(self.b));
        if a.max(b) < hull.least - self.round_off || a.min(b) > hull.most + self.round_off {
            return true;
        }
        // The box and the segment's line, seen along each axis; the round-off of a moment is below
        // a tenth of the slack.
        let size = 0.5 * (hull.bounds.high - hull.bounds.low);
        let moment = (self.middle - 0.5 * (hull.bounds.high + hull.bounds.low))
            .cross(self.half)
            .abs();
        let direction = self.half.abs();
        let extent = size.yzx() * direction.zxy() + size.zxy() * direction.yzx();
        let slack = 4.0 * (self.round_off + round_off(&hull.bounds)) * direction.max_element();
        moment.cmpgt(extent + DVec3::splat(slack)).any()
    }
}

impl Hull {
    fn of(triangles: &[[DVec3; 3]]) -> Self {
        let mut bounds = Bounds::EMPTY;
        let mut sum = DVec3::ZERO;
        for [p, q, r] in triangles {
            bounds = bounds.union(Bounds::of(&[*p, *q, *r]));
            let area = (*q - *p).cross(*r - *p);
            // Triangles of either orientation count alike.
            sum += if area.dot(sum) < 0.0 { -area } else { area };
        }
        let normal = sum.normalize_or(DVec3::Z);
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in triangles.as_flattened() {
            let height = normal.dot(*corner);
            least = least.min(height);
            most = most.max(height);
        }
        let round_off = round_off(&bounds);
        Self {
            bounds,
            normal,
            least: least - round_off,
            most: most + round_off,
        }
    }
}

/// One full tree: `LEAF · 2^k` triangles sorted along a space-filling curve, two halves at each node.
#[derive(Debug, Clone)]
struct Tree {
    ids: Vec<u32>,
    triangles: Vec<[DVec3; 3]>,
    hulls: Vec<Hull>,
    /// Node `n` has the children `2 n` and `2 n + 1`; the root is 1, node 0 is not used.
    nodes: Vec<Hull>,
}

impl Tree {
    fn new(mut items: Vec<(u32, [DVec3; 3])>) -> Self {
        let middle = |t: &[DVec3; 3]| t[0] + t[1] + t[2];
        let points: Vec<DVec3> = items.iter().map(|(_, t)| middle(t)).collect();
        let bounds = Bounds::of(&points);
        let extent = (bounds.high - bounds.low)
            .max_element()
            .max(f64::MIN_POSITIVE);
        items.sort_by_cached_key(|(id, t)| (morton((middle(t) - bounds.low) / extent), *id));
        let (ids, triangles): (Vec<u32>, Vec<[DVec3; 3]>) = items.into_iter().unzip();
        let leaves = ids.len() / LEAF;
        let empty = Hull::of(&[]);
        let mut nodes = vec![empty; 2 * leaves];
        let mut width = 1;
        while width <= leaves {
            let share = ids.len() / width;
            for k in 0..width {
                nodes[width + k] = Hull::of(&triangles[k * share..(k + 1) * share]);
            }
            width *= 2;
        }
        let hull = |t: &[DVec3; 3]| Hull::of(std::slice::from_ref(t));
        Self {
            hulls: triangles.iter().map(hull).collect(),
            ids,
            triangles,
            nodes,
        }
    }

    /// Calls `f` with number and corners of every triangle whose hull is not missed.
    fn visit(
        &self,
        missed: impl Fn(&Hull) -> bool,
        mut f: impl FnMut(u32, &[DVec3; 3]) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let leaves = self.nodes.len() / 2;
        // One waiting node per level at most, and LARGEST / LEAF leaves have nine levels.
        let mut waiting = [1_usize; 12];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let node = waiting[count];
            if missed(&self.nodes[node]) {
                continue;
            }
            if node < leaves {
                waiting[count] = 2 * node + 1;
                waiting[count + 1] = 2 * node;
                count += 2;
                continue;
            }
            for k in (node - leaves) * LEAF..(node - leaves + 1) * LEAF {
                if !missed(&self.hulls[k]) {
                    f(self.ids[k], &self.triangles[k])?;
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// Interleaves the bits of three coordinates in 0..=1, 20 bits each.
fn morton(p: DVec3) -> u64 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "the cast saturates, and only the order matters"
    )]
    let cells = p.to_array().map(|c| (c * 1_048_575.0) as u64);
    let mut key = 0;
    for bit in (0..20).rev() {
        for cell in cells {
            key = 2 * key + (cell >> bit & 1);
        }
    }
    key
}

/// Triangles in trees of falling size; a new one is put aside until there are enough for a tree, and
/// trees of equal size become one (Bentley and Saxe 1980). A query costs a logarithm of the count and
/// allocates nothing.
#[derive(Debug, Clone, Default)]
pub(crate) struct Forest {
    trees: Vec<Tree>,
    waiting: Vec<(u32, [DVec3; 3])>,
    waiting_hulls: Vec<Hull>,
}

impl Forest {
    /// Adds a triangle under a number of the caller's choice.
    pub(crate) fn insert(&mut self, id: u32, triangle: [DVec3; 3]) {
        self.waiting.push((id, triangle));
        self.waiting_hulls.push(Hull::of(&[triangle]));
        if self.waiting.len() < LEAF {
            return;
        }
        self.waiting_hulls.clear();
        let mut items = std::mem::take(&mut self.waiting);
        while let Some(last) = self.trees.last()
            && last.ids.len() == items.len()
            && items.len() < LARGEST
            && let Some(last) = self.trees.pop()
        {
            items.extend(last.ids.into_iter().zip(last.triangles));
        }
        self.trees.push(Tree::new(items));
    }

    /// Calls `f` once with number and corners of each triangle that the segment `ab` may meet, until
    /// it breaks.
    pub(crate) fn on_segment(
        &self,
        a: DVec3,
        b: DVec3,
        f: impl FnMut(u32, &[DVec3; 3]) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let segment = HullQuery::new(a, b);
        self.visit(|hull| segment.misses(hull), f)
    }

    /// Whether the segment `ab` crosses a triangle; exact.
    pub(crate) fn crossed(&self, a: DVec3, b: DVec3) -> bool {
        self.on_segment(a, b, |_, &[p, q, r]| {
            if segment_crosses_triangle(a, b, p, q, r) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .is_break()
    }

    /// Calls `f` once with the number of each triangle whose box meets `near`.
    pub(crate) fn in_box(&self, near: &Bounds, mut f: impl FnMut(u32)) {
        let _ = self.visit(
            |hull| !hull.bounds.meets(near),
            |id, _| {
                f(id);
                ControlFlow::Continue(())
            },
        );
    }

    fn visit(
        &self,
        missed: impl Fn(&Hull) -> bool,
        mut f: impl FnMut(u32, &[DVec3; 3]) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        for tree in &self.trees {
            tree.visit(&missed, &mut f)?;
        }
        for ((id, triangle), hull) in self.waiting.iter().zip(&self.waiting_hulls) {
            if !missed(hull) {
                f(*id, triangle)?;
            }
        }
        ControlFlow::Continue(())
    }

    /// Bytes held on the heap, about.
    pub(crate) fn bytes(&self) -> usize {
        let per_triangle = 4 + size_of::<[DVec3; 3]>() + size_of::<Hull>();
        self.trees
            .iter()
            .map(|tree| tree.ids.len() * per_triangle + tree.nodes.len() * size_of::<Hull>())
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use testkit::cloud::Random;

    fn crossed(forest: &Forest, a: DVec3, b: DVec3) -> Vec<u32> {
        let mut found = Vec::new();
        let _ = forest.on_segment(a, b, |id, [p, q, r]| {
            found.extend(segment_crosses_triangle(a, b, *p, *q, *r).then_some(id));
            ControlFlow::Continue(())
        });
        found.sort_unstable();
        found
    }

    fn in_box(forest: &Forest, near: &Bounds) -> Vec<u32> {
        let mut found = Vec::new();
        forest.in_box(near, |id| found.push(id));
        found.sort_unstable();
        found
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

        /// Sheets and dust on a coarse lattice far from the origin: ties everywhere, the trees'
        /// planes through the query points, sizes over five decades.
        #[test]
        fn equal_to_brute_force(
            seed in 0_u64..1_000_000,
            count in 1_u32..700,
            scale in prop::sample::select(vec![1.0, 1e-6, 1e6]),
            place in prop::sample::select(vec![0.0, 1.0, 4096.0]),
            flat in any::<bool>(),
        ) {
            let mut random = Random::new(seed);
            let mut point = |size: f64| {
                let mut c = || (random.bits() % 9) as f64 - 4.0;
                let p = DVec3::new(c(), c(), c()) * size;
                scale * (DVec3::splat(place) + if flat { p.with_z(0.25 * (p.x + p.y)) } else { p })
            };
            let mut forest = Forest::default();
            let mut triangles = Vec::new();
            for id in 0..count {
                let at = point(1.0);
                let size = [1.0, 0.125, 1e-3, 32.0][id as usize % 4];
                let base = point(0.0);
                let t = [at, at + (point(size) - base), at + (point(size) - base)];
                forest.insert(id, t);
                triangles.push(t);
            }
            for _ in 0..40 {
                let (a, b) = (point(1.0), point(1.0));
                let those = |holds: &dyn Fn(&[DVec3; 3]) -> bool| -> Vec<u32> {
                    (0..count).filter(|&id| holds(&triangles[id as usize])).collect()
                };
                let brute = those(&|[p, q, r]| segment_crosses_triangle(a, b, *p, *q, *r));
                prop_assert_eq!(forest.crossed(a, b), !brute.is_empty());
                prop_assert_eq!(crossed(&forest, a, b), brute);
                let near = Bounds::of(&[a, b]);
                let brute = those(&|t| Bounds::of(t).meets(&near));
                prop_assert_eq!(in_box(&forest, &near), brute);
            }
        }
    }

    #[test]
    fn every_size_of_forest_holds_every_triangle_once() {
        let mut forest = Forest::default();
        let everything = Bounds::of(&[DVec3::splat(-9e9), DVec3::splat(9e9)]);
        for id in 0..6144_u32 {
            let at = DVec3::X * f64::from(id);
            forest.insert(id, [at, at + DVec3::Y, at + DVec3::Z]);
            if id % 97 == 0 || id > 6135 {
                let found = in_box(&forest, &everything);
                assert!(found.into_iter().eq(0..=id), "{id}");
            }
        }
        assert_eq!(forest.trees.len(), 3, "{}", forest.trees.len());
    }
}
