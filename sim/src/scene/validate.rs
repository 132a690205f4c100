//! What a scene's values must be: checked once, so that nothing later meets a surprise.

use std::fmt::Display;
use std::path::Path;

use glam::DVec3;

use super::body::{Body, Material, Sampling, Shape, SurfelTarget, Surfels, Target};
use super::event::{Capture, Cut, Motion, Region, Support, Tool, ToolShape};
use super::path::Key;
use super::settings::{Integration, Pictures, View};
use super::suggest::nearest;
use super::{Scene, VERSION};

/// The first value that is not as it must be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Fault {
    pub(super) path: String,
    pub(super) found: String,
    pub(super) must: String,
}

type Check = Result<(), Fault>;

fn fault(path: impl Display, found: impl Display, must: impl Display) -> Fault {
    Fault {
        path: path.to_string(),
        found: found.to_string(),
        must: must.to_string(),
    }
}

fn require(holds: bool, path: impl Display, found: impl Display, must: impl Display) -> Check {
    if holds {
        Ok(())
    } else {
        Err(fault(path, found, must))
    }
}

/// A point or direction as a scene writes it.
fn triple(value: DVec3) -> String {
    format!("({}, {}, {})", value.x, value.y, value.z)
}

/// A finite number above zero.
fn positive(path: impl Display, value: f64, hint: &str) -> Check {
    require(
        value.is_finite() && value > 0.0,
        path,
        value,
        format_args!("it must be finite and above 0{hint}"),
    )
}

/// A finite number of zero or more.
fn not_negative(path: impl Display, value: f64, hint: &str) -> Check {
    require(
        value.is_finite() && value >= 0.0,
        path,
        value,
        format_args!("it must be finite and not below 0{hint}"),
    )
}

fn finite(path: impl Display, value: DVec3) -> Check {
    require(
        value.is_finite(),
        path,
        triple(value),
        "each of its three numbers must be finite",
    )
}

fn direction(path: impl Display, value: DVec3) -> Check {
    let length = value.length();
    require(
        length.is_finite() && length > 0.0,
        path,
        triple(value),
        "it must be finite and longer than 0",
    )
}

/// Checks every value of a scene.
pub(super) fn validate(scene: &Scene) -> Check {
    require(
        scene.version == VERSION,
        "version",
        scene.version,
        format_args!("this program reads version {VERSION}"),
    )?;
    require(
        is_file_name(&scene.name),
        "name",
        format_args!("'{}'", scene.name),
        "it names the output folder: use letters, digits, '-', '_', '.' or spaces, and begin with \
         a letter or digit",
    )?;
    require(
        !scene.bodies.is_empty(),
        "bodies",
        "empty",
        "a scene needs one body at least, such as (shape: Liver(width: 0.166))",
    )?;
    for (index, item) in scene.bodies.iter().enumerate() {
        body(&format!("bodies[{index}]"), item)?;
    }
    unique("bodies", scene.bodies.iter().map(|body| body.name.as_str()))?;
    for (index, item) in scene.supports.iter().enumerate() {
        support(&format!("supports[{index}]"), item, &scene.bodies)?;
    }
    if let Some(gravity) = &scene.gravity {
        finite("gravity.acceleration", gravity.acceleration)?;
        not_negative("gravity.ramp", gravity.ramp, " (s)")?;
    }
    // A scene must not be run as if it had no tools.
    require(
        scene.tools.is_empty(),
        "tools",
        format_args!("{} tools", scene.tools.len()),
        "contact with tools is not simulated yet; remove them",
    )?;
    for (index, item) in scene.tools.iter().enumerate() {
        tool(&format!("tools[{index}]"), item)?;
    }
    unique("tools", scene.tools.iter().map(|tool| tool.name.as_str()))?;
    for (index, item) in scene.cuts.iter().enumerate() {
        cut(&format!("cuts[{index}]"), item, scene)?;
    }
    unique("cuts", scene.cuts.iter().map(|cut| cut.name.as_str()))?;
    integration(&scene.integration)?;
    let rate = scene.observe.history_rate;
    positive("observe.history_rate", rate, " (1/s)")?;
    limited("observe.history_rate", rate, MOST_ROWS, scene, "rows")?;
    if let Some(period) = scene.observe.checkpoint {
        positive("observe.checkpoint", period, " (s)")?;
    }
    if let Some(settings) = &scene.pictures {
        pictures(settings)?;
        limited("pictures.rate", settings.rate, MOST_FRAMES, scene, "frames")?;
    }
    Ok(())
}

