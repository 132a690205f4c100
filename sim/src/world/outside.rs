//! The outside of a body, as tools touch it.

use glam::DVec3;
use phyxel_discretize::{Solid, boundary_triangles, sample_surfels, surface_mesh};
use phyxel_integrate::ContactSurface;
use phyxel_splat::{BindSettings, RadiusRule, Tissue, TissueSettings};

use super::body::Body;
use super::error::BodyProblem;
use super::factors::Factors;

/// Contact points along a side of a surface triangle: enough for contacts of two spacings.
const DIVISIONS: u32 = 4;
/// Samples of the surface for each node on it, where there are no tetrahedra; nodes that are looked at
/// for each; cosine below which a node's normal is that of another face.
const SAMPLES: usize = 12;
const LOOKED_AT: usize = 6;
const SAME_FACE: f64 = 0.5;

/// Nodes on the surface of a body without tetrahedra, each with the area (m²) nearest to it.
#[derive(Debug, Clone, Default)]
pub(super) struct Cover {
    nodes: Vec<u32>,
    areas: Vec<f64>,
}

impl Cover {
    /// Covers `solid`, whose nodes on the surface are `outer`. Beside an edge a sample goes to the
    /// nearest node of its own face.
    pub(super) fn new(
        solid: &Solid,
        rest: &[DVec3],
        outer: &[u32],
        spacing: f64,
    ) -> Result<Self, BodyProblem> {
        let surface = surface_mesh(solid, 0.5 * spacing)?;
        let samples = sample_surfels(&surface, SAMPLES * outer.len(), Some(solid));
        let places: Vec<DVec3> = outer.iter().map(|&node| rest[node as usize]).collect();
        let facing: Vec<DVec3> = places.iter().map(|&x| solid.normal(x)).collect();
        let settings = TissueSettings {
            bind: BindSettings {
                neighbors: LOOKED_AT,
                ..BindSettings::default()
            },
            radius: RadiusRule::Constant(spacing),
            clip: false,
            ..TissueSettings::default()
        };
        let (positions, normals) = (&samples.positions, &samples.normals);
        let tissue = Tissue::new(positions, normals, &samples.areas, &places, &settings)?;
        let mut areas = vec![0.0; outer.len()];
        for (sample, (area, normal)) in samples.areas.iter().zip(normals).enumerate() {
            let (near, _) = tissue.binding().row(sample);
            let alike = |k: &&u32| facing[**k as usize].dot(*normal) > SAME_FACE;
            let own = near.iter().find(alike).unwrap_or(&near[0]);
            areas[*own as usize] += area;
        }
        let covered = outer.iter().copied().zip(areas);
        let (nodes, areas) = covered.filter(|&(_, area)| area > 0.0).unzip();
        Ok(Self { nodes, areas })
    }
}

/// Whether no edge of a surface triangle is severed.
fn is_whole(body: &Body, factors: Option<&Factors>, [a, b, c]: [u32; 3]) -> bool {
    let holds = |a: u32, b: u32| {
        let pair = body.neighborhoods.find_pair(a as usize, b);
        factors
            .zip(pair)
            .is_none_or(|(factors, pair)| factors.factor(pair) > 0.0)
    };
    holds(a, b) && holds(b, c) && holds(c, a)
}

/// How many triangles of a body's outside cuts have torn; what is torn stays so.
pub(super) fn torn_count(body: &Body, factors: &Factors) -> usize {
    let torn = |triangle: &&[u32; 3]| !is_whole(body, Some(factors), **triangle);
    body.outside.iter().filter(torn).count()
}

/// Triangles of the outside of a body of tetrahedra.
pub(super) fn outside_of(tetrahedra: &[[u32; 4]]) -> Vec<[u32; 3]> {
    boundary_triangles(tetrahedra, |_| true)
}

/// Contact points on a body's outside.
pub(super) fn surface_of(
    body: &Body,
    factors: Option<&Factors>,
) -> Result<ContactSurface, BodyProblem> {
    if let Some(cover) = &body.cover {
        // No node's area spans a gap.
        return Ok(ContactSurface::from_nodes(
            &cover.nodes,
            &cover.areas,
            body.rest.len(),
        )?);
    }
    let (whole, torn): (Vec<[u32; 3]>, Vec<[u32; 3]>) =
        (body.outside.iter()).partition(|triangle| is_whole(body, factors, **triangle));
    let mut surface = ContactSurface::from_triangles(&whole, &body.rest, DIVISIONS)?;
    if !torn.is_empty() {
        let mut areas = vec![0.0; body.rest.len()];
        for triangle in &torn {
            let [a, b, c] = triangle.map(|node| body.rest[node as usize]);
            for &node in triangle {
                areas[node as usize] += (b - a).cross(c - a).length() / 6.0;
            }
        }
        let (nodes, areas): (Vec<u32>, Vec<f64>) =
            (0_u32..).zip(areas).filter(|&(_, area)| area > 0.0).unzip();
        surface = surface.joined(&ContactSurface::from_nodes(
            &nodes,
            &areas,
            body.rest.len(),
        )?);
    }
    Ok(surface)
}
