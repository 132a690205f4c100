//! Boxes of tetrahedra cut by one of the forms, and linear statics on them.

use std::time::Instant;

use glam::{DMat3, DVec3};
use phyxel_elastic::{Elastic, Material, Settings};
use phyxel_enrich::{
    Cuts, EnrichmentGrid, FactorSettings, GridForm, GridSettings, PairFactors, Rule,
    grid_pair_factors, triangle_enrichment,
};
use phyxel_mls::{GradientStencils, Neighborhoods};

use super::plate::Plate;
use super::{POISSON, YOUNG, opening};
use crate::StudyError;
use crate::problems::model::{law, small_displacements};

/// How a cut weakens pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// One of the rules of `phyxel-enrich`; the default is diffraction.
    Rule(Rule),
    /// The dissertation's grid, Aras 2014, eqs (45)–(48).
    Grid(GridForm),
    /// Mean of both directions of the product over the strip's pieces, Aras 2014, eq. (38).
    Pieces,
}

impl Form {
    /// The default.
    pub const DIFFRACTION: Self = Self::Rule(Rule::Diffraction);

    /// All forms that are compared.
    pub const ALL: [Self; 6] = [
        Self::DIFFRACTION,
        Self::Rule(Rule::Visibility),
        Self::Grid(GridForm::OneSided),
        Self::Grid(GridForm::OneSidedMean),
        Self::Grid(GridForm::Product),
        Self::Pieces,
    ];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rule(Rule::Diffraction) => "diffraction (default)",
            Self::Rule(Rule::Visibility) => "visibility",
            Self::Grid(GridForm::Product) => "grid, product of phi",
            Self::Grid(GridForm::OneSided) => "grid, one-sided",
            Self::Grid(GridForm::OneSidedMean) => "grid, one-sided mean",
            Self::Pieces => "product over pieces",
            Self::Rule(_) | Self::Grid(_) => "another rule",
        }
    }
}

/// A cut box.
#[derive(Debug)]
pub struct CutBody<'a> {
    /// The box.
    pub body: &'a Plate,
    /// Its stencils after the cut.
    pub stencils: GradientStencils,
    /// Times (s): what is set up once per body, the factors of the cut, the rows after them.
    pub seconds: [f64; 3],
}

impl<'a> CutBody<'a> {
    /// Cuts a box. `blades` are the captures of the same cut for the grid. `None` if the form
    /// refuses the cut, or the elastic model the form, as its weights must be the same both ways.
    pub fn new(
        body: &'a Plate,
        cuts: &Cuts,
        blades: &[[DVec3; 2]],
        form: Form,
    ) -> Result<Option<Self>, StudyError> {
        let (x, graph) = (&body.block.rest, &body.block.graph);
        let Some((factors, [set_up, weighed])) = factors(body, cuts, blades, form) else {
            return Ok(None);
        };
        if !are_mutual(graph, &factors) {
            return Ok(None);
        }
        let weakened = |node: &u32| graph.pairs(*node as usize).any(|pair| factors[pair] < 1.0);
        let touched: Vec<u32> = (0_u32..).take(x.len()).filter(weakened).collect();
        let mut stencils = body.block.stencils.clone();
        let start = Instant::now();
        stencils.update_rows(x, graph, |pair| factors[pair], &touched)?;
        Ok(Some(Self {
            body,
            stencils,
            seconds: [set_up, weighed, start.elapsed().as_secs_f64()],
        }))
    }

    /// The elastic model of the cut body.
    pub fn elastic(&self) -> Result<Elastic, StudyError> {
        let material = Material::neo_hookean(YOUNG, POISSON);
        self.body
            .block
            .elastic(&self.stencils, material, &Settings::default())
    }

    /// Displacements (m) under nodal forces (N) along the axes that `free` has, see [`small_displacements`].
    pub fn solve(&self, forces: &[DVec3], free: DVec3) -> Result<Vec<DVec3>, StudyError> {
        let rest = &self.body.block.rest;
        small_displacements(&mut law(&mut self.elastic()?), rest, forces, |_| free)
    }

