//! Draws the pairs of a plate around a crack in the colour of their factor: the picture at the top of the README.
//!
//! `cargo run --release -p phyxel-enrich --example crack -- enrich/crack.svg`. Fails if a pair that the crack does not
//! cross is weakened, or one far behind its tip is not severed.

#![allow(clippy::print_stdout, reason = "it says what it drew")]

use std::error::Error;
use std::fmt::Write;

use phyxel_enrich::{CutSettings, Cuts, FactorSettings, PairFactors, Rows, glam::DVec3};

/// Nodes along and across the plate.
const NODES: (u32, u32) = (22, 12);
/// Pixels of a spacing, and of the margin.
const SIZE: f64 = 30.0;

/// Nodes of a jittered lattice, one apart.
fn plate() -> Vec<DVec3> {
    let jitter = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65_536.0 - 0.5;
    let at = |k: u32| {
        let (x, y) = (f64::from(k % NODES.0), f64::from(k / NODES.0));
        DVec3::new(
            x + 0.4 * jitter(3 * k + 1),
            y + 0.4 * jitter(7 * k + 5),
            0.0,
        )
    };
    (0..NODES.0 * NODES.1).map(at).collect()
}

/// From grey (1) over orange to dark red (just above 0).
fn color(factor: f64) -> String {
    let stops = [
        [150.0, 20.0, 30.0],
        [235.0, 120.0, 20.0],
        [175.0, 180.0, 190.0],
    ];
    let (low, share) = if factor < 0.5 {
        (0, 2.0 * factor)
    } else {
        (1, 2.0 * factor - 1.0)
    };
    let mix = |c: usize| stops[low][c] + share * (stops[low + 1][c] - stops[low][c]);
    format!("rgb({:.0},{:.0},{:.0})", mix(0), mix(1), mix(2))
}

/// What colour a factor has, at the foot of a picture of these sizes (pixels).
fn draw_scale(svg: &mut String, width: f64, height: f64) -> std::fmt::Result {
    for k in 0..40 {
        let factor = (f64::from(k) + 0.5) / 40.0;
        let left = width - 6.0 * SIZE + f64::from(k) * 4.0;
        writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{:.1}\" width=\"4.2\" height=\"9\" fill=\"{}\"/>",
            height - 15.0,
            color(factor)
        )?;
    }
    for (at, text) in [(6.5, "0"), (0.4, "1")] {
        let (x, y) = (width - at * SIZE, height - 6.5);
        writeln!(
            svg,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-family=\"sans-serif\" font-size=\"13\">{text}</text>"
        )?;
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args()
        .nth(1)
        .ok_or("name the SVG file to write")?;
    let x = plate();
    let count = NODES.0 * NODES.1;
    let near = |i: u32, j: u32| x[i as usize].distance(x[j as usize]) < 1.75;
    let edges = (0..count).flat_map(|i| {
        (i + 1..count)
            .filter(move |&j| near(i, j))
            .map(move |j| [i, j])
    });
    let rows = Rows::from_edges(x.len(), edges)?;
    let graph = rows.graph(&x)?;
    let mut factors = PairFactors::new(&graph, &FactorSettings::default());
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));

    // A blade that stands upright goes in from the left along a wave, to the middle of the plate.
    let path = |t: f64| DVec3::new(13.4 * t - 1.0, 5.6 + 1.3 * (5.0 * t).sin(), 0.0);
    let blade = |t: f64| [-1.0, 1.0].map(|z| path(t) + DVec3::Z * z);
    let stroke = cuts.start(&blade(0.0))?;
    let places: Vec<DVec3> = (0..=24).map(|k| path(f64::from(k) / 24.0)).collect();
    for k in 1..=24 {
        let new = cuts.append(stroke, &blade(f64::from(k) / 24.0))?;
        // The plate is thin: no path leads over the blade's ends, or around the mouth of the crack.
        factors.update(&graph, &cuts, new, &|p| p.z.abs() < 0.5 && p.x > -0.5);
    }

    let pixel = |p: DVec3| ((p.x + 1.0) * SIZE, (f64::from(NODES.1) - p.y) * SIZE);
    let (width, height) = (f64::from(NODES.0 + 1) * SIZE, f64::from(NODES.1 + 1) * SIZE);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let mut weak = factors.crossed(&graph).peekable();
    let (mut whole, mut gone) = (String::new(), String::new());
    let (mut severed, mut partly) = (0, 0);
    for i in 0..count {
        for j in (i + 1..count).filter(|&j| near(i, j)) {
            let factor = weak.next_if(|pair| (pair.0, pair.1) == (i, j));
            let middle = x[i as usize].midpoint(x[j as usize]);
            let away = places.iter().map(|p| p.distance(middle));
            let away = away.fold(f64::INFINITY, f64::min);
            let near = factor.is_none() || away < 1.2;
            assert!(near, "a pair {away} from the crack is weakened");
            let factor = factor.map_or(1.0, |(_, _, factor)| factor);
            severed += u32::from(factor == 0.0);
            partly += u32::from(factor > 0.0 && factor < 1.0);
            let ((x1, y1), (x2, y2)) = (pixel(x[i as usize]), pixel(x[j as usize]));
            let way = format!("M{x1:.0} {y1:.0}L{x2:.0} {y2:.0}");
            if factor == 0.0 {
                gone.push_str(&way);
            } else if factor < 1.0 {
                let color = color(factor);
                writeln!(
                    svg,
                    "<path d=\"{way}\" stroke=\"{color}\" stroke-width=\"3\"/>"
                )?;
            } else {
                whole.push_str(&way);
            }
        }
    }
    let grey = color(1.0);
    writeln!(
        svg,
        "<path d=\"{whole}\" stroke=\"{grey}\" stroke-width=\"1.2\"/>"
    )?;
    writeln!(
        svg,
        "<path d=\"{gone}\" stroke=\"#000\" stroke-width=\"0.6\" stroke-dasharray=\"2 3\"/>"
    )?;
    let point = |(x, y): (f64, f64)| format!("{x:.1},{y:.1}");
    let line: Vec<String> = places.iter().map(|&p| point(pixel(p))).collect();
    writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#1a5fb4\" stroke-width=\"3.5\"/>",
        line.join(" ")
    )?;
    for &p in &x {
        let (x, y) = pixel(p);
        writeln!(svg, "<circle cx=\"{x:.0}\" cy=\"{y:.0}\" r=\"3\"/>")?;
    }
    draw_scale(&mut svg, width, height)?;
    svg.push_str("</svg>\n");
    std::fs::write(&file, svg)?;
    println!("{severed} pairs severed, {partly} weakened: {file}");
    let drawn = severed > 30 && partly > 2;
    assert!(drawn, "the crack is not as it was drawn");
    Ok(())
}
