//! What is drawn instead of surfaces, or beside them, to look into a model.

use glam::{DVec3, Vec3};
use phyxel_mls::Neighborhoods;
use phyxel_splat::{Binding, ColorScale, DrawnMesh, Splat};

use super::markers::Markers;

/// Half the width of a node's mark and of a line, in node spacings.
const MARK: f64 = 0.12;
const LINE: f64 = 0.03;
/// Marks of a lattice at most; of a larger one every second point is drawn, or every third and so on.
const MOST_MARKS: usize = 20_000;
/// Steps of a colour scale.
const SHADES: u32 = 11;
/// Edges of a path between two that are drawn whole.
const SHOWN_EDGE: usize = 4;
/// Half the width of an edge's line, over the edge's length.
const EDGE_LINE: f64 = 0.004;

const RED: Vec3 = Vec3::new(0.6, 0.05, 0.05);
const BLUE: Vec3 = Vec3::new(0.05, 0.12, 0.5);
const GREEN: Vec3 = Vec3::new(0.02, 0.3, 0.05);

/// Nodes (m), `spacing` (m) apart, as marks and, as lines, the pairs of a graph that they see, by `weights` that are 0 for
/// severed ones; of `only` one node if it is given, which then stands among small marks of all others.
///
/// # Panics
/// If the graph is of fewer nodes or has more pairs.
pub(super) fn drawn_pairs(
    nodes: &[DVec3],
    graph: &Neighborhoods,
    weights: &[f64],
    spacing: f64,
    only: Option<u32>,
) -> Vec<DrawnMesh> {
    let (mark, line) = (MARK * spacing, LINE * spacing);
    let (mut marks, mut lines) = (Markers::default(), Markers::default());
    for (k, &from) in (0_u32..).zip(nodes) {
        if only.is_none() || only == Some(k) {
            marks.point(from, mark);
        }
        for pair in graph.pairs(k as usize) {
            let other = graph.indices()[pair];
            // One way of a pair is enough, the other if it is the only one.
            let back = graph.find_pair(other as usize, k);
            let twice = other < k && back.is_some_and(|back| weights[back] > 0.0);
            let shown = only.map_or(!twice, |node| node == k);
            if weights[pair] > 0.0 && shown {
                let to = nodes[other as usize];
                lines.line(from, to, line);
                if only.is_some() {
                    marks.point(to, 0.6 * mark);
                }
            }
        }
    }
    // Around the one, those that it does not see.
    let others = if only.is_some() { nodes } else { &[] };
    vec![marks.colored(RED), lines.colored(BLUE), dots(others, mark)]
}

/// Normals of splats, as lines of a `length` (m).
pub(super) fn drawn_normals(splats: &[Splat], length: f64) -> DrawnMesh {
    let mut lines = Markers::default();
    for splat in splats {
        let to = splat.position + length * splat.normal;
        lines.line(splat.position, to, 0.03 * length);
    }
    lines.colored(GREEN)
}

/// A surfel at a position (m) and, as lines as thick as their weights, the nodes that carry it, among all `nodes` (m),
/// which lie `spacing` (m) apart.
///
/// # Panics
/// If the binding has no such surfel, or there are fewer nodes than it names.
pub(super) fn drawn_binding(
    binding: &Binding,
    surfel: usize,
    place: DVec3,
    nodes: &[DVec3],
    spacing: f64,
) -> Vec<DrawnMesh> {
    let (mark, line) = (MARK * spacing, LINE * spacing);
    let (mut marks, mut lines) = (Markers::default(), Markers::default());
    let (bound, weights) = binding.row(surfel);
    for (&node, &weight) in bound.iter().zip(weights) {
        if weight > 0.0 {
            let to = nodes[node as usize];
            marks.point(to, mark);
            // As thick as its weight, 1 if one node carries it alone.
            lines.line(place, to, 8.0 * line * weight);
        }
    }
    let mut own = Markers::default();
    own.point(place, 1.5 * mark);
    vec![
        marks.colored(RED),
        lines.colored(BLUE),
        dots(nodes, mark),
        own.colored(GREEN),
    ]
}

/// All nodes, small and grey.
fn dots(at: &[DVec3], mark: f64) -> DrawnMesh {
    let mut all = Markers::default();
    for &node in at {
        all.point(node, 0.25 * mark);
    }
    all.colored(Vec3::splat(0.3))
}

