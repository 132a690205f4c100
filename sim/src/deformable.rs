//! Contact of bodies with each other and of the flanks of their cuts: surface samples that follow cuts.

use glam::DVec3;
use phyxel_discretize::{boundary_triangles, sample_surfels, surface_mesh};
use phyxel_integrate::{
    ContactDisks, DeformableContact, DeformableSettings, DeformableState, DiskSample, Outside,
    StepView, TouchingNodes,
};
use phyxel_splat::{CAPSULE, Tissue, TissueSettings};

use crate::Body;
use crate::cutting::CutUpdate;
use crate::error::{BodyProblem, WorldError, in_body};
use crate::scene::Scene;

/// Samples per squared spacing of nodes.
const DENSITY: f64 = 4.0;
/// Rate at which offsets learn, over the least damping of the bodies.
const LEARNING: f64 = 0.5;
/// Nodes of a sample: enough for a linear fit on one side of a cut.
const NODES: usize = 16;
/// A body's surface as it touches others and itself.
#[derive(Debug, Clone)]
struct BodySurface {
    tissue: Tissue,
    /// Sample of each surfel.
    samples: Vec<u32>,
    outside: Outside,
    /// Area vectors (m²) that cuts have opened at nodes; empty before the first.
    opened: Vec<DVec3>,
    /// Of its samples (Pa/m), and the distance (m) of its nodes.
    stiffness: f64,
    spacing: f64,
}

/// All bodies as their surfaces touch.
#[derive(Debug, Clone)]
pub(crate) struct DeformableBodies {
    pub(crate) contact: DeformableContact,
    nodes: TouchingNodes,
    surfaces: Vec<BodySurface>,
}

impl DeformableBodies {
    /// The uncut bodies of a scene; `None` if it asks for no contact between them.
    pub(crate) fn new(scene: &Scene, bodies: &[Body]) -> Result<Option<Self>, WorldError> {
        let Some(contact) = &scene.contact else {
            return Ok(None);
        };
        let (mut surfaces, mut nodes) = (Vec::new(), TouchingNodes::default());
        for (body, description) in bodies.iter().zip(&scene.bodies) {
            surfaces.push(BodySurface {
                tissue: in_body(tissue_of(body), &body.name)?,
                samples: Vec::new(),
                outside: Outside::new(&boundary_triangles(&body.tetrahedra, |_| true)),
                opened: Vec::new(),
                stiffness: description.material.youngs_modulus / body.spacing,
                spacing: body.spacing,
            });
            nodes.push(&body.rest, &body.masses);
        }
        let name = |body: u32| scene.bodies[body as usize].name.as_str();
        let friction = |a: u32, b: u32| contact.friction_of(name(a), name(b));
        let mut all = Self {
            contact: DeformableContact::new(
                ContactDisks::default(),
                DeformableSettings::default(),
                index(bodies.len()),
                friction,
            ),
            nodes,
            surfaces,
        };
        let mut disks = ContactDisks::default();
        for (at, body) in bodies.iter().enumerate() {
            all.take_new(body, at, &mut disks);
        }
        all.contact.set_disks(disks, &[], &[]);
        Ok(Some(all))
    }

    /// Adds samples for the surfels of a body that have none.
    fn take_new(&mut self, body: &Body, at: usize, disks: &mut ContactDisks) {
        let BodySurface {
            samples, tissue, ..
        } = &self.surfaces[at];
        for surfel in samples.len()..tissue.surfels().len() {
            let (sample, nodes, areas) = self.sample(body, at, surfel);
            self.surfaces[at].samples.push(index(disks.len()));
            disks.push(sample, (&nodes, &areas), self.nodes.rest());
        }
    }

    /// A surfel as a sample, with the nodes that may bear it and what cuts have opened there.
    fn sample(&self, body: &Body, at: usize, surfel: usize) -> (DiskSample, Vec<u32>, Vec<DVec3>) {
        let surface = &self.surfaces[at];
        let tissue = &surface.tissue;
        let (row, _) = tissue.binding().row(surfel);
        let disk = &tissue.surfels()[surfel];
        // Linear interpolation on a triangle gives its corners what their share of the surface bears; rows of flanks
        // and of what a cut hides are fitted.
        let outer = surfel < tissue.outer_count();
        let triangle = outer.then(|| {
            let outside = &surface.outside;
            outside.triangle(&body.rest, disk.position, row)
        });
        let triangle = triangle.flatten();
        let nodes = triangle.as_ref().map_or(row, |triangle| &triangle[..]);
        let sample = DiskSample {
            position: disk.position,
            normal: disk.normal,
            area: disk.area,
            flank: disk.material != CAPSULE,
            body: index(at),
            stiffness: surface.stiffness,
            spacing: surface.spacing,
        };
        let mut nodes = nodes.to_vec();
        let mut areas = Vec::new();
        if sample.flank && !surface.opened.is_empty() {
            let graph = &body.neighborhoods;
            for &node in row {
                let pairs = graph.pairs(node as usize).zip(graph.row(node as usize));
                let linked = pairs.filter(|(pair, _)| body.stencils.weights[*pair] > 0.0);
                nodes.extend(linked.map(|(_, other)| other));
            }
            areas.extend(nodes.iter().map(|node| surface.opened[*node as usize]));
        }
        let first = index(self.nodes.of(at).start);
        for node in &mut nodes {
            *node += first;
        }
        (sample, nodes, areas)
    }