    /// Displacement gradients at the nodes.
    pub fn gradients(&self, u: &[DVec3]) -> Vec<DMat3> {
        let (rest, graph) = (&self.body.block.rest, &self.body.block.graph);
        let written_out = self.stencils.pair_gradients(rest, graph);
        (0..u.len())
            .map(|i| {
                let mut sum = DMat3::ZERO;
                for (pair, &j) in graph.pairs(i).zip(graph.row(i)) {
                    let du = u[j as usize] - u[i];
                    let g = written_out[pair];
                    sum += DMat3::from_cols(du * g.x, du * g.y, du * g.z);
                }
                sum
            })
            .collect()
    }

    /// Opening (m) of the cut along `normal` at a point of its face, see [`opening`].
    pub fn opening(
        &self,
        cuts: &Cuts,
        u: &[DVec3],
        gradients: &[DMat3],
        at: DVec3,
        normal: DVec3,
    ) -> f64 {
        let crosses = |a, b| cuts.crosses(a, b);
        let field = (&self.body.block.rest[..], u, gradients);
        opening(field, self.body.spacing, crosses, at, normal)
    }
}

/// Factors of all pairs, and the times (s) of the set-up and of them. `None` if the form refuses the cut.
fn factors(
    body: &Plate,
    cuts: &Cuts,
    blades: &[[DVec3; 2]],
    form: Form,
) -> Option<(Vec<f64>, [f64; 2])> {
    let coupled = body.coupled();
    let rule = match form {
        Form::Rule(rule) => rule,
        _ => Rule::Diffraction,
    };
    let settings = FactorSettings {
        rule,
        ..FactorSettings::default()
    };
    let begin = Instant::now();
    let mut pairs = PairFactors::new(&coupled, &settings);
    // Of the set-up, the forms other than rules use the influence radii only.
    let reach: Vec<f64> = match form {
        Form::Rule(_) => Vec::new(),
        _ => (0..body.block.rest.len())
            .map(|node| settings.influence_radius.of(&coupled, node))
            .collect(),
    };
    let start = Instant::now();
    let factors = match form {
        Form::Rule(_) => {
            let inside = |p| body.inside(p);
            pairs.update(&coupled, cuts, 0..cuts.triangle_count(), &inside);
            pairs.to_vec()
        }
        Form::Grid(grid_form) => {
            let settings = GridSettings::for_spacing(body.spacing);
            let grid = EnrichmentGrid::from_blades(blades, &settings).ok()?;
            grid_pair_factors(&[grid], &coupled, &reach, grid_form)
        }
        Form::Pieces => piece_products(body, cuts, &reach),
    };
    let seconds = [start - begin, start.elapsed()].map(|time| time.as_secs_f64());
    Some((factors, seconds))
}

/// Whether pairs have the same factors both ways.
fn are_mutual(graph: &Neighborhoods, factors: &[f64]) -> bool {
    let back = |node: u32, j: usize| {
        graph.pairs(j).start + graph.row(j).partition_point(|&other| other < node)
    };
    let nodes = graph.offsets().len() - 1;
    (0_u32..).take(nodes).all(|node| {
        let mut row = graph.pairs(node as usize).zip(graph.row(node as usize));
        row.all(|(pair, &j)| factors[pair].to_bits() == factors[back(node, j as usize)].to_bits())
    })
}

/// Product over the strip's pieces, each with its own frame, within the influence radius.
fn piece_products(body: &Plate, cuts: &Cuts, reach: &[f64]) -> Vec<f64> {
    let (x, graph) = (&body.block.rest, &body.block.graph);
    let mut factors = vec![1.0; graph.pair_count()];
    for t in (0..cuts.triangle_count()).step_by(2) {
        let triangle = cuts.triangle(t);
        let middle = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
        let values: Vec<Option<f64>> = x
            .iter()
            .zip(reach)
            .map(|(x, h)| {
                let near = x.distance(middle) < *h + 10.0 * body.spacing;
                near.then(|| triangle_enrichment(triangle, *x))
            })
            .collect();
        for i in 0..x.len() {
            for (pair, &j) in graph.pairs(i).zip(graph.row(i)) {
                let j = j as usize;
                if let (Some(a), Some(b)) = (values[i], values[j]) {
                    let (a, b) = if i < j { (a, b) } else { (b, a) };
                    factors[pair] *= 0.25 * (2.0 + (a.signum() * b + b.signum() * a));
                }
            }
        }
    }
    factors
}
