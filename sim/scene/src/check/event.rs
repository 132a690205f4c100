//! What acts on the bodies: supports, tools and cuts.

use super::file::rigid;
use super::shapes::{region, tool_shape};
use super::suggest::{DidYouMean, nearest};
use super::{Checks, SCALE, triple};
use crate::{Body, Capture, Cut, Key, Scene, Support, SupportMotion, Tool};

pub(super) fn support(checks: &mut Checks, support: &Support, bodies: &[Body]) {
    body_name(checks, "body", support.body.as_deref(), bodies);
    checks.group("region", |checks| region(checks, &support.region));
    if let SupportMotion::Driven { path } = &support.motion {
        keys_in_order(checks, "motion.path", path, 1);
    }
}

pub(super) fn tool(checks: &mut Checks, tool: &Tool, bodies: &[Body]) {
    body_name(checks, "body", tool.body.as_deref(), bodies);
    checks.group("shape", |checks| tool_shape(checks, &tool.shape));
    if let Some(looks) = &tool.looks {
        checks.group("looks", |checks| rigid(checks, looks));
    }
    checks.finite("position", tool.position);
    checks.positive("scale", tool.scale, SCALE);
    keys_in_order(checks, "path", &tool.path, 0);
    checks.not_negative("friction", tool.friction, "");
    checks.positive("penalty", tool.penalty, " (N/m^3)");
    let Some(release) = &tool.release else {
        return;
    };
    checks.positive("release.mass", release.mass, " (kg)");
    checks.finite("release.force", release.force);
    checks.not_negative("release.damping", release.damping, " (1/s)");
    let found = format_args!("{} keys", tool.path.len());
    let must = "a tool that is released has one key at most, the position where it is released";
    checks.require(tool.path.len() <= 1, "path", found, must);
    let fits = tool.body.is_some() || bodies.len() == 1;
    let found = format_args!("a tool that touches {} bodies", bodies.len());
    let named = checks.path("body");
    let must = format_args!("a released tool touches one body; name it in {named}");
    checks.require(fits, "release", found, must);
}

pub(super) fn cut(checks: &mut Checks, cut: &Cut, scene: &Scene) {
    body_name(checks, "body", cut.body.as_deref(), &scene.bodies);
    let found = format_args!("{} points", cut.edge.len());
    let must = "a blade's edge needs two points at least";
    checks.require(cut.edge.len() >= 2, "edge", found, must);
    checks.each("edge", &cut.edge, |checks, &point| checks.finite("", point));
    for (index, pair) in cut.edge.windows(2).enumerate() {
        let path = format_args!("edge[{}]", index + 1);
        let must = "it equals the point before it";
        checks.require(pair[0] != pair[1], path, triple(pair[1]), must);
    }
    keys_in_order(checks, "path", &cut.path, 2);
    let duration = scene.integration.duration;
    let last = cut.path.last().map_or(0.0, |key| key.time);
    // A scene that only settles has no time for any cut: a recording of one that was saved then.
    let fits = duration == 0.0 || last <= duration;
    let end = format_args!("path[{}].time", cut.path.len().saturating_sub(1));
    let must = format_args!("the scene ends at integration.duration, {duration} s");
    checks.require(fits, end, last, must);
    // How many a share of the spacing makes is known once the nodes are.
    cut.check_capture(checks, f64::INFINITY);
    checks.not_negative("weld_tolerance", cut.weld_tolerance, " (m)");
}

/// Most captures that a stroke may make.
const MOST_CAPTURES: f64 = 1e5;

impl Cut {
    /// Checks when it is captured, and that it is not too often with nodes `spacing` (m) apart; key paths start here.
    pub fn check_capture(&self, checks: &mut Checks, spacing: f64) {
        let ends = self.path.first().zip(self.path.last());
        let time = ends.map_or(0.0, |(first, last)| last.time - first.time);
        let (name, value, such_as, count) = match self.capture {
            Capture::Rate(rate) => ("Rate", rate, " (1/s), such as 60", rate * time),
            Capture::Distance(far) => {
                let count = self.way() / far;
                ("Distance", far, " (m), such as 0.002", count)
            }
            Capture::Spacing(share) => {
                let count = self.way() / (share * spacing);
                ("Spacing", share, ", such as 0.15", count)
            }
        };
        checks.above_zero("capture", name, value, such_as);
        let (found, most) = (format_args!("{name}({value:?})"), MOST_CAPTURES);
        let (better, way) = match self.capture {
            Capture::Rate(rate) => (0.99 * rate * most / count, "less"),
            _ => (1.01 * value * count / most, "more"),
        };
        let must = format_args!(
            "it makes {count:.2e} captures; the limit is {most:.0e}: take {name}({better:.2e}) or {way}"
        );
        checks.require(count <= most, "capture", found, must);
    }
}

/// A body that is named must be there.
pub(super) fn body_name(checks: &mut Checks, path: &str, name: Option<&str>, bodies: &[Body]) {
    let Some(name) = name else { return };
    let names: Vec<&str> = bodies.iter().map(|body| body.name.as_str()).collect();
    if names.contains(&name) {
        return;
    }
    let hint = DidYouMean(nearest(name, names.iter().copied()));
    let names = names.join(", ");
    let must = format_args!("no body has this name{hint}; bodies are {names}");
    checks.require(false, path, format_args!("'{name}'"), must);
}

/// Keys of a path, `fewest` at least, must be finite and follow each other.
fn keys_in_order(checks: &mut Checks, path: &str, keys: &[Key], fewest: usize) {
    let found = format_args!("{} keys", keys.len());
    let must = format_args!("it needs {fewest} at least, such as (time: 0, position: (0, 0, 0))");
    checks.require(keys.len() >= fewest, path, found, must);
    checks.each(path, keys, |checks, key| {
        checks.not_negative("time", key.time, " (s after settling)");
        checks.finite("position", key.position);
        checks.finite("rotation", key.rotation);
    });
    for (index, pair) in keys.windows(2).enumerate() {
        let [before, after] = [pair[0].time, pair[1].time];
        let path = format_args!("{path}[{}].time", index + 1);
        let must = format_args!("it must be later than the key before, at {before} s");
        checks.require(before < after, path, after, must);
    }
}
