//! What a table of cases says: quantiles, and which key a result depends on.

/// Where the values of a result lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantiles {
    /// Values.
    pub count: usize,
    /// Arithmetic mean.
    pub mean: f64,
    /// Standard deviation of the sample; 0 of one value.
    pub deviation: f64,
    /// At [`SHARES`].
    pub at: [f64; SHARES.len()],
}

/// Shares of the values that lie below the quantiles.
pub const SHARES: [f64; 7] = [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0];

/// Mean, deviation and quantiles of finite values; `None` of none.
///
/// Quantiles lie linearly between neighbours in order: definition 7 of Hyndman 1996.
#[must_use]
#[allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "counts are far below 2^53"
)]
pub fn quantiles(values: &[f64]) -> Option<Quantiles> {
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

#[allow(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// How much of a result's variance one key explains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    /// First-order index; 0 if the result never changes.
    pub index: f64,
    /// Standard deviation of the estimate where the key has no influence at all.
    pub noise: f64,
    /// Bins that the key's values were put into.
    pub bins: usize,
}

/// First-order sensitivity `Var(E[y | x]) / Var(y)` (Sobol 1993) of the results `y` to one key with the
/// values `x`, from cases as they are.
///
/// The conditional means are those of bins of `x` with as many cases each, about `√n` of them, or of the
/// values themselves where there are no more; the share of variance between bins is freed of what chance
/// alone puts there (Kelley 1935): `1 - (n - 1) / (n - m) · SS_within / SS`. With `m` bins a linear
/// influence comes out too small by `1/m²` of itself. A key without influence gives 0 in the mean with a
/// deviation of `√(2 (m - 1) / ((n - m) (n + 1)))`, so estimates may be negative; the standard error of a
/// large index `S` is about `2 √S (1 - S) / √n`, as that of a coefficient of determination. What several keys do
/// only together is in none of the indices, and keys that do not vary independently share what they do.
///
/// `None` for fewer than 8 cases, or if `x` does not change.
///
/// # Panics
/// If `x` and `y` differ in length.
#[must_use]
#[allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "counts are far below 2^53"
)]
pub fn sensitivity(x: &[f64], y: &[f64]) -> Option<Sensitivity> {
    assert_eq!(x.len(), y.len(), "one result per value of the key");
    const FEWEST: usize = 8;
    let count = x.len();
    if count < FEWEST {
        return None;
    }
    let bins = bins(x);
    if bins.len() < 2 {
        return None;
    }
    let squares = |cases: &[usize]| -> f64 {
        let values: Vec<f64> = cases.iter().map(|&case| y[case]).collect();
        let mean = mean(&values);
        values.iter().map(|value| (value - mean).powi(2)).sum()
    };
    let all: Vec<usize> = (0..count).collect();
    let within: f64 = bins.iter().map(|bin| squares(bin)).sum();
    let total = squares(&all);
    let (n, m) = (count as f64, bins.len() as f64);
    // Rounding of the mean leaves this much of values that are all the same.
    let scale: f64 = y.iter().map(|value| value * value).sum();
    let index = if total > n * f64::EPSILON * f64::EPSILON * scale {
        1.0 - (n - 1.0) / (n - m) * within / total
    } else {
        0.0
    };
    Some(Sensitivity {
        index,
        noise: (2.0 * (m - 1.0) / ((n - m) * (n + 1.0))).sqrt(),
        bins: bins.len(),
    })
}

/// The cases of each bin of `x`, in increasing order: one per value where there are few of them, else
/// about `√n` of as many cases each, equal values together.
#[allow(
    clippy::float_cmp,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "equal values are meant; counts are far below 2^53"
)]
pub(crate) fn bins(x: &[f64]) -> Vec<Vec<usize>> {
    let wanted = (x.len() as f64).sqrt().round() as usize;
    let mut order: Vec<usize> = (0..x.len()).collect();
    order.sort_by(|&a, &b| x[a].total_cmp(&x[b]).then(a.cmp(&b)));
    let values = 1 + order
        .windows(2)
        .filter(|pair| x[pair[0]] != x[pair[1]])
        .count();
    let mut bins: Vec<Vec<usize>> = Vec::new();
    let mut bin = usize::MAX;
    for (rank, &case) in order.iter().enumerate() {
        let new = rank == 0 || x[order[rank - 1]] != x[case];
        let asked = rank * wanted / x.len();
        if new && (values <= wanted || asked != bin) {
            bins.push(Vec::new());
            bin = asked;
        }
        if let Some(bin) = bins.last_mut() {
            bin.push(case);
        }
    }
    bins
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Sequence;

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

    /// The function of Ishigami and Homma 1990 with a = 7, b = 0.1: indices 0.3139, 0.4424 and 0, the
    /// rest being done by the first and the third together.
    #[test]
    fn ishigami_homma_1990_has_its_indices() {
        let mut sequence = Sequence::new(1);
        let mut draw = || std::f64::consts::PI * (2.0 * sequence.unit() - 1.0);
        let points: Vec<[f64; 3]> = (0..4000).map(|_| [draw(), draw(), draw()]).collect();
        let y: Vec<f64> = points
            .iter()
            .map(|[a, b, c]| a.sin() + 7.0 * b.sin().powi(2) + 0.1 * c.powi(4) * a.sin())
            .collect();
        for (key, expected) in [0.3139, 0.4424, 0.0].into_iter().enumerate() {
            let x: Vec<f64> = points.iter().map(|point| point[key]).collect();
            let found = sensitivity(&x, &y).expect("there are enough");
            let (index, noise) = (found.index, found.noise);
            // Three standard errors, as of a coefficient of determination.
            let error = 2.0 * f64::sqrt(expected) * (1.0 - expected) / f64::sqrt(4000.0);
            let allowed = 3.0 * (error + noise);
            assert!(
                (index - expected).abs() < allowed,
                "{index} {expected} {allowed}"
            );
        }
    }

    #[test]
    fn a_key_without_influence_gives_nothing_in_the_mean() {
        let mut sequence = Sequence::new(2);
        let mut column =
            |count: usize| -> Vec<f64> { (0..count).map(|_| sequence.unit()).collect() };
        let (mut sum, mut squares, trials) = (0.0, 0.0, 400.0);
        let mut noise = 0.0;
        for _ in 0..400 {
            let found = sensitivity(&column(100), &column(100)).expect("there are enough");
            sum += found.index;
            squares += found.index * found.index;
            noise = found.noise;
        }
        let (mean, deviation) = (sum / trials, (squares / trials).sqrt());
        assert!(
            mean.abs() < 4.0 * noise / f64::sqrt(trials),
            "{mean} {noise}"
        );
        assert!((deviation / noise - 1.0).abs() < 0.2, "{deviation} {noise}");
    }

    #[test]
    fn few_values_are_bins_of_their_own() {
        let x: Vec<f64> = (0..30).map(|case| f64::from(case % 3)).collect();
        let lengths: Vec<usize> = bins(&x).iter().map(Vec::len).collect();
        assert_eq!(lengths, [10, 10, 10]);
        let y: Vec<f64> = x.iter().map(|x| x * x - 4.0).collect();
        let found = sensitivity(&x, &y).expect("there are enough");
        assert_eq!((found.index, found.bins), (1.0, 3));
        let same = sensitivity(&x, &[2.5; 30]).expect("enough");
        assert!(same.index.abs() < f64::MIN_POSITIVE, "{}", same.index);
        assert_eq!(sensitivity(&[1.0; 30], &y), None, "it does not change");
        assert_eq!(sensitivity(&x[..7], &y[..7]), None, "too few");
    }
}
