//! Finite elements to time beside phyxel: explicit forces of eight elements at a time, in lanes.
#![allow(
    clippy::needless_range_loop,
    reason = "lanes, corners and axes are walked in step over several arrays"
)]

use std::ops::{Add, Mul, Neg, Sub};

use glam::{DMat3, DVec3};
use phyxel_integrate::ForceLaw;
use pulp::{Arch, Simd, WithSimd};

use super::elements::{displacements, linear_forces};
use super::solid::Solid;

/// Elements that are computed at a time.
const LANES: usize = 8;

/// A number of each lane's element.
#[derive(Debug, Clone, Copy)]
struct Wide([f64; LANES]);

macro_rules! lane_by_lane {
    ($($operator:ident $name:ident $sign:tt),*) => {
        $(impl $operator for Wide {
            type Output = Self;

            #[inline(always)]
            fn $name(mut self, other: Self) -> Self {
                for l in 0..LANES {
                    self.0[l] $sign other.0[l];
                }
                self
            }
        })*
    };
}
lane_by_lane![Add add +=, Sub sub -=, Mul mul *=];

impl Neg for Wide {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::all(0.0) - self
    }
}

impl Wide {
    #[inline(always)]
    fn all(value: f64) -> Self {
        Self([value; LANES])
    }

    /// `self * by + to`.
    #[inline(always)]
    fn times(mut self, by: Self, to: Self) -> Self {
        for l in 0..LANES {
            self.0[l] = self.0[l].mul_add(by.0[l], to.0[l]);
        }
        self
    }

    #[inline(always)]
    fn recip(mut self) -> Self {
        for l in 0..LANES {
            self.0[l] = 1.0 / self.0[l];
        }
        self
    }
}

/// A vector in each lane.
type Vector = [Wide; 3];

// Loops, not closures: these are compiled without the instructions that are chosen where the compiler leaves them apart.

/// `a by + to`.
#[inline(always)]
fn along(a: &Vector, by: Wide, to: &Vector) -> Vector {
    let [x, y, z] = *a;
    [x.times(by, to[0]), y.times(by, to[1]), z.times(by, to[2])]
}

#[inline(always)]
fn scaled(a: &Vector, by: Wide) -> Vector {
    [a[0] * by, a[1] * by, a[2] * by]
}

