//! Boxes of tetrahedra as bodies, cut by one of the forms, and linear statics on them.

use std::time::Instant;

use glam::{DMat3, DMat4, DVec3, DVec4};
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings, Stencils};
use phyxel_enrich::{
    CutSettings, Cuts, EnrichmentGrid, FactorSettings, GridForm, GridSettings, PairFactors, Rule,
    grid_pair_factors, triangle_enrichment,
};
use phyxel_mls::{
    ConservativeSettings, ConservativeStencils, Neighborhoods, StrokeReport,
    inverse_square_weights, normal_projector,
};
use testkit::cloud::Random;

/// Young's modulus (Pa) and Poisson's ratio of all benchmarks.
pub(crate) const YOUNG: f64 = 1000.0;
pub(crate) const POISSON: f64 = 0.3;

/// How a cut weakens pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Form {
    Rule(Rule),
    Grid(GridForm),
    /// Mean of both directions of the product over the strip's pieces, Aras 2014, eq. (38).
    Pieces,
}

impl Form {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Rule(Rule::Detour) => "detour (default)",
            Self::Rule(Rule::Visibility) => "visibility",
            Self::Rule(Rule::Transparency { .. }) => "transparency",
            Self::Grid(GridForm::Product) => "grid, product of phi",
            Self::Grid(GridForm::OneSided) => "grid, one-sided",
            Self::Grid(GridForm::OneSidedMean) => "grid, one-sided mean",
            Self::Pieces => "product over pieces",
        }
    }
}

/// A box meshed by mirrored right-angled tetrahedra.
pub(crate) struct Body {
    pub(crate) x: Vec<DVec3>,
    pub(crate) spacing: f64,
    pub(crate) low: DVec3,
    pub(crate) high: DVec3,
    pub(crate) graph: Neighborhoods,
    pub(crate) stencils: ConservativeStencils,
    volumes: Vec<f64>,
    boundary: Vec<DVec3>,
    surface: Vec<[usize; 3]>,
}

impl Body {
    /// `cells` cells from `low` to `high`; inner nodes moved by up to `jitter` of a cell along x and
    /// y, the same in all layers of a slab.
    pub(crate) fn new(cells: [usize; 3], low: DVec3, high: DVec3, jitter: f64) -> Self {
        let n = cells.map(|c| c + 1);
        let size = (high - low) / DVec3::from(cells.map(|c| c as f64));
        let at = |i: usize, j: usize, k: usize| (k * n[1] + j) * n[0] + i;
        let mut x = Vec::new();
        for k in 0..n[2] {
            let mut random = Random::new(if cells[2] == 1 { 5 } else { 5 + k as u64 });
            for j in 0..n[1] {
                for i in 0..n[0] {
                    let inner = i > 0 && i < cells[0] && j > 0 && j < cells[1];
                    let mut shift = random.vector(jitter);
                    shift.z *= f64::from(u8::from(k > 0 && k < cells[2]));
                    let shift = if inner { shift } else { DVec3::ZERO };
                    x.push(low + (DVec3::new(i as f64, j as f64, k as f64) + shift) * size);
                }
            }
        }
        let mut tetrahedra = Vec::new();
        for k in 0..cells[2] {
            for j in 0..cells[1] {
                for i in 0..cells[0] {
                    // Neighbouring cells are mirror images of each other.
                    let corner = |c: [usize; 3]| {
                        let m =
                            |c: usize, cell: usize| if cell.is_multiple_of(2) { c } else { 1 - c };
                        at(i + m(c[0], i), j + m(c[1], j), k + m(c[2], k))
                    };
                    for order in [
                        [0, 1, 2],
                        [0, 2, 1],
                        [1, 0, 2],
                        [1, 2, 0],
                        [2, 0, 1],
                        [2, 1, 0],
                    ] {
                        let mut c = [0; 3];
                        let mut t = [corner(c); 4];
                        for (step, axis) in order.into_iter().enumerate() {
                            c[axis] = 1;
                            t[step + 1] = corner(c);
                        }
                        let volume = (x[t[1]] - x[t[0]])
                            .cross(x[t[2]] - x[t[0]])
                            .dot(x[t[3]] - x[t[0]]);
                        if volume < 0.0 {
                            t.swap(2, 3);
                        }
                        tetrahedra.push(t);
                    }
                }
            }
        }
        Self::from_tetrahedra(x, &tetrahedra, size.max_element(), low, high)
    }

