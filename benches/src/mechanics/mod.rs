//! Error against processor time: phyxel, and finite elements in lanes, on three tasks of small strain. References by
//! triquadratic elements in the same run. `benches/peers/mechanics.py` gives the same tasks to other simulators.

mod chart;
mod speed;

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use glam::DVec3;
use phyxel::scene::{self, Gravity, MaterialSettings, Region, Scene, Scheme, Shape, Support};
use phyxel::scene::{Target, Tool};
use phyxel::{Body, World};
use phyxel_discretize::{boundary_triangles, nodal_volumes};
use phyxel_integrate::{
    BoundaryConditions, Contact, ContactSettings, ContactSurface, EigenvalueSettings, ForceLaw,
    NewtonSettings, Pose, RigidShape, StaticLoad, largest_eigenvalue, penalty, solve_static,
};
use serde::Serialize;

use crate::StudyError;
use crate::error::of_file;
use crate::problems::block::{faces_where, lattice};
use crate::problems::elements::{Elements, Order, displacements};
use crate::problems::indentation::{Press, SMALL, SPHERES, held, on_top};
use crate::problems::lanes::Lanes;
use crate::problems::model::{law, small_displacements};
use crate::problems::reference::Reference;
use crate::problems::solid::Solid;

pub use chart::chart;

/// Tissue of all tasks, but for Poisson's ratio.
const YOUNGS_MODULUS: f64 = 1e4;
const DENSITY: f64 = 1e3;
const RATIOS: [f64; 3] = [0.3, 0.45, 0.49];
/// Steps of finite elements over the largest stable ones.
const STEP_FACTOR: f64 = 0.9;
/// Cells along an edge of the cube at whose corners the file of the reference's field has displacements.
const FIELD: u32 = 48;

/// A box that is held, and what pulls or presses it.
#[derive(Debug, Clone, Copy)]
struct Task {
    name: &'static str,
    low: DVec3,
    high: DVec3,
    /// Gravity along -z (m/s²); 0 where a sphere presses the top instead.
    gravity: f64,
    held: fn(DVec3) -> bool,
    /// What of the body's mass the answer is the mean displacement along -z of.
    seen: fn(DVec3) -> bool,
    /// Intervals of the reference's two lattices.
    fine: [[u32; 3]; 2],
    /// Cells of the lattices of finite elements, from which phyxel takes the spacing.
    cells: [[u32; 3]; 4],
}

const BEAM: Task = Task {
    name: "beam",
    low: DVec3::new(0.0, -0.1, -0.1),
    high: DVec3::new(1.0, 0.1, 0.1),
    gravity: 0.002,
    held: |x| x.x < 1e-9,
    seen: |x| x.x > 1.0 - 1e-9,
    fine: [[40, 8, 8], [60, 12, 12]],
    cells: [[10, 2, 2], [20, 4, 4], [30, 6, 6], [40, 8, 8]],
};
const BLOCK: Task = Task {
    name: "block",
    low: DVec3::new(-0.035, -0.035, -0.21),
    high: DVec3::new(0.035, 0.035, 0.0),
    gravity: 0.1,
    held: |x| x.z > -1e-9,
    seen: |_| true,
    fine: [[8, 8, 24], [12, 12, 36]],
    cells: [[3, 3, 9], [5, 5, 15], [7, 7, 21], [10, 10, 30]],
};
const CUBE: Task = Task {
    name: "sphere",
    low: DVec3::new(-1.0, -1.0, -2.0),
    high: DVec3::new(1.0, 1.0, 0.0),
    gravity: 0.0,
    held,
    seen: on_top,
    fine: [[12; 3], [16; 3]],
    cells: [[6; 3], [8; 3], [12; 3], [16; 3]],
};

/// One method on one task at one size.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Row {
    task: &'static str,
    poissons_ratio: f64,
    method: &'static str,
    nodes: usize,
    /// Displacement (m) or force (N) at rest.
    answer: Option<f64>,
    /// Its error, and the norm of the displacements' (%).
    error: Option<f64>,
    norm: Option<f64>,
    /// Step (s), and processor time (s) of one.
    step: Option<f64>,
    seconds: Option<f64>,
}

/// Answer of the reference, displacement (m) or force (N), and its field under the sphere.
type Known = (f64, Option<Reference>);

impl Task {
    fn solid(poissons_ratio: f64) -> Solid {
        // Of unit stiffness, as the indentation has it, and the same speed of sound.
        Solid {
            youngs_modulus: 1.0,
            poissons_ratio,
            density: DENSITY / YOUNGS_MODULUS,
        }
    }

    fn size(&self) -> DVec3 {
        self.high - self.low
    }

    fn spacing(&self, cells: [u32; 3]) -> f64 {
        self.size().x / f64::from(cells[0])
    }

