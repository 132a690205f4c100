//! Whole scenes of the validation suite, and the problems with a known answer.

use glam::DVec3;
use phyxel::World;
use phyxel::scene::{Body, Capture, Cut, Key, Region, Scene, Shape, Support, Target};
use testkit::cloud::Random;

use super::Proof;
use crate::batch::{Case, run_all};
use crate::{Options, cook, cracks, griffith, matrix, random};

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
            "{}: added {:.1e}, imbalance {:.1e}, shrink {:.2}, det F {:.3}",
            row.scene, row.added, row.imbalance, row.shrink, row.smallest_determinant
        );
        proof.none(what, &matrix::breaches(own));
    }
    proof.none("all together", &matrix::breaches(&rows));
}

pub(super) fn slit_by_a_blade(proof: &mut Proof) {
    let mut families = cracks::FAMILIES.iter();
    let (_, slit) = families.find(|family| family.0 == "slit").expect("one");
    let findings = slit(cracks::Fronts::OfScenes).expect("it is a scene");
    assert_eq!(findings.len(), 2, "sag and mouth");
    for finding in &findings {
        let what = format!("{}, {}", finding.case, finding.quantity);
        proof.within(what, finding.ratio, 1.0, finding.bar);
    }
    proof.none("both", &cracks::breaches(&findings));
}

pub(super) fn step_below_its_limit(proof: &mut Proof) {
    let mut cases = matrix::cases().expect("its scenes are valid");
    cases.retain(|case| case.name == "block 500 through");
    let rows = rows(&cases, Options { eigenvalues: true });
    let most = rows[0].step_to_limit.expect("it was asked for");
    proof.above("largest step over its limit", most, 0.3);
    proof.below("largest step over its limit", most, 1.0);
}

pub(super) fn cooks_membrane(proof: &mut Proof) {
    let finding = cook::measure(32).expect("it is solved");
    let what = format!("rise {:.3} of {}", finding.rise, cook::RISE);
    proof.none(what, &cook::breaches(&finding));
}

pub(super) fn energy_release_rate(proof: &mut Proof) {
    let finding = griffith::measure(4.0).expect("it is a scene");
    let what = format!(
        "set free over G by the load {:.3}, by the closed form {:.3}, most that an update adds {:.1e}",
        finding.ratio, finding.ratio_of_closed_form, finding.row.added
    );
    proof.none(what, &griffith::breaches(&finding));
}

pub(super) fn random_scenes_depend_on_seed_and_number(proof: &mut Proof) {
    let [few, more] = [2, 4].map(|count| random::cases(7, count).expect("valid"));
    proof.holds("two are the first of four", few[..] == more[..2]);
    proof.holds("they differ", few[0].scene.cuts != few[1].scene.cuts);
}

/// A held block of 40 x 40 x 60 mm, cut every 0.1 ms at random places.
pub(super) fn thousand_cuts(proof: &mut Proof) {
    let mut body = Body::new(Shape::Box {
        size: DVec3::new(0.04, 0.04, 0.06),
    });
    body.sampling.target = Target::Nodes(500);
    body.material.youngs_modulus = 2e4;
    body.damping = 4.0;
    let mut scene = Scene::new("cuts", vec![body]);
    scene.supports.push(Support::fixed(Region::HalfSpace {
        point: DVec3::Z * 0.0299,
        normal: DVec3::Z,
    }));
    scene.integration.settle = None;
    scene.integration.duration = 0.2;
    let mut random = Random::new(9);
    for k in 0..1000_u32 {
        let begin = 1e-4 * f64::from(k);
        let (from, edge) = (random.vector(0.02), random.vector(0.004));
        let path = [(begin, from), (begin + 5e-5, from + random.vector(0.008))];
        let path = path.map(|(time, position)| Key::new(time, position));
        let mut cut = Cut::new(vec![-edge, edge], path.to_vec());
        cut.name = k.to_string();
        cut.capture = Capture::Distance(0.01);
        scene.cuts.push(cut);
    }
    let mut world = World::new(scene).unwrap();
    let severed = |world: &World| {
        let cutting = world.members()[0].cutting.as_ref();
        cutting.map_or(0, phyxel::Cutting::severed_pairs)
    };
    let mut before = 0;
    for k in 1..=5 {
        world.play(0.03 * f64::from(k), |_| {}).unwrap();
        proof.above("severed pairs", severed(&world) as f64, before as f64);
        before = severed(&world);
    }
    let captures = world.scene().cuts.iter();
    let captures: usize = captures.map(|cut| world.capture_count(cut)).sum();
    let taken = world.members()[0].cutting.as_ref().unwrap().counts().0;
    proof.within("samples taken up", taken as f64, captures as f64, 0.0);
    proof.above("severed pairs", before as f64, 100.0);
    let audit = world.members()[0].body.motion.audit();
    let off = audit.energy_error().abs() / audit.elastic.max(audit.dissipated);
    proof.below("imbalance", off, 0.02);
}
