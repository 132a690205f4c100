//! Mistakes of scenes, each reported with its position.

use super::*;
use crate::text::read::finished;
use crate::text::tree::line_column;

/// A value out of range is reported with its position; of several the first by the order of checks.
#[test]
fn a_value_that_is_wrong_is_told_at_its_place() {
    for (line, what, text) in [
        (
            1,
            "bodies[0].shape.width is -1",
            "(version: 1, bodies: [(shape: Liver(width: -1))])",
        ),
        (
            2,
            "bodies[1].material.density is 0",
            "(version: 1, bodies: [(shape: Liver(width: 1)), (name: \"b\", shape: Liver(width: 1),
                material: (density: 0, poissons_ratio: 1))])",
        ),
        (
            2,
            "integration.duration is -1",
            "(version: 1, bodies: [(shape: Liver(width: 1))],
                integration: (duration: -1))",
        ),
    ] {
        let told = read(text).expect_err(what).to_string();
        assert!(told.starts_with(&format!("test.ron:{line}:")), "{told}");
        assert!(told.contains(what), "{told}");
    }
}

/// What is compared with a value that is at fault is not reported in its stead.
#[test]
fn a_mistake_is_told_and_not_its_consequence() {
    for (text, culprit) in [
        // A tool of a body whose name is misread, a cut that would end too late, a tube round nothing.
        (
            "(version: 1, bodies: [(name: 7, shape: Liver(width: 0.1))], cuts: [(body: \"liver\", edge: [(0, 0, 0), (0, 0, 1)],
                path: [(time: 1), (time: 2, position: (1, 0, 0))])], integration: (duration: 5))",
            "bodies[0].name is 7",
        ),
        (
            "(version: 1, bodies: [(shape: Liver(width: 0.1))], cuts: [(edge: [(0, 0, 0), (0, 0, 1)],
                path: [(time: 1), (time: 20, position: (1, 0, 0))])], integration: (duration: -5))",
            "integration.duration is -5",
        ),
        (
            "(version: 1, bodies: [(shape: Tube(from: (0, 0, 0), to: (0, 0, 1), inner_radius: NaN, outer_radius: 1))])",
            "bodies[0].shape.inner_radius is NaN",
        ),
        (
            "(version: 1, bodies: [(shape: Liver(width: 0.1)), (shape: Liver(width: 0.1), nam: \"b\")])",
            "unknown key 'nam' in bodies[1] (did you mean 'name'?)",
        ),
        ("(version: 1, bodies: [(shape: Livre(width: 0.1))])", "unknown choice 'Livre' in bodies[0].shape (did you mean 'Liver'?)"),
    ] {
        let told = read(text).expect_err("one mistake").to_string();
        assert!(told.contains(culprit), "{told}");
    }
}

/// Whichever value of a scene is broken, and in whichever way, the message names it at its position.
#[test]
fn every_broken_value_has_its_message() {
    let mut seed = 7_u64;
    let mut random = |below: usize| {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(seed >> 33).expect("31 bits") % below
    };
    let folder = tempfile::tempdir().expect("a folder");
    for round in 0..400 {
        let embedded = &EMBEDDED[random(EMBEDDED.len())];
        let scene = crate::embedded(embedded.name, &[]).expect("it is valid");
        let json = round % 2 == 1;
        let text = if json {
            serde_json::to_string_pretty(&scene).expect("it can be written")
        } else {
            to_ron(&scene)
        };
        let read_tree = if json { Node::read_json } else { Node::read };
        let tree = read_tree(&text).expect("it is well formed");
        let mut found = Vec::new();
        leaves(&text, &tree, "", &mut found);
        // What may be a text as well as nothing is no mistake.
        found.retain(|(_, value)| !matches!(value.as_str(), "None" | "null" | "[]" | "()"));
        let (path, _) = found.swap_remove(random(found.len()));
        let key = KeyPath::parse(&path).expect("a path");
        let node = key.0.iter().fold(tree.inner(), |node, segment| {
            node.child(segment).expect("it stands there")
        });
        let span = node.inner().span.clone();
        let value = &text[span.clone()];
        let number = value.parse::<f64>().is_ok();
        let wrong = match random(2) {
            0 if number && !json && value.contains('.') && !path.ends_with(']') => "NaN",
            _ if number || value == "true" || value == "false" => "\"word\"",
            _ => "7",
        };
        let mut broken = text.clone();
        broken.replace_range(span.clone(), wrong);
        let file = folder.path().join(if json { "a.json" } else { "a.ron" });
        std::fs::write(&file, &broken).expect("it can be written");
        let told = load(&file, &[]).expect_err("it is broken").to_string();
        let (row, column) = line_column(&broken, span.start);
        // A value that is out of range is reported with the name before it.
        let place = if wrong == "NaN" {
            format!(":{row}:")
        } else {
            format!(":{row}:{column}: {path} is {wrong};")
        };
        assert!(
            told.contains(&place) && told.contains(&format!(": {path} is ")),
            "{told}\nnot {place}"
        );
    }
}

/// Damage at any byte gives a scene or an error with a position inside the text, never a panic.
#[test]
fn damaged_text_gives_lines_with_places() {
    let read = |text: &str| read(text);
    assert!(failures(LIVER, &['(', '\u{e9}'], read) > LIVER.len());
}

/// The same of JSON.
#[test]
fn damaged_json_gives_lines_with_places() {
    let scene = embedded("minimal", &[]).expect("it is valid");
    let text = serde_json::to_string_pretty(&scene).expect("JSON says it");
    let read = |text: &str| {
        let json = Syntax::Json;
        finished(text, json, "test.json", "".as_ref(), &[])
    };
    assert!(failures(&text, &['{', '"', '\u{e9}'], read) > text.len());
}

/// How many damages at all characters of a text are reported.
fn failures(
    text: &str,
    put_in: &[char],
    read: impl Fn(&str) -> Result<Scene, SceneError>,
) -> usize {
    let lines = text.lines().count();
    let mut failed = 0;
    for (at, c) in text.char_indices() {
        let (before, after) = (&text[..at], &text[at + c.len_utf8()..]);
        let put_in = put_in.iter().map(|c| format!("{before}{c}{after}"));
        let damaged = [format!("{before}{after}"), before.to_owned()];
        for damaged in damaged.into_iter().chain(put_in) {
            let Err(error) = read(&damaged) else { continue };
            failed += 1;
            let told = error.to_string();
            assert!(!told.contains('\n'), "damage at {at}: {told}");
            let SceneError::Text(TextError::At { place, .. }) = error else {
                panic!("damage at {at}: {told}");
            };
            let (line, _) = place.position.expect("the text is at hand");
            assert!((1..=lines + 1).contains(&line), "damage at {at}: {told}");
        }
    }
    failed
}
