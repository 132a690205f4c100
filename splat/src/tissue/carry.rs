//! Surfels follow their nodes.

use crate::cast::index;
use crate::render::splats::{Splats, bends};
use crate::render::surfels::Surfels;
use crate::tissue::binding::Binding;
use glam::{DMat3, DVec3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::{Add, Mul, Sub};

/// Surfels that are carried, and nodes whose maps are formed, by one thread at a time.
const CHUNK: usize = 128;

/// Carries surfels by their nodes' positions and deformation gradients.
///
/// `x(X) = Σ w_i(X) p_i` with `p_i = x_i + F_i (X - X_i)`. The disk's axes are r times the derivative
/// of x along the tangents, `F t + Σ p_i (∇w_i · t)` with `F = Σ w_i F_i`: neighbouring disks move
/// apart just as they grow, so that no hole opens where nodes disagree. The normal is `cof(F) N`
/// normalised, smoother than the disk's own; the linear field of normals over the disk is carried by
/// the same cofactor: where Aras 2014 calls Phong splatting (eq. (51)) unfit for bodies that deform,
/// this keeps it at the price of two products. All this replaces Aras 2014, eq. (59)
/// (`x = X + Σ w_i u_i / Σ w_i`, in print without its sum), which drags surfels behind in a rotation
/// and leaves normals where they were.
///
/// # Arguments
/// * `rest_nodes`, `nodes` -- node positions in the rest and the deformed frame (m), shape `(n)`.
/// * `gradients` -- deformation gradients of the nodes (1), shape `(n)`.
/// * `max_stretch` -- a disk's axis never grows beyond this times its radius: an overstretched
///   node near a cut would otherwise throw a disk over the picture.
/// * `splats` -- output, resized.
///
/// # Panics
/// If the slices disagree in length.
///
/// # Numerics
/// An affine map of the nodes with its gradient is reproduced to round-off. A singular `F` keeps
/// the rest normal. Same bits at any thread count.
#[allow(
    clippy::too_many_arguments,
    reason = "plain arrays in, plain arrays out"
)]
pub fn carry_into(
    surfels: &Surfels,
    binding: &Binding,
    rest_nodes: &[DVec3],
    nodes: &[DVec3],
    gradients: &[DMat3],
    max_stretch: f64,
    splats: &mut Splats,
) {
    let n = surfels.len();
    assert_eq!(binding.len(), n, "one binding row per surfel");
    assert_eq!(rest_nodes.len(), nodes.len(), "one position per node");
    assert_eq!(gradients.len(), nodes.len(), "one gradient per node");
    splats.positions.resize(n, DVec3::ZERO);
    splats.axes_u.resize(n, DVec3::ZERO);
    splats.axes_v.resize(n, DVec3::ZERO);
    splats.normals.resize(n, DVec3::ZERO);
    splats.bends_u.resize(n, DVec3::ZERO);
    splats.bends_v.resize(n, DVec3::ZERO);
    let maps: Vec<Map> = (rest_nodes, nodes, gradients)
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(|(&rest, &node, gradient)| Map::new(rest, node, gradient))
        .collect();
    let arch = Arch::new();
    splats
        .positions
        .par_chunks_mut(CHUNK)
        .zip(splats.axes_u.par_chunks_mut(CHUNK))
        .zip(splats.axes_v.par_chunks_mut(CHUNK))
        .zip(splats.normals.par_chunks_mut(CHUNK))
        .zip(splats.bends_u.par_chunks_mut(CHUNK))
        .zip(splats.bends_v.par_chunks_mut(CHUNK))
        .enumerate()
        .for_each(
            |(chunk, (((((positions, u), v), normals), bend_u), bend_v))| {
                arch.dispatch(Run {
                    from: (surfels, binding, &maps),
                    max_stretch,
                    first: chunk * CHUNK,
                    positions,
                    axes: [u, v],
                    normals,
                    bends: [bend_u, bend_v],
                });
            },
        );
}

/// A run of surfels to carry, by the instructions that the processor at hand has.
struct Run<'a> {
    from: (&'a Surfels, &'a Binding, &'a [Map]),
    max_stretch: f64,
    /// Index of the first surfel.
    first: usize,
    positions: &'a mut [DVec3],
    axes: [&'a mut [DVec3]; 2],
    normals: &'a mut [DVec3],
    bends: [&'a mut [DVec3]; 2],
}

impl WithSimd for Run<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (surfels, binding, maps) = self.from;
        let x = self.positions;
        let ([u, v], [bend_u, bend_v]) = (self.axes, self.bends);
        let mut sums = [Sums::ZERO; CHUNK];
        for (k, sum) in sums[..x.len()].iter_mut().enumerate() {
            let i = self.first + k;
            let (row, weights) = binding.row(i);
            *sum = blend(surfels.positions[i], row, weights, binding.slopes(i), maps);
        }
        for (k, sum) in sums[..x.len()].iter().enumerate() {
            let carried = carry(surfels, self.first + k, sum, self.max_stretch);
            x[k] = carried.position;
            [u[k], v[k]] = carried.axes;
            self.normals[k] = carried.normal;
            [bend_u[k], bend_v[k]] = carried.bends;
        }
    }
}

