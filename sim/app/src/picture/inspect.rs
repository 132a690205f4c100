//! What is drawn instead of surfaces, or beside them, to look into a model.

use glam::{DVec3, Vec3};
use phyxel::scene::{Cut, Show};
use phyxel::{Body, World};
use phyxel_discretize::Bounds;
use phyxel_enrich::Factors;
use phyxel_mls::Neighborhoods;
use phyxel_splat::{Camera, ColorScale, DrawnMesh, DrawnTissue};

use super::markers::Markers;

/// Pieces into which the path of a blade is divided.
const PIECES: u32 = 64;

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

/// Values of a lattice.
const LATTICE: ColorScale = ColorScale {
    low: -1.0,
    high: 1.0,
};

/// Whether the surfaces are drawn too.
pub(super) fn has_surface(show: Show) -> bool {
    matches!(show, Show::Surface | Show::Normals { .. } | Show::BladePath)
}

/// Meshes of what is to be shown of a body.
pub(super) fn meshes(show: Show, body: &Body, skin: &DrawnTissue) -> Vec<DrawnMesh> {
    match show {
        Show::Surface | Show::BladePath => Vec::new(),
        Show::Neighbors { node } => {
            let nodes = body.smoothed_positions();
            let weights = &body.stencils.weights;
            drawn_pairs(&nodes, &body.neighborhoods, weights, body.spacing, node)
        }
        Show::Lattice => lattices(body),
        Show::Normals { length } => {
            let mut lines = Markers::default();
            for splat in skin.splats() {
                let to = splat.position + length * splat.normal;
                lines.line(splat.position, to, 0.03 * length);
            }
            vec![lines.colored(GREEN)]
        }
        Show::Binding { surfel } => drawn_binding(body, skin, surfel as usize),
    }
}

/// The colours of a lattice's values, and what they say.
pub(super) fn legend(show: Show) -> Option<(ColorScale, &'static str)> {
    matches!(show, Show::Lattice).then_some((LATTICE, "phi"))
}

/// Points of the lattices of a body's cuts where they lie in the material, coloured by φ.
fn lattices(body: &Body) -> Vec<DrawnMesh> {
    let factors = body.cutting.iter().map(|cutting| &cutting.factors);
    let lattices = factors.flat_map(Factors::lattices).map(|grid| {
        let point = move |k: usize| (grid.lattice_point(k), grid.values()[k].phi);
        (grid.size(), point)
    });
    drawn_lattices(lattices, body.spacing)
}

/// The camera, or one that looks the same way at all of some meshes that have grown around it, for a picture of `aspect`.
pub(super) fn outside_of(meshes: &[DrawnMesh], camera: Camera, aspect: f64) -> Camera {
    let Camera {
        eye, forward, up, ..
    } = camera;
    let all = Bounds::of(meshes.iter().flat_map(|mesh| mesh.vertices.iter().copied()));
    if eye.cmpge(all.min).all() && eye.cmple(all.max).all() {
        return Camera::framing(all.min, all.max, forward, up, aspect);
    }
    camera
}

/// The paths of all blades' edges in the world up to now, as nets of lines.
pub(super) fn blade_paths(world: &World) -> Vec<DrawnMesh> {
    let Some(now) = world.scene_time() else {
        return Vec::new();
    };
    let begun = world.scene().cuts.iter().filter(|cut| cut.start() <= now);
    begun.map(|cut| blade_path(cut, now)).collect()
}

fn blade_path(cut: &Cut, now: f64) -> DrawnMesh {
    let end = cut.end().min(now);
    let edges = (0..=PIECES).map(|piece| {
        let share = f64::from(piece) / f64::from(PIECES);
        cut.edge_at(cut.start() + share * (end - cut.start()))
    });
    drawn_sweep(&edges.collect::<Vec<_>>())
}

/// Nodes (m), `spacing` (m) apart, as marks and, as lines, the pairs of a graph that they see, by `weights` that are 0 for
/// severed ones; of `only` one node if it is given, which then stands among small marks of all others.
///
/// # Panics
/// If the graph is of fewer nodes or has more pairs.
fn drawn_pairs(
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

/// A surfel and, as lines as thick as their weights, the nodes that carry it, among all of the body; nothing where there
/// is no such surfel.
fn drawn_binding(body: &Body, skin: &DrawnTissue, surfel: usize) -> Vec<DrawnMesh> {
    let Some(splat) = skin.splats().get(surfel) else {
        return Vec::new();
    };
    let nodes = &body.smoothed_positions();
    let (mark, line) = (MARK * body.spacing, LINE * body.spacing);
    let (mut marks, mut lines) = (Markers::default(), Markers::default());
    let (bound, weights) = skin.tissue.binding().row(surfel);
    for (&node, &weight) in bound.iter().zip(weights) {
        if weight > 0.0 {
            let to = nodes[node as usize];
            marks.point(to, mark);
            // As thick as its weight, 1 if one node carries it alone.
            lines.line(splat.position, to, 8.0 * line * weight);
        }
    }
    let mut own = Markers::default();
    own.point(splat.position, 1.5 * mark);
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
fn drawn_lattices<F: Fn(usize) -> (DVec3, f64)>(
    lattices: impl IntoIterator<Item = ([usize; 3], F)>,
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
        marks.colored(LATTICE.color(value))
    });
    meshes.collect()
}

/// The path of an edge (m) through positions that follow each other, as a net of lines: some of the edges, and the ways
/// of their points.
fn drawn_sweep(edges: &[Vec<DVec3>]) -> DrawnMesh {
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

    #[test]
    fn a_camera_leaves_what_has_grown_around_it() {
        let camera = Camera::looking_at(DVec3::NEG_Y, DVec3::ZERO, DVec3::Z, 0.5);
        let line = |reach: f64| {
            let mut markers = Markers::default();
            markers.line(DVec3::splat(-reach), DVec3::splat(reach), 0.01);
            [markers.colored(RED)]
        };
        assert_eq!(outside_of(&line(0.5), camera, 1.5), camera);
        let outside = outside_of(&line(2.0), camera, 1.5);
        assert!(outside.eye.y < -2.0, "{outside:?}");
        assert!(
            outside.forward.distance(camera.forward) < 1e-12,
            "the same way"
        );
    }

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
        let few = |k: usize| (DVec3::ZERO, [-1.0, 0.0, 1.0][k]);
        let meshes = drawn_lattices([([3, 1, 1], few)], 1.0);
        let marks: Vec<usize> = meshes.iter().map(|mesh| mesh.triangles.len() / 8).collect();
        assert_eq!(marks, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
        let many = ([100, 100, 100], |_| (DVec3::ZERO, 0.0));
        let many = drawn_lattices([many], 1.0);
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
