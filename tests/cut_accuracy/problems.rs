//! Cracks with a known answer. All ratios are to the reference named beside them.

use std::f64::consts::{PI, SQRT_2};

use glam::{DMat3, DVec3};
use phyxel_enrich::Cuts;

use super::body::{Body, CutBody, Form, POISSON, YOUNG};

/// Plane strain modulus.
fn plane_modulus() -> f64 {
    YOUNG / (1.0 - POISSON * POISSON)
}

/// Results relative to their references, and the times (s) of set-up, factors and rows.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ratios {
    pub(crate) first: f64,
    pub(crate) second: f64,
    pub(crate) seconds: [f64; 3],
}

/// A slab of one cell, held in its plane: plane strain.
fn slab(cells: [usize; 2], low: [f64; 2], high: [f64; 2], jitter: f64) -> Body {
    let dx = (high[0] - low[0]) / cells[0] as f64;
    Body::new(
        [cells[0], cells[1], 1],
        DVec3::new(low[0], low[1], 0.0),
        DVec3::new(high[0], high[1], dx),
        jitter,
    )
}

/// An upright cut along a line of the plane, in pieces of about a spacing.
fn upright(body: &Body, from: DVec3, to: DVec3) -> (Cuts, Vec<[DVec3; 2]>) {
    let count = (from.distance(to) / body.spacing).ceil() as u32;
    let reach = 4.0 * body.spacing * DVec3::Z;
    let blades: Vec<[DVec3; 2]> = (0..=count)
        .map(|k| from.lerp(to, f64::from(k) / f64::from(count)))
        .map(|p| [p - reach, p + reach])
        .collect();
    let mut cuts = body.cuts();
    let stroke = cuts.start(&blades[0]).unwrap();
    for blade in &blades[1..] {
        cuts.append(stroke, blade).unwrap();
    }
    cuts.end(stroke).unwrap();
    (cuts, blades)
}

/// Williams' near field of unit stress intensity in the frame of the tip, modes I and II.
fn near_field(mode: usize, p: [f64; 2]) -> [f64; 2] {
    let mu = YOUNG / (2.0 * (1.0 + POISSON));
    let kappa = 3.0 - 4.0 * POISSON;
    let (r, theta) = (p[0].hypot(p[1]), p[1].atan2(p[0]));
    let (s, c) = (0.5 * theta).sin_cos();
    let scale = (r / (2.0 * PI)).sqrt() / (2.0 * mu);
    if mode == 0 {
        [
            scale * c * (kappa - 1.0 + 2.0 * s * s),
            scale * s * (kappa + 1.0 - 2.0 * c * c),
        ]
    } else {
        [
            scale * s * (kappa + 1.0 + 2.0 * c * c),
            -scale * c * (kappa - 1.0 - 2.0 * s * s),
        ]
    }
}

fn stress(gradient: DMat3) -> DMat3 {
    let strain = 0.5 * (gradient + gradient.transpose());
    let mu = YOUNG / (2.0 * (1.0 + POISSON));
    let lame = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
    let trace = strain.x_axis.x + strain.y_axis.y + strain.z_axis.z;
    2.0 * mu * strain + lame * trace * DMat3::IDENTITY
}

fn contract(a: DMat3, b: DMat3) -> f64 {
    a.x_axis.dot(b.x_axis) + a.y_axis.dot(b.y_axis) + a.z_axis.dot(b.z_axis)
}

/// Stress intensities `K_I` and `K_II` by the interaction integral over a disc round the tip.
fn stress_intensities(
    cut: &CutBody<'_>,
    gradients: &[DMat3],
    tip: DVec3,
    along: DVec3,
    radius: f64,
) -> [f64; 2] {
    let body = cut.body;
    let thickness = body.high.z - body.low.z;
    let normal = DVec3::Z.cross(along);
    let turn = DMat3::from_cols(along, normal, DVec3::Z);
    let mut integrals = [0.0; 2];
    for (i, x) in body.x.iter().enumerate() {
        let d = (*x - tip).with_z(0.0);
        let q = d.length() / radius;
        if !(1e-9..1.0).contains(&q) {
            continue;
        }
        // Weight (1 - q²)², 1 at the tip.
        let local = turn.transpose() * d;
        let slope = -4.0 * (1.0 - q * q) / (radius * radius) * local;
        let gradient = turn.transpose() * gradients[i] * turn;
        let sigma = stress(gradient);
        for (mode, integral) in integrals.iter_mut().enumerate() {
            let step = 1e-6 * d.length();
            let field = |dx: f64, dy: f64| near_field(mode, [local.x + dx, local.y + dy]);
            let (px, mx) = (field(step, 0.0), field(-step, 0.0));
            let (py, my) = (field(0.0, step), field(0.0, -step));
            let column =
                |p: [f64; 2], m: [f64; 2]| DVec3::new(p[0] - m[0], p[1] - m[1], 0.0) / (2.0 * step);
            let other = DMat3::from_cols(column(px, mx), column(py, my), DVec3::ZERO);
            let other_sigma = stress(other);
            let flow = sigma.transpose() * other.x_axis + other_sigma.transpose() * gradient.x_axis;
            let energy = contract(sigma, 0.5 * (other + other.transpose()));
            *integral += cut.stencils.volumes[i] * (flow.dot(slope) - energy * slope.x);
        }
    }
    integrals.map(|integral| 0.5 * plane_modulus() * integral / thickness)
}

