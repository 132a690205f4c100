//! Nearest valid name for a misspelt one.

use std::fmt;

/// The candidate most like `found`, or nothing where none is alike enough to be meant.
///
/// Likeness is the optimal-string-alignment distance (insertions, deletions, substitutions and
/// swaps of neighbours) without regard to case; a third of the longer word may differ.
#[must_use]
pub fn nearest<'a>(found: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = found.to_lowercase();
    candidates
        .into_iter()
        .map(|name| (strsim::osa_distance(&lower, &name.to_lowercase()), name))
        .filter(|(distance, name)| {
            let longer = found.chars().count().max(name.chars().count());
            *distance <= longer.div_ceil(3)
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

/// A name that may have been meant, for messages; nothing where there is none.
#[derive(Debug, Clone, Copy)]
pub struct DidYouMean<'a>(pub Option<&'a str>);

impl fmt::Display for DidYouMean<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0
            .map_or(Ok(()), |name| write!(f, " (did you mean '{name}'?)"))
    }
}