    /// Mean displacement along -z of the mass that is seen.
    fn mean(&self, rest: &[DVec3], masses: &[f64], moved: &[DVec3]) -> f64 {
        let (mut sum, mut whole) = (0.0, 0.0);
        for ((x, mass), u) in rest.iter().zip(masses).zip(moved) {
            if (self.seen)(*x) {
                (sum, whole) = (sum - u.z * mass, whole + mass);
            }
        }
        sum / whole
    }

    /// The reference, and answers on a coarser and a finer lattice, from which it is extrapolated.
    fn known(&self, ratio: f64) -> Result<(Known, [f64; 2]), StudyError> {
        let solid = Self::solid(ratio);
        if self.gravity == 0.0 {
            let mut reference = Reference::of(solid, self.fine.map(|cells| cells[0]))?;
            let (radius, depth) = SPHERES[1];
            let found = reference.press(radius, depth)?;
            return Ok(((found.force, Some(reference)), [found.coarse, found.fine]));
        }
        let mut found = [0.0; 2];
        for (answer, cells) in found.iter_mut().zip(self.fine) {
            let mut body = Elements::new(self.lines(cells), Order::Quadratic, solid);
            let supports = BoundaryConditions::fixed_where(&body.rest, self.held);
            let volumes = body.volumes();
            let weights: Vec<DVec3> = volumes.iter().map(|v| self.weight() * *v).collect();
            let mut x = body.rest.clone();
            // Tighter is beyond round-off at the largest Poisson's ratio.
            let settings = NewtonSettings::with_tolerance(1e-7);
            let load = StaticLoad::of(&weights);
            solve_static(&mut body, &mut x, &supports, &load, &settings)?;
            *answer = self.mean(&body.rest, &volumes, &displacements(&x, &body.rest));
        }
        let [coarse, fine] = found;
        let refined = (f64::from(self.fine[1][0]) / f64::from(self.fine[0][0])).powi(2) - 1.0;
        Ok(((fine + (fine - coarse) / refined, None), found))
    }

    /// Lines drawn towards the clamp, and towards the faces beside it: its edge leaves a singularity.
    fn lines(&self, cells: [u32; 3]) -> [Vec<f64>; 3] {
        [0, 1, 2].map(|axis| {
            let middle = 0.5 * (self.low + self.high);
            let [low, high] = [self.low, self.high].map(|end| {
                let mut at = middle;
                at[axis] = end[axis];
                (self.held)(at)
            });
            let near = |s: f64| 1.0 - (FRAC_PI_2 * s).cos();
            let part = |k: u32| match f64::from(k) / f64::from(cells[axis]) {
                s if low == high => 0.5 * near(2.0 * s),
                s if low => near(s),
                s => 1.0 - near(1.0 - s),
            };
            let line = (0..=cells[axis]).map(part);
            line.map(|s| self.low[axis] + self.size()[axis] * s)
                .collect()
        })
    }

    /// Force per volume (N/m³) at unit stiffness.
    fn weight(&self) -> DVec3 {
        DVec3::NEG_Z * (self.gravity * DENSITY / YOUNGS_MODULUS)
    }

    /// A row with the answer of a body and its errors; `read` makes of nodal positions those that are compared.
    fn answer(
        &self,
        mut body: impl ForceLaw,
        (rest, volumes, tetrahedra): (&[DVec3], &[f64], &[[u32; 4]]),
        spacing: f64,
        (known, reference): &Known,
        read: impl Fn(&[DVec3]) -> Vec<DVec3>,
    ) -> Result<Row, StudyError> {
        let supports = BoundaryConditions::fixed_where(rest, self.held);
        let read = |positions: &[DVec3]| {
            let mut read = read(positions);
            supports.keep(positions, &mut read);
            read
        };
        let mut norm = None;
        let answer = if let Some(reference) = reference {
            let top = faces_where(&boundary_triangles(tetrahedra, |_| true), rest, on_top);
            let mut press = Press::of(body, rest.to_vec(), supports.clone(), &top, spacing)?;
            let (radius, depth) = SPHERES[1];
            let force = press.press(radius / SMALL, depth * SMALL, 1e-6)?.force / SMALL;
            norm = Some(100.0 * reference.norm(rest, &read(&press.positions)));
            force
        } else {
            let free = |node: usize| DVec3::splat(f64::from(u8::from(!(self.held)(rest[node]))));
            let forces: Vec<DVec3> = volumes.iter().map(|v| self.weight() * *v).collect();
            let moved = small_displacements(&mut body, rest, &forces, free)?;
            let positions: Vec<DVec3> = rest.iter().zip(moved).map(|(x, u)| *x + u).collect();
            self.mean(rest, volumes, &displacements(&read(&positions), rest))
        };
        Ok(Row {
            task: self.name,
            nodes: rest.len(),
            answer: Some(answer),
            error: Some(100.0 * (answer / known - 1.0)),
            norm,
            ..Row::default()
        })
    }