    /// Takes what a cut that changed the rows of `touched` nodes has opened; which nodes bear more or less since.
    fn open(&mut self, body: &Body, at: usize, touched: &[u32]) -> Vec<bool> {
        let opened = &mut self.surfaces[at].opened;
        opened.resize(body.rest.len(), DVec3::ZERO);
        let mut others = vec![false; opened.len()];
        let graph = &body.neighborhoods;
        for node in graph.around(touched) {
            let node = node as usize;
            let area = body.stencils.opened_area(&body.rest, graph, node);
            others[node] |= opened[node] != area;
            opened[node] = area;
        }
        others
    }

    /// Follows a cut that a body has taken: new flanks, and surfels that see other nodes.
    pub(crate) fn grow(
        &mut self,
        bodies: &[Body],
        index: usize,
        update: &CutUpdate,
    ) -> Result<(), BodyProblem> {
        let body = &bodies[index];
        let others = self.open(body, index, &update.touched);
        let BodySurface {
            tissue, samples, ..
        } = &mut self.surfaces[index];
        let mut changed = body.cut_surface(tissue, &update.triangles)?;
        changed.extend(tissue.part(&body.pieces().piece));
        let known = samples.len();
        let flanks = tissue.outer_count()..known;
        let is_other = |surfel: &usize| {
            let (nodes, _) = tissue.binding().row(*surfel);
            nodes.iter().any(|node| others[*node as usize])
        };
        changed.extend(flanks.filter(is_other).map(self::index));
        changed.sort_unstable();
        changed.dedup();
        if changed.iter().all(|surfel| *surfel as usize >= known) && tissue.surfels().len() == known
        {
            return Ok(());
        }
        let changed = changed.iter().map(|&surfel| surfel as usize);
        self.begin(bodies);
        let mut disks = self.contact.take_disks(self.nodes.positions());
        let mut set = Vec::new();
        for surfel in changed.filter(|surfel| *surfel < known) {
            let (sample, nodes, areas) = self.sample(body, index, surfel);
            let at = self.surfaces[index].samples[surfel] as usize;
            disks.set(at, sample, (&nodes, &areas), self.nodes.rest());
            set.push(at);
        }
        self.take_new(body, index, &mut disks);
        self.contact.set_disks(disks, &set, self.nodes.positions());
        Ok(())
    }

    /// Begins a step. Offsets learn at half the rate of the least damping, so that they feed no motion. What lies by its
    /// weight, by `gravity` (m/s²) in full, loses its bounce at the rate of that damping, from which rigid motions of free
    /// bodies are spared.
    pub(crate) fn begin_step(&mut self, bodies: &[Body], gravity: f64) {
        let damping = bodies.iter().map(|body| body.motion().settings().damping);
        let least = damping.fold(f64::INFINITY, f64::min);
        let drag = if gravity > 0.0 { least / gravity } else { 0.0 };
        self.contact.set_rates(LEARNING * least, drag);
        self.begin(bodies);
        self.nodes.clear_pieces();
        for (at, body) in bodies.iter().enumerate() {
            for piece in body.motion().free_pieces() {
                self.nodes.add_piece(at, piece);
            }
        }
    }

    /// Remembers where bodies' nodes are at the begin of a step.
    fn begin(&mut self, bodies: &[Body]) {
        for (at, body) in bodies.iter().enumerate() {
            self.nodes.place(at, body.motion().positions());
        }
    }

    /// Takes where a body's nodes are at the end of a step.
    pub(crate) fn take(&mut self, body: usize, view: &StepView<'_>) {
        self.nodes.take(body, view.positions);
    }

    /// Computes the forces once all bodies' nodes are known.
    pub(crate) fn press(&mut self, step: f64) {
        self.contact.update_forces(&self.nodes.moved(step));
    }

