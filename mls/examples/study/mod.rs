//! Output of the studies: a folder, CSV files and line plots as SVG.
#![allow(
    dead_code,
    unreachable_pub,
    clippy::print_stdout,
    reason = "every example takes what it needs and prints tables"
)]

use std::fmt::Write as _;
use std::path::PathBuf;

use plotters::prelude::*;

/// One line of a plot.
pub struct Line {
    /// Label in the legend.
    pub name: String,
    /// Points in order.
    pub points: Vec<(f64, f64)>,
    /// Only the points, not the line between them.
    pub dots: bool,
}

impl Line {
    /// A line through points.
    pub fn new(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self {
            name: name.into(),
            points,
            dots: false,
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

/// Writes a plot; `log` scales both axes logarithmically.
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
    let root = SVGBackend::new(&path, (900, 560)).into_drawing_area();
    root.fill(&WHITE).expect("drawing");
    let mut builder = ChartBuilder::on(&root);
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
            mesh.draw().expect("drawing");
            for (place, line) in lines.iter().enumerate() {
                let colour = Palette99::pick(place).to_rgba();
                let drawn = if line.dots {
                    chart.draw_series(
                        line.points
                            .iter()
                            .map(|&p| Circle::new(p, 3, colour.filled())),
                    )
                } else {
                    chart.draw_series(LineSeries::new(
                        line.points.iter().copied(),
                        colour.stroke_width(2),
                    ))
                };
                drawn
                    .expect("drawing")
                    .label(&line.name)
                    .legend(move |(x, y)| {
                        Rectangle::new([(x, y - 2), (x + 16, y + 2)], colour.filled())
                    });
            }
            chart
                .configure_series_labels()
                .background_style(WHITE.mix(0.8))
                .border_style(BLACK)
                .draw()
                .expect("drawing");
        }};
    }
    if log {
        draw!(builder.build_cartesian_2d(x.log_scale(), y.log_scale()));
    } else {
        draw!(builder.build_cartesian_2d(x, y));
    }
    root.present().expect("the plot can be written");
    drop(root);
    println!("wrote {}", path.display());
}

/// Median of some timings.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
