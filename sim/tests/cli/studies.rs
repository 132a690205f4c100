//! The studies, in their quick form.

use serde_json::Value;

use crate::program::Sandbox;

/// Runs a study and returns its findings; tables, plots and the page must be there.
fn study(name: &str) -> Value {
    let sandbox = Sandbox::empty();
    let result = sandbox.run(&[
        "study", name, "--quick", "--quiet", "--json", "--out", "found",
    ]);
    assert_eq!((result.status, result.stderr.as_str()), (0, ""), "{name}");
    let findings: Value = serde_json::from_str(&result.stdout).expect("one JSON object");
    let files = sandbox.files();
    for file in findings["files"].as_array().expect("a list") {
        let file = file.as_str().expect("a path").to_owned();
        assert!(files.contains(&file), "{file} is not there");
    }
    let page = std::fs::read_to_string(sandbox.path().join("found/index.html")).unwrap();
    let plots = findings["report"]["plots"].as_array().expect("a list");
    assert_eq!(page.matches("<svg").count(), plots.len());
    for plot in plots {
        for series in plot["series"].as_array().expect("a list") {
            let legend = series["name"].as_str().expect("a name");
            assert!(page.contains(legend), "{legend}");
        }
    }
    findings
}

/// The entries of a column in the rows whose first entry is `method`.
fn column(findings: &Value, heading: &str, method: &str) -> Vec<f64> {
    let table = &findings["report"]["tables"][0];
    let columns = table["columns"].as_array().expect("a list");
    let at = columns
        .iter()
        .position(|column| column["name"] == heading)
        .expect("the column is there");
    let rows = table["rows"].as_array().expect("a list");
    rows.iter()
        .filter(|row| row[0].as_str().is_some_and(|name| name.contains(method)))
        .filter_map(|row| row[at].as_f64())
        .collect()
}

#[test]
fn gradient_study_orders_the_methods_as_theory_does() {
    let findings = study("gradient");
    for method in ["Aras", "conservative", "linear", "quadratic"] {
        let errors = column(&findings, "error", method);
        assert!(
            errors[1] < errors[0] && errors[0] < 0.5,
            "{method}: {errors:?}"
        );
        let order = column(&findings, "order", method)[0];
        assert!(order > 0.9, "{method}: order {order}");
    }
    let fine = |method| column(&findings, "error", method)[1];
    assert!(fine("quadratic") < fine("linear"));
    // Only the conservative stencils sum to the surface.
    let off = |method| column(&findings, "conservation", method)[1];
    assert!(off("conservative") < 1e-10, "{}", off("conservative"));
    assert!(off("Aras") > 0.1, "{}", off("Aras"));
}

#[test]
fn beam_study_comes_near_the_finite_elements() {
    let findings = study("beam");
    let table = &findings["report"]["tables"][0];
    let rows = table["rows"].as_array().expect("a list");
    assert_eq!(rows.len(), 6, "three ratios, two spacings");
    for pair in rows.chunks(2) {
        let errors: Vec<f64> = pair.iter().filter_map(|row| row[3].as_f64()).collect();
        // 1.2 % at nu 0.3 with four cells over the depth of a lattice that fits the beam.
        assert!(errors[1].abs() < 4.0, "{pair:?}");
        assert!(errors[1].abs() < errors[0].abs(), "{pair:?}");
    }
}

#[test]
fn time_study_measures_bodies_of_the_size_asked_for() {
    let findings = study("time");
    let rows = findings["report"]["tables"][0]["rows"]
        .as_array()
        .expect("a list");
    for (row, asked) in rows.iter().zip([300.0, 1408.0]) {
        let nodes = row[0].as_f64().expect("a count");
        assert!((nodes / asked - 1.0).abs() < 0.05, "{row}");
        assert!(row[7].as_f64().is_some_and(|speed| speed > 0.0), "{row}");
    }
}

#[test]
fn studies_are_listed_and_a_misspelt_one_is_named() {
    let sandbox = Sandbox::empty();
    let list = sandbox.run(&["study", "--list"]);
    assert!(list.stdout.starts_with("gradient "), "{}", list.stdout);
    assert_eq!(sandbox.files(), Vec::<String>::new());
}
