//! A scene's text: what is valid reads back as the same.
#![no_main]

use libfuzzer_sys::fuzz_target;
use phyxel_scene::{from_text, to_ron};

fuzz_target!(|text: &str| {
    let Ok(scene) = from_text(text, "scene.ron", "", &[]) else {
        return;
    };
    let again = from_text(&to_ron(&scene), "written.ron", "", &[]);
    assert_eq!(again.as_ref().ok(), Some(&scene), "{again:?}");
});
