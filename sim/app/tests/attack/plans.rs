//! Plans of sweeps: broken values, broken texts; their cases are listed.

use std::path::Path;

use crate::scenes::{BLOCK, leftovers, spoiled};
use crate::watch;
use testkit::cloud::Random;

const PLANS: [&str; 2] = [
    include_str!("ranges.plan.ron"),
    include_str!("lists.plan.ron"),
];

pub(crate) fn case(folder: &Path, random: &mut Random) -> Option<String> {
    let text = *random.pick(&PLANS);
    let bytes = spoiled(text, random);
    std::fs::write(folder.join("plan.ron"), &bytes).unwrap();
    std::fs::write(folder.join("block.ron"), BLOCK).unwrap();
    let ended = watch::run(folder, "sweep plan.ron --out out --list --quiet");
    let named = ["plan.ron", "block.ron", "--set"];
    let fault = ended.fault().or_else(|| {
        let said = named.iter().any(|name| ended.stderr.contains(name));
        (!ended.status.success() && !said).then(|| format!("no file is named: {}", ended.stderr))
    });
    fault.or_else(|| leftovers(folder))
}
