//! Every key of a scene does something: each is changed alone in a small scene, and the run's results
//! are compared, bit for bit, with those of the scene without the change. What is written out although
//! it is the default changes nothing.

mod physics;
mod points;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Mutex;

use glam::DVec3;
use phyxel::World;
use phyxel_cli::run::{RunOptions, run};
use phyxel_scene::{Override, key_reference};

use crate::Files;

/// A fixed block that is pressed and cut, with pictures.
const SCENE: &str = include_str!("scene_keys/scene.ron");

/// Rows `keys | what both scenes have | what only the second has`; a line that begins with `=` is of a
/// change to what is the default, which must change nothing. `SHELF` stands for a folder of files.
const ROWS: &str = include_str!("scene_keys/rows.txt");

/// Keys that no result of a run depends on, and where they are tested.
const ELSEWHERE: &str = "\
Shape.Mesh.largest_hole, sim/app/tests/cli: an open mesh is refused with the value that closes it
Scene.version, sim/app/tests/cli: other versions are refused
Scene.description, for people
Sampling.limit, sim/app/tests/cli: more nodes are refused
Observe.checkpoint, tests/determinism.rs: runs resume from checkpoints";

/// Files of a run by name, but for what says how long it took or repeats the scene.
fn results(changes: &[&str], shelf: &Path) -> Result<Files, String> {
    let shelf_name = shelf.to_str().expect("a plain path");
    let changes = changes.iter().map(|change| change.trim());
    let changes = changes.filter(|change| !change.is_empty());
    let parsed = |change: &str| Override::parse(&change.replace("SHELF", shelf_name));
    let changes: Result<Vec<Override>, _> = changes.map(parsed).collect();
    let changes = changes.expect("they are overrides");
    let scene = phyxel_scene::from_text(SCENE, "test", shelf, &changes);
    let scene = scene.map_err(|error| error.to_string())?;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = RunOptions::quiet(folder.path(), 1);
    let summary = run(&scene, &options).map_err(|error| error.to_string())?;
    let repeated = ["scene.ron", "summary.json", "state.checkpoint"];
    Ok(crate::files(&summary, folder.path(), &repeated))
}

/// How far the lowest nodes of a column 0.08 m high lie below their positions at rest (m), in the mean.
fn sag(world: &World) -> f64 {
    let body = &world.bodies()[0];
    let low = body.rest.iter().zip(body.motion().positions());
    let (mut sum, mut count) = (0.0, 0.0);
    for (rest, now) in low.filter(|(rest, _)| rest.z < -0.0399) {
        sum += rest.z - now.z;
        count += 1.0;
    }
    sum / count
}

/// Files that scenes name: a lopsided closed mesh, points of the block's surface and two images.
fn fill(shelf: &Path) {
    let skin = points_on_box(DVec3::new(0.05, 0.04, 0.04), 5e-3);
    for (name, content) in [
        ("block.obj", include_str!("scene_keys/block.obj")),
        ("textured.obj", include_str!("scene_keys/textured.obj")),
        ("block.mtl", "newmtl skin\nmap_Kd one.png\n"),
        ("block.xyz", &skin),
    ] {
        std::fs::write(shelf.join(name), content).expect("it can be written");
    }
    let drawn = results(&[], shelf).expect("the scene runs");
    for (name, frame) in [
        ("one.png", "frames/frame-00000.png"),
        ("two.png", "frames/frame-00003.png"),
    ] {
        let image = drawn.get(frame);
        let image = image.unwrap_or_else(|| panic!("no {frame} in {:?}", drawn.keys()));
        std::fs::write(shelf.join(name), image).expect("it can be written");
    }
}

/// Points with normals about `apart` from each other on a box about the origin, one a line.
fn points_on_box(size: DVec3, apart: f64) -> String {
    let mut text = String::from("# x y z nx ny nz\n");
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let counts = [u, v].map(|side| (size[side] / apart).round().max(1.0));
        let mut a = 0.5;
        while a < counts[0] {
            let mut b = 0.5;
            while b < counts[1] {
                for sign in [-1.0, 1.0] {
                    let (mut x, mut normal) = (DVec3::ZERO, DVec3::ZERO);
                    x[axis] = 0.5 * sign * size[axis];
                    x[u] = (a / counts[0] - 0.5) * size[u];
                    x[v] = (b / counts[1] - 0.5) * size[v];
                    normal[axis] = sign;
                    let line = [x, normal].map(|v| format!("{} {} {}", v.x, v.y, v.z));
                    text += &(line.join(" ") + "\n");
                }
                b += 1.0;
            }
            a += 1.0;
        }
    }
    text
}

