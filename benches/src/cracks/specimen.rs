//! A body of a scene that its blades have cut, at rest: small displacements under uniform stress.

use glam::{DMat3, DVec3};
use phyxel::World;
use phyxel::scene::{Body, Cut, Scene, Shape, Target};
use phyxel_discretize::boundary_triangles;
use phyxel_elastic::Elastic;
use phyxel_enrich::Cuts;

use super::Fronts;
use crate::error::StudyError;
use crate::problems::cracks::{POISSON, YOUNG, opening};
use crate::problems::model::{law, small_displacements};

/// Time (s) by which a blade's stroke is over.
pub(super) const STROKE: f64 = 2.0;
/// Density (kg/m³): nothing moves, it sets the number of steps alone.
const DENSITY: f64 = 1000.0;

/// A box about the origin and how it is sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plate {
    /// Cells along its edges.
    pub(super) cells: [u32; 3],
    /// Size of a cell (m).
    pub(super) spacing: f64,
    /// A lattice along the box if `None`, else the scenes' own sampling of the box turned about z by so many degrees: the
    /// nodes inside lie at an angle to the crack, those near the surface are moved onto it.
    pub(super) turned: Option<f64>,
}

impl Plate {
    /// A slab of one cell on a lattice.
    pub(super) fn slab(cells: [u32; 2], spacing: f64) -> Self {
        Self {
            cells: [cells[0], cells[1], 1],
            spacing,
            turned: None,
        }
    }

    /// Half its edges (m).
    pub(super) fn half(&self) -> DVec3 {
        DVec3::from_array(self.cells.map(f64::from)) * (0.5 * self.spacing)
    }

    fn angle(&self) -> f64 {
        self.turned.unwrap_or(0.0)
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
        let [x, y, z] = self.cells.map(|count| count + 1);
        body.sampling.target = match self.turned {
            None => Target::Lattice(x, y, z),
            Some(_) => Target::Spacing(self.spacing),
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
    pub(super) fn new(plate: &Plate, blades: &[Cut], fronts: Fronts) -> Result<Self, StudyError> {
        let text = phyxel_scene::to_ron(&plate.scene(blades));
        let mut world = World::new(phyxel_scene::from_text(&text, "cracks", "", &[])?)?;
        world.play(STROKE, |_| {})?;
        let body = &world.bodies()[0];
        let cutting = body.cutting.as_ref();
        let cutting = cutting.ok_or("the blade of a study cuts nothing")?;
        let turn = plate.turn();
        let mut elastic = body.elastic().clone();
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

    /// Displacements (m) under a uniform stress (Pa) on all of the uncut surface, along the axes that `free` has, and the
    /// work (J) of these loads, beyond that on the body without a cut, which has the uniform displacement gradient
    /// `uniform`.
    pub(super) fn pull(
        &self,
        (stress, uniform): (DMat3, DMat3),
        free: DVec3,
    ) -> Result<(Vec<DVec3>, f64), StudyError> {
        let mut forces = vec![DVec3::ZERO; self.rest.len()];
        for face in &self.triangles {
            let [p, q, r] = face.map(|v| self.rest[v as usize]);
            let share = stress * (q - p).cross(r - p) / 6.0;
            for &v in face {
                forces[v as usize] += share;
            }
        }
        let moved = self.solve(&forces, |_| free)?;
        let nodes = forces.iter().zip(&moved).zip(&self.rest);
        let work = nodes.map(|((f, u), x)| f.dot(*u - uniform * *x)).sum();
        Ok((moved, work))
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
        // Masks free z, or the plane, or hold all: the same in both frames.
        let mask = |node: usize| mask(self.rest[node]);
        let world = |vectors: &[DVec3]| vectors.iter().map(|v| turn * *v).collect::<Vec<_>>();
        let mut elastic = self.elastic.clone();
        let (rest, forces) = (world(&self.rest), world(forces));
        let moved = small_displacements(&mut law(&mut elastic), &rest, &forces, mask)?;
        Ok(moved.iter().map(|u| back * *u).collect())
    }

    /// Displacement gradients at the nodes.
    fn gradients(&self, moved: &[DVec3]) -> Vec<DMat3> {
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

    /// Opening (m) of the cut along `normal` at a point of its face, see [`opening`].
    pub(super) fn opening(&self, moved: &[DVec3], at: DVec3, normal: DVec3) -> f64 {
        let crosses = |a: DVec3, b: DVec3| self.cuts.crosses(self.turn * a, self.turn * b);
        let gradients = self.gradients(moved);
        let field = (&self.rest[..], moved, &gradients[..]);
        opening(field, self.spacing, crosses, at, normal)
    }
}
