//! What a scene's values must be: checked once, so that nothing later meets a surprise.

mod body;
mod event;
mod faults;
mod file;
mod shapes;
mod suggest;

use crate::{Between, Coloring, Integration, Pictures, Rest, Scene, Scheme, Show, VERSION, View};
use body::body;
use event::{body_name, cut, support, tool};
use faults::triple;
pub use faults::{Checks, Fault};
use file::rigid;
pub use suggest::{DidYouMean, nearest};

/// Hint for what makes a thing larger than its shape says.
const SCALE: &str = ", 1 for the size that the shape says";

impl Scene {
    /// Checks every value, so that nothing later meets a surprise.
    ///
    /// # Errors
    /// The first value that is not as it must be, with its key path and a remedy.
    pub fn validate(&self) -> Result<(), Fault> {
        let scene = self;
        let mut all = Checks::default();
        let checks = &mut all;
        whole(checks, scene);
        integration(checks, &scene.integration);
        checks.each("bodies", &scene.bodies, body);
        unique(checks, "bodies", scene.bodies.iter().map(|one| &*one.name));
        checks.each("supports", &scene.supports, |checks, item| {
            support(checks, item, &scene.bodies);
        });
        if let Some(gravity) = &scene.gravity {
            checks.finite("gravity.acceleration", gravity.acceleration);
            checks.not_negative("gravity.ramp", gravity.ramp, " (s)");
        }
        checks.each("tools", &scene.tools, |checks, item| {
            tool(checks, item, &scene.bodies);
        });
        contact(checks, scene);
        unique(checks, "tools", scene.tools.iter().map(|tool| &*tool.name));
        checks.each("cuts", &scene.cuts, |checks, item| cut(checks, item, scene));
        unique(checks, "cuts", scene.cuts.iter().map(|cut| &*cut.name));
        stepping(checks, scene);
        observe(checks, scene);
        if let Some(settings) = &scene.pictures {
            checks.group("pictures", |checks| {
                pictures(checks, settings);
                limited(checks, "rate", settings.rate, MOST_FRAMES, scene, "frames");
            });
        }
        all.first()
    }
}

fn whole(checks: &mut Checks, scene: &Scene) {
    let (version, name, bodies) = (scene.version, &scene.name, scene.bodies.len());
    let must = format_args!("this program reads version {VERSION}");
    checks.require(version == VERSION, "version", version, must);
    let must = "it names the output folder: use letters, digits, '-', '_', '.' or spaces, and begin with \
         a letter or digit";
    checks.require(is_file_name(name), "name", format_args!("'{name}'"), must);
    let must = "a scene needs one body at least, such as (shape: Liver(width: 0.166))";
    checks.require(bodies > 0, "bodies", "empty", must);
    let found = format_args!("a list of {bodies}");
    let must = format_args!("a scene may have {MOST_BODIES} at most");
    checks.require(bodies <= MOST_BODIES, "bodies", found, must);
}

fn observe(checks: &mut Checks, scene: &Scene) {
    let mut rate = |path: &str, rate: f64, most: f64, what: &str| {
        checks.positive(path, rate, " (1/s)");
        limited(checks, path, rate, most, scene, what);
    };
    let observe = scene.observe;
    let path = "observe.history_rate";
    rate(path, observe.history_rate, MOST_ROWS, "rows");
    // Without a tool there are no rows.
    let tools = !scene.tools.is_empty();
    let most = if tools { MOST_ROWS } else { f64::INFINITY };
    rate("observe.force_rate", observe.force_rate, most, "rows");
    if let Some(states) = observe.state_rate {
        rate("observe.state_rate", states, MOST_FRAMES, "states");
    }
    checks.positive("observe.checkpoint", observe.checkpoint, " (s)");
}

/// Most bodies: pictures number two surfaces of each in 16 bits.
const MOST_BODIES: usize = 32_767;
/// Most rows of `history.csv`, and of `tools.csv` for a tool.
const MOST_ROWS: f64 = 1e7;
/// Most frames of a run.
const MOST_FRAMES: f64 = 1e5;
/// Most pixels of a frame (64 megapixels).
const MOST_PIXELS: u64 = 1 << 26;

fn limited(checks: &mut Checks, path: &str, rate: f64, most: f64, scene: &Scene, what: &str) {
    let duration = scene.integration.duration;
    let count = rate * duration;
    let must =
        format_args!("over {duration} s it makes {count:.2e} {what} and the limit is {most:.0e}");
    checks.require(count <= most, path, rate, must);
}

fn is_file_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_alphanumeric())
        && name.len() <= 100
        && (name.chars()).all(|c| c.is_alphanumeric() || "-_. ".contains(c))
}

fn unique<'a>(checks: &mut Checks, path: &str, names: impl Iterator<Item = &'a str>) {
    let names: Vec<&str> = names.collect();
    for (index, name) in names.iter().enumerate() {
        let is_new = !names[..index].contains(name);
        let path = format_args!("{path}[{index}].name");
        let must = "an earlier one has this name already; give each its own";
        checks.require(is_new, path, format_args!("'{name}'"), must);
    }
}

