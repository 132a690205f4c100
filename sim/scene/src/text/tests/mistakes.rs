//! Mistakes of scenes, each reported with its position.

use testkit::cloud::Random;

use super::*;
use crate::text::read::finished;
use crate::text::tree::line_column;

/// Whichever value of a scene is broken, and in whichever way, the message names it at its position.
#[test]
fn every_broken_value_has_its_message() {
    let mut random = Random::new(7);
    let mut random = |below: usize| random.below(below);
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
        assert!(told.contains(&place), "{told}\nnot {place}");
        assert!(told.contains(&format!(": {path} is ")), "{told}");
    }
}

/// Damage at any byte gives a scene or an error with a position inside the text, never a panic. One kind of damage
/// each: what is missing, ended there or put in.
#[test]
fn damaged_text_gives_lines_with_places() {
    let scene = embedded("minimal", &[]).expect("it is valid");
    let json = serde_json::to_string_pretty(&scene).expect("JSON says it");
    let texts: [(&str, Syntax, &[char]); 2] = [
        (LIVER, Syntax::Ron, &['(', '\u{e9}']),
        (&json, Syntax::Json, &['{', '"', '\u{e9}']),
    ];
    for (text, syntax, put_in) in texts {
        let lines = text.lines().count();
        let mut failed = 0;
        for (k, (at, c)) in text.char_indices().enumerate() {
            let (before, after) = (&text[..at], &text[at + c.len_utf8()..]);
            let damaged = match k % (put_in.len() + 2) {
                0 => format!("{before}{after}"),
                1 => before.to_owned(),
                kind => format!("{before}{}{after}", put_in[kind - 2]),
            };
            let read = finished(&damaged, syntax, "test", "".as_ref(), &[]);
            let Err(error) = read else { continue };
            failed += 1;
            let told = error.to_string();
            assert!(!told.contains('\n'), "damage at {at}: {told}");
            let TextError::At { place, .. } = error else {
                panic!("damage at {at}: {told}");
            };
            let (line, _) = place.position.expect("the text is at hand");
            assert!((1..=lines + 1).contains(&line), "damage at {at}: {told}");
        }
        assert!(2 * failed > text.len(), "{failed} damages are reported");
    }
}