#[inline(always)]
fn less(a: &Vector, b: &Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn cross(a: &Vector, b: &Vector) -> Vector {
    [
        a[1].times(b[2], -(a[2] * b[1])),
        a[2].times(b[0], -(a[0] * b[2])),
        a[0].times(b[1], -(a[1] * b[0])),
    ]
}

#[inline(always)]
fn dot(a: &Vector, b: &Vector) -> Wide {
    a[0].times(b[0], a[1].times(b[1], a[2] * b[2]))
}

/// The cofactor matrix, columns as the argument's.
#[inline(always)]
fn cofactor([a, b, c]: &[Vector; 3]) -> [Vector; 3] {
    [cross(b, c), cross(c, a), cross(a, b)]
}

/// What of an element's corners its force needs.
#[derive(Debug, Clone)]
enum Kind {
    /// Boxes of one size, of selectively reduced integration (Hughes 2000, section 4.4): `μ (F − cof F)` at eight
    /// points, `(λ + μ) (J − 1) cof F` in the middle. With the lanes that are elements.
    Hexahedra(Vec<([[u32; LANES]; 8], Wide)>),
    /// Corotational linear tetrahedra (Müller and Gross 2004): `2 μ (F − R) + λ tr(Rᵀ F − I) R`, with `R` by three steps of
    /// Newton's iteration for the polar decomposition (Higham 1986). With gradients of the last three shape functions, and volumes.
    Tetrahedra(Vec<([[u32; LANES]; 4], [Vector; 3], Wide)>),
}

/// Corners of the cells of a lattice, cells and corners along x first.
pub fn boxes([nx, ny, nz]: [u32; 3]) -> Vec<[u32; 8]> {
    let number = |i: u32, j: u32, k: u32| i + (nx + 1) * (j + (ny + 1) * k);
    let mut elements = Vec::new();
    for (k, j) in (0..nz).flat_map(|k| (0..ny).map(move |j| (k, j))) {
        for i in 0..nx {
            let corner = |a: u32| number(i + (a & 1), j + (a >> 1 & 1), k + (a >> 2));
            elements.push([0, 1, 2, 3, 4, 5, 6, 7].map(corner));
        }
    }
    elements
}

/// Elements of a lattice, forces of finite strain.
#[derive(Debug, Clone)]
pub struct Lanes {
    rest: Vec<DVec3>,
    kind: Kind,
    solid: Solid,
    /// Edges of a box (m).
    cell: DVec3,
    arch: Arch,
    scratch: [Vec<DVec3>; 2],
}

impl Lanes {
    /// Hexahedra between the nodes of a lattice of `cells`, along x first.
    pub fn hexahedra(rest: &[DVec3], cells: [u32; 3], solid: Solid) -> Self {
        Self::boxes(rest, &boxes(cells), solid)
    }

    /// Hexahedra that are boxes of one size, corners as [`boxes`] has them.
    pub fn boxes(rest: &[DVec3], elements: &[[u32; 8]], solid: Solid) -> Self {
        let blocks = elements.chunks(LANES).map(|part| {
            let is_one = std::array::from_fn(|l| f64::from(u8::from(l < part.len())));
            (lanes_of(part), Wide(is_one))
        });
        Self::new(rest, Kind::Hexahedra(blocks.collect()), solid)
    }

    /// Tetrahedra.
    pub fn tetrahedra(rest: &[DVec3], tetrahedra: &[[u32; 4]], solid: Solid) -> Self {
        let blocks = tetrahedra.chunks(LANES).map(|part| {
            let mut gradients = [[Wide::all(0.0); 3]; 3];
            let mut volumes = Wide::all(0.0);
            // Lanes without an element have the first one's corners, and no volume.
            for l in 0..LANES {
                let t = part.get(l).unwrap_or(&part[0]);
                let [a, b, c, d] = t.map(|node| rest[node as usize]);
                let edges = DMat3::from_cols(b - a, c - a, d - a);
                let inverse = edges.inverse().transpose();
                for (column, g) in gradients.iter_mut().enumerate() {
                    for (k, lanes) in g.iter_mut().enumerate() {
                        lanes.0[l] = inverse.col(column)[k];
                    }
                }
                volumes.0[l] = if l < part.len() {
                    edges.determinant() / 6.0
                } else {
                    0.0
                };
            }
            (lanes_of(part), gradients, volumes)
        });
        Self::new(rest, Kind::Tetrahedra(blocks.collect()), solid)
    }

    fn new(rest: &[DVec3], kind: Kind, solid: Solid) -> Self {
        let cell = match &kind {
            Kind::Hexahedra(blocks) => {
                let [first, .., last] = blocks[0].0.map(|corner| rest[corner[0] as usize]);
                last - first
            }
            Kind::Tetrahedra(_) => DVec3::ZERO,
        };
        Self {
            rest: rest.to_vec(),
            kind,
            solid,
            cell,
            arch: Arch::new(),
            scratch: [rest.to_vec(), rest.to_vec()],
        }
    }

    /// Forces (N) at positions (m) into `forces`.
    pub fn explicit_into(&self, positions: &[DVec3], forces: &mut [DVec3]) {
        forces.fill(DVec3::ZERO);
        self.add_explicit(positions, forces);
    }

    /// Adds forces (N) at positions (m) to `forces`.
    pub fn add_explicit(&self, positions: &[DVec3], forces: &mut [DVec3]) {
        self.arch.dispatch(Pass {
            lanes: self,
            positions,
            forces,
        });
    }
}

/// A pass over the elements, made once for each kind of processor.
struct Pass<'a> {
    lanes: &'a Lanes,
    positions: &'a [DVec3],
    forces: &'a mut [DVec3],
}

impl WithSimd for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            lanes,
            positions,
            forces,
        } = self;
        let (mu, lambda) = lanes.solid.lame();
        match &lanes.kind {
            Kind::Hexahedra(blocks) => {
                for (corners, full) in blocks {
                    let constants = (mu, lambda, lanes.cell);
                    hexahedron(corners, full, constants, positions, forces);
                }
            }
            Kind::Tetrahedra(blocks) => {
                for block in blocks {
                    tetrahedron(block, mu, lambda, positions, forces);
                }
            }
        }
    }
}

/// Corners of up to eight elements, in lanes; lanes without one have the first's.
fn lanes_of<const N: usize>(part: &[[u32; N]]) -> [[u32; LANES]; N] {
    let lane = |a: usize, l: usize| part.get(l).unwrap_or(&part[0])[a];
    std::array::from_fn(|a| std::array::from_fn(|l| lane(a, l)))
}

#[inline(always)]
fn gather<const N: usize>(corners: &[[u32; LANES]; N], positions: &[DVec3]) -> [Vector; N] {
    let mut found = [[Wide::all(0.0); 3]; N];
    for a in 0..N {
        for l in 0..LANES {
            let x = positions[corners[a][l] as usize];
            (found[a][0].0[l], found[a][1].0[l], found[a][2].0[l]) = (x.x, x.y, x.z);
        }
    }
    found
}

