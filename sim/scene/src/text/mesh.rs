//! The default scene of a mesh that comes without one.

use std::path::Path;

use glam::DVec3;
use phyxel_discretize::{Bounds, RepairSettings, Solid, UnitGuess, guess_unit};

use super::error::TextError;
use super::overrides::Override;
use super::read::{from_text, to_ron};
use crate::{Axis, Body, Cut, Gravity, Key, Pictures, Region, Scene, Shape, Support};

/// The default scene of a mesh: resting on what lies below and behind it, under gravity, cut from
/// the front down into its upper side where there is tissue, and drawn.
///
/// `solid` is the body as it lies in the file; OBJ and PLY files are taken to have +y up, as their tools do, all
/// others +z.
///
/// # Errors
/// [`TextError`] if an override does not fit, or the file cannot be read any more.
///
/// # Panics
/// If the box is empty or not finite; the caller has read the mesh.
pub fn for_mesh(
    file: impl AsRef<Path>,
    solid: &Solid,
    overrides: &[Override],
) -> Result<(Scene, UnitGuess), TextError> {
    let file = file.as_ref();
    let extent = solid.bounds();
    let size = extent.size();
    assert!(
        size.is_finite() && size.min_element() >= 0.0 && size.max_element() > 0.0,
        "the box of a mesh must have a size, not {size}"
    );
    let unit = guess_unit(&extent);
    // Supports and cuts follow a scale that someone asks for.
    let scale = Override::number(overrides, "bodies[0].shape.scale")
        .filter(|scale| scale.is_finite() && *scale > 0.0)
        .unwrap_or(unit.scale());
    let up = Axis::usually_up(file);
    let turned = |corner: DVec3| up.rotation() * (corner * scale);
    let (a, b) = (turned(extent.min), turned(extent.max));
    let to_file = up.rotation().inverse();
    let is_tissue = |place: DVec3| solid.contains(to_file * place / scale);
    let place = Bounds::new(a.min(b), a.max(b));
    let mut scene = standing(file, scale, up, place, &is_tissue);
    scene.name = file
        .file_stem()
        .map(|stem| stem.to_string_lossy().into_owned())
        .map(|stem| stem.replace(|c: char| !(c.is_alphanumeric() || "-_. ".contains(c)), "-"))
        .filter(|stem| stem.starts_with(|c: char| c.is_alphanumeric()))
        .unwrap_or_else(|| "mesh".to_owned());
    // A shorter scene has its stroke in the same fraction of the time.
    if let Some(duration) = Override::number(overrides, "integration.duration")
        && duration > 0.0
        && duration < scene.integration.duration
    {
        for key in scene.cuts.iter_mut().flat_map(|cut| &mut cut.path) {
            key.time *= duration / scene.integration.duration;
        }
    }
    let origin = format!("default scene of {}", file.display());
    let scene = from_text(&to_ron(&scene), &origin, "", overrides);
    // Nobody has seen the text that its positions count in.
    let scene = scene.map_err(TextError::without_position)?;
    Ok((scene, unit))
}

/// Shares of the box's width at which the blade may cut, the usual one first.
const PLACES: [f64; 9] = [0.4, 0.5, 0.3, 0.6, 0.2, 0.7, 0.1, 0.8, 0.9];
/// Shares of the box's height from which on the blade cuts and of its depth as far as which, the usual ones first.
const REACHES: [[f64; 2]; 4] = [[0.45, 0.6], [0.45, 1.0], [0.15, 0.6], [0.15, 1.0]];
/// The blade goes farther than usual if it would meet tissue in less than one in so many points of what it sweeps.
const RARELY: usize = 30;
/// The usual position is taken unless the blade would meet more than so many times as much elsewhere.
const ENOUGH: usize = 4;
/// Points that are looked at along either side of what the blade sweeps.
const LOOKS: u32 = 24;
/// Fraction of the box's depth at which the blade starts.
const FRONT: f64 = -0.1;

/// Where the blade meets enough of what is free to be cut: share of the width, of the height from which on, of the depth
/// as far as which.
fn place_of_blade(
    at: &dyn Fn(f64, f64, f64) -> DVec3,
    is_free: &dyn Fn(DVec3) -> bool,
) -> [f64; 3] {
    let share = |k: u32| (f64::from(k) + 0.5) / f64::from(LOOKS);
    let best = REACHES.map(|[foot, back]| {
        let met = PLACES.map(|x| {
            let column = |j: u32| {
                let y = FRONT + (back - FRONT) * share(j);
                let free = |k: &u32| is_free(at(x, y, foot + (1.0 - foot) * share(*k)));
                (0..LOOKS).filter(free).count()
            };
            (0..LOOKS).map(column).sum::<usize>()
        });
        let most = met.into_iter().max().unwrap_or(0);
        let first = met.into_iter().position(|met| ENOUGH * met >= most);
        (most, [PLACES[first.unwrap_or(0)], foot, back])
    });
    let all = (LOOKS * LOOKS) as usize;
    let enough = best.iter().find(|(met, _)| RARELY * met >= all);
    enough.unwrap_or(&best[0]).1
}

/// Least Young's modulus over the stress of a column as high as the body is long: softer ones sag into strings.
const UPRIGHT: f64 = 3.0;

/// The scene for a mesh that fills a box (m, z up).
fn standing(
    file: &Path,
    scale: f64,
    up: Axis,
    place: Bounds,
    is_tissue: &dyn Fn(DVec3) -> bool,
) -> Scene {
    let size = place.size();
    let at = |x: f64, y: f64, z: f64| place.min + size * DVec3::new(x, y, z);
    let mut body = Body::new(Shape::Mesh {
        file: file.to_owned(),
        scale,
        up,
        largest_hole: RepairSettings::default().largest_hole,
    });
    body.name = "organ".to_owned();
    let material = &mut body.material;
    let weight = material.density * Gravity::default().acceleration.length() * size.max_element();
    material.youngs_modulus = material.youngs_modulus.max(UPRIGHT * weight);
    let mut scene = Scene::new("mesh", vec![body]);
    scene.description =
        "default scene of a mesh: held from below and behind, cut from the front".to_owned();
    let held = Region::HalfSpace {
        // Below the line from the middle of the front's foot to the top of the back.
        point: at(0.5, 0.65, 0.45),
        normal: DVec3::new(0.0, size.z, -size.y).normalize_or(DVec3::Y),
    };
    let is_free = |place: DVec3| !held.contains(place) && is_tissue(place);
    let [x, foot, back] = place_of_blade(&at, &is_free);
    scene.supports.push(Support::fixed(held));
    // An upright edge, usually from the middle of the height to above the top, drawn towards the back.
    let path = [(0.1, FRONT), (1.6, back)].map(|(time, y)| Key::new(time, at(x, y, foot)));
    scene.cuts.push(Cut {
        name: "incision".to_owned(),
        ..Cut::new(vec![DVec3::ZERO, DVec3::Z * size.z], path.to_vec())
    });
    scene.integration.duration = 2.5;
    scene.pictures = Some(Pictures::default());
    scene
}
