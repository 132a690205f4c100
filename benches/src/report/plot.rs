//! Plots as SVG.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::ValueFormatter;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged};
use plotters::prelude::*;

use super::{Axis, Plot};
use crate::StudyError;

const SIZE: (u32, u32) = (720, HEIGHT);
const HEIGHT: u32 = 500;

/// So that a power of ten at the end of an axis is inside it.
const EDGE: f64 = 1e-6;
/// Height of a line of the legend, which stands below the plot (pixels).
const LEGEND_LINE: i32 = 20;
/// Width of a column of it (pixels).
const LEGEND_COLUMN: i32 = 310;

/// Colours that stay apart for the colour-blind (Okabe and Ito 2008), black first, and two more.
const COLORS: [RGBColor; 10] = [
    RGBColor(0, 0, 0),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(120, 120, 120),
    RGBColor(140, 86, 75),
    RGBColor(0, 90, 90),
];

/// Draws a plot.
pub(crate) fn draw(plot: &Plot) -> Result<String, StudyError> {
    panels(std::slice::from_ref(plot), 1, SIZE)
}

/// Draws plots of the same series side by side in so many columns, with the legend of the first below them; `size` in pixels.
pub(crate) fn panels(
    plots: &[Plot],
    columns: usize,
    size: (u32, u32),
) -> Result<String, StudyError> {
    let mut text = String::new();
    let drawn = picture(plots, columns, size, &mut text);
    drawn.map_err(|error| format!("plot '{}': {error}", plots[0].title))?;
    Ok(text)
}

fn picture(
    plots: &[Plot],
    columns: usize,
    size: (u32, u32),
    text: &mut String,
) -> Result<(), StudyError> {
    let root = SVGBackend::with_string(text, size).into_drawing_area();
    root.fill(&WHITE)?;
    let series = &plots[0].series;
    let across = (size.0.cast_signed() - 24) / LEGEND_COLUMN;
    let lines = i32::try_from(series.len())? / across
        + i32::from(!series.len().is_multiple_of(usize::try_from(across)?));
    let (area, legend) = root.split_vertically(size.1.cast_signed() - LEGEND_LINE * lines - 10);
    for ((index, series), row) in series.iter().enumerate().zip(0..) {
        let color = COLORS[index % COLORS.len()];
        let (x, y) = (
            84 + (row % across) * LEGEND_COLUMN,
            6 + (row / across) * LEGEND_LINE,
        );
        let name = series.name.as_str();
        legend.draw(&PathElement::new(
            [(x, y), (x + 22, y)],
            color.stroke_width(2),
        ))?;
        legend.draw(&Text::new(name, (x + 30, y - 6), ("sans-serif", 13)))?;
    }
    let areas = area.split_evenly((plots.len().div_ceil(columns), columns));
    for (plot, area) in plots.iter().zip(&areas) {
        let (x, y) = (range(plot, plot.x, |p| p.0), range(plot, plot.y, |p| p.1));
        match (plot.x.is_log, plot.y.is_log) {
            (false, false) => chart(area, plot, x, y),
            (false, true) => chart(area, plot, x, y.log_scale()),
            (true, false) => chart(area, plot, x.log_scale(), y),
            (true, true) => chart(area, plot, x.log_scale(), y.log_scale()),
        }?;
    }
    root.present()?;
    Ok(())
}

/// Whether a coordinate has a place on an axis.
fn has_place(axis: Axis, value: f64) -> bool {
    value.is_finite() && (!axis.is_log || value > 0.0)
}

/// What an axis must show, with a margin.
fn range(plot: &Plot, axis: Axis, coordinate: impl Fn(&(f64, f64)) -> f64) -> Range<f64> {
    let values = plot.series.iter().flat_map(|series| &series.points);
    let values = values
        .map(coordinate)
        .filter(|&value| has_place(axis, value));
    let (mut low, mut high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    if low > high {
        (low, high) = (1.0, 10.0);
    }
    if !axis.is_log {
        let margin = if high > low { 0.06 * (high - low) } else { 0.5 };
        return low - margin..high + margin;
    }
    let factor = (high / low).powf(0.06).max(1.2);
    (low, high) = (low / factor, high * factor);
    // Powers of ten carry the labels: two of them at least, the nearer ones first.
    while high.log10().floor() - low.log10().ceil() < 1.0 {
        let (below, above) = (low.log10(), high.log10());
        if below - (below.ceil() - 1.0) < (above.floor() + 1.0) - above {
            low = 10_f64.powf(below.ceil() - 1.0) * (1.0 - EDGE);
        } else {
            high = 10_f64.powf(above.floor() + 1.0) * (1.0 + EDGE);
        }
    }
    low..high
}

fn chart<X, Y>(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    plot: &Plot,
    x: X,
    y: Y,
) -> Result<(), StudyError>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let mut chart = ChartBuilder::on(area)
        .caption(plot.title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(74)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .x_desc(plot.x.label)
        .y_desc(plot.y.label)
        .x_label_formatter(&|value| tick(plot.x, *value))
        .y_label_formatter(&|value| tick(plot.y, *value))
        .light_line_style(RGBColor(238, 238, 238))
        .bold_line_style(RGBColor(205, 205, 205))
        // Finer ones crowd where decades have no room for labels.
        .max_light_lines(1)
        .label_style(("sans-serif", 13))
        .axis_desc_style(("sans-serif", 14))
        .draw()?;
    for (index, series) in plot.series.iter().enumerate() {
        let color = COLORS[index % COLORS.len()];
        let shown = |point: &&(f64, f64)| has_place(plot.x, point.0) && has_place(plot.y, point.1);
        let points: Vec<(f64, f64)> = series.points.iter().filter(shown).copied().collect();
        let dots = points
            .iter()
            .map(|&point| Circle::new(point, 3, color.filled()));
        let dots: Vec<_> = dots.collect();
        if !series.dots {
            chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?;
        }
        chart.draw_series(dots)?;
    }
    Ok(())
}

/// Label of a tick; on a logarithmic axis 1, 2 and 5 of each decade have one, the rest no room.
fn tick(axis: Axis, value: f64) -> String {
    let size = value.abs();
    if axis.is_log {
        let digit = (size / 10_f64.powf((size.log10() + 1e-9).floor())).round();
        let kept = [1.0, 2.0, 5.0];
        if !kept.iter().any(|kept| (digit - kept).abs() < 0.1) {
            return String::new();
        }
    }
    if !axis.is_log && size < 1e-12 {
        "0".to_owned()
    } else if size > 0.0 && !(0.01..1e4).contains(&size) {
        format!("{value:.0e}")
    } else {
        let text = format!("{value:.3}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}
