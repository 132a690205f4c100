//! Hard cases of bodies and flanks that touch.

use phyxel::World;
use phyxel::scene::{Scene, embedded};

use super::Proof;

/// Largest imbalance of the energy of contact.
const OF_CONTACT: f64 = 0.01;
/// Largest imbalance of energy of a body.
const UNBALANCED: f64 = 0.01;

/// The cases: of each a line `= name | end (s) | largest depth (spacings)`, then its scene.
const CASES: &str = include_str!("touch.txt");

pub(super) fn touch(proof: &mut Proof) {
    for case in CASES.split("\n= ").skip(1) {
        let (head, scene) = case.split_once('\n').expect("a line and a scene");
        let [name, end, depth] = head.split(" | ").collect::<Vec<_>>()[..] else {
            panic!("three parts in '{head}'");
        };
        let [end, depth] = [end, depth].map(|number| number.parse().expect("a number"));
        let text = format!("(version: 1, {scene})");
        let scene = phyxel_scene::from_text(&text, name, "", &[]).expect("valid");
        play(proof, name, scene, [end, depth]);
    }
    // Until the wound is pressed shut, and the upper pad has come to lie.
    for (name, end) in [("wound", 1.2), ("stack", 0.1)] {
        let scene = embedded(name, &[]).expect("it is there");
        play(proof, name, scene, [end, 0.25]);
    }
}

fn play(proof: &mut Proof, name: &str, scene: Scene, [end, depth]: [f64; 2]) {
    let mut world = World::new(scene).expect("it can be built");
    let (mut deepest, mut pressed) = (0.0_f64, false);
    while world.time() < end {
        if let Err(error) = world.step() {
            return proof.none(name, &[error.to_string()]);
        }
        let (between, _) = world.body_contact().expect("it is asked for");
        for sum in between {
            let spacings = sum.bodies.map(|body| world.bodies()[body as usize].spacing);
            deepest = deepest.max(sum.penetration / spacings[0].min(spacings[1]));
            pressed |= sum.normal > 0.0;
        }
    }
    let what = |what: &str| format!("{name}: {what}");
    proof.holds(what("surfaces were pressed"), pressed);
    proof.below(what("depth over the spacing"), deepest, depth);
    for body in world.bodies() {
        let audit = body.motion().audit();
        let share = audit.unexplained();
        proof.above(what("det F"), body.smallest_ratio, 1e-6);
        proof.below(what("unexplained energy of a body"), share, UNBALANCED);
    }
    let unexplained = unbalanced(&world);
    let what = what("unexplained energy of contact");
    proof.below(what, unexplained, OF_CONTACT);
}

/// Energy that contact made or lost, over what the bodies hold or damped.
fn unbalanced(world: &World) -> f64 {
    let (_, state) = world.body_contact().expect("it is asked for");
    let audits = world.bodies().iter().map(|body| body.motion().audit());
    let scale: f64 = audits.map(|audit| audit.elastic.max(audit.taken())).sum();
    state.energy_error().abs() / scale
}