    /// The task as a scene, all else by default.
    fn scene(&self, solid: Solid, spacing: f64, scheme: Scheme) -> Scene {
        let size = self.size();
        let mut body = scene::Body::new(Shape::Box { size });
        body.position = 0.5 * (self.low + self.high);
        body.sampling.target = Target::Spacing(spacing);
        body.material = MaterialSettings {
            youngs_modulus: solid.youngs_modulus,
            poissons_ratio: solid.poissons_ratio,
            density: solid.density,
            ..MaterialSettings::default()
        };
        let mut scene = Scene::new(self.name, vec![body]);
        let edge = 1e-6 * size.x;
        let middle = 0.5 * (self.low + self.high);
        for axis in [-1.0, 1.0]
            .into_iter()
            .flat_map(|side| DVec3::AXES.map(|axis| axis * side))
        {
            if (self.held)(middle + 0.5 * axis * size) {
                let point = middle + axis * (0.5 * size - edge);
                let region = Region::HalfSpace {
                    point,
                    normal: axis,
                };
                scene.supports.push(Support::fixed(region));
            }
        }
        scene.gravity = Some(Gravity {
            acceleration: DVec3::NEG_Z * self.gravity,
            ramp: 0.0,
        });
        if self.gravity == 0.0 {
            let (radius, depth) = SPHERES[1];
            let (radius, depth) = (radius / SMALL, depth * SMALL);
            let mut tool = Tool::new(RigidShape::Sphere { radius }, Vec::new());
            tool.position = DVec3::Z * (radius - depth);
            scene.tools.push(tool);
            scene.gravity = None;
        }
        scene.integration.scheme = scheme;
        scene.integration.settle = None;
        scene
    }

    /// phyxel, as scenes have it.
    fn by_phyxel(
        &self,
        ratio: f64,
        cells: [u32; 3],
        known: &Known,
    ) -> Result<Vec<Row>, StudyError> {
        let (solid, spacing) = (Self::solid(ratio), self.spacing(cells));
        let scene = self.scene(solid, spacing, Scheme::default());
        let body = Body::new(&scene, &scene.bodies[0])?;
        let (reader, mut elastic) = (body.elastic(), body.elastic().clone());
        let made = (&*body.rest, &*body.volumes, &*body.tetrahedra);
        let law = law(&mut elastic);
        let row = self.answer(law, made, spacing, known, |x| reader.smoothed_positions(x))?;
        let tissue = Solid {
            youngs_modulus: YOUNGS_MODULUS,
            density: DENSITY,
            ..solid
        };
        let (step, tolerance) = (0.01, Scheme::default_tolerance());
        let schemes = [
            ("phyxel", Scheme::default()),
            (
                "phyxel, backward Euler",
                Scheme::BackwardEuler { step, tolerance },
            ),
            (
                "phyxel, energy-momentum",
                Scheme::EnergyMomentum { step, tolerance },
            ),
        ];
        let timed = schemes.into_iter().map(|(method, scheme)| {
            let mut world = World::new(self.scene(tissue, spacing, scheme))?;
            let seconds = Some(speed::processor_seconds(|| Ok(world.step()?))?);
            let step = Some(world.step_size());
            Ok(Row {
                method,
                step,
                seconds,
                ..row.clone()
            })
        });
        timed.collect()
    }

    /// Finite elements in lanes, in steps of symplectic Euler.
    fn by_elements(
        &self,
        ratio: f64,
        cells: [u32; 3],
        known: &Known,
    ) -> Result<Vec<Row>, StudyError> {
        let (solid, spacing) = (Self::solid(ratio), self.spacing(cells));
        let (rest, tetrahedra) = lattice(cells, |s| self.low + self.size() * s);
        let boxes = Elements::even(cells, self.low, self.high, Order::Linear, solid).volumes();
        let fourths = nodal_volumes(&rest, &tetrahedra);
        let hexahedra = Lanes::hexahedra(&rest, cells, solid);
        let corotational = Lanes::tetrahedra(&rest, &tetrahedra, solid);
        let supports = BoundaryConditions::fixed_where(&rest, self.held);
        let methods = [
            ("hexahedra", hexahedra, boxes),
            ("corotational tetrahedra", corotational, fourths),
        ];
        let timed = methods.into_iter().map(|(method, mut body, volumes)| {
            let masses: Vec<f64> = volumes.iter().map(|v| v * solid.density).collect();
            let made = (&*rest, &*volumes, &*tetrahedra);
            let row = self.answer(body.clone(), made, spacing, known, <[DVec3]>::to_vec)?;
            let product = |v: &[DVec3], out: &mut [DVec3]| body.tangent_product_into(v, out);
            let (settings, mut warm) = (EigenvalueSettings::default(), Vec::new());
            let found = largest_eigenvalue(&masses, &supports, product, &mut warm, &settings)?;
            let step = STEP_FACTOR * found.critical_step;
            let seconds = self.explicit(&body, &rest, &tetrahedra, &masses, (spacing, step))?;
            let (step, seconds) = (Some(step), Some(seconds));
            Ok(Row {
                method,
                step,
                seconds,
                ..row
            })
        });
        timed.collect()
    }

