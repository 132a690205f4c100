//! A body is drawn out and cut while it is loaded: opening and energy against finite elements with doubled nodes.

use glam::{DMat2, DVec2, DVec3};
use phyxel::scene::{Body, Cut, Inclusion, Key, Refinement, Region, Scene, Shape, Support, Target};

use crate::problems::opening::{
    BEGINS, DAMPING, Quarter, RATIO, REST, SIZE, STIFF, State, blade, flank, pull,
};
use crate::problems::solid::Solid;
use crate::report::{Cell, Plot, Report, Series, Table, add_point, plots, row};
use crate::watch::{Options, run_with};
use crate::{Effort, StudyError};

/// Time (s) from one reading of a scene to the next.
const READING: f64 = 1e-3;
/// Parts of the time from the blade's entry to the end at whose ends courses are compared.
const PARTS: u32 = 280;

/// What is cut.
#[derive(Debug, Clone, Copy)]
struct Case {
    name: &'static str,
    poissons_ratio: f64,
    /// Whether nodes lie at half the distance along the blade's path.
    refined: bool,
    inclusion: bool,
}

const fn case(name: &'static str, poissons_ratio: f64, refined: bool, inclusion: bool) -> Case {
    Case {
        name,
        poissons_ratio,
        refined,
        inclusion,
    }
}

/// A refined one has the reference of the one before.
const CASES: [Case; 4] = [
    case("nu 0.3", 0.3, false, false),
    case("graded", 0.3, true, false),
    case("nu 0.45", 0.45, false, false),
    case("inclusion", 0.3, false, true),
];

impl Case {
    fn solid(self) -> Solid {
        Solid {
            youngs_modulus: 1e4,
            poissons_ratio: self.poissons_ratio,
            density: 1000.0,
        }
    }

    /// As a user gives it, with so many spacings over half the height.
    fn scene(self, per_depth: u32) -> Scene {
        let (mut body, solid) = (Body::new(Shape::Box { size: SIZE }), self.solid());
        body.sampling.target = Target::Spacing(0.5 * SIZE.z / f64::from(per_depth));
        body.material.youngs_modulus = solid.youngs_modulus;
        body.material.poissons_ratio = solid.poissons_ratio;
        body.material.density = solid.density;
        body.damping = DAMPING;
        if self.refined {
            body.sampling.refine = [0.0, 0.25, 0.5].map(refinement).to_vec();
        }
        if self.inclusion {
            let [min, max] = STIFF;
            body.inclusions.push(Inclusion {
                region: Region::Box { min, max },
                youngs_modulus: Some(RATIO * solid.youngs_modulus),
                poissons_ratio: None,
                density: None,
                fiber: None,
            });
        }
        let mut scene = Scene::new("opening", vec![body]);
        scene.gravity = None;
        scene.integration.settle = None;
        scene.integration.duration = REST;
        for side in [1.0, -1.0] {
            let end = DVec3::X * (side * 0.5 * SIZE.x);
            let reach = SIZE.with_x(1e-6);
            let [min, max] = [end - reach, end + reach];
            let path = pull().map(|key| Key::new(key.time, key.position * side));
            let support = Support::driven(Region::Box { min, max }, path.to_vec());
            scene.supports.push(support);
        }
        let edge = vec![DVec3::Y * -SIZE.y, DVec3::Y * SIZE.y];
        scene.cuts.push(Cut::new(edge, blade().to_vec()));
        scene
    }

    /// States of the scene, and how many nodes it has.
    fn run(self, per_depth: u32) -> Result<(Vec<State>, usize), StudyError> {
        let mut states: Vec<State> = Vec::new();
        let name = format!("{}, {per_depth} over the depth", self.name);
        let row = run_with(&name, self.scene(per_depth), Options::default(), |world| {
            let time = world.time();
            // Steps may be rolled back.
            states.retain(|state| state[0] < time);
            if states.last().is_none_or(|state| time >= state[0] + READING) {
                let (body, x) = (&world.bodies()[0], world.positions(0));
                let both = [1.0, -1.0].map(|side| flank(side, &body.rest, &x, &body.masses));
                let stored = body.motion().audit().elastic;
                states.push([time, both[0] + both[1], stored]);
            }
        });
        if row.ended {
            Ok((compared(&states), row.nodes))
        } else {
            Err(format!("{name}: {}", row.error).into())
        }
    }
}

