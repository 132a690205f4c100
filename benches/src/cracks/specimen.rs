//! A body of a scene that its blades have cut, at rest: small displacements under uniform stress.

use glam::{DMat3, DVec3};
use phyxel::World;
use phyxel::scene::{Body, Cut, Scene, Shape, Target};
use phyxel_discretize::boundary_triangles;
use phyxel_elastic::Elastic;
use phyxel_enrich::Cuts;

use super::Fronts;
use crate::error::StudyError;
use crate::problems::cracks::{POISSON, YOUNG};
use crate::problems::model::{Law, small_displacements};

/// Time (s) by which a blade's stroke is over.
pub(super) const STROKE: f64 = 2.0;
/// Density (kg/m³): nothing moves, it sets the number of steps alone.
const DENSITY: f64 = 1000.0;

/// How a box is filled with nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Grain {
    /// A lattice along the box.
    Lattice,
    /// The scenes' own sampling of the box turned about z by so many degrees: the nodes inside lie at an angle to
    /// the crack, those near the surface are moved onto it.
    Turned(f64),
}

/// A box about the origin and how it is sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plate {
    /// Cells along its edges.
    pub(super) cells: [u32; 3],
    /// Size of a cell (m).
    pub(super) spacing: f64,
    pub(super) grain: Grain,
}

impl Plate {
    /// A slab of one cell.
    pub(super) fn slab(cells: [u32; 2], spacing: f64, grain: Grain) -> Self {
        Self {
            cells: [cells[0], cells[1], 1],
            spacing,
            grain,
        }
    }

    /// Half its edges (m).
    pub(super) fn half(&self) -> DVec3 {
        DVec3::from_array(self.cells.map(f64::from)) * (0.5 * self.spacing)
    }

    fn angle(&self) -> f64 {
        match self.grain {
            Grain::Lattice => 0.0,
            Grain::Turned(angle) => angle,
        }
    }

    /// From the box's frame to the world's.
    fn turn(&self) -> DMat3 {
        DMat3::from_rotation_z(self.angle().to_radians())
    }

    /// The scene: nothing but the box and the blades (in the box's frame).
    fn scene(&self, blades: &[Cut]) -> Scene {
        let mut body = Body::new(Shape::Box {
            size: 2.0 * self.half(),
        });
        body.rotation = DVec3::Z * self.angle();
        body.sampling.target = match self.grain {
            Grain::Lattice => {
                let [x, y, z] = self.cells.map(|count| count + 1);
                Target::Lattice(x, y, z)
            }
            Grain::Turned(_) => Target::Spacing(self.spacing),
        };
        body.material.youngs_modulus = YOUNG;
        body.material.poissons_ratio = POISSON;
        body.material.density = DENSITY;
        let mut scene = Scene::new("cracks", vec![body]);
        scene.gravity = None;
        scene.integration.settle = None;
        scene.integration.duration = STROKE;
        scene.cuts = blades.to_vec();
        for cut in &mut scene.cuts {
            for key in &mut cut.path {
                key.position = self.turn() * key.position;
                key.rotation += DVec3::Z * self.angle();
            }
        }
        scene
    }
}

/// A cut box; positions, displacements and stresses are in its own frame.
#[derive(Debug)]
pub(super) struct Specimen {
    /// Rest positions (m).
    pub(super) rest: Vec<DVec3>,
    /// Size of a cell (m).
    pub(super) spacing: f64,
    triangles: Vec<[u32; 3]>,
    volumes: Vec<f64>,
    elastic: Elastic,
    cuts: Cuts,
    /// What is done about the cut's front.
    pub(super) fronts: Fronts,
    turn: DMat3,
}

impl Specimen {
    /// Runs the scene until its blades are through.
    ///
    /// # Errors
    /// [`StudyError`] if the scene does not run, or no blade cuts.
    pub(super) fn new(plate: &Plate, blades: &[Cut], fronts: Fronts) -> Result<Self, StudyError> {
        let text = phyxel_scene::to_ron(&plate.scene(blades));
        let mut world = World::new(phyxel_scene::from_text(&text, "cracks", "", &[])?)?;
        world.play(STROKE, |_| {})?;
        let body = &world.bodies()[0];
        let cutting = body
            .cutting
            .as_ref()
            .ok_or("the blade of a study cuts nothing")?;
        let turn = plate.turn();
        let mut elastic = body.elastic.clone();
        if fronts == Fronts::Without {
            let mut state = elastic.state();
            state.fronts.clear();
            elastic.set_state(&state);
        }
        let back = turn.transpose();
        Ok(Self {
            rest: body.rest.iter().map(|x| back * *x).collect(),
            spacing: plate.spacing,
            triangles: boundary_triangles(&body.tetrahedra, |_| true),
            volumes: body.volumes.clone(),
            elastic,
            cuts: cutting.cuts.clone(),
            fronts,
            turn,
        })
    }

