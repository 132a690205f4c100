//! What stuffing asks of a body: signs at lattice points and crossings of edges.

use glam::DVec3;
use rayon::prelude::*;

use crate::background::Background;
use crate::error::SampleError;
use crate::fill::SHIFT;
use crate::hierarchy::{Crossing, Hierarchy};
use crate::lattice::Lattice;
use crate::mesh::{Bounds, Mesh, index};
use crate::solid::Solid;

/// Values below this fraction of the box's diagonal count as on the surface.
const ON_SURFACE: f64 = 1e-13;
/// Smallest offset of the lattice from a mesh's faces, in cells: far above round-off and far below what
/// moves lattice points onto the surface.
const OFFSET: f64 = 1.0 / 1024.0;
/// Halvings of an edge until its crossing is known to round-off.
const HALVINGS: usize = 60;

/// A solid with what sampling needs to know about its parts.
pub(crate) struct Oracle<'a> {
    pub solid: &'a Solid,
    /// Closed part of the surface each triangle belongs to; empty for implicit bodies.
    part_of_triangle: Vec<u32>,
    parts: usize,
}

impl<'a> Oracle<'a> {
    pub(crate) fn new(solid: &'a Solid) -> Self {
        let (part_of_triangle, parts) = solid.mesh().map_or((Vec::new(), 0), parts_of);
        Self {
            solid,
            part_of_triangle,
            parts,
        }
    }

    /// By how much of a cell the background leaves the box's lower corner. A face of a mesh in a plane of
    /// the lattice would leave it to round-off which of the points there are inside; of an implicit
    /// body these have sign 0.
    pub(crate) fn offset(&self) -> DVec3 {
        match self.solid.mesh() {
            Some(_) => OFFSET * SHIFT,
            None => DVec3::ZERO,
        }
    }

    pub(crate) fn part_count(&self) -> usize {
        self.parts
    }

    /// Triangles of one part.
    pub(crate) fn triangles_of(&self, part: usize) -> impl Iterator<Item = usize> + '_ {
        self.part_of_triangle
            .iter()
            .enumerate()
            .filter(move |(_, p)| **p as usize == part)
            .map(|(t, _)| t)
    }

    /// Sign at a point: 1 inside, 0 on the surface, -1 outside.
    pub(crate) fn sign_at(&self, at: DVec3) -> Result<i8, SampleError> {
        if self.solid.mesh().is_some() {
            return Ok(if self.solid.contains(at) { 1 } else { -1 });
        }
        let value = self.solid.signed_distance(at);
        if value.is_nan() {
            return Err(SampleError::NotANumber { at });
        }
        Ok(
            if value.abs() <= ON_SURFACE * self.solid.bounds().diagonal() {
                0
            } else if value < 0.0 {
                1
            } else {
                -1
            },
        )
    }

    /// Signs at all lattice points.
    pub(crate) fn lattice_signs(&self, lattice: &Lattice) -> Result<Vec<i8>, SampleError> {
        let Some((mesh, hierarchy)) = self.solid.mesh().zip(self.solid.hierarchy()) else {
            return self.signs_implicit(lattice);
        };
        Ok(signs_mesh(mesh, hierarchy, lattice))
    }

    fn signs_implicit(&self, lattice: &Lattice) -> Result<Vec<i8>, SampleError> {
        let mut sign = vec![0_i8; lattice.point_count()];
        sign.par_chunks_mut(4096)
            .enumerate()
            .try_for_each(|(chunk, out)| {
                for (offset, sign) in out.iter_mut().enumerate() {
                    *sign = self.sign_at(lattice.position(index(chunk * 4096 + offset)))?;
                }
                Ok(())
            })?;
        Ok(sign)
    }

    /// Where the edge from an inside to an outside point leaves the body (first time), and the
    /// part of the surface met there (`u32::MAX` if not known).
    pub(crate) fn crossing(
        &self,
        inside: DVec3,
        outside: DVec3,
        scratch: &mut Vec<Crossing>,
    ) -> (DVec3, u32) {
        if let Some(hierarchy) = self.solid.hierarchy() {
            scratch.clear();
            hierarchy.crossings_into(inside, outside, scratch);
            let first = scratch.iter().min_by(|a, b| {
                a.parameter
                    .total_cmp(&b.parameter)
                    .then(a.triangle.cmp(&b.triangle))
            });
            if let Some(first) = first {
                let at = inside + first.parameter * (outside - inside);
                return (at, self.part_of_triangle[first.triangle as usize]);
            }
        }
        (self.bisect(inside, outside), u32::MAX)
    }

    /// Regula falsi of the Illinois kind, kept inside a shrinking bracket.
    fn bisect(&self, inside: DVec3, outside: DVec3) -> DVec3 {
        let value = |t: f64| self.solid.signed_distance(inside + t * (outside - inside));
        let (mut a, mut b) = (0.0, 1.0);
        let (mut fa, mut fb) = (value(a), value(b));
        let mut side = 0;
        for round in 0..HALVINGS {
            let secant = (a * fb - b * fa) / (fb - fa);
            let t = if round % 4 == 3 || !(secant > a && secant < b) {
                0.5 * (a + b)
            } else {
                secant
            };
            let ft = value(t);
            if ft == 0.0 {
                return inside + t * (outside - inside);
            }
            if ft < 0.0 {
                (a, fa) = (t, ft);
                if side == -1 {
                    fb *= 0.5;
                }
                side = -1;
            } else {
                (b, fb) = (t, ft);
                if side == 1 {
                    fa *= 0.5;
                }
                side = 1;
            }
            if b - a < 4.0 * f64::EPSILON {
                break;
            }
        }
        inside + a * (outside - inside)
    }
}

