//! All mistakes of a scene at once.

use phyxel_text::Syntax;
#[cfg(feature = "schemars")]
use phyxel_text::{KeyPath, line_column};

use super::*;

/// A scene with several bad values is told all of them, each on its line.
#[test]
fn all_values_that_are_wrong_are_told_at_once() {
    let text = "(version: 1, bodies: [(shape: Liver(width: -1)), (name: \"b\", shape: Liver(width: 1), damping: -3,
        material: (density: 0, poissons_ratio: 1))],
        integration: (duration: -1))";
    let told = read(text).expect_err("five values").to_string();
    let lines: Vec<&str> = told.lines().collect();
    let expected = [
        ("1", "bodies[0].shape.width is -1"),
        ("1", "bodies[1].damping is -3"),
        ("2", "bodies[1].material.density is 0"),
        ("2", "bodies[1].material.poissons_ratio is 1"),
        ("3", "integration.duration is -1"),
    ];
    assert_eq!(lines.len(), expected.len(), "{told}");
    for (line, (at, what)) in lines.iter().zip(expected) {
        assert!(line.starts_with(&format!("test.ron:{at}:")), "{told}");
        assert!(line.contains(what), "{told}");
    }
}

/// What is compared with a value that is at fault, or that stands for a misread one, is not told of.
#[test]
fn consequences_of_a_mistake_are_not_told() {
    for text in [
        // A tool of a body whose name is misread, a cut that would end too late, a tube round nothing.
        "(version: 1, bodies: [(name: 7, shape: Liver(width: 0.1))], cuts: [(body: \"liver\", edge: [(0, 0, 0), (0, 0, 1)],
            path: [(time: 1), (time: 2, position: (1, 0, 0))])], integration: (duration: 5))",
        "(version: 1, bodies: [(shape: Liver(width: 0.1))], cuts: [(edge: [(0, 0, 0), (0, 0, 1)],
            path: [(time: 1), (time: 20, position: (1, 0, 0))])], integration: (duration: -5))",
        "(version: 1, bodies: [(shape: Tube(from: (0, 0, 0), to: (0, 0, 1), inner_radius: NaN, outer_radius: 1))])",
        "(version: 1, bodies: [(shape: Liver(width: 0.1)), (shape: Liver(width: 0.1), nam: \"b\")])",
    ] {
        let error = read(text).expect_err("one mistake");
        assert!(!matches!(error, SceneError::Text(TextError::Several(_))), "{error}");
    }
}

/// However many keys of a scene are broken, and in whichever way, there is a message for each, at its place, in
/// the order of the text.
#[cfg(feature = "schemars")]
#[test]
fn every_broken_key_has_its_message() {
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
        let scene = Scene::embedded(embedded.name, &[]).expect("it is valid");
        let json = round % 2 == 1;
        let text = if json {
            serde_json::to_string_pretty(&scene).expect("it can be written")
        } else {
            scene.to_ron()
        };
        let read_tree = if json { Node::read_json } else { Node::read };
        let tree = read_tree(&text).expect("it is well formed");
        let mut found = Vec::new();
        leaves(&text, &tree, "", &mut found);
        // What may be a text as well as nothing is no mistake.
        found.retain(|(_, value)| !matches!(value.as_str(), "None" | "null" | "[]" | "()"));
        let mut breaks = Vec::new();
        for _ in 0..=random(6) {
            let (path, _) = found.swap_remove(random(found.len()));
            let key = KeyPath::parse(&path).expect("a path");
            let node = key.0.iter().fold(tree.inner(), |node, segment| {
                node.child(segment).expect("it stands there")
            });
            let node = node.inner();
            let value = &text[node.span.clone()];
            let number = value.parse::<f64>().is_ok();
            let wrong = match random(2) {
                0 if number && !json && value.contains('.') && !path.ends_with(']') => "NaN",
                _ if number || value == "true" || value == "false" => "\"word\"",
                _ => "7",
            };
            breaks.push((node.span.clone(), path, wrong));
        }
        breaks.sort_by_key(|(span, ..)| span.start);
        let mut broken = text.clone();
        for (span, _, wrong) in breaks.iter().rev() {
            broken.replace_range(span.clone(), wrong);
        }
        let file = folder.path().join(if json { "a.json" } else { "a.ron" });
        std::fs::write(&file, &broken).expect("it can be written");
        let told = Scene::load(&file, &[])
            .expect_err("it is broken")
            .to_string();
        let lines: Vec<&str> = told.lines().collect();
        assert_eq!(lines.len(), breaks.len(), "{breaks:?}:\n{told}");
        let mut moved = 0_isize;
        for (line, (span, path, wrong)) in lines.iter().zip(&breaks) {
            let start = span
                .start
                .checked_add_signed(moved)
                .expect("within the text");
            let (row, column) = line_column(&broken, start);
            // A value that is out of range is told with the name before it.
            let place = if *wrong == "NaN" {
                format!(":{row}:")
            } else {
                format!(":{row}:{column}: {path} is {wrong};")
            };
            assert!(
                line.contains(&place) && line.contains(&format!(": {path} is ")),
                "{line}\nnot {place}"
            );
            moved += wrong.len().cast_signed() - span.len().cast_signed();
        }
    }
}

/// Misspelt keys and choices are read as what they are like, so that what is in them is told of too.
#[cfg(feature = "schemars")]
#[test]
fn mistakes_within_misspelt_groups_are_told() {
    let text = "(version: 1, bodys: [(shap: Livre(width: true), materal: (densty: \"a\"), damping: -1)], tols: [])";
    let told = read(text).expect_err("all is wrong").to_string();
    let words = [
        "'bodys'",
        "'shap'",
        "'Livre'",
        "width is true",
        "'materal'",
        "'densty'",
        "density is \"a\"",
        "'tols'",
    ];
    assert_eq!(told.lines().count(), words.len(), "{told}");
    for (line, word) in told.lines().zip(words) {
        assert!(line.contains(word), "{line} without {word}");
    }
}

/// Damage at any byte gives a scene or an error with a place inside the text, never a panic.
#[test]
fn damaged_text_gives_lines_with_places() {
    let read = |text: &str| read(text);
    assert!(failures(LIVER, &['(', '\u{e9}'], read) > LIVER.len());
    let scene = Scene::embedded("minimal", &[]).expect("it is valid");
    let text = serde_json::to_string_pretty(&scene).expect("JSON says it");
    let read = |text: &str| {
        let json = Syntax::Json;
        Scene::finished((text, json), "test.json", Path::new(""), &[])
    };
    assert!(failures(&text, &['{', '"', '\u{e9}'], read) > text.len());
}

/// How many damages at all characters of a text are told of.
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
            let errors = match error {
                SceneError::Text(TextError::Several(errors)) => errors,
                SceneError::Text(error) => vec![error],
                other => panic!("damage at {at}: {other}"),
            };
            for error in errors {
                let told = error.to_string();
                assert!(!told.contains('\n'), "damage at {at}: {told}");
                let place = match error {
                    TextError::Format { place, .. } | TextError::Value { place, .. } => place,
                    other => panic!("damage at {at}: {other}"),
                };
                let (line, _) = place.position.expect("the text is at hand");
                assert!((1..=lines + 1).contains(&line), "damage at {at}: {told}");
            }
        }
    }
    failed
}
