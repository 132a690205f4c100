//! Cracks as scenes make them: a blade slits a body at its defaults, the body is loaded at rest.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use phyxel_discretize::boundary_triangles;
use phyxel_enrich::Cuts;

use super::field::{Field, opening, plane_modulus, stress_intensities};
use super::problems::{Ratios, centre_shapes, edge_shapes};
use super::{POISSON, YOUNG};
use crate::scene::{self, Key, Scene, Shape, Target};
use crate::study::StudyError;
use crate::study::model::small_displacements;
use crate::study::noise::noisy;
use crate::world::{Body, Cutting, Filling, World};

/// A body that a blade has slit.
struct Slit {
    world: World,
    triangles: Vec<[u32; 3]>,
    half: DVec3,
}

/// Where a crack lies relative to the nodes of a scene, and what they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Distance (spacings) of the crack's plane from a plane of nodes.
    pub off: f64,
    /// Largest move of an inner node along each axis (spacings); 0 leaves the lattice that the scene
    /// samples.
    pub jitter: f64,
}

impl Slit {
    /// A box of `size` (m) about the origin with nodes `spacing` apart (m), and the strokes that
    /// `strokes` makes for the height of a plane of nodes next to the middle.
    fn new(
        size: DVec3,
        spacing: f64,
        jitter: f64,
        axis: DVec3,
        strokes: impl Fn(f64) -> Vec<scene::Cut>,
    ) -> Result<Self, StudyError> {
        let mut wish = scene::Body::new(Shape::Box { size });
        wish.sampling.target = Target::Spacing(spacing);
        wish.material.youngs_modulus = YOUNG;
        wish.material.poissons_ratio = POISSON;
        let mut scene = Scene::new("crack", vec![wish]);
        scene.gravity = None;
        scene.integration.settle = None;
        let whole = Body::new(&scene, &scene.bodies[0])?;
        let filling = shaken(&whole, jitter * spacing);
        scene.cuts = strokes(plane_near(&whole.rest, axis, 0.25 * spacing));
        let end = scene.cuts.iter().map(scene::Cut::end).fold(0.0, f64::max);
        let fillings: &[Filling] = if jitter > 0.0 { &[filling] } else { &[] };
        let mut world = World::filled(scene, fillings)?;
        // A blade's last place is taken up in the first step that starts after it.
        let mut ended = false;
        while !ended {
            ended = world.scene_time().is_some_and(|time| time > end);
            world.step()?;
        }
        Ok(Self {
            triangles: boundary_triangles(&world.members()[0].body.tetrahedra, |_| true),
            half: 0.5 * size,
            world,
        })
    }

    fn body(&self) -> &Body {
        &self.world.members()[0].body
    }

    /// The cut; none if the blade met nothing.
    fn cuts(&self) -> Result<&Cuts, StudyError> {
        let cutting = self.world.members()[0].cutting.as_ref();
        let cuts = cutting.map(Cutting::cuts);
        let cuts = cuts.filter(|cuts| cuts.triangle_count() > 0);
        cuts.ok_or(StudyError::NotSolved { residual: 1.0 })
    }

    /// Nodal forces (N) of 1 Pa of tension along an axis on the two sides of the box across it.
    ///
    /// The edges of the body are bevelled by its sampling; the forces sum to those of the box.
    fn tension(&self, axis: DVec3) -> Vec<DVec3> {
        let rest = &self.body().rest;
        let mut forces = vec![DVec3::ZERO; rest.len()];
        let full = 4.0 * self.half.element_product() / self.half.dot(axis);
        for sign in [1.0, -1.0] {
            let mut found = 0.0;
            let mut shares = Vec::new();
            for face in &self.triangles {
                let [p, q, r] = face.map(|v| rest[v as usize]);
                let normal = 0.5 * (q - p).cross(r - p);
                let level = sign * (p + q + r).dot(axis) / 3.0;
                if level > self.half.dot(axis) - 0.1 * self.body().spacing
                    && sign * normal.dot(axis) > 0.99 * normal.length()
                {
                    found += normal.length();
                    shares.push((face, normal.length() / 3.0));
                }
            }
            for (face, share) in shares {
                for &v in face {
                    forces[v as usize] += sign * axis * share * full / found;
                }
            }
        }
        forces
    }

    fn solve(
        &self,
        forces: &[DVec3],
        mask: impl Fn(DVec3) -> DVec3,
    ) -> Result<Vec<DVec3>, StudyError> {
        small_displacements(
            &mut self.body().elastic.clone(),
            &self.body().rest,
            forces,
            mask,
        )
    }

    /// Displacement gradients of small displacements.
    fn gradients(&self, u: &[DVec3]) -> Vec<DMat3> {
        let mut elastic = self.body().elastic.clone();
        let largest = u.iter().map(|u| u.length()).fold(0.0, f64::max);
        let scale = 1e-6 * self.body().spacing / largest;
        let rest = &self.body().rest;
        let moved: Vec<DVec3> = rest.iter().zip(u).map(|(x, u)| *x + scale * *u).collect();
        elastic.forces_into(&moved, &mut vec![DVec3::ZERO; u.len()]);
        let gradients = elastic.deformation_gradients().iter();
        gradients
            .map(|f| (*f - DMat3::IDENTITY) * scale.recip())
            .collect()
    }
}

