//! What a table of cases says: quantiles of each result.

/// Fractions of the values that lie below the quantiles.
pub(super) const SHARES: [f64; 7] = [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0];

/// Arithmetic mean and standard deviation (of the sample; 0 of one value) of finite values, and their quantiles at
/// [`SHARES`]; `None` of none.
///
/// Quantiles lie linearly between neighbours in order: definition 7 of Hyndman 1996.
#[allow(clippy::cast_possible_truncation, reason = "counts are far below 2^53")]
pub(super) fn quantiles(values: &[f64]) -> Option<([f64; 2], [f64; SHARES.len()])> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let mean = sorted.iter().sum::<f64>() / sorted.len() as f64;
    let squares: f64 = sorted.iter().map(|value| (value - mean).powi(2)).sum();
    let at = SHARES.map(|share| {
        let place = share * last as f64;
        let below = place.floor() as usize;
        let above = (below + 1).min(last);
        sorted[below] + (place - place.floor()) * (sorted[above] - sorted[below])
    });
    Some(([mean, (squares / last.max(1) as f64).sqrt()], at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_definition_seven() {
        assert_eq!(quantiles(&[]), None);
        let (moments, at) = quantiles(&[3.0, 1.0, 2.0, 5.0, 4.0]).expect("five values");
        let expected = [3.0, 2.5_f64.sqrt()];
        assert_eq!(moments.map(f64::to_bits), expected.map(f64::to_bits));
        let shares = [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0];
        for (found, share) in at.into_iter().zip(shares) {
            let off = (found - (1.0 + 4.0 * share)).abs();
            assert!(off < 1e-14, "{found} {share}");
        }
        assert_eq!(quantiles(&[7.0]), Some(([7.0, 0.0], [7.0; 7])));
    }
}
