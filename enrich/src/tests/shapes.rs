//! Cuts of every shape in the unit square and the unit cube, by name.

use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};
use testkit::cloud;

/// Polylines of one plane case.
pub(crate) type Lines = Vec<Vec<DVec2>>;
/// Blade edges of the strokes of one case in space.
pub(crate) type Strokes = Vec<Vec<Vec<DVec3>>>;

fn line(points: &[[f64; 2]]) -> Vec<DVec2> {
    points.iter().map(|&p| DVec2::from(p)).collect()
}

pub(crate) fn curve(count: u32, at: impl Fn(f64) -> [f64; 2]) -> Vec<DVec2> {
    (0..=count)
        .map(|k| DVec2::from(at(f64::from(k) / f64::from(count))))
        .collect()
}

/// Plane cases: name, number of pieces of more than 3 nodes that must be left, polylines.
const PLANE: &str = "\
figure 23, inside | 1 | 0.15 0.35, 0.4 0.5, 0.6 0.48, 0.85 0.7
figure 23, through | 2 | -0.3 0.35, 0.3 0.55, 0.65 0.45, 1.3 0.7
kink of 90 degrees | 1 | 0.25 0.253, 0.653 0.253, 0.653 0.7
kink of 150 degrees | 1 | 0.2 0.3, 0.8 0.5, 0.25 0.62
wide U-turn | 1 | 0.3 0.9, 0.3 0.3, 0.7 0.3, 0.7 0.9
thin U-turn | 1 | 0.2 0.49, 0.8 0.49, 0.8 0.511, 0.2 0.511
Y-branch | 1 | 0.1 0.2, 0.5 0.5, 0.9 0.25; 0.5 0.5, 0.5 0.95
T-crossing | 3 | -0.2 0.503, 1.2 0.503; 0.497 0.503, 0.497 1.2
X-crossing | 1 | 0.2 0.2, 0.8 0.8; 0.2 0.78, 0.8 0.22
self-intersecting | 2 | 0.15 0.4, 0.8 0.45, 0.75 0.8, 0.45 0.75, 0.4 0.15
sliver between parallels | 1 | 0.2 0.5, 0.8 0.5; 0.2 0.52, 0.8 0.52
sliver, opposite strokes | 1 | 0.2 0.5, 0.8 0.5; 0.8 0.52, 0.2 0.52
ends inside | 1 | -0.2 0.45, 0.3 0.5, 0.55 0.62
through nodes, ends inside | 1 | -0.2 0.5208333333333333, 0.5 0.5208333333333333
through nodes | 2 | -0.2 0.5208333333333333, 1.2 0.5208333333333333
through nodes, oblique | 2 | -0.5 -0.5, 1.5 1.5
repeated points | 1 | 0.2 0.4, 0.2 0.4, 0.5 0.55, 0.5 0.55, 0.5 0.55, 0.8 0.4, 0.8 0.4
retraced path | 1 | 0.2 0.4, 0.5 0.55, 0.8 0.45, 0.5 0.55, 0.2 0.4
zigzag | 1 | 0.15 0.4, 0.3 0.6, 0.45 0.4, 0.6 0.6, 0.75 0.4, 0.9 0.6
leaves and re-enters | 3 | 0.3 -0.1, 0.35 0.4, 1.2 0.45, 1.2 0.7, -0.2 0.75
closed square | 2 | 0.253 0.253, 0.747 0.253, 0.747 0.747, 0.253 0.747, 0.253 0.253
outside of the body | 1 | 1.1 0.2, 1.4 0.9
gap within the tolerance | 2 | -0.2 0.51, 0.5 0.51; 0.502 0.511, 1.2 0.51
comb | 2 | -0.1 0.303, 1.1 0.303; 0.3 0.303, 0.3 0.8; 0.6 0.303, 0.6 0.8
one long line | 2 | -1e6 -299999.6, 1e6 300000.4";

