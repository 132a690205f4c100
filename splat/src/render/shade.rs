//! Light and the way to the screen.

use crate::render::{Light, Lighting, slope_noise};
use glam::{Vec3, Vec4};

/// Points lit at a time.
pub(crate) const LANES: usize = 4;

/// A point of a surface to be lit, in camera axes (right, up, towards the viewer).
pub(crate) struct Point {
    pub(crate) normal: Vec3,
    /// Unit vector to the viewer.
    pub(crate) view: Vec3,
    pub(crate) color: Vec3,
    pub(crate) specular: f32,
    pub(crate) shininess: f32,
    /// Red light that leaks around the terminator: 0 for opaque things.
    pub(crate) softness: f32,
}

/// [`LANES`] points: components one by one, a lane for each point.
pub(crate) struct Points {
    pub(crate) normal: [Vec4; 3],
    pub(crate) view: [Vec4; 3],
    pub(crate) color: [Vec4; 3],
    pub(crate) specular: Vec4,
    pub(crate) shininess: Vec4,
    pub(crate) softness: Vec4,
}

/// Square roots of the components.
#[inline]
pub(crate) fn sqrt(v: Vec4) -> Vec4 {
    Vec4::from_array(v.to_array().map(f32::sqrt))
}

#[inline]
fn dot(a: &[Vec4; 3], b: &[Vec4; 3]) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Lights with unit directions.
#[derive(Debug)]
pub(crate) struct Lights {
    lights: Vec<(Vec3, Vec3)>,
    sky: Vec3,
    ground: Vec3,
}

impl Lights {
    pub(crate) fn new(lighting: &Lighting) -> Self {
        let unit = |light: &Light| (light.direction.normalize_or(Vec3::Z), light.color);
        Self {
            lights: lighting.lights.iter().map(unit).collect(),
            sky: lighting.sky,
            ground: lighting.ground,
        }
    }

    /// Linear colours: ambient from a hemisphere, Lambert with a soft terminator, Blinn's highlight
    /// (the halfway form of Phong's) with Schlick's Fresnel growth towards grazing view.
    pub(crate) fn shade(&self, p: &Points) -> [Vec4; 3] {
        let n = &p.normal;
        let up = n[1] * 0.5 + 0.5;
        let hemisphere =
            [0, 1, 2].map(|c| up * (self.sky[c] - self.ground[c]) + Vec4::splat(self.ground[c]));
        let facing = dot(n, &p.view).clamp(Vec4::ZERO, Vec4::ONE);
        let past = Vec4::ONE - facing;
        let grazing = past * past;
        let fresnel = grazing * grazing * past * 2.0 + 1.0;
        let mut diffuse = hemisphere;
        let mut highlight = hemisphere.map(|light| light * (fresnel * 0.12));
        for &(direction, light) in &self.lights {
            let towards = direction.to_array().map(Vec4::splat);
            let cosine = dot(n, &towards);
            let lambert = cosine.max(Vec4::ZERO);
            let leak = ((cosine + 0.35) / 1.35).max(Vec4::ZERO);
            let soft = (leak * leak - lambert).max(Vec4::ZERO) * p.softness;
            let half = [0, 1, 2].map(|c| towards[c] + p.view[c]);
            // Where viewer and light are opposite, nothing shines.
            let length = sqrt(dot(&half, &half)).max(Vec4::splat(f32::MIN_POSITIVE));
            let shine = power((dot(n, &half) / length).max(Vec4::ZERO), p.shininess);
            // The light must reach the surface.
            let reach = (lambert * 4.0).min(Vec4::ONE);
            let shine = fresnel * reach * shine;
            for (c, share) in [1.0, 0.25, 0.2].into_iter().enumerate() {
                diffuse[c] += (lambert + soft * share) * light[c];
                highlight[c] += shine * light[c];
            }
        }
        [0, 1, 2].map(|c| p.color[c] * diffuse[c] + highlight[c] * p.specular)
    }

    /// The linear colour of one point.
    pub(crate) fn shade_one(&self, p: &Point) -> Vec3 {
        let lit = self.shade(&Points::of([p; LANES]));
        lit.map(|channel| channel.x).into()
    }
}

impl Points {
    pub(crate) fn of(points: [&Point; LANES]) -> Self {
        let lanes = |of: &dyn Fn(&Point) -> f32| Vec4::from_array(points.map(of));
        let axes = |of: &dyn Fn(&Point) -> Vec3| [0, 1, 2].map(|c| lanes(&|p| of(p)[c]));
        Self {
            normal: axes(&|p| p.normal),
            view: axes(&|p| p.view),
            color: axes(&|p| p.color),
            specular: lanes(&|p| p.specular),
            shininess: lanes(&|p| p.shininess),
            softness: lanes(&|p| p.softness),
        }
    }
}

/// About `base^exponent` for base in 0..1: the fourth power of the rational function of Schlick 1994
/// ("A fast alternative to Phong's specular model") for a quarter of the exponent, whose tail falls
/// off fast enough.
#[inline]
fn power(base: Vec4, exponent: Vec4) -> Vec4 {
    let n = exponent * 0.25;
    let x = base / (n - n * base + base);
    (x * x) * (x * x)
}

