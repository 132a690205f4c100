//! A sphere on a block: force, contact radius and pressure, by the default model and by the
//! dissertation's.

mod released;
mod space;

use std::time::Instant;

use glam::DVec3;

use phyxel_integrate::ForceLaw;

use crate::problems::elements::Order;
use crate::problems::indentation::{Press, SMALL, SOFT, SPHERES, cube, graded, hertz_force};
use crate::problems::reference::Reference;
use crate::report::{Cell, Plot, Report, Series, Table, median_time, plots, row};
use crate::{Effort, StudyError};

/// Young's modulus (Pa) of the tables; everything is proportional to it.
const MODULUS: f64 = 1.0e4;
/// Unbalanced forces relative to the tool's at which the body counts as at rest.
pub(super) const TOLERANCE: f64 = 1e-7;
/// Evaluations of the forces that are timed.
const EVALUATIONS: usize = 9;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Model {
    Default,
    Graded,
    Dissertation,
    Linear,
    Quadratic,
}

const MODELS: [(Model, &str); 5] = [
    (Model::Default, "default, even nodes"),
    (Model::Graded, "default, graded nodes"),
    (Model::Dissertation, "dissertation, even nodes"),
    (Model::Linear, "trilinear elements, even"),
    (Model::Quadratic, "triquadratic elements, even"),
];

impl Model {
    /// Spacing (m) of the nodes under the tool.
    fn spacing(self, cells: u32) -> f64 {
        let even = 2.0 / f64::from(cells);
        if self == Self::Graded {
            0.45 * even
        } else {
            even
        }
    }

    fn press(self, cells: u32) -> Result<Press, StudyError> {
        match self {
            Self::Graded => graded([cells; 3]),
            Self::Dissertation => Press::by_dissertation(cells),
            _ => cube(cells),
        }
    }

    /// Cells along a side for so many that are asked, if it takes so many.
    fn cells(self, asked: u32) -> Option<u32> {
        match self {
            Self::Graded if asked > 17 => None,
            // Their stiffness has the most entries.
            Self::Quadratic if asked > 14 => None,
            // Elements of order 2 take two intervals each.
            Self::Quadratic => Some(asked + asked % 2),
            _ => Some(asked),
        }
    }

    fn measured(self, cells: u32, reference: &Reference) -> Result<Measured, StudyError> {
        let order = match self {
            Self::Linear => Order::Linear,
            Self::Quadratic => Order::Quadratic,
            _ => return measured(&mut self.press(cells)?, reference),
        };
        measured(&mut Press::of_elements(cells, order)?, reference)
    }
}

/// Force (N) at E = 1 Pa of a sphere of 1 m at small strain, contact radius (m), time (s), products.
struct Pressed {
    force: f64,
    contact_radius: f64,
    seconds: f64,
    products: usize,
}

fn press<B: ForceLaw>(
    press: &mut Press<B>,
    radius: f64,
    depth: f64,
) -> Result<Pressed, StudyError> {
    let start = Instant::now();
    let found = press.press(radius / SMALL, depth * SMALL, TOLERANCE)?;
    let steps = found.report.steps.iter();
    Ok(Pressed {
        force: found.force / SMALL,
        contact_radius: found.contact_radius,
        seconds: start.elapsed().as_secs_f64(),
        products: steps.map(|step| step.linear_iterations).sum(),
    })
}

/// One model on one lattice, pressed by the two of [`SPHERES`] that convergence is of.
struct Measured {
    nodes: usize,
    deep: Pressed,
    small: Pressed,
    /// Norm of the displacements' error over that of the reference's, of the nodes.
    norm: f64,
    /// Median time (s) of one evaluation of the forces.
    evaluation: f64,
}

