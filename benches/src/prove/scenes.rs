//! Whole scenes of the validation suite, and the problems with a known answer.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::Proof;
use phyxel_cli::cli::run_time;
use phyxel_cli::run::{RunOptions, pool, run};

use crate::batch::{Case, run_all};
use crate::studies::embedded;
use crate::{Options, cook, cracks, griffith, matrix, random, watch};

/// The cases' rows, one after the other: the claims themselves share the cores.
fn rows(cases: &[Case], options: Options) -> Vec<crate::Row> {
    run_all(cases, 1, options, |_| Ok(())).expect("threads can be had")
}

pub(super) fn matrix(proof: &mut Proof) {
    let mut cases = matrix::cases().expect("its scenes are valid");
    cases.retain(|case| matrix::QUICK.contains(&&*case.name));
    assert_eq!(cases.len(), matrix::QUICK.len(), "as many as are named");
    let rows = rows(&cases, Options::default());
    for row in &rows {
        let own = std::slice::from_ref(row);
        let what = format!(
            "{}: added {:.1e}, energy-balance error {:.1e}, shrink {:.2}, det F {:.3}",
            row.scene, row.added, row.imbalance, row.shrink, row.smallest_determinant
        );
        proof.none(what, &matrix::breaches(own));
    }
    proof.none("all together", &matrix::breaches(&rows));
}

/// Those families of the study `cracks` that keep their limits in all.
pub(super) fn cracks(proof: &mut Proof) {
    for (name, family) in cracks::FAMILIES {
        if ["slit", "penny", "modes 8"].contains(&name) {
            for finding in family(cracks::Fronts::OfScenes).expect("it is a scene") {
                let what = format!("{}, {}", finding.case, finding.quantity);
                proof.within(what, finding.ratio, 1.0, finding.bar);
            }
        }
    }
}

pub(super) fn step_limit(proof: &mut Proof) {
    let mut cases = matrix::cases().expect("its scenes are valid");
    cases.retain(|case| case.name == "block 500 through");
    let rows = rows(&cases, Options { eigenvalues: true });
    let most = rows[0].step_to_limit.expect("it was asked for");
    proof.above("largest step over its limit", most, 0.3);
    proof.below("largest step over its limit", most, 1.0);
}

pub(super) fn cook(proof: &mut Proof) {
    let finding = cook::measure(32).expect("it is solved");
    let what = format!("rise {:.3} of {}", finding.rise, cook::RISE);
    proof.none(what, &cook::breaches(&finding));
}

pub(super) fn griffith(proof: &mut Proof) {
    let finding = griffith::measure(4.0);
    let what = format!(
        "released over G by the load {:.3}, by the closed form {:.3}, most that an update adds {:.1e}",
        finding.ratio, finding.ratio_of_closed_form, finding.row.added
    );
    proof.none(what, &griffith::breaches(&finding));
}

/// `phyxel check` accepts what runs. How far its estimate of the time is off is printed: no claim, as it depends on what
/// else the machine does.
pub(super) fn check(proof: &mut Proof) {
    const SCENES: u32 = 10;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = RunOptions::quiet(folder.path(), 1);
    let one = pool(Some(1)).expect("a thread can be had");
    for Case { name, scene } in random::cases(45, SCENES, false).expect("valid") {
        let estimate = one.install(|| run_time(&scene));
        let ran = run(&scene, &options);
        let mut off = "refused".to_owned();
        if let (Ok([least, most]), Ok(summary)) = (&estimate, &ran) {
            let wall = summary.timings.wall;
            let times = (least / wall).max(wall / most).max(1.0);
            off = format!("time off {times:.1} times");
        }
        proof.holds(format!("{name}: {off}"), estimate.is_ok() == ran.is_ok());
    }
}

