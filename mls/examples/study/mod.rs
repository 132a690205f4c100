//! What the studies share: an output folder, CSV files, plots as SVG, and stencils of a block.
#![allow(
    dead_code,
    unreachable_pub,
    clippy::print_stdout,
    reason = "every example takes what it needs and prints tables"
)]

use std::fmt::Write as _;
use std::path::PathBuf;

use phyxel_mls::{
    ConservativeSettings, ConservativeStencils, Neighborhoods, inverse_square_weights,
};
use plotters::coord::Shift;
use plotters::element::DynElement;
use plotters::prelude::*;
use testkit::kuhn::Block;

/// Size of a plot and, of it, the column of the legend (pixels).
const SIZE: (u32, u32) = (1120, 560);
const LEGEND: u32 = 260;

/// How a series is drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// A line through the points.
    Line,
    /// Marks only.
    Marks(Shape),
    /// Marks only, drawn as outlines.
    Outlines(Shape),
}

/// Shape of a mark.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Circle,
    Triangle,
    Square,
    Cross,
}

/// One series of a plot.
pub struct Line {
    /// Label in the legend.
    pub name: String,
    /// Points in order.
    pub points: Vec<(f64, f64)>,
    pub style: Style,
    /// Place in the palette; the place among the series if there is none.
    pub colour: Option<usize>,
    /// Half sizes of the marks (pixels); 4 beyond the end.
    pub sizes: Vec<i32>,
}

impl Line {
    /// A line through points.
    pub fn new(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self {
            name: name.into(),
            points,
            style: Style::Line,
            colour: None,
            sizes: Vec::new(),
        }
    }

    /// Filled circles.
    pub fn marks(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self {
            style: Style::Marks(Shape::Circle),
            ..Self::new(name, points)
        }
    }
}

/// Folder of the results: the first argument, or `target/studies/mls`.
pub fn folder() -> PathBuf {
    let folder = std::env::args()
        .nth(1)
        .map_or_else(|| "target/studies/mls".into(), PathBuf::from);
    std::fs::create_dir_all(&folder).expect("the output folder can be made");
    folder
}

/// Writes a table as CSV.
pub fn write_csv(name: &str, header: &str, rows: &[Vec<String>]) {
    let mut text = format!("{header}\n");
    for row in rows {
        writeln!(text, "{}", row.join(",")).expect("writing to a string");
    }
    let path = folder().join(name);
    std::fs::write(&path, text).expect("the table can be written");
    println!("wrote {}", path.display());
}

/// Writes a plot with its legend beside it; `log` scales both axes logarithmically.
pub fn write_plot(name: &str, title: &str, axes: [&str; 2], log: bool, lines: &[Line]) {
    let path = folder().join(name);
    let all = || lines.iter().flat_map(|line| &line.points);
    let range = |pick: fn(&(f64, f64)) -> f64| {
        let low = all().map(pick).fold(f64::INFINITY, f64::min);
        let high = all().map(pick).fold(f64::NEG_INFINITY, f64::max);
        if log {
            low / 1.3..high * 1.3
        } else {
            let margin = 0.05 * (high - low).max(1e-9);
            low - margin..high + margin
        }
    };
    let (x, y) = (range(|p| p.0), range(|p| p.1));
    let root = SVGBackend::new(&path, SIZE).into_drawing_area();
    root.fill(&WHITE).expect("drawing");
    let (plot, legend) = root.split_horizontally(SIZE.0 - LEGEND);
    let mut builder = ChartBuilder::on(&plot);
    builder
        .caption(title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(68);
    // The two kinds of axes are different types.
    macro_rules! draw {
        ($chart:expr) => {{
            let mut chart = $chart.expect("drawing");
            let mut mesh = chart.configure_mesh();
            mesh.x_desc(axes[0]).y_desc(axes[1]).light_line_style(WHITE);
            mesh.x_labels(20).y_labels(20);
            mesh.x_label_formatter(&tick).y_label_formatter(&tick);
            mesh.draw().expect("drawing");
            for (place, line) in lines.iter().enumerate() {
                let colour = colour(line, place);
                if line.style == Style::Line {
                    let points = line.points.iter().copied();
                    chart
                        .draw_series(LineSeries::new(points, colour.stroke_width(2)))
                        .expect("drawing");
                } else {
                    let marks = line.points.iter().enumerate().map(|(k, &at)| {
                        EmptyElement::at(at)
                            + mark(line.style, line.sizes.get(k).copied().unwrap_or(4), colour)
                    });
                    chart.draw_series(marks).expect("drawing");
                }
            }
        }};
    }
    if log {
        draw!(builder.build_cartesian_2d(x.log_scale(), y.log_scale()));
    } else {
        draw!(builder.build_cartesian_2d(x, y));
    }
    draw_legend(&legend, lines);
    root.present().expect("the plot can be written");
    drop((plot, legend, root));
    println!("wrote {}", path.display());
}

/// What stands at a tick: five figures at most, as a power of ten where zeros would be many.
#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "the drawing library asks for it"
)]
fn tick(value: &f64) -> String {
    let rounded: f64 = format!("{value:.4e}").parse().unwrap_or(*value);
    if rounded == 0.0 || (1e-3..1e5).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

fn colour(line: &Line, place: usize) -> RGBAColor {
    Palette99::pick(line.colour.unwrap_or(place)).to_rgba()
}

/// A mark around the origin.
fn mark<DB: DrawingBackend>(
    style: Style,
    size: i32,
    colour: RGBAColor,
) -> DynElement<'static, DB, (i32, i32)> {
    let (shape, paint) = match style {
        Style::Line => {
            let corners = [(-8, -1), (8, 1)];
            return Rectangle::new(corners, colour.filled()).into_dyn();
        }
        Style::Marks(shape) => (shape, colour.filled()),
        Style::Outlines(shape) => (shape, colour.stroke_width(1)),
    };
    let origin = (0, 0);
    match shape {
        Shape::Circle => Circle::new(origin, size, paint).into_dyn(),
        Shape::Triangle => TriangleMarker::new(origin, size + 1, paint).into_dyn(),
        Shape::Square => {
            let half = size - 1;
            Rectangle::new([(-half, -half), (half, half)], paint).into_dyn()
        }
        Shape::Cross => Cross::new(origin, size, colour.stroke_width(2)).into_dyn(),
    }
}

/// Names of the series, one below the other.
fn draw_legend(area: &DrawingArea<SVGBackend<'_>, Shift>, lines: &[Line]) {
    let mut y = 60;
    for (place, line) in lines.iter().enumerate() {
        let sample = EmptyElement::at((14, y)) + mark(line.style, 5, colour(line, place));
        area.draw(&sample).expect("drawing");
        let font = ("sans-serif", 14).into_font();
        let text = Text::new(line.name.clone(), (30, y - 7), font);
        area.draw(&text).expect("drawing");
        y += 22;
    }
}

/// Median of some timings.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Conservative stencils of a block on a graph, with inverse square weights.
pub fn block_stencils(
    block: &Block,
    graph: &Neighborhoods,
    settings: &ConservativeSettings,
) -> ConservativeStencils {
    let weights = inverse_square_weights(&block.positions, graph);
    ConservativeStencils::new(
        &block.positions,
        &block.volumes,
        &block.boundary_vectors,
        graph,
        weights,
        settings,
    )
    .expect("finite data")
}
