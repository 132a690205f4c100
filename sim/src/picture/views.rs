//! What pictures show in place of surfaces, or beside them: to look into a model.

use glam::{DVec3, Vec3};
use phyxel_splat::{ColorScale, DrawnMesh, Markers, Splats, Tissue};

use crate::scene::{Cut, Show};
use crate::world::{Factors, Member, World};

/// Half the width of a node's mark and of a line, in distances of nodes.
const MARK: f64 = 0.12;
const LINE: f64 = 0.03;
/// Marks of a lattice at most; of a larger one every second point is drawn, or every third and so on.
const MOST_MARKS: f64 = 20_000.0;
/// Steps of a colour scale.
const SHADES: u32 = 11;
/// Pieces into which the way of a blade is divided, and how many of them lie between two edges that are drawn.
const PIECES: u32 = 64;
const SHOWN_EDGE: u32 = 4;
/// Half the width of an edge's line, over the edge's length.
const EDGE_LINE: f64 = 0.004;

/// Whether the surfaces are drawn too.
pub(super) fn has_surface(show: Show) -> bool {
    matches!(show, Show::Surface | Show::Normals { .. } | Show::BladePath)
}

/// Meshes of what is to be shown of a body.
pub(super) fn meshes(
    show: Show,
    member: &Member,
    tissue: &Tissue,
    splats: &Splats,
) -> Vec<DrawnMesh> {
    let body = &member.body;
    let (mark, line) = (MARK * body.spacing, LINE * body.spacing);
    let at = body.motion.positions();
    match show {
        Show::Surface | Show::BladePath => Vec::new(),
        Show::Neighbors { node } => {
            let graph = &body.neighborhoods;
            let weights = body.stencils.weights();
            let (mut marks, mut lines) = (Markers::default(), Markers::default());
            for (k, &from) in (0_u32..).zip(at) {
                let row = k as usize;
                if node.is_none() || node == Some(k) {
                    marks.point(from, mark);
                }
                for (pair, &other) in graph.pairs(row).zip(graph.row(row)) {
                    // One way of a pair is enough, the other if it is the only one.
                    let back = graph.find_pair(other as usize, k);
                    let twice = back.is_some_and(|back| weights[back] > 0.0) && other < k;
                    let shown = node.map_or(!twice, |node| node == k);
                    if weights[pair] > 0.0 && shown {
                        lines.line(from, at[other as usize], line);
                        if node.is_some() {
                            marks.point(at[other as usize], 0.6 * mark);
                        }
                    }
                }
            }
            // Around the one, those that it does not see.
            let others = if node.is_some() { at } else { &[] };
            vec![
                marks.colored(Vec3::new(0.6, 0.05, 0.05)),
                lines.colored(Vec3::new(0.05, 0.12, 0.5)),
                dots(others, mark),
            ]
        }
        Show::Lattice => lattices(member, mark),
        Show::Normals { length } => {
            let mut lines = Markers::default();
            for (&from, normal) in splats.positions.iter().zip(&splats.normals) {
                lines.line(from, from + length * *normal, 0.03 * length);
            }
            vec![lines.colored(Vec3::new(0.02, 0.3, 0.05))]
        }
        Show::Binding { surfel } => {
            let surfel = surfel as usize;
            let (mut nodes, mut lines) = (Markers::default(), Markers::default());
            let Some(&from) = splats.positions.get(surfel) else {
                return Vec::new();
            };
            let (bound, weights) = tissue.binding().row(surfel);
            for (&node, &weight) in bound.iter().zip(weights) {
                if weight > 0.0 {
                    let to = at[node as usize];
                    nodes.point(to, mark);
                    // As thick as its weight, 1 if one node carries it alone.
                    lines.line(from, to, 8.0 * line * weight);
                }
            }
            let mut own = Markers::default();
            own.point(from, 1.5 * mark);
            vec![
                nodes.colored(Vec3::new(0.6, 0.05, 0.05)),
                lines.colored(Vec3::new(0.05, 0.12, 0.5)),
                dots(at, mark),
                own.colored(Vec3::new(0.02, 0.3, 0.05)),
            ]
        }
    }
}