/// A vector padded to four numbers, so that one instruction works on all of it where the processor
/// has such. Sums and products stay apart: same bits on any processor.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
struct Wide([f64; 4]);

impl Wide {
    const ZERO: Self = Self([0.0; 4]);

    #[inline(always)]
    fn new(v: DVec3) -> Self {
        Self([v.x, v.y, v.z, 0.0])
    }

    #[inline(always)]
    fn vector(self) -> DVec3 {
        let [x, y, z, _] = self.0;
        DVec3::new(x, y, z)
    }
}

impl Add for Wide {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]])
    }
}

impl Sub for Wide {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]])
    }
}

impl Mul<f64> for Wide {
    type Output = Self;

    #[inline(always)]
    fn mul(self, by: f64) -> Self {
        let a = self.0;
        Self([a[0] * by, a[1] * by, a[2] * by, a[3] * by])
    }
}

/// The affine map of one node: `p(X) = F X + shift`.
#[derive(Debug, Clone, Copy)]
struct Map {
    axes: [Wide; 3],
    shift: Wide,
}

impl Map {
    fn new(rest: DVec3, node: DVec3, gradient: &DMat3) -> Self {
        Self {
            axes: [gradient.x_axis, gradient.y_axis, gradient.z_axis].map(Wide::new),
            shift: Wide::new(node - *gradient * rest),
        }
    }

    #[inline(always)]
    fn point(&self, x: DVec3) -> Wide {
        turned(&self.axes, x) + self.shift
    }
}

/// A matrix of the given columns times a vector.
#[inline(always)]
fn turned(columns: &[Wide; 3], x: DVec3) -> Wide {
    columns[0] * x.x + columns[1] * x.y + columns[2] * x.z
}

/// One surfel in the deformed frame.
struct Carried {
    position: DVec3,
    axes: [DVec3; 2],
    normal: DVec3,
    bends: [DVec3; 2],
}

/// What the nodes of a surfel make of it.
#[derive(Debug, Clone, Copy)]
struct Sums {
    at: Wide,
    gradient: [Wide; 3],
    /// What the change of the weights over the disk adds to its axes.
    drift: [Wide; 2],
}

impl Sums {
    const ZERO: Self = Self {
        at: Wide::ZERO,
        gradient: [Wide::ZERO; 3],
        drift: [Wide::ZERO; 2],
    };
}

/// Sums over a row of nodes. They are handed back whole: told to go on with three of four numbers,
/// the compiler shuffles in every step.
#[inline(always)]
fn blend(rest: DVec3, row: &[u32], weights: &[f64], slopes: &[[f64; 2]], maps: &[Map]) -> Sums {
    let first = maps[index(row[0])].point(rest);
    let mut sums = Sums {
        at: first,
        ..Sums::ZERO
    };
    for ((&node, &w), slope) in row.iter().zip(weights).zip(slopes) {
        let map = &maps[index(node)];
        let aside = map.point(rest) - first;
        sums.at = sums.at + aside * w;
        for k in 0..3 {
            sums.gradient[k] = sums.gradient[k] + map.axes[k] * w;
        }
        sums.drift[0] = sums.drift[0] + aside * slope[0];
        sums.drift[1] = sums.drift[1] + aside * slope[1];
    }
    sums
}