/// Cases in space: name, number of pieces, blade edges of 2 points; a stroke begins after each `/`.
const SPACE: &str = "\
half depth | 1 | -0.2 0.51 0.45, -0.2 0.51 1.3; 0.3 0.52 0.45, 0.3 0.52 1.3; 0.8 0.49 0.45, 0.8 0.49 1.3; 1.2 0.51 0.45, 1.2 0.51 1.3
corner inside | 1 | -0.2 0.51 0.45, -0.2 0.51 1.3; 0.55 0.51 0.45, 0.55 0.51 1.3
fold flat back | 1 | 0.2 0.3 0.5, 0.2 0.7 0.5; 0.8 0.3 0.5, 0.8 0.7 0.5; 0.2 0.3 0.51, 0.2 0.7 0.51
plane overshooting by 0.01 | 2 | -0.01 0.503 -0.01, -0.01 0.503 1.01; 1.01 0.503 -0.01, 1.01 0.503 1.01
plane through nodes | 2 | -0.3 0.5416666666666666 -0.3, -0.3 0.5416666666666666 1.3; 1.3 0.5416666666666666 -0.3, 1.3 0.5416666666666666 1.3
oblique plane | 2 | -0.5 -0.4 -0.2, -0.5 1.4 -0.6; 1.5 -0.4 1.5, 1.5 1.4 1.3
two planes crossing | 1 | 0.2 0.503 0.2, 0.2 0.503 0.8; 0.8 0.503 0.2, 0.8 0.503 0.8 / 0.503 0.2 0.2, 0.503 0.2 0.8; 0.503 0.8 0.2, 0.503 0.8 0.8
inner square | 1 | 0.3 0.3 0.503, 0.3 0.7 0.503; 0.7 0.3 0.503, 0.7 0.7 0.503";

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace()
        .map(|number| number.parse().unwrap())
        .collect()
}

