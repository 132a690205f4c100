//! Displacements under a sphere: nodes' own, which are coefficients, and those that are drawn and written.

use glam::DVec3;
use phyxel_splat::{Tissue, TissueSettings};

use super::hertz::TOLERANCE;
use crate::problems::elements::Order;
use crate::problems::indentation::{
    Press, SMALL, SOFT, SPHERES, cube_lattice, cube_sampled, graded_lattice, on_top,
};
use crate::problems::model::ElasticBody;
use crate::problems::reference::Reference;
use crate::report::{Report, Series, Table, plots, row};
use crate::{Effort, StudyError};

/// Method and nodes of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Method {
    /// The default with its hourglass stabilization at a value.
    Even(f64),
    Sampled(f64),
    Graded,
    Dissertation,
    Linear,
}

/// The default's hourglass stabilization, and stronger ones.
const CONTROLS: [f64; 3] = [0.1, 0.2, 0.3];

impl Method {
    fn all(effort: Effort) -> Vec<Self> {
        let default = [Self::Even(CONTROLS[0]), Self::Sampled(CONTROLS[0])];
        let mut all = default.to_vec();
        if effort == Effort::Full {
            all.push(Self::Graded);
            all.extend(CONTROLS[1..].iter().map(|&control| Self::Even(control)));
            all.extend(CONTROLS[1..].iter().map(|&control| Self::Sampled(control)));
            all.extend([Self::Dissertation, Self::Linear]);
        }
        all
    }

    fn name(self) -> String {
        match self {
            Self::Even(control) => format!("even nodes, control {control}"),
            Self::Sampled(control) => format!("as scenes sample, control {control}"),
            Self::Graded => "graded nodes, control 0.1".to_owned(),
            Self::Dissertation => "dissertation, even nodes".to_owned(),
            Self::Linear => "trilinear elements, even".to_owned(),
        }
    }

    /// Presses the sphere into a cube of about `cells` along each side.
    fn pressed(self, cells: u32, reference: &Reference) -> Result<Found, StudyError> {
        let (radius, depth) = SPHERES[1];
        let (radius, depth) = (radius / SMALL, depth * SMALL);
        let even = 2.0 / f64::from(cells);
        if self == Self::Linear {
            let mut press = Press::of_elements(cells, Order::Linear)?;
            let force = press.press(radius, depth, TOLERANCE)?.force;
            return Ok(Found {
                nodes: press.rest.len(),
                force,
                as_nodes: reference.norm(&press.rest, &press.positions),
                as_read: None,
                skins: None,
            });
        }
        let count = (cells as usize + 1).pow(3);
        let (nodes, tetrahedra) = match self {
            Self::Sampled(_) => cube_sampled(count)?,
            Self::Graded => graded_lattice([cells; 3]),
            _ => cube_lattice(cells),
        };
        let (body, spacing) = match self {
            Self::Dissertation => (ElasticBody::dissertation(&nodes, &tetrahedra, SOFT)?, even),
            Self::Graded => {
                let body = ElasticBody::new(&nodes, &tetrahedra, SOFT, CONTROLS[0])?;
                (body, 0.45 * even)
            }
            Self::Even(control) | Self::Sampled(control) => {
                let body = ElasticBody::new(&nodes, &tetrahedra, SOFT, control)?;
                (body, even)
            }
            Self::Linear => unreachable!("elements are pressed above"),
        };
        let mut press = Press::cube(body, spacing)?;
        let force = press.press(radius, depth, TOLERANCE)?.force;
        let (values, read) = (&press.positions, press.smoothed());
        Ok(Found {
            nodes: press.rest.len(),
            force,
            as_nodes: reference.norm(&press.rest, values),
            as_read: Some(reference.norm(&press.rest, &read)),
            skins: Some(skins(&press.body, [values, &read], reference)?),
        })
    }
}

