//! A dozen scenes of the laboratory, and the problems with a known answer.

use benches::batch::{Case, run_all};
use benches::{Options, cook, cracks, griffith, matrix, random};

/// The cases' rows, two at a time.
fn rows(cases: &[Case], options: Options) -> Vec<benches::Row> {
    run_all(cases, 2, options, |_| Ok(())).expect("threads can be had")
}

fn none(breaches: &[String]) {
    assert!(breaches.is_empty(), "{}", breaches.join("\n"));
}

#[test]
fn a_dozen_scenes_of_the_matrix_hold() {
    let mut cases = matrix::cases().expect("its scenes are valid");
    cases.retain(|case| matrix::QUICK.contains(&&*case.name));
    assert_eq!(cases.len(), matrix::QUICK.len());
    let rows = rows(&cases, Options::default());
    none(&matrix::breaches(&rows));
}

/// The opening and the sag of a beam that a blade slits, against finite elements.
#[test]
fn a_slit_by_a_blade_opens_as_finite_elements_say() {
    let (_, slit) = cracks::FAMILIES
        .iter()
        .find(|family| family.0 == "slit")
        .expect("it is one");
    let findings = slit(cracks::Fronts::OfScenes).expect("it is a scene");
    assert_eq!(findings.len(), 2, "sag and mouth");
    none(&cracks::breaches(&findings));
}

#[test]
fn a_step_stays_below_the_limit_of_an_independent_estimate() {
    let mut cases = matrix::cases().expect("its scenes are valid");
    cases.retain(|case| case.name == "block 500 through");
    let rows = rows(&cases, Options { eigenvalues: true });
    let most = rows[0].step_to_limit.expect("it was asked for");
    assert!(most > 0.3 && most < 1.0, "the step is {most} of its limit");
}

#[test]
fn random_scenes_depend_on_their_seed_and_number_alone() {
    let (few, more) = (random::cases(7, 2), random::cases(7, 4));
    let (few, more) = (few.expect("valid"), more.expect("valid"));
    assert_eq!(few[..], more[..2]);
    assert_ne!(few[0].scene.cuts, few[1].scene.cuts);
}

#[test]
fn cooks_membrane_rises_as_it_should() {
    none(&cook::breaches(&cook::measure(32).expect("it is solved")));
}

#[test]
fn a_crack_sets_its_energy_release_rate_free_and_no_update_adds_any() {
    none(&griffith::breaches(
        &griffith::measure(4.0).expect("it is a scene"),
    ));
}
