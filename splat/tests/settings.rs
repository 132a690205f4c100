//! Settings are read as they were written.
#![cfg(feature = "serde")]

use phyxel_splat::{Measure, RadiusRule, TissueSettings};

#[test]
fn settings_survive_writing() {
    let mut settings = TissueSettings::default();
    settings.bind.neighbors += 3;
    settings.skin_density = Some(1e4);
    settings.radius = RadiusRule::Mapped {
        measure: Measure::Curvature,
        neighbors: 9,
        least: 0.001,
        most: 0.004,
        at_cuts: true,
    };
    let text = ron::to_string(&settings).expect("plain data");
    let read: TissueSettings = ron::from_str(&text).expect("what was written");
    assert_eq!(read, settings);
}