/// The surfel that the sums make.
#[inline(always)]
fn carry(surfels: &Surfels, i: usize, sums: &Sums, max_stretch: f64) -> Carried {
    let (f, drift) = (&sums.gradient, &sums.drift);
    let normal = surfels.normals[i];
    let radius = surfels.radii[i];
    let (t0, t1) = Surfels::tangents(normal);
    let (a, b) = (turned(f, t0), turned(f, t1));
    let u = (a + drift[0]).vector().clamp_length_max(max_stretch) * radius;
    let v = (b + drift[1]).vector().clamp_length_max(max_stretch) * radius;
    let (a, b) = (a.vector(), b.vector());
    let raw = a.cross(b);
    let length = raw.length();
    let mut carried = Carried {
        position: sums.at.vector(),
        axes: [u, v],
        normal,
        bends: [DVec3::ZERO; 2],
    };
    if length > 0.0 {
        // cof(F) t0 = F t1 × F n and cof(F) t1 = F n × F t0, as t0, t1, n are a right-handed frame.
        let c = turned(f, normal).vector();
        let per = radius / length;
        let (t0, t1) = (b.cross(c) * per, c.cross(a) * per);
        let shape = surfels.shapes[i];
        carried.normal = raw / length;
        carried.bends = bends(shape, t0, t1);
    }
    carried
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Tissue, TissueSettings};

    /// Numbers between -1 and 1 without order.
    fn noise(i: usize) -> f64 {
        (12.9898 * crate::cast::real(i + 1)).sin() * 43.7585 % 1.0
    }

    fn vector(i: usize) -> DVec3 {
        DVec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2))
    }

    /// Surfels on a ball that bulge anyhow, and nodes that were moved and turned anyhow.
    fn scene() -> (Tissue, Surfels, Vec<DVec3>, Vec<DVec3>, Vec<DMat3>) {
        let normals: Vec<DVec3> = (0..1_000).map(|i| vector(i).normalize()).collect();
        let areas = vec![0.0126; normals.len()];
        let nodes: Vec<DVec3> = (1_000..1_300).map(vector).collect();
        let settings = TissueSettings::default();
        let tissue = Tissue::new(&normals, &normals, &areas, &nodes, &settings)
            .expect("unit normals and finite nodes");
        let mut surfels = tissue.surfels().clone();
        surfels.shapes = (2_000..3_000).map(vector).collect();
        let moved = nodes.iter().zip(4_000..).map(|(&x, i)| x + 0.2 * vector(i));
        let gradients = (5_000..).step_by(3).take(nodes.len()).map(|i| {
            let columns = [0, 1, 2].map(|k| DMat3::IDENTITY.col(k) + 0.3 * vector(i + k));
            DMat3::from_cols(columns[0], columns[1], columns[2])
        });
        let (moved, gradients) = (moved.collect(), gradients.collect());
        (tissue, surfels, nodes, moved, gradients)
    }

    /// The formulas as they stand, pair by pair.
    #[test]
    fn carrying_is_what_its_formulas_say() {
        let (tissue, surfels, rest_nodes, nodes, gradients) = scene();
        let binding = tissue.binding();
        let mut splats = Splats::default();
        carry_into(
            &surfels,
            binding,
            &rest_nodes,
            &nodes,
            &gradients,
            1e9,
            &mut splats,
        );
        let mut worst: f64 = 0.0;
        for i in 0..surfels.len() {
            let (row, weights) = binding.row(i);
            let (t0, t1) = Surfels::tangents(surfels.normals[i]);
            let r = surfels.radii[i];
            let (mut x, mut u, mut v) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
            let mut f = DMat3::ZERO;
            for (k, &node) in row.iter().enumerate() {
                let node = index(node);
                let p = nodes[node] + gradients[node] * (surfels.positions[i] - rest_nodes[node]);
                x += p * weights[k];
                f += gradients[node] * weights[k];
                u += p * binding.slopes(i)[k][0];
                v += p * binding.slopes(i)[k][1];
            }
            let cofactor = f.inverse().transpose() * f.determinant();
            let normal = cofactor * surfels.normals[i];
            let bend = bends(surfels.shapes[i], t0, t1).map(|b| cofactor * b * r / normal.length());
            for (found, expected) in [
                (splats.positions[i], x),
                (splats.axes_u[i], (f * t0 + u) * r),
                (splats.axes_v[i], (f * t1 + v) * r),
                (splats.normals[i], normal.normalize()),
                (splats.bends_u[i], bend[0]),
                (splats.bends_v[i], bend[1]),
            ] {
                worst = worst.max(found.distance(expected) / expected.length().max(1.0));
            }
        }
        // 9e-16.
        assert!(worst < 1e-14, "off by {worst:e}");
    }

    #[test]
    fn bits_depend_neither_on_threads_nor_on_the_processor() {
        let (tissue, surfels, rest_nodes, nodes, gradients) = scene();
        let with = |threads: usize| {
            let mut splats = Splats::default();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().expect("threads").install(|| {
                let to = &mut splats;
                carry_into(
                    &surfels,
                    tissue.binding(),
                    &rest_nodes,
                    &nodes,
                    &gradients,
                    3.0,
                    to,
                );
            });
            splats
        };
        let one = with(1);
        assert_eq!(one, with(4));
        let maps: Vec<Map> = (0..nodes.len())
            .map(|i| Map::new(rest_nodes[i], nodes[i], &gradients[i]))
            .collect();
        let mut plain = one.clone();
        plain.positions.fill(DVec3::ZERO);
        Run {
            from: (&surfels, tissue.binding(), &maps),
            max_stretch: 3.0,
            first: 0,
            positions: &mut plain.positions[..CHUNK],
            axes: [&mut plain.axes_u[..CHUNK], &mut plain.axes_v[..CHUNK]],
            normals: &mut plain.normals[..CHUNK],
            bends: [&mut plain.bends_u[..CHUNK], &mut plain.bends_v[..CHUNK]],
        }
        .with_simd(pulp::Scalar);
        assert_eq!(plain.positions[..CHUNK], one.positions[..CHUNK]);
        assert_eq!((plain.axes_u, plain.axes_v), (one.axes_u, one.axes_v));
        assert_eq!(plain.normals, one.normals);
        assert_eq!((plain.bends_u, plain.bends_v), (one.bends_u, one.bends_v));
    }
}
