//! Scenes as a whole: reading, writing, overriding, sampling of paths.

use glam::DVec3;
use phyxel_discretize::{Bounds, Solid};

use super::tree::{Content, Node};
use crate::*;

mod mistakes;
mod properties;

const LIVER: &str = EMBEDDED[0].text;

fn read(text: &str) -> Result<Scene, TextError> {
    from_text(text, "test.ron", "", &[])
}

fn with(text: &str, overrides: &[&str]) -> Result<Scene, TextError> {
    let overrides = overrides.iter().map(|text| Override::parse(text));
    let overrides = overrides.collect::<Result<Vec<_>, _>>();
    from_text(text, "test.ron", "", &overrides.expect("each is one"))
}

/// Every key path that ends at a leaf, with the leaf's text.
fn leaves(text: &str, node: &Node, path: &str, found: &mut Vec<(String, String)>) {
    match &node.inner().content {
        Content::Struct { fields, .. } => {
            for (key, _, value) in fields {
                let dot = if path.is_empty() { "" } else { "." };
                leaves(text, value, &format!("{path}{dot}{key}"), found);
            }
        }
        Content::Tuple { items, .. } | Content::List(items) if !items.is_empty() => {
            for (index, item) in items.iter().enumerate() {
                leaves(text, item, &format!("{path}[{index}]"), found);
            }
        }
        _ => found.push((path.to_owned(), text[node.span.clone()].to_owned())),
    }
}

#[test]
fn every_embedded_scene_is_valid_and_survives_writing() {
    for embedded in EMBEDDED {
        let scene = crate::embedded(embedded.name, &[]).expect("an embedded scene is valid");
        assert_eq!(scene.name, embedded.name);
        assert_eq!(scene.description, embedded.summary);
        let again = read(&to_ron(&scene)).expect("what is written can be read");
        assert_eq!(again, scene);
        assert_eq!(to_ron(&again), to_ron(&scene));
    }
}

#[test]
fn setting_any_value_to_itself_changes_nothing() {
    let scene = read(LIVER).expect("the scene is valid");
    let resolved = to_ron(&scene);
    let tree = Node::read(&resolved).expect("RON");
    let mut found = Vec::new();
    leaves(&resolved, &tree, "", &mut found);
    assert!(found.len() > 80, "only {} leaves", found.len());
    for (path, value) in found {
        let change = format!("{path}={value}");
        let in_resolved = with(&resolved, &[&change]);
        assert_eq!(in_resolved.expect("it stands there"), scene, "{change}");
        // In the short text most keys are left out.
        let in_short = with(LIVER, &[&change]);
        assert_eq!(in_short.expect("it has a default"), scene, "{change}");
    }
}

#[test]
fn overrides_apply_in_order_and_add_what_is_missing() {
    let scene = with(
        "(version: 1, bodies: [(shape: Box(size: (1, 2, 3)))])",
        &[
            "bodies[0].material.density=900",
            "bodies[0].material.density = 950",
            "bodies[0].shape.size[1]=0.5",
            "pictures.width=320",
            "pictures.view.zoom=2",
            "pictures.color=Stress(most: 2e3)",
            "pictures.view.elevation=10",
            "integration.settle=None",
            "integration.settle.limit=0.5",
            r#"name="a b""#,
        ],
    )
    .expect("each of them fits");
    assert_eq!(scene.name, "a b");
    let material = MaterialSettings {
        density: 950.0,
        ..MaterialSettings::default()
    };
    assert_eq!(scene.bodies[0].material, material);
    let size = DVec3::new(1.0, 0.5, 3.0);
    assert_eq!(scene.bodies[0].shape, Shape::Box { size });
    let pictures = scene.pictures.expect("pictures are on");
    assert_eq!((pictures.width, pictures.height), (320, 540));
    assert_eq!(pictures.color, Coloring::Stress { most: 2e3 });
    let view = View::Around {
        parallel: false,
        azimuth: 20.0,
        elevation: 10.0,
        zoom: 2.0,
    };
    assert_eq!(pictures.view, view);
    let settle = Settle {
        limit: 0.5,
        ..Settle::default()
    };
    assert_eq!(scene.integration.settle, Some(settle));
}

#[test]
fn the_shortest_scene_has_the_defaults() {
    let scene = read("(version: 1, bodies: [(shape: Liver(width: 0.166))])").expect("it is valid");
    let body = Body::new(Shape::Liver { width: 0.166 });
    assert_eq!(scene, Scene::new("scene", vec![body]));
}

