//! Proofs: what takes too long for a test, or shows an order by sizes. `cargo run --release -p benches -- prove`.

mod bending;
mod cuts;
mod dynamics;
mod elastic;
mod geodesics;
mod grids;
mod indentation;
mod own;
mod real_meshes;
mod scattered;
mod scenes;
mod studies;
mod touch;
mod traps;

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

/// Every claim, those that take longest first, so that all cores end together.
pub const CLAIMS: &[Claim] = &[
    Claim {
        name: "chapter6",
        about: "the study chapter6: three bodies, cut twice",
        run: studies::chapter_6_cuts_three_bodies_twice,
    },
    Claim {
        name: "cracks",
        about: "a blade's slit, centre crack and penny: mouths, works of modes I to III",
        run: scenes::cracks_by_a_blade,
    },
    Claim {
        name: "splat-holes",
        about: "the study splat: no hole, fewer errors with more surfels",
        run: studies::splat_study_finds_no_hole_in_the_default,
    },
    Claim {
        name: "matrix",
        about: "a dozen scenes of the matrix keep every limit",
        run: scenes::matrix,
    },
    Claim {
        name: "grid",
        about: "embedded scenes with the enrichment grid end well at three sizes",
        run: grids::every_embedded_scene_ends_well_with_the_grid_at_three_sizes,
    },
    Claim {
        name: "hertz",
        about: "the study hertz: a sphere on a block, against finite elements and a half-space",
        run: studies::hertz_study_meets_the_block_and_the_half_space,
    },
    Claim {
        name: "field",
        about: "the study field: displacements are read nearer to finite elements than nodes have them",
        run: studies::field_study_reads_nearer_than_nodes_are,
    },
    Claim {
        name: "contact",
        about: "the study contact: flanks, spheres, bars, sliding",
        run: studies::contact_study_meets_closed_forms,
    },
    Claim {
        name: "touch",
        about: "hard cases of bodies and flanks that touch",
        run: touch::what_touches_holds,
    },
    Claim {
        name: "real-meshes",
        about: "real organ meshes are sampled well at four sizes",
        run: real_meshes::real_meshes_sample_well,
    },
    Claim {
        name: "edge-crack",
        about: "an edge crack has the stress intensity of Tada, Paris, Irwin",
        run: cuts::tada_paris_irwin_edge_crack,
    },
    Claim {
        name: "griffith",
        about: "a cut releases the energy release rate, and no update adds energy",
        run: scenes::energy_release_rate,
    },
    Claim {
        name: "indentation",
        about: "forces of a pressed sphere are those of finite elements",
        run: indentation::block_indentation_meets_finite_elements,
    },
    Claim {
        name: "hertz-quarter",
        about: "a large block gives the force and pressure of Hertz",
        run: indentation::hertz_on_a_quarter_of_a_large_block,
    },
    Claim {
        name: "cantilever",
        about: "tip deflection of beams, small strain, three Poisson ratios",
        run: bending::cantilever_small_strain,
    },
    Claim {
        name: "large-deformation",
        about: "a manufactured large deformation converges",
        run: elastic::large_deformation_converges,
    },
    Claim {
        name: "energy",
        about: "a bending beam keeps its energy over 1e5 steps",
        run: dynamics::energy_of_a_bending_beam_stays_over_1e5_steps,
    },
    Claim {
        name: "crack",
        about: "the study crack: the default is nearest to the handbook",
        run: studies::crack_study_finds_the_default_nearest_to_the_handbook,
    },
    Claim {
        name: "set-up-after",
        about: "a set-up after the cut opens it",
        run: cuts::a_set_up_after_the_cut_opens_it_and_the_trap_glues_it,
    },
    Claim {
        name: "pieces",
        about: "pieces of through cuts feel nothing of each other",
        run: cuts::pieces_of_through_cuts_feel_nothing_of_each_other,
    },
    Claim {
        name: "check",
        about: "check accepts the random scenes that run, and no others",
        run: scenes::check_accepts_what_runs,
    },
    Claim {
        name: "step-limit",
        about: "the step is below the limit of an independent estimate",
        run: scenes::step_below_its_limit,
    },
    Claim {
        name: "cook",
        about: "Cook's membrane rises as it should",
        run: scenes::cooks_membrane,
    },
    Claim {
        name: "bending",
        about: "pure bending converges",
        run: bending::bending_converges,
    },
    Claim {
        name: "large-deflection",
        about: "a cantilever at large deflection",
        run: bending::cantilever_large_deflection,
    },
    Claim {
        name: "control",
        about: "how much the control coefficient matters",
        run: bending::cantilever_against_the_control_coefficient,
    },
    Claim {
        name: "patch",
        about: "patch tests on five clouds",
        run: elastic::patch_test_with_affine_boundary,
    },
    Claim {
        name: "soft-modes",
        about: "a free body has six soft modes",
        run: elastic::a_free_body_has_six_soft_modes_and_no_more,
    },
    Claim {
        name: "dilatation",
        about: "mean dilatation against locking",
        run: elastic::clamped_cube_needs_mean_dilatation,
    },
    Claim {
        name: "wave",
        about: "a standing wave converges in space",
        run: dynamics::standing_wave_in_a_bar_converges_in_space_to_the_wave_speed,
    },
    Claim {
        name: "dropped-sphere",
        about: "a dropped sphere bounces with a closed audit",
        run: dynamics::a_dropped_sphere_bounces_with_a_closed_audit,
    },
    Claim {
        name: "geodesics-random",
        about: "factors around random strips are those of sampled shortest paths",
        run: geodesics::random_strips_through_random_clouds_match_sampled_shortest_paths,
    },
    Claim {
        name: "geodesics-twisted",
        about: "factors around twisted strips are those of sampled shortest paths",
        run: geodesics::paths_around_twisted_strips_are_the_shortest,
    },
    Claim {
        name: "gradient",
        about: "the study gradient: methods are ordered as theory says",
        run: studies::gradient_study_orders_the_methods_as_theory_does,
    },
    Claim {
        name: "beam",
        about: "the study beam: near the finite elements",
        run: studies::beam_study_comes_near_the_finite_elements,
    },
    Claim {
        name: "cut",
        about: "the study cut: updates and slits",
        run: studies::cut_study_updates_blocks,
    },
    Claim {
        name: "figures",
        about: "the study figures: each is drawn, table 1 has its pattern",
        run: studies::figures_study_draws_each_and_table_1_has_its_pattern,
    },
    Claim {
        name: "stretch",
        about: "the study stretch: every material is exact",
        run: studies::stretch_study_finds_every_material_exact,
    },
    Claim {
        name: "splat-curvature",
        about: "the study splat: where following curvature gains",
        run: studies::splat_study_says_where_following_curvature_gains,
    },
    Claim {
        name: "splat-depth",
        about: "the study splat: depth and inside tests",
        run: studies::splat_study_leaves_no_hole_and_errs_less_with_more_surfels,
    },
    Claim {
        name: "time",
        about: "the study time: bodies of the size asked for",
        run: studies::time_study_measures_bodies_of_the_size_asked_for,
    },
    Claim {
        name: "scattered",
        about: "values at 100,000 places from 10,000 random points",
        run: scattered::interpolation_of_scattered_points,
    },
    Claim {
        name: "random-seed",
        about: "random scenes depend on seed and number alone",
        run: scenes::random_scenes_depend_on_seed_and_number,
    },
    Claim {
        name: "random-keys",
        about: "random scenes draw every key of scenes but those that are listed",
        run: scenes::random_scenes_say_all_that_scenes_can,
    },
    Claim {
        name: "command-line",
        about: "studies are listed, a misspelt one is named",
        run: studies::studies_are_listed_and_a_misspelt_one_is_named,
    },
    Claim {
        name: "own",
        about: "the studies' own code: finite elements, exact cracks, tables, this command",
        run: own::parts,
    },
    Claim {
        name: "pipe",
        about: "a reader of the output may leave",
        run: studies::a_reader_may_leave,
    },
];