const IN_PLANE: DVec3 = DVec3::new(1.0, 1.0, 0.0);

/// Edge crack in a strip under tension, W 1, H 3 (Tada, Paris, Irwin: F and V of a single edge notch):
/// `K_I` and mouth opening. `shift` moves the tip and the cut's line by shares of a spacing.
pub(crate) fn edge_crack(cells: usize, jitter: f64, shift: [f64; 2], form: Form) -> Option<Ratios> {
    let body = slab([cells, 3 * cells], [0.0, 0.0], [1.0, 3.0], jitter);
    let dx = body.spacing;
    let (a, y) = (0.4 + shift[0] * dx, 1.5 + shift[1] * dx);
    let tip = DVec3::new(a, y, 0.5 * dx);
    let (cuts, blades) = upright(&body, DVec3::new(-2.0 * dx, y, 0.5 * dx), tip);
    let cut = CutBody::new(&body, &cuts, &blades, form)?;
    let mut forces = body.traction(|p| p.y > 3.0 - 1e-9, DVec3::Y);
    for (f, g) in forces
        .iter_mut()
        .zip(body.traction(|p| p.y < 1e-9, -DVec3::Y))
    {
        *f += g;
    }
    let u = cut.solve(&forces, |_| IN_PLANE);
    let gradients = cut.gradients(&u);
    let k = stress_intensities(&cut, &gradients, tip, DVec3::X, 6.0_f64.min(0.3 / dx) * dx);
    let shape = 1.12 - 0.231 * a + 10.55 * a.powi(2) - 21.72 * a.powi(3) + 30.39 * a.powi(4);
    let opening_shape = (1.46 + 3.42 * (1.0 - (0.5 * PI * a).cos())) / (0.5 * PI * a).cos().powi(2);
    let mouth = cut.opening(
        &cuts,
        &u,
        &gradients,
        DVec3::new(0.0, y, 0.5 * dx),
        DVec3::Y,
    );
    Some(Ratios {
        first: k[0] / (shape * (PI * a).sqrt()),
        second: mouth / (4.0 * a * opening_shape / plane_modulus()),
        seconds: cut.seconds,
    })
}

/// Centre crack, half width 1, half height 1.5, a 0.4 (Tada, Paris, Irwin): `K_I`, mean of both tips,
/// and opening at the middle.
pub(crate) fn centre_crack(cells: usize, shift: [f64; 2], form: Form) -> Option<Ratios> {
    let body = slab([cells, 3 * cells / 2], [-1.0, -1.5], [1.0, 1.5], 0.0);
    let dx = body.spacing;
    let a = 0.4;
    let middle = DVec3::new(shift[0] * dx, shift[1] * dx, 0.5 * dx);
    let tip = middle + a * DVec3::X;
    let (cuts, blades) = upright(&body, middle - a * DVec3::X, tip);
    let cut = CutBody::new(&body, &cuts, &blades, form)?;
    let mut forces = body.traction(|p| p.y > 1.5 - 1e-9, DVec3::Y);
    for (f, g) in forces
        .iter_mut()
        .zip(body.traction(|p| p.y < -1.5 + 1e-9, -DVec3::Y))
    {
        *f += g;
    }
    let u = cut.solve(&forces, |_| IN_PLANE);
    let gradients = cut.gradients(&u);
    let k: f64 = [DVec3::X, -DVec3::X]
        .map(|along| stress_intensities(&cut, &gradients, middle + a * along, along, 5.0 * dx)[0])
        .iter()
        .sum();
    let reference = (PI * a).sqrt()
        * (0.5 * PI * a).cos().recip().sqrt()
        * (1.0 - 0.025 * a * a + 0.06 * a.powi(4));
    let shape = -0.071 - 0.535 * a + 0.169 * a * a + 0.020 * a.powi(3) - 1.071 * (1.0 - a).ln() / a;
    let opening = cut.opening(&cuts, &u, &gradients, middle, DVec3::Y);
    Some(Ratios {
        first: 0.5 * k / reference,
        second: opening / (4.0 * a * shape / plane_modulus()),
        seconds: cut.seconds,
    })
}

