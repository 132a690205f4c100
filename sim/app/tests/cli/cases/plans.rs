//! Plans of sweeps that cannot be used.

use super::{Case, given};

const PLAN: &str = "(\n    version: 1,\n    scene: \"block\",\n    set: [\"pictures=None\"],\n    \
     design: LatinHypercube(cases: 20, seed: 1),\n    keys: [\n        \
     (key: \"bodies[0].material.youngs_modulus\", values: LogUniform(2e3, 2e4)),\n        \
     (key: \"bodies[0].sampling.target\", name: \"nodes\", write: \"Nodes({})\", whole: true, \
     values: Uniform(100, 200)),\n    ],\n    results: [Summary(path: \"stepping.steps\")],\n)\n";

pub(super) fn plan_cases() -> Vec<Case> {
    let plan = |name: &str, from: &str, to: &str| {
        assert!(PLAN.contains(from), "{name}: the plan has no '{from}'");
        let text = PLAN.replacen(from, to, 1);
        let arguments = ["sweep", "plan.ron", "--out", "results/here"];
        given(
            &format!("plan: {name}"),
            &[("plan.ron", text.as_str())],
            &arguments,
        )
    };
    let whole = |name: &str, more: &[&str]| {
        let arguments = [&["sweep", "plan.ron", "--out", "results/here"], more].concat();
        given(&format!("plan: {name}"), &[("plan.ron", PLAN)], &arguments)
    };
    vec![
        given("plan: not there", &[], &["sweep", "plan.ron"]),
        plan("of a later version", "version: 1", "version: 2"),
        plan("misspelt key", "design:", "desing:"),
        plan("misspelt range", "Uniform(100", "Unifrom(100"),
        plan(
            "no keys",
            &PLAN[PLAN.find("(key").unwrap()..PLAN.find("    ],").unwrap()],
            "",
        ),
        plan("no such scene", "\"block\"", "\"blokc\""),
        plan("no scene beside it", "\"block\"", "\"block.ron\""),
        plan("no scene at all", "\"block\"", "\"block.txt\""),
        plan("bad change", "pictures=None", "pictures"),
        plan("change of nothing", "pictures=None", "bodies[1].damping=2"),
        plan(
            "change out of range",
            "pictures=None",
            "bodies[0].damping=-2",
        ),
        plan("no key path", "bodies[0].sampling.target", "bodies.0"),
        plan("key of nothing", "material.youngs", "material.young"),
        plan("value out of range", "LogUniform(2e3", "Uniform(-2e3"),
        plan(
            "value of another kind",
            "LogUniform(2e3, 2e4)",
            "Of([1e3, Soft])",
        ),
        plan("range turned round", "LogUniform(2e3", "LogUniform(2e5"),
        plan("logarithm of nothing", "LogUniform(2e3", "LogUniform(0"),
        plan("no values", "LogUniform(2e3, 2e4)", "Of([])"),
        plan("value without a position", "Nodes({})", "Nodes(100)"),
        plan(
            "range in a grid",
            "LatinHypercube(cases: 20, seed: 1)",
            "Grid",
        ),
        plan("no cases", "cases: 20", "cases: 0"),
        plan("two columns of a name", "\"nodes\"", "\"stepping.steps\""),
        plan("reserved column", "\"nodes\"", "\"healthy\""),
        plan("path of nothing", "stepping.steps", "stepping."),
        plan(
            "table elsewhere",
            "Summary(path: \"stepping.steps\")",
            "Largest(column: \"force_N\", file: \"../tools.csv\")",
        ),
        given(
            "plan: lists that do not match",
            &[(
                "plan.ron",
                "(version: 1, scene: \"block\", design: List, keys: [\n\
                 (key: \"bodies[0].damping\", values: Of([1, 2])),\n\
                 (key: \"bodies[0].damping_ratio\", values: Of([0, 0.1, 0.2]))])",
            )],
            &["sweep", "plan.ron"],
        ),
        whole("no such case", &["--case", "21"]),
        whole("case 0", &["--case", "0"]),
    ]
}