struct Row<'a> {
    keys: Vec<&'a str>,
    both: Vec<&'a str>,
    more: Vec<&'a str>,
    same: bool,
}

impl<'a> Row<'a> {
    fn all(&self) -> Vec<&'a str> {
        [&self.both[..], &self.more[..]].concat()
    }
}

fn rows() -> Vec<Row<'static>> {
    let lines = ROWS.lines().filter(|line| {
        let line = line.trim();
        !line.is_empty() && !line.starts_with('#')
    });
    lines
        .map(|line| {
            let (same, line) = line.strip_prefix('=').map_or((false, line), |l| (true, l));
            let parts: Vec<&str> = line.split('|').collect();
            let [keys, both, more] = parts[..] else {
                panic!("three parts in '{line}'");
            };
            Row {
                keys: keys.split_whitespace().collect(),
                both: both.split(';').collect(),
                more: more.split(';').collect(),
                same,
            }
        })
        .collect()
}

#[test]
fn each_key_has_an_effect_and_each_default_has_none() {
    let shelf = tempfile::tempdir().expect("a temporary folder");
    fill(shelf.path());
    let rows = rows();
    let asked = rows.iter().flat_map(|row| [row.both.clone(), row.all()]);
    let asked: BTreeSet<Vec<&str>> = asked.collect();
    // Threads that take the next: in a pool, a run that waits for its own tasks would begin others within itself.
    let (next, found) = (Mutex::new(asked.into_iter()), Mutex::new(BTreeMap::new()));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let take = || next.lock().expect("no run panics").next();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(changes) = take() {
                    let files = results(&changes, shelf.path());
                    found.lock().expect("no run panics").insert(changes, files);
                }
            });
        }
    });
    let found = found.into_inner().expect("no run panics");
    let mut wrong = Vec::new();
    for row in rows {
        let (without, with) = (&found[&row.both], &found[&row.all()]);
        let what = match (without, with) {
            (Ok(without), Ok(with)) if (without == with) == row.same => continue,
            (Err(error), _) => format!("without it: {error}"),
            (_, Err(error)) => error.clone(),
            _ if row.same => "changes the results".to_owned(),
            _ => "leaves the results as they are".to_owned(),
        };
        wrong.push(format!("{:?}: {:?}: {what}", row.keys, row.more));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_key_is_left_out() {
    let mut section = String::new();
    let mut choice = String::new();
    let mut all = BTreeSet::new();
    for line in key_reference().lines() {
        if let Some(title) = line.strip_prefix("## ") {
            title.clone_into(&mut section);
        }
        if let Some(title) = line.strip_prefix("### ") {
            section = title.split(' ').next().unwrap_or_default().to_owned();
        }
        // The tables of everyday keys and of limits name the sections' again.
        if section.starts_with("Keys") || section == "Limits" {
            continue;
        }
        let Some(rest) = line.strip_prefix("| ") else {
            continue;
        };
        let Some(name) = rest.split('`').nth(1) else {
            continue;
        };
        let name = name.trim_end_matches("(..)");
        if rest.starts_with('·') {
            all.insert(format!("{section}.{choice}.{name}"));
        } else if rest.starts_with('`') {
            choice = name.to_owned();
            all.insert(format!("{section}.{name}"));
        }
    }
    assert!(all.len() > 180, "{} keys are documented", all.len());
    let rows = rows();
    let tested = rows.iter().flat_map(|row| row.keys.iter().copied());
    let elsewhere = ELSEWHERE.lines().filter_map(|line| line.split(',').next());
    let tested: BTreeSet<String> = tested.chain(elsewhere).map(str::to_owned).collect();
    let missing: Vec<_> = all.difference(&tested).collect();
    let unknown: Vec<_> = tested.difference(&all).collect();
    assert!(missing.is_empty(), "without a row: {missing:?}");
    assert!(unknown.is_empty(), "of no key: {unknown:?}");
}
