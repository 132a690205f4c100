//! The studies' own code: what would be tests, were they not built as the proofs are.

use super::{Proof, checks};
use crate::cracks::williams::checks as cracks;
use crate::problems::elements::checks as elements;
use crate::problems::lanes::checks as lanes;
use crate::{eigenvalue, report};

/// What is checked, and what checks it.
macro_rules! parts {
    ($($what:literal $check:path;)*) => {
        [$(($what, $check as fn())),*]
    };
}

pub(super) fn own(proof: &mut Proof) {
    let parts = parts![
        "a crack in a plane" cracks::a_crack_in_a_plane_has_its_stress_intensities;
        "the exact arc" cracks::the_exact_arc_has_free_faces_tension_far_away_and_the_known_intensities;
        "a fit to an arc" cracks::an_arc_has_its_stress_intensities_where_a_straight_fit_has_not;
        "elements pass the patch test" elements::the_patch_test_is_passed_on_uneven_lines;
        "elements bend" elements::a_cantilever_bends_as_theory_says;
        "lanes turn and stretch" lanes::lanes_turn_freely_and_pass_the_patch_test;
        "eigenvalues of a chain" eigenvalue::checks::a_chain_has_the_eigenvalue_of_its_shortest_wave;
        "tables" report::checks::tables_line_up_and_keep_all_digits_in_csv;
        "numbers" report::checks::numbers_keep_three_digits;
        "wrong claims fail" checks::a_claim_that_is_wrong_panics_or_shows_nothing_fails;
    ];
    for (what, check) in parts {
        check();
        proof.holds(what, true);
    }
}
