//! A block stretched between its ends with free sides, by every material, against closed forms.

use std::time::Instant;

use glam::DVec3;
use phyxel_elastic::{Dilatation, Elastic, Fiber, Material, Settings};
use phyxel_integrate::{
    BoundaryConditions, Ease, ForceLaw, NewtonSettings, SolveError, StaticLoad, Trajectory,
    solve_static,
};

use crate::problems::block::{Block, lattice};
use crate::problems::model::{Law, dissertation};
use crate::report::{Cell, Report, Series, Table, add_point, plots, row};
use crate::{Effort, StudyError};
use testkit::cloud::Random;

/// Load steps to a stretch.
const LOAD_STEPS: u32 = 7;

/// Largest shift of a node inside, as a fraction of a cell.
const JITTER: f64 = 0.25;
/// Unbalanced forces relative to those on the ends.
const TOLERANCE: f64 = 1e-9;
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

/// What the closed forms know: stretch along x, across it, and the laws' constants at E = 1 Pa.
#[derive(Clone, Copy)]
enum Kind {
    NeoHookean,
    MooneyRivlin,
    SaintVenantKirchhoff,
    Volume,
    Fibers,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::NeoHookean => "neo-Hookean",
            Self::MooneyRivlin => "Mooney-Rivlin",
            Self::SaintVenantKirchhoff => "Saint Venant-Kirchhoff",
            Self::Volume => "neo-Hookean, volume constant",
            Self::Fibers => "neo-Hookean, fibers along",
        }
    }

    fn material(self, nu: f64) -> Material {
        match self {
            Self::NeoHookean => Material::neo_hookean(1.0, nu),
            Self::MooneyRivlin => Material::mooney_rivlin(1.0, nu, SHARE),
            Self::SaintVenantKirchhoff => Material::saint_venant_kirchhoff(1.0, nu),
            Self::Volume => {
                let mut material = Material::neo_hookean(1.0, nu);
                material.volume_constant = VOLUME;
                material
            }
            Self::Fibers => Material::neo_hookean(1.0, nu).with_fiber(FIBER),
        }
    }

    /// Nominal stress (Pa) along x and across at the stretches `l` and `t`.
    fn stresses(self, nu: f64, l: f64, t: f64) -> [f64; 2] {
        let mu = 0.5 / (1.0 + nu);
        let lambda = 2.0 * mu * nu / (1.0 - 2.0 * nu);
        let log = (l * t * t).ln();
        let neo = [
            mu * (l - 1.0 / l) + lambda * log / l,
            mu * (t - 1.0 / t) + lambda * log / t,
        ];
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
                let pull = if strain > 0.0 {
                    FIBER.stiffness * strain * (FIBER.exponent * strain * strain).exp()
                } else {
                    0.0
                };
                [
                    neo[0] + pull * 2.0 * l * (kappa + along),
                    neo[1] + pull * 2.0 * t * kappa,
                ]
            }
        }
    }

    /// Nominal stress (Pa) and stretch across of a bar with free sides.
    fn closed_form(self, nu: f64, l: f64) -> (f64, f64) {
        let (mut low, mut high) = (0.2_f64, 4.0_f64);
        for _ in 0..200 {
            let t = 0.5 * (low + high);
            if self.stresses(nu, l, t)[1] < 0.0 {
                low = t;
            } else {
                high = t;
            }
        }
        (self.stresses(nu, l, low)[0], low)
    }
}

/// The numerical models that are compared.
#[derive(Clone, Copy, PartialEq)]
enum Model {
    Default,
    MeanDilatation,
    Dissertation,
}

impl Model {
    fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::MeanDilatation => "mean dilatation",
            Self::Dissertation => "dissertation",
        }
    }

    fn elastic(self, block: &Block, material: Material) -> Result<Elastic, StudyError> {
        let mut settings = Settings::default();
        match self {
            Self::Default => {}
            Self::MeanDilatation => settings.dilatation = Dilatation::Mean,
            Self::Dissertation => return Ok(dissertation(&block.rest, material, 1.0)?.0),
        }
        block.elastic(&block.stencils, material, &settings)
    }
}

/// Each variant on the law it is for; the default on all of them.
const CASES: [(Kind, Model); 7] = [
    (Kind::NeoHookean, Model::Default),
    (Kind::NeoHookean, Model::MeanDilatation),
    (Kind::MooneyRivlin, Model::Default),
    (Kind::SaintVenantKirchhoff, Model::Default),
    (Kind::SaintVenantKirchhoff, Model::Dissertation),
    (Kind::Volume, Model::Default),
    (Kind::Fibers, Model::Default),
];

/// A stretched block: stress and stretch across, the cost.
struct Stretched {
    stress: f64,
    across: f64,
    seconds: f64,
    products: usize,
}

/// A jittered unit cube of `cells`.
fn cube(cells: u32) -> Result<Block, StudyError> {
    let (mut nodes, tetrahedra) = lattice([cells; 3], |s| s);
    let mut random = Random::new(7);
    let step = 1.0 / f64::from(cells);
    for x in &mut nodes {
        let shift = random.vector(JITTER * step);
        for axis in 0..3 {
            if (1e-9..1.0 - 1e-9).contains(&x[axis]) {
                x[axis] += shift[axis];
            }
        }
    }
    Block::ordered(&nodes, &tetrahedra)
}

