//! Error of the ways back from world to material points under five deformations.
//!
//! `cargo run --release -p phyxel-mls --example inverse_map`
#![allow(clippy::print_stdout, reason = "prints its table")]

use glam::{DMat3, DVec3};
use phyxel_mls::{
    MapKind, MapSettings, MaterialMap, NearestSettings, k_nearest, mean_neighbor_distance,
};
use testkit::cloud::{Random, lattice};

type Motion = (&'static str, fn(DVec3) -> DVec3);

/// Deformations of the unit cube.
const MOTIONS: [Motion; 5] = [
    ("rotation 40 deg, shift 2", |x| {
        DMat3::from_rotation_z(40.0_f64.to_radians()) * x + DVec3::X * 2.0
    }),
    ("shear 0.5", |x| DVec3::new(x.x + 0.5 * x.y, x.y, x.z)),
    ("bend, radius 0.7", |x| {
        let (across, angle) = (0.7 - (x.x - 0.5), (x.z - 0.5) / 0.7);
        DVec3::new(0.7 - across * angle.cos(), x.y, across * angle.sin())
    }),
    ("twist 2.1 rad", |x| {
        DMat3::from_rotation_z(2.1 * x.z) * (x - DVec3::new(0.5, 0.5, 0.0))
    }),
    ("uneven stretch", |x| {
        DVec3::new(
            x.x + 0.3 * x.x * x.x,
            x.y * (1.0 - 0.2 * x.x),
            x.z + 0.1 * (3.0 * x.z).sin(),
        )
    }),
];

/// Gradient by central differences of a smooth function, good to about 1e-10.
fn gradient(motion: fn(DVec3) -> DVec3, x: DVec3) -> DMat3 {
    let h = 1e-5;
    let along = |d: DVec3| (motion(x + d * h) - motion(x - d * h)) / (2.0 * h);
    DMat3::from_cols(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
}

fn main() {
    let n = 12_u32;
    let spacing = 1.0 / f64::from(n);
    let half = DVec3::splat(0.5 * spacing);
    let points: Vec<DVec3> = lattice([12; 3], spacing, 0.25, 2)
        .iter()
        .map(|&x| x + half)
        .collect();
    let search = NearestSettings {
        nearest: 16,
        scale: 1.5,
        limit: None,
    };
    let found = k_nearest(&points, &search).expect("a finite cloud");
    let graph = found.neighborhoods.symmetrized().expect("few pairs");
    let radii: Vec<f64> = mean_neighbor_distance(&points, &graph)
        .iter()
        .map(|r| 1.7 * r)
        .collect();
    let map = MaterialMap::new(&points, &radii, &graph, &MapSettings::default())
        .expect("a finite cloud with positive radii");

    println!("largest error over 600 inner points, in node spacings");
    println!(
        "{:<26} {:>9} {:>5} {:>6} {:>10} {:>10} {:>10} {:>10}",
        "motion", "Newton", "steps", "failed", "(62) rest", "(62) now", "(63)", "1/d (63)"
    );
    for (name, motion) in MOTIONS {
        let moved: Vec<DVec3> = points.iter().map(|&x| motion(x)).collect();
        let gradients: Vec<DMat3> = points.iter().map(|&x| gradient(motion, x)).collect();
        let frame = map.frame(&moved, &gradients).expect("finite motion");
        let mut random = Random::new(5);
        let mut worst = [0.0_f64; 5];
        let (mut steps, mut failed, mut alone) = (0, 0, 0);
        for _ in 0..600 {
            let material = DVec3::splat(0.5) + random.vector(0.46);
            let start = frame.nearest_node(motion(material));
            // The world point that eq. (61) itself gives, so that only the solver is judged.
            let world = frame
                .to_world(material, start)
                .expect("inside the supports");
            let point = frame.to_material(world);
            match point.kind {
                MapKind::Newton { iterations } => steps = steps.max(iterations),
                MapKind::Shepard => failed += 1,
            }
            let rest = frame.one_shot_rest_weights(world);
            alone += usize::from(rest.is_none());
            let answers = [
                Some(point.position),
                rest,
                frame.one_shot_current_weights(world),
                Some(frame.distance_weighted(world)),
                Some(frame.inverse_distance_weighted(world)),
            ];
            for (worst, answer) in worst.iter_mut().zip(answers) {
                if let Some(answer) = answer {
                    *worst = worst.max((answer - material).length() / spacing);
                }
            }
        }
        let rest = if alone > 300 {
            "no nodes".into()
        } else {
            format!("{:.3}", worst[1])
        };
        println!(
            "{name:<26} {:>9.1e} {steps:>5} {failed:>6} {rest:>10} {:>10.1e} {:>10.3} {:>10.3}",
            worst[0], worst[2], worst[3], worst[4]
        );
        assert!(worst[0] < 1e-10 && steps <= 4 && failed == 0, "{name}");
        assert!(worst[3] > 0.1, "the text's fallback is far off");
    }
}