/// A figure and the limit that it must keep.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    what: String,
    figure: String,
    /// Whether the limit is kept.
    pub holds: bool,
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let failed = if self.holds { "" } else { "  FAILED" };
        write!(f, "{}: {}{failed}", self.what, self.figure)
    }
}

/// What a claim has shown so far. Numbers that are NaN keep no limit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Proof {
    /// Each figure with its limit, in the order in which they were found.
    pub checks: Vec<Check>,
}

impl Proof {
    fn add(&mut self, what: impl fmt::Display, figure: String, holds: bool) {
        let what = what.to_string();
        self.checks.push(Check {
            what,
            figure,
            holds,
        });
    }

    /// `value <= limit`.
    pub fn below(&mut self, what: impl fmt::Display, value: f64, limit: f64) {
        let figure = format!("{} <= {}", short(value), short(limit));
        self.add(what, figure, value <= limit);
    }

    /// `value >= limit`.
    pub fn above(&mut self, what: impl fmt::Display, value: f64, limit: f64) {
        let figure = format!("{} >= {}", short(value), short(limit));
        self.add(what, figure, value >= limit);
    }

    /// `|value - expected| <= allowed`.
    pub fn within(&mut self, what: impl fmt::Display, value: f64, expected: f64, allowed: f64) {
        let figure = format!(
            "{} = {} within {}",
            short(value),
            short(expected),
            short(allowed)
        );
        self.add(what, figure, (value - expected).abs() <= allowed);
    }