/// All nodes, small and grey.
fn dots(at: &[DVec3], mark: f64) -> DrawnMesh {
    let mut all = Markers::default();
    for &node in at {
        all.point(node, 0.25 * mark);
    }
    all.colored(Vec3::splat(0.3))
}

/// The colours of a lattice's values, and what they say.
pub(super) fn legend(show: Show) -> Option<(ColorScale, &'static str)> {
    let scale = ColorScale {
        low: -1.0,
        high: 1.0,
    };
    matches!(show, Show::Lattice).then_some((scale, "phi"))
}

/// Points of the lattices of a body's cuts where they lie in the material, coloured by φ.
fn lattices(member: &Member, mark: f64) -> Vec<DrawnMesh> {
    let Some(Factors::Grids(grids)) = member.cutting.as_ref().map(|cutting| cutting.factors())
    else {
        return Vec::new();
    };
    let Some((scale, _)) = legend(Show::Lattice) else {
        return Vec::new();
    };
    let mut shades: Vec<Markers> = (0..SHADES).map(|_| Markers::default()).collect();
    for grid in grids.lattices() {
        let [nx, ny, nz] = grid.size();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_precision_loss,
            clippy::cast_sign_loss,
            reason = "a few, from a count far below 2^53"
        )]
        let stride = (grid.values().len() as f64 / MOST_MARKS)
            .cbrt()
            .ceil()
            .max(1.0) as usize;
        for z in (0..nz).step_by(stride) {
            for y in (0..ny).step_by(stride) {
                for x in (0..nx).step_by(stride) {
                    let k = x + nx * (y + ny * z);
                    let share = 0.5 * (grid.values()[k].phi + 1.0) * f64::from(SHADES - 1);
                    #[allow(
                        clippy::cast_possible_truncation,
                        clippy::cast_sign_loss,
                        reason = "from 0 to the number of shades"
                    )]
                    let shade = share.round() as usize;
                    shades[shade].point(grid.lattice_point(k), 0.5 * mark);
                }
            }
        }
    }
    let shades = (0_u32..).zip(shades);
    let meshes = shades.map(|(shade, marks)| {
        let phi = 2.0 * f64::from(shade) / f64::from(SHADES - 1) - 1.0;
        marks.colored(scale.color(phi))
    });
    meshes.collect()
}

/// The ways of all blades' edges in the world up to now, as nets of lines: edges at times, and the ways of their
/// points.
pub(super) fn blade_paths(world: &World) -> Vec<DrawnMesh> {
    let Some(now) = world.scene_time() else {
        return Vec::new();
    };
    let begun = world.scene().cuts.iter().filter(|cut| cut.start() <= now);
    begun.map(|cut| blade_path(cut, now)).collect()
}

fn blade_path(cut: &Cut, now: f64) -> DrawnMesh {
    let end = cut.end().min(now);
    let mut shape = Markers::default();
    let place = |piece: u32| {
        let share = f64::from(piece) / f64::from(PIECES);
        cut.edge_at(cut.start() + share * (end - cut.start()))
    };
    let length = |edge: &[DVec3]| edge.windows(2).map(|ab| ab[0].distance(ab[1])).sum::<f64>();
    let width = EDGE_LINE * length(&place(0));
    for piece in 0..=PIECES {
        let here = place(piece);
        if piece % SHOWN_EDGE == 0 {
            for ab in here.windows(2) {
                shape.line(ab[0], ab[1], width);
            }
        }
        let before = place(piece.saturating_sub(1));
        for (&a, &b) in before.iter().zip(&here) {
            shape.line(a, b, width);
        }
    }
    shape.colored(Vec3::new(0.1, 0.3, 0.6))
}