/// Connected parts of a surface over shared vertices: part per triangle, and their number.
pub(crate) fn parts_of(mesh: &Mesh) -> (Vec<u32>, usize) {
    let mut root: Vec<u32> = (0..mesh.vertices.len()).map(index).collect();
    for [a, b, c] in &mesh.triangles {
        for other in [b, c] {
            let (x, y) = (find(&mut root, *a), find(&mut root, *other));
            root[x.max(y) as usize] = x.min(y);
        }
    }
    let mut number = vec![u32::MAX; mesh.vertices.len()];
    let mut count = 0;
    let parts = mesh
        .triangles
        .iter()
        .map(|t| {
            let r = find(&mut root, t[0]) as usize;
            if number[r] == u32::MAX {
                number[r] = index(count);
                count += 1;
            }
            number[r]
        })
        .collect();
    (parts, count)
}

/// Root of a union-find tree, halving the path.
pub(crate) fn find(root: &mut [u32], mut v: u32) -> u32 {
    while root[v as usize] != v {
        root[v as usize] = root[root[v as usize] as usize];
        v = root[v as usize];
    }
    v
}

/// Signs by winding number. Lattice rows run along x; a point whose step from its predecessor
/// passes no cell near the surface takes the predecessor's sign.
fn signs_mesh(mesh: &Mesh, hierarchy: &Hierarchy, lattice: &Lattice) -> Vec<i8> {
    let near = cells_near(mesh, lattice);
    let [nx, ny, nz] = lattice.cells;
    let is_near =
        |i: usize, j: usize, k: usize| i < nx && j < ny && k < nz && near[i + nx * (j + ny * k)];
    let sign_at = |p: DVec3| -> i8 {
        if hierarchy.winding_number(p) > 0.5 {
            1
        } else {
            -1
        }
    };
    let mut sign = vec![-1_i8; lattice.point_count()];
    let (corners, centers) = sign.split_at_mut(lattice.corner_count());
    corners
        .par_chunks_mut(nx + 1)
        .enumerate()
        .for_each(|(row, out)| {
            let (j, k) = (row % (ny + 1), row / (ny + 1));
            let mut last = -1;
            for (i, sign) in out.iter_mut().enumerate() {
                // The edge from (i-1, j, k) lies on the border of the four cells i-1.
                let crossed = i > 0
                    && (0..4).any(|c| {
                        let (dj, dk) = (c & 1, c >> 1);
                        j >= dj && k >= dk && is_near(i - 1, j - dj, k - dk)
                    });
                if crossed {
                    last = sign_at(lattice.position(lattice.corner([i, j, k])));
                }
                *sign = last;
            }
        });
    centers
        .par_chunks_mut(nx)
        .enumerate()
        .for_each(|(row, out)| {
            let (j, k) = (row % ny, row / ny);
            let mut last = -1;
            for (i, sign) in out.iter_mut().enumerate() {
                if i > 0 && (is_near(i - 1, j, k) || is_near(i, j, k)) {
                    last = sign_at(lattice.position(lattice.center([i, j, k])));
                }
                *sign = last;
            }
        });
    sign
}

/// Cells that a triangle may touch: boxes overlap and the plane is not farther than half the
/// cell's diagonal, with some slack.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "cell coordinates, clamped to the lattice"
)]
fn cells_near(mesh: &Mesh, lattice: &Lattice) -> Vec<bool> {
    let [nx, ny, nz] = lattice.cells;
    let mut near = vec![false; nx * ny * nz];
    let slack = 1e-6;
    let half_diagonal = (0.5 + slack) * lattice.cell.length();
    for t in 0..mesh.triangles.len() {
        let corners = mesh.corners(t);
        let normal = mesh.area_vector(t).normalize_or_zero();
        let bounds = Bounds::of(corners);
        let low = (bounds.min - lattice.origin) / lattice.cell - slack;
        let high = (bounds.max - lattice.origin) / lattice.cell + slack;
        let range = |axis: usize| {
            let most = lattice.cells[axis] - 1;
            let first = (low[axis].floor().max(0.0) as usize).min(most);
            let last = (high[axis].floor().max(0.0) as usize).min(most);
            first..=last
        };
        for k in range(2) {
            for j in range(1) {
                for i in range(0) {
                    let cell = i + nx * (j + ny * k);
                    if near[cell] {
                        continue;
                    }
                    let center = lattice.origin
                        + (DVec3::new(i as f64, j as f64, k as f64) + 0.5) * lattice.cell;
                    near[cell] = (center - corners[0]).dot(normal).abs() <= half_diagonal;
                }
            }
        }
    }
    near
}