/// Most rows of `history.csv`.
const MOST_ROWS: f64 = 1e7;
/// Most frames of a run.
const MOST_FRAMES: f64 = 1e5;
/// Most captures of one stroke.
const MOST_CAPTURES: f64 = 1e5;
/// Most pixels of a frame (64 megapixels).
const MOST_PIXELS: u64 = 1 << 26;

fn limited(path: &str, rate: f64, most: f64, scene: &Scene, what: &str) -> Check {
    let count = rate * (scene.integration.duration);
    require(
        count <= most,
        path,
        rate,
        format_args!(
            "over {} s it makes {count:.2e} {what} and the limit is {most:.0e}",
            scene.integration.duration
        ),
    )
}

fn is_file_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_alphanumeric())
        && name.len() <= 100
        && name
            .chars()
            .all(|c| c.is_alphanumeric() || "-_. ".contains(c))
}

fn unique<'a>(path: &str, names: impl Iterator<Item = &'a str>) -> Check {
    let names: Vec<&str> = names.collect();
    for (index, name) in names.iter().enumerate() {
        require(
            !names[..index].contains(name),
            format_args!("{path}[{index}].name"),
            format_args!("'{name}'"),
            "an earlier one has this name already; give each its own",
        )?;
    }
    Ok(())
}

fn body(path: &str, body: &Body) -> Check {
    shape(&format!("{path}.shape"), &body.shape)?;
    finite(format_args!("{path}.position"), body.position)?;
    sampling(&format!("{path}.sampling"), &body.sampling, &body.shape)?;
    material(&format!("{path}.material"), &body.material)?;
    require(
        (0.0..=1.0).contains(&body.damping_ratio),
        format_args!("{path}.damping_ratio"),
        body.damping_ratio,
        "it must lie between 0 (none) and 1 (critical damping of the stiffest mode)",
    )?;
    not_negative(format_args!("{path}.damping"), body.damping, " (1/s)")?;
    surfels(&format!("{path}.surfels"), &body.surfels)
}

fn shape(path: &str, shape: &Shape) -> Check {
    match shape {
        Shape::Liver { width } => positive(
            format_args!("{path}.width"),
            *width,
            " (m), such as 0.166 for 1.2 litres",
        ),
        Shape::Box { size } => positive_components(&format!("{path}.size"), *size),
        Shape::Ellipsoid { radii } => positive_components(&format!("{path}.radii"), *radii),
        Shape::Capsule { from, to, radius } => {
            finite(format_args!("{path}.from"), *from)?;
            finite(format_args!("{path}.to"), *to)?;
            positive(format_args!("{path}.radius"), *radius, " (m)")
        }
        Shape::Tube {
            from,
            to,
            inner_radius,
            outer_radius,
        } => {
            finite(format_args!("{path}.from"), *from)?;
            finite(format_args!("{path}.to"), *to)?;
            require(
                from != to,
                format_args!("{path}.to"),
                triple(*to),
                "it must differ from 'from', the other end of the axis",
            )?;
            positive(format_args!("{path}.inner_radius"), *inner_radius, " (m)")?;
            require(
                outer_radius.is_finite() && outer_radius > inner_radius,
                format_args!("{path}.outer_radius"),
                outer_radius,
                format_args!("it must be above the inner radius, {inner_radius} m"),
            )
        }
        Shape::Mesh { file, scale, .. } => {
            mesh_file(&format!("{path}.file"), file)?;
            positive(
                format_args!("{path}.scale"),
                *scale,
                " (metres per unit of the file), such as 0.001 for millimetres",
            )
        }
    }
}

