//! Sheets that end near the faces of older ones, and on the surface.

use glam::DVec3;
use testkit::cloud::{Random, lattice, lattice_rows};

use crate::{CutSettings, Cuts, FactorSettings, Graph, PairFactors, connected_pieces};

/// Height of the older sheet over the plane x, z: even, or wavy.
fn height(wavy: bool, x: f64, z: f64) -> f64 {
    if wavy {
        5.0 + 0.45 * (0.6 * x).sin() * (0.5 * z).cos()
    } else {
        5.0 + 0.1 * x - 0.05 * z
    }
}

/// An edge of points 0.7 spacings apart along z, across all of the body.
fn edge(at: impl Fn(f64) -> DVec3) -> Vec<DVec3> {
    (0..22).map(|m| at(-1.4 + 0.7 * f64::from(m))).collect()
}

/// Cuts a body of 12 x 12 x 12 nodes, one apart, by an older sheet and one that leans and ends `gap` above it; the
/// number of pieces of more than 3 nodes.
fn pieces(wavy: bool, gap: f64, lean: f64, down: bool, at: f64) -> usize {
    let x = lattice([12; 3], 1.0, 0.25, 11);
    let (offsets, indices) = lattice_rows([12; 3]);
    let graph = Graph::new(&x, &offsets, &indices).unwrap();
    let floor = |k: u32| {
        let u = -1.5 + 0.7 * f64::from(k);
        edge(|z| DVec3::new(u, height(wavy, u, z), z))
    };
    let wall = |share: f64| {
        edge(|z| {
            let foot = |y: f64| at + lean * (y - 5.0);
            // Where the leaning line meets the floor.
            let y = (0..60).fold(5.0, |y, _| 0.5 * (y + height(wavy, foot(y), z)));
            let y = y + gap / f64::hypot(1.0, lean);
            let y = y + share * (13.0 - y);
            DVec3::new(foot(y), y, z)
        })
    };
    let mut shares = [1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.0];
    if !down {
        shares.reverse();
    }
    let inside = |p: DVec3| (p - DVec3::splat(5.5)).abs().max_element() <= 6.0;
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    let mut factors = PairFactors::new(&graph, &FactorSettings::default());
    for edges in [(0..22).map(floor).collect(), shares.map(wall).to_vec()] {
        let edges: Vec<Vec<DVec3>> = edges;
        let stroke = cuts.start(&edges[0]).unwrap();
        for edge in &edges[1..] {
            let new = cuts.append(stroke, edge).unwrap();
            let new = cuts.carry_through(new, &inside);
            factors.update(&graph, &cuts, new, &inside);
        }
    }
    let sizes = connected_pieces(&offsets, &indices, &factors.to_vec()).sizes;
    sizes.iter().filter(|size| **size > 3).count()
}

/// Whatever side of the face it ends on, within a tenth of a spacing.
#[test]
fn a_sheet_that_ends_near_a_face_joins_it() {
    let mut random = Random::new(3);
    for wavy in [false, true] {
        for (k, gap) in [-0.1, -0.05, 0.0, 0.025, 0.05].into_iter().enumerate() {
            for (m, lean) in [0.0, 0.4, -1.2].into_iter().enumerate() {
                let (down, at) = ((k + m) % 2 == 0, 4.6 + 1.8 * random.unit());
                let case = format!("wavy {wavy}, gap {gap}, lean {lean}, down {down}, at {at}");
                assert_eq!(pieces(wavy, gap, lean, down, at), 3, "{case}");
            }
        }
    }
}

/// The sheet spans a body of 8 x 8 x 8 nodes, one apart, from surface to surface and no farther: the pairs that lie in its
/// surface hold both parts together.
#[test]
fn a_sheet_that_ends_on_the_surface_parts_the_body() {
    let x = lattice([8; 3], 1.0, 0.0, 0);
    let (offsets, indices) = lattice_rows([8; 3]);
    let graph = Graph::new(&x, &offsets, &indices).unwrap();
    let inside = |p: DVec3| (p - DVec3::splat(3.5)).abs().max_element() <= 3.5;
    for short in [0.0, 0.05, -1.0] {
        let found = [false, true].map(|carries| {
            let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
            let mut factors = PairFactors::new(&graph, &FactorSettings::default());
            let edge = |x: f64| [short, 7.0 - short].map(|z| DVec3::new(x, 3.3 + 0.02 * x, z));
            let stroke = cuts.start(&edge(short)).unwrap();
            for share in [0.3, 0.6, 1.0] {
                let at = short + share * (7.0 - 2.0 * short);
                let mut new = cuts.append(stroke, &edge(at)).unwrap();
                if carries {
                    new = cuts.carry_through(new, &inside);
                }
                factors.update(&graph, &cuts, new, &inside);
            }
            connected_pieces(&offsets, &indices, &factors.to_vec()).sizes
        });
        assert_eq!(found[1], [256, 256], "{short} before the surface");
        assert_eq!(
            found[0].len(),
            if short < 0.0 { 2 } else { 1 },
            "{short} without"
        );
    }
}
