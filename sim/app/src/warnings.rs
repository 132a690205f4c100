//! What of a scene has no effect, or is of another size than its bodies.

use glam::DVec3;
use phyxel_discretize::Bounds;

use phyxel::World;
use phyxel::scene::{Body, Key, Support, Tool, pose_at};

/// Lengths beyond this many times the bodies' are reported: the next unit is a thousand times larger.
const FAR: f64 = 30.0;
/// Deviation of the nodes' volume from the body's that is reported.
const LARGEST_VOLUME_ERROR: f64 = 0.05;
/// Places looked at between two keys of a path.
const PLACES: u32 = 16;

/// What a scene asks for without effect: supports that hold no node, places of a mesh too thin for its
/// nodes, lengths far beyond the bodies; one sentence each.
pub(crate) fn warnings(world: &World) -> Vec<String> {
    let mut warnings = Vec::new();
    for body in world.bodies() {
        let name = &body.name;
        if body.missed > 0.0 {
            warnings.push(format!(
                "body '{name}': {:.1} % of the mesh's vertices lie where it is thinner than its \
                 nodes are apart ({:.2e} m); those places are cut off, ask for more nodes",
                1e2 * body.missed,
                body.spacing
            ));
        }
        if let Some(error) = body.volume_error
            && error.abs() > LARGEST_VOLUME_ERROR
        {
            warnings.push(format!(
                "body '{name}': its tetrahedra have a volume {:+.1} % off the body's; ask for \
                 more nodes, or look whether its mesh crosses itself",
                1e2 * error
            ));
        }
    }
    warn_of_regions(world, &mut warnings);
    let bodies = bounds(world);
    for (index, spec) in world.scene().supports.iter().enumerate() {
        let pairs = world.bodies().iter().zip(&world.scene().bodies);
        let held: usize = pairs
            .map(|(body, description)| held(spec, description, &body.rest).len())
            .sum();
        if held == 0 {
            let lie = place(&bodies);
            warnings.push(format!("supports[{index}] holds no node: the bodies {lie}"));
        }
    }
    warn_of_lengths(world, &bodies, &mut warnings);
    warnings
}

/// Inclusions without a node, and nodes that two supports move in two ways.
fn warn_of_regions(world: &World, warnings: &mut Vec<String>) {
    for (body, spec) in world.bodies().iter().zip(&world.scene().bodies) {
        let name = &body.name;
        for (index, inclusion) in spec.inclusions.iter().enumerate() {
            if inclusion.region.nodes(&body.rest).is_empty() {
                warnings.push(format!(
                    "body '{name}': inclusions[{index}] has no node; make its region larger or ask for more nodes"
                ));
            }
        }
        let supports = &world.scene().supports;
        for (index, support) in supports.iter().enumerate() {
            let other = held(support, spec, &body.rest)
                .into_iter()
                .find_map(|node| {
                    let x = body.rest[node as usize];
                    let holds = |of: &Support| of.acts_on(&spec.name) && of.region.contains(x);
                    let last = supports.iter().rposition(holds)?;
                    (supports[last].motion != support.motion).then_some(last)
                });
            if let Some(last) = other {
                warnings.push(format!(
                    "body '{name}': supports[{index}] and supports[{last}] have nodes in common and move \
                     otherwise; those nodes follow the later one"
                ));
            }
        }
    }
}

/// Cuts and tools whose paths stay away from the bodies, as these lie at rest.
pub(crate) fn misses(world: &World) -> Vec<String> {
    let bodies = bounds(world);
    let margin = DVec3::splat(0.5 * bodies.diagonal());
    let (low, high) = (bodies.min - margin, bodies.max + margin);
    let near = |points: Vec<DVec3>| {
        let swept = Bounds::of(points);
        swept.min.cmple(high).all() && swept.max.cmpge(low).all()
    };
    let mut warnings = Vec::new();
    let mut check = |what: String, path: &[Key], moved: DVec3, points: &[DVec3]| {
        if !sweeps(path, moved, points).any(near) {
            let lie = place(&bodies);
            warnings.push(format!("{what} stays away from the bodies, which {lie}"));
        }
    };
    for (index, cut) in world.scene().cuts.iter().enumerate() {
        let what = format!("cuts[{index}] '{}'", cut.name);
        check(what, &cut.path, DVec3::ZERO, &cut.edge);
    }
    for (index, tool) in world.scene().tools.iter().enumerate() {
        if let Some(corners) = corners(tool).filter(|_| tool.release.is_none()) {
            let what = format!("tools[{index}] '{}'", tool.name);
            check(what, &tool.path, tool.position, &corners);
        }
    }
    warnings
}

