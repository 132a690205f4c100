//! A result over each key, as SVG.

use std::fmt::Write;

use crate::statistics::bins;

/// A result over one key.
pub(crate) struct Panel<'a> {
    pub(crate) key: &'a str,
    pub(crate) logarithmic: bool,
    /// Key and result.
    pub(crate) points: Vec<(f64, f64)>,
}

/// Pixels of a panel, and what is left free around its axes for their labels.
const WIDTH: f64 = 360.0;
const HEIGHT: f64 = 240.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 40.0;
const CAPTION: f64 = 30.0;
/// Share of the range that is left free at both of its ends.
const MARGIN: f64 = 0.05;

/// An axis: what is shown, where it lies, and where it has labels.
struct Axis {
    logarithmic: bool,
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    /// The axis that shows `values` between the pixels `from` and `to`.
    fn of(values: impl Iterator<Item = f64>, logarithmic: bool, from: f64, to: f64) -> Self {
        let mapped = values.map(|value| if logarithmic { value.log10() } else { value });
        let (low, high) = mapped.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        let margin = if high > low {
            MARGIN * (high - low)
        } else {
            (0.1 * high.abs()).max(1e-9)
        };
        Self {
            logarithmic,
            low: low - margin,
            high: high + margin,
            from,
            to,
        }
    }

    fn at(&self, value: f64) -> f64 {
        let value = if self.logarithmic {
            value.log10()
        } else {
            value
        };
        self.from + (value - self.low) / (self.high - self.low) * (self.to - self.from)
    }

    /// A few round numbers: even steps, or powers of ten and their parts where there is more than one.
    fn ticks(&self) -> Vec<f64> {
        if !self.logarithmic {
            return even(self.low, self.high);
        }
        if self.high - self.low < 1.0 {
            return even(10_f64.powf(self.low), 10_f64.powf(self.high));
        }
        let fine = if self.high - self.low > 2.5 {
            &[1.0][..]
        } else {
            &[1.0, 2.0, 5.0]
        };
        (self.low.floor()..=self.high.ceil())
            .into_steps(1.0)
            .into_iter()
            .flat_map(|decade| fine.iter().map(move |digit| digit * 10_f64.powf(decade)))
            .filter(|value| (self.low..=self.high).contains(&value.log10()))
            .collect()
    }
}

/// Round numbers between two, from two to six steps apart.
fn even(low: f64, high: f64) -> Vec<f64> {
    let rough = (high - low) / 6.0;
    let power = 10_f64.powf(rough.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * power);
    let step = steps.into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(rough);
    ((low / step).ceil()..=(high / step).floor())
        .into_steps(1.0)
        .into_iter()
        .map(|count| count * step)
        .collect()
}

/// The numbers of a range at even steps.
trait IntoSteps {
    fn into_steps(self, step: f64) -> Vec<f64>;
}

impl IntoSteps for std::ops::RangeInclusive<f64> {
    fn into_steps(self, step: f64) -> Vec<f64> {
        std::iter::successors(Some(*self.start()), |value| Some(value + step))
            .take_while(|value| value <= self.end())
            .collect()
    }
}

/// Draws the panels beside and below each other.
pub(crate) fn chart(result: &str, panels: &[Panel<'_>]) -> String {
    let columns = panels.len().clamp(1, 2);
    #[allow(clippy::cast_precision_loss, reason = "a plan has few keys")]
    let (across, down) = (columns as f64, panels.len().div_ceil(columns) as f64);
    let (width, height) = (across * WIDTH, CAPTION + down * HEIGHT);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"{}\" y=\"20\" font-size=\"15\" text-anchor=\"middle\">{}</text>\n",
        width / 2.0,
        escaped(result)
    );
    for (index, panel) in panels.iter().enumerate() {
        #[allow(clippy::cast_precision_loss, reason = "a plan has few keys")]
        let (column, row) = ((index % columns) as f64, (index / columns) as f64);
        // Writing into a string cannot fail.
        let _ = draw(&mut svg, panel, column * WIDTH, CAPTION + row * HEIGHT);
    }
    svg.push_str("</svg>\n");
    svg
}

