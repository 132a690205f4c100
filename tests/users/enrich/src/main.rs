//! How much a cut leaves between the nodes of a plate.

use phyxel_enrich::{CutSettings, Cuts, FactorSettings, PairFactors, Rows, glam::DVec3};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let x: Vec<DVec3> = (0..100).map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 0.0)).collect();
    let edges = (0..100_u32).flat_map(|i| [(i % 10 < 9).then_some([i, i + 1]), (i < 90).then_some([i, i + 10])]);
    let rows = Rows::from_edges(x.len(), edges.flatten())?;
    let graph = rows.graph(&x)?;
    let mut factors = PairFactors::new(&graph, &FactorSettings::default());
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    let blade = |y: f64| [-1.0, 1.0].map(|z| DVec3::new(4.5, y, z));
    let stroke = cuts.start(&blade(-1.0))?;
    let new = cuts.append(stroke, &blade(5.6))?;
    factors.update(&graph, &cuts, new, &|_| true);
    let crossed: Vec<(u32, u32, f64)> = factors.crossed(&graph).collect();
    println!("crossed: {crossed:?}");
    assert_eq!((crossed.len(), factors.severed_count()), (6, 5)); // the sixth sees round the end
    Ok(())
}
