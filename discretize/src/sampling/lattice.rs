//! The body-centred cubic lattice: numbering, edges and tetrahedra.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::{Bounds, Hierarchy, Mesh, index};
use crate::sampling::sides::first_error;
use crate::sampling::{BackgroundEdge, BackgroundMesh, SampleError, Solid, Visit};

/// A lattice point moves onto the surface if a cut lies within this fraction of a long edge.
/// Labelle & Shewchuk 2007, table 1 (the pair that bounds dihedral angles by 10.7 and 164.8).
pub(crate) const WARP_LONG: f64 = 0.24999;
/// The same for a short edge.
pub(crate) const WARP_SHORT: f64 = 0.41189;

/// A block of cells with points at the cell corners and cell centres.
///
/// Ids: corners first (x fastest), then centres. Corner-corner and centre-centre edges are the long
/// ones (length of the cell), corner-centre edges the short ones (0.866 of it).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lattice {
    pub origin: DVec3,
    pub cell: DVec3,
    pub cells: [usize; 3],
}

impl Lattice {
    pub(crate) fn corner_count(&self) -> usize {
        self.cells.iter().map(|n| n + 1).product()
    }

    pub(crate) fn cell_count(&self) -> usize {
        self.cells.iter().product()
    }

    pub(crate) fn corner(&self, [i, j, k]: [usize; 3]) -> u32 {
        index(i + (self.cells[0] + 1) * (j + (self.cells[1] + 1) * k))
    }

    pub(crate) fn center(&self, [i, j, k]: [usize; 3]) -> u32 {
        index(self.corner_count() + i + self.cells[0] * (j + self.cells[1] * k))
    }

    /// Calls `visit` for the edges owned by the corner and centre at one cell coordinate; every
    /// edge is owned once.
    fn edges_at(&self, at: [usize; 3], mut visit: impl FnMut(u32, u32, bool)) {
        let from = self.corner(at);
        for axis in 0..3 {
            if at[axis] < self.cells[axis] {
                let mut next = at;
                next[axis] += 1;
                visit(from, self.corner(next), true);
            }
        }
        if (0..3).any(|axis| at[axis] >= self.cells[axis]) {
            return;
        }
        let from = self.center(at);
        for axis in 0..3 {
            if at[axis] + 1 < self.cells[axis] {
                let mut next = at;
                next[axis] += 1;
                visit(from, self.center(next), true);
            }
        }
        for octant in 0..8 {
            let to = self.corner([0, 1, 2].map(|axis| at[axis] + (octant >> axis & 1)));
            visit(from, to, false);
        }
    }

    /// Calls `visit` for the twelve tetrahedra between one cell and its three next neighbours,
    /// corners ordered centre, centre, corner, corner.
    fn tetrahedra_at(&self, at: [usize; 3], mut visit: impl FnMut([u32; 4])) {
        let center = self.center(at);
        for axis in 0..3 {
            if at[axis] + 1 >= self.cells[axis] {
                continue;
            }
            let mut next = at;
            next[axis] += 1;
            let other = self.center(next);
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let ring = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| {
                let mut corner = next;
                corner[u] += du;
                corner[v] += dv;
                self.corner(corner)
            });
            for side in 0..4 {
                visit([center, other, ring[side], ring[(side + 1) % 4]]);
            }
        }
    }
}

/// Length classes of the edges of a lattice tetrahedron in the order of
/// [`Lattice::tetrahedra_at`]: edges 0-1 and 2-3 are long.
const CLASSES: [[u8; 4]; 4] = [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1], [0, 0, 1, 0]];

impl BackgroundMesh for Lattice {
    fn point_count(&self) -> usize {
        self.corner_count() + self.cell_count()
    }

