//! Point clouds made from fixed seeds, the same on every machine.

use glam::DVec3;

/// A small generator (SplitMix64): the tests need repeatable numbers, not statistics.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// Starts from a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in `[low, high)`.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in `0..end`; 0 where that is empty.
    pub fn below(&mut self, end: usize) -> usize {
        usize::try_from(self.bits() % end.max(1) as u64).unwrap_or(0)
    }

    /// One of some items, each as likely.
    pub fn pick<'a, T>(&mut self, items: &'a [T]) -> &'a T {
        &items[self.below(items.len())]
    }

    /// True with a probability.
    pub fn chance(&mut self, share: f64) -> bool {
        self.unit() < share
    }

    /// Uniform in the cube `[-half, half)³`.
    pub fn vector(&mut self, half: f64) -> DVec3 {
        let x = self.range(-half, half);
        let y = self.range(-half, half);
        let z = self.range(-half, half);
        DVec3::new(x, y, z)
    }
}

/// Who is coupled with whom on [`lattice`]: the 6 nearest and the 12 next nearest positions, as row starts
/// and neighbours.
#[must_use]
pub fn lattice_rows(n: [usize; 3]) -> (Vec<u32>, Vec<u32>) {
    let (mut offsets, mut indices) = (vec![0], Vec::new());
    let near = |c: usize, axis: usize| c.saturating_sub(1)..=(c + 1).min(n[axis] - 1);
    let index = |value: usize| u32::try_from(value).expect("tests are small");
    for node in 0..n[0] * n[1] * n[2] {
        let [i, j, k] = [node % n[0], node / n[0] % n[1], node / n[0] / n[1]];
        for c in near(k, 2) {
            for b in near(j, 1) {
                for a in near(i, 0) {
                    let steps = a.abs_diff(i) + b.abs_diff(j) + c.abs_diff(k);
                    if steps == 1 || steps == 2 {
                        indices.push(index((c * n[1] + b) * n[0] + a));
                    }
                }
            }
        }
        offsets.push(index(indices.len()));
    }
    (offsets, indices)
}

/// Lattice of `nx × ny × nz` points, `spacing` apart, from the origin, each moved by up to
/// `jitter · spacing` per axis.
#[must_use]
pub fn lattice(n: [usize; 3], spacing: f64, jitter: f64, seed: u64) -> Vec<DVec3> {
    let mut random = Random::new(seed);
    let mut points = Vec::with_capacity(n[0] * n[1] * n[2]);
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                let at = DVec3::new(i as f64, j as f64, k as f64);
                points.push((at + random.vector(1.0) * jitter) * spacing);
            }
        }
    }
    points
}

/// Positions, normals and areas of `side × side` surfels of the unit square z = 0.5 around the z-axis,
/// moved by up to 0.01 in the plane; normals lean with them by `lean` times their shift.
#[must_use]
pub fn patch(side: u32, lean: f64, seed: u64) -> (Vec<DVec3>, Vec<DVec3>, Vec<f64>) {
    let mut random = Random::new(seed);
    let mut out = (Vec::new(), Vec::new(), Vec::new());
    let step = f64::from(side).recip();
    for i in 0..side * side {
        let shift = random.vector(0.01) * DVec3::new(1.0, 1.0, 0.0);
        let at = DVec3::new(f64::from(i % side), f64::from(i / side), 0.0) * step;
        let corner = DVec3::new(0.5 - 0.5 * step, 0.5 - 0.5 * step, -0.5);
        out.0.push(at - corner + shift);
        out.1.push(DVec3::Z + shift * lean);
        out.2.push(step * step);
    }
    out
}

/// `n` evenly spread points of the unit sphere, along a golden spiral about y.
#[must_use]
pub fn golden_sphere(n: u32) -> Vec<DVec3> {
    let at = |i: u32| {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
        let (sine, cosine) = (2.399_963_229_728_653 * f64::from(i)).sin_cos();
        (DVec3::new(cosine, 0.0, sine) * (1.0 - y * y).sqrt()).with_y(y)
    };
    (0..n).map(at).collect()
}

/// Faces of a box, seen from outside counterclockwise; bit 0, 1, 2 of a corner's number: high in x, y, z.
pub const BOX_FACES: [[u32; 4]; 6] = [
    [0, 2, 3, 1],
    [4, 5, 7, 6],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 4, 6, 2],
    [1, 3, 7, 5],
];

/// Random nodes that fill the unit cube around the origin, `n` along an edge.
#[must_use]
pub fn filled_cube(n: usize, seed: u64) -> Vec<DVec3> {
    let points = lattice([n; 3], 1.0 / (n - 1) as f64, 0.2, seed);
    points.into_iter().map(|p| p - 0.5).collect()
}

/// The two triangles that an edge leaves behind on its way from `[a, b]` to `[c, d]`, oriented alike.
#[must_use]
pub fn swept([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> [[DVec3; 3]; 2] {
    [[a, b, c], [c, b, d]]
}

/// `n` uniform points in the cube `[-half, half)³`.
#[must_use]
pub fn uniform(n: usize, half: f64, seed: u64) -> Vec<DVec3> {
    let mut random = Random::new(seed);
    (0..n).map(|_| random.vector(half)).collect()
}