/// Inner crack at 45 degrees, half width 1, half height 2, a 0.2: `K_I` and `K_II` against
/// `σ sqrt(π a) / 2`, means of both tips. The finite width adds 1 or 2 % to the reference.
pub(crate) fn inclined_crack(cells: usize, jitter: f64, form: Form) -> Option<Ratios> {
    let body = slab([cells, 2 * cells], [-1.0, -2.0], [1.0, 2.0], jitter);
    let dx = body.spacing;
    let a = 0.2;
    let middle = DVec3::new(0.11 * dx, 0.37 * dx, 0.5 * dx);
    let along = DVec3::new(1.0, 1.0, 0.0) / SQRT_2;
    let (cuts, blades) = upright(&body, middle - a * along, middle + a * along);
    let cut = CutBody::new(&body, &cuts, &blades, form)?;
    let mut forces = body.traction(|p| p.y > 2.0 - 1e-9, DVec3::Y);
    for (f, g) in forces
        .iter_mut()
        .zip(body.traction(|p| p.y < -2.0 + 1e-9, -DVec3::Y))
    {
        *f += g;
    }
    let u = cut.solve(&forces, |_| IN_PLANE);
    let gradients = cut.gradients(&u);
    let reference = 0.5 * (PI * a).sqrt();
    let mut means = [0.0; 2];
    for d in [along, -along] {
        let k = stress_intensities(&cut, &gradients, middle + a * d, d, 5.0 * dx);
        means[0] += 0.5 * k[0] / reference;
        means[1] += 0.5 * k[1].abs() / reference;
    }
    Some(Ratios {
        first: means[0],
        second: means[1],
        seconds: cut.seconds,
    })
}

/// Openings of a penny-shaped cut relative to the reference.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Penny {
    /// Mean over the face within 0.9 of the radius, and at the middle, of the displacement field.
    pub(crate) face: Ratios,
    /// Mean over the whole face by the work of the loads (what the cut adds to it is the stress times
    /// the opened volume), and mean at the nodes beside the cut, each by its own gradient.
    pub(crate) others: Ratios,
}