    /// Adds the forces on a body's nodes.
    pub(crate) fn give(&self, body: usize, forces: &mut [DVec3]) {
        let own = &self.contact.state().forces[self.nodes.of(body)];
        for (sum, force) in forces.iter_mut().zip(own) {
            *sum += *force;
        }
    }

    /// The bound of what contact adds to the largest eigenvalue, if it is another than before.
    pub(crate) fn new_bound(&mut self, bodies: &[Body]) -> Option<f64> {
        if self.contact.state().listed_at.is_empty() {
            self.begin(bodies);
            self.contact.update_lists(self.nodes.positions());
        }
        self.contact.new_bound(self.nodes.masses())
    }

    /// Contact pressure (Pa) at each node of a body.
    pub(crate) fn pressures(&self, bodies: &[Body], body: usize) -> Vec<f64> {
        let positions = bodies.iter().map(|body| body.motion().positions());
        let positions = positions.collect::<Vec<_>>().concat();
        self.contact.pressures(&positions)[self.nodes.of(body)].to_vec()
    }

    pub(crate) fn fits(&self, state: &DeformableState) -> bool {
        self.contact.fits(state, self.nodes.rest().len())
    }

    /// Goes back to a snapshot; the bound there.
    pub(crate) fn restore(&mut self, state: DeformableState) -> f64 {
        let bound = state.bound;
        self.contact.restore(state);
        bound
    }

    pub(crate) fn bytes(&self) -> usize {
        let tissues = self.surfaces.iter().map(|surface| surface.tissue.bytes());
        self.contact.bytes() + self.nodes.bytes() + tissues.sum::<usize>()
    }
}

/// Samples of a body's surface at rest.
fn tissue_of(body: &Body) -> Result<Tissue, BodyProblem> {
    let surface = surface_mesh(&body.solid, 0.5 * body.spacing)?;
    let density = DENSITY / (body.spacing * body.spacing);
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a positive number, and as many samples as there is memory for"
    )]
    let count = (density * surface.area()).round().max(1.0) as usize;
    let samples = sample_surfels(&surface, count, Some(&body.solid));
    let settings = TissueSettings {
        neighbors: NODES,
        skin_density: Some(density),
        ..TissueSettings::default()
    };
    let (positions, normals) = (&samples.positions, &samples.normals);
    let tissue = Tissue::new(positions, normals, &samples.areas, &body.rest, &settings)?;
    Ok(tissue)
}

fn index(count: usize) -> u32 {
    u32::try_from(count).expect("fewer than 2^32 samples")
}

#[cfg(test)]
mod tests {
    use crate::scene::{BodyContact, Target, embedded};
    use crate::testing::{assert_alike, small};
    use crate::{Body, World};

    /// Sum of the amounts of all normal forces (N).
    fn normal(world: &World) -> f64 {
        let (between, _) = world.body_contact().unwrap();
        between.iter().map(|sum| sum.normal).sum()
    }

    /// A block that is cut through touches itself along its flanks, and continues bitwise from a state.
    #[test]
    fn flanks_that_touch_are_part_of_the_state() {
        let mut scene = small("block", 300);
        scene.contact = Some(BodyContact {
            friction: 0.3,
            ..BodyContact::default()
        });
        for key in scene.cuts.iter_mut().flat_map(|cut| &mut cut.path) {
            key.time *= 0.05;
        }
        let mut world = World::new(scene.clone()).unwrap();
        let outer = world.deformable.as_ref().unwrap().surfaces[0]
            .tissue
            .outer_count();
        let mut pressed = 0.0_f64;
        let mut again = World::new(scene.clone()).unwrap();
        let mut begun = 0;
        for step in 0..400 {
            world.step().unwrap();
            pressed = pressed.max(normal(&world));
            // After lists were made in a step, or by a cut, the next step has a new bound.
            let contact = &world.deformable.as_ref().unwrap().contact;
            if !contact.state().is_bounded || step == 90 {
                again = World::new(scene.clone()).unwrap();
                again.restore(world.state(), |_, _| ()).unwrap();
                assert_alike(&mut world, &mut again, 3);
                begun += 1;
            }
        }
        assert!(begun > 1, "{begun} continued");
        let contact = world.deformable.as_ref().unwrap();
        assert!(
            contact.surfaces[0].samples.len() > outer + 20,
            "flanks have samples"
        );
        assert!(pressed > 0.0, "they are pressed");
        let contact = &world.deformable.as_ref().unwrap().contact;
        let (state, motion) = (contact.state(), world.bodies()[0].motion());
        let (nodes, moved) = (motion.positions().len(), motion.audit().scale());
        let error = state.energy_error();
        assert!(error.abs() < 0.002 * moved, "{error} of {moved}");
        assert!(contact.fits(state, nodes) && !contact.fits(state, nodes + 1));
        let mut broken = world.state();
        broken.contact.as_mut().unwrap().energy = f64::NAN;
        let refused = again.restore(broken, |_, _| ()).unwrap_err();
        assert!(refused.to_string().contains("contact"), "{refused}");
    }

