//! Draws the dissertation's figures 20 to 23, 26 to 28 and 32 to 37, and the default beside them.
//!
//! `cargo run --release -p phyxel-enrich --example figures -- out` writes PNG files into `out`.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "colours and pixel numbers are clamped"
)]

use std::error::Error;
use std::path::Path;

use glam::{DVec2, DVec3};
use phyxel_enrich::{
    CutSettings, EnrichmentGrid, GridSettings, PlanarCuts, Rule, Scratch, product_of_segments,
    segment_enrichment,
};

const PIXELS: usize = 300;

/// Where a point of a picture lies in space.
type Slice = fn(DVec2) -> DVec3;

/// Picture of a field over the unit square (y up), with level lines and a polyline over it.
fn picture(
    path: &Path,
    field: impl Fn(DVec2) -> f64,
    range: [f64; 2],
    levels: u32,
    line: &[DVec2],
) -> Result<(), Box<dyn Error>> {
    let at = |column: usize, row: usize| {
        DVec2::new(column as f64 + 0.5, (PIXELS - row) as f64 - 0.5) / PIXELS as f64
    };
    let share = |p: DVec2| ((field(p) - range[0]) / (range[1] - range[0])).clamp(0.0, 1.0);
    let mut image = Vec::with_capacity(3 * PIXELS * PIXELS);
    for row in 0..PIXELS {
        for column in 0..PIXELS {
            let p = at(column, row);
            let value = share(p);
            // Blue below the middle of the range, white at it, red above.
            let mut colour = if value < 0.5 {
                let t = 2.0 * value;
                [60.0 + 195.0 * t, 90.0 + 165.0 * t, 180.0 + 75.0 * t]
            } else {
                let t = 2.0 - 2.0 * value;
                [180.0 + 75.0 * t, 50.0 + 205.0 * t, 60.0 + 195.0 * t]
            };
            let band = |v: f64| (v * f64::from(levels)).floor();
            let step = 1.0 / PIXELS as f64;
            let next = [p + DVec2::X * step, p + DVec2::Y * step];
            if levels > 0
                && next
                    .iter()
                    .any(|&q| (band(share(q)) - band(value)).abs() > 0.5)
            {
                colour = colour.map(|c| 0.6 * c);
            }
            let near = line.windows(2).any(|w| {
                let t =
                    ((p - w[0]).dot(w[1] - w[0]) / (w[1] - w[0]).length_squared()).clamp(0.0, 1.0);
                w[0].lerp(w[1], t).distance(p) < 1.2 * step
            });
            if near {
                colour = [0.0; 3];
            }
            image.extend(colour.map(|c| c as u8));
        }
    }
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let side = u32::try_from(PIXELS)?;
    let mut encoder = png::Encoder::new(file, side, side);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&image)?;
    Ok(())
}