    fn from_tetrahedra(
        x: Vec<DVec3>,
        tetrahedra: &[[usize; 4]],
        spacing: f64,
        low: DVec3,
        high: DVec3,
    ) -> Self {
        let (mut volumes, mut boundary) = (vec![0.0; x.len()], vec![DVec3::ZERO; x.len()]);
        let mut rows: Vec<Vec<u32>> = vec![Vec::new(); x.len()];
        let mut faces: Vec<([usize; 3], [usize; 3])> = Vec::new();
        for &t in tetrahedra {
            let p = t.map(|v| x[v]);
            let volume = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]) / 6.0;
            assert!(volume > 0.0);
            for a in 0..4 {
                volumes[t[a]] += volume / 4.0;
                let others = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]][a].map(|o: usize| t[o]);
                for o in others {
                    rows[t[a]].push(o as u32);
                }
                let mut key = others;
                key.sort_unstable();
                faces.push((key, others));
            }
        }
        faces.sort_unstable();
        let mut surface = Vec::new();
        for (k, (key, face)) in faces.iter().enumerate() {
            let same = |m: usize| faces.get(m).is_some_and(|f| f.0 == *key);
            if !same(k + 1) && (k == 0 || !same(k - 1)) {
                let [p, q, r] = face.map(|v| x[v]);
                for v in face {
                    boundary[*v] += (q - p).cross(r - p) / 6.0;
                }
                surface.push(*face);
            }
        }
        let (mut offsets, mut indices) = (vec![0], Vec::new());
        for row in &mut rows {
            row.sort_unstable();
            row.dedup();
            indices.extend_from_slice(row);
            offsets.push(indices.len() as u32);
        }
        let graph = Neighborhoods::from_graph(offsets, indices).unwrap();
        let weights = inverse_square_weights(&x, &graph);
        let settings = ConservativeSettings::default();
        let stencils =
            ConservativeStencils::new(&x, &volumes, &boundary, &graph, weights, &settings).unwrap();
        assert!(stencils.report.residual < 1e-9, "{:?}", stencils.report);
        Self {
            x,
            spacing,
            low,
            high,
            graph,
            stencils,
            volumes,
            boundary,
            surface,
        }
    }

    pub(crate) fn inside(&self, p: DVec3) -> bool {
        p.cmpge(self.low).all() && p.cmple(self.high).all()
    }

    /// No cut yet, for cuts of this body.
    pub(crate) fn cuts(&self) -> Cuts {
        Cuts::new(&CutSettings::for_spacing(self.spacing))
    }

    /// Nodal forces of a traction on the part of the surface where `on` holds.
    pub(crate) fn traction(&self, on: impl Fn(DVec3) -> bool, traction: DVec3) -> Vec<DVec3> {
        let mut forces = vec![DVec3::ZERO; self.x.len()];
        for face in &self.surface {
            let [p, q, r] = face.map(|v| self.x[v]);
            if on(p) && on(q) && on(r) {
                for v in face {
                    forces[*v] += traction * (q - p).cross(r - p).length() / 6.0;
                }
            }
        }
        forces
    }

    /// Nodal forces of a force per volume.
    pub(crate) fn weight(&self, force: DVec3) -> Vec<DVec3> {
        self.volumes.iter().map(|v| force * *v).collect()
    }
}

/// A cut body.
pub(crate) struct CutBody<'a> {
    pub(crate) body: &'a Body,
    pub(crate) stencils: ConservativeStencils,
    pub(crate) factors: Vec<f64>,
    pub(crate) touched: Vec<u32>,
    /// Times (s): what is set up once per body, the factors of the cut, the rows after them.
    pub(crate) seconds: [f64; 3],
    pairs: PairFactors,
}