/// Half the distance of nodes around a line across the blade's path, so far up (in heights).
fn refinement(up: f64) -> Refinement {
    let [from, to] = [-0.5, 0.5].map(|y| SIZE * DVec3::new(0.0, y, up));
    Refinement {
        from,
        to,
        radius: 0.015,
        factor: 0.5,
    }
}

/// States at the times at which courses are compared, linear between those that are known.
fn compared(states: &[State]) -> Vec<State> {
    let at = |time: f64| {
        let after = states.partition_point(|state| state[0] < time);
        let [from, to] = [after.saturating_sub(1), after.min(states.len() - 1)].map(|k| states[k]);
        let part = ((time - from[0]) / (to[0] - from[0]).max(f64::MIN_POSITIVE)).min(1.0);
        [0, 1, 2].map(|k| from[k] + part * (to[k] - from[k]))
    };
    let part = |k: u32| f64::from(k) / f64::from(PARTS);
    (0..=PARTS)
        .map(|k| at(BEGINS + part(k) * (REST - BEGINS)))
        .collect()
}

/// A mesh's elements over the depth, and its states.
type Mesh = (u32, Vec<State>);

/// Meshes extrapolated to elements of no size: at each time a fit linear in that size, as errors of a crack fall. Meshes weigh
/// with the square of their fineness.
fn extrapolated(meshes: &[Mesh]) -> Vec<State> {
    let fit = |at: usize, k: usize| {
        let (mut matrix, mut right) = (DMat2::ZERO, DVec2::ZERO);
        for (n, states) in meshes {
            // Both sides times the fineness.
            let row = DVec2::new(f64::from(*n), 1.0);
            matrix += DMat2::from_cols(row * row.x, row * row.y);
            right += row * (row.x * states[at][k]);
        }
        (matrix.inverse() * right).x
    };
    let times = 0..meshes[0].1.len();
    times.map(|at| [0, 1, 2].map(|k| fit(at, k))).collect()
}

/// Opening (m) at rest, energy (J) that the cut has released until then.
fn at_rest(states: &[State]) -> [f64; 2] {
    let [before, after] = [states[0], states[states.len() - 1]];
    [after[1], before[2] - after[2]]
}

