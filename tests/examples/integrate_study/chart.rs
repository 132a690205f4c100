//! Curves as SVG.

use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;
use std::ops::Range;

/// Points joined by a line, or dots.
#[derive(Debug)]
pub(crate) struct Curve {
    name: String,
    line: bool,
    pub(crate) points: Vec<(f64, f64)>,
}

impl Curve {
    pub(crate) fn new(name: &str, points: Vec<(f64, f64)>) -> Self {
        let name = name.to_owned();
        Self {
            name,
            line: true,
            points,
        }
    }

    pub(crate) fn dots(name: &str, points: Vec<(f64, f64)>) -> Self {
        Self {
            line: false,
            ..Self::new(name, points)
        }
    }
}

/// Curves over common axes.
#[derive(Debug)]
pub(crate) struct Chart {
    title: &'static str,
    axes: [&'static str; 2],
    logarithmic: [bool; 2],
    curves: Vec<Curve>,
}

impl Chart {
    /// Curves over two axes (names), each linear or logarithmic.
    pub(crate) fn new(
        title: &'static str,
        axes: [&'static str; 2],
        logarithmic: [bool; 2],
        curves: Vec<Curve>,
    ) -> Self {
        Self {
            title,
            axes,
            logarithmic,
            curves,
        }
    }

    /// The corner in whose two fifths of the axes the fewest points lie.
    fn legend(&self) -> SeriesLabelPosition {
        let share = |axis: usize, value: f64| {
            let Range { start, end } = self.range(axis);
            if self.logarithmic[axis] {
                (value / start).ln() / (end / start).ln()
            } else {
                (value - start) / (end - start)
            }
        };
        let inside = |[right, upper]: [bool; 2]| {
            let near = |high: bool, share: f64| if high { share > 0.6 } else { share < 0.4 };
            let points = self.curves.iter().flat_map(|c| &c.points);
            let hits = points.filter(|p| near(right, share(0, p.0)) && near(upper, share(1, p.1)));
            hits.count()
        };
        let corners = [
            ([true, true], SeriesLabelPosition::UpperRight),
            ([false, true], SeriesLabelPosition::UpperLeft),
            ([true, false], SeriesLabelPosition::LowerRight),
            ([false, false], SeriesLabelPosition::LowerLeft),
        ];
        let freest = corners
            .into_iter()
            .min_by_key(|(corner, _)| inside(*corner));
        freest.map_or(SeriesLabelPosition::UpperRight, |(_, position)| position)
    }

    fn range(&self, axis: usize) -> Range<f64> {
        let values = self.curves.iter().flat_map(|c| &c.points);
        let values = values.map(|p| if axis == 0 { p.0 } else { p.1 });
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        if self.logarithmic[axis] {
            low / 1.3..high * 1.3
        } else {
            let margin = 0.04 * (high - low);
            low - margin..high + margin
        }
    }

    /// The chart as text of an SVG file.
    pub(crate) fn svg(&self) -> String {
        let (x, y) = (self.range(0), self.range(1));
        match self.logarithmic {
            [false, false] => self.draw(x, y),
            [true, false] => self.draw(x.log_scale(), y),
            [false, true] => self.draw(x, y.log_scale()),
            [true, true] => self.draw(x.log_scale(), y.log_scale()),
        }
    }

    fn draw<X, Y>(&self, x: X, y: Y) -> String
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        const COLORS: [RGBColor; 6] = [
            RGBColor(0, 0, 0),
            RGBColor(213, 94, 0),
            RGBColor(0, 114, 178),
            RGBColor(0, 158, 115),
            RGBColor(204, 121, 167),
            RGBColor(230, 159, 0),
        ];
        let mut text = String::new();
        {
            let root = SVGBackend::with_string(&mut text, (760, 520)).into_drawing_area();
            root.fill(&WHITE).unwrap();
            let mut chart = ChartBuilder::on(&root)
                .caption(self.title, ("sans-serif", 20))
                .margin(14)
                .x_label_area_size(46)
                .y_label_area_size(74)
                .build_cartesian_2d(x, y)
                .unwrap();
            chart
                .configure_mesh()
                .x_desc(self.axes[0])
                .y_desc(self.axes[1])
                .x_labels(if self.logarithmic[0] { 5 } else { 10 })
                .label_style(("sans-serif", 14))
                .axis_desc_style(("sans-serif", 16))
                .draw()
                .unwrap();
            for (curve, color) in self.curves.iter().zip(COLORS.iter().cycle()) {
                let style = color.stroke_width(2);
                if curve.line {
                    let line = LineSeries::new(curve.points.iter().copied(), style);
                    chart.draw_series(line).unwrap();
                }
                if !curve.line || curve.points.len() < 40 {
                    let dot = |p: &(f64, f64)| Circle::new(*p, 3, color.filled());
                    chart.draw_series(curve.points.iter().map(dot)).unwrap();
                }
                // An empty series carries the name, so that dots and lines have one entry each.
                chart
                    .draw_series(LineSeries::new(std::iter::empty(), style))
                    .unwrap()
                    .label(curve.name.as_str())
                    .legend(move |(x, y)| {
                        PathElement::new(vec![(x, y), (x + 18, y)], color.stroke_width(3))
                    });
            }
            chart
                .configure_series_labels()
                .position(self.legend())
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.3))
                .label_font(("sans-serif", 14))
                .draw()
                .unwrap();
            root.present().unwrap();
        }
        text
    }
}