#[cfg(feature = "schemars")]
#[test]
fn the_key_page_is_in_step_with_the_types() {
    let page = key_reference();
    if std::env::var_os("PHYXEL_BLESS").is_some() {
        std::fs::write("SCENES.md", &page).expect("the page can be written");
    }
    assert!(
        page == include_str!("../../SCENES.md"),
        "SCENES.md is old: run PHYXEL_BLESS=1 cargo test -p phyxel-scene --features schemars key_page"
    );
    // Every key that a scene is written with stands on the page.
    let resolved = to_ron(&read(LIVER).expect("the scene is valid"));
    for word in resolved.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')) {
        if let Some(key) = word.strip_suffix(':') {
            assert!(page.contains(&format!("`{key}`")), "{key}");
        }
    }
}

fn key(time: f64, position: [f64; 3], rotation: [f64; 3]) -> Key {
    Key {
        time,
        position: position.into(),
        rotation: rotation.into(),
    }
}

#[test]
fn a_path_rests_before_and_after_its_keys_and_is_even_between() {
    let path = [
        key(1.0, [0.0, 0.0, 1.0], [0.0; 3]),
        key(3.0, [2.0, 0.0, 1.0], [0.0, 0.0, 90.0]),
    ];
    let local = DVec3::X;
    assert_eq!(pose_at(&[], 5.0).apply(local), local);
    assert_eq!(pose_at(&path, 0.0).apply(local), DVec3::new(1.0, 0.0, 1.0));
    let end = pose_at(&path, 9.0).apply(local);
    assert!(end.distance(DVec3::new(2.0, 1.0, 1.0)) < 1e-15, "{end}");
    let middle = pose_at(&path, 2.0).apply(local);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let expected = DVec3::new(1.0 + half, half, 1.0);
    assert!(middle.distance(expected) < 1e-15, "{middle}");
    // Continuous at the keys.
    for key in &path {
        let [a, b] = [key.time - 1e-9, key.time].map(|time| pose_at(&path, time).apply(local));
        assert!(a.distance(b) < 1e-8, "{a} {b}");
    }
}

fn stroke(capture: Capture, path: Vec<Key>) -> Cut {
    Cut {
        capture,
        ..Cut::new(vec![DVec3::ZERO, DVec3::Y * 0.1], path)
    }
}

#[test]
fn captures_hold_the_keys_and_keep_to_rate_and_distance() {
    let path = vec![
        key(0.5, [0.0; 3], [0.0; 3]),
        key(1.0, [0.07, 0.0, 0.0], [0.0; 3]),
        key(1.25, [0.07, 0.0, 0.0], [0.0, 0.0, 60.0]),
    ];
    let cut = stroke(Capture::Rate(10.0), path.clone());
    let times = cut.capture_times(0.02);
    assert_eq!((cut.start(), cut.end()), (0.5, 1.25));
    assert_eq!(times.len(), 5 + 3 + 1);
    for key in &path {
        assert!(times.contains(&key.time), "{times:?}");
    }
    let distance = 0.01;
    let cut = stroke(Capture::Distance(distance), path.clone());
    let by_spacing = stroke(Capture::Spacing(0.5), path);
    assert_eq!(by_spacing.capture_times(0.02), cut.capture_times(0.02));
    let times = cut.capture_times(0.02);
    // 0.07 m straight; then the tip turns by 60 degrees on an arc of 0.1 m: 0.1047 m.
    assert_eq!(times.len(), 7 + 11 + 1);
    for pair in times.windows(2) {
        assert!(pair[0] < pair[1], "{pair:?}");
        let [from, to] = [0, 1].map(|k| cut.edge_at(pair[k]));
        let ways = from.iter().zip(&to).map(|(a, b)| a.distance(*b));
        let way = ways.fold(0.0, f64::max);
        assert!(way <= distance * (1.0 + 1e-8), "{way}");
    }
}