    /// That something without a limit of its own is so.
    pub fn holds(&mut self, what: impl fmt::Display, holds: bool) {
        self.add(what, if holds { "yes" } else { "no" }.to_owned(), holds);
    }

    /// That a study found nothing that breaks its limits, which it names itself.
    pub fn none(&mut self, what: impl fmt::Display, breaches: &[String]) {
        let figure = format!("{} broken limits {breaches:?}", breaches.len());
        self.add(what, figure, breaches.is_empty());
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
    #[must_use]
    pub fn holds(&self) -> bool {
        !self.proof.checks.is_empty() && self.proof.checks.iter().all(|check| check.holds)
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.holds() { "ok" } else { "FAILED" };
        let seconds = self.time.as_secs_f64();
        writeln!(
            f,
            "{} {verdict} in {seconds:.1} s: {}",
            self.claim.name, self.claim.about
        )?;
        for check in &self.proof.checks {
            writeln!(f, "    {check}")?;
        }
        Ok(())
    }
}

/// The claims that have `filter` in their names; all without one.
///
/// # Errors
/// [`StudyError::NoScene`] if none has.
pub fn chosen(filter: Option<&str>) -> Result<Vec<Claim>, StudyError> {
    let wanted = |claim: &&Claim| filter.is_none_or(|filter| claim.name.contains(filter));
    let chosen: Vec<Claim> = CLAIMS.iter().filter(wanted).copied().collect();
    if chosen.is_empty() {
        let names: Vec<_> = CLAIMS.iter().map(|claim| claim.name).collect();
        return Err(StudyError::NoScene {
            filter: filter.unwrap_or_default().to_owned(),
            names: names.join(", "),
        });
    }
    Ok(chosen)
}

/// Checks claims, `jobs` at a time with one thread each; `ended` sees each outcome as it is there. A claim
/// that panics has failed. Whether all hold.
///
/// # Errors
/// [`StudyError::Threads`], and what `ended` returns.
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

#[allow(
    clippy::unwrap_used,
    clippy::missing_assert_message,
    reason = "a claim that panics fails"
)]
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
