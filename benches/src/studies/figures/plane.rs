//! Figures 18 and 20 to 28: cuts in the plane.

use glam::{DVec2, DVec3};
use phyxel_enrich::{
    CutSettings, Cuts, EnrichmentGrid, GridSettings, Rule, product_of_segments, segment_enrichment,
};
use phyxel_mls::kernel;

use super::Drawn;
use super::canvas::{Image, Plot, View, hue};
use crate::StudyError;

const BLACK: [f64; 3] = [0.0; 3];

/// A field with level lines and a polyline over it.
fn picture(field: impl Fn(DVec2) -> f64, range: [f64; 2], levels: u32, line: &[DVec2]) -> Image {
    let mut image = Image::new();
    image.field(field, range, levels);
    image.polyline(line, BLACK);
    image
}

/// A field over the unit square as a surface in space, height and colour by value.
fn surface(field: impl Fn(DVec2) -> f64, range: [f64; 2]) -> Image {
    const CELLS: u32 = 120;
    let view = View::from(DVec3::new(-0.7, -1.0, 0.9));
    let mut image = Image::new();
    view.frame(&mut image);
    let share = |p: DVec2| ((field(p) - range[0]) / (range[1] - range[0])).clamp(0.0, 1.0);
    for k in 0..CELLS * CELLS {
        let low = DVec2::new(f64::from(k % CELLS), f64::from(k / CELLS)) / f64::from(CELLS);
        let step = 1.0 / f64::from(CELLS);
        let corner = |x: f64, y: f64| {
            let p = low + step * DVec2::new(x, y);
            p.extend(share(p))
        };
        let [a, b, c, d] = [
            corner(0.0, 0.0),
            corner(1.0, 0.0),
            corner(1.0, 1.0),
            corner(0.0, 1.0),
        ];
        // Lines of the surface, as of a net.
        let net = (k % CELLS).is_multiple_of(8) || (k / CELLS).is_multiple_of(8);
        let colour = hue(0.25 * (a.z + b.z + c.z + d.z)).map(|v| if net { 0.7 * v } else { v });
        view.triangle(&mut image, [a, b, c], colour);
        view.triangle(&mut image, [a, c, d], colour);
    }
    image
}

/// Factor between a point and a probe: what a node there knows of the other.
fn factor(rule: Rule, cuts: &Cuts, p: DVec2, probe: DVec2) -> f64 {
    let inside = |p: DVec3| p.cmpge(DVec3::ZERO).all() && p.cmple(DVec3::ONE).all();
    let reach = 3.0 * p.distance(probe).max(1e-9);
    let (a, b) = (p.extend(0.0), probe.extend(0.0));
    rule.factor(cuts, a, b, reach, &inside)
}

/// A cut along a polyline of the plane, by upright blades.
fn upright(line: &[DVec2]) -> Result<Cuts, StudyError> {
    let blade = |p: DVec2| [p.extend(-2.0), p.extend(2.0)];
    let mut cuts = Cuts::new(&CutSettings::for_spacing(0.02));
    let stroke = cuts.start(&blade(line[0]))?;
    for &point in &line[1..] {
        cuts.append(stroke, &blade(point))?;
    }
    Ok(cuts)
}

