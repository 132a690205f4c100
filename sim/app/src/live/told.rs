//! What clients receive of a world.

use glam::{DMat3, DVec3};
use phyxel_elastic::von_mises_stress;
use phyxel_live::{BodyInfo, Picture, Quantity, Scene as SceneInfo, Stats, ToolInfo, ToolState};
use phyxel_splat::Camera;

use super::session::Session;
use super::sources::Sources;
use crate::picture::bounds_of;
use phyxel::World;
use phyxel::scene::{Scene, Shape, ToolShape, View};

/// Positions (m) and deformation gradients of each body's nodes.
pub(super) fn nodes_of(world: &World) -> Vec<(Vec<DVec3>, Vec<DMat3>)> {
    let bodies = world.bodies().iter().map(|body| {
        let gradients = body.elastic().deformation_gradients();
        (body.smoothed_positions(), gradients)
    });
    bodies.collect()
}

/// Numbers (Pa) of quantities (bits of [`StateMessage::values`]) at each body's nodes; nothing is computed for those not asked for.
pub(super) fn values_of(world: &World, quantities: u32) -> Vec<Vec<f32>> {
    let asked = |quantity: Quantity| quantities & quantity.bit() != 0;
    let bodies = world.bodies().iter().enumerate().map(|(index, body)| {
        let mut values = Vec::new();
        if asked(Quantity::Stress) {
            let (elastic, nodes) = (body.elastic(), 0..body.rest.len());
            values.extend(nodes.map(|node| von_mises_stress(elastic.cauchy_stress(node))));
        }
        if asked(Quantity::Contact) {
            let others = world.contact_pressures(index).unwrap_or_default();
            let others = others.into_iter().chain(std::iter::repeat(0.0));
            let tools = world.tool_pressures(index);
            values.extend(tools.into_iter().zip(others).map(|(a, b)| f64::max(a, b)));
        }
        values.into_iter().map(single).collect()
    });
    bodies.collect()
}

#[expect(clippy::cast_possible_truncation, reason = "colours need no more")]
fn single(value: f64) -> f32 {
    value as f32
}

pub(super) fn tool_states(world: &World) -> Vec<ToolState> {
    let tools = world.tool_forces().into_iter().map(|tool| ToolState {
        position: tool.pose.position,
        rotation: tool.pose.rotation,
        force: tool.force,
        torque: tool.torque,
        penetration: tool.penetration,
    });
    tools.collect()
}

/// The scene as clients see it. `base` is what it was before users got it.
pub(super) fn scene_of(
    epoch: u32,
    session: &Session,
    base: &Scene,
    sources: &Sources,
    recordings: Vec<String>,
) -> SceneInfo {
    let (world, painter) = (session.world(), session.painter());
    let bounds = bounds_of(world);
    let settings = painter.settings();
    let bodies = world.bodies().iter().zip(painter.skins());
    let bodies = bodies.map(|(body, skin)| {
        let surfaces = skin.surfaces.iter();
        let surfaces = surfaces.map(|s| [s.specular, s.shininess, s.relief, s.relief_frequency]);
        BodyInfo {
            name: body.name.clone(),
            nodes: body.rest.len(),
            outer: skin.tissue.outer_count(),
            surfaces: surfaces.collect(),
            inside: skin.depth_color().to_array(),
        }
    });
    let background = &settings.background;
    SceneInfo {
        epoch,
        name: base.name.clone(),
        description: base.description.clone(),
        scenes: sources.names(),
        low: bounds.min.to_array(),
        high: bounds.max.to_array(),
        view: view_of(base),
        bodies: bodies.collect(),
        tools: world.scene().tools.iter().map(tool_of).collect(),
        values: settings_of(session),
        recordings,
        length: session.recorded_time(),
        capture: session.capture(),
        spacing: session.spacing(),
        background: [background.top.to_array(), background.bottom.to_array()],
        tolerance: settings.tolerance,
        max_stretch: phyxel_splat::TissueSettings::default().max_stretch,
        settling: session.is_settling(),
        hand: if base.cuts.is_empty() && !base.tools.is_empty() {
            "press"
        } else {
            "cut"
        },
        unit: sources.mesh_of(&base.name).and_then(|_| unit_of(base)),
    }
}

