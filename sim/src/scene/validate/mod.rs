//! What a scene's values must be: checked once, so that nothing later meets a surprise.

mod body;
mod check;
mod event;
mod material;
mod method;

pub(super) use check::Fault;

use super::settings::{Coloring, Integration, Pictures, Rest, Scheme, Show, View};
use super::{Scene, VERSION};
use body::body;
use check::{Check, color, finite, not_negative, positive, require, triple};
use event::{cut, support, tool};

/// Checks every value of a scene: the first fault of each of its parts, in the order of the file.
pub(super) fn validate(scene: &Scene) -> Vec<Fault> {
    let mut checks = vec![whole(scene)];
    for (index, item) in scene.bodies.iter().enumerate() {
        checks.push(body(&format!("bodies[{index}]"), item));
    }
    let names = scene.bodies.iter().map(|body| body.name.as_str());
    checks.push(unique("bodies", names));
    for (index, item) in scene.supports.iter().enumerate() {
        checks.push(support(&format!("supports[{index}]"), item, &scene.bodies));
    }
    if let Some(gravity) = &scene.gravity {
        checks.push(finite("gravity.acceleration", gravity.acceleration));
        checks.push(not_negative("gravity.ramp", gravity.ramp, " (s)"));
    }
    for (index, item) in scene.tools.iter().enumerate() {
        checks.push(tool(&format!("tools[{index}]"), item, &scene.bodies));
    }
    checks.push(unique(
        "tools",
        scene.tools.iter().map(|tool| tool.name.as_str()),
    ));
    for (index, item) in scene.cuts.iter().enumerate() {
        checks.push(cut(&format!("cuts[{index}]"), item, scene));
    }
    checks.push(unique(
        "cuts",
        scene.cuts.iter().map(|cut| cut.name.as_str()),
    ));
    let time = integration(&scene.integration);
    let lasting = time.is_ok();
    checks.extend([time, stepping(scene)]);
    if lasting {
        // What a rate makes depends on the duration.
        checks.push(observe(scene));
        if let Some(settings) = &scene.pictures {
            let rate = || limited("pictures.rate", settings.rate, MOST_FRAMES, scene, "frames");
            checks.push(pictures(settings).and_then(|()| rate()));
        }
    }
    checks.into_iter().filter_map(Check::err).collect()
}

fn whole(scene: &Scene) -> Check {
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
    require(
        scene.bodies.len() <= MOST_BODIES,
        "bodies",
        format_args!("a list of {}", scene.bodies.len()),
        format_args!("a scene may have {MOST_BODIES} at most"),
    )
}

fn observe(scene: &Scene) -> Check {
    let rate = scene.observe.history_rate;
    positive("observe.history_rate", rate, " (1/s)")?;
    limited("observe.history_rate", rate, MOST_ROWS, scene, "rows")?;
    let rate = scene.observe.force_rate;
    positive("observe.force_rate", rate, " (1/s)")?;
    if !scene.tools.is_empty() {
        limited("observe.force_rate", rate, MOST_ROWS, scene, "rows")?;
    }
    if let Some(rate) = scene.observe.state_rate {
        positive("observe.state_rate", rate, " (1/s)")?;
        limited("observe.state_rate", rate, MOST_FRAMES, scene, "states")?;
    }
    if let Some(period) = scene.observe.checkpoint {
        positive("observe.checkpoint", period, " (s)")?;
    }
    Ok(())
}

/// Most bodies: pictures number two surfaces of each in 16 bits.
const MOST_BODIES: usize = 32_767;
/// Most rows of `history.csv` and of `tools.csv`.
const MOST_ROWS: f64 = 1e7;
/// Most frames of a run.
const MOST_FRAMES: f64 = 1e5;
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

/// What the scheme and the way to rest ask of the rest of the scene.
fn stepping(scene: &Scene) -> Check {
    let settings = &scene.integration;
    let at_rest = settings
        .settle
        .is_some_and(|settle| settle.rest == Rest::Equilibrium);
    require(
        !at_rest || scene.tools.is_empty(),
        "integration.settle.rest",
        "Equilibrium",
        "it does not go with tools; take Motion",
    )?;
    let (Scheme::BackwardEuler { step, tolerance } | Scheme::Newmark { step, tolerance }) =
        settings.scheme
    else {
        return Ok(());
    };
    positive("integration.scheme.step", step, " (s), such as 0.01")?;
    require(
        tolerance > 0.0 && tolerance < 1.0,
        "integration.scheme.tolerance",
        tolerance,
        "it must be above 0 and below 1, such as 1e-4",
    )?;
    for (index, body) in scene.bodies.iter().enumerate() {
        require(
            body.damping_ratio == 0.0,
            format_args!("bodies[{index}].damping_ratio"),
            body.damping_ratio,
            "implicit schemes have no viscous damping; set it to 0",
        )?;
    }
    for (index, tool) in scene.tools.iter().enumerate() {
        require(
            tool.release.is_none(),
            format_args!("tools[{index}].release"),
            "given",
            "implicit schemes have tools on paths only; take an explicit scheme",
        )?;
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
    require(
        [1, 2, 4].contains(&pictures.samples),
        "pictures.samples",
        pictures.samples,
        "it must be 1, 2 or 4",
    )?;
    if let Some(behind) = pictures.background {
        color("pictures.background.top", behind.top)?;
        color("pictures.background.bottom", behind.bottom)?;
    }
    positive("pictures.rate", pictures.rate, " (frames per second)")?;
    require(
        pictures.splat_scale > 0.0 && pictures.splat_scale <= 1.0,
        "pictures.splat_scale",
        pictures.splat_scale,
        "it must be above 0 and 1 at most",
    )?;
    if let Show::Normals { length } = pictures.show {
        positive("pictures.show.length", length, " (m)")?;
    }
    match pictures.color {
        Coloring::Tissue => {}
        Coloring::Displacement { most } => positive("pictures.color.most", most, " (m)")?,
        Coloring::Stress { most } => positive("pictures.color.most", most, " (Pa)")?,
        Coloring::Curvature { most } => positive("pictures.color.most", most, " (1/m)")?,
    }
    match pictures.view {
        View::Around {
            azimuth,
            elevation,
            zoom,
            ..
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
