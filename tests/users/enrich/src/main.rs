//! How much a cut leaves between the nodes of a plate.

use phyxel_enrich::{CutSettings, Cuts, FactorSettings, PairFactors, Rows, glam::DVec3};

/// Edges of a lattice of ten by ten nodes.
fn edges() -> impl Iterator<Item = [u32; 2]> {
    let right = (0..100).filter(|i| i % 10 < 9).map(|i| [i, i + 1]);
    right.chain((0..90).map(|i| [i, i + 10]))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let at = |i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 0.0);
    let x: Vec<DVec3> = (0..100).map(at).collect();
    let rows = Rows::from_edges(x.len(), edges())?;
    let graph = rows.graph(&x)?;
    let mut factors = PairFactors::new(&graph, &FactorSettings::default());
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    let blade = |y: f64| [-1.0, 1.0].map(|z| DVec3::new(4.5, y, z));
    let stroke = cuts.start(&blade(-1.0))?;
    let new = cuts.append(stroke, &blade(5.6))?;
    factors.update(&graph, &cuts, new, &|_| true);
    let crossed: Vec<(u32, u32, f64)> = factors.crossed(&graph).collect();
    println!("crossed: {crossed:?}");
    assert_eq!(crossed.len(), 6); // rows 0 to 5
    Ok(())
}
