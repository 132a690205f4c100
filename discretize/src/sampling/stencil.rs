//! How one background tetrahedron is cut along the surface (Labelle & Shewchuk 2007, figure 3).

use std::cmp::Ordering;

use glam::DVec3;

/// Cosine of the angle at which two equally long edges of the lattice meet.
const TIED_COSINE: f64 = 1.0 / 3.0;

/// One background tetrahedron to be cut.
///
/// `sign` is 1 inside, 0 on the surface, -1 outside; `class[a][b]` ranks the length of the
/// background edge between corners a and b, and the cut point on a longer edge takes the diagonal.
pub(crate) struct Stencil<'a, C, P> {
    pub corners: [u32; 4],
    pub sign: [i8; 4],
    pub class: &'a [[u8; 4]; 4],
    /// Id of the cut point on the edge between two corners (ids) of opposite sign.
    pub cut: C,
    /// Position of an id.
    pub position: P,
}

impl<C: Fn(u32, u32) -> u32, P: Fn(u32) -> DVec3> Stencil<'_, C, P> {
    /// Emits the tetrahedra that fill the inside part, each with positive volume.
    pub(crate) fn emit(&self, out: &mut Vec<[u32; 4]>) {
        let (plus, plus_count) = self.corners_of(1);
        let (zero, _) = self.corners_of(0);
        let (minus, minus_count) = self.corners_of(-1);
        let id = |corner: usize| self.corners[corner];
        let cut = |a: usize, b: usize| (self.cut)(self.corners[a], self.corners[b]);
        match (plus_count, minus_count) {
            (0, _) => {}
            (_, 0) => self.push(self.corners, out),
            (1, _) => {
                let p = plus[0];
                let mut tetrahedron = self.corners;
                for &m in &minus[..minus_count] {
                    tetrahedron[m] = cut(p, m);
                }
                self.push(tetrahedron, out);
            }
            (2, 1) => {
                let (p, q, z, m) = (plus[0], plus[1], zero[0], minus[0]);
                let (cp, cq) = (cut(p, m), cut(q, m));
                if self.diagonal(p, q, m) {
                    self.push([id(z), id(p), id(q), cq], out);
                    self.push([id(z), id(p), cq, cp], out);
                } else {
                    self.push([id(z), id(p), id(q), cp], out);
                    self.push([id(z), id(q), cq, cp], out);
                }
            }
            (2, _) => {
                let (p, q, r, s) = (plus[0], plus[1], minus[0], minus[1]);
                let x = [id(p), cut(p, r), cut(p, s)];
                let y = [id(q), cut(q, r), cut(q, s)];
                let to_r = self.diagonal(p, q, r);
                let to_s = self.diagonal(p, q, s);
                // The third face lies on the surface: free unless the other two force it.
                let free = if to_r == to_s {
                    self.shorter(x[1], y[2], x[2], y[1])
                } else {
                    to_s
                };
                self.prism(x, y, [to_r, free, to_s], out);
            }
            _ => {
                let (p, q, s, m) = (plus[0], plus[1], plus[2], minus[0]);
                let x = [id(p), id(q), id(s)];
                let y = [cut(p, m), cut(q, m), cut(s, m)];
                let diagonals = [
                    self.diagonal(p, q, m),
                    self.diagonal(q, s, m),
                    self.diagonal(p, s, m),
                ];
                self.prism(x, y, diagonals, out);
            }
        }
    }

    /// The corners of one sign, and how many they are.
    fn corners_of(&self, sign: i8) -> ([usize; 4], usize) {
        let mut found = [0; 4];
        let mut count = 0;
        for corner in (0..4).filter(|corner| self.sign[*corner] == sign) {
            found[count] = corner;
            count += 1;
        }
        (found, count)
    }

    /// Splits the prism with triangles x and y; `diagonals` for the column pairs (0,1), (1,2),
    /// (0,2): true joins x of the first to y of the second. They never chase each other round:
    /// [`Stencil::diagonal`] follows one order of the cut edges.
    fn prism(&self, x: [u32; 3], y: [u32; 3], diagonals: [bool; 3], out: &mut Vec<[u32; 4]>) {
        let [d01, d12, d02] = diagonals;
        // "i before j" if the diagonal starts at x_i.
        let before = [
            usize::from(d01) + usize::from(d02),
            usize::from(!d01) + usize::from(d12),
            usize::from(!d12) + usize::from(!d02),
        ];
        let mut order = [0; 3];
        for (column, count) in before.iter().enumerate() {
            order[2 - count] = column;
        }
        let [i, j, k] = order;
        self.push([x[i], x[j], x[k], y[k]], out);
        self.push([x[i], x[j], y[j], y[k]], out);
        self.push([x[i], y[i], y[j], y[k]], out);
    }

    /// Diagonal of the face p q m between inside corners p, q: true from p to the cut on q-m.
    ///
    /// The longer edge's cut takes it; of equally long edges the one that gives the shorter
    /// diagonal, up to moved corners. Both tetrahedra at the face see the same order of its edges.
    fn diagonal(&self, p: usize, q: usize, m: usize) -> bool {
        let by_class = self.class[q][m].cmp(&self.class[p][m]);
        let by_length = || self.reach(p, m).total_cmp(&self.reach(q, m));
        let by_id = || self.corners[p].cmp(&self.corners[q]);
        by_class.then_with(by_length).then_with(by_id) == Ordering::Greater
    }

    /// Grows with the diagonal that ends in the cut of the edge p-m, by the law of cosines.
    fn reach(&self, p: usize, m: usize) -> f64 {
        let (p, m) = (self.corners[p], self.corners[m]);
        let (at, from) = ((self.position)(m), (self.position)(p));
        let t = at.distance((self.position)((self.cut)(p, m))) / at.distance(from);
        t * (t - 2.0 * TIED_COSINE)
    }

    /// Whether a-b is shorter than c-d; equal lengths by the ids of a and c.
    fn shorter(&self, a: u32, b: u32, c: u32, d: u32) -> bool {
        let length = |u, v| (self.position)(u).distance_squared((self.position)(v));
        match length(a, b).total_cmp(&length(c, d)) {
            Ordering::Less => true,
            Ordering::Greater => false,
            Ordering::Equal => a < c,
        }
    }

    fn push(&self, tetrahedron: [u32; 4], out: &mut Vec<[u32; 4]>) {
        let [a, b, c, d] = tetrahedron.map(&self.position);
        if (b - a).cross(c - a).dot(d - a) < 0.0 {
            let [i, j, k, l] = tetrahedron;
            out.push([i, k, j, l]);
        } else {
            out.push(tetrahedron);
        }
    }
}
