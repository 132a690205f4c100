//! Figures 29 to 37 and 66 to 68: a cut in space.

use glam::{DVec2, DVec3};
use phyxel_enrich::{EnrichmentGrid, GridSettings};

use super::Drawn;
use super::canvas::{Image, Plot, View, region_colour};
use crate::StudyError;

const RED: [f64; 3] = [215.0, 60.0, 50.0];
const BLUE: [f64; 3] = [70.0, 110.0, 220.0];
const BLACK: [f64; 3] = [0.0; 3];

/// Where a point of a picture lies in space.
type Slice = fn(DVec2) -> DVec3;

/// A bent strip whose blade leans over as it goes.
fn blades() -> Vec<[DVec3; 2]> {
    (0..=6)
        .map(|k| {
            let x = 0.2 + 0.1 * f64::from(k);
            let y = 0.45 + 0.18 * (4.5 * x).sin();
            [DVec3::new(x, y, 0.3), DVec3::new(x, y + 0.05, 0.7)]
        })
        .collect()
}

fn strip(view: &View, image: &mut Image, blades: &[[DVec3; 2]], colour: [f64; 3]) {
    for w in blades.windows(2) {
        view.triangle(image, [w[0][0], w[0][1], w[1][0]], colour);
        view.triangle(image, [w[1][0], w[0][1], w[1][1]], colour);
        for (from, to) in [(w[0][0], w[1][0]), (w[0][1], w[1][1]), (w[0][1], w[1][0])] {
            view.line(image, from, to, BLACK);
        }
    }
    for b in blades {
        view.line(image, b[0], b[1], BLACK);
    }
}

