//! Plans of sweeps that cannot be used.

use super::{Case, given};

const PLAN: &str = include_str!("plan.ron");

/// The valid plan with `from` replaced.
pub(super) fn changed(name: &str, from: &str, to: &str) -> Case {
    assert!(PLAN.contains(from), "{name}: the plan has no '{from}'");
    whole(name, &PLAN.replacen(from, to, 1), "")
}

fn whole(name: &str, plan: &str, more: &str) -> Case {
    let line = format!("sweep plan.ron --out results/here {more}");
    given(&format!("plan: {name}"), &[("plan.ron", plan)], &line)
}

pub(super) fn plan_cases() -> Vec<Case> {
    vec![
        given("plan: not there", super::NOTHING, "sweep plan.ron"),
        changed(
            "no keys",
            &PLAN[PLAN.find("(key").unwrap()..PLAN.find("    ],").unwrap()],
            "",
        ),
        given(
            "plan: lists that do not match",
            &[(
                "plan.ron",
                "(version: 1, scene: \"block\", design: List, keys: [\n\
                 (key: \"bodies[0].damping\", values: Of([1, 2])),\n\
                 (key: \"bodies[0].damping_ratio\", values: Of([0, 0.1, 0.2]))])",
            )],
            "sweep plan.ron",
        ),
        whole("no such case", PLAN, "--case 21"),
        whole("case 0", PLAN, "--case 0"),
    ]
}
