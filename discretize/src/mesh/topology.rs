//! Edges of a triangle mesh: neighbours, orientation, holes, parts, genus.

use crate::mesh::{Groups, Mesh, index, rows};

/// One side of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// Smaller and larger corner.
    ends: [u32; 2],
    triangle: u32,
    /// Whether the triangle runs from the smaller to the larger corner.
    forward: bool,
}

/// The sides of all triangles, sorted by edge.
#[derive(Debug)]
pub(crate) struct SortedSides {
    sides: Vec<Side>,
}

impl SortedSides {
    pub(crate) fn new(mesh: &Mesh) -> Self {
        let mut sides = Vec::with_capacity(3 * mesh.triangles.len());
        for (t, [a, b, c]) in mesh.triangles.iter().enumerate() {
            for (from, to) in [(*a, *b), (*b, *c), (*c, *a)] {
                sides.push(Side {
                    ends: [from.min(to), from.max(to)],
                    triangle: index(t),
                    forward: from < to,
                });
            }
        }
        sides.sort_unstable();
        Self { sides }
    }

    fn groups(&self) -> impl Iterator<Item = &[Side]> + Clone {
        self.sides.chunk_by(|a, b| a.ends == b.ends)
    }

    /// Edges of more than two triangles.
    pub(crate) fn non_manifold(&self) -> usize {
        self.groups().filter(|g| g.len() > 2).count()
    }

    /// Edges whose triangles do not run both ways equally often: their number and the first.
    pub(crate) fn unbalanced(&self) -> Option<(usize, [u32; 2])> {
        let mut bad = self
            .groups()
            .filter(|g| 2 * g.iter().filter(|s| s.forward).count() != g.len());
        let first = bad.next()?.first()?.ends;
        Some((1 + bad.count(), first))
    }

    /// Closed parts: part of each triangle, and their number. Triangles are joined over edges of
    /// two; at an edge of more, sheets that do not close there by themselves are joined too, so that
    /// two bodies that share an edge stay two.
    pub(crate) fn parts(&self, triangles: usize) -> (Vec<u32>, usize) {
        let mut joined = Groups::new(triangles);
        for g in self.groups() {
            if let [s, t] = g {
                joined.join(s.triangle, t.triangle);
            }
        }
        let sheets: Vec<u32> = (0..triangles).map(|t| joined.find(index(t))).collect();
        for g in self.groups().filter(|g| g.len() > 2) {
            let surplus = |sheet: u32| -> i32 {
                let own = g.iter().filter(|s| sheets[s.triangle as usize] == sheet);
                own.map(|s| if s.forward { 1 } else { -1 }).sum()
            };
            let mut open = g
                .iter()
                .map(|s| sheets[s.triangle as usize])
                .filter(|sheet| surplus(*sheet) != 0);
            if let Some(first) = open.next() {
                for other in open {
                    joined.join(first, other);
                }
            }
        }
        joined.numbers(0..index(triangles))
    }

    /// Sum of the parts' genus by Euler's formula `V - E + F = 2 (parts - genus)`; vertices where
    /// two fans touch count once per fan. `None` if the sum is no even number.
    pub(crate) fn genus(&self, mesh: &Mesh, parts: usize) -> Option<usize> {
        // A vertex per fan: corners of triangles joined over edges at the vertex.
        let corners = 3 * mesh.triangles.len();
        let mut fans = Groups::new(corners);
        let corner_of = |t: u32, v: u32| {
            let place = mesh.triangles[t as usize].iter().position(|c| *c == v);
            3 * t + index(place.expect("the side's end is a corner of its triangle"))
        };
        for g in self.groups() {
            if let [s, t] = g {
                for end in s.ends {
                    fans.join(corner_of(s.triangle, end), corner_of(t.triangle, end));
                }
            }
        }
        let (_, vertices) = fans.numbers(0..index(corners));
        let edges = self.groups().count();
        let twice = (2 * parts + edges).checked_sub(vertices + mesh.triangles.len())?;
        (twice % 2 == 0).then_some(twice / 2)
    }
}

/// Turns triangles so that neighbours over two-sided edges agree; in each sheet the fewer turn.
/// Returns how many were turned, or a triangle where a sheet comes back to itself with its other
/// side, as a Moebius strip does.
pub(crate) fn orient(mesh: &mut Mesh, edges: &SortedSides) -> Result<usize, u32> {
    let n = mesh.triangles.len();
    // Neighbours over two-sided edges, and whether both run the edge the same way.
    let pairs = edges.groups().filter_map(|g| match g {
        [a, b] => Some((a.triangle, b.triangle, a.forward == b.forward)),
        _ => None,
    });
    let (offsets, neighbours) = rows(
        n,
        pairs.flat_map(|(a, b, same)| [(a, (b, same)), (b, (a, same))]),
    );
    let mut turned = vec![None; n];
    let mut total = 0;
    let mut sheet = Vec::new();
    for seed in 0..n {
        if turned[seed].is_some() {
            continue;
        }
        sheet.clear();
        sheet.push(seed);
        turned[seed] = Some(false);
        let mut at = 0;
        let mut count = 0;
        while at < sheet.len() {
            let t = sheet[at];
            at += 1;
            let own = turned[t] == Some(true);
            count += usize::from(own);
            for &(other, same) in &neighbours[offsets[t]..offsets[t + 1]] {
                let wanted = Some(own != same);
                let found = &mut turned[other as usize];
                if found.is_none() {
                    *found = wanted;
                    sheet.push(other as usize);
                } else if *found != wanted {
                    return Err(other);
                }
            }
        }
        let majority = 2 * count > sheet.len();
        for &t in &sheet {
            if (turned[t] == Some(true)) != majority {
                mesh.triangles[t].swap(1, 2);
                total += 1;
            }
        }
    }
    Ok(total)
}

/// Rims of holes as closed rings of vertices, in the sense that closing triangles need.
pub(crate) fn boundary_loops(edges: &SortedSides) -> Vec<Vec<u32>> {
    // A closing triangle runs each rim edge against its only triangle.
    let mut next: Vec<(u32, u32)> = edges
        .groups()
        .filter_map(|g| match g {
            [s] if s.forward => Some((s.ends[1], s.ends[0])),
            [s] => Some((s.ends[0], s.ends[1])),
            _ => None,
        })
        .collect();
    next.sort_unstable();
    let mut used = vec![false; next.len()];
    let mut loops = Vec::new();
    for start in 0..next.len() {
        if used[start] {
            continue;
        }
        let mut ring = Vec::new();
        let mut at = start;
        loop {
            used[at] = true;
            ring.push(next[at].0);
            let to = next[at].1;
            let first = next.partition_point(|(from, _)| *from < to);
            let follow = (first..next.len()).take_while(|k| next[*k].0 == to);
            match follow.into_iter().find(|k| !used[*k]) {
                Some(k) => at = k,
                None => break,
            }
        }
        loops.push(ring);
    }
    loops
}
