//! Displacements under a sphere: nodes' own, which are coefficients, and those that are drawn and written.

use glam::DVec3;
use phyxel_splat::{Tissue, TissueSettings};

use super::hertz::TOLERANCE;
use crate::problems::indentation::{Press, SMALL, SPHERES, cube_lattice, cube_sampled, on_top};
use crate::problems::model::ElasticBody;
use crate::problems::reference::Reference;
use crate::report::{Report, Series, Table, plots, row};
use crate::{Effort, StudyError};

/// The default's hourglass stabilization, and stronger ones.
const CONTROLS: [f64; 3] = [0.1, 0.2, 0.3];

/// Norms of the displacements' error.
struct Found {
    nodes: usize,
    /// Force (N) at the small strain.
    force: f64,
    as_nodes: f64,
    as_read: f64,
    /// Of points of the top that are carried by the one and by the other.
    skins: [f64; 2],
}

/// Presses the sphere into a cube of about `cells` along each side, even or as scenes `sample` it, with hourglass
/// stabilization `control`.
fn pressed(
    sample: bool,
    control: f64,
    cells: u32,
    reference: &Reference,
) -> Result<Found, StudyError> {
    let nodes = if sample {
        cube_sampled((cells as usize + 1).pow(3))?
    } else {
        cube_lattice(cells)
    };
    let mut press = Press::on_nodes(nodes, control, 2.0 / f64::from(cells))?;
    let (radius, depth) = SPHERES[1];
    let found = press.press(radius / SMALL, depth * SMALL, TOLERANCE)?;
    let (values, read) = (&press.positions, press.smoothed());
    Ok(Found {
        nodes: press.rest.len(),
        force: found.force,
        as_nodes: reference.norm(&press.rest, values),
        as_read: reference.norm(&press.rest, &read),
        skins: skins(&press.body, [values, &read], reference)?,
    })
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
    let middles = corners.iter().map(|[a, b, c]| (*a + *b + *c) / 3.0);
    let middles: Vec<DVec3> = middles.collect();
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
    let controls = &CONTROLS[..effort.choose(3, 1)];
    for (control, sample) in controls.iter().flat_map(|&c| [(c, false), (c, true)]) {
        let kind = ["even nodes", "as scenes sample"][usize::from(sample)];
        let name = format!("{kind}, control {control}");
        let (mut by_nodes, mut by_reading) = (Vec::new(), Vec::new());
        for &cells in sizes {
            let found = pressed(sample, control, cells, &reference)?;
            rows.push(row![
                name.clone(),
                found.nodes,
                100.0 * (found.force / (known * SMALL) - 1.0),
                100.0 * found.as_nodes,
                100.0 * found.as_read,
                100.0 * found.skins[0],
                100.0 * found.skins[1]
            ]);
            let nodes = found.nodes as f64;
            by_nodes.push((nodes, 100.0 * found.as_nodes));
            by_reading.push((nodes, 100.0 * found.as_read));
        }
        curves.push(Series::line(format!("{name}, nodal values"), by_nodes));
        curves.push(Series::line(format!("{name}, as read"), by_reading));
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
             smoothed_positions), which pictures, states and the live page show. Nodal values of other methods: the table convergence of hertz. Contact and forces use nodal values. The skin are points of the top that nodes carry as in pictures.",
        ],
        vec![table],
        plots,
    ))
}
