//! One deformable body: from its description to nodes in motion.

use std::time::{Duration, Instant};

use glam::{DMat3, DVec3};
use phyxel_discretize::{
    Bounds, Grading, MeshReport, Refinement, RepairSettings, SampleSettings, Sampling,
    Shape as Primitive, Solid, Target, read_mesh, repair, sample_tetrahedra, tetrahedra_edges,
};
use phyxel_elastic::{
    Elastic, Material, Materials, Nodes, Part, Settings as ElasticSettings, Stencils,
};
use phyxel_integrate::{
    Eigenvalue, EigenvalueSettings, Leveled, Motion, MotionSettings, StepError, Supports,
    critical_step, largest_eigenvalue, level_masses,
};
use phyxel_mls::{
    ConservativeSettings, ConservativeStencils, Neighborhoods, inverse_square_weights,
};

use super::error::{BodyProblem, WorldError};
use super::support::supports_of;
use super::tool::Touch;
use crate::scene::{self, Scene, Shape};

/// Extent of the built-in liver from right to left (m), as its own function has it.
const LIVER_WIDTH: f64 = 0.166;
/// A direction that a node's neighbours span this much less than the widest (squared lengths) counts
/// as not seen: a cut leaves surface nodes with three or four neighbours almost in a plane, whose
/// gradients across the plane would be twenty times too large.
const RANK_TOLERANCE: f64 = 0.03;
/// Room above the power iteration's estimate, which comes from below.
const EIGENVALUE_MARGIN: f64 = 0.05;
/// Share of the start of an estimate that comes from the motion.
const STIRRED: f64 = 0.5;

/// A body, its model and its motion.
#[derive(Debug)]
pub struct Body {
    /// Name in the scene.
    pub name: String,
    /// What the body occupies at rest (m).
    pub solid: Solid,
    /// What was found and repaired in the mesh file, if it came from one.
    pub report: Option<MeshReport>,
    /// Rest positions (m) of the nodes.
    pub rest: Vec<DVec3>,
    /// Nodal volumes (m³).
    pub volumes: Vec<f64>,
    /// Nodal masses (kg).
    pub masses: Vec<f64>,
    /// Tetrahedra that gave volumes and edges; results are written on them.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Deviation of the nodes' volume from the input surface's, relative; `None` for shapes
    /// without a mesh.
    pub volume_error: Option<f64>,
    /// Mean distance between neighbouring nodes (m).
    pub spacing: f64,
    /// Who is coupled with whom.
    pub neighborhoods: Neighborhoods,
    /// Gradient stencils.
    pub stencils: ConservativeStencils,
    /// Forces.
    pub elastic: Elastic,
    /// Nodes in motion.
    pub motion: Motion,
    /// Mass that was moved between neighbouring nodes, if the scene allows any.
    pub leveled: Option<Leveled>,
    /// Largest eigenvalue of the uncut body.
    pub eigenvalue: Eigenvalue,
    /// Largest eigenvalue (1/s²) as last estimated, never below the uncut body's at rest.
    pub current_eigenvalue: f64,
    /// Vector of the last estimate, where the next one starts.
    pub(super) eigenvector: Vec<DVec3>,
    /// Share of the critical step that is taken.
    pub step_factor: f64,
    /// Mass-proportional damping (1/s) once settled.
    pub damping: f64,
    /// What a cut must not change.
    pub initial: Totals,
    pending: Result<(), StepError>,
}

/// Stiffest mode of a part of a body.
#[derive(Debug)]
pub(super) struct PartMode {
    /// Its eigenvalue (1/s²).
    pub(super) value: f64,
    /// The vector, one entry per node of the part.
    vector: Vec<DVec3>,
}

/// Sums over a body's nodes before the first step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Totals {
    /// Mass (kg).
    pub mass: f64,
    /// Volume (m³).
    pub volume: f64,
}

/// The stencils as the elastic model reads them.
pub(super) fn stencil_view<'a>(
    neighborhoods: &'a Neighborhoods,
    stencils: &'a ConservativeStencils,
) -> Stencils<'a> {
    Stencils {
        offsets: neighborhoods.offsets(),
        indices: neighborhoods.indices(),
        gradients: &stencils.pair_gradients,
        self_gradients: &stencils.self_gradients,
        weights: &stencils.weights,
    }
}

impl Body {
    /// Builds the body that `description` asks for.
    ///
    /// # Errors
    /// [`WorldError`] with the body's name.
    pub fn new(scene: &Scene, description: &scene::Body) -> Result<Self, WorldError> {
        Self::build(scene, description).map_err(|problem| WorldError {
            body: description.name.clone(),
            problem,
        })
    }