/// Factor of the default between each point and the nodes of its neighbourhood, averaged over those
/// above the point's place along the cut's normal: what a node at the point still knows of them.
fn detour_field(cuts: &PlanarCuts, p: DVec2, probe: DVec2) -> f64 {
    let inside = |p: DVec3| p.cmpge(DVec3::ZERO).all() && p.cmple(DVec3::ONE).all();
    let reach = 3.0 * p.distance(probe).max(1e-9);
    let mut scratch = Scratch::default();
    Rule::Detour.factor(
        cuts,
        p.extend(0.0),
        probe.extend(0.0),
        reach,
        &inside,
        &mut scratch,
    )
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "out".to_owned());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let file = |name: &str| folder.join(format!("{name}.png"));
    let settings = GridSettings {
        spacing: 0.01,
        inflate: 0.5,
        most_points: 1 << 24,
    };

    // Figures 20 to 22: one segment.
    let segment = [DVec2::new(0.3, 0.5), DVec2::new(0.7, 0.5)];
    let one = EnrichmentGrid::from_polyline(&segment, &settings)?;
    let on_grid = |grid: &EnrichmentGrid, p: DVec2| {
        grid.look_up(p.extend(0.0))
            .unwrap_or(grid.evaluate(p.extend(0.0)))
    };
    picture(
        &file("figure-20-d1"),
        |p| on_grid(&one, p).d_plus,
        [-0.3, 0.3],
        12,
        &segment,
    )?;
    picture(
        &file("figure-21a-d2"),
        |p| on_grid(&one, p).distance,
        [-0.5, 0.5],
        20,
        &segment,
    )?;
    picture(
        &file("figure-22-phi"),
        |p| segment_enrichment(segment, p),
        [-1.0, 1.0],
        20,
        &segment,
    )?;

    // Figures 23 and 28: the product, the grid, and the default, growing and through.
    let inside = [[0.15, 0.35], [0.4, 0.5], [0.6, 0.48], [0.85, 0.7]].map(DVec2::from);
    let through = [[-0.3, 0.35], [0.3, 0.55], [0.65, 0.45], [1.3, 0.7]].map(DVec2::from);
    for (name, line) in [("inside", inside), ("through", through)] {
        for pieces in 1..=3 {
            let line = &line[..=pieces];
            let grid = EnrichmentGrid::from_polyline(line, &settings)?;
            let label = format!("{name}-{pieces}");
            picture(
                &file(&format!("figure-23-product-{label}")),
                |p| product_of_segments(line, p),
                [0.0, 1.0],
                10,
                line,
            )?;
            picture(
                &file(&format!("figure-28-grid-{label}")),
                |p| 0.5 * (1.0 + on_grid(&grid, p).phi),
                [0.0, 1.0],
                10,
                line,
            )?;
            picture(
                &file(&format!("figure-26-regions-{label}")),
                |p| f64::from(on_grid(&grid, p).region),
                [-0.5, 2.5],
                3,
                line,
            )?;
            picture(
                &file(&format!("figure-27-s-{label}")),
                |p| on_grid(&grid, p).s,
                [-0.5, 0.5],
                20,
                line,
            )?;
            let mut cuts = PlanarCuts::new(&CutSettings::for_spacing(0.02));
            cuts.add_polyline(line)?;
            let probe = DVec2::new(0.5, 0.65);
            picture(
                &file(&format!("figure-28-default-{label}")),
                |p| detour_field(&cuts, p, probe),
                [0.0, 1.0],
                10,
                line,
            )?;
        }
    }

    // Figures 32 to 37: a bent strip in space, in slices across and along it.
    let blades: Vec<[DVec3; 2]> = (0..=6)
        .map(|k| {
            let x = 0.2 + 0.1 * f64::from(k);
            let y = 0.5 + 0.1 * (4.0 * x).sin();
            [DVec3::new(x, y, 0.3), DVec3::new(x, y + 0.05, 0.7)]
        })
        .collect();
    let coarse = GridSettings {
        spacing: 0.02,
        inflate: 0.35,
        ..settings
    };
    let grid = EnrichmentGrid::from_blades(&blades, &coarse)?;
    let slices: [(&str, Slice); 3] = [
        ("across-z", |p| DVec3::new(p.x, p.y, 0.5)),
        ("across-x", |p| DVec3::new(0.5, p.y, p.x)),
        ("along", |p| DVec3::new(p.x, 0.53, p.y)),
    ];
    for (name, place) in slices {
        let of = |p: DVec2| {
            grid.look_up(place(p))
                .unwrap_or_else(|| grid.evaluate(place(p)))
        };
        picture(
            &file(&format!("figure-32-d2-{name}")),
            |p| of(p).d_plus,
            [-0.3, 0.3],
            12,
            &[],
        )?;
        picture(
            &file(&format!("figure-33-s-{name}")),
            |p| of(p).s,
            [-0.5, 0.5],
            20,
            &[],
        )?;
        picture(
            &file(&format!("figure-34-phi-{name}")),
            |p| of(p).phi,
            [-1.0, 1.0],
            20,
            &[],
        )?;
        // Level sets 1, 0.5 and 0 of the enrichment (1 + phi) / 2 as bands.
        let level = |p: DVec2| {
            let h = 0.5 * (1.0 + of(p).phi);
            [1.0, 0.5, 0.0]
                .iter()
                .map(|l| 1.0 - ((h - l).abs() / 0.02).min(1.0))
                .fold(0.0, f64::max)
        };
        picture(
            &file(&format!("figure-37-levels-{name}")),
            level,
            [-1.0, 1.0],
            0,
            &[],
        )?;
        picture(
            &file(&format!("figure-67-d3-{name}")),
            |p| of(p).distance,
            [-0.5, 0.5],
            20,
            &[],
        )?;
    }
    Ok(())
}