/// Penny-shaped cut of radius 0.35 in a cube of half width 1 under tension, `shift` spacings beside the
/// middle: opening against 1.0455 times Sneddon's half-space value (fine finite elements of the cube).
pub(crate) fn penny(cells: usize, jitter: f64, shift: DVec3, form: Form) -> Option<Penny> {
    let body = Body::new([cells; 3], -DVec3::ONE, DVec3::ONE, jitter);
    let a = 0.35;
    let between = if cells.is_multiple_of(2) { 0.5 } else { 0.0 };
    let middle = body.spacing * (shift + between * DVec3::Z);
    let (mut vertices, mut triangles) = (vec![middle], Vec::new());
    let count = 64_u32;
    for k in 0..count {
        let (s, c) = (2.0 * PI * f64::from(k) / f64::from(count)).sin_cos();
        vertices.push(middle + a * DVec3::new(c, s, 0.0));
        triangles.push([0, 1 + k, 1 + (k + 1) % count]);
    }
    let mut cuts = body.cuts();
    cuts.add_surface(&vertices, &triangles).unwrap();
    // A blade that sweeps a lens of the same disc, for the grid.
    let blades: Vec<[DVec3; 2]> = (0..=24)
        .map(|k| {
            let x = a * (-1.0 + f64::from(k) / 12.0) * 0.999;
            let y = (a * a - x * x).sqrt();
            [-y, y].map(|y| middle + DVec3::new(x, y, 0.0))
        })
        .collect();
    let cut = CutBody::new(&body, &cuts, &blades, form)?;
    let mut forces = body.traction(|p| p.z > 1.0 - 1e-9, DVec3::Z);
    for (f, g) in forces
        .iter_mut()
        .zip(body.traction(|p| p.z < -1.0 + 1e-9, -DVec3::Z))
    {
        *f += g;
    }
    let u = cut.solve(&forces, |_| DVec3::ONE);
    let stiff = 8.0 * (1.0 - POISSON * POISSON) / (PI * YOUNG);
    let sneddon = |r: f64| 1.0455 * stiff * (a * a - r * r).sqrt();
    let ratio = |sums: (f64, f64)| sums.0 / sums.1;
    // Points of the face in 18 rings, each with its share of the area.
    let mut face = (0.0, 0.0);
    for ring in 0..18_u32 {
        let r = a * (f64::from(ring) + 0.5) / 20.0;
        let points = 2 * ring + 4;
        let share = r / f64::from(points);
        for k in 0..points {
            let (s, c) = (2.0 * PI * (f64::from(k) + 0.3) / f64::from(points)).sin_cos();
            let at = middle + r * DVec3::new(c, s, 0.0);
            face.0 += share * cut.field_opening(&cuts, &u, at, DVec3::Z);
            face.1 += share * sneddon(r);
        }
    }
    let gradients = cut.gradients(&u);
    let mut at_nodes = (0.0, 0.0);
    for x in &body.x {
        let (above, r) = (x.z - middle.z, (*x - middle).truncate().length());
        if above > 0.0 && above < 0.99 * body.spacing && r < 0.9 * a {
            let at = x.with_z(middle.z);
            at_nodes.0 += cut.opening(&cuts, &u, &gradients, at, DVec3::Z);
            at_nodes.1 += sneddon(r);
        }
    }
    let work: f64 = forces.iter().zip(&u).map(|(f, u)| f.dot(*u)).sum();
    let volume = (work - 8.0 / YOUNG, 2.0 / 3.0 * PI * a * a * sneddon(0.0));
    Some(Penny {
        face: Ratios {
            first: ratio(face),
            second: cut.field_opening(&cuts, &u, middle, DVec3::Z) / sneddon(0.0),
            seconds: cut.seconds,
        },
        others: Ratios {
            first: ratio(volume),
            second: ratio(at_nodes),
            seconds: cut.seconds,
        },
    })
}

/// Beam 2 × 0.5 with clamped ends under its own weight, slit from below at the middle to half its
/// height: growth of the sag by the slit, and mouth, against finite elements (240 × 60, real slit).
pub(crate) fn gravity_slit(cells: usize, form: Form) -> Option<Ratios> {
    let body = slab([cells, cells / 4], [0.0, 0.0], [2.0, 0.5], 0.0);
    let dx = body.spacing;
    let x = 1.0 - 0.5 * dx;
    let (cuts, blades) = upright(
        &body,
        DVec3::new(x, -2.0 * dx, 0.5 * dx),
        DVec3::new(x, 0.25, 0.5 * dx),
    );
    let whole = CutBody::new(
        &body,
        &body.cuts(),
        &[],
        Form::Rule(phyxel_enrich::Rule::Detour),
    )?;
    let cut = CutBody::new(&body, &cuts, &blades, form)?;
    let forces = body.weight(-DVec3::Y);
    let hold = |p: DVec3| {
        if p.x < 1e-9 || p.x > 2.0 - 1e-9 {
            DVec3::ZERO
        } else {
            IN_PLANE
        }
    };
    let (uncut, u) = (whole.solve(&forces, hold), cut.solve(&forces, hold));
    let top = (0..body.x.len())
        .min_by(|&i, &j| {
            let d = |i: usize| body.x[i].distance_squared(DVec3::new(1.0, 0.5, 0.0));
            d(i).total_cmp(&d(j))
        })
        .unwrap();
    let gradients = cut.gradients(&u);
    let mouth = cut.opening(
        &cuts,
        &u,
        &gradients,
        DVec3::new(x, 0.0, 0.5 * dx),
        DVec3::X,
    );
    Some(Ratios {
        first: (u[top].y / uncut[top].y) / (0.004_234_3 / 0.003_216_9),
        second: mouth / 0.002_247_7,
        seconds: cut.seconds,
    })
}