impl<'a> CutBody<'a> {
    /// Cuts a body. `blades` are the captures of the same cut for the grid. None if the form refuses
    /// the cut, or the elastic model the form.
    pub(crate) fn new(
        body: &'a Body,
        cuts: &Cuts,
        blades: &[[DVec3; 2]],
        form: Form,
    ) -> Option<Self> {
        let (offsets, indices) = (body.graph.offsets(), body.graph.indices());
        let rule = if let Form::Rule(rule) = form {
            rule
        } else {
            Rule::Detour
        };
        let settings = FactorSettings {
            rule,
            ..FactorSettings::default()
        };
        let begin = Instant::now();
        let mut pairs = PairFactors::new(&body.x, offsets, indices, &settings);
        let start = Instant::now();
        let factors = match form {
            Form::Rule(_) => {
                pairs.update(cuts, 0..cuts.triangle_count(), &|p| body.inside(p));
                pairs.factors().to_vec()
            }
            Form::Grid(grid_form) => {
                let settings = GridSettings::for_spacing(body.spacing);
                let grid = EnrichmentGrid::from_blades(blades, &settings).ok()?;
                grid_pair_factors(&[grid], &body.x, offsets, indices, pairs.reach(), grid_form)
            }
            Form::Pieces => piece_products(body, cuts, pairs.reach()),
        };
        let middle = Instant::now();
        // The elastic model takes weights that are equal in both directions only.
        for i in 0..body.x.len() {
            for (pair, &j) in body.graph.pairs(i).zip(body.graph.row(i)) {
                let place = body.graph.row(j as usize).binary_search(&(i as u32));
                let back = body.graph.pairs(j as usize).start + place.unwrap();
                if factors[pair].to_bits() != factors[back].to_bits() {
                    return None;
                }
            }
        }
        let mut touched = Vec::new();
        for i in 0..body.x.len() {
            if body.graph.pairs(i).any(|pair| factors[pair] < 1.0) {
                touched.push(i as u32);
            }
        }
        let mut stencils = body.stencils.clone();
        stencils
            .update_rows(&body.x, &body.graph, &factors, &touched)
            .unwrap();
        // Of the set-up, the forms other than rules use the coupling distances only.
        let seconds = [
            (start - begin).as_secs_f64(),
            (middle - start).as_secs_f64(),
            middle.elapsed().as_secs_f64(),
        ];
        Some(Self {
            body,
            stencils,
            factors,
            touched,
            seconds,
            pairs,
        })
    }

    /// Restores the constraint on the faces of a finished cut.
    pub(crate) fn finish(&mut self, cuts: &Cuts) -> StrokeReport {
        let mut near = self.touched.clone();
        for &i in &self.touched {
            near.extend_from_slice(self.body.graph.row(i as usize));
        }
        near.sort_unstable();
        near.dedup();
        let (offsets, normals) = self.pairs.normals_near(cuts, &near);
        let projectors: Vec<DMat3> = offsets
            .windows(2)
            .map(|w| normal_projector(&normals[w[0] as usize..w[1] as usize]))
            .collect();
        self.stencils
            .finish_stroke(&self.body.x, &self.body.graph, &near, &projectors)
    }

    /// The elastic model of the cut body.
    pub(crate) fn elastic(&self) -> Elastic {
        let b = self.body;
        let stencils = Stencils {
            offsets: b.graph.offsets(),
            indices: b.graph.indices(),
            gradients: &self.stencils.pair_gradients,
            self_gradients: &self.stencils.self_gradients,
            weights: &self.stencils.weights,
        };
        let nodes = Nodes {
            rest_positions: &b.x,
            volumes: &b.volumes,
        };
        let material = Materials::Uniform(Material::neo_hookean(YOUNG, POISSON));
        Elastic::new(&stencils, &nodes, &material, &Settings::default()).unwrap()
    }

    /// Displacements under nodal forces by conjugate gradients; components with mask 0 are held.
    pub(crate) fn solve(&self, forces: &[DVec3], mask: impl Fn(DVec3) -> DVec3) -> Vec<DVec3> {
        let b = self.body;
        let mut elastic = self.elastic();
        let n = b.x.len();
        elastic.forces_into(&b.x, &mut vec![DVec3::ZERO; n]);
        let mask: Vec<DVec3> = b.x.iter().map(|&x| mask(x)).collect();
        let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
        let mut u = vec![DVec3::ZERO; n];
        let mut r: Vec<DVec3> = forces.iter().zip(&mask).map(|(f, m)| *f * *m).collect();
        let mut p = r.clone();
        let mut product = vec![DVec3::ZERO; n];
        let mut rr = dot(&r, &r);
        let end = rr * 1e-20;
        for _ in 0..8000 {
            if rr <= end {
                break;
            }
            elastic.tangent_product_into(&p, &mut product);
            for (q, m) in product.iter_mut().zip(&mask) {
                *q *= *m;
            }
            let step = rr / dot(&p, &product);
            for i in 0..n {
                u[i] += step * p[i];
                r[i] -= step * product[i];
            }
            let next = dot(&r, &r);
            for i in 0..n {
                p[i] = r[i] + next / rr * p[i];
            }
            rr = next;
        }
        assert!(rr <= end, "residual {}", (rr / end).sqrt() * 1e-10);
        u
    }