    fn build(scene: &Scene, description: &scene::Body) -> Result<Self, BodyProblem> {
        let (solid, report) = solid_of(description)?;
        let sampling = sample(&solid, &description.sampling)?;
        let Sampling {
            positions: rest,
            volumes,
            boundary_vectors,
            tetrahedra,
            report: sampled,
            ..
        } = sampling;
        let (offsets, indices) = tetrahedra_edges(rest.len(), &tetrahedra);
        let neighborhoods = Neighborhoods::from_graph(offsets, indices)?;
        let weights = inverse_square_weights(&rest, &neighborhoods);
        let stencils = ConservativeStencils::new(
            &rest,
            &volumes,
            &boundary_vectors,
            &neighborhoods,
            weights,
            &ConservativeSettings {
                rank_tolerance: RANK_TOLERANCE,
                ..ConservativeSettings::default()
            },
        )?;
        let material = &description.material;
        let scene::Model::NeoHookean = material.model;
        let mut elastic = Elastic::new(
            &stencil_view(&neighborhoods, &stencils),
            &Nodes {
                rest_positions: &rest,
                volumes: &volumes,
            },
            &Materials::Uniform(Material::neo_hookean(
                material.youngs_modulus,
                material.poissons_ratio,
            )),
            &ElasticSettings {
                zero_energy_control: material.stabilization,
                ..ElasticSettings::default()
            },
        )?;
        let mut masses: Vec<f64> = volumes.iter().map(|v| material.density * v).collect();
        let initial = Totals {
            mass: masses.iter().sum(),
            volume: volumes.iter().sum(),
        };
        let supports = supports_of(scene, description, &rest);
        // Stretching stiffens; the estimate is taken at rest and the step factor leaves the room.
        let mut forces = vec![DVec3::ZERO; rest.len()];
        elastic.forces_into(&rest, &mut forces);
        let leveled = (description.moved_mass > 0.0)
            .then(|| {
                level_masses(
                    &mut masses,
                    &supports,
                    neighborhoods.offsets(),
                    neighborhoods.indices(),
                    |v, out| elastic.tangent_product_into(v, out),
                    description.moved_mass,
                )
            })
            .transpose()?;
        let mut eigenvector = Vec::new();
        let settings = EigenvalueSettings {
            margin: EIGENVALUE_MARGIN,
            ..EigenvalueSettings::default()
        };
        let eigenvalue = largest_eigenvalue(
            &masses,
            &supports,
            |v, out| elastic.tangent_product_into(v, out),
            &mut eigenvector,
            &settings,
        )?;
        if !eigenvalue.critical_step.is_finite() {
            return Err(BodyProblem::NoStiffness);
        }
        let motion = Motion::new(
            &rest,
            &masses,
            supports,
            MotionSettings {
                damping: description.damping,
                viscosity: 2.0 * description.damping_ratio / eigenvalue.value.sqrt(),
                ..MotionSettings::default()
            },
        )?;
        Ok(Self {
            name: description.name.clone(),
            solid,
            report,
            tetrahedra,
            volume_error: sampled.volume_error,
            spacing: mean_edge(&rest, &neighborhoods),
            rest,
            volumes,
            masses,
            neighborhoods,
            stencils,
            elastic,
            motion,
            current_eigenvalue: eigenvalue.value,
            eigenvector,
            leveled,
            eigenvalue,
            step_factor: scene.integration.step_factor,
            damping: description.damping,
            initial,
            pending: Ok(()),
        })
    }

    /// Largest stable step (s) of the uncut body at rest, damping included.
    #[must_use]
    pub fn critical_step(&self) -> f64 {
        critical_step(self.eigenvalue.value, self.motion.settings().viscosity)
    }

    /// Step (s) for the eigenvalue as last estimated: the step factor times the critical step.
    #[must_use]
    pub fn step_size(&self) -> f64 {
        self.step_factor * critical_step(self.current_eigenvalue, self.motion.settings().viscosity)
    }

    /// Estimates the largest eigenvalue where the body is now, from the vector of the last time,
    /// and takes it for the step.
    pub(super) fn estimate_eigenvalue(&mut self, products: usize) -> Result<f64, BodyProblem> {
        let settings = EigenvalueSettings {
            iterations: products,
            margin: EIGENVALUE_MARGIN,
            ..EigenvalueSettings::default()
        };
        self.stir();
        let elastic = &mut self.elastic;
        let found = largest_eigenvalue(
            &self.masses,
            self.motion.supports(),
            |v, out| elastic.tangent_product_into(v, out),
            &mut self.eigenvector,
            &settings,
        )?;
        self.current_eigenvalue = found.value.max(self.eigenvalue.value);
        Ok(found.value)
    }