#[inline(always)]
fn scatter(corner: &[u32; LANES], force: &Vector, forces: &mut [DVec3]) {
    for l in 0..LANES {
        forces[corner[l] as usize] += DVec3::new(force[0].0[l], force[1].0[l], force[2].0[l]);
    }
}

/// Sums and differences over the corners of a box: the trilinear modes 1, ξ, η, ξη, ζ, ξζ, ηζ, ξηζ of what is at its
/// corners, times 8; `BACK`, of forces by modes those at the corners, `Σ_m sign(m, a) f_m`.
#[inline(always)]
fn modes<const BACK: bool>(corners: &mut [Vector; 8]) {
    for bit in [1, 2, 4] {
        for a in 0..8 {
            if a & bit == 0 {
                for k in 0..3 {
                    let (low, high) = (corners[a][k], corners[a | bit][k]);
                    let (sum, difference) = (high + low, high - low);
                    (corners[a][k], corners[a | bit][k]) = if BACK {
                        (-difference, sum)
                    } else {
                        (sum, difference)
                    };
                }
            }
        }
    }
}

/// Forces of eight hexahedra, in the coordinates ξ, η, ζ of -1..=1.
#[inline(always)]
fn hexahedron(
    corners: &[[u32; LANES]; 8],
    full: &Wide,
    (mu, lambda, cell): (f64, f64, DVec3),
    positions: &[DVec3],
    forces: &mut [DVec3],
) {
    let mut x = gather(corners, positions);
    modes::<false>(&mut x);
    let volume = cell.x * cell.y * cell.z;
    // Of ∂ξ/∂x and of its square, with the eighths of the modes.
    let scale = DVec3::splat(mu * volume / 128.0) / (cell * cell);
    let scale = [Wide::all(scale.x), Wide::all(scale.y), Wide::all(scale.z)];
    let shrink = Wide::all(mu / 512.0);
    let mut sum = [[Wide::all(0.0); 3]; 8];
    let g = 1.0 / 3.0_f64.sqrt();
    for q in 0..8 {
        let s = Wide::all(if q & 1 == 0 { -g } else { g });
        let t = Wide::all(if q & 2 == 0 { -g } else { g });
        let r = Wide::all(if q & 4 == 0 { -g } else { g });
        let (st, sr, tr) = (s * t, s * r, t * r);
        let slopes = [
            along(&x[7], tr, &along(&x[5], r, &along(&x[3], t, &x[1]))),
            along(&x[7], sr, &along(&x[6], r, &along(&x[3], s, &x[2]))),
            along(&x[7], st, &along(&x[6], t, &along(&x[5], s, &x[4]))),
        ];
        let cofactors = cofactor(&slopes);
        let mut p = slopes;
        for c in 0..3 {
            p[c] = along(&cofactors[c], -shrink, &scaled(&slopes[c], scale[c]));
        }
        for k in 0..3 {
            sum[1][k] = sum[1][k] + p[0][k];
            sum[2][k] = sum[2][k] + p[1][k];
            sum[4][k] = sum[4][k] + p[2][k];
            sum[3][k] = t.times(p[0][k], s.times(p[1][k], sum[3][k]));
            sum[5][k] = r.times(p[0][k], s.times(p[2][k], sum[5][k]));
            sum[6][k] = r.times(p[1][k], t.times(p[2][k], sum[6][k]));
            sum[7][k] = tr.times(p[0][k], sr.times(p[1][k], st.times(p[2][k], sum[7][k])));
        }
    }
    // In the middle, with all of the volume.
    let middle = [x[1], x[2], x[4]];
    let cofactors = cofactor(&middle);
    let ratio = dot(&middle[0], &cofactors[0]) * Wide::all(1.0 / (64.0 * volume));
    let pressure = (ratio - Wide::all(1.0)) * Wide::all((lambda + mu) / 64.0);
    for c in 0..3 {
        sum[1 << c] = along(&cofactors[c], pressure, &sum[1 << c]);
    }
    modes::<true>(&mut sum);
    for a in 0..8 {
        scatter(&corners[a], &scaled(&sum[a], -*full), forces);
    }
}

