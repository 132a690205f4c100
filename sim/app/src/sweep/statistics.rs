//! What a table of cases says: quantiles of each result.

/// Where the values of a result lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Quantiles {
    /// Values.
    pub(super) count: usize,
    /// Arithmetic mean.
    pub(super) mean: f64,
    /// Standard deviation of the sample; 0 of one value.
    pub(super) deviation: f64,
    /// At [`SHARES`].
    pub(super) at: [f64; SHARES.len()],
}

/// Fractions of the values that lie below the quantiles.
pub(super) const SHARES: [f64; 7] = [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0];

/// Mean, deviation and quantiles of finite values; `None` of none.
///
/// Quantiles lie linearly between neighbours in order: definition 7 of Hyndman 1996.
#[allow(clippy::cast_possible_truncation, reason = "counts are far below 2^53")]
pub(super) fn quantiles(values: &[f64]) -> Option<Quantiles> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let mean = mean(&sorted);
    let squares: f64 = sorted.iter().map(|value| (value - mean).powi(2)).sum();
    let at = SHARES.map(|share| {
        let place = share * last as f64;
        let below = place.floor() as usize;
        let above = (below + 1).min(last);
        sorted[below] + (place - place.floor()) * (sorted[above] - sorted[below])
    });
    Some(Quantiles {
        count: sorted.len(),
        mean,
        deviation: (squares / last.max(1) as f64).sqrt(),
        at,
    })
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_definition_seven() {
        assert_eq!(quantiles(&[]), None);
        let q = quantiles(&[3.0, 1.0, 2.0, 5.0, 4.0]).expect("five values");
        assert_eq!((q.count, q.mean, q.deviation), (5, 3.0, 2.5_f64.sqrt()));
        let shares = [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0];
        for (found, share) in q.at.into_iter().zip(shares) {
            assert!(
                (found - (1.0 + 4.0 * share)).abs() < 1e-14,
                "{found} {share}"
            );
        }
        let one = quantiles(&[7.0]).expect("one value");
        assert_eq!((one.deviation, one.at), (0.0, [7.0; 7]));
    }
}
