//! Plans of sweeps: broken values, broken texts; their cases are listed.

use std::path::Path;

use crate::broken::broken;
use crate::random::Random;
use crate::scenes::{BLOCK, changed, leftovers};
use crate::watch;

const PLANS: [&str; 2] = [
    r#"(
    version: 1,
    scene: "block.ron",
    set: ["observe.history_rate=500", "pictures=None"],
    design: LatinHypercube(cases: 9, seed: 4),
    keys: [
        (key: "bodies[0].material.youngs_modulus", name: "stiffness", values: LogUniform(5e3, 5e4)),
        (key: "bodies[0].sampling.target", name: "nodes", write: "Nodes({})", whole: true, values: Uniform(60, 200)),
        (key: "cuts[0].path[1].time", name: "stroke", values: Of([0.004, 0.003])),
    ],
    results: [
        Summary(path: "bodies[0].energy.elastic", name: "elastic_J"),
        Largest(column: "kinetic_J"),
        Smallest(column: "smallest_determinant", of: "body", name: "det F"),
    ],
)"#,
    r#"(
    version: 1,
    scene: "block.ron",
    design: List,
    keys: [
        (key: "bodies[0].material.youngs_modulus", values: Of([1e4, 2e4, 3e4])),
        (key: "supports[0].region", values: Of([
            HalfSpace(point: (0, 0, 0.01), normal: (0, 0, 1)),
            HalfSpace(point: (0, 0, 0.015), normal: (0, 0, 1)),
            HalfSpace(point: (0, 0, -1), normal: (0, 0, 1)),
        ])),
    ],
)"#,
];

pub(crate) fn case(folder: &Path, random: &mut Random) -> Option<String> {
    let mut text = (*random.pick(&PLANS)).to_owned();
    for _ in 0..=random.below(3) {
        text = changed(&text, random);
    }
    let mut bytes = text.into_bytes();
    if random.chance(0.2) {
        bytes = broken(bytes, random);
    }
    std::fs::write(folder.join("plan.ron"), &bytes).unwrap();
    std::fs::write(folder.join("block.ron"), BLOCK).unwrap();
    let ended = watch::run(
        folder,
        &["sweep", "plan.ron", "--out", "out", "--list", "--quiet"],
    );
    let named = ["plan.ron", "block.ron", "--set"];
    let fault = ended.fault().or_else(|| {
        let said = named.iter().any(|name| ended.stderr.contains(name));
        (!ended.status.success() && !said).then(|| format!("no file is named: {}", ended.stderr))
    });
    fault.or_else(|| leftovers(folder))
}