/// Forces of eight tetrahedra.
#[inline(always)]
fn tetrahedron(
    (corners, gradients, volume): &([[u32; LANES]; 4], [Vector; 3], Wide),
    mu: f64,
    lambda: f64,
    positions: &[DVec3],
    forces: &mut [DVec3],
) {
    let x = gather(corners, positions);
    let edges = [less(&x[1], &x[0]), less(&x[2], &x[0]), less(&x[3], &x[0])];
    // Column c of F is the sum of edges times component c of their gradients.
    let mut f = edges;
    for c in 0..3 {
        let two = along(
            &edges[1],
            gradients[1][c],
            &scaled(&edges[0], gradients[0][c]),
        );
        f[c] = along(&edges[2], gradients[2][c], &two);
    }
    let half = Wide::all(0.5);
    let mut turn = f;
    for _ in 0..3 {
        let cofactors = cofactor(&turn);
        let inverse = half * dot(&turn[0], &cofactors[0]).recip();
        for c in 0..3 {
            turn[c] = along(&cofactors[c], inverse, &scaled(&turn[c], half));
        }
    }
    let mut trace = Wide::all(-3.0);
    for c in 0..3 {
        trace = trace + dot(&turn[c], &f[c]);
    }
    let (double, pull) = (Wide::all(2.0 * mu), Wide::all(lambda) * trace);
    let mut stress = f;
    for c in 0..3 {
        let stretched = scaled(&less(&f[c], &turn[c]), double);
        stress[c] = scaled(&along(&turn[c], pull, &stretched), -*volume);
    }
    let mut rest = [Wide::all(0.0); 3];
    for a in 0..3 {
        let g = &gradients[a];
        let two = along(&stress[1], g[1], &scaled(&stress[0], g[0]));
        let force = along(&stress[2], g[2], &two);
        rest = less(&rest, &force);
        scatter(&corners[a + 1], &force, forces);
    }
    scatter(&corners[0], &rest, forces);
}

/// Small strain about rest, by central differences of the explicit forces.
impl ForceLaw for Lanes {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let moved = displacements(positions, &self.rest);
        linear_forces(self, &moved, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        let largest = vector.iter().map(|v| v.abs().max_element());
        let largest = largest.fold(f64::MIN_POSITIVE, f64::max);
        let size = self.rest[1].distance(self.rest[0]);
        let scale = 1e-5 * size / largest;
        let [mut moved, mut back] = std::mem::take(&mut self.scratch);
        for (x, (rest, v)) in moved.iter_mut().zip(self.rest.iter().zip(vector)) {
            *x = *rest - *v * scale;
        }
        self.explicit_into(&moved, product);
        for (x, (rest, v)) in moved.iter_mut().zip(self.rest.iter().zip(vector)) {
            *x = *rest + *v * scale;
        }
        self.explicit_into(&moved, &mut back);
        for (product, back) in product.iter_mut().zip(&back) {
            *product = (*product - *back) / (2.0 * scale);
        }
        self.scratch = [moved, back];
    }
}

pub(crate) mod checks {
    use super::*;
    use crate::problems::block::lattice;

    /// A turned body has no forces, a stretched one none on inner nodes and `P n` per area on its faces, of Hooke's law.
    pub(crate) fn lanes_turn_freely_and_pass_the_patch_test() {
        let solid = Solid {
            youngs_modulus: 3.0,
            poissons_ratio: 0.4,
            density: 1.0,
        };
        let cells = [3, 3, 3];
        let (rest, tetrahedra) = lattice(cells, |s| s * DVec3::new(3.0, 2.4, 1.5));
        let (mu, lambda) = solid.lame();
        let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.0);
        let strain = 1e-5;
        let stretch = DMat3::from_diagonal(DVec3::new(1.0 + strain, 1.0, 1.0));
        for body in [
            Lanes::hexahedra(&rest, cells, solid),
            Lanes::tetrahedra(&rest, &tetrahedra, solid),
        ] {
            let mut forces = rest.clone();
            let mut at = |map: DMat3| {
                let positions: Vec<DVec3> = rest.iter().map(|x| map * *x).collect();
                body.explicit_into(&positions, &mut forces);
                forces.clone()
            };
            assert!(
                at(turn).iter().all(|f| f.length() < 1e-12),
                "{:?}",
                body.kind
            );
            let pulled = at(turn * stretch);
            let mut end = DVec3::ZERO;
            for (x, f) in rest.iter().zip(&pulled) {
                let inner = x.cmpgt(DVec3::ZERO) & x.cmplt(DVec3::new(2.9, 2.3, 1.4));
                assert!(!inner.all() || f.length() < 1e-12, "{x} {f}");
                end += if x.x > 2.9 { *f } else { DVec3::ZERO };
            }
            let known = turn * DVec3::NEG_X * ((lambda + 2.0 * mu) * strain * 2.4 * 1.5);
            assert!(end.distance(known) < 1e-4 * known.length(), "{end} {known}");
        }
    }
}
