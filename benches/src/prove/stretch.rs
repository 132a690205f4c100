//! A cube stretched between its ends with free sides, by every material, against closed forms.
//!
//! The state is the same everywhere, so a consistent and conservative method is exact to the solver's tolerance.

use glam::DVec3;
use phyxel_elastic::{Dilatation, Elastic, Fiber, Material, Settings};
use phyxel_integrate::{
    BoundaryConditions, Ease, NewtonSettings, StaticLoad, Trajectory, solve_static,
};

use super::Proof;
use crate::problems::block::Block;
use crate::problems::cantilever::{body, on};
use crate::problems::model::law;

/// Fraction of `c01` in the shear modulus of the Mooney-Rivlin material.
const SHARE: f64 = 0.3;
/// Volume constant (Pa) at E = 1 Pa (Aras 2014, eq. (30)).
const VOLUME: f64 = 1.5;
const FIBER: Fiber = Fiber {
    direction: DVec3::X,
    stiffness: 0.2,
    exponent: 0.8,
    dispersion: 0.1,
};

/// Laws at E = 1 Pa: what the closed forms know.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    NeoHookean,
    MooneyRivlin,
    SaintVenantKirchhoff,
    Volume,
    Fibers,
}

impl Kind {
    fn material(self, nu: f64) -> Material {
        let neo = Material::neo_hookean(1.0, nu);
        match self {
            Self::NeoHookean => neo,
            Self::MooneyRivlin => Material::mooney_rivlin(1.0, nu, SHARE),
            Self::SaintVenantKirchhoff => Material::saint_venant_kirchhoff(1.0, nu),
            Self::Volume => neo.with_volume_constant(VOLUME),
            Self::Fibers => neo.with_fiber(FIBER),
        }
    }

    /// Nominal stress (Pa) along x and across at the stretches `l` and `t`: the derivatives of the strain energy.
    fn stresses(self, nu: f64, l: f64, t: f64) -> [f64; 2] {
        let mu = 0.5 / (1.0 + nu);
        let lambda = 2.0 * mu * nu / (1.0 - 2.0 * nu);
        let log = (l * t * t).ln();
        let neo = [l, t].map(|s| mu * (s - 1.0 / s) + lambda * log / s);
        match self {
            Self::NeoHookean => neo,
            Self::MooneyRivlin => {
                let (c10, c01) = (0.5 * mu * (1.0 - SHARE), 0.5 * mu * SHARE);
                let (shear, bulk) = (2.0 * (c10 + 2.0 * c01), lambda - 4.0 * c01);
                [
                    2.0 * c10 * l + 4.0 * c01 * l * t * t + (bulk * log - shear) / l,
                    2.0 * c10 * t + 2.0 * c01 * t * (l * l + t * t) + (bulk * log - shear) / t,
                ]
            }
            Self::SaintVenantKirchhoff => {
                let [along, across] = [l, t].map(|s| 0.5 * (s * s - 1.0));
                let trace = along + 2.0 * across;
                [
                    l * (lambda * trace + 2.0 * mu * along),
                    t * (lambda * trace + 2.0 * mu * across),
                ]
            }
            Self::Volume => {
                let excess = VOLUME * (l * t * t - 1.0);
                [neo[0] + excess * t * t, neo[1] + excess * l * t]
            }
            Self::Fibers => {
                let (kappa, along) = (FIBER.dispersion, 1.0 - 3.0 * FIBER.dispersion);
                let strain = kappa * (l * l + 2.0 * t * t - 3.0) + along * (l * l - 1.0);
                let pull = FIBER.stiffness * strain.max(0.0);
                let pull = pull * (FIBER.exponent * strain * strain).exp();
                [
                    neo[0] + pull * 2.0 * l * (kappa + along),
                    neo[1] + pull * 2.0 * t * kappa,
                ]
            }
        }
    }

    /// Nominal stress (Pa) and stretch across of a bar with free sides.
    fn closed_form(self, nu: f64, l: f64) -> [f64; 2] {
        let (mut low, mut high) = (0.2_f64, 4.0_f64);
        for _ in 0..200 {
            let t = 0.5 * (low + high);
            if self.stresses(nu, l, t)[1] < 0.0 {
                low = t;
            } else {
                high = t;
            }
        }
        [self.stresses(nu, l, low)[0], low]
    }
}

/// Force (N) on the end of the unit cube stretched by `l` between frictionless ends, and its stretch across.
fn stretched(block: &Block, mut elastic: Elastic, l: f64) -> [f64; 2] {
    let mut supports = BoundaryConditions::free(block.rest.len());
    for (axis, normal) in DVec3::AXES.into_iter().enumerate() {
        for node in block.nodes(|x| on(x[axis], 0.0)) {
            supports.slide(node, normal);
        }
    }
    let keys = vec![(0.0, DVec3::ZERO), (1.0, DVec3::X * (l - 1.0))];
    let pull = Trajectory::translation(keys, Ease::Linear).unwrap();
    let far = block.nodes(|x| on(x.x, 1.0));
    supports.drive(&far, [true, false, false], pull, &block.rest);
    let mut x = block.rest.clone();
    let load = StaticLoad {
        times: [0.0, 1.0],
        // One step of a third is so far from balance that Newton's method may end in another, uneven
        // equilibrium of a nearly incompressible cube.
        steps: 7,
        ..StaticLoad::default()
    };
    let settings = NewtonSettings::with_tolerance(1e-9);
    solve_static(&mut law(&mut elastic), &mut x, &supports, &load, &settings).unwrap();
    let mut forces = vec![DVec3::ZERO; x.len()];
    elastic.forces_into(&x, &mut forces);
    let sides = block.nodes(|x| on(x.y, 1.0));
    let across = sides.iter().map(|&node| x[node as usize].y);
    [
        -far.iter().map(|&node| forces[node as usize].x).sum::<f64>(),
        across.sum::<f64>() / sides.len() as f64,
    ]
}

pub(super) fn stretch(proof: &mut Proof) {
    let block = Block::jittered([3; 3], DVec3::ONE, 0.25, 7);
    for kind in [
        Kind::NeoHookean,
        Kind::MooneyRivlin,
        Kind::SaintVenantKirchhoff,
        Kind::Volume,
        Kind::Fibers,
    ] {
        let means = [Dilatation::Local, Dilatation::Mean].into_iter();
        for dilatation in means.take(1 + usize::from(kind == Kind::NeoHookean)) {
            let settings = Settings {
                dilatation,
                ..Settings::default()
            };
            for (nu, l) in [(0.3, 0.8), (0.3, 1.2), (0.499, 0.8), (0.499, 1.2)] {
                let elastic = body(&block, kind.material(nu), &settings);
                let [force, across] = stretched(&block, elastic, l);
                let [stress, known] = kind.closed_form(nu, l);
                let what = format!("{kind:?}, {dilatation:?}, nu {nu}, stretch {l}");
                proof.within(format!("{what}: stress"), force / stress, 1.0, 1e-6);
                proof.within(format!("{what}: across"), across / known, 1.0, 1e-4);
            }
        }
    }
}