/// Tilts normals by the slope of noise at `at` (in cells) times `amount`.
#[inline]
pub(crate) fn relief(normal: [Vec4; 3], at: [Vec4; 3], amount: Vec4) -> [Vec4; 3] {
    if amount.cmple(Vec4::ZERO).all() {
        return normal;
    }
    let at = at.map(|at| at.to_array());
    let mut tilt = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        let slope = slope_noise(Vec3::from_array(at.map(|at| at[lane])));
        for (tilt, slope) in tilt.iter_mut().zip(slope.to_array()) {
            tilt[lane] = slope;
        }
    }
    let tilt = tilt.map(Vec4::from_array);
    let along = dot(&tilt, &normal);
    let amount = amount.max(Vec4::ZERO);
    let tilted = [0, 1, 2].map(|c| normal[c] + (tilt[c] - normal[c] * along) * amount);
    // The tilt lies in the surface: the length is at least the normal's.
    let length = sqrt(dot(&tilted, &tilted));
    tilted.map(|c| c / length)
}

/// Tone curve: linear to about a half, then rolling off to white, per channel.
#[inline]
pub(crate) fn tones(color: [Vec4; 3]) -> [Vec4; 3] {
    color.map(|c| {
        let c = c.max(Vec4::ZERO);
        let rolled = Vec4::ONE - Vec4::splat(0.25) / c;
        Vec4::select(c.cmple(Vec4::splat(0.5)), c, rolled)
    })
}

/// The tone curve for one colour.
#[inline]
pub(crate) fn tone(c: Vec3) -> Vec3 {
    tones(c.to_array().map(Vec4::splat))
        .map(|channel| channel.x)
        .into()
}

/// Resolution of the transfer table.
const STEPS: usize = 4096;

/// Table from linear light to 8-bit sRGB.
#[derive(Debug)]
pub(crate) struct Transfer(Vec<u8>);

impl Transfer {
    pub(crate) fn new() -> Self {
        let encoded = |k: usize| {
            // The square root spreads the dark end over more steps.
            let x = (k as f32 / STEPS as f32).powi(2);
            crate::cast::byte(if x <= 0.003_130_8 {
                12.92 * x
            } else {
                1.055 * x.powf(1.0 / 2.4) - 0.055
            })
        };
        Self((0..=STEPS).map(encoded).collect())
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "clamped to the table; NaN gives 0"
    )]
    pub(crate) fn encode(&self, c: Vec3) -> [u8; 3] {
        let at = sqrt(c.extend(0.0).clamp(Vec4::ZERO, Vec4::ONE)) * STEPS as f32 + 0.5;
        let [r, g, b, _] = at.to_array();
        [r, g, b].map(|at| self.0[at as usize % (STEPS + 1)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The formulas of [`Lights::shade`], a number at a time.
    fn formula(lights: &Lights, p: &Point) -> Vec3 {
        let hemisphere = lights.ground.lerp(lights.sky, 0.5 + 0.5 * p.normal.y);
        let fresnel = 1.0 + 2.0 * (1.0 - p.normal.dot(p.view).clamp(0.0, 1.0)).powi(5);
        let (mut diffuse, mut highlight) = (hemisphere, 0.12 * fresnel * hemisphere);
        for &(direction, light) in &lights.lights {
            let cosine = p.normal.dot(direction);
            let lambert = cosine.max(0.0);
            let leak = ((cosine + 0.35) / 1.35).max(0.0).powi(2);
            let soft = p.softness * (leak - lambert).max(0.0);
            diffuse += light * (Vec3::new(1.0, 0.25, 0.2) * soft + lambert);
            let half = (direction + p.view).normalize_or_zero();
            let (base, n) = (p.normal.dot(half).max(0.0), 0.25 * p.shininess);
            let shine = (base / (n - n * base + base)).powi(4);
            highlight += light * (fresnel * (4.0 * lambert).min(1.0) * shine);
        }
        p.color * diffuse + p.specular * highlight
    }

    /// Points all around, tilted by noise.
    fn points() -> Vec<Point> {
        let unit = |k: u32, step: f32| {
            let turn = f64::from(k) * f64::from(step);
            let (sine, cosine) = crate::cast::single(turn).sin_cos();
            Vec3::new(sine, cosine * sine, cosine).normalize()
        };
        (0..400)
            .map(|k| Point {
                normal: unit(k, 0.37),
                view: if k == 7 { Vec3::NEG_X } else { unit(k, 0.73) },
                color: unit(k, 0.11).abs(),
                specular: 0.5,
                shininess: 12.0 + crate::cast::single(f64::from(k)),
                softness: 0.5,
            })
            .collect()
    }

    #[test]
    fn lanes_are_lit_by_the_formulas_each_for_itself() {
        let mut lighting = Lighting::default();
        lighting.lights[0].direction = Vec3::X;
        let lights = Lights::new(&lighting);
        for four in points().as_chunks::<LANES>().0 {
            let together = lights.shade(&Points::of(four.each_ref()));
            for (lane, point) in four.iter().enumerate() {
                let lit = Vec3::from_array(together.map(|channel| channel[lane]));
                assert_eq!(lit, lights.shade_one(point), "lane {lane}");
                let expected = formula(&lights, point);
                // Round-off of some forty operations in f32.
                let off = lit.distance(expected);
                assert!(off <= 1e-5 * expected.length(), "{lit} for {expected}");
            }
        }
    }

    #[test]
    fn relief_tilts_normals_by_the_slope_of_noise_and_keeps_them_unit() {
        for (k, point) in points().iter().enumerate() {
            let (n, at) = (point.normal, 9.0 * point.view);
            let all = |v: Vec3| v.to_array().map(Vec4::splat);
            let amount = Vec4::new(0.0, 0.1, 0.7, -1.0);
            let tilted = relief(all(n), all(at), amount);
            let slope = slope_noise(at);
            for lane in 0..LANES {
                let found = Vec3::from_array(tilted.map(|c| c[lane]));
                let expected = n + slope.reject_from(n) * amount[lane].max(0.0);
                let off = found.distance(expected.normalize());
                assert!(off < 1e-5, "{k}: {found} for {expected}");
            }
        }
    }
}