fn positive_components(path: &str, value: DVec3) -> Check {
    for (index, component) in value.to_array().into_iter().enumerate() {
        positive(format_args!("{path}[{index}]"), component, " (m)")?;
    }
    Ok(())
}

fn mesh_file(path: &str, file: &Path) -> Check {
    let found = format!("'{}'", file.display());
    require(
        file.to_str().is_some(),
        path,
        &found,
        "a path in a scene must be UTF-8; rename the file or its folder",
    )?;
    match std::fs::metadata(file) {
        Ok(metadata) => require(
            metadata.is_file(),
            path,
            found,
            "it must name a mesh file, and this is a folder",
        ),
        Err(error) => Err(fault(
            path,
            found,
            format_args!(
                "the file cannot be read ({error}); relative paths start at the scene's folder"
            ),
        )),
    }
}

fn sampling(path: &str, sampling: &Sampling, shape: &Shape) -> Check {
    const FEWEST_NODES: u32 = 4;
    let limit = sampling.limit;
    require(
        limit >= FEWEST_NODES,
        format_args!("{path}.limit"),
        limit,
        format_args!("a body needs {FEWEST_NODES} nodes at least"),
    )?;
    let target = format!("{path}.target");
    match sampling.target {
        Target::Nodes(count) => require(
            (FEWEST_NODES..=limit).contains(&count),
            target,
            format_args!("Nodes({count})"),
            format_args!("it must be from {FEWEST_NODES} to the limit, {limit} nodes"),
        ),
        Target::Spacing(spacing) => {
            require(
                spacing.is_finite() && spacing > 0.0,
                &target,
                format_args!("Spacing({spacing:?})"),
                "it must be above 0 (m), such as 0.006 for an organ",
            )?;
            let Some(volume) = shape.rough_volume() else {
                return Ok(());
            };
            let nodes = volume / (spacing * spacing * spacing);
            let wider = 1.05 * (volume / f64::from(limit)).cbrt();
            require(
                nodes <= f64::from(limit),
                &target,
                format_args!("Spacing({spacing:?})"),
                format_args!(
                    "it would make about {nodes:.2e} nodes and {path}.limit is {limit}; use \
                     {wider:.2e} m or more, or raise the limit"
                ),
            )
        }
    }
}

fn material(path: &str, material: &Material) -> Check {
    positive(
        format_args!("{path}.youngs_modulus"),
        material.youngs_modulus,
        " (Pa), such as 5e3 for liver",
    )?;
    require(
        material.poissons_ratio > -1.0 && material.poissons_ratio < 0.5,
        format_args!("{path}.poissons_ratio"),
        material.poissons_ratio,
        "it must be above -1 and below 0.5, such as 0.45 for soft tissue",
    )?;
    positive(
        format_args!("{path}.density"),
        material.density,
        " (kg/m^3), such as 1060 for soft tissue",
    )?;
    not_negative(
        format_args!("{path}.stabilization"),
        material.stabilization,
        ", 0.1 is the measured choice",
    )
}

fn surfels(path: &str, surfels: &Surfels) -> Check {
    const MOST_SURFELS: u32 = 10_000_000;
    let target = format!("{path}.target");
    match surfels.target {
        SurfelTarget::Count(count) => require(
            (1..=MOST_SURFELS).contains(&count),
            target,
            format_args!("Count({count})"),
            format_args!("it must be from 1 to {MOST_SURFELS}"),
        )?,
        SurfelTarget::Density(density) => require(
            density.is_finite() && density > 0.0,
            target,
            format_args!("Density({density:?})"),
            "it must be above 0 (1/m^2), such as 3e5",
        )?,
    }
    if let Some(density) = surfels.cut_density {
        positive(format_args!("{path}.cut_density"), density, " (1/m^2)")?;
    }
    for (name, color) in [("color", surfels.color), ("cut_color", surfels.cut_color)] {
        for (index, value) in color.into_iter().enumerate() {
            require(
                (0.0..=1.0).contains(&value),
                format_args!("{path}.{name}[{index}]"),
                value,
                "colours are three numbers from 0 to 1",
            )?;
        }
    }
    Ok(())
}

