//! A mesh file's bytes: what is read can be repaired or is refused, and a repaired surface bounds a volume.
#![no_main]

use libfuzzer_sys::fuzz_target;
use phyxel_discretize::{RepairSettings, parse_mesh, repair};

fuzz_target!(|bytes: &[u8]| {
    let Ok(file) = parse_mesh(bytes) else { return };
    let Ok((mesh, _)) = repair(&file.mesh, &RepairSettings::default()) else {
        return;
    };
    assert!(mesh.volume() > 0.0, "a body's volume is {}", mesh.volume());
});
