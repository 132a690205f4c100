//! Proofs: what takes too long for a test, or shows an order by sizes. `cargo run --release -p benches -- prove`.

mod bending;
mod cuts;
mod dynamics;
mod elastic;
mod geodesics;
mod grids;
mod indentation;
mod invariance;
mod own;
mod real_meshes;
mod scattered;
mod scenes;
mod stretch;
mod studies;
mod touch;

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use crate::StudyError;
use crate::batch::on_threads;

/// A claim and the code that checks it.
#[derive(Debug, Clone, Copy)]
pub struct Claim {
    /// Name on the command line.
    pub name: &'static str,
    /// What is claimed, in one line.
    pub about: &'static str,
    run: fn(&mut Proof),
}

/// The claims of a table: name, function, what is claimed.
macro_rules! claims {
    ($($name:literal $run:path, $about:literal;)*) => {
        &[$(Claim { name: $name, about: $about, run: $run }),*]
    };
}

/// Every claim, those that take longest first, so that all cores end together.
pub const CLAIMS: &[Claim] = claims! {
    "chapter6" studies::chapter6, "the study chapter6: three bodies, cut twice";
    "cracks" scenes::cracks, "a blade's slit, centre crack and penny: mouths, works of modes I to III";
    "splat-holes" studies::splat_holes, "the study splat: no hole, fewer errors with more surfels, inside tests";
    "matrix" scenes::matrix, "a dozen scenes of the matrix keep every limit";
    "grid" grids::grid, "embedded scenes with the enrichment grid end well at three sizes";
    "hertz" studies::hertz, "the study hertz: a sphere on a block, against finite elements and a half-space";
    "invariance" invariance::invariance, "what a cut releases does not depend on how a scene is given";
    "field" studies::field, "the study field: displacements are read nearer to finite elements than nodes have them";
    "opening" studies::opening, "the study opening: a dynamic cut at finite strain, against finite elements";
    "contact" studies::contact, "the study contact: flanks, spheres, bars, sliding";
    "touch" touch::touch, "hard cases of bodies and flanks that touch";
    "real-meshes" real_meshes::real_meshes, "real organ meshes are sampled well at four sizes";
    "edge-crack" cuts::edge_crack, "an edge crack has the stress intensity of Tada, Paris, Irwin";
    "griffith" scenes::griffith, "a cut releases the energy release rate, and no update adds energy";
    "indentation" indentation::indentation, "forces of a pressed sphere are those of finite elements";
    "hertz-quarter" indentation::hertz_quarter, "a large block gives the force and pressure of Hertz";
    "cantilever" bending::cantilever, "tip deflection of beams, small strain, three Poisson ratios; bending of turned meshes";
    "large-deformation" elastic::large_deformation, "a manufactured large deformation converges";
    "energy" dynamics::energy, "a bending beam keeps its energy over 1e5 steps";
    "crack" studies::crack, "the study crack: the default is nearest to the handbook";
    "viscosity" scenes::viscosity, "cut bodies that creep close their energy, by every scheme";
    "ring" scenes::ring, "a ring that is cut through falls apart, whatever its stiffness and the blade's angle";
    "check" scenes::check, "check accepts the random scenes that run, and no others";
    "step-limit" scenes::step_limit, "the step is below the limit of an independent estimate";
    "cook" scenes::cook, "Cook's membrane rises as it should";
    "bending" bending::bending, "pure bending converges";
    "large-deflection" bending::large_deflection, "a cantilever at large deflection";
    "control" bending::control, "how much the control coefficient matters";
    "patch" elastic::patch, "patch tests on four clouds";
    "soft-modes" elastic::soft_modes, "a free body has six soft modes";
    "dilatation" elastic::dilatation, "mean dilatation against locking";
    "wave" dynamics::wave, "a standing wave converges in space";
    "dropped-sphere" dynamics::dropped_sphere, "a dropped sphere bounces with a closed audit";
    "geodesics-random" geodesics::geodesics_random, "factors around random strips are those of sampled shortest paths";
    "geodesics-twisted" geodesics::geodesics_twisted, "factors around twisted strips are those of sampled shortest paths";
    "figures" studies::figures, "the study figures: each is drawn, table 1 has its pattern";
    "stretch" stretch::stretch, "a stretched cube with free sides has the stress of every material's closed form";
    "splat-curvature" studies::splat_curvature, "the study splat: where following curvature gains";
    "scattered" scattered::scattered, "values at 100,000 places from 10,000 random points";
    "random-seed" scenes::random_seed, "random scenes depend on seed and number alone";
    "random-keys" scenes::random_keys, "random scenes draw every key of scenes but those that are listed";
    "command-line" studies::command_line, "studies are listed, a misspelt one is named";
    "own" own::own, "the studies' own code: finite elements, exact cracks, tables, this command";
    "pipe" studies::pipe, "a reader of the output may leave";
};

