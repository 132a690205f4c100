//! The values of each case.

use super::plan::{Design, Plan, SweptKey, Values};

/// Numbers from 0 to 1 that look random and are the same on every machine: the splitting generator of
/// Steele, Lea and Flood 2014.
#[derive(Debug, Clone)]
pub(super) struct Sequence(u64);

impl Sequence {
    /// The sequence of a seed; any will do.
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ (bits >> 31)
    }

    /// The next number, at least 0 and below 1.
    pub(super) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A random order of `0..count` (Fisher and Yates).
    fn order(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        for last in (1..count).rev() {
            // The fraction of the product beyond 64 bits is uniform to 1 in 2^64 / count.
            let pick = (u128::from(self.bits()) * (last as u128 + 1)) >> 64;
            order.swap(last, usize::try_from(pick).unwrap_or(last));
        }
        order
    }
}

/// The values of each case, as text, in the order of the plan's keys.
pub(super) fn cases(plan: &Plan) -> Vec<Vec<String>> {
    let count = plan.case_count();
    let mut rows = vec![Vec::with_capacity(plan.keys.len()); count];
    match plan.design {
        Design::List => {
            for key in &plan.keys {
                for (index, row) in rows.iter_mut().enumerate() {
                    row.push(listed(key, index));
                }
            }
        }
        Design::Grid => {
            let mut repeat = count;
            for key in &plan.keys {
                let length = key.values.listed().len().max(1);
                repeat /= length;
                for (index, row) in rows.iter_mut().enumerate() {
                    row.push(listed(key, index / repeat.max(1) % length));
                }
            }
        }
        Design::LatinHypercube { seed, .. } => {
            let mut sequence = Sequence::new(seed);
            for key in &plan.keys {
                let order = sequence.order(count);
                for (row, part) in rows.iter_mut().zip(order) {
                    let share = (part as f64 + sequence.unit()) / count as f64;
                    row.push(drawn(key, share, part, count));
                }
            }
        }
    }
    rows
}

fn listed(key: &SweptKey, index: usize) -> String {
    let value = key.values.listed().get(index);
    value.map_or(String::new(), |value| value.0.clone())
}

/// The value below which a `share` of all lie; of a list the one that `part` of `count` falls on.
fn drawn(key: &SweptKey, share: f64, part: usize, count: usize) -> String {
    let number = match key.values {
        Values::Of(ref list) => return listed(key, part * list.len() / count),
        Values::Uniform(low, high) => low + (high - low) * share,
        Values::LogUniform(low, high) => low * (high / low).powf(share),
    };
    if key.whole {
        return format!("{}", number.round());
    }
    // Six digits: enough to keep the parts apart, and the same whatever the system's logarithm does.
    let short: f64 = format!("{number:.5e}").parse().unwrap_or(number);
    short.to_string()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;

    fn rows_of(design: &str, keys: &str) -> Vec<Vec<String>> {
        let text = format!("(version: 1, scene: \"block\", design: {design}, keys: [{keys}])");
        cases(&Plan::from_text(&text, Path::new("plan.ron")).expect("the plan is valid"))
    }

    #[test]
    fn a_list_takes_values_together_and_a_grid_all_of_them() {
        let keys = "(key: \"a\", values: Of([1, 2e3])), (key: \"b\", values: Of([X(1), None]))";
        assert_eq!(rows_of("List", keys), [["1", "X(1)"], ["2e3", "None"]]);
        assert_eq!(
            rows_of("Grid", keys),
            [
                ["1", "X(1)"],
                ["1", "None"],
                ["2e3", "X(1)"],
                ["2e3", "None"]
            ]
        );
    }

    #[test]
    fn a_latin_hypercube_uses_each_part_of_each_range_once() {
        let keys = "(key: \"a\", values: Uniform(-1, 3)), (key: \"b\", values: LogUniform(1, 1e4)), \
                    (key: \"c\", values: Of([\"x\", \"y\", \"z\"])), \
                    (key: \"d\", whole: true, values: Uniform(1, 9))";
        for count in [1, 7, 60, 501] {
            let design = |seed| format!("LatinHypercube(cases: {count}, seed: {seed})");
            let rows = rows_of(&design(5), keys);
            assert_eq!(rows, rows_of(&design(5), keys), "the seed decides");
            let column = |at: usize| rows.iter().map(move |row| row[at].as_str());
            let numbers = |at| column(at).map(|text| text.parse::<f64>().expect("a number"));
            // Half a digit of the sixth may carry a value over the edge of its part.
            let part = |share: f64| (share * f64::from(count)).floor().to_string();
            let a: BTreeSet<String> = numbers(0).map(|v| part((v + 1.0) / 4.0)).collect();
            let b: BTreeSet<String> = numbers(1).map(|v| part(v.log10() / 4.0)).collect();
            assert!(a.len() + 2 >= rows.len(), "{} of {count}", a.len());
            assert!(b.len() + 2 >= rows.len(), "{} of {count}", b.len());
            let y = column(2).filter(|text| *text == "\"y\"").count();
            assert!(y.abs_diff(rows.len() / 3) <= 1, "{y} of {count}");
            assert!(numbers(3).all(|v| v.fract() == 0.0 && (1.0..=9.0).contains(&v)));
            if count > 7 {
                assert_ne!(rows, rows_of(&design(6), keys));
            }
        }
    }
}