fn body_name(path: &str, name: Option<&str>, bodies: &[Body]) -> Check {
    let Some(name) = name else { return Ok(()) };
    let names: Vec<&str> = bodies.iter().map(|body| body.name.as_str()).collect();
    let hint = nearest(name, names.iter().copied())
        .map_or_else(String::new, |name| format!(" (did you mean '{name}'?)"));
    require(
        names.contains(&name),
        path,
        format_args!("'{name}'"),
        format_args!(
            "no body has this name{hint}; bodies are {}",
            names.join(", ")
        ),
    )
}

fn support(path: &str, support: &Support, bodies: &[Body]) -> Check {
    body_name(&format!("{path}.body"), support.body.as_deref(), bodies)?;
    match support.region {
        Region::HalfSpace { point, normal } => {
            finite(format_args!("{path}.region.point"), point)?;
            direction(format_args!("{path}.region.normal"), normal)?;
        }
        Region::Box { min, max } => {
            finite(format_args!("{path}.region.min"), min)?;
            finite(format_args!("{path}.region.max"), max)?;
            require(
                min.cmple(max).all(),
                format_args!("{path}.region.max"),
                triple(max),
                format_args!(
                    "each of its numbers must be at least that of min, {}",
                    triple(min)
                ),
            )?;
        }
        Region::Sphere { center, radius } => {
            finite(format_args!("{path}.region.center"), center)?;
            positive(format_args!("{path}.region.radius"), radius, " (m)")?;
        }
    }
    match &support.motion {
        Motion::Fixed => Ok(()),
        Motion::Driven { path: keys } => keys_in_order(&format!("{path}.motion.path"), keys, 1),
    }
}

fn tool(path: &str, tool: &Tool) -> Check {
    match tool.shape {
        ToolShape::Sphere { radius } => {
            positive(format_args!("{path}.shape.radius"), radius, " (m)")?;
        }
        ToolShape::Plane { normal } => direction(format_args!("{path}.shape.normal"), normal)?,
        ToolShape::Capsule { from, to, radius } => {
            finite(format_args!("{path}.shape.from"), from)?;
            finite(format_args!("{path}.shape.to"), to)?;
            positive(format_args!("{path}.shape.radius"), radius, " (m)")?;
        }
    }
    keys_in_order(&format!("{path}.path"), &tool.path, 1)
}

fn keys_in_order(path: &str, keys: &[Key], fewest: usize) -> Check {
    require(
        keys.len() >= fewest,
        path,
        format_args!("{} keys", keys.len()),
        format_args!("it needs {fewest} at least, such as (time: 0, position: (0, 0, 0))"),
    )?;
    for (index, key) in keys.iter().enumerate() {
        not_negative(
            format_args!("{path}[{index}].time"),
            key.time,
            " (s after settling)",
        )?;
        finite(format_args!("{path}[{index}].position"), key.position)?;
        finite(format_args!("{path}[{index}].rotation"), key.rotation)?;
    }
    for (index, pair) in keys.windows(2).enumerate() {
        require(
            pair[0].time < pair[1].time,
            format_args!("{path}[{}].time", index + 1),
            pair[1].time,
            format_args!(
                "it must be later than the key before, at {} s",
                pair[0].time
            ),
        )?;
    }
    Ok(())
}

