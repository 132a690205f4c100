//! Cuts: one update, a whole cut by the default and by the grid, queries.
//! `cargo bench -p benches --bench enrich`
#![allow(missing_docs, reason = "criterion emits undocumented functions")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::unwrap_used,
    reason = "benchmark inputs are small and valid"
)]

mod time;

use std::hint::black_box;
use std::ops::Range;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use phyxel_enrich::{
    CutSettings, Cuts, EnrichmentGrid, FactorSettings, Graph, GridForm, GridSettings, PairFactors,
    Rule, connected_pieces, grid_pair_factors,
};
use testkit::cloud;
use time::time;

const SIDES: [usize; 3] = [10, 22, 46];

/// Jittered lattice of spacing 1, joined to its 6 nearest and 12 next nearest positions.
struct Block {
    x: Vec<DVec3>,
    offsets: Vec<u32>,
    indices: Vec<u32>,
    side: f64,
}

impl Block {
    fn new(side: usize, jitter: f64) -> Self {
        let x = cloud::lattice([side; 3], 1.0, jitter, 3);
        let (offsets, indices) = cloud::lattice_rows([side; 3]);
        Self {
            x,
            offsets,
            indices,
            side: side as f64,
        }
    }

    fn graph(&self) -> Graph<'_> {
        Graph::new_unchecked(&self.x, &self.offsets, &self.indices)
    }

    fn factors(&self, rule: Rule) -> PairFactors {
        let settings = FactorSettings {
            rule,
            ..FactorSettings::default()
        };
        PairFactors::new(&self.graph(), &settings)
    }

    /// Factors that know of all of a cut.
    fn cut(&self, rule: Rule, cuts: &Cuts) -> PairFactors {
        let mut factors = self.factors(rule);
        self.update(&mut factors, cuts, 0..cuts.triangle_count());
        factors
    }

    /// Takes triangles of cuts in.
    fn update(&self, factors: &mut PairFactors, cuts: &Cuts, new: Range<usize>) {
        black_box(factors.update(&self.graph(), cuts, new, &|p| self.inside(p)));
    }

    /// A strip in the middle that has come half way, in pieces of one spacing.
    fn half_cut(&self) -> (Cuts, usize) {
        let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
        let stroke = cuts.start(&self.blade(-1.0)).unwrap();
        for k in 0..self.side as usize / 2 {
            cuts.append(stroke, &self.blade(k as f64)).unwrap();
        }
        (cuts, stroke)
    }

    fn blade(&self, at: f64) -> [DVec3; 2] {
        let y = 0.5 * self.side + 0.2 + 0.5 * (0.3 * at).sin();
        [
            DVec3::new(at + 0.4, y, 0.5 * self.side - 0.4),
            DVec3::new(at + 0.4, y, 0.5 * self.side + 1.1),
        ]
    }

    fn inside(&self, p: DVec3) -> bool {
        p.cmpge(DVec3::splat(-0.5)).all() && p.cmple(DVec3::splat(self.side - 0.5)).all()
    }
}

fn update(c: &mut Criterion) {
    let mut group = c.benchmark_group("enrich/update_two_triangles");
    for side in SIDES {
        let block = Block::new(side, 0.1);
        for (name, rule) in [
            ("diffraction", Rule::Diffraction),
            ("visibility", Rule::Visibility),
        ] {
            let (mut cuts, stroke) = block.half_cut();
            let before = block.cut(rule, &cuts);
            let edge = block.blade((side / 2) as f64);
            let new = cuts.append(stroke, &edge).unwrap();
            // The state before is copied outside of the timed part.
            group.bench_function(BenchmarkId::new(name, block.x.len()), |b| {
                b.iter_batched_ref(
                    || before.clone(),
                    |factors| block.update(factors, &cuts, new.clone()),
                    BatchSize::LargeInput,
                );
            });
        }
    }
}

fn whole_cut(c: &mut Criterion) {
    let mut group = c.benchmark_group("enrich/whole_half_cut");
    for side in SIDES {
        let block = Block::new(side, 0.1);
        let (cuts, _) = block.half_cut();
        group.throughput(Throughput::Elements(cuts.triangle_count() as u64));
        group.bench_function(BenchmarkId::new("diffraction", block.x.len()), |b| {
            b.iter_batched_ref(
                || block.factors(Rule::Diffraction),
                |factors| block.update(factors, &cuts, 0..cuts.triangle_count()),
                BatchSize::LargeInput,
            );
        });
        let blades: Vec<[DVec3; 2]> = (0..side / 2).map(|k| block.blade(k as f64)).collect();
        let settings = GridSettings::for_spacing(1.0);
        let reach = vec![2.5; block.x.len()];
        time(&mut group, "grid", block.x.len(), || {
            let grid = EnrichmentGrid::from_blades(&blades, &settings).unwrap();
            grid_pair_factors(&[grid], &block.graph(), &reach, GridForm::OneSidedMean)
        });
    }
}

fn queries(c: &mut Criterion) {
    let mut group = c.benchmark_group("enrich/queries");
    for side in SIDES {
        let block = Block::new(side, 0.1);
        let (cuts, _) = block.half_cut();
        let middle = DVec3::splat(0.5 * block.side);
        let pairs = cloud::uniform(1000, 0.4 * block.side, 9).into_iter();
        let pairs = pairs.map(|p| (middle + p, middle + p + DVec3::new(0.3, 1.1, 0.2)));
        let pairs: Vec<(DVec3, DVec3)> = pairs.collect();
        group.throughput(Throughput::Elements(1000));
        time(&mut group, "crosses", block.x.len(), || {
            pairs.iter().filter(|(p, q)| cuts.crosses(*p, *q)).count()
        });
        let factors = block.cut(Rule::Diffraction, &cuts).to_vec();
        group.throughput(Throughput::Elements(block.x.len() as u64));
        time(&mut group, "connected_pieces", block.x.len(), || {
            connected_pieces(&block.offsets, &block.indices, black_box(&factors))
        });
    }
}

criterion_group!(benches, update, whole_cut, queries);
criterion_main!(benches);