pub(super) fn draw() -> Result<Vec<Drawn>, StudyError> {
    let settings = GridSettings {
        spacing: 0.01,
        inflate: 0.5,
        most_points: 1 << 24,
    };
    let mut drawn = one_segment()?;

    let on_grid = |grid: &EnrichmentGrid, p: DVec2| {
        let p = p.extend(0.0);
        grid.look_up(p).unwrap_or(grid.evaluate(p))
    };
    let inside = [[0.15, 0.35], [0.4, 0.5], [0.6, 0.48], [0.85, 0.7]].map(DVec2::from);
    let through = [[-0.3, 0.35], [0.3, 0.55], [0.65, 0.45], [1.3, 0.7]].map(DVec2::from);
    for (name, line) in [("inside", inside), ("through", through)] {
        let mut defaults = Vec::new();
        for pieces in 1..=3 {
            let line = &line[..=pieces];
            let grid = EnrichmentGrid::from_polyline(line, &settings)?;
            let label = format!("{name}-{pieces}");
            // Figure 24: the common frame, turning as the cut grows.
            let mut image = Image::new();
            let (origin, normal) = grid.frame();
            let (origin, along) = (origin.truncate(), -normal.truncate().perp());
            image.polyline(&[origin - 2.0 * along, origin + 2.0 * along], [200.0; 3]);
            image.arrow(origin, origin + 0.3 * along, [40.0, 70.0, 200.0]);
            image.arrow(origin, origin + 0.3 * along.perp(), [40.0, 150.0, 60.0]);
            image.polyline(line, [200.0, 40.0, 40.0]);
            drawn.push(Drawn::new(24, format!("frame, {label}"), &image));
            let fields: [Plot<'_>; 5] = [
                Plot(
                    (23, "product"),
                    &|p| product_of_segments(line, p),
                    [0.0, 1.0],
                    10,
                ),
                Plot((25, "d1+"), &|p| on_grid(&grid, p).d_plus, [-0.3, 0.3], 12),
                Plot(
                    (26, "regions"),
                    &|p| f64::from(on_grid(&grid, p).region),
                    [-0.5, 2.5],
                    3,
                ),
                Plot((27, "s"), &|p| on_grid(&grid, p).s, [-0.5, 0.5], 20),
                Plot(
                    (28, "grid"),
                    &|p| 0.5 * (1.0 + on_grid(&grid, p).phi),
                    [0.0, 1.0],
                    10,
                ),
            ];
            for Plot(what, field, range, levels) in fields {
                let (number, what) = what;
                let image = picture(field, range, levels, line);
                drawn.push(Drawn::new(number, format!("{what}, {label}"), &image));
            }
            let cuts = upright(line)?;
            let probe = DVec2::new(0.5, 0.65);
            let image = picture(
                |p| factor(Rule::Diffraction, &cuts, p, probe),
                [0.0, 1.0],
                10,
                line,
            );
            defaults.push(Drawn::new(28, format!("default, {label}"), &image));
        }
        // In a row below those of the grid.
        drawn.append(&mut defaults);
    }
    drawn.extend(influences()?);
    Ok(drawn)
}

/// Figure 18: the weight of a node beside the tip of a cut.
fn influences() -> Result<Vec<Drawn>, StudyError> {
    let line = [DVec2::new(-0.3, 0.5), DVec2::new(0.55, 0.5)];
    let cuts = upright(&line)?;
    let (node, radius) = (DVec2::new(0.4, 0.38), 0.45);
    let rules = [
        (Rule::Visibility, "(a) visibility"),
        (Rule::Diffraction, "(b) diffraction"),
    ];
    let drawn = rules.into_iter().map(|(rule, caption)| {
        let weight = |p: DVec2| {
            let kernel = kernel(p.distance(node) / radius);
            if kernel > 0.0 {
                kernel * factor(rule, &cuts, p, node)
            } else {
                0.0
            }
        };
        Drawn::new(18, caption, &picture(weight, [0.0, 1.2], 12, &line))
    });
    Ok(drawn.collect())
}

/// Figures 20 to 22.
fn one_segment() -> Result<Vec<Drawn>, StudyError> {
    let settings = GridSettings {
        spacing: 0.02,
        inflate: 0.1,
        most_points: 1 << 24,
    };
    // Figure 20: d1⁺ along the axis of the cut from t = 0 to 1, drawn for t from -1 to 2.
    let unit = EnrichmentGrid::from_polyline(&[DVec2::ZERO, DVec2::X], &settings)?;
    let mut image = Image::new();
    let axis = |t: f64, value: f64| DVec2::new((t + 1.0) / 3.0, 0.2 + 0.6 * value);
    image.polyline(&[axis(-1.0, 0.0), axis(2.0, 0.0)], [150.0; 3]);
    image.polyline(&[axis(0.0, 0.0), axis(0.0, 1.0)], [150.0; 3]);
    for t in [0.0, 1.0] {
        image.polyline(&[axis(t, -0.03), axis(t, 0.03)], BLACK);
    }
    let curve: Vec<DVec2> = (0..=300)
        .map(|k| f64::from(k) / 100.0 - 1.0)
        .map(|t| axis(t, unit.evaluate(DVec3::X * t).d_plus))
        .collect();
    image.polyline(&curve, [200.0, 40.0, 40.0]);
    let mut drawn = vec![Drawn::new(20, "d1+ over t", &image)];

    let segment = [DVec2::new(0.3, 0.5), DVec2::new(0.7, 0.5)];
    let one = EnrichmentGrid::from_polyline(&segment, &settings)?;
    let of = |p: DVec2| one.evaluate(p.extend(0.0));
    let image = surface(|p| of(p).distance, [0.0, 0.7]);
    drawn.push(Drawn::new(21, "(a) d2", &image));
    let image = surface(|p| of(p).phi, [-1.0, 1.0]);
    drawn.push(Drawn::new(21, "(b) phi", &image));
    let image = picture(
        |p| segment_enrichment(segment, p),
        [-1.0, 1.0],
        20,
        &segment,
    );
    drawn.push(Drawn::new(22, "phi", &image));
    Ok(drawn)
}