    /// Estimates the largest eigenvalue of a part where the body is now, all other nodes held.
    pub(super) fn part_eigenvalue(
        &mut self,
        part: &Part,
        products: usize,
    ) -> Result<PartMode, BodyProblem> {
        let nodes = part.nodes();
        let masses: Vec<f64> = nodes.iter().map(|&i| self.masses[i as usize]).collect();
        let supports = self.motion.supports();
        let free = |at: usize, v: DVec3| {
            let support = supports.of(nodes[at] as usize);
            support.map_or(v, |support| support.free * v)
        };
        let settings = EigenvalueSettings {
            iterations: products,
            margin: EIGENVALUE_MARGIN,
            ..EigenvalueSettings::default()
        };
        let elastic = &mut self.elastic;
        let mut freed = vec![DVec3::ZERO; nodes.len()];
        let mut vector = Vec::new();
        let found = largest_eigenvalue(
            &masses,
            &Supports::free(nodes.len()),
            |v, out| {
                for (at, (freed, v)) in freed.iter_mut().zip(v).enumerate() {
                    *freed = free(at, *v);
                }
                elastic.tangent_product_within(part, &freed, out);
                for (at, out) in out.iter_mut().enumerate() {
                    *out = free(at, *out);
                }
            },
            &mut vector,
            &settings,
        )?;
        Ok(PartMode {
            value: found.value,
            vector,
        })
    }

    /// Takes the eigenvalue of a part for the step if it is above that of the whole as last estimated;
    /// the next estimate of the whole then starts with the part's vector in it.
    pub(super) fn take_part_eigenvalue(&mut self, part: &Part, mode: &PartMode) {
        if mode.value <= self.current_eigenvalue {
            return;
        }
        self.current_eigenvalue = mode.value;
        for (&node, part) in part.nodes().iter().zip(&mode.vector) {
            // A kept state may have no vector.
            if let Some(whole) = self.eigenvector.get_mut(node as usize) {
                *whole += *part;
            }
        }
    }

    /// Turns the vector of the last estimate towards what the nodes do against their neighbours. A
    /// mode that has stiffened past the step grows there first, and the vector of before may know
    /// nothing of it.
    fn stir(&mut self) {
        let forces = &self.motion.state().forces;
        if forces.is_empty() || self.eigenvector.len() != self.rest.len() {
            return;
        }
        let acceleration = |node: usize| forces[node] / self.masses[node];
        let apart: Vec<DVec3> = (0..self.rest.len())
            .map(|node| {
                let row = self.neighborhoods.row(node);
                let sum: DVec3 = row.iter().map(|&j| acceleration(j as usize)).sum();
                #[allow(clippy::cast_precision_loss, reason = "a row's length")]
                let count = row.len().max(1) as f64;
                acceleration(node) - sum / count
            })
            .collect();
        let length = |v: &[DVec3]| v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
        let size = length(&apart);
        if size > 0.0 {
            let share = STIRRED * length(&self.eigenvector) / size;
            for (v, a) in self.eigenvector.iter_mut().zip(&apart) {
                *v += *a * share;
            }
        }
    }

    /// Takes one step (s) with the tools that may touch the body; the times in the force law and in
    /// contact are added to `in_forces` and `in_contact`.
    pub(super) fn advance(
        &mut self,
        step: f64,
        touches: &mut [Touch],
        in_forces: &mut Duration,
        in_contact: &mut Duration,
    ) -> Result<(), BodyProblem> {
        std::mem::replace(&mut self.pending, Ok(()))?;
        let elastic = &mut self.elastic;
        let law = |positions: &[DVec3], forces: &mut [DVec3]| {
            let start = Instant::now();
            let energy = elastic.forces_into(positions, forces);
            *in_forces += start.elapsed();
            energy
        };
        if touches.is_empty() {
            self.motion.step(step, law)?;
        } else {
            self.motion.step_with(step, law, &mut |view, forces| {
                for touch in touches.iter_mut() {
                    touch.press(view, forces, in_contact);
                }
            })?;
        }
        Ok(())
    }

    /// Takes over a kept state; the model is brought to its positions.
    pub(super) fn restore(
        &mut self,
        motion: phyxel_integrate::State,
        eigenvalue: f64,
        eigenvector: Vec<DVec3>,
    ) {
        let mut forces = vec![DVec3::ZERO; self.rest.len()];
        self.elastic.forces_into(&motion.positions, &mut forces);
        self.motion.restore(motion);
        self.current_eigenvalue = eigenvalue;
        self.eigenvector = eigenvector;
        self.pending = Ok(());
    }

    /// Evaluates the forces anew after the model changed; the energy's jump is booked. A failure
    /// comes out of the next step.
    pub(super) fn reload(&mut self) {
        let elastic = &mut self.elastic;
        if let Err(error) = self.motion.refresh(|x, f| elastic.forces_into(x, f)) {
            self.pending = Err(error);
        }
    }
}