    /// Nodal forces (N) of a uniform stress (Pa) on all of the uncut surface.
    pub(super) fn loads(&self, stress: DMat3) -> Vec<DVec3> {
        let mut forces = vec![DVec3::ZERO; self.rest.len()];
        for face in &self.triangles {
            let [p, q, r] = face.map(|v| self.rest[v as usize]);
            let share = stress * (q - p).cross(r - p) / 6.0;
            for &v in face {
                forces[v as usize] += share;
            }
        }
        forces
    }

    /// Nodal forces (N) of a force per volume (N/m³).
    pub(super) fn weight(&self, force: DVec3) -> Vec<DVec3> {
        self.volumes.iter().map(|v| force * *v).collect()
    }

    /// Displacements (m) under nodal forces (N), with the axes that `mask` frees.
    pub(super) fn solve(
        &self,
        forces: &[DVec3],
        mask: impl Fn(DVec3) -> DVec3,
    ) -> Result<Vec<DVec3>, StudyError> {
        let (turn, back) = (self.turn, self.turn.transpose());
        let world = |vectors: &[DVec3]| vectors.iter().map(|v| turn * *v).collect::<Vec<_>>();
        let mut elastic = self.elastic.clone();
        let (rest, forces) = (world(&self.rest), world(forces));
        // Masks free z, or the plane, or hold all: the same in both frames.
        let mask = |x: DVec3| mask(back * x);
        let moved = small_displacements(&mut Law(&mut elastic), &rest, &forces, mask)?;
        Ok(moved.iter().map(|u| back * *u).collect())
    }

    /// Work (J) of the loads of a uniform stress, beyond that on the body without a cut, which has the uniform
    /// displacement gradient `uniform`.
    pub(super) fn extra_work(
        loads: &[DVec3],
        moved: &[DVec3],
        rest: &[DVec3],
        uniform: DMat3,
    ) -> f64 {
        let nodes = loads.iter().zip(moved).zip(rest);
        nodes.map(|((f, u), x)| f.dot(*u - uniform * *x)).sum()
    }

    /// Displacement gradients at the nodes.
    pub(super) fn gradients(&self, moved: &[DVec3]) -> Vec<DMat3> {
        let (turn, back) = (self.turn, self.turn.transpose());
        let mut elastic = self.elastic.clone();
        // Gradients are linear in displacements; small ones keep every law's domain.
        let small = 1e-3 * self.spacing
            / moved
                .iter()
                .fold(f64::MIN_POSITIVE, |m, u| m.max(u.length()));
        let places = self.rest.iter().zip(moved);
        let places: Vec<DVec3> = places.map(|(x, u)| turn * (*x + *u * small)).collect();
        elastic.forces_into(&places, &mut vec![DVec3::ZERO; places.len()]);
        let gradients = elastic.deformation_gradients().into_iter();
        gradients
            .map(|f| (back * (f - DMat3::IDENTITY) * turn) * small.recip())
            .collect()
    }

    /// Opening (m) of the cut along `normal` at a point of its face: both sides by the nearest nodes that look at
    /// it from that side, each with its own gradient.
    pub(super) fn opening(
        &self,
        moved: &[DVec3],
        gradients: &[DMat3],
        at: DVec3,
        normal: DVec3,
    ) -> f64 {
        let side = |sign: f64| {
            let from = at + sign * 1e-6 * self.spacing * normal;
            let near = (0..self.rest.len()).filter(|&i| {
                self.rest[i].distance(at) < 3.0 * self.spacing
                    && !self
                        .cuts
                        .crosses(self.turn * from, self.turn * self.rest[i])
            });
            let nearest = near.min_by(|&i, &j| {
                let far = |i: usize| self.rest[i].distance_squared(at);
                far(i).total_cmp(&far(j))
            });
            nearest.map_or(f64::NAN, |i| {
                (moved[i] + gradients[i] * (at - self.rest[i])).dot(normal)
            })
        };
        side(1.0) - side(-1.0)
    }
}
