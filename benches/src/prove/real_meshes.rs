//! Samplings of real organ meshes at the sizes that scenes have.

use std::path::Path;

use glam::{DMat3, DVec3};
use phyxel_discretize::{
    Grading, Refinement, SampleSettings, Solid, read_mesh, repair, sample_points, sample_tetrahedra,
};

use super::Proof;
use crate::organs;

/// Cells up to `coarsest` times wider inside and by `factor` finer in a ball around a vertex; nodes.
const SIZES: [(f64, f64, usize); 4] = [
    (1.0, 1.0, 3000),
    (1.0, 1.0, 10_000),
    (4.0, 1.0, 3000),
    (2.0, 0.5, 6000),
];
/// Smallest angle (degrees) that two faces of a tetrahedron may have.
const LEAST_ANGLE: f64 = 8.0;

/// What all meshes showed at one size.
struct Worst {
    angle: f64,
    count: f64,
    sum: f64,
    least_volume: f64,
    /// `sum b` over the area, and `sum b (x) X - V I` over the volume.
    open: f64,
    moment: f64,
}

impl Worst {
    /// Positions (m), volumes (m³) and boundary vectors (m²) of so many nodes as were asked for.
    fn nodes(
        &mut self,
        (x, volumes, boundary): (&[DVec3], &[f64], &[DVec3]),
        whole: f64,
        asked: usize,
    ) {
        let sum: f64 = volumes.iter().sum();
        self.sum = self.sum.max((sum / whole - 1.0).abs());
        let least = volumes.iter().copied().fold(f64::INFINITY, f64::min);
        self.least_volume = self.least_volume.min(least / whole);
        let off = (volumes.len() as f64 / asked as f64 - 1.0).abs();
        self.count = self.count.max(off);
        let (mut area, mut closed, mut moment) = (0.0, DVec3::ZERO, DMat3::IDENTITY * -whole);
        for (b, at) in boundary.iter().zip(x) {
            let x = *at - x[0];
            area += b.length();
            closed += *b;
            moment += DMat3::from_cols(*b * x.x, *b * x.y, *b * x.z);
        }
        let moment = moment.to_cols_array().map(f64::abs);
        self.moment = moment
            .into_iter()
            .fold(self.moment, |a, b| a.max(b / whole));
        self.open = self.open.max(closed.length() / area);
    }

    fn mesh(&mut self, file: &Path, size: (f64, f64, usize), points: bool) {
        let (coarsest, factor, nodes) = size;
        let read = read_mesh(file).expect("it can be read");
        let (mesh, _) = repair(&read.mesh, &Default::default()).expect("it can be repaired");
        let (at, radius) = (mesh.vertices[0], 0.1 * mesh.bounds().diagonal());
        let refinements = vec![Refinement {
            from: at,
            to: at,
            radius,
            factor,
        }];
        let settings = SampleSettings {
            grading: Grading {
                coarsest,
                refinements,
                ..Grading::default()
            },
            ..SampleSettings::nodes(nodes)
        };
        let solid = Solid::from_mesh(mesh);
        if points {
            let s = sample_points(&solid, &settings, true).expect("it can be sampled");
            let all = (&*s.positions, &*s.volumes, &*s.boundary_vectors);
            self.nodes(all, s.report.volume, nodes);
        } else {
            let s = sample_tetrahedra(&solid, &settings).expect("it can be sampled");
            let all = (&*s.positions, &*s.volumes, &*s.boundary_vectors);
            self.nodes(all, s.report.volume, nodes);
            self.angle = self.angle.min(s.report.quality.smallest_dihedral);
        }
    }
}

pub(super) fn real_meshes(proof: &mut Proof) {
    let Some(folder) = organs::folder() else {
        proof.holds("skipped: PHYXEL_MESHES names no folder of meshes", true);
        return;
    };
    let files = organs::meshes(&folder).expect("the folder can be read");
    for size in SIZES {
        for points in [false, true] {
            let mut worst = Worst {
                angle: f64::INFINITY,
                count: 0.0,
                sum: 0.0,
                least_volume: f64::INFINITY,
                open: 0.0,
                moment: 0.0,
            };
            for file in &files {
                worst.mesh(file, size, points);
            }
            let form = if points { "points" } else { "tetrahedra" };
            let (coarsest, factor, nodes) = size;
            let what = |what: &str| {
                format!(
                    "{} meshes, {nodes} nodes, coarsest {coarsest}, factor {factor}, {form}: {what}",
                    files.len()
                )
            };
            proof.below(what("count off by"), worst.count, 0.05);
            proof.below(what("volumes' sum off by"), worst.sum, 1e-12);
            proof.below(what("boundary vectors' sum"), worst.open, 1e-10);
            proof.below(what("their moment off the volume"), worst.moment, 3e-10);
            proof.above(what("least share of a node"), worst.least_volume, 1e-300);
            if !points {
                proof.above(what("least dihedral angle"), worst.angle, LEAST_ANGLE);
            }
        }
    }
}