    /// Blocks that close at up to 0.65 of the speed of sound bounce: each is stopped by a pressure of 0.7 of Young's modulus.
    /// At 0.86 some pass through each other, with 200 and 1,000 nodes, not with 400; at 1.7 all do, and the run says so.
    #[test]
    fn blocks_that_meet_bounce_or_it_is_said() {
        let blow = |speed: f64| {
            let block = |name: &str, x: f64, v: f64| {
                format!(
                    "(name: \"{name}\", shape: Box(size: (0.04, 0.03, 0.03)), position: ({x}, 0, 0), velocity: ({v}, 0, 0),
                      sampling: (target: Nodes(200)),
                      material: (youngs_modulus: 1e4, poissons_ratio: 0.4, density: 1000))"
                )
            };
            let (a, b) = (block("a", -0.021, speed), block("b", 0.021, -speed));
            let text = format!(
                "(version: 1, bodies: [{a}, {b}], contact: (between: All),
                  integration: (duration: {}, settle: None))",
                0.06 / speed
            );
            let mut world =
                World::new(phyxel_scene::from_text(&text, "blow", "", &[]).unwrap()).unwrap();
            while !world.is_over() {
                world.step().unwrap();
            }
            let middle = |body: &Body| {
                let places = body.motion().positions();
                places.iter().map(|x| x.x).sum::<f64>() / places.len() as f64
            };
            let [a, b] = world.bodies() else {
                panic!("two bodies")
            };
            (middle(a) < middle(b), world.alarms().to_vec())
        };
        let (bounce, alarms) = blow(0.6);
        assert!(bounce && alarms.is_empty(), "{alarms:?}");
        assert!(blow(1.5).0, "closing at 0.65 of the speed of sound");
        let (_, alarms) = blow(4.0);
        let said = "bodies 'a' and 'b' press into each other";
        assert!(
            alarms.iter().any(|alarm| alarm.starts_with(said)),
            "{alarms:?}"
        );
    }

    /// Two pads come to lie on each other and on a tray: nothing passes through, the books close.
    #[test]
    fn a_body_rests_on_another() {
        let mut scene = embedded("stack", &[]).expect("it is there");
        for body in &mut scene.bodies {
            body.sampling.target = Target::Nodes(200);
        }
        scene.pictures = None;
        scene.integration.duration = 0.3;
        let mut world = World::new(scene).unwrap();
        let (mut deepest, mut push, mut time) = (0.0_f64, 0.0, 0.0);
        world
            .play(0.3, |world| {
                let (between, _) = world.body_contact().unwrap();
                for sum in between {
                    assert_eq!(sum.bodies, [0, 1], "uncut bodies do not touch themselves");
                    deepest = deepest.max(sum.penetration);
                    if world.time() > 0.1 {
                        push -= sum.force.z * world.step_size();
                    }
                }
                if world.time() > 0.1 {
                    time += world.step_size();
                }
            })
            .unwrap();
        let spacing = world.bodies[0].spacing;
        assert!(deepest < 0.25 * spacing, "{deepest} m of {spacing} m");
        let weight = world.bodies[1].mass * 9.81;
        let mean = push / time / weight;
        assert!((mean - 1.0).abs() < 0.2, "it bears {mean} of its weight");
        let pressures = world.contact_pressures(1).unwrap();
        let body = &world.bodies[1];
        let mean = |below: bool| {
            let nodes = body.rest.iter().zip(&pressures);
            let nodes: Vec<f64> = nodes
                .filter(|(x, _)| (x.z < 0.04) == below)
                .map(|(_, p)| *p)
                .collect();
            nodes.iter().sum::<f64>() / nodes.len() as f64
        };
        let expected = weight / (0.06 * 0.05);
        assert!(
            mean(true) > 0.2 * expected && mean(true) < 2.0 * expected,
            "{} Pa",
            mean(true)
        );
        assert!(mean(false) == 0.0, "nothing presses from above");
        let (_, state) = world.body_contact().unwrap();
        assert!(state.dissipated >= 0.0 && state.energy > 0.0, "{state:?}");
        assert!(world.retaken().unbalanced == 0, "{:?}", world.retaken());
        assert!(world.alarms().is_empty(), "{:?}", world.alarms());
    }
}
