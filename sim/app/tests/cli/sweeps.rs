//! Sweeps: the same table whatever process runs the cases, and nothing but the cases in flight lost by a kill.

use std::collections::BTreeMap;
use std::fs;
use std::time::Duration;

use crate::program::Sandbox;

const SCENE: &str = include_str!("sweeps/block.ron");

const PLAN: &str = include_str!("sweeps/plan.ron");

fn sandbox() -> Sandbox {
    Sandbox::new(&[("block.ron", SCENE), ("plan.ron", PLAN)])
}

/// Runs the program, which must succeed; what it says to people.
fn done(sandbox: &Sandbox, line: &str) -> String {
    let result = sandbox.run(line);
    let told = (result.status, result.stdout.as_str());
    assert_eq!(told, (0, ""), "{result:?}");
    result.stderr
}

fn says(said: &str, part: &str) {
    assert!(said.contains(part), "no `{part}` in {said}");
}

/// The tables of a sweep that is finished.
fn collected(sandbox: &Sandbox) -> BTreeMap<String, Vec<u8>> {
    done(sandbox, "sweep plan.ron --collect");
    let entries = fs::read_dir(sandbox.path().join("out/plan")).unwrap();
    let files = entries.map(|entry| entry.unwrap().path());
    let files = files.filter(|path| path.is_file());
    files
        .map(|path| {
            (
                path.file_name().unwrap().display().to_string(),
                fs::read(path).unwrap(),
            )
        })
        .collect()
}

#[test]
fn whoever_runs_the_cases_the_table_is_the_same() {
    let one = sandbox();
    let said = done(&one, "sweep plan.ron --jobs 1");
    says(&said, "9 cases: 0 finished before, 9 now, 0 failed");
    let table = collected(&one);
    let names: Vec<&str> = table.keys().map(String::as_str).collect();
    let expected = ["cases.jsonl", "quantiles.csv", "results.csv"];
    assert_eq!(names, expected);
    let quantiles = String::from_utf8(table["quantiles.csv"].clone()).unwrap();
    let rows = quantiles.lines();
    let found: Vec<&str> = rows.map(|row| row.split(',').next().unwrap()).collect();
    let expected = "result,healthy,elastic_J,captures,largest kinetic_J,det F";
    assert_eq!(found.join(","), expected);
    let results = String::from_utf8(table["results.csv"].clone()).unwrap();
    let mut rows = csv::Reader::from_reader(results.as_bytes());
    let header = "case,stiffness,nodes,stroke,ended,healthy,warnings,elastic_J,captures,largest kinetic_J,det F,error";
    let found: Vec<&str> = rows.headers().unwrap().iter().collect();
    assert_eq!(found.join(","), header);
    let rows: Vec<csv::StringRecord> = rows.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 9);
    // What is in the table is what the runs say of themselves.
    let folder = one.path().join("out/plan/cases/000004");
    let summary = fs::read(folder.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    let elastic = summary["bodies"][0]["energy"]["elastic"].as_f64().unwrap();
    let bits = |text: &str| text.parse::<f64>().unwrap().to_bits();
    assert_eq!(bits(&rows[3][7]), elastic.to_bits());
    let nodes = summary["bodies"][0]["nodes"].as_f64().unwrap();
    let asked: f64 = rows[3][2].parse().unwrap();
    assert!((nodes / asked - 1.0).abs() < 0.5, "{nodes}");
    let history = fs::read_to_string(folder.join("history.csv")).unwrap();
    let kinetic = history.lines().skip(1).map(|line| line.split(',').nth(3));
    let kinetic = kinetic.map(|text| text.unwrap().parse::<f64>().unwrap());
    let kinetic = kinetic.fold(0.0, f64::max);
    assert_eq!(bits(&rows[3][9]), kinetic.to_bits());

    let two = sandbox();
    done(&two, "sweep plan.ron --jobs 2 --threads 2 --quiet");
    assert_eq!(collected(&two), table, "two at a time");
    let tasks = sandbox();
    done(&tasks, "sweep plan.ron --list");
    for case in [3, 1, 9, 2, 4, 8, 5, 7, 6] {
        let line = format!("sweep plan.ron --case {case} --threads 1 --quiet");
        done(&tasks, &line);
    }
    assert_eq!(collected(&tasks), table, "one by one, in any order");
}