fn cut(path: &str, cut: &Cut, scene: &Scene) -> Check {
    body_name(&format!("{path}.body"), cut.body.as_deref(), &scene.bodies)?;
    let edge = format!("{path}.edge");
    require(
        cut.edge.len() >= 2,
        &edge,
        format_args!("{} points", cut.edge.len()),
        "a blade's edge needs two points at least",
    )?;
    for (index, &point) in cut.edge.iter().enumerate() {
        finite(format_args!("{edge}[{index}]"), point)?;
    }
    for (index, pair) in cut.edge.windows(2).enumerate() {
        require(
            pair[0] != pair[1],
            format_args!("{edge}[{}]", index + 1),
            triple(pair[1]),
            "it equals the point before it",
        )?;
    }
    keys_in_order(&format!("{path}.path"), &cut.path, 2)?;
    let duration = scene.integration.duration;
    let last = cut.path.len() - 1;
    require(
        cut.path[last].time <= duration,
        format_args!("{path}.path[{last}].time"),
        cut.path[last].time,
        format_args!("the scene ends at integration.duration, {duration} s"),
    )?;
    let capture = format!("{path}.capture");
    match cut.capture {
        Capture::Rate(rate) => {
            require(
                rate.is_finite() && rate > 0.0,
                &capture,
                format_args!("Rate({rate:?})"),
                "it must be above 0 (1/s), such as 60",
            )?;
            let count = rate * (cut.path[last].time - cut.path[0].time);
            require(
                count <= MOST_CAPTURES,
                &capture,
                format_args!("Rate({rate:?})"),
                format_args!("it makes {count:.2e} captures; the limit is {MOST_CAPTURES:.0e}"),
            )?;
        }
        Capture::Distance(distance) => {
            require(
                distance.is_finite() && distance > 0.0,
                &capture,
                format_args!("Distance({distance:?})"),
                "it must be above 0 (m), such as 0.002",
            )?;
            let count = cut.way() / distance;
            require(
                count <= MOST_CAPTURES,
                &capture,
                format_args!("Distance({distance:?})"),
                format_args!("it makes {count:.2e} captures; the limit is {MOST_CAPTURES:.0e}"),
            )?;
        }
    }
    if let Some(tolerance) = cut.weld_tolerance {
        not_negative(format_args!("{path}.weld_tolerance"), tolerance, " (m)")?;
    }
    Ok(())
}

fn integration(settings: &Integration) -> Check {
    not_negative(
        "integration.duration",
        settings.duration,
        " (s after settling)",
    )?;
    require(
        settings.step_factor > 0.0 && settings.step_factor <= 1.0,
        "integration.step_factor",
        settings.step_factor,
        "it must be above 0 and at most 1, the largest stable step",
    )?;
    if let Some(settle) = settings.settle {
        positive("integration.settle.speed", settle.speed, " (m/s)")?;
        positive("integration.settle.limit", settle.limit, " (s)")?;
        not_negative("integration.settle.damping", settle.damping, " (1/s)")?;
    }
    Ok(())
}

fn pictures(pictures: &Pictures) -> Check {
    for (name, size) in [("width", pictures.width), ("height", pictures.height)] {
        require(
            size >= 16,
            format_args!("pictures.{name}"),
            size,
            "it must be 16 pixels or more",
        )?;
    }
    let pixels = u64::from(pictures.width) * u64::from(pictures.height);
    require(
        pixels <= MOST_PIXELS,
        "pictures.width",
        pictures.width,
        format_args!("with the height it makes {pixels} pixels; the limit is {MOST_PIXELS}"),
    )?;
    positive("pictures.rate", pictures.rate, " (frames per second)")?;
    match pictures.view {
        View::Around {
            azimuth,
            elevation,
            zoom,
        } => {
            require(
                azimuth.is_finite(),
                "pictures.view.azimuth",
                azimuth,
                "it must be finite (degrees)",
            )?;
            require(
                (-90.0..=90.0).contains(&elevation),
                "pictures.view.elevation",
                elevation,
                "it must be from -90 (below) to 90 (above)",
            )?;
            positive("pictures.view.zoom", zoom, ", 1 fits the bodies")
        }
        View::Explicit {
            eye,
            target,
            field_of_view,
        } => {
            finite("pictures.view.eye", eye)?;
            finite("pictures.view.target", target)?;
            require(
                eye != target,
                "pictures.view.target",
                triple(target),
                "it must differ from the eye",
            )?;
            require(
                field_of_view > 0.0 && field_of_view < 180.0,
                "pictures.view.field_of_view",
                field_of_view,
                "it must be above 0 and below 180 (degrees)",
            )
        }
    }
}
