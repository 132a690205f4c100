//! What pictures show instead of surfaces, or beside them: to look into a model.

use phyxel_enrich::Factors;
use phyxel_splat::{ColorScale, DrawnMesh, DrawnTissue};

use phyxel::scene::{Cut, Show};
use phyxel::{Body, World};

use super::inspect::{drawn_binding, drawn_lattices, drawn_normals, drawn_pairs, drawn_sweep};

/// Pieces into which the path of a blade is divided.
const PIECES: u32 = 64;

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
        Show::Normals { length } => vec![drawn_normals(skin.splats(), length)],
        Show::Binding { surfel } => {
            let surfel = surfel as usize;
            let Some(splat) = skin.splats().get(surfel) else {
                return Vec::new();
            };
            let nodes = body.smoothed_positions();
            let binding = skin.tissue.binding();
            drawn_binding(binding, surfel, splat.position, &nodes, body.spacing)
        }
    }
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
fn lattices(body: &Body) -> Vec<DrawnMesh> {
    let Some((scale, _)) = legend(Show::Lattice) else {
        return Vec::new();
    };
    let factors = body.cutting.iter().map(|cutting| &cutting.factors);
    let lattices = factors.flat_map(Factors::lattices).map(|grid| {
        let point = move |k: usize| (grid.lattice_point(k), grid.values()[k].phi);
        (grid.size(), point)
    });
    drawn_lattices(lattices, &scale, body.spacing)
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
