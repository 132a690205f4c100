//! The sphere on a block so large that it is nearly a half-space.

use crate::problems::indentation::{HalfSpace, Ring};
use crate::report::{Cell, Series, Table, row};

pub(super) fn table(spaces: &[HalfSpace]) -> Table {
    let rows = spaces.iter().map(|space| {
        let mut row = row![
            space.nodes,
            space.size,
            100.0 * (space.force - 1.0),
            100.0 * (space.contact_radius - 1.0),
            space.products
        ];
        let inner = space.rings.iter().take(3);
        row.extend(inner.map(|ring| Cell::Number(100.0 * (ring.pressure / ring.expected - 1.0))));
        row
    });
    Table::new(
        "half-space",
        "Sphere on a large block against Hertz",
        "nodes (1); block (contact radii); force (%); contact radius (%); products (1); \
         pressure to 0.3 a (%); 0.3 to 0.55 a (%); 0.55 to 0.8 a (%)",
        rows.collect(),
    )
}

pub(super) fn pressures(spaces: &[HalfSpace]) -> Vec<Series> {
    let middle = |radii: [f64; 2]| 0.5 * (radii[0] + radii[1]);
    let profile = (0..=50).map(|k| {
        let r = f64::from(k) / 50.0;
        (r, (1.0 - r * r).sqrt())
    });
    let mut all = vec![Series::line("Hertz", profile.collect())];
    if let Some(space) = spaces.last() {
        let means = |of: fn(&Ring) -> f64| {
            let rings = space.rings.iter();
            rings.map(|ring| (middle(ring.radii), of(ring))).collect()
        };
        all.push(Series::line(
            "Hertz, means over rings",
            means(|ring| ring.expected),
        ));
        let name = format!("default, {} nodes, means over rings", space.nodes);
        all.push(Series::line(&name, means(|ring| ring.pressure)));
    }
    all
}