/// Azimuth, elevation (degrees) and zoom of the scene's camera.
fn view_of(scene: &Scene) -> [f64; 3] {
    let pictures = scene.pictures.as_ref();
    match pictures.map(|pictures| pictures.view).unwrap_or_default() {
        View::Around {
            azimuth,
            elevation,
            zoom,
            ..
        } => [azimuth, elevation, zoom],
        View::Explicit { eye, target, .. } => {
            let from = eye - target;
            let azimuth = from.x.atan2(-from.y).to_degrees();
            let elevation = from.z.atan2(from.x.hypot(from.y)).to_degrees();
            [azimuth, elevation, 1.0]
        }
    }
}

/// Metres per unit of the mesh that is the first body's shape.
fn unit_of(scene: &Scene) -> Option<f64> {
    match scene.bodies.first()?.shape {
        Shape::Mesh { scale, .. } => Some(scale),
        _ => None,
    }
}

fn tool_of(tool: &phyxel::scene::Tool) -> ToolInfo {
    let zero = [0.0; 3];
    let (shape, points, radius) = match tool.solid() {
        ToolShape::Sphere { radius } => ("sphere", [zero, zero], radius),
        ToolShape::Capsule { from, to, radius } => {
            ("capsule", [from.to_array(), to.to_array()], radius)
        }
        ToolShape::Box { size } => ("box", [size.to_array(), zero], 0.0),
        ToolShape::Plane { normal } => ("plane", [normal.to_array(), zero], 0.0),
    };
    ToolInfo {
        name: tool.name.clone(),
        shape,
        points,
        radius,
    }
}

/// Gravity, damping and Young's modulus as they are.
fn settings_of(session: &Session) -> [f64; 3] {
    let world = session.world();
    let first = world.scene().bodies.first();
    let modulus = first.map_or(0.0, |body| body.material.youngs_modulus);
    [world.gravity().length(), world.damping(), modulus]
}

/// Kinetic energy (J), elastic energy (J), and balance of the audit over its scale, of all bodies.
pub(super) fn energies_of(world: &World) -> [f64; 3] {
    let (mut energies, mut scale) = ([0.0; 3], 0.0);
    for body in world.bodies() {
        let audit = body.motion().audit();
        energies[0] += audit.kinetic;
        energies[1] += audit.elastic;
        energies[2] += audit.energy_error();
        scale += audit.scale() + body.elastic().energy_round_off(body.motion().positions());
    }
    energies[2] /= f64::max(scale, f64::MIN_POSITIVE);
    energies
}

pub(super) fn stats_of(session: &Session, surfels: usize) -> Stats {
    let world = session.world();
    let (strokes, undo) = session.strokes();
    let score = session.score();
    let [_, _, balance] = energies_of(world);
    Stats {
        step: world.steps(),
        settling: session.is_settling(),
        nodes: world.bodies().iter().map(|body| body.rest.len()).sum(),
        surfels,
        severed: session.severed_pairs(),
        strokes,
        undo,
        path: score.path,
        peak: score.peak,
        contact: (world.body_contact())
            .map(|(between, _)| 0.0 + between.iter().map(|sum| sum.normal).sum::<f64>()),
        balance,
        values: settings_of(session),
        replaying: session.is_replaying(),
        ..Stats::default()
    }
}

/// The camera and the size of a picture that a client asks for; `None` if there is no such camera.
pub(super) fn camera_of(asked: &Picture) -> Option<(Camera, [u32; 2])> {
    let [eye, target, up] = [asked.eye, asked.target, asked.up].map(DVec3::from_array);
    (target - eye).try_normalize()?.cross(up).try_normalize()?;
    let eye = Some(eye).filter(|eye| eye.is_finite())?;
    let angle = Some(asked.field_of_view).filter(|angle| (1.0..=120.0).contains(angle))?;
    let camera = Camera::looking_at(eye, target, up, angle.to_radians());
    Some((camera, [asked.width, asked.height]))
}