/// A figure and the limit that it must keep.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// What it is, the figure and the limit.
    text: String,
    /// Whether the limit is kept.
    pub holds: bool,
}

/// What a claim has shown so far. Numbers that are NaN keep no limit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Proof {
    /// Each figure with its limit, in the order in which they were found.
    pub checks: Vec<Check>,
}

impl Proof {
    fn add(&mut self, what: impl fmt::Display, figure: &str, holds: bool) {
        let text = format!("{what}: {figure}");
        self.checks.push(Check { text, holds });
    }

    /// `value <= limit`.
    pub fn below(&mut self, what: impl fmt::Display, value: f64, limit: f64) {
        let figure = format!("{} <= {}", short(value), short(limit));
        self.add(what, &figure, value <= limit);
    }

    /// `value >= limit`.
    pub fn above(&mut self, what: impl fmt::Display, value: f64, limit: f64) {
        let figure = format!("{} >= {}", short(value), short(limit));
        self.add(what, &figure, value >= limit);
    }

    /// `|value - expected| <= allowed`.
    pub fn within(&mut self, what: impl fmt::Display, value: f64, expected: f64, allowed: f64) {
        let holds = (value - expected).abs() <= allowed;
        let [value, known] = [value, expected].map(short);
        let figure = format!("{value} = {known} within {}", short(allowed));
        self.add(what, &figure, holds);
    }

    /// That something without a limit of its own is so.
    pub fn holds(&mut self, what: impl fmt::Display, holds: bool) {
        self.add(what, if holds { "yes" } else { "no" }, holds);
    }

    /// That a study found nothing that breaks its limits, which it names itself.
    pub fn none(&mut self, what: impl fmt::Display, breaches: &[String]) {
        let figure = format!("{} broken limits {breaches:?}", breaches.len());
        self.add(what, &figure, breaches.is_empty());
    }
}

/// A number in a few characters, whatever its size.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        format!("{value:.5}")
    } else {
        format!("{value:.2e}")
    }
}

/// A claim that was checked.
#[derive(Debug)]
pub struct Outcome {
    /// The claim.
    pub claim: Claim,
    /// Its figures.
    pub proof: Proof,
    /// How long it took.
    pub time: Duration,
}

impl Outcome {
    /// Whether there are figures, all of which keep their limits.
    pub fn holds(&self) -> bool {
        !self.proof.checks.is_empty() && self.proof.checks.iter().all(|check| check.holds)
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.holds() { "ok" } else { "FAILED" };
        let seconds = self.time.as_secs_f64();
        let Claim { name, about, .. } = self.claim;
        writeln!(f, "{name} {verdict} in {seconds:.1} s: {about}")?;
        for Check { text, holds } in &self.proof.checks {
            writeln!(f, "    {text}{}", if *holds { "" } else { "  FAILED" })?;
        }
        Ok(())
    }
}

/// Checks claims, `jobs` at a time with one thread each; `ended` sees each outcome as it is there. A claim
/// that panics has failed. Whether all hold.
///
/// # Errors
/// If threads cannot be started, and what `ended` returns.
pub fn run(
    claims: &[Claim],
    jobs: usize,
    mut ended: impl FnMut(&Outcome) -> Result<(), StudyError>,
) -> Result<bool, StudyError> {
    let mut all = true;
    on_threads(claims, jobs, check, |_, outcome| {
        all &= outcome.holds();
        ended(&outcome)
    })?;
    Ok(all)
}

fn check(claim: &Claim) -> Outcome {
    let start = Instant::now();
    let mut proof = Proof::default();
    let ran = catch_unwind(AssertUnwindSafe(|| (claim.run)(&mut proof)));
    // The panic's own message stands on stderr.
    if ran.is_err() {
        proof.holds("it comes to its end", false);
    }
    Outcome {
        claim: *claim,
        proof,
        time: start.elapsed(),
    }
}

pub(crate) mod checks {
    use super::*;

    pub(crate) fn a_claim_that_is_wrong_panics_or_shows_nothing_fails() {
        let claim = |run| Claim {
            name: "test",
            about: "a test",
            run,
        };
        let right = claim(|proof| proof.below("one", 1.0, 1.0));
        let wrong = claim(|proof| proof.within("NaN", f64::NAN, 1.0, 1.0));
        let empty = claim(|_| {});
        let panics = claim(|proof| {
            proof.above("one", 1.0, 1.0);
            panic!("as it should");
        });
        assert!(run(&[right], 2, |_| Ok(())).unwrap());
        for claim in [wrong, empty, panics] {
            assert!(!run(&[right, claim], 2, |_| Ok(())).unwrap());
        }
    }
}