struct Found {
    nodes: usize,
    /// Force (N) at the small strain.
    force: f64,
    as_nodes: f64,
    /// Elements have displacements at their nodes.
    as_read: Option<f64>,
    /// Of points of the top that are carried by the one and by the other.
    skins: Option<[f64; 2]>,
}

/// Norms of the error of points of the top, a surfel a triangle, that nodes' positions and gradients carry as they
/// carry the skin of pictures.
fn skins(
    body: &ElasticBody,
    positions: [&[DVec3]; 2],
    reference: &Reference,
) -> Result<[f64; 2], StudyError> {
    let corners = body.faces(on_top).into_iter();
    let corners = corners.map(|triangle| triangle.map(|node| body.rest[node as usize]));
    let corners: Vec<[DVec3; 3]> = corners.collect();
    let middles: Vec<DVec3> = corners
        .iter()
        .map(|[a, b, c]| (*a + *b + *c) / 3.0)
        .collect();
    let area = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
    let areas: Vec<f64> = corners.iter().map(area).collect();
    let normals = vec![DVec3::Z; middles.len()];
    let settings = TissueSettings::default();
    let tissue = Tissue::new(&middles, &normals, &areas, &body.rest, &settings)?;
    let gradients = body.elastic.deformation_gradients();
    Ok(positions.map(|nodes| {
        let mut splats = Vec::new();
        tissue.carry_into(nodes, &gradients, &mut splats);
        let carried: Vec<DVec3> = splats.iter().map(|splat| splat.position).collect();
        reference.norm(&middles, &carried)
    }))
}

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let (intervals, sizes): ([u32; 2], &[u32]) =
        effort.choose(([12, 16], &[9, 11, 17, 22]), ([8, 12], &[9, 17]));
    let mut reference = Reference::new(intervals)?;
    let (radius, depth) = SPHERES[1];
    let known = reference.press(radius, depth)?.force;
    let (mut rows, mut curves) = (Vec::new(), Vec::new());
    for method in Method::all(effort) {
        let name = method.name();
        let (mut by_nodes, mut by_reading) = (Vec::new(), Vec::new());
        for &cells in sizes {
            // Coarser elements show the order; what is drawn to the sphere is finer there.
            if cells > 17 && matches!(method, Method::Linear | Method::Graded) {
                continue;
            }
            let found = method.pressed(cells, &reference)?;
            let skin = |at: usize| found.skins.map(|skins| 100.0 * skins[at]);
            rows.push(row![
                name.clone(),
                found.nodes,
                100.0 * (found.force / (known * SMALL) - 1.0),
                100.0 * found.as_nodes,
                found.as_read.map(|read| 100.0 * read),
                skin(0),
                skin(1)
            ]);
            let nodes = found.nodes as f64;
            by_nodes.push((nodes, 100.0 * found.as_nodes));
            by_reading.extend(found.as_read.map(|read| (nodes, 100.0 * read)));
        }
        curves.push(Series::line(format!("{name}, nodal values"), by_nodes));
        if !by_reading.is_empty() {
            curves.push(Series::line(format!("{name}, as read"), by_reading));
        }
    }
    let table = Table::new(
        "field",
        "Error of displacements under a sphere",
        "nodes and method; nodes (1); force (%); as nodal values (%); as read (%); \
         skin by nodal values (%); skin as read (%)",
        rows,
    );
    let plots = plots![
        "field" "Norm of the displacements' error",
            log "nodes", log "error over displacements (%)" => curves;
    ];
    Ok(Report::new(
        &[
            "The cube and the sphere of the study hertz, pressed 0.1 m deep; the norm is that of the displacements' \
             error over all nodes, over the norm of the reference's there. A nodal value is a coefficient of a \
             linear fit; as read is the field whose gradient the stencils have (phyxel-elastic, \
             smoothed_positions), which pictures, states and the live page show. Contact and forces use nodal values. The skin are points of the top that nodes carry as in pictures.",
        ],
        vec![table],
        plots,
    ))
}