fn stretch(
    block: &Block,
    model: Model,
    material: Material,
    l: f64,
) -> Result<Stretched, StudyError> {
    let mut elastic = model.elastic(block, material)?;
    let mut supports = BoundaryConditions::free(block.rest.len());
    let edge = 1e-9;
    for (normal, axis) in [(DVec3::Y, 1), (DVec3::Z, 2)] {
        for node in block.nodes(|x| x[axis] < edge) {
            supports.slide(node, normal);
        }
    }
    for node in block.nodes(|x| x.x < edge) {
        supports.slide(node, DVec3::X);
    }
    let pull = Trajectory::translation(
        vec![(0.0, DVec3::ZERO), (1.0, DVec3::X * (l - 1.0))],
        Ease::Linear,
    )?;
    let far = block.nodes(|x| x.x > 1.0 - edge);
    supports.drive(&far, [true, false, false], pull, &block.rest);
    let mut x = block.rest.clone();
    let settings = NewtonSettings::with_tolerance(TOLERANCE);
    let load = StaticLoad {
        times: [0.0, 1.0],
        // One step of a third is so far from balance that Newton's method may end in another, uneven
        // equilibrium of a nearly incompressible cube.
        steps: LOAD_STEPS,
        ..StaticLoad::default()
    };
    let start = Instant::now();
    let report = solve_static(&mut Law(&mut elastic), &mut x, &supports, &load, &settings)?;
    let seconds = start.elapsed().as_secs_f64();
    let mut forces = vec![DVec3::ZERO; x.len()];
    Law(&mut elastic).forces_into(&x, &mut forces);
    let sides = block.nodes(|x| x.y > 1.0 - edge);
    let count = sides.len() as f64;
    Ok(Stretched {
        stress: -far.iter().map(|&node| forces[node as usize].x).sum::<f64>(),
        across: sides.iter().map(|&node| x[node as usize].y).sum::<f64>() / count,
        seconds,
        products: report.steps.iter().map(|step| step.linear_iterations).sum(),
    })
}

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let (cells, ratios, stretches): (u32, &[f64], &[f64]) = effort.choose(
        (
            6,
            &[0.3, 0.45, 0.49, 0.499],
            &[0.7, 0.8, 0.9, 1.1, 1.2, 1.35],
        ),
        (3, &[0.3, 0.499], &[0.8, 1.2]),
    );
    let block = cube(cells)?;
    let (mut rows, mut by_ratio) = (Vec::new(), Vec::<Series>::new());
    let mut stresses: Vec<Series> = Vec::new();
    for (kind, model) in CASES {
        // The dissertation's model has soft modes without energy, in which Newton's method gets
        // lost where the law itself is soft.
        let borne = |nu: f64, l: f64| {
            model != Model::Dissertation || (nu < 0.46 && (0.85..1.25).contains(&l))
        };
        let name = format!("{}, {}", kind.name(), model.name());
        let mut errors = Vec::new();
        for &nu in ratios {
            let mut worst = 0.0_f64;
            for &l in stretches.iter().filter(|&&l| borne(nu, l)) {
                let (stress, across) = kind.closed_form(nu, l);
                let mut row = row![kind.name(), model.name(), nu, l, stress];
                match stretch(&block, model, kind.material(nu), l) {
                    Ok(found) => {
                        let error = 100.0 * (found.stress / stress - 1.0);
                        worst = worst.max(error.abs());
                        row.extend(row![
                            error,
                            100.0 * (found.across / across - 1.0),
                            1e3 * found.seconds,
                            found.products
                        ]);
                        if model == Model::Default && (nu - ratios[0]).abs() < 1e-9 {
                            add_point(&mut stresses, kind.name(), (l, found.stress));
                        }
                    }
                    // Not every model bears every stretch; the table says which did not.
                    Err(error) if error.is::<SolveError>() => {
                        row.push("no equilibrium".into());
                        row.resize(9, Cell::Nothing);
                    }
                    Err(error) => return Err(error),
                }
                rows.push(row);
            }
            if stretches.iter().any(|&l| borne(nu, l)) {
                errors.push((nu, worst));
            }
        }
        by_ratio.push(Series::line(name, errors));
    }
    let table = Table::new(
        "stretch",
        "Stress of a stretched cube with free sides",
        "material; model; Poisson's ratio (1); stretch (1); stress (Pa); error (%); \
         stretch across (%); solution (ms); products (1)",
        rows,
    );
    let plots = plots![
        "stress" &format!("Nominal stress over stretch, nu {}", ratios[0]),
            linear "stretch (1)", linear "nominal stress (Pa)" => stresses;
        "error" "Largest error of the stress over all stretches",
            linear "Poisson's ratio (1)", log "largest error of the stress (%)" => by_ratio;
    ];
    Ok(Report::new(
        &[
            &format!(
                "A unit cube of {} jittered nodes, E 1 Pa, stretched between frictionless ends with \
                 free sides. The state is the same everywhere, so a consistent and conservative method \
                 is exact to the solver's tolerance: what is left is a defect of the method. The \
                 nominal stress is the force on the end over its area at rest.",
                block.rest.len(),
            ),
            "Closed forms: the derivatives of each strain energy along and across, the latter zero. \
             The dissertation's model has nodal volumes of eqs (17) and (18). Viscous parts do not \
             act at rest. Pairs in f32 are solved to 1e-5 of the end's force.",
        ],
        vec![table],
        plots,
    ))
}