#[test]
fn what_is_finished_is_not_run_again_and_what_changed_is() {
    let sandbox = sandbox();
    let plan = |stiffness: &str, density: &str, results: &str| {
        format!(
            "(version: 1, scene: \"block.ron\", design: List, set: [\"bodies[0].material.density={density}\"], \
             keys: [(key: \"bodies[0].material.youngs_modulus\", values: Of([1e4, {stiffness}, 3e4])), \
             (key: \"supports[0].region\", values: Of([HalfSpace(point: (0, 0, 0.01), normal: (0, 0, 1)), \
             HalfSpace(point: (0, 0, 0.01), normal: (0, 0, 1)), HalfSpace(point: (0, 0, -1), normal: (0, 0, 1))]))]\
             {results})"
        )
    };
    let write = |plan: String| fs::write(sandbox.path().join("plan.ron"), plan).unwrap();
    let run = |more: &str| {
        let result = sandbox.run(&format!("sweep plan.ron {more}"));
        assert_eq!(result.status, 1, "{result:?}");
        result.stderr
    };
    write(plan("2e4", "1000", ""));
    // Everything is held in the third, so that nothing resists motion.
    let said = run("");
    says(&said, "3 cases: 0 finished before, 3 now, 1 failed of all");
    let why = "case 3 failed: body 'body': nothing resists motion";
    says(&said, why);
    assert!(said.ends_with("runs the failed ones again\n"), "{said}");
    let said = run("");
    says(&said, "3 cases: 3 finished before, 0 now, 1 failed of all");
    says(&said, why);
    // A disk that was full leaves a file of nothing: its case is run again, not collected blank.
    let summary = "out/plan/cases/000001/summary.json";
    fs::write(sandbox.path().join(summary), "").unwrap();
    let again = "3 cases: 2 finished before, 1 now, 1 failed of all";
    says(&run(""), again);
    says(&run("--retry"), again);
    let said = run("--case 3");
    says(&said, "error: case 3: body 'body': nothing resists");
    let collect = done(&sandbox, "sweep plan.ron --collect");
    says(&collect, "3 cases: 2 ended, ");
    let table = || fs::read_to_string(sandbox.path().join("out/plan/results.csv")).unwrap();
    let last = table().lines().last().unwrap().to_owned();
    // No end, no health, no results.
    says(&last, ",0,0,,");
    says(&last, "nothing resists motion");

    // Another value: its case alone. Another result: no case. Another scene: all of them.
    write(plan("2.5e4", "1000", ""));
    says(&run(""), "3 cases: 2 finished before, 1 now");
    let results = ", results: [Summary(path: \"stepping.steps\")]";
    write(plan("2.5e4", "1000", results));
    says(&run(""), "3 cases: 3 finished before, 0 now");
    done(&sandbox, "sweep plan.ron --collect");
    let table = table();
    let header = table.lines().next().unwrap();
    assert!(header.starts_with("case,bodies[0].material.youngs_modulus,supports[0].region,ended,"));
    assert!(header.ends_with("warnings,stepping.steps,error"));
    write(plan("2.5e4", "1100", ""));
    let collect = sandbox.run("sweep plan.ron --collect");
    says(&collect.stderr, "no case in out/plan is finished");
    says(&run(""), "3 cases: 0 finished before, 3 now");
}

#[cfg(unix)]
#[test]
fn a_killed_sweep_loses_the_cases_in_flight_alone() {
    let undisturbed = sandbox();
    done(&undisturbed, "sweep plan.ron --jobs 2 --quiet");
    let table = collected(&undisturbed);
    let sandbox = sandbox();
    let finished = || {
        let cases = (1..=9).map(|case| format!("out/plan/cases/{case:06}/outcome.json"));
        cases
            .filter(|name| sandbox.path().join(name).exists())
            .count()
    };
    let mut kills = 0;
    for wanted in [1, 3, 6] {
        let mut child = sandbox.start("sweep plan.ron --jobs 2 --quiet");
        while finished() < wanted && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        let before = finished();
        kills += usize::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(finished() >= before, "what was finished stays");
    }
    assert!(kills > 0, "it was never killed on its way");
    let kept = finished();
    let said = done(&sandbox, "sweep plan.ron --jobs 2");
    let last = said.lines().last().unwrap();
    let before: usize = last.split(' ').nth(2).unwrap().parse().unwrap();
    // One that was in flight may have come to its end since.
    assert!(before >= kept, "{kept}: {said}");
    assert_eq!(collected(&sandbox), table);
    let parts = |name: &String| name.ends_with(".part");
    assert!(!sandbox.files().iter().any(parts));
}