/// A row of the table: what is found at a size, and how far it is off what is known.
fn entries(
    names: [&str; 2],
    [size, nodes]: [usize; 2],
    found: &[State],
    known: &[State],
) -> Vec<Cell> {
    let [[opening, released], reference] = [found, known].map(at_rest);
    let largest = known.iter().fold(0.0, |most, state| state[1].max(most));
    let squares = found.iter().zip(known).map(|(a, b)| (a[1] - b[1]).powi(2));
    let rms = (squares.sum::<f64>() / known.len() as f64).sqrt();
    let percent = |ratio: f64| 100.0 * (ratio - 1.0);
    row![
        names[0],
        names[1],
        size,
        nodes,
        1e3 * opening,
        1e3 * released,
        100.0 * rms / largest,
        percent(opening / reference[0]),
        percent(released / reference[1]),
        percent(found[0][2] / known[0][2]),
    ]
}

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    // All meshes are the reference, the first two a coarser one.
    let full = (&[8, 16, 12, 24][..], &[4, 6, 8, 12][..]);
    let (meshes, sizes) = effort.choose(full, (&[8, 16], &[4, 6]));
    let (mut rows, mut curves) = (Vec::new(), Vec::new());
    let mut known = Vec::new();
    for case in CASES {
        if !case.refined {
            let run = |&mesh: &u32| {
                let quarter = Quarter::new(case.solid(), mesh, case.inclusion);
                (mesh, compared(&quarter.run()))
            };
            known = meshes.iter().map(run).collect();
        }
        let reference = extrapolated(&known);
        let mut add = |method: &str, size: u32, nodes: usize, states: &[State]| {
            let size = size as usize;
            let names = [case.name, method];
            rows.push(entries(names, [size, nodes], states, &reference));
            let curve = states.iter().map(|state| (state[0], 1e3 * state[1]));
            let name = format!("{}, {method}, {size}", case.name);
            curves.push(Series::line(name, curve.collect()));
        };
        if !case.refined {
            let nodes = |n: u32| ((3 * n + 1) * (n + 1) * (2 * n + 1)) as usize;
            for (mesh, states) in &known {
                add(ELEMENTS, *mesh, nodes(*mesh), states);
            }
            let last = known.len() - 1;
            add(REFERENCE, known[last].0, nodes(known[last].0), &reference);
            if last > 1 {
                let coarser = extrapolated(&known[..2]);
                add("coarser reference", meshes[1], nodes(meshes[1]), &coarser);
            }
        }
        for &size in sizes {
            let (states, nodes) = case.run(size)?;
            add("phyxel", size, nodes, &states);
        }
    }
    let table = Table::new(
        "cut",
        "A body cut while it is drawn out: errors against finite elements with doubled nodes",
        "case; method; spacings over the depth (1); nodes (1); opening at rest (mm); released (mJ); opening over time (%); \
         error of the opening at rest (%); error of what is released (%); error of what is stored before (%)",
        rows,
    );
    let plots = plots(&table, &curves);
    Ok(Report::new(&[WORDS, OF_ELEMENTS], vec![table], plots))
}

const ELEMENTS: &str = "finite elements";
const REFERENCE: &str = "reference";

const WORDS: &str = "A box of 12 x 4 x 8 cm (E 10 kPa, 1,000 kg/m3, damping 20/s, no gravity) is drawn along x to a stretch of 1.3. A blade \
     enters at 0.8 m/s and stops at half the height; then the box swings and comes to rest. The inclusion (100 times as stiff) lies \
     1 cm below the end of the blade's path. Graded: half the spacing along that path, over the depth as elsewhere. The mouth is \
     read from displacements as users read them, of both methods by a linear fit of nodes within 2 cm. Over time: root mean square \
     of the difference from the blade's entry on, over the largest opening.";

const OF_ELEMENTS: &str = "Reference: eight-node elements of selectively reduced integration, the same law, a quarter of the box. Nodes on the cut's \
     plane are let go as the blade's edge passes them where they are then, with a spring for the part of an element that \
     it has passed. Meshes are extrapolated, as errors that fall with the element's size; coarser: the first two meshes only.";

/// Openings of the first case over time, and errors of all over size.
fn plots(table: &Table, curves: &[Series]) -> Vec<Plot> {
    let error = table.column("opening over time");
    let mut lines = Vec::new();
    let is_reference = |row: &&Vec<Cell>| row[1].word().contains(REFERENCE);
    for row in table.rows.iter().filter(|row| !is_reference(row)) {
        if let (Some(size), Some(error)) = (row[2].number(), row[error].number()) {
            let name = format!("{}, {}", row[0], row[1]);
            add_point(&mut lines, &name, (size, error));
        }
    }
    let case = format!("{}, ", CASES[0].name);
    let first = curves.iter().filter(|line| line.name.starts_with(&case));
    let first =
        first.filter(|line| !line.name.contains(ELEMENTS) && !line.name.contains("coarser"));
    plots![
        "course" "Opening of a cut's mouth over time, nu 0.3",
            linear "time (s)", linear "opening (mm)" => first.cloned().collect();
        "error" "Opening over time, root mean square of the error",
            log "spacings over the depth of the cut", log "error over the largest opening (%)" => lines;
    ]
}
