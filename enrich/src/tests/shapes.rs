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

fn curve(count: u32, at: impl Fn(f64) -> [f64; 2]) -> Vec<DVec2> {
    (0..=count)
        .map(|k| DVec2::from(at(f64::from(k) / f64::from(count))))
        .collect()
}

/// What must be left of the body.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Expect {
    /// Connected.
    One,
    /// This many pieces of more than 3 nodes.
    Parts(usize),
}

/// All plane cases: name, polylines, expectation.
pub(crate) fn plane() -> Vec<(&'static str, Lines, Expect)> {
    use Expect::{One, Parts};
    let circle = |from: f64, to: f64, radius: f64, count| {
        curve(count, move |t| {
            let (sin, cos) = (from + (to - from) * t).sin_cos();
            [0.5 + radius * cos, 0.5 + radius * sin]
        })
    };
    let mut closed = circle(0.0, TAU, 0.27, 24);
    closed[24] = closed[0];
    let s_curve = curve(24, |t| [0.2 + 0.6 * t, 0.5 + 0.2 * (TAU * t).sin()]);
    let mut retraced = line(&[[0.2, 0.4], [0.5, 0.55], [0.8, 0.45]]);
    retraced.extend(line(&[[0.5, 0.55], [0.2, 0.4]]));
    vec![
        (
            "straight, 6 segments",
            vec![curve(6, |t| [0.2 + 0.6 * t, 0.503])],
            One,
        ),
        (
            "figure 23, inside",
            vec![line(&[[0.15, 0.35], [0.4, 0.5], [0.6, 0.48], [0.85, 0.7]])],
            One,
        ),
        (
            "figure 23, through",
            vec![line(&[[-0.3, 0.35], [0.3, 0.55], [0.65, 0.45], [1.3, 0.7]])],
            Parts(2),
        ),
        (
            "kink of 90 degrees",
            vec![line(&[[0.25, 0.253], [0.653, 0.253], [0.653, 0.7]])],
            One,
        ),
        (
            "kink of 150 degrees",
            vec![line(&[[0.2, 0.3], [0.8, 0.5], [0.25, 0.62]])],
            One,
        ),
        (
            "wide U-turn",
            vec![line(&[[0.3, 0.9], [0.3, 0.3], [0.7, 0.3], [0.7, 0.9]])],
            One,
        ),
        (
            "thin U-turn",
            vec![line(&[
                [0.2, 0.49],
                [0.8, 0.49],
                [0.8, 0.511],
                [0.2, 0.511],
            ])],
            One,
        ),
        ("closed circle", vec![closed], Parts(2)),
        (
            "almost closed circle",
            vec![circle(0.1, TAU - 0.25, 0.27, 24)],
            One,
        ),
        (
            "spiral of two turns",
            vec![curve(48, |t| {
                let (sin, cos) = (2.0 * TAU * t).sin_cos();
                let r = 0.08 + 0.3 * t;
                [0.5 + r * cos, 0.5 + r * sin]
            })],
            One,
        ),
        (
            "Y-branch",
            vec![
                line(&[[0.1, 0.2], [0.5, 0.5], [0.9, 0.25]]),
                line(&[[0.5, 0.5], [0.5, 0.95]]),
            ],
            One,
        ),
        (
            "T-crossing",
            vec![
                line(&[[-0.2, 0.503], [1.2, 0.503]]),
                line(&[[0.497, 0.503], [0.497, 1.2]]),
            ],
            Parts(3),
        ),
        (
            "X-crossing",
            vec![
                line(&[[0.2, 0.2], [0.8, 0.8]]),
                line(&[[0.2, 0.78], [0.8, 0.22]]),
            ],
            One,
        ),
        (
            "self-intersecting",
            vec![line(&[
                [0.15, 0.4],
                [0.8, 0.45],
                [0.75, 0.8],
                [0.45, 0.75],
                [0.4, 0.15],
            ])],
            Parts(2),
        ),
        (
            "sliver between parallels",
            vec![
                line(&[[0.2, 0.5], [0.8, 0.5]]),
                line(&[[0.2, 0.52], [0.8, 0.52]]),
            ],
            One,
        ),
        (
            "sliver, opposite strokes",
            vec![
                line(&[[0.2, 0.5], [0.8, 0.5]]),
                line(&[[0.8, 0.52], [0.2, 0.52]]),
            ],
            One,
        ),
        (
            "ends inside",
            vec![line(&[[-0.2, 0.45], [0.3, 0.5], [0.55, 0.62]])],
            One,
        ),
        (
            "through nodes, ends inside",
            vec![line(&[
                [-0.2, 12.5 * (1.0 / 24.0)],
                [0.5, 12.5 * (1.0 / 24.0)],
            ])],
            One,
        ),
        (
            "through nodes",
            vec![line(&[
                [-0.2, 12.5 * (1.0 / 24.0)],
                [1.2, 12.5 * (1.0 / 24.0)],
            ])],
            Parts(2),
        ),
        (
            "through nodes, oblique",
            vec![line(&[[-0.5, -0.5], [1.5, 1.5]])],
            Parts(2),
        ),
        (
            "repeated points",
            vec![line(&[
                [0.2, 0.4],
                [0.2, 0.4],
                [0.5, 0.55],
                [0.5, 0.55],
                [0.5, 0.55],
                [0.8, 0.4],
                [0.8, 0.4],
            ])],
            One,
        ),
        ("S-curve, 24 segments", vec![s_curve], One),
        ("retraced path", vec![retraced], One),
        (
            "zigzag",
            vec![line(&[
                [0.15, 0.4],
                [0.3, 0.6],
                [0.45, 0.4],
                [0.6, 0.6],
                [0.75, 0.4],
                [0.9, 0.6],
            ])],
            One,
        ),
        (
            "leaves and re-enters",
            vec![line(&[
                [0.3, -0.1],
                [0.35, 0.4],
                [1.2, 0.45],
                [1.2, 0.7],
                [-0.2, 0.75],
            ])],
            Parts(3),
        ),
        (
            "closed square",
            vec![line(&[
                [0.253, 0.253],
                [0.747, 0.253],
                [0.747, 0.747],
                [0.253, 0.747],
                [0.253, 0.253],
            ])],
            Parts(2),
        ),
        (
            "diced",
            [0.253, 0.497, 0.741]
                .iter()
                .flat_map(|&c| [line(&[[c, -0.1], [c, 1.1]]), line(&[[-0.1, c], [1.1, c]])])
                .collect(),
            Parts(16),
        ),
        (
            "star of five",
            (0..5)
                .map(|k| {
                    let (sin, cos) = (TAU * f64::from(k) / 5.0).sin_cos();
                    line(&[[0.503, 0.497], [0.503 + 0.35 * cos, 0.497 + 0.35 * sin]])
                })
                .collect(),
            One,
        ),
        (
            "outside of the body",
            vec![line(&[[1.1, 0.2], [1.4, 0.9]])],
            One,
        ),
        (
            "gap within the tolerance",
            vec![
                line(&[[-0.2, 0.51], [0.5, 0.51]]),
                line(&[[0.502, 0.511], [1.2, 0.51]]),
            ],
            Parts(2),
        ),
        (
            "comb",
            vec![
                line(&[[-0.1, 0.303], [1.1, 0.303]]),
                line(&[[0.3, 0.303], [0.3, 0.8]]),
                line(&[[0.6, 0.303], [0.6, 0.8]]),
            ],
            Parts(2),
        ),
        (
            "hook",
            vec![curve(30, |t| {
                [
                    0.3 + 0.4 * t + 0.1 * (3.0 * PI * t).sin(),
                    0.3 + 0.3 * t * t + 0.12 * (2.0 * PI * t).sin(),
                ]
            })],
            One,
        ),
        (
            "one long line",
            vec![line(&[[-1e6, 0.4 - 3e5], [1e6, 0.4 + 3e5]])],
            Parts(2),
        ),
        (
            "dust of tiny pieces",
            (0..60)
                .map(|k| {
                    let mut random = cloud::Random::new(900 + k);
                    let at = DVec2::new(random.unit(), random.unit());
                    vec![
                        at,
                        at + 0.02 * DVec2::new(random.unit() - 0.5, random.unit() - 0.5),
                    ]
                })
                .collect(),
            One,
        ),
    ]
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

/// All cases in space: name, strokes, expectation.
pub(crate) fn space() -> Vec<(String, Strokes, Expect)> {
    use Expect::{One, Parts};
    // A third case of the plane ends in a cloud's cell boundaries only by chance in space.
    let skipped = [
        "diced",
        "through nodes, oblique",
        "one long line",
        "dust of tiny pieces",
    ];
    let mut all: Vec<(String, Strokes, Expect)> = plane()
        .into_iter()
        .filter(|(name, _, _)| !skipped.contains(name))
        .map(|(name, lines, expect)| {
            (
                format!("{name}, upright"),
                extruded(&lines, -0.3, 1.3),
                expect,
            )
        })
        .collect();
    let blade = |a: [f64; 3], b: [f64; 3]| vec![DVec3::from(a), DVec3::from(b)];
    let mut add =
        |name: &str, strokes: Strokes, expect| all.push((name.to_owned(), strokes, expect));
    add(
        "half depth",
        vec![vec![
            blade([-0.2, 0.51, 0.45], [-0.2, 0.51, 1.3]),
            blade([0.3, 0.52, 0.45], [0.3, 0.52, 1.3]),
            blade([0.8, 0.49, 0.45], [0.8, 0.49, 1.3]),
            blade([1.2, 0.51, 0.45], [1.2, 0.51, 1.3]),
        ]],
        One,
    );
    add(
        "corner inside",
        vec![vec![
            blade([-0.2, 0.51, 0.45], [-0.2, 0.51, 1.3]),
            blade([0.55, 0.51, 0.45], [0.55, 0.51, 1.3]),
        ]],
        One,
    );
    for turn in [90.0, 180.0, 360.0] {
        add(
            &format!("twist of {turn} degrees"),
            twist(f64::to_radians(turn)),
            One,
        );
    }
    add(
        "fold flat back",
        vec![vec![
            blade([0.2, 0.3, 0.5], [0.2, 0.7, 0.5]),
            blade([0.8, 0.3, 0.5], [0.8, 0.7, 0.5]),
            blade([0.2, 0.3, 0.51], [0.2, 0.7, 0.51]),
        ]],
        One,
    );
    add(
        "helicoid of two turns",
        vec![
            (0..=32)
                .map(|k| {
                    let t = f64::from(k) / 32.0;
                    let (sin, cos) = (2.0 * TAU * t).sin_cos();
                    let z = 0.15 + 0.7 * t;
                    vec![
                        DVec3::new(0.5 + 0.06 * cos, 0.5 + 0.06 * sin, z),
                        DVec3::new(0.5 + 0.4 * cos, 0.5 + 0.4 * sin, z),
                    ]
                })
                .collect(),
        ],
        One,
    );
    let ring = |radius: f64, low: f64, high: f64| -> Vec<Vec<DVec3>> {
        (0..=24)
            .map(|k| {
                let (sin, cos) = (TAU * f64::from(k % 24) / 24.0).sin_cos();
                let at = DVec2::new(0.5 + radius * cos, 0.5 + radius * sin);
                vec![at.extend(low), at.extend(high)]
            })
            .collect()
    };
    add(
        "cylinder plug of half depth",
        vec![ring(0.3, 0.5, 1.3)],
        One,
    );
    add(
        "plane overshooting by 0.01",
        extruded(&vec![line(&[[-0.01, 0.503], [1.01, 0.503]])], -0.01, 1.01),
        Parts(2),
    );
    add(
        "plane through nodes",
        extruded(
            &vec![line(&[
                [-0.3, 6.5 * (1.0 / 12.0)],
                [1.3, 6.5 * (1.0 / 12.0)],
            ])],
            -0.3,
            1.3,
        ),
        Parts(2),
    );
    add(
        "oblique plane",
        vec![vec![
            blade([-0.5, -0.4, -0.2], [-0.5, 1.4, -0.6]),
            blade([1.5, -0.4, 1.5], [1.5, 1.4, 1.3]),
        ]],
        Parts(2),
    );
    add(
        "wavy, 24 segments",
        extruded(
            &vec![curve(24, |t| {
                [-0.3 + 1.6 * t, 0.5 + 0.1 * (2.0 * TAU * t).sin()]
            })],
            -0.3,
            1.3,
        ),
        Parts(2),
    );
    add(
        "wavy blade of 9 points",
        vec![
            (0..=12)
                .map(|k| {
                    let x = -0.2 + 1.4 * f64::from(k) / 12.0;
                    (0..9)
                        .map(|m| {
                            let y = -0.2 + 1.4 * f64::from(m) / 8.0;
                            DVec3::new(x, y, 0.5 + 0.08 * (7.0 * x).sin() * (5.0 * y).cos())
                        })
                        .collect()
                })
                .collect(),
        ],
        Parts(2),
    );
    add(
        "blade changing from 2 to 7 points",
        vec![
            (0..=9)
                .map(|k| {
                    let x = -0.2 + 1.4 * f64::from(k) / 9.0;
                    let n = [2_u32, 7, 3, 5][k as usize % 4];
                    (0..n)
                        .map(|m| {
                            let y = -0.2 + 1.4 * f64::from(m) / f64::from(n - 1);
                            DVec3::new(x, y, 0.503)
                        })
                        .collect()
                })
                .collect(),
        ],
        Parts(2),
    );
    add(
        "dome",
        {
            let ring = |k: u32| -> Vec<DVec3> {
                let (sin, cos) = (0.35 * PI * f64::from(k) / 6.0 + 0.02).sin_cos();
                (0..=20)
                    .map(|m| {
                        let (s, c) = (TAU * f64::from(m % 20) / 20.0).sin_cos();
                        DVec3::new(0.5 + 0.4 * sin * c, 0.5 + 0.4 * sin * s, 0.3 + 0.4 * cos)
                    })
                    .collect()
            };
            vec![(0..=6).map(ring).collect()]
        },
        One,
    );
    add(
        "closed box",
        {
            let c = |x: u32, y: u32, z: u32| {
                DVec3::new(
                    0.253 + 0.5 * f64::from(x),
                    0.253 + 0.5 * f64::from(y),
                    0.253 + 0.5 * f64::from(z),
                )
            };
            let walls = vec![
                vec![c(0, 0, 0), c(0, 0, 1)],
                vec![c(1, 0, 0), c(1, 0, 1)],
                vec![c(1, 1, 0), c(1, 1, 1)],
                vec![c(0, 1, 0), c(0, 1, 1)],
                vec![c(0, 0, 0), c(0, 0, 1)],
            ];
            let lid = |z| vec![vec![c(0, 0, z), c(1, 0, z)], vec![c(0, 1, z), c(1, 1, z)]];
            vec![walls, lid(0), lid(1)]
        },
        Parts(2),
    );
    add(
        "two planes crossing",
        vec![
            vec![
                blade([0.2, 0.503, 0.2], [0.2, 0.503, 0.8]),
                blade([0.8, 0.503, 0.2], [0.8, 0.503, 0.8]),
            ],
            vec![
                blade([0.503, 0.2, 0.2], [0.503, 0.2, 0.8]),
                blade([0.503, 0.8, 0.2], [0.503, 0.8, 0.8]),
            ],
        ],
        One,
    );
    add(
        "inner square",
        vec![vec![
            blade([0.3, 0.3, 0.503], [0.3, 0.7, 0.503]),
            blade([0.7, 0.3, 0.503], [0.7, 0.7, 0.503]),
        ]],
        One,
    );
    all
}
