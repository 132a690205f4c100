//! Settings are read as they were written.

use phyxel_discretize::glam::DVec3;
use phyxel_discretize::{Refinement, RepairSettings, SampleSettings};

#[test]
fn settings_survive_writing() {
    let mut settings = SampleSettings::nodes(1234);
    settings.grading.refinements.push(Refinement {
        from: DVec3::X,
        to: DVec3::Y,
        radius: 0.25,
        factor: 0.5,
    });
    let repair = RepairSettings {
        largest_hole: 0.03,
        ..RepairSettings::default()
    };
    let text = ron::to_string(&(&settings, &repair)).expect("plain data");
    let read: (SampleSettings, RepairSettings) = ron::from_str(&text).expect("what was written");
    assert_eq!(read, (settings, repair));
}