    /// Processor time (s) of a step.
    fn explicit(
        &self,
        body: &Lanes,
        rest: &[DVec3],
        tetrahedra: &[[u32; 4]],
        masses: &[f64],
        (spacing, step): (f64, f64),
    ) -> Result<f64, StudyError> {
        let still = |x: DVec3| if (self.held)(x) { 0.0 } else { 1.0 };
        let free: Vec<f64> = rest
            .iter()
            .zip(masses)
            .map(|(x, mass)| still(*x) / mass)
            .collect();
        let top = faces_where(&boundary_triangles(tetrahedra, |_| true), rest, on_top);
        let surface = ContactSurface::from_triangles(&top, rest, 4)?;
        let mut contact = Contact::new(surface, ContactSettings::new(penalty(1.0, spacing)));
        let (radius, depth) = (SPHERES[1].0 / SMALL, SPHERES[1].1 * SMALL);
        let (shape, pose) = (
            RigidShape::Sphere { radius },
            Pose::at(DVec3::Z * (radius - depth)),
        );
        // The penalty would ask for shorter steps, and is left alone: nodes move by a tenth, in as many operations.
        let step = step * if self.gravity == 0.0 { 0.1 } else { 1.0 };
        let (mut x, mut v) = (rest.to_vec(), vec![DVec3::ZERO; rest.len()]);
        let mut forces = v.clone();
        let gravity = DVec3::NEG_Z * (step * self.gravity);
        speed::processor_seconds(|| {
            body.explicit_into(&x, &mut forces);
            if self.gravity == 0.0 {
                contact.add_forces(&shape, &pose, &x, &mut forces);
            }
            for (node, free) in free.iter().enumerate() {
                let fall = if *free > 0.0 { gravity } else { DVec3::ZERO };
                v[node] += forces[node] * (step * free) + fall;
                x[node] += v[node] * step;
            }
            Ok(())
        })
    }
}

/// Runs the tasks, `quick` at one Poisson's ratio; writes the reference's field under the sphere into
/// `folder`.
///
/// # Errors
/// If a body is not solved, and what `each` returns.
pub fn run(
    quick: bool,
    folder: &Path,
    mut each: impl FnMut(&Row) -> Result<(), StudyError> + Send,
) -> Result<(), StudyError> {
    let ratios = if quick { &RATIOS[1..2] } else { &RATIOS };
    testkit::pool(1).install(|| {
        for (&ratio, task) in ratios
            .iter()
            .flat_map(|r| [BEAM, BLOCK, CUBE].map(|task| (r, task)))
        {
            let mut add = |mut row: Row| {
                row.poissons_ratio = ratio;
                each(&row)
            };
            let (known, lattices) = task.known(ratio)?;
            for (method, answer) in ["reference, coarser", "reference, finer", "reference"]
                .into_iter()
                .zip(lattices.into_iter().chain([known.0]))
            {
                let (task, error) = (task.name, Some(100.0 * (answer / known.0 - 1.0)));
                let answer = Some(answer);
                add(Row {
                    task,
                    method,
                    answer,
                    error,
                    ..Row::default()
                })?;
            }
            if let Some(reference) = &known.1 {
                write_field(reference, &folder.join(format!("field-{ratio}.csv")))?;
            }
            for cells in &task.cells {
                let rows = task.by_phyxel(ratio, *cells, &known)?.into_iter();
                rows.chain(task.by_elements(ratio, *cells, &known)?)
                    .try_for_each(&mut add)?;
            }
        }
        speed::rows(&mut each)
    })
}

/// Displacements of a quarter of the cube at the corners of [`FIELD`] cells, over [`SMALL`], as CSV.
fn write_field(reference: &Reference, path: &Path) -> Result<(), StudyError> {
    let mut text = String::from("x,y,z,u,v,w\n");
    let at = |k: u32| 2.0 * f64::from(k) / f64::from(FIELD);
    for (k, j) in (0..=FIELD).flat_map(|k| (0..=FIELD / 2).map(move |j| (k, j))) {
        for i in 0..=FIELD / 2 {
            let x = DVec3::new(at(i), at(j), at(k) - 2.0);
            let u = reference.displacement(x) / SMALL;
            text += &format!("{},{},{},{:e},{:e},{:e}\n", x.x, x.y, x.z, u.x, u.y, u.z);
        }
    }
    std::fs::write(path, text).map_err(of_file(path))
}