/// Name, viscosity and what else the block is given.
const CREEPING: &str = "\
half as stiff again for 0.1 s | (ratio: 0.5, time: 0.1) |
captured ten times as often | (ratio: 0.5, time: 0.1) | cuts[0].capture=Spacing(0.015); cuts[1].capture=Spacing(0.015)
thrice as stiff for 1 ms | (ratio: 2, time: 0.001) |
thrice as stiff for 10 s | (ratio: 2, time: 10) |
with fibres | (ratio: 0.5, time: 0.1) | bodies[0].material.fiber=(direction: (0, 0.3, 1), stiffness: 5e3, exponent: 1)
with mean dilatation | (ratio: 0.5, time: 0.1) | bodies[0].material.dilatation=Mean
with a probe | (ratio: 0.5, time: 0.1) | tools=[(name: \"probe\", shape: Sphere(radius: 0.02), friction: 0.3, path: [\
(time: 0, position: (-0.08, 0, 0.06)), (time: 1, position: (-0.045, 0, 0.06)), (time: 2, position: (-0.08, 0, 0.06))])]
energy-momentum | (ratio: 0.5, time: 0.1) | integration.scheme=EnergyMomentum(step: 0.003)
backward Euler | (ratio: 0.5, time: 0.1) | integration.scheme=BackwardEuler(step: 0.003)";

/// Cut bodies that creep close their energy as plain ones do, and their steps do not shrink.
pub(super) fn viscosity(proof: &mut Proof) {
    for line in CREEPING.lines() {
        let [name, term, more] = line.split('|').map(str::trim).collect::<Vec<_>>()[..] else {
            panic!("three parts in '{line}'");
        };
        let term = format!("bodies[0].material.viscosity=[{term}]");
        let mut changes = vec![&*term, "bodies[0].sampling.target=Nodes(700)"];
        changes.extend(more.split("; ").filter(|change| !change.is_empty()));
        let scene = embedded("block", &changes).expect("a scene");
        let row = watch::run(name, scene, Options::default());
        proof.below(format!("{name}: unexplained"), row.imbalance, 5e-4);
        let what = format!("{name}: first step over the least");
        proof.below(what, row.shrink, 2.0);
    }
}

/// A hanging ring that a blade cuts through on both sides falls apart, whatever its stiffness and the blade's angle.
pub(super) fn ring(proof: &mut Proof) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for modulus in ["1e4", "1e5"] {
        for gravity in ["0", "-9.81"] {
            for angle in [0.0_f64, 18.0, 36.0, 54.0, 72.0] {
                let (sin, cos) = angle.to_radians().sin_cos();
                let (x, z) = (0.2 * cos, 0.2 * sin);
                let text = format!(
                    "(version: 1, bodies: [(
                        shape: Tube(from: (0, -0.015, 0), to: (0, 0.015, 0), inner_radius: 0.05, outer_radius: 0.09),
                        sampling: (target: Nodes(1000)), damping: 3,
                        material: (youngs_modulus: {modulus}, poissons_ratio: 0.4, density: 1000))],
                    supports: [(region: HalfSpace(point: (0, 0, 0.075), normal: (0, 0, 1)))],
                    gravity: (acceleration: (0, 0, {gravity}), ramp: 0.3),
                    cuts: [(edge: [(-{x}, 0, -{z}), ({x}, 0, {z})],
                        path: [(time: 0.1, position: (0, -0.05, -0.01)), (time: 1, position: (0, 0.05, -0.01))])],
                    integration: (duration: 1.5, settle: (speed: 2e-3, limit: 1.5, damping: 10)))"
                );
                let scene = phyxel_scene::from_text(&text, "the ring", "", &[]).expect("a scene");
                let ran = run(&scene, &RunOptions::quiet(folder.path(), 1)).expect("it ends");
                let what = format!("E {modulus}, gravity {gravity}, {angle} degrees: 2 pieces");
                proof.holds(what, ran.bodies[0].pieces == 2);
            }
        }
    }
}

pub(super) fn random_seed(proof: &mut Proof) {
    for all in [false, true] {
        let [few, more] = [2, 4].map(|count| random::cases(7, count, all).expect("valid"));
        proof.holds("two are the first of four", few[..] == more[..2]);
        proof.holds("they differ", few[0].scene.cuts != few[1].scene.cuts);
    }
}

/// What no random scene says: what is not of one body's mechanics, and what is there to compare with.
const NOT_DRAWN: &str = "version description observe pictures bodies.name bodies.shape.Mesh.largest_hole \
     bodies.rotation bodies.scale bodies.velocity bodies.surfels bodies.method bodies.cut_rule \
     bodies.sampling.limit bodies.material.tissue bodies.material.density bodies.material.stabilization \
     bodies.inclusions.fiber bodies.position supports.body contact.between cuts.body cuts.weld_tolerance \
     integration.scheme.BackwardEuler.tolerance integration.scheme.EnergyMomentum.tolerance integration.settle. \
     tools.body tools.looks tools.name tools.penalty tools.position";

/// A key of scenes that `random --all` does not draw is in the list, with the others of which that is known.
pub(super) fn random_keys(proof: &mut Proof) {
    fn collect(value: &Value, at: &str, found: &mut BTreeMap<String, BTreeSet<String>>) {
        match value {
            Value::Object(fields) => {
                for (key, value) in fields {
                    collect(value, &format!("{at}.{key}"), found);
                }
            }
            Value::Array(items) if items.iter().any(|item| !item.is_number()) => {
                items.iter().for_each(|item| collect(item, at, found));
            }
            _ => {
                let at = at.trim_start_matches('.').to_owned();
                found.entry(at).or_default().insert(value.to_string());
            }
        }
    }
    let mut found = BTreeMap::new();
    for case in random::cases(8, 200, true).expect("valid") {
        let scene = serde_json::to_value(&case.scene).expect("a scene is data");
        collect(&scene, "", &mut found);
    }
    // What is there or not has keys of its own where it is.
    let is_drawn = |key: &str, values: &BTreeSet<String>| {
        let within = format!("{key}.");
        values.len() > 1 || found.keys().any(|other| other.starts_with(&within))
    };
    let same = found.iter().filter(|(key, values)| !is_drawn(key, values));
    let unknown = same.filter(|(key, _)| {
        !NOT_DRAWN
            .split_whitespace()
            .any(|known| key.starts_with(known))
    });
    let unknown: Vec<String> = unknown.map(|(key, _)| key.clone()).collect();
    proof.none(format!("of {} keys", found.len()), &unknown);
}