#[test]
fn the_default_scene_of_a_mesh_fits_its_box_as_it_stands() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, up) in [("cow #1.obj", Axis::Y), ("part.stl", Axis::Z)] {
        let file = folder.path().join(name);
        std::fs::write(&file, "").expect("it can be written");
        let extent = Bounds::new(DVec3::new(-1.0, 0.0, -2.0), DVec3::new(1.0, 3.0, 2.0));
        let solid = Solid::implicit(extent, |_| -1.0);
        let (scene, unit) = for_mesh(&file, &solid, &[]).expect("it is valid");
        assert_eq!(unit, phyxel_discretize::guess_unit(&extent));
        let expected = Shape::Mesh {
            file: file.clone(),
            scale: unit.scale(),
            up,
            largest_hole: 0.2,
        };
        assert_eq!(scene.bodies[0].shape, expected);
        let corners = [extent.min, extent.max].map(|p| up.rotation() * (p * unit.scale()));
        let (min, max) = (corners[0].min(corners[1]), corners[0].max(corners[1]));
        let region = scene.supports[0].region;
        let at = |x: f64, y: f64, z: f64| min + (max - min) * DVec3::new(x, y, z);
        let held = |x: f64, y: f64, z: f64| region.contains(at(x, y, z));
        assert!(held(0.5, 0.8, 0.5) && !held(0.5, 0.7, 0.5), "{name}");
        // The blade starts in front of the box, reaches above it and stays clear of the support.
        let cut = &scene.cuts[0];
        let [first, last] = [cut.start(), cut.end()].map(|time| cut.edge_at(time));
        assert!(first.iter().all(|p| p.y < min.y), "{name}");
        assert!(last[0].z < max.z && last[1].z > max.z, "{name}");
        assert!(last[0].z > min.z && last[0].y < max.y, "{name}");
        assert!(scene.pictures.is_some(), "{name}");
    }
}

/// The blade of the default scene goes where there is something to cut: to its usual position if it can.
#[test]
fn the_default_blade_meets_tissue() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("two.stl");
    std::fs::write(&file, "").expect("it can be written");
    let extent = Bounds::new(DVec3::ZERO, DVec3::new(0.1, 0.08, 0.06));
    let blade = |body: fn(DVec3) -> bool| {
        let solid = Solid::implicit(extent, move |p| if body(p) { -1.0 } else { 1.0 });
        let (scene, _) = for_mesh(&file, &solid, &[]).expect("it is valid");
        10.0 * scene.cuts[0].path[0].position.x
    };
    let close = |x: f64, share: f64| assert!((x - share).abs() < 1e-12, "{x}, not {share}");
    close(blade(|_| true), 0.4);
    // A gap where it usually cuts, and a thread across the gap.
    close(blade(|p| (p.x - 0.04).abs() > 0.005), 0.5);
    close(blade(|p| (p.x - 0.04).abs() > 0.005 || p.y < -0.005), 0.5);
    close(blade(|p| p.x > 0.075), 0.8);
    // Low in front, and nothing but what is held, where nowhere is better.
    close(blade(|p| p.x > 0.065 && p.z < 0.025), 0.7);
    close(blade(|p| p.y > 0.06 && p.z < 0.01), 0.4);
}

/// The schema knows the keys that the reader knows, and a scene in JSON is the scene in RON.
#[cfg(feature = "schemars")]
#[test]
fn a_scene_in_json_is_that_in_ron() {
    let scene = read(LIVER).expect("the scene is valid");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scene.JSON");
    let text = serde_json::to_string_pretty(&scene).expect("JSON says it");
    std::fs::write(&file, &text).expect("it is written");
    assert_eq!(load(&file, &[]).expect("it is read"), scene);
    let change = Override::parse("gravity.ramp=0.125").expect("an override");
    let changed = load(&file, &[change]).expect("it is changed");
    assert!((changed.gravity.expect("gravity").ramp - 0.125).abs() < f64::EPSILON);
    let schema = schema();
    let keys = schema["$defs"]["Body"]["properties"]
        .as_object()
        .expect("keys");
    let written = serde_json::to_value(&scene.bodies[0]).expect("a body");
    let written = written.as_object().expect("keys");
    assert!(written.keys().eq(keys.keys()), "{keys:?}");
}

#[test]
fn a_tissue_gives_what_is_not_given() {
    let read = |changes: &[&str]| {
        let changes = changes.iter().map(|text| Override::parse(text).unwrap());
        let scene = embedded("block", &changes.collect::<Vec<_>>()).unwrap();
        scene.bodies[0].material.clone()
    };
    let kidney = "bodies[0].material=(tissue: Kidney, poissons_ratio: 0.4)";
    let material = read(&[kidney]);
    let wanted = MaterialSettings {
        poissons_ratio: 0.4,
        ..MaterialSettings::of(Preset::Kidney)
    };
    assert_eq!(material, wanted);
    assert!((material.youngs_modulus, material.density) == (5000.0, 1050.0));
    let stiffer = read(&[kidney, "bodies[0].material.youngs_modulus=2e4"]);
    assert!((stiffer.youngs_modulus, stiffer.density) == (2e4, 1050.0));
    // Written with its values, it is read as the same.
    let mut scene = embedded("block", &[]).unwrap();
    scene.bodies[0].material = stiffer;
    let again = from_text(&to_ron(&scene), "test.ron", "", &[]);
    assert_eq!(again.unwrap().bodies, scene.bodies);
}