pub(super) fn draw() -> Result<Vec<Drawn>, StudyError> {
    let settings = GridSettings {
        spacing: 0.02,
        inflate: 0.35,
        most_points: 1 << 24,
    };
    let blades = blades();
    let grid = EnrichmentGrid::from_blades(&blades, &settings)?;
    let of = |p: DVec3| grid.look_up(p).unwrap_or_else(|| grid.evaluate(p));

    // Figures 29 to 31: the strip, its projection onto the common plane, separators and regions.
    let view = View::from(DVec3::new(-0.5, -1.0, 1.3));
    let (origin, normal) = grid.frame();
    let project = |p: DVec3| p - normal.dot(p - origin) * normal;
    let flat: Vec<[DVec3; 2]> = blades.iter().map(|b| b.map(project)).collect();
    let mut image = Image::new();
    view.frame(&mut image);
    strip(&view, &mut image, &blades, RED);
    strip(&view, &mut image, &flat, BLUE);
    view.arrow(&mut image, origin, origin - 0.35 * normal, BLACK);
    let mut drawn = vec![Drawn::new(29, "the strip (red) and its projection", &image)];

    let along_normal = View::from(DVec3::new(-0.3, -1.0, 0.2));
    let mut image = Image::new();
    along_normal.frame(&mut image);
    strip(&along_normal, &mut image, &flat, BLUE);
    for [p, q] in &flat[1..flat.len() - 1] {
        let along = normal.cross(*q - *p).normalize();
        let [p, q] = [*p, *q].map(|end| end + 0.02 * along_normal.toward());
        along_normal.line(&mut image, p - 0.4 * (q - p), q + 0.4 * (q - p), RED);
        let from = p.midpoint(q);
        along_normal.arrow(&mut image, from, from + 0.06 * along, RED);
    }
    drawn.push(Drawn::new(30, "separators", &image));

    let mut image = Image::new();
    view.frame(&mut image);
    for plane in [0, 1, 2] {
        const CELLS: u32 = 60;
        for k in 0..CELLS * CELLS {
            let corner = |x: u32, y: u32| {
                let (u, v) = (
                    f64::from(k % CELLS + x) / f64::from(CELLS),
                    f64::from(k / CELLS + y) / f64::from(CELLS),
                );
                [
                    DVec3::new(1.0, u, v),
                    DVec3::new(u, 1.0, v),
                    DVec3::new(u, v, 0.0),
                ][plane]
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            let colour = region_colour(grid.evaluate(a.midpoint(c)).region);
            view.triangle(&mut image, [a, b, c], colour);
            view.triangle(&mut image, [a, c, d], colour);
        }
    }
    for (region, w) in (0..).zip(blades.windows(2)) {
        strip(&view, &mut image, w, region_colour(region));
    }
    drawn.push(Drawn::new(31, "regions", &image));

    // Figures 32 to 36 and 67 in slices, three views each of 32, 33 and 67.
    let slices: [(&str, Slice, u32); 3] = [
        ("across-z", |p| DVec3::new(p.x, p.y, 0.5), 34),
        ("across-x", |p| DVec3::new(0.5, p.y, p.x), 35),
        ("along", |p| DVec3::new(p.x, 0.55, p.y), 36),
    ];
    for (name, place, phi) in slices {
        let fields: [Plot<'_>; 4] = [
            Plot((32, "d2+"), &|p| of(place(p)).d_plus, [-0.3, 0.3], 12),
            Plot((33, "s"), &|p| of(place(p)).s, [-0.5, 0.5], 20),
            Plot((phi, "phi"), &|p| of(place(p)).phi, [-1.0, 1.0], 20),
            Plot((67, "d3"), &|p| of(place(p)).distance, [-0.5, 0.5], 20),
        ];
        for Plot((number, what), field, range, levels) in fields {
            let mut image = Image::new();
            image.field(field, range, levels);
            drawn.push(Drawn::new(number, format!("{what}, {name}"), &image));
        }
    }

    // Figure 37: the level sets of the enrichment (1 + phi) / 2. Its sets of 1 and 0 fill the prisms
    // beside the cut; what is drawn is their hull.
    let view = View::from(DVec3::new(-0.6, -1.0, 0.5));
    for (name, level) in [("(a) 1", 0.98), ("(b) 0.5", 0.5), ("(c) 0", 0.02)] {
        let mut image = Image::new();
        view.frame(&mut image);
        let h = |p: DVec3| 0.5 * (1.0 + grid.evaluate(p).phi);
        view.level_set(&mut image, h, level, [120.0, 200.0, 160.0]);
        strip(&view, &mut image, &blades, RED);
        drawn.push(Drawn::new(37, name, &image));
    }
    // Figure 68: level sets of d3, in node spacings of a fifth of the cut's length.
    for (name, level) in [("(a) 0.5 spacings", 0.5), ("(b) 1.5 spacings", 1.5)] {
        let mut image = Image::new();
        view.frame(&mut image);
        let d3 = |p: DVec3| grid.evaluate(p).distance / 0.12;
        view.level_set(&mut image, d3, level, [120.0, 200.0, 160.0]);
        strip(&view, &mut image, &blades, RED);
        drawn.push(Drawn::new(68, name, &image));
    }
    // Figure 66: the nodes whose supports the cut meets, by looking d3 up, on a lattice of nodes.
    let nodes: Vec<DVec3> = (0..9 * 9 * 9)
        .map(|k| DVec3::new(f64::from(k % 9), f64::from(k / 9 % 9), f64::from(k / 81)) / 8.0)
        .collect();
    let touched = grid.touched_nodes(&nodes, &vec![0.12; nodes.len()]);
    let mut image = Image::new();
    view.frame(&mut image);
    strip(&view, &mut image, &blades, RED);
    for (node, &at) in (0..).zip(&nodes) {
        let is_touched = touched.binary_search(&node).is_ok();
        let (size, colour) = if is_touched {
            (0.014, BLUE)
        } else {
            (0.006, [170.0; 3])
        };
        for axis in DVec3::AXES {
            view.line(&mut image, at - size * axis, at + size * axis, colour);
        }
    }
    drawn.push(Drawn::new(66, "touched (blue)", &image));
    Ok(drawn)
}