/// Points of lattices, coloured by a value from -1 to 1: each has so many along x, y and z, and a function that gives
/// position (m) and value of its k-th, x running fastest. Of many only every second is drawn, or every third and so
/// on. They are of a model whose nodes lie `spacing` (m) apart; one mesh for each shade.
pub(super) fn drawn_lattices<F: Fn(usize) -> (DVec3, f64)>(
    lattices: impl IntoIterator<Item = ([usize; 3], F)>,
    scale: &ColorScale,
    spacing: f64,
) -> Vec<DrawnMesh> {
    let mut shades: Vec<Markers> = (0..SHADES).map(|_| Markers::default()).collect();
    for ([nx, ny, nz], point) in lattices {
        let stride = (1..).find(|n: &usize| n.pow(3) * MOST_MARKS >= nx * ny * nz);
        let stride = stride.unwrap_or(usize::MAX);
        for z in (0..nz).step_by(stride) {
            for y in (0..ny).step_by(stride) {
                for x in (0..nx).step_by(stride) {
                    let (at, value) = point(x + nx * (y + ny * z));
                    let share = 0.5 * (value + 1.0) * f64::from(SHADES - 1);
                    #[allow(
                        clippy::cast_possible_truncation,
                        reason = "from 0 to SHADES - 1; NaN gives 0"
                    )]
                    shades[share.round() as usize].point(at, 0.5 * MARK * spacing);
                }
            }
        }
    }
    let shades = (0_u32..).zip(shades);
    let meshes = shades.map(|(shade, marks)| {
        let value = 2.0 * f64::from(shade) / f64::from(SHADES - 1) - 1.0;
        marks.colored(scale.color(value))
    });
    meshes.collect()
}

/// The path of an edge (m) through positions that follow each other, as a net of lines: some of the edges, and the ways
/// of their points.
pub(super) fn drawn_sweep(edges: &[Vec<DVec3>]) -> DrawnMesh {
    let length = |edge: &[DVec3]| edge.windows(2).map(|ab| ab[0].distance(ab[1])).sum::<f64>();
    let width = EDGE_LINE * edges.first().map_or(0.0, |edge| length(edge));
    let mut shape = Markers::default();
    let mut before = edges.first();
    for (place, here) in edges.iter().enumerate() {
        if place % SHOWN_EDGE == 0 {
            for ab in here.windows(2) {
                shape.line(ab[0], ab[1], width);
            }
        }
        for (&a, &b) in before.into_iter().flatten().zip(here) {
            shape.line(a, b, width);
        }
        before = Some(here);
    }
    shape.colored(Vec3::new(0.1, 0.3, 0.6))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three nodes in a row, of which the outer two see only the middle one, one of them one way.
    #[test]
    fn each_pair_is_a_line_once_and_severed_ones_are_none() {
        let nodes = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X];
        let graph = Neighborhoods::from_graph(vec![0, 1, 3, 4], vec![1, 0, 2, 1]).expect("a graph");
        let drawn = |weights: &[f64], only| {
            let meshes = drawn_pairs(&nodes, &graph, weights, 1.0, only);
            meshes.iter().map(|m| m.triangles.len()).collect::<Vec<_>>()
        };
        let lines = |weights: &[f64]| drawn(weights, None)[1] / 6;
        assert_eq!(lines(&[1.0; 4]), 2, "two pairs");
        assert_eq!(lines(&[1.0, 1.0, 0.0, 0.0]), 1, "one is severed");
        assert_eq!(lines(&[1.0, 1.0, 0.0, 1.0]), 2, "one way is left");
        // The node and its neighbour, its pair, all nodes.
        assert_eq!(drawn(&[1.0; 4], Some(0)), [16, 6, 24]);
    }

    #[test]
    fn a_lattice_has_a_mark_for_each_point_in_the_shade_of_its_value() {
        let scale = ColorScale {
            low: -1.0,
            high: 1.0,
        };
        let few = |k: usize| (DVec3::ZERO, [-1.0, 0.0, 1.0][k]);
        let meshes = drawn_lattices([([3, 1, 1], few)], &scale, 1.0);
        let marks: Vec<usize> = meshes.iter().map(|mesh| mesh.triangles.len() / 8).collect();
        assert_eq!(marks, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
        let many = ([100, 100, 100], |_| (DVec3::ZERO, 0.0));
        let many = drawn_lattices([many], &scale, 1.0);
        let marks: usize = many.iter().map(|mesh| mesh.triangles.len() / 8).sum();
        assert_eq!(marks, 25 * 25 * 25, "every fourth along each axis");
    }

    #[test]
    fn an_edge_on_its_way_draws_itself_and_the_ways_of_its_points() {
        let edges: Vec<Vec<DVec3>> = (0..=4)
            .map(|k| f64::from(k) * DVec3::Y)
            .map(|at| vec![at, at + DVec3::X])
            .collect();
        let sides = drawn_sweep(&edges).triangles.len() / 6;
        assert_eq!(sides, 2 + 2 * 4, "two edges, and the paths between");
        assert_eq!(drawn_sweep(&[]).triangles.len(), 0, "nothing of nothing");
    }
}
