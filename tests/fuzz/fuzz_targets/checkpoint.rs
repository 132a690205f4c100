//! A state whose bytes were changed: it is refused, or the world steps on from it.
#![no_main]

use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use phyxel::{World, WorldState};

const SCENE: &str = include_str!("../../../sim/app/tests/attack/kept.ron");

/// A body as built, and the bytes of its state when it has been cut.
fn whole() -> &'static (World, Vec<u8>) {
    static WHOLE: OnceLock<(World, Vec<u8>)> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let scene = phyxel_scene::from_text(SCENE, "kept.ron", "", &[]).expect("it is valid");
        let new = World::new(scene).expect("it can be built");
        let mut world = new.clone();
        world.settle().expect("it need not");
        world.play(0.006, |_| ()).expect("it runs");
        let bytes = postcard::to_stdvec(&world.state()).expect("it can be written");
        (new, bytes)
    })
}

fuzz_target!(|changes: Vec<(u16, u8)>| {
    let (new, whole) = whole();
    let mut bytes = whole.clone();
    for (place, byte) in changes {
        let place = usize::from(place) * whole.len() / (usize::from(u16::MAX) + 1);
        bytes[place] = byte;
    }
    let Ok(state) = postcard::from_bytes::<WorldState>(&bytes) else {
        return;
    };
    let mut world = new.clone();
    if world.restore(state, |_, _| ()).is_ok() {
        let _ = world.step();
    }
});
