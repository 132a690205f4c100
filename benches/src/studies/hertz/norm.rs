//! Why nodal displacements are farther off than forces: what alternates from node to node.

use std::collections::HashMap;

use glam::DVec3;

use crate::problems::elements::{Order, displacements};
use crate::problems::indentation::{Press, SMALL, SOFT, SPHERES, cube_lattice, held, on_top};
use crate::problems::model::{ElasticBody, small_displacements};
use crate::problems::reference::{Reference, pulled};
use crate::report::{Plot, Table, plots, row};
use crate::{Effort, StudyError};

pub(super) const WORDS: &str = "The table of alternation asks where the norm comes from: first a smooth \
     field is given on the top, then the reference's displacements there, so that no contact is left, and last \
     the sphere. Averaged is the error after the mean (1/4, 1/2, 1/4) along each axis, which takes what changes \
     its sign from one layer to the next and leaves the rest. Forces of the default come from one gradient \
     a node, which does not see such a motion; the control alone resists it, and one-sided rows at the \
     surface set it going.";

/// Settings of the hourglass stabilization; the first is the default.
const CONTROLS: [f64; 3] = [0.1, 0.3, 1.0];

/// What is done to the cube.
#[derive(Debug, Clone, Copy)]
enum Load {
    Smooth,
    Given,
    Sphere,
}

const LOADS: [(Load, &str); 3] = [
    (Load::Smooth, "smooth field given on the top"),
    (Load::Given, "the reference's given on the top"),
    (Load::Sphere, "sphere"),
];

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
fn default(
    cells: u32,
    control: f64,
    load: Load,
    top: &dyn Fn(DVec3) -> DVec3,
) -> Result<Found, StudyError> {
    let (nodes, tetrahedra) = cube_lattice(cells);
    let mut body = ElasticBody::new(&nodes, &tetrahedra, SOFT, control)?;
    let rest = body.rest.clone();
    if let Load::Sphere = load {
        return pressed(Press::cube(body, 2.0 / f64::from(cells))?);
    }
    let given = given(&rest, top);
    let forces = pulled(&mut body, &rest, &given);
    let free = |x| {
        if held(x) || on_top(x) {
            DVec3::ZERO
        } else {
            DVec3::ONE
        }
    };
    let inner = small_displacements(&mut body, &rest, &forces, free)?;
    Ok(Found {
        moved: sum(given, inner),
        rest,
    })
}

/// Trilinear elements on the same lattice.
fn trilinear(cells: u32, load: Load, top: &dyn Fn(DVec3) -> DVec3) -> Result<Found, StudyError> {
    let mut press = Press::of_elements(cells, Order::Linear)?;
    if let Load::Sphere = load {
        return pressed(press);
    }
    let rest = press.rest.clone();
    let given = given(&rest, top);
    let forces = pulled(&mut press.body, &rest, &given);
    let supports =
        phyxel_integrate::BoundaryConditions::fixed_where(&rest, |x| held(x) || on_top(x));
    let inner = press.body.solve(&supports, &forces)?;
    Ok(Found {
        moved: sum(given, inner),
        rest,
    })
}

fn pressed<B: phyxel_integrate::ForceLaw>(mut press: Press<B>) -> Result<Found, StudyError> {
    let (radius, depth) = SPHERES[1];
    press.press(radius / SMALL, depth * SMALL, super::TOLERANCE)?;
    Ok(Found {
        moved: displacements(&press.positions, &press.rest),
        rest: press.rest,
    })
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
    for (load, load_name) in LOADS {
        let known: &dyn Fn(DVec3) -> DVec3 = match load {
            Load::Smooth => &by_smooth,
            Load::Given | Load::Sphere => &by_sphere,
        };
        let controls = CONTROLS.into_iter().map(Some).chain([None]);
        for control in controls {
            let name = control.map_or("trilinear elements".to_owned(), |control| {
                format!("default, control {control}")
            });
            let mut before = None;
            for &cells in sizes {
                let found = match control {
                    Some(control) => default(cells, control, load, known)?,
                    // Coarser ones show the order.
                    None if cells > 20 => continue,
                    None => trilinear(cells, load, known)?,
                };
                let [plain, averaged] = found.errors(cells, known);
                let order = before.map(|(coarse, error): (u32, f64)| {
                    (error / plain).ln() / (f64::from(cells) / f64::from(coarse)).ln()
                });
                rows.push(row![
                    load_name,
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
    given.rows.retain(|row| row[0].word() == LOADS[1].1);
    let plots = plots![
        "alternating" "Error inside with the reference's displacements given on the top",
            log "nodes",
            log "error over displacements (%)" => given.lines("model", "nodes", "error inside");
    ];
    Ok((table, plots))
}