/// All plane cases: name, polylines, number of pieces of more than 3 nodes that must be left.
pub(crate) fn plane() -> Vec<(&'static str, Lines, usize)> {
    let point = |text: &str| DVec2::from_slice(&numbers(text));
    let mut all: Vec<(&'static str, Lines, usize)> = Vec::new();
    for case in PLANE.lines() {
        let fields: Vec<&'static str> = case.split(" | ").collect();
        let lines = fields[2].split(';');
        let lines = lines.map(|line| line.split(',').map(point).collect());
        all.push((fields[0], lines.collect(), fields[1].parse().unwrap()));
    }
    let circle = |from: f64, to: f64| {
        curve(24, move |t| {
            let (sin, cos) = (from + (to - from) * t).sin_cos();
            [0.5 + 0.27 * cos, 0.5 + 0.27 * sin]
        })
    };
    let mut closed = circle(0.0, TAU);
    closed[24] = closed[0];
    let spiral = |t: f64| {
        let (sin, cos) = (2.0 * TAU * t).sin_cos();
        let r = 0.08 + 0.3 * t;
        [0.5 + r * cos, 0.5 + r * sin]
    };
    let hook = |t: f64| {
        [
            0.3 + 0.4 * t + 0.1 * (3.0 * PI * t).sin(),
            0.3 + 0.3 * t * t + 0.12 * (2.0 * PI * t).sin(),
        ]
    };
    let diced = [0.253, 0.497, 0.741];
    let diced = diced.map(|c| [line(&[[c, -0.1], [c, 1.1]]), line(&[[-0.1, c], [1.1, c]])]);
    let star = |k: u32| {
        let (sin, cos) = (TAU * f64::from(k) / 5.0).sin_cos();
        line(&[[0.503, 0.497], [0.503 + 0.35 * cos, 0.497 + 0.35 * sin]])
    };
    let dust = |k: u64| {
        let mut random = cloud::Random::new(900 + k);
        let at = DVec2::new(random.unit(), random.unit());
        let way = DVec2::new(random.unit() - 0.5, random.unit() - 0.5);
        vec![at, at + 0.02 * way]
    };
    let straight = curve(6, |t| [0.2 + 0.6 * t, 0.503]);
    let s_curve = curve(24, |t| [0.2 + 0.6 * t, 0.5 + 0.2 * (TAU * t).sin()]);
    all.extend([
        ("straight, 6 segments", vec![straight], 1),
        ("closed circle", vec![closed], 2),
        ("almost closed circle", vec![circle(0.1, TAU - 0.25)], 1),
        ("spiral of two turns", vec![curve(48, spiral)], 1),
        ("S-curve, 24 segments", vec![s_curve], 1),
        ("diced", diced.concat(), 16),
        ("star of five", (0..5).map(star).collect(), 1),
        ("hook", vec![curve(30, hook)], 1),
        ("dust of tiny pieces", (0..60).map(dust).collect(), 1),
    ]);
    all
}

/// Upright strips over plane polylines.
pub(crate) fn extruded(lines: &Lines, low: f64, high: f64) -> Strokes {
    let blade = |p: &DVec2| vec![p.extend(low), p.extend(high)];
    lines
        .iter()
        .map(|l| l.iter().map(blade).collect())
        .collect()
}

fn twist(turn: f64) -> Strokes {
    let blade = |k: u32| {
        let t = f64::from(k) / 16.0;
        let (sin, cos) = (turn * t).sin_cos();
        let x = 0.05 + 0.9 * t;
        let arm = DVec3::new(0.0, 0.35 * cos, 0.35 * sin);
        let mid = DVec3::new(x, 0.5, 0.5);
        vec![mid - arm, mid + arm]
    };
    vec![(0..=16).map(blade).collect()]
}

/// All cases in space: name, strokes, number of pieces of more than 3 nodes that must be left.
pub(crate) fn space() -> Vec<(String, Strokes, usize)> {
    // A third case of the plane ends in a cloud's cell boundaries only by chance in space.
    let skipped = [
        "diced",
        "through nodes, oblique",
        "one long line",
        "dust of tiny pieces",
    ];
    let mut all: Vec<(String, Strokes, usize)> = Vec::new();
    for (name, lines, parts) in plane() {
        if !skipped.contains(&name) {
            let upright = extruded(&lines, -0.3, 1.3);
            all.push((format!("{name}, upright"), upright, parts));
        }
    }
    let point = |text: &str| DVec3::from_slice(&numbers(text));
    let edge = |text: &str| text.split(',').map(point).collect();
    let stroke = |text: &str| text.split(';').map(edge).collect();
    for case in SPACE.lines() {
        let fields: Vec<&str> = case.split(" | ").collect();
        let strokes = fields[2].split('/').map(stroke).collect();
        all.push((fields[0].to_owned(), strokes, fields[1].parse().unwrap()));
    }
    for turn in [90.0, 180.0, 360.0] {
        let strokes = twist(f64::to_radians(turn));
        all.push((format!("twist of {turn} degrees"), strokes, 1));
    }
    // A blade of so many points in the plane at each of so many places along x.
    let sheet = |places: u32, points: &dyn Fn(u32) -> u32, height: &dyn Fn(f64, f64) -> f64| {
        let blade = |k: u32| {
            let (x, n) = (-0.2 + 1.4 * f64::from(k) / f64::from(places), points(k));
            let point = |m: u32| {
                let y = -0.2 + 1.4 * f64::from(m) / f64::from(n - 1);
                DVec3::new(x, y, height(x, y))
            };
            (0..n).map(point).collect()
        };
        vec![(0..=places).map(blade).collect()]
    };
    let helicoid = |k: u32| {
        let t = f64::from(k) / 32.0;
        let (sin, cos) = (2.0 * TAU * t).sin_cos();
        let at = |r: f64| DVec3::new(0.5 + r * cos, 0.5 + r * sin, 0.15 + 0.7 * t);
        vec![at(0.06), at(0.4)]
    };
    let plug = |k: u32| {
        let (sin, cos) = (TAU * f64::from(k % 24) / 24.0).sin_cos();
        let at = DVec2::new(0.5 + 0.3 * cos, 0.5 + 0.3 * sin);
        vec![at.extend(0.5), at.extend(1.3)]
    };
    let wavy = curve(24, |t| [-0.3 + 1.6 * t, 0.5 + 0.1 * (2.0 * TAU * t).sin()]);
    let dome = |k: u32| -> Vec<DVec3> {
        let (sin, cos) = (0.35 * PI * f64::from(k) / 6.0 + 0.02).sin_cos();
        let at = |m: u32| {
            let (s, c) = (TAU * f64::from(m % 20) / 20.0).sin_cos();
            DVec3::new(0.5 + 0.4 * sin * c, 0.5 + 0.4 * sin * s, 0.3 + 0.4 * cos)
        };
        (0..=20).map(at).collect()
    };
    let c = |x: f64, y: f64, z: f64| DVec3::splat(0.253) + 0.5 * DVec3::new(x, y, z);
    let wall = |[x, y]: [f64; 2]| vec![c(x, y, 0.0), c(x, y, 1.0)];
    let walls = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]].map(wall);
    let lid = |z| {
        vec![
            vec![c(0.0, 0.0, z), c(1.0, 0.0, z)],
            vec![c(0.0, 1.0, z), c(1.0, 1.0, z)],
        ]
    };
    let wave = |x: f64, y: f64| 0.5 + 0.08 * (7.0 * x).sin() * (5.0 * y).cos();
    let cases: [(&str, Strokes, usize); 7] = [
        (
            "helicoid of two turns",
            vec![(0..=32).map(helicoid).collect()],
            1,
        ),
        (
            "cylinder plug of half depth",
            vec![(0..=24).map(plug).collect()],
            1,
        ),
        ("wavy, 24 segments", extruded(&vec![wavy], -0.3, 1.3), 2),
        ("wavy blade of 9 points", sheet(12, &|_| 9, &wave), 2),
        (
            "blade changing from 2 to 7 points",
            sheet(9, &|k| [2, 7, 3, 5][k as usize % 4], &|_, _| 0.503),
            2,
        ),
        ("dome", vec![(0..=6).map(dome).collect()], 1),
        ("closed box", vec![walls.to_vec(), lid(0.0), lid(1.0)], 2),
    ];
    all.extend(cases.map(|(name, strokes, parts)| (name.to_owned(), strokes, parts)));
    all
}
