//! The matrix of the next coarser grid.

use super::level::{Level, SHARES, STENCIL, first_child, parents};
use crate::parallel::{map, to_u32};

impl Level {
    /// The next coarser level, `Rᵀ A R` with splines of cells twice as wide.
    pub(super) fn coarser(&self) -> Self {
        let fine = self.grid;
        let grid = fine.coarser();
        let mut number = vec![u32::MAX; fine.len()];
        for (k, &place) in self.places.iter().enumerate() {
            number[place as usize] = to_u32(k);
        }
        let mut taken = vec![false; grid.len()];
        for &place in &self.places {
            let parents = fine.spline(place as usize).map(parents);
            for (z, _) in parents[2] {
                for (y, _) in parents[1] {
                    for (x, _) in parents[0] {
                        taken[grid.place([x, y, z])] = true;
                    }
                }
            }
        }
        let places: Vec<u32> = (0..grid.len())
            .filter(|&place| taken[place])
            .map(to_u32)
            .collect();
        let stencils = map(places.len(), 8, |at| {
            self.coarse_stencil(grid.spline(places[at] as usize), &number)
        });
        Self::new(grid, places, stencils)
    }

    /// One row of `Rᵀ A R`.
    fn coarse_stencil(&self, at: [usize; 3], number: &[u32]) -> [f64; STENCIL] {
        let fine = self.grid;
        let [_, y, z] = fine.steps();
        let start = first_child(&fine, at);
        // Along every axis the columns of the children span eight splines from 2S − 4 on.
        let mut sums = [[[0.0; 8]; 8]; 8];
        for k in 0..4 {
            for j in 0..4 {
                for i in 0..4 {
                    let child = number[start + i + j * y + k * z];
                    if child == u32::MAX {
                        continue;
                    }
                    let share = SHARES[i] * SHARES[j] * SHARES[k];
                    let row = &self.stencils[child as usize];
                    for (run, values) in row.as_chunks::<5>().0.iter().enumerate() {
                        let to = &mut sums[k + run / 5][j + run % 5][i..i + 5];
                        for (sum, value) in to.iter_mut().zip(values) {
                            *sum += value * share;
                        }
                    }
                }
            }
        }
        // Column 2S − 4 + c belongs to the coarse splines S − 2 + c/2 (+ 1 or − 1).
        let columns: [[(usize, f64); 2]; 8] = std::array::from_fn(|c| {
            let [(a, va), (b, vb)] = parents(c + 4);
            // c + 4 stands for a spline of S = 4.
            [(a.wrapping_sub(2), va), (b.wrapping_sub(2), vb)]
        });
        let mut row = [0.0; STENCIL];
        for (c, plane) in sums.iter().enumerate() {
            for (b, line) in plane.iter().enumerate() {
                for (a, value) in line.iter().enumerate() {
                    for (k, vk) in columns[c] {
                        for (j, vj) in columns[b] {
                            for (i, vi) in columns[a] {
                                row[i + 5 * j + 25 * k] += value * (vi * vj * vk);
                            }
                        }
                    }
                }
            }
        }
        row
    }
}
