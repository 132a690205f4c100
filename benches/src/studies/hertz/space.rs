//! The sphere on a block so large that it is nearly a half-space.

use crate::problems::indentation::{HalfSpace, Ring, half_space, hertz_radius};
use crate::report::{Cell, Series, Table, row};
use crate::{Effort, StudyError};

/// Depth (m) of the sphere.
const DEPTH: f64 = 0.0025;

/// Half of the cells along an axis over 1.44 contact radii, then as many that grow until 46.
pub(super) fn press(effort: Effort) -> Result<Vec<HalfSpace>, StudyError> {
    // On 12 and 14 cells, which grow by more than twofold, the stencils' solve stops at 1e-6.
    let cells: &[u32] = effort.choose(&[16, 20, 24], &[10]);
    let a = hertz_radius(DEPTH);
    let press = |&cells: &u32| {
        let half = cells / 2;
        let fine = 1.44 * a / f64::from(half);
        let outside = |growth: f64| {
            let widths = (1..=half).map(|k| fine * growth.powf(f64::from(k)));
            widths.sum::<f64>()
        };
        let (mut low, mut high) = (1.0, 20.0);
        for _ in 0..60 {
            let growth = 0.5 * (low + high);
            if outside(growth) < 44.0 * a {
                low = growth;
            } else {
                high = growth;
            }
        }
        half_space(DEPTH, fine, [half, cells - half], low, 1e-10)
    };
    cells.iter().map(press).collect()
}

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
        let expected = means(|ring| ring.expected);
        all.push(Series::line("Hertz, means over rings", expected));
        let name = format!("default, {} nodes, means over rings", space.nodes);
        all.push(Series::line(&name, means(|ring| ring.pressure)));
    }
    all
}