/// A body's tetrahedra with the nodes inside moved by up to `by` (m) along each axis.
fn shaken(body: &Body, by: f64) -> Filling {
    let mut positions = body.rest.clone();
    let mut outer = vec![false; positions.len()];
    for face in boundary_triangles(&body.tetrahedra, |_| true) {
        for v in face {
            outer[v as usize] = true;
        }
    }
    let mut state = 5;
    for (x, _) in positions
        .iter_mut()
        .zip(&outer)
        .filter(|(_, outer)| !**outer)
    {
        *x += noisy(&mut state, by);
    }
    Filling {
        positions,
        tetrahedra: body.tetrahedra.clone(),
    }
}

/// Height along an axis of the plane with the most nodes within `range` (m) of the origin's.
fn plane_near(rest: &[DVec3], axis: DVec3, range: f64) -> f64 {
    let mut heights: Vec<f64> = rest.iter().map(|x| x.dot(axis)).collect();
    heights.retain(|h| h.abs() <= range);
    heights.sort_by(f64::total_cmp);
    let near = |h: f64| {
        heights
            .iter()
            .filter(|o| (*o - h).abs() < 1e-6 * range)
            .count()
    };
    let best = heights.iter().copied().max_by_key(|&h| near(h));
    best.unwrap_or(0.0)
}

/// A straight stroke (m) of an edge along z.
fn stroke(from: DVec3, to: DVec3, reach: f64) -> scene::Cut {
    let key = |time: f64, position: DVec3| Key {
        time,
        position,
        rotation: DVec3::ZERO,
    };
    scene::Cut {
        name: "crack".to_owned(),
        body: None,
        edge: vec![-reach * DVec3::Z, reach * DVec3::Z],
        path: vec![key(0.0, from), key(0.5, to)],
        capture: scene::Capture::default(),
        weld_tolerance: None,
    }
}

/// Edge crack of length `a` in a strip of width 1 and height 3 under tension, plane strain, as a scene
/// with `across` spacings over its width makes it: `K_I` and mouth opening over those of Tada, Paris
/// and Irwin.
///
/// # Errors
/// [`StudyError`] if the world ends or the displacements are not found.
pub fn edge_crack_in_scene(across: u32, a: f64, place: Place) -> Result<Ratios, StudyError> {
    let dx = f64::from(across).recip();
    let size = DVec3::new(1.0, 3.0, 3.0 * dx);
    let line = |plane: f64| plane + place.off * dx;
    let slit = Slit::new(size, dx, place.jitter, DVec3::Y, |plane| {
        let at = |x: f64| DVec3::new(x - 0.5, line(plane), 0.0);
        vec![stroke(at(-3.0 * dx), at(a), 4.0 * dx)]
    })?;
    let y = slit.cuts()?.triangle(0)[0].y;
    let u = slit.solve(&slit.tension(DVec3::Y), |_| DVec3::new(1.0, 1.0, 0.0))?;
    let gradients = slit.gradients(&u);
    let field = Field {
        rest: &slit.body().rest,
        volumes: &slit.body().volumes,
        gradients: &gradients,
        thickness: size.z,
        cuts: slit.cuts()?,
    };
    let tip = DVec3::new(a - 0.5, y, 0.0);
    let k = stress_intensities(&field, tip, DVec3::X, 6.0_f64.min(0.3 / dx) * dx);
    let (shape, opening_shape) = edge_shapes(a);
    let at = DVec3::new(-0.5, y, 0.0);
    let mouth = opening(
        (&slit.body().rest, dx),
        slit.cuts()?,
        &u,
        &gradients,
        at,
        DVec3::Y,
    );
    Ok(Ratios {
        first: k[0] / (shape * (PI * a).sqrt()),
        second: mouth / (4.0 * a * opening_shape / plane_modulus()),
        seconds: [0.0; 3],
        nodes: u.len(),
    })
}

/// Centre crack, half length `a`, in a strip of half width 1 and half height 1.5 under tension, plane
/// strain, as a scene with `across` spacings over its width makes it: `K_I`, mean of both tips, and
/// opening at the middle over those of Tada, Paris and Irwin.
///
/// # Errors
/// [`StudyError`] if the world ends or the displacements are not found.
pub fn centre_crack_in_scene(across: u32, a: f64, place: Place) -> Result<Ratios, StudyError> {
    let dx = 2.0 / f64::from(across);
    let size = DVec3::new(2.0, 3.0, 3.0 * dx);
    let slit = Slit::new(size, dx, place.jitter, DVec3::Y, |plane| {
        let at = |x: f64| DVec3::new(x, plane + place.off * dx, 0.0);
        vec![stroke(at(-a), at(a), 4.0 * dx)]
    })?;
    let y = slit.cuts()?.triangle(0)[0].y;
    let u = slit.solve(&slit.tension(DVec3::Y), |_| DVec3::new(1.0, 1.0, 0.0))?;
    let gradients = slit.gradients(&u);
    let field = Field {
        rest: &slit.body().rest,
        volumes: &slit.body().volumes,
        gradients: &gradients,
        thickness: size.z,
        cuts: slit.cuts()?,
    };
    let k: f64 = [DVec3::X, -DVec3::X]
        .map(|along| stress_intensities(&field, a * along + y * DVec3::Y, along, 5.0 * dx)[0])
        .iter()
        .sum();
    let (reference, shape) = centre_shapes(a);
    let middle = DVec3::new(0.0, y, 0.0);
    let mouth = opening(
        (&slit.body().rest, dx),
        slit.cuts()?,
        &u,
        &gradients,
        middle,
        DVec3::Y,
    );
    Ok(Ratios {
        first: 0.5 * k / reference,
        second: mouth / (4.0 * a * shape / plane_modulus()),
        seconds: [0.0; 3],
        nodes: u.len(),
    })
}
