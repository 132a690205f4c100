//! Prints the table of all forms on all benchmarks: ratio to the reference, and the times of the set-up
//! (of `PairFactors`, once per body), of the cut's factors and of the rows after them.
//!
//! `cargo run -p tests --example cut_table` (the development profile is optimised); with `fine` as an
//! argument also the finer bodies, which take some minutes.
#![allow(
    clippy::print_stdout,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::unwrap_used,
    clippy::missing_assert_message,
    reason = "prints a table; the rest are test helpers"
)]

#[path = "../cut_accuracy/body.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod body;
#[path = "../cut_accuracy/problems.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod problems;

use body::Form;
use glam::DVec3;
use phyxel_enrich::{GridForm, Rule};
use problems::{Penny, Ratios};

const FORMS: [Form; 7] = [
    Form::Rule(Rule::Detour),
    Form::Rule(Rule::Visibility),
    Form::Rule(Rule::Transparency {
        kappa: 0.5,
        exponent: 2.0,
    }),
    Form::Grid(GridForm::OneSided),
    Form::Grid(GridForm::OneSidedMean),
    Form::Grid(GridForm::Product),
    Form::Pieces,
];

/// Eight places of the tip and the line relative to the nodes.
const SHIFTS: [[f64; 2]; 8] = [
    [0.0, 0.25],
    [0.25, 0.25],
    [0.5, 0.25],
    [0.75, 0.25],
    [0.0, 0.4],
    [0.25, 0.4],
    [0.5, 0.4],
    [0.75, 0.4],
];

fn show(name: &str, form: Form, runs: &[Option<Ratios>]) {
    let known: Vec<Ratios> = runs.iter().copied().flatten().collect();
    if known.is_empty() {
        println!("{name:34} {:22} refused", form.name());
        return;
    }
    let n = known.len() as f64;
    let mean = |f: fn(&Ratios) -> f64| known.iter().map(f).sum::<f64>() / n;
    let spread = |f: fn(&Ratios) -> f64| {
        let m = mean(f);
        (known.iter().map(|r| (f(r) - m).powi(2)).sum::<f64>() / n).sqrt()
    };
    println!(
        "{name:34} {:22} {:7.3} ({:.3})  {:7.3} ({:.3})  {:8.2} ms {:8.2} ms {:8.2} ms",
        form.name(),
        mean(|r| r.first),
        spread(|r| r.first),
        mean(|r| r.second),
        spread(|r| r.second),
        1e3 * mean(|r| r.seconds[0]),
        1e3 * mean(|r| r.seconds[1]),
        1e3 * mean(|r| r.seconds[2]),
    );
}

fn show_penny(name: &str, form: Form, runs: &[Option<Penny>]) {
    let faces: Vec<Option<Ratios>> = runs.iter().map(|run| run.map(|run| run.face)).collect();
    let others: Vec<Option<Ratios>> = runs.iter().map(|run| run.map(|run| run.others)).collect();
    show(&format!("{name}: face, middle"), form, &faces);
    show(&format!("{name}: by work, nodes"), form, &others);
}

fn main() {
    let fine = std::env::args().any(|a| a == "fine");
    println!(
        "{:34} {:22} first (sd)       second (sd)        set-up     factors        rows",
        "benchmark", "form"
    );
    for form in FORMS {
        let edge = |cells, jitter| -> Vec<Option<Ratios>> {
            SHIFTS
                .iter()
                .map(|&s| problems::edge_crack(cells, jitter, s, form))
                .collect()
        };
        show("edge crack a=8: K_I, mouth", form, &edge(20, 0.0));
        show("edge crack a=8, jittered", form, &edge(20, 0.2));
        if fine {
            show("edge crack a=16: K_I, mouth", form, &edge(40, 0.0));
            show("edge crack a=16, jittered", form, &edge(40, 0.2));
            show(
                "centre crack a=12: K_I, opening",
                form,
                &[problems::centre_crack(60, [0.25, 0.2], form)],
            );
            show(
                "gravity slit 64: sag, mouth",
                form,
                &[problems::gravity_slit(64, form)],
            );
            let penny = problems::penny(31, 0.0, DVec3::ZERO, form);
            show_penny("penny a=5.4", form, &[penny]);
        }
        show(
            "centre crack a=6: K_I, opening",
            form,
            &[problems::centre_crack(30, [0.25, 0.2], form)],
        );
        show(
            "inclined crack a=5: K_I, K_II",
            form,
            &[problems::inclined_crack(50, 0.0, form)],
        );
        show(
            "gravity slit 32: sag, mouth",
            form,
            &[problems::gravity_slit(32, form)],
        );
        let pennies = [20, 21, 22, 23].map(|cells| problems::penny(cells, 0.0, DVec3::ZERO, form));
        show_penny("penny a=3.5 to 4", form, &pennies);
    }
}
