//! A scene made ready for users.

use glam::DVec3;

use phyxel::WorldError;
use phyxel::scene::{Cut, Key, Observe, Pictures, Rest, Scene, Tool, ToolShape};
use phyxel_discretize::Bounds;

use super::session::SessionError;

/// Name of the blade that users drive.
pub(super) const BLADE: &str = "hand";
/// Name of the probe of a scene without tools that move.
const PROBE: &str = "probe";
/// Radius of that probe over the diagonal of the bodies: 10 mm for a liver.
const PROBE_SIZE: f64 = 0.045;
/// Where tools wait that no user drives (m): far from all bodies.
pub(super) const PARKED: DVec3 = DVec3::new(0.0, 0.0, 50.0);

/// Makes a scene ready for users: one blade replaces its cuts, a scene without tools that move
/// gets a probe, pictures are on so that there are surfels, and nothing moves by a path.
///
/// # Errors
/// [`SessionError`] if a mesh cannot be read or is no solid, or if the scene was not valid before.
pub(super) fn prepare(scene: &Scene) -> Result<Scene, SessionError> {
    let extent = extent(scene)?;
    let mut scene = scene.clone();
    let key = |time: f64| Key::new(time, PARKED);
    let edge = vec![DVec3::ZERO, DVec3::Z * 0.01];
    scene.cuts = vec![Cut {
        name: BLADE.to_owned(),
        weld_tolerance: scene.cuts.iter().find_map(|cut| cut.weld_tolerance),
        ..Cut::new(edge, vec![key(0.0), key(1.0)])
    }];
    // What stands, as a tray does, stays; users drive the first of the others.
    let stands = |tool: &Tool| tool.path.is_empty() && tool.release.is_none();
    scene.tools.sort_by_key(stands);
    let mut driven = scene.tools.iter().filter(|tool| !stands(tool)).count();
    if driven == 0 {
        let radius = PROBE_SIZE * extent;
        let mut probe = Tool::new(ToolShape::Sphere { radius }, Vec::new());
        PROBE.clone_into(&mut probe.name);
        probe.friction = 0.1;
        scene.tools.insert(0, probe);
        driven = 1;
    }
    for tool in &mut scene.tools[..driven] {
        tool.position = DVec3::ZERO;
        tool.path = vec![key(0.0)];
        tool.release = None;
    }
    // A session ends where its user ends it: no step is cut at the scene's end.
    scene.integration.duration = 0.0;
    if let Some(settle) = &mut scene.integration.settle {
        settle.rest = Rest::Motion;
    }
    scene.observe = Observe {
        state_rate: None,
        input: false,
        checkpoint: None,
        ..scene.observe
    };
    scene.pictures.get_or_insert_with(Pictures::default);
    // The same checks as for any other scene.
    let text = phyxel_scene::to_ron(&scene);
    Ok(phyxel_scene::from_text(&text, "live scene", "", &[])?)
}

/// Diagonal (m) of the box around all bodies at rest.
fn extent(scene: &Scene) -> Result<f64, WorldError> {
    let mut all = Bounds::EMPTY;
    for body in &scene.bodies {
        let solid = body.shape.solid(&body.placement());
        let (solid, _) = solid.map_err(|problem| WorldError::Body {
            body: body.name.clone(),
            problem: problem.into(),
        })?;
        let Bounds { min, max } = solid.bounds();
        all.include(min);
        all.include(max);
    }
    Ok(all.diagonal())
}
