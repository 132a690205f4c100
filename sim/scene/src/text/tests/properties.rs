//! Properties of texts, whatever their values.

use proptest::prelude::*;

use super::*;

/// A number as scenes have them: of any size, and its neighbours in binary.
fn number() -> impl Strategy<Value = f64> {
    prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO
}

fn positive() -> impl Strategy<Value = f64> {
    prop::num::f64::NORMAL.prop_map(f64::abs)
}

fn point() -> impl Strategy<Value = DVec3> {
    (number(), number(), number()).prop_map(DVec3::from)
}

prop_compose! {
    fn scene()(
        size in (positive(), positive(), positive()),
        (place, turn) in (point(), point()),
        (modulus, damping) in (positive(), positive()),
        keys in prop::collection::vec((positive(), point()), 1..5),
        name in "[a-zA-Z0-9][-a-zA-Z0-9_. ]{0,20}",
        count in any::<u32>(),
    ) -> Scene {
        let mut body = Body::new(Shape::Box { size: size.into() });
        (body.position, body.rotation) = (place, turn);
        body.material.youngs_modulus = modulus;
        body.damping = damping;
        body.sampling.target = Target::Nodes(count);
        let mut scene = Scene::new(&name, vec![body]);
        let path = keys.into_iter().map(|(time, position)| Key::new(time, position));
        scene.cuts.push(Cut::new(vec![place, turn], path.collect()));
        scene
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// What is written in RON or JSON is read as it was, every number bitwise.
    #[test]
    fn what_is_written_is_read(scene in scene()) {
        let text = to_ron(&scene);
        let again: Scene = parse(&text, Syntax::Ron, "a.ron", "the scene").expect("RON");
        prop_assert_eq!(&again, &scene);
        prop_assert_eq!(to_ron(&again), text);
        let json = serde_json::to_string(&scene).expect("JSON says it");
        let again: Scene = parse(&json, Syntax::Json, "a.json", "the scene").expect("JSON");
        prop_assert_eq!(&again, &scene);
    }

    /// An override gives its value to the key that it names and to no other.
    #[test]
    fn an_override_changes_its_key_alone(scene in scene(), modulus in positive()) {
        let text = format!("bodies[0].material.youngs_modulus={modulus:?}");
        let change = Override::parse(&text).expect("it is one");
        prop_assert_eq!(change.to_string(), text);
        let changed = change.apply(&to_ron(&scene)).expect("the key is there");
        let mut expected = scene;
        expected.bodies[0].material.youngs_modulus = modulus;
        let changed: Scene = parse(&changed, Syntax::Ron, "a", "the scene").expect("RON");
        prop_assert_eq!(changed, expected);
    }
}