    /// Displacement gradients at the nodes.
    pub(crate) fn gradients(&self, u: &[DVec3]) -> Vec<DMat3> {
        (0..u.len())
            .map(|i| {
                let mut sum = DMat3::ZERO;
                for pair in self.body.graph.pairs(i) {
                    let du = u[self.body.graph.indices()[pair] as usize] - u[i];
                    let g = self.stencils.pair_gradients[pair];
                    sum += DMat3::from_cols(du * g.x, du * g.y, du * g.z);
                }
                sum
            })
            .collect()
    }

    /// Opening of the cut along `normal` at a point of its face: both sides by the nearest nodes that
    /// look at it from that side, each with its own gradient.
    pub(crate) fn opening(
        &self,
        cuts: &Cuts,
        u: &[DVec3],
        gradients: &[DMat3],
        at: DVec3,
        normal: DVec3,
    ) -> f64 {
        let eps = 1e-6 * self.body.spacing;
        let side = |sign: f64| -> f64 {
            let from = at + sign * eps * normal;
            let (mut best, mut nearest) = (f64::INFINITY, 0);
            for (i, x) in self.body.x.iter().enumerate() {
                let d = x.distance(at);
                if d < best && d < 3.0 * self.body.spacing && !cuts.crosses(from, *x) {
                    (best, nearest) = (d, i);
                }
            }
            let value = u[nearest] + gradients[nearest] * (at - self.body.x[nearest]);
            value.dot(normal)
        };
        side(1.0) - side(-1.0)
    }
}

impl CutBody<'_> {
    /// Opening of the cut along `normal` at a point of its face, of the displacement as a field:
    /// linear moving least squares on either side over the nodes within 2.2 spacings that the cut does
    /// not hide.
    pub(crate) fn field_opening(&self, cuts: &Cuts, u: &[DVec3], at: DVec3, normal: DVec3) -> f64 {
        let (dx, radius) = (self.body.spacing, 2.2 * self.body.spacing);
        let side = |sign: f64| -> f64 {
            let from = at + sign * 1e-6 * dx * normal;
            let (mut moment, mut sum) = (DMat4::ZERO, DVec4::ZERO);
            for (x, u) in self.body.x.iter().zip(u) {
                let q = x.distance(from) / radius;
                if q < 1.0 && !cuts.crosses(from, *x) {
                    let basis = ((*x - at) / dx).extend(1.0);
                    let weighted = (1.0 - q * q).powi(3) * basis;
                    moment += DMat4::from_cols(
                        weighted * basis.x,
                        weighted * basis.y,
                        weighted * basis.z,
                        weighted * basis.w,
                    );
                    sum += weighted * u.dot(normal);
                }
            }
            assert!(moment.determinant() > 1e-6, "too few nodes see {at}");
            (moment.inverse() * sum).w
        };
        side(1.0) - side(-1.0)
    }
}

/// Product over the strip's pieces, each with its own frame, within the coupling distance.
fn piece_products(body: &Body, cuts: &Cuts, reach: &[f64]) -> Vec<f64> {
    let mut factors = vec![1.0; body.graph.pair_count()];
    for t in (0..cuts.triangle_count()).step_by(2) {
        let triangle = cuts.triangle(t);
        let values: Vec<Option<f64>> = body
            .x
            .iter()
            .zip(reach)
            .map(|(x, h)| {
                let middle = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
                let near = x.distance(middle) < *h + 10.0 * body.spacing;
                near.then(|| triangle_enrichment(triangle, *x))
            })
            .collect();
        for i in 0..body.x.len() {
            for pair in body.graph.pairs(i) {
                let j = body.graph.indices()[pair] as usize;
                if let (Some(a), Some(b)) = (values[i], values[j]) {
                    let (a, b) = if i < j { (a, b) } else { (b, a) };
                    factors[pair] *= 0.25 * (2.0 + (a.signum() * b + b.signum() * a));
                }
            }
        }
    }
    factors
}

/// Setting up the whole body anew with the weights of a cut and the old boundary vectors: what glues.
pub(crate) fn glued(cut: &CutBody<'_>) -> ConservativeStencils {
    let body = cut.body;
    let weights: Vec<f64> = inverse_square_weights(&body.x, &body.graph)
        .iter()
        .zip(&cut.factors)
        .map(|(w, f)| w * f)
        .collect();
    ConservativeStencils::new(
        &body.x,
        &body.volumes,
        &body.boundary,
        &body.graph,
        weights,
        &ConservativeSettings::default(),
    )
    .unwrap()
}