fn integration(checks: &mut Checks, settings: &Integration) {
    let (path, hint) = ("integration.duration", " (s after settling)");
    checks.not_negative(path, settings.duration, hint);
    let (path, factor) = ("integration.step_factor", settings.step_factor);
    let must = "it must be above 0 and at most 1, the largest stable step";
    checks.require(factor > 0.0 && factor <= 1.0, path, factor, must);
    if let Some(settle) = settings.settle {
        checks.positive("integration.settle.speed", settle.speed, " (m/s)");
        checks.positive("integration.settle.limit", settle.limit, " (s)");
        checks.not_negative("integration.settle.damping", settle.damping, " (1/s)");
    }
}

/// How bodies touch each other.
fn contact(checks: &mut Checks, scene: &Scene) {
    let Some(contact) = &scene.contact else {
        return;
    };
    checks.not_negative("contact.friction", contact.friction, "");
    if let Between::Pairs(pairs) = &contact.between {
        checks.each("contact.between", pairs, |checks, pair| {
            let (a, b) = &pair.bodies;
            body_name(checks, "bodies", Some(a), &scene.bodies);
            body_name(checks, "bodies", Some(b), &scene.bodies);
            checks.not_negative("friction", pair.friction, "");
            let first = pairs.iter().find(|other| other.is_of(a, b));
            let is_new = first.is_some_and(|first| std::ptr::eq(first, pair));
            let found = format_args!("of '{a}' and '{b}'");
            checks.require(is_new, "", found, "these two are named before");
        });
    }
    let is_explicit = scene.integration.scheme.step().is_none();
    let must = "implicit schemes have no contact between bodies; take an explicit integration.scheme, or leave it out";
    checks.require(is_explicit, "contact", "given", must);
}

/// What the scheme and the method of coming to rest ask of the rest of the scene.
fn stepping(checks: &mut Checks, scene: &Scene) {
    let settings = &scene.integration;
    let at_rest = (settings.settle).is_some_and(|settle| settle.rest == Rest::Equilibrium);
    let fits = !at_rest || scene.tools.is_empty();
    let (path, must) = (
        "integration.settle.rest",
        "it does not go with tools; take Motion",
    );
    checks.require(fits, path, "Equilibrium", must);
    if let Scheme::BackwardEuler { step, tolerance } | Scheme::EnergyMomentum { step, tolerance } =
        settings.scheme
    {
        checks.positive("integration.scheme.step", step, " (s), such as 0.01");
        let path = "integration.scheme.tolerance";
        let must = "it must be above 0 and below 1, such as 1e-4";
        checks.require(tolerance > 0.0 && tolerance < 1.0, path, tolerance, must);
    }
    if settings.scheme.step().is_none() {
        return;
    }
    checks.each("bodies", &scene.bodies, |checks, body| {
        let must = "implicit schemes have no viscous damping; set it to 0";
        let ratio = body.damping_ratio;
        checks.require(ratio == 0.0, "damping_ratio", ratio, must);
    });
    checks.each("tools", &scene.tools, |checks, tool| {
        let must = "implicit schemes have tools on paths only; take an explicit scheme";
        checks.require(tool.release.is_none(), "release", "given", must);
    });
}

fn pictures(checks: &mut Checks, pictures: &Pictures) {
    let (width, height) = (pictures.width, pictures.height);
    for (path, size) in [("width", width), ("height", height)] {
        checks.require(size >= 16, path, size, "it must be 16 pixels or more");
    }
    let pixels = u64::from(width) * u64::from(height);
    let must = format_args!("with the height it makes {pixels} pixels; the limit is {MOST_PIXELS}");
    checks.require(pixels <= MOST_PIXELS, "width", width, must);
    let fits = [1, 2, 4].contains(&pictures.samples);
    let must = "it must be 1, 2 or 4";
    checks.require(fits, "samples", pictures.samples, must);
    if let Some(behind) = pictures.background {
        checks.color("background.top", behind.top);
        checks.color("background.bottom", behind.bottom);
    }
    checks.positive("rate", pictures.rate, " (frames per second)");
    let scale = pictures.splat_scale;
    let must = "it must be above 0 and 1 at most";
    checks.require(scale > 0.0 && scale <= 1.0, "splat_scale", scale, must);
    checks.each("meshes", &pictures.meshes, rigid);
    if let Show::Normals { length } = pictures.show {
        checks.positive("show.length", length, " (m)");
    }
    let (most, unit) = match pictures.color {
        Coloring::Tissue => (1.0, ""),
        Coloring::Displacement { most } => (most, " (m)"),
        Coloring::Stress { most } => (most, " (Pa)"),
        Coloring::Curvature { most } => (most, " (1/m)"),
    };
    checks.positive("color.most", most, unit);
    checks.group("view", |checks| view(checks, pictures.view));
}

fn view(checks: &mut Checks, view: View) {
    match view {
        View::Around {
            azimuth,
            elevation,
            zoom,
            ..
        } => {
            let must = "it must be finite (degrees)";
            checks.require(azimuth.is_finite(), "azimuth", azimuth, must);
            let must = "it must be from -90 (below) to 90 (above)";
            checks.within("elevation", elevation, -90.0..=90.0, must);
            checks.positive("zoom", zoom, ", 1 fits the bodies");
        }
        View::Explicit {
            eye,
            target,
            field_of_view,
        } => {
            checks.finite("eye", eye);
            checks.finite("target", target);
            let must = "it must differ from the eye";
            checks.require(eye != target, "target", triple(target), must);
            let fits = field_of_view > 0.0 && field_of_view < 180.0;
            let must = "it must be above 0 and below 180 (degrees)";
            checks.require(fits, "field_of_view", field_of_view, must);
        }
    }
}