/// Mean length (m) of all pairs.
fn mean_edge(rest: &[DVec3], neighborhoods: &Neighborhoods) -> f64 {
    let mut sum = 0.0;
    for (node, x) in rest.iter().enumerate() {
        for &other in neighborhoods.row(node) {
            sum += x.distance(rest[other as usize]);
        }
    }
    #[allow(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
    let count = neighborhoods.pair_count().max(1) as f64;
    sum / count
}

/// The body's solid in the world's rest frame.
fn solid_of(body: &scene::Body) -> Result<(Solid, Option<MeshReport>), BodyProblem> {
    let at = body.position;
    let placed = |primitive: Primitive, turn: DMat3, scale: f64, shift: DVec3| {
        let inner = primitive.bounds();
        let corners = (0..8).map(|k| {
            let pick = |bit: usize, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
            let corner = DVec3::new(
                pick(0, inner.min.x, inner.max.x),
                pick(1, inner.min.y, inner.max.y),
                pick(2, inner.min.z, inner.max.z),
            );
            turn * corner * scale + shift
        });
        let back = turn.transpose();
        Solid::implicit(Bounds::of(corners), move |p| {
            scale * primitive.value(back * (p - shift) / scale)
        })
    };
    // Rotation that takes +z to the axis of a capsule or tube.
    let along = |axis: DVec3| {
        let z = axis.normalize_or(DVec3::Z);
        let (x, y) = z.any_orthonormal_pair();
        DMat3::from_cols(x, y, z)
    };
    let still = DMat3::IDENTITY;
    Ok(match &body.shape {
        Shape::Liver { width } => {
            // The organ of an upright person: its head end up, its front to -y.
            let turn = DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y);
            let natural = LIVER_WIDTH;
            (placed(Primitive::Liver, turn, width / natural, at), None)
        }
        Shape::Box { size } => {
            let (min, max) = (at - *size * 0.5, at + *size * 0.5);
            (Solid::from(Bounds { min, max }), None)
        }
        Shape::Ellipsoid { radii } => {
            let semi_axes = *radii;
            (
                placed(Primitive::Ellipsoid { semi_axes }, still, 1.0, at),
                None,
            )
        }
        Shape::Capsule { from, to, radius } => {
            let capsule = Primitive::Capsule {
                half_length: 0.5 * from.distance(*to),
                radius: *radius,
            };
            let shift = at + from.midpoint(*to);
            (placed(capsule, along(*to - *from), 1.0, shift), None)
        }
        Shape::Tube {
            from,
            to,
            inner_radius,
            outer_radius,
        } => {
            let tube = Primitive::Tube {
                half_length: 0.5 * from.distance(*to),
                outer_radius: *outer_radius,
                inner_radius: *inner_radius,
            };
            let shift = at + from.midpoint(*to);
            (placed(tube, along(*to - *from), 1.0, shift), None)
        }
        Shape::Mesh { file, scale, up } => {
            let mut mesh = read_mesh(file)?.mesh;
            let turn = up.rotation();
            for vertex in &mut mesh.vertices {
                *vertex = turn * (*vertex * *scale) + at;
            }
            let repaired = repair(&mesh, &RepairSettings::default());
            let (mesh, report) = repaired.map_err(|problem| BodyProblem::Repair {
                file: file.clone(),
                problem,
            })?;
            (Solid::from_mesh(mesh), Some(report))
        }
    })
}

fn sample(solid: &Solid, wish: &scene::Sampling) -> Result<Sampling, BodyProblem> {
    let target = match wish.target {
        scene::Target::Spacing(spacing) => {
            check_count(solid, spacing, wish.limit)?;
            Target::Spacing(spacing)
        }
        scene::Target::Nodes(count) => Target::NodeCount(count as usize),
    };
    let refinements = wish.refine.iter().map(|place| Refinement {
        from: place.from,
        to: place.to,
        radius: place.radius,
        factor: place.factor,
    });
    let settings = SampleSettings {
        target,
        grading: Grading {
            coarsest: wish.coarsest,
            refinements: refinements.collect(),
            ..Grading::default()
        },
        ..SampleSettings::default()
    };
    Ok(sample_tetrahedra(solid, &settings)?)
}

/// Refuses a spacing that would make more nodes than the limit, before memory is taken.
fn check_count(solid: &Solid, spacing: f64, limit: u32) -> Result<(), BodyProblem> {
    let volume = solid.mesh().map_or_else(
        || 0.5 * solid.bounds().size().element_product(),
        phyxel_discretize::Mesh::volume,
    );
    // A body-centred lattice whose mean edge is the spacing has 1.57 nodes in a spacing cubed.
    let estimate = 1.57 * volume / (spacing * spacing * spacing);
    if estimate > f64::from(limit) {
        return Err(BodyProblem::TooManyNodes {
            spacing,
            estimate,
            limit,
            advice: spacing * (estimate / f64::from(limit)).cbrt(),
        });
    }
    Ok(())
}