/// Bar with a cut along half its length under uniform stress parallel to the cut, after the stroke is
/// finished: largest error of the stress at any node, relative. `finish` says whether it is.
pub(crate) fn parallel_stress(jitter: f64, finish: bool) -> f64 {
    let body = Body::new([16, 8, 2], DVec3::ZERO, DVec3::new(2.0, 1.0, 0.25), jitter);
    let z = 0.125;
    let (cuts, blades) = upright(&body, DVec3::new(-0.3, 0.53, z), DVec3::new(1.03, 0.53, z));
    let mut cut = CutBody::new(
        &body,
        &cuts,
        &blades,
        Form::Rule(phyxel_enrich::Rule::Detour),
    )
    .unwrap();
    if finish {
        let report = cut.finish(&cuts);
        assert!(
            report.moved > 0 && report.solve.residual < 1e-9,
            "{report:?}"
        );
    }
    let mut forces = body.traction(|p| p.x > 2.0 - 1e-9, DVec3::X);
    for (f, g) in forces
        .iter_mut()
        .zip(body.traction(|p| p.x < 1e-9, -DVec3::X))
    {
        *f += g;
    }
    let u = cut.solve(&forces, |_| DVec3::ONE);
    let exact = DMat3::from_cols(DVec3::X, DVec3::ZERO, DVec3::ZERO);
    cut.gradients(&u)
        .iter()
        .map(|g| {
            let error = stress(*g) - exact;
            contract(error, error).sqrt()
        })
        .fold(0.0, f64::max)
}

/// Mouth opening of an edge crack (m) with the stencils of the cut, of a set-up from the start that
/// then takes the finished cut's factors, and of a set-up with the cut's weights and the old boundary
/// vectors.
pub(crate) fn mouths() -> [f64; 3] {
    let body = slab([20, 40], [0.0, 0.0], [1.0, 2.0], 0.2);
    let dx = body.spacing;
    let y = 1.0 + 0.3 * dx;
    let (cuts, blades) = upright(
        &body,
        DVec3::new(-2.0 * dx, y, 0.5 * dx),
        DVec3::new(0.41, y, 0.5 * dx),
    );
    let form = Form::Rule(phyxel_enrich::Rule::Detour);
    let mut forces = body.traction(|p| p.y > 2.0 - 1e-9, DVec3::Y);
    for (f, g) in forces
        .iter_mut()
        .zip(body.traction(|p| p.y < 1e-9, -DVec3::Y))
    {
        *f += g;
    }
    let mouth = |cut: &CutBody<'_>| {
        let u = cut.solve(&forces, |_| IN_PLANE);
        let gradients = cut.gradients(&u);
        cut.opening(
            &cuts,
            &u,
            &gradients,
            DVec3::new(0.0, y, 0.5 * dx),
            DVec3::Y,
        )
    };
    let cut = CutBody::new(&body, &cuts, &blades, form).unwrap();
    let again = slab([20, 40], [0.0, 0.0], [1.0, 2.0], 0.2);
    let resumed = CutBody::new(&again, &cuts, &blades, form).unwrap();
    let mut trap = CutBody::new(&body, &cuts, &blades, form).unwrap();
    trap.stencils = super::body::glued(&cut);
    [mouth(&cut), mouth(&resumed), mouth(&trap)]
}

/// Largest change of a force by moving the nodes of one piece of a body after a through cut, before
/// and after the strokes are finished: on that piece, and on the rest.
pub(crate) fn force_across(strips: &[&[[DVec3; 2]]], piece: impl Fn(DVec3) -> bool) -> [f64; 2] {
    let body = Body::new([8; 3], DVec3::ZERO, DVec3::ONE, 0.2);
    let mut cuts = body.cuts();
    for strip in strips {
        let stroke = cuts.start(&strip[0]).unwrap();
        for blade in &strip[1..] {
            cuts.append(stroke, blade).unwrap();
        }
        cuts.end(stroke).unwrap();
    }
    let form = Form::Rule(phyxel_enrich::Rule::Detour);
    let mut cut = CutBody::new(&body, &cuts, &[], form).unwrap();
    let mut most = [0.0_f64; 2];
    for finished in [false, true] {
        if finished {
            cut.finish(&cuts);
        }
        let mut random = testkit::cloud::Random::new(8);
        let mut elastic = cut.elastic();
        let moved: Vec<DVec3> = body
            .x
            .iter()
            .map(|&x| {
                let shift = random.vector(0.02);
                if piece(x) { x + shift } else { x }
            })
            .collect();
        let mut forces = vec![DVec3::ZERO; moved.len()];
        let mut at_rest = forces.clone();
        elastic.forces_into(&body.x, &mut at_rest);
        elastic.forces_into(&moved, &mut forces);
        for ((f, rest), &x) in forces.iter().zip(&at_rest).zip(&body.x) {
            let k = usize::from(!piece(x));
            most[k] = most[k].max((*f - *rest).abs().max_element());
        }
    }
    most
}