/// Presses a body and compares it with a reference that was pressed as deep.
fn measured<B: ForceLaw>(
    body: &mut Press<B>,
    reference: &Reference,
) -> Result<Measured, StudyError> {
    let (radius, depth) = SPHERES[2];
    let small = press(body, radius, depth)?;
    let (radius, depth) = SPHERES[1];
    let deep = press(body, radius, depth)?;
    let norm = reference.norm(&body.rest, &body.positions);
    let rest = body.rest.clone();
    let mut forces = vec![DVec3::ZERO; rest.len()];
    let law = &mut body.body;
    let (_, evaluation) = median_time(EVALUATIONS, || law.forces_into(&rest, &mut forces));
    Ok(Measured {
        nodes: rest.len(),
        deep,
        small,
        norm,
        evaluation,
    })
}

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let mut reference = Reference::new(effort.choose([12, 16], [8, 12]))?;
    let (table, curves) = force_curves(effort, &mut reference)?;
    let (convergence, converging) = convergence(effort, &mut reference)?;
    let released = released::table(effort, &mut reference)?;
    let spaces = space::press(effort)?;
    let tables = vec![convergence, table, released, space::table(&spaces)];
    let mut plots = plots![
        "curves" "Force against indentation, sphere of 1 m (figs 69 and 72)",
            linear "indentation (m)", linear "force (N)" => curves;
    ];
    plots.extend(converging);
    plots.extend(plots![
        "pressure" "Pressure in the contact against Hertz",
            linear "distance from the middle (contact radii)",
            linear "pressure over Hertz's largest (1)" => space::pressures(&spaces);
    ]);
    Ok(Report::new(&WORDS, tables, plots))
}

const WORDS: [&str; 5] = [
    "A cube of 2 m (E 10 kPa, nu 0.3), sides and bottom held, a frictionless rigid sphere of \
     1 m pressed into the middle of its top. Half-space theory is Aras 2014, eq. (65); the \
     block reference are triquadratic finite elements of this program, on a quarter of the cube and \
     lines drawn towards the sphere, with the same contact, on two lattices, extrapolated. \
     A held block is stiffer than a half-space: by 15 % at 0.05 m and 27 % at 0.1 m. The strain \
     is made small (radius times 100, depth over 100, forces scaled back), as the reference has it.",
    "Finite elements are linear elastic boxes, fully integrated, on the same lattice; their stiffness \
     is assembled beforehand, as the stencils are. The \
     norm of fig. 71 is that of the displacements' error over all nodes, over the norm of the \
     reference's displacements there.",
    "The dissertation's model: 16 nearest nodes, plain stencils, nodal volumes of eqs (17) and \
     (18) that sum to more than the cube, Saint Venant-Kirchhoff; contact is the same in both. \
     It published 20.11 ms a step at about 6,000 nodes (section 5.7).",
    released::WORDS,
    "The half-space table presses a quarter of a block of about 46 contact radii; pressures \
     are means over rings over Hertz's largest.",
];

/// The force over the depth, by both models on one lattice.
fn force_curves(
    effort: Effort,
    reference: &mut Reference,
) -> Result<(Table, Vec<Series>), StudyError> {
    let (cells, depths): (u32, &[f64]) = effort.choose(
        (17, &[0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1]),
        (9, &[0.05, 0.1]),
    );
    let mut rows = Vec::new();
    let theory = depths
        .iter()
        .map(|&depth| (depth, MODULUS * hertz_force(SOFT, 1.0, depth)));
    let mut blocks = Vec::new();
    for &depth in depths {
        blocks.push((depth, MODULUS * reference.press(1.0, depth)?.force));
    }
    for (model, name) in [MODELS[0], MODELS[2]] {
        let mut body = model.press(cells)?;
        for &(depth, block) in &blocks {
            let found = press(&mut body, 1.0, depth)?;
            let theory = hertz_force(SOFT, 1.0, depth);
            rows.push(row![
                name,
                body.body.rest.len(),
                depth,
                MODULUS * found.force,
                found.force / theory,
                100.0 * (MODULUS * found.force / block - 1.0),
                found.contact_radius,
                found.contact_radius / depth.sqrt(),
                found.seconds,
                found.products
            ]);
        }
    }
    let table = Table::new(
        "curves",
        "Force over indentation",
        "model; nodes (1); depth (m); force (N); over half-space (1); error to block (%); \
         contact radius (m); over Hertz's (1); solution (s); products (1)",
        rows,
    );
    let mut curves = vec![
        Series::line("half-space theory, eq. (65)", theory.collect()),
        Series::line("block, triquadratic elements", blocks),
    ];
    curves.extend(table.lines("model", "depth", "force"));
    Ok((table, curves))
}