    fn position(&self, id: u32) -> DVec3 {
        let id = id as usize;
        let corners = self.corner_count();
        let (id, [nx, ny], shift) = if id < corners {
            (id, [self.cells[0] + 1, self.cells[1] + 1], 0.0)
        } else {
            (id - corners, [self.cells[0], self.cells[1]], 0.5)
        };
        let at = DVec3::new(
            (id % nx) as f64,
            (id / nx % ny) as f64,
            (id / (nx * ny)) as f64,
        );
        self.origin + (at + shift) * self.cell
    }

    fn size(&self, _: u32) -> f64 {
        self.cell.element_sum() / 3.0
    }

    fn signs(&self, solid: &Solid) -> Result<Vec<i8>, SampleError> {
        match solid.mesh().zip(solid.hierarchy()) {
            Some((mesh, hierarchy)) => Ok(signs_mesh(mesh, hierarchy, self)),
            None => signs_implicit(solid, self),
        }
    }

    fn crossed_edges(&self, sign: &[i8]) -> Vec<BackgroundEdge> {
        (0..=self.cells[2])
            .into_par_iter()
            .flat_map_iter(|k| {
                let mut out = Vec::new();
                for j in 0..=self.cells[1] {
                    for i in 0..=self.cells[0] {
                        self.edges_at([i, j, k], |from, to, long| {
                            if sign[from as usize] * sign[to as usize] < 0 {
                                let reach = if long { WARP_LONG } else { WARP_SHORT };
                                out.push(BackgroundEdge::new(from, to, reach));
                            }
                        });
                    }
                }
                out
            })
            .collect()
    }

    fn chunks(&self) -> usize {
        self.cells[2]
    }

    fn tetrahedra_in(&self, chunk: usize, visit: &mut Visit<'_>) {
        for j in 0..self.cells[1] {
            for i in 0..self.cells[0] {
                self.tetrahedra_at([i, j, chunk], |corners| visit(corners, &CLASSES));
            }
        }
    }

    fn may_warp(&self, _: u32, _: DVec3, _: &dyn Fn(u32) -> DVec3) -> bool {
        // The thresholds leave every tetrahedron positive, wherever their corners go.
        true
    }
}

/// Signs by the function of an implicit body.
fn signs_implicit(solid: &Solid, lattice: &Lattice) -> Result<Vec<i8>, SampleError> {
    let mut sign = vec![0_i8; lattice.point_count()];
    let chunks = sign.par_chunks_mut(4096).enumerate().map(|(chunk, out)| {
        for (offset, sign) in out.iter_mut().enumerate() {
            *sign = solid.sign_at(lattice.position(index(chunk * 4096 + offset)))?;
        }
        Ok(())
    });
    first_error(chunks).map(|_: Vec<()>| sign)
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
    let first_center = corners.len();
    // Rows of points from a first one on, and whether the step to a point of a row passes a near cell.
    let fill = |first: usize,
                width: usize,
                signs: &mut [i8],
                passes: &(dyn Fn(usize, usize) -> bool + Sync)| {
        let rows = signs.par_chunks_mut(width).enumerate();
        rows.for_each(|(row, out)| {
            let mut last = -1;
            for (i, sign) in out.iter_mut().enumerate() {
                if i > 0 && passes(row, i) {
                    last = sign_at(lattice.position(index(first + row * width + i)));
                }
                *sign = last;
            }
        });
    };
    // The edge to (i, j, k) lies on the border of the four cells i - 1.
    fill(0, nx + 1, corners, &|row, i| {
        let (j, k) = (row % (ny + 1), row / (ny + 1));
        (0..4).any(|c| {
            let (dj, dk) = (c & 1, c >> 1);
            j >= dj && k >= dk && is_near(i - 1, j - dj, k - dk)
        })
    });
    fill(first_center, nx, centers, &|row, i| {
        let (j, k) = (row % ny, row / ny);
        is_near(i - 1, j, k) || is_near(i, j, k)
    });
    sign
}

/// Cells that a triangle may touch: boxes overlap and the plane is not farther than half the
/// cell's diagonal, with some slack.
#[allow(
    clippy::cast_possible_truncation,
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
