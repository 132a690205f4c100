//! Light and the way to the screen.

use crate::noise::slope_noise;
use crate::scene::Lighting;
use glam::Vec3;

/// A point of a surface to be lit, in camera axes (right, up, towards the viewer).
pub(crate) struct Point {
    pub(crate) normal: Vec3,
    /// Unit vector to the viewer.
    pub(crate) view: Vec3,
    pub(crate) color: Vec3,
    pub(crate) specular: f32,
    pub(crate) shininess: f32,
    /// Red light that leaks round the terminator: 0 for opaque things.
    pub(crate) softness: f32,
}

/// Lights with unit directions.
#[derive(Debug)]
pub(crate) struct Rig {
    lights: Vec<(Vec3, Vec3)>,
    sky: Vec3,
    ground: Vec3,
}

impl Rig {
    pub(crate) fn new(lighting: &Lighting) -> Self {
        Self {
            lights: lighting
                .lights
                .iter()
                .map(|l| (l.direction.normalize_or(Vec3::Z), l.color))
                .collect(),
            sky: lighting.sky,
            ground: lighting.ground,
        }
    }

    /// Linear colour: ambient from a hemisphere, Lambert with a soft terminator, Blinn's highlight
    /// (the halfway form of Phong's) with Schlick's Fresnel growth towards grazing view.
    pub(crate) fn shade(&self, p: &Point) -> Vec3 {
        let n = p.normal;
        let hemisphere = self.ground.lerp(self.sky, 0.5 + 0.5 * n.y);
        let mut diffuse = hemisphere;
        let facing = n.dot(p.view).clamp(0.0, 1.0);
        let grazing = (1.0 - facing) * (1.0 - facing);
        let fresnel = 1.0 + 2.0 * grazing * grazing * (1.0 - facing);
        let mut highlight = hemisphere * (0.12 * fresnel);
        for &(direction, light) in &self.lights {
            let cosine = n.dot(direction);
            let lambert = cosine.max(0.0);
            let leak = ((cosine + 0.35) / 1.35).max(0.0);
            let soft = p.softness * (leak * leak - lambert).max(0.0);
            diffuse += light * (Vec3::splat(lambert) + Vec3::new(soft, 0.25 * soft, 0.2 * soft));
            let half = (direction + p.view).normalize_or_zero();
            let cosine = n.dot(half).max(0.0);
            // The light must reach the surface.
            let reach = (4.0 * lambert).min(1.0);
            highlight += light * (fresnel * reach * power(cosine, p.shininess));
        }
        p.color * diffuse + highlight * p.specular
    }
}

/// About `base^exponent` for base in 0..1: the fourth power of the rational function of Schlick 1994
/// (\"A fast alternative to Phong's specular model\") for a quarter of the exponent, whose tail falls
/// off fast enough.
#[inline]
fn power(base: f32, exponent: f32) -> f32 {
    let n = 0.25 * exponent;
    let x = base / (n - n * base + base);
    (x * x) * (x * x)
}

/// Tilts a normal by the slope of noise at `at` (in cells); normal and slope in the same axes.
pub(crate) fn relief(normal: Vec3, at: Vec3, amount: f32) -> Vec3 {
    if amount <= 0.0 {
        return normal;
    }
    let tilt = slope_noise(at);
    (normal + (tilt - normal * tilt.dot(normal)) * amount).normalize_or(normal)
}

/// Tone curve: linear to about a half, then rolling off to white, per channel.
#[inline]
pub(crate) fn tone(c: Vec3) -> Vec3 {
    c.max(Vec3::ZERO)
        .to_array()
        .map(|x| if x <= 0.5 { x } else { 1.0 - 0.5 / (2.0 * x) })
        .into()
}

/// Resolution of the transfer table.
const STEPS: usize = 4096;

/// Table from linear light to 8-bit sRGB.
#[derive(Debug)]
pub(crate) struct Transfer(Vec<u8>);

impl Transfer {
    #[allow(clippy::cast_precision_loss, reason = "4096 steps")]
    pub(crate) fn new() -> Self {
        Self(
            (0..=STEPS)
                .map(|k| {
                    // The square root spreads the dark end over more steps.
                    let x = (k as f32 / STEPS as f32).powi(2);
                    let s = if x <= 0.003_130_8 {
                        12.92 * x
                    } else {
                        1.055 * x.powf(1.0 / 2.4) - 0.055
                    };
                    crate::cast::byte(s)
                })
                .collect(),
        )
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "clamped to the table; NaN gives 0"
    )]
    pub(crate) fn encode(&self, c: Vec3) -> [u8; 3] {
        c.to_array()
            .map(|x| self.0[(x.clamp(0.0, 1.0).sqrt() * STEPS as f32 + 0.5) as usize % (STEPS + 1)])
    }
}