/// Cuts that a finished run took up and that changed nothing.
pub(crate) fn vain_cuts(world: &World) -> Vec<String> {
    let cuttings = world.bodies().iter().flat_map(|body| &body.cutting);
    let strokes = || (cuttings.clone()).flat_map(|cutting| &cutting.by_stroke);
    let changed = |cut: usize| strokes().any(|of| of.cut == cut && of.updates > 0);
    let cuts = world.scene().cuts.iter().enumerate();
    cuts.filter(|(index, _)| !changed(*index))
        .map(|(index, cut)| format!("cuts[{index}] '{}' cut nothing", cut.name))
        .collect()
}

/// Box around all bodies at rest.
fn bounds(world: &World) -> Bounds {
    let bodies = world.bodies().iter();
    Bounds::of(bodies.flat_map(|body| body.rest.iter().copied()))
}

fn warn_of_lengths(world: &World, bodies: &Bounds, warnings: &mut Vec<String>) {
    let size = bodies.diagonal();
    let mut check = |what: String, length: f64| {
        if length > FAR * size {
            warnings.push(format!(
                "{what} is {length:.3e} m, and the bodies are {size:.3e} m from corner to corner: \
                     lengths are in metres"
            ));
        }
    };
    for (index, cut) in world.scene().cuts.iter().enumerate() {
        let edge = Bounds::of(cut.edge.iter().copied()).diagonal();
        check(format!("the edge of cuts[{index}]"), edge);
        check(format!("the way of cuts[{index}]"), way(&cut.path));
    }
    for (index, tool) in world.scene().tools.iter().enumerate() {
        let size = corners(tool).map_or(0.0, |corners| Bounds::of(corners).diagonal());
        check(format!("the size of tools[{index}]"), size);
        check(format!("the way of tools[{index}]"), way(&tool.path));
    }
}

/// Nodes of a body that a support holds or drives.
fn held(support: &Support, body: &Body, rest: &[DVec3]) -> Vec<u32> {
    match support.acts_on(&body.name) {
        true => support.region.nodes(rest),
        false => Vec::new(),
    }
}

/// Where a box lies, in words.
fn place(bounds: &Bounds) -> String {
    let [low, high] =
        [bounds.min, bounds.max].map(|p| format!("({:.3e}, {:.3e}, {:.3e})", p.x, p.y, p.z));
    format!("lie from {low} to {high}")
}

/// Diagonal of the box around a path's keys.
fn way(path: &[Key]) -> f64 {
    if path.is_empty() {
        return 0.0;
    }
    Bounds::of(path.iter().map(|key| key.position)).diagonal()
}

/// Where some points of a thing are at two positions of its path, moved as a whole, that follow each other.
fn sweeps<'a>(
    path: &'a [Key],
    moved: DVec3,
    points: &'a [DVec3],
) -> impl Iterator<Item = Vec<DVec3>> + 'a {
    let times = path.windows(2).flat_map(|pair| {
        let (from, to) = (pair[0].time, pair[1].time);
        let at = move |k: u32| from + (to - from) * f64::from(k) / f64::from(PLACES);
        (0..PLACES).map(move |k| (at(k), at(k + 1)))
    });
    let still = path.first().map_or(0.0, |key| key.time);
    times.chain([(still, still)]).map(move |(from, to)| {
        let poses = [pose_at(path, from), pose_at(path, to)];
        let places = poses
            .iter()
            .flat_map(|pose| points.iter().map(|p| pose.apply(*p) + moved));
        places.collect()
    })
}

/// Corners of a box around a tool, in its frame; `None` for a plane, which has no end.
fn corners(tool: &Tool) -> Option<[DVec3; 8]> {
    let [min, max] = tool.solid().bounds()?;
    Some(Bounds { min, max }.corners())
}
