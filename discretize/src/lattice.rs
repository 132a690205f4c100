//! The body-centred cubic lattice: numbering, edges and tetrahedra.

use glam::DVec3;

use crate::mesh::index;

/// Corners of the eight octants of a cell, in units of the cell.
const OCTANTS: [[usize; 3]; 8] = [
    [0, 0, 0],
    [1, 0, 0],
    [0, 1, 0],
    [1, 1, 0],
    [0, 0, 1],
    [1, 0, 1],
    [0, 1, 1],
    [1, 1, 1],
];

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

/// An edge of the lattice.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    pub from: u32,
    pub to: u32,
    pub long: bool,
}

impl Lattice {
    /// Moves the lattice by less than a cell, adding a layer of cells so that the rim stays whole.
    pub(crate) fn shift(&mut self, fraction: DVec3) {
        self.origin -= (fraction - fraction.floor()) * self.cell;
        self.cells = self.cells.map(|n| n + 1);
    }

    pub(crate) fn corner_count(&self) -> usize {
        self.cells.iter().map(|n| n + 1).product()
    }

    pub(crate) fn cell_count(&self) -> usize {
        self.cells.iter().product()
    }

    pub(crate) fn point_count(&self) -> usize {
        self.corner_count() + self.cell_count()
    }

    pub(crate) fn corner(&self, [i, j, k]: [usize; 3]) -> u32 {
        index(i + (self.cells[0] + 1) * (j + (self.cells[1] + 1) * k))
    }

    pub(crate) fn center(&self, [i, j, k]: [usize; 3]) -> u32 {
        index(self.corner_count() + i + self.cells[0] * (j + self.cells[1] * k))
    }

    /// Place of a lattice id.
    #[allow(
        clippy::cast_precision_loss,
        reason = "lattice coordinates are far below 2^52"
    )]
    pub(crate) fn position(&self, id: u32) -> DVec3 {
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

    /// Calls `visit` for the edges owned by the corner and centre at one cell coordinate; every
    /// edge is owned once.
    pub(crate) fn edges_at(&self, at: [usize; 3], mut visit: impl FnMut(Edge)) {
        let from = self.corner(at);
        for axis in 0..3 {
            if at[axis] < self.cells[axis] {
                let mut next = at;
                next[axis] += 1;
                let to = self.corner(next);
                visit(Edge {
                    from,
                    to,
                    long: true,
                });
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
                let to = self.center(next);
                visit(Edge {
                    from,
                    to,
                    long: true,
                });
            }
        }
        for o in OCTANTS {
            let to = self.corner([at[0] + o[0], at[1] + o[1], at[2] + o[2]]);
            visit(Edge {
                from,
                to,
                long: false,
            });
        }
    }

    /// Calls `visit` for the twelve tetrahedra between one cell and its three next neighbours,
    /// corners ordered centre, centre, corner, corner.
    pub(crate) fn tetrahedra_at(&self, at: [usize; 3], mut visit: impl FnMut([u32; 4])) {
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
pub(crate) const CLASSES: [[u8; 4]; 4] = [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1], [0, 0, 1, 0]];