/// Error of the force over nodes and time, and of the displacements over degrees of freedom.
fn convergence(
    effort: Effort,
    reference: &mut Reference,
) -> Result<(Table, Vec<Plot>), StudyError> {
    let sizes: &[u32] = effort.choose(&[7, 9, 11, 14, 17, 22], &[7, 9]);
    let (radius, depth) = SPHERES[2];
    let known_small = reference.press(radius, depth)?;
    let (radius, depth) = SPHERES[1];
    let known = reference.press(radius, depth)?;
    let off = |force: f64, known: f64| 100.0 * (force / known - 1.0);
    // Depth goes with the power 2/3 of the force, at small strain exactly.
    let deeper = |force: f64| (hertz_force(SOFT, radius, depth) / force).powf(2.0 / 3.0);
    let mut rows = Vec::new();
    for (model, name) in MODELS {
        for cells in sizes.iter().filter_map(|&cells| model.cells(cells)) {
            let found = model.measured(cells, reference)?;
            rows.push(row![
                name,
                found.nodes,
                depth.sqrt() / model.spacing(cells),
                off(found.deep.force, known.force),
                off(found.small.force, known_small.force),
                100.0 * found.norm,
                deeper(found.deep.force),
                found.deep.seconds,
                found.deep.products,
                1e3 * found.evaluation
            ]);
        }
    }
    let fine = ("reference, finer lattice", known.fine, known_small.fine);
    let coarse = (
        "reference, coarser lattice",
        known.coarse,
        known_small.coarse,
    );
    for (name, force, small) in [fine, coarse] {
        let mut row = row![name, Cell::Nothing, Cell::Nothing];
        row.extend(row![off(force, known.force), off(small, known_small.force)]);
        row.resize(10, Cell::Nothing);
        rows.push(row);
    }
    let table = Table::new(
        "convergence",
        "Force on the sphere against finite elements of the block",
        "model; nodes (1); contact radius (spacings); error, r 1 d 0.1 (%); \
         error, r 0.5 d 0.05 (%); norm of the error (%); depth over eq. (65)'s (1); \
         solution (s); products (1); forces (ms)",
        rows,
    );
    let plots = converging(&table, deeper(known.force));
    Ok((table, plots))
}

/// The table of convergence as plots; `depth` is that of the finite elements over eq. (65)'s.
fn converging(table: &Table, depth: f64) -> Vec<Plot> {
    let error = "error, r 1 d 0.1";
    let mut by_norm = table.lines("model", "nodes", "norm of the error");
    for point in by_norm.iter_mut().flat_map(|line| &mut line.points) {
        point.0 *= 3.0;
    }
    let mut by_theory = table.lines("model", "nodes", "depth over eq. (65)'s");
    let block = by_theory[0].points.iter().map(|point| (point.0, depth));
    let block = Series::line("block, triquadratic elements", block.collect());
    by_theory.push(block);
    plots![
        "convergence" "Error of the force against the block's finite elements, 0.1 m deep",
            log "nodes", log "error of the force (%)" => table.lines("model", "nodes", error);
        "norm" "Norm of the displacements' error against degrees of freedom (fig. 71)",
            log "degrees of freedom", log "error over displacements (%)" => by_norm;
        "indentation" "Indentation at the force of eq. (65) over theory's (fig. 73)",
            log "nodes", linear "indentation over theory's (1)" => by_theory;
        "time" "Error of the force against the time of its solution, 0.1 m deep",
            log "wall time of the static solution (s)",
            log "error of the force (%)" => table.lines("model", "solution", error);
    ]
}