fn draw(svg: &mut String, panel: &Panel<'_>, left: f64, top: f64) -> std::fmt::Result {
    let (x0, x1) = (left + LEFT, left + WIDTH - RIGHT);
    let (y0, y1) = (top + HEIGHT - BOTTOM, top + TOP);
    let keys: Vec<f64> = panel.points.iter().map(|point| point.0).collect();
    let x = Axis::of(keys.iter().copied(), panel.logarithmic, x0, x1);
    let y = Axis::of(panel.points.iter().map(|point| point.1), false, y0, y1);
    let frame = "fill=\"none\" stroke=\"#888\"";
    writeln!(
        svg,
        "<rect x=\"{x0}\" y=\"{y1}\" width=\"{}\" height=\"{}\" {frame}/>",
        x1 - x0,
        y0 - y1
    )?;
    for value in x.ticks() {
        let at = x.at(value);
        writeln!(
            svg,
            "<path d=\"M{at:.1} {y0}V{:.1}\" {frame}/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            y0 - 4.0,
            y0 + 14.0,
            label(value)
        )?;
    }
    for value in y.ticks() {
        let at = y.at(value);
        writeln!(
            svg,
            "<path d=\"M{x0} {at:.1}H{:.1}\" {frame}/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            x0 + 4.0,
            x0 - 5.0,
            at + 4.0,
            label(value)
        )?;
    }
    writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
        f64::midpoint(x0, x1),
        y0 + 31.0,
        escaped(panel.key)
    )?;
    for (key, result) in &panel.points {
        writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.5\" fill=\"#0072b2\" fill-opacity=\"0.45\"/>",
            x.at(*key),
            y.at(*result)
        )?;
    }
    // Through the means of the bins that the sensitivity is computed from.
    let mut path = String::new();
    for bin in bins(&keys) {
        #[allow(clippy::cast_precision_loss, reason = "at most 1e5 cases")]
        let count = bin.len() as f64;
        let key: f64 = bin.iter().map(|&case| x.at(keys[case])).sum();
        let result: f64 = bin.iter().map(|&case| y.at(panel.points[case].1)).sum();
        let letter = if path.is_empty() { 'M' } else { 'L' };
        write!(path, "{letter}{:.1} {:.1}", key / count, result / count)?;
    }
    writeln!(
        svg,
        "<path d=\"{path}\" fill=\"none\" stroke=\"#d55e00\" stroke-width=\"2\"/>"
    )
}

fn label(value: f64) -> String {
    // What is left of a tick at 0 by rounding.
    let value = if value.abs() < 1e-12 { 0.0 } else { value };
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        let text = format!("{value:.4}");
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    let text = format!("{value:.2e}");
    text.replace(".00e", "e").replace("0e", "e")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_a_few_round_labels_inside() {
        for (low, high) in [
            (0.0, 1.0),
            (-3e-4, 8e-4),
            (1234.0, 1235.0),
            (5.0, 5.0),
            (0.0, 0.0),
        ] {
            let axis = Axis::of([low, high].into_iter(), false, 0.0, 100.0);
            let ticks = axis.ticks();
            assert!((2..=7).contains(&ticks.len()), "{low} {high}: {ticks:?}");
            assert!(
                ticks
                    .iter()
                    .all(|tick| (0.0..=100.0).contains(&axis.at(*tick)))
            );
        }
        let labels = |low: f64, high: f64| -> Vec<String> {
            let axis = Axis::of([low, high].into_iter(), true, 0.0, 100.0);
            axis.ticks().into_iter().map(label).collect()
        };
        assert_eq!(labels(2e3, 2e4), ["2000", "5000", "10000", "20000"]);
        assert_eq!(
            labels(400.0, 3000.0),
            ["500", "1000", "1500", "2000", "2500", "3000"]
        );
        assert_eq!(
            labels(1e-6, 1.0),
            ["1e-6", "1e-5", "1e-4", "0.001", "0.01", "0.1", "1"]
        );
        assert_eq!(label(2.5e-6), "2.5e-6");
        assert_eq!(label(-0.03), "-0.03");
    }

    #[test]
    fn a_chart_draws_every_case() {
        let points = vec![(1.0, 3.0), (2.0, 1.0), (4.0, 2.0)];
        let panel = |key| Panel {
            key,
            logarithmic: true,
            points: points.clone(),
        };
        let svg = chart("a < b", &[panel("x"), panel("y"), panel("z")]);
        assert_eq!(svg.matches("<circle").count(), 9);
        assert!(svg.contains("a &lt; b") && !svg.contains("NaN"), "{svg}");
    }
}
