//! A sweep plan's text: what is valid lists its cases.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use phyxel_cli::sweep::Plan;

fuzz_target!(|text: &str| {
    if let Ok(plan) = Plan::from_text(text, Path::new("plan.ron")) {
        assert!(plan.case_count() > 0, "a valid plan without a case");
    }
});
