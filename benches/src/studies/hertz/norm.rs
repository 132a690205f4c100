//! Why nodal displacements are farther off than forces: what alternates from node to node.

use std::collections::HashMap;

use glam::DVec3;
use phyxel_integrate::BoundaryConditions;

use crate::problems::elements::{Elements, Order};
use crate::problems::indentation::{SMALL, SOFT, SPHERES, cube_lattice, held, on_top};
use crate::problems::model::{ElasticBody, small_displacements};
use crate::problems::reference::{Reference, pulled};
use crate::report::{Plot, Table, plots, row};
use crate::{Effort, StudyError};

pub(super) const WORDS: &str = "The table of alternation asks where the norm comes from: first a smooth \
     field is given on the top, then the reference's displacements there, so that no contact is left. Averaged is the error after the mean (1/4, 1/2, 1/4) along each axis, which takes what changes \
     its sign from one layer to the next and leaves the rest. Forces of the default come from one gradient \
     a node, which does not see such a motion; the control alone resists it, and one-sided rows at the \
     surface set it going.";

/// Settings of the hourglass stabilization; the first is the default.
const CONTROLS: [f64; 3] = [0.1, 0.3, 1.0];

/// `-d cos²(π x / 2) cos²(π y / 2)` along z.
fn smooth(x: DVec3) -> DVec3 {
    let wave = |s: f64| (0.5 * std::f64::consts::PI * s).cos().powi(2);
    DVec3::NEG_Z * (SPHERES[1].1 * SMALL * wave(x.x) * wave(x.y))
}

/// What one model makes of a load.
struct Found {
    rest: Vec<DVec3>,
    moved: Vec<DVec3>,
}

/// The default on a lattice, with the control at `control`.
fn default(cells: u32, control: f64, top: &dyn Fn(DVec3) -> DVec3) -> Result<Found, StudyError> {
    let (nodes, tetrahedra) = cube_lattice(cells);
    let mut body = ElasticBody::new(&nodes, &tetrahedra, SOFT, control)?;
    let rest = body.rest.clone();
    let given = given(&rest, top);
    let forces = pulled(&mut body, &rest, &given);
    let is_held = |node: usize| held(rest[node]) || on_top(rest[node]);
    let free = |node| [DVec3::ONE, DVec3::ZERO][usize::from(is_held(node))];
    let inner = small_displacements(&mut body, &rest, &forces, free)?;
    let moved = sum(given, inner);
    Ok(Found { rest, moved })
}

/// Trilinear elements on the same lattice.
fn trilinear(cells: u32, top: &dyn Fn(DVec3) -> DVec3) -> Result<Found, StudyError> {
    let low = DVec3::new(-1.0, -1.0, -2.0);
    let mut body = Elements::even([cells; 3], low, low + 2.0, Order::Linear, SOFT);
    let rest = body.rest.clone();
    let given = given(&rest, top);
    let forces = pulled(&mut body, &rest, &given);
    let supports = BoundaryConditions::fixed_where(&rest, |x| held(x) || on_top(x));
    let inner = body.solve(&supports, &forces)?;
    let moved = sum(given, inner);
    Ok(Found { rest, moved })
}

fn given(rest: &[DVec3], top: &dyn Fn(DVec3) -> DVec3) -> Vec<DVec3> {
    let on = |x: &DVec3| {
        if on_top(*x) && !held(*x) {
            top(*x)
        } else {
            DVec3::ZERO
        }
    };
    rest.iter().map(on).collect()
}

fn sum(mut left: Vec<DVec3>, right: Vec<DVec3>) -> Vec<DVec3> {
    for (left, right) in left.iter_mut().zip(right) {
        *left += right;
    }
    left
}

impl Found {
    /// Error of the displacements inside, and of their averages, over their norm.
    fn errors(&self, cells: u32, known: &dyn Fn(DVec3) -> DVec3) -> [f64; 2] {
        let spacing = 2.0 / f64::from(cells);
        let low = DVec3::new(-1.0, -1.0, -2.0);
        // Whole numbers, none of them a negative zero.
        let place = |x: DVec3| ((x - low) / spacing).round() + DVec3::ZERO;
        let key = |place: DVec3| place.to_array().map(f64::to_bits);
        let error = |node: usize| self.moved[node] - known(self.rest[node]);
        let errors: HashMap<_, _> = (0..self.rest.len())
            .map(|node| (key(place(self.rest[node])), error(node)))
            .collect();
        let (mut plain, mut averaged, mut size) = (0.0, 0.0, 0.0);
        for x in self.rest.iter().filter(|x| !held(**x) && !on_top(**x)) {
            let mut mean = DVec3::ZERO;
            for shift in 0..27_u32 {
                let along = [shift % 3, shift / 3 % 3, shift / 9].map(f64::from);
                let shift = DVec3::from_array(along) - 1.0;
                let weight = 0.125 * 0.5_f64.powf(shift.abs().element_sum());
                mean += errors[&key(place(*x) + shift + DVec3::ZERO)] * weight;
            }
            plain += errors[&key(place(*x))].length_squared();
            averaged += mean.length_squared();
            size += known(*x).length_squared();
        }
        [plain, averaged].map(|error| f64::sqrt(error / size))
    }
}

/// The errors of all loads and models over cells; `reference` stands as the sphere left it.
pub(super) fn table(
    effort: Effort,
    reference: &Reference,
) -> Result<(Table, Vec<Plot>), StudyError> {
    let sizes: &[u32] = effort.choose(&[9, 17, 25], &[6, 12]);
    let by_smooth = reference.with_top(smooth)?;
    let by_sphere = |x: DVec3| reference.displacement(x);
    let mut rows = Vec::new();
    let loads: [(&str, &dyn Fn(DVec3) -> DVec3); 2] = [
        ("smooth field given on the top", &by_smooth),
        ("the reference's given on the top", &by_sphere),
    ];
    for (load, known) in loads {
        let controls = CONTROLS.into_iter().map(Some).chain([None]);
        for control in controls {
            let name = control.map_or("trilinear elements".to_owned(), |control| {
                format!("default, control {control}")
            });
            let mut before = None;
            for &cells in sizes {
                let found = match control {
                    Some(control) => default(cells, control, known)?,
                    // Coarser ones show the order.
                    None if cells > 20 => continue,
                    None => trilinear(cells, known)?,
                };
                let [plain, averaged] = found.errors(cells, known);
                let order = before.map(|(coarse, error): (u32, f64)| {
                    (error / plain).ln() / (f64::from(cells) / f64::from(coarse)).ln()
                });
                rows.push(row![
                    load,
                    name.clone(),
                    found.rest.len(),
                    100.0 * plain,
                    order,
                    100.0 * averaged
                ]);
                before = Some((cells, plain));
            }
        }
    }
    let table = Table::new(
        "alternating",
        "Where the norm of the displacements' error comes from",
        "load; model; nodes (1); error inside (%); order (1); averaged (%)",
        rows,
    );
    let mut given = table.clone();
    given.rows.retain(|row| row[0].word() == loads[1].0);
    let plots = plots![
        "alternating" "Error inside with the reference's displacements given on the top",
            log "nodes",
            log "error over displacements (%)" => given.lines("model", "nodes", "error inside");
    ];
    Ok((table, plots))
}
