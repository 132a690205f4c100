//! One tile: visibility and blending of splats and triangles.

use crate::cast::index;
use crate::project::{Chunk, Projected, TILE, Wall};
use glam::Vec3;

/// Samples of a tile.
const AREA: usize = TILE * TILE;
/// Weight that even the border of a disk has, so that any covered sample gets a colour.
const LEAST_WEIGHT: f32 = 1e-4;

/// Sums of one tile, per sample.
#[derive(Debug)]
pub(crate) struct TileBuffers {
    /// Nearness of what is seen; minus infinity: nothing.
    pub(crate) near: Vec<f32>,
    pub(crate) weight: Vec<f32>,
    /// Weighted normal (3), colour (3), texture point (3), specular, relief.
    pub(crate) sums: [Vec<f32>; 11],
    /// Triangle seen, plus 1; 0: none.
    pub(crate) triangle: Vec<u32>,
}

impl TileBuffers {
    pub(crate) fn new() -> Self {
        Self {
            near: vec![f32::NEG_INFINITY; AREA],
            weight: vec![0.0; AREA],
            sums: std::array::from_fn(|_| vec![0.0; AREA]),
            triangle: vec![0; AREA],
        }
    }

    pub(crate) fn clear(&mut self) {
        self.near.fill(f32::NEG_INFINITY);
        self.weight.fill(0.0);
        self.triangle.fill(0);
        for s in &mut self.sums {
            s.fill(0.0);
        }
    }
}

/// What a splat adds to the sums of a sample it is blended into.
pub(crate) struct Ink {
    pub(crate) color: Vec3,
    pub(crate) point: Vec3,
    pub(crate) specular: f32,
    pub(crate) relief: f32,
}

/// A triangle on the screen.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScreenTriangle {
    /// Edge functions (constant, x, y) in samples, scaled to barycentric coordinates.
    pub(crate) edges: [[f32; 3]; 3],
    /// Nearness (constant, x, y).
    pub(crate) near: [f32; 3],
    pub(crate) bounds: [i32; 4],
}

/// The part of `bounds` in the tile at `origin`, in samples from `origin`: x and y ranges.
#[inline]
fn window(bounds: [i32; 4], origin: [i32; 2]) -> [usize; 4] {
    let side = i32::try_from(TILE).unwrap_or(0);
    let clip = |value: i32, from: i32| usize::try_from((value - from).clamp(0, side)).unwrap_or(0);
    [
        clip(bounds[0], origin[0]),
        clip(bounds[1], origin[1]),
        clip(bounds[2], origin[0]),
        clip(bounds[3], origin[1]),
    ]
}

/// A row of fragments: squared disk radius over 1 where outside, and nearness.
struct Row {
    squared: [f32; TILE],
    near: [f32; TILE],
}

#[allow(
    clippy::cast_precision_loss,
    reason = "sample coordinates are far below 2^24"
)]
#[inline]
fn fragments(
    p: &Projected,
    walls: &[Wall],
    origin: [i32; 2],
    y: usize,
    x: [usize; 2],
    row: &mut Row,
) {
    let dy = origin[1] as f32 + y as f32 + 0.5 - p.y;
    let dx0 = origin[0] as f32 + 0.5 - p.x;
    let (s0, t0) = (p.s[1] * dy, p.t[1] * dy);
    let w0 = 1.0 + p.w[1] * dy;
    let n0 = p.near + p.slope[1] * dy;
    for i in x[0]..x[1] {
        let dx = dx0 + i as f32;
        let (s, t) = (s0 + p.s[0] * dx, t0 + p.t[0] * dx);
        let w = w0 + p.w[0] * dx;
        row.squared[i] = (s * s + t * t) / (w * w);
        row.near[i] = n0 + p.slope[0] * dx;
    }
    if p.filter > 0.0 {
        for i in x[0]..x[1] {
            let dx = dx0 + i as f32;
            let flat = (dx * dx + dy * dy) * p.filter;
            if flat < row.squared[i] {
                row.squared[i] = flat;
                row.near[i] = p.near;
            }
        }
    }
    for wall in walls {
        for i in x[0]..x[1] {
            let dx = dx0 + i as f32;
            let w = w0 + p.w[0] * dx;
            let (s, t) = ((s0 + p.s[0] * dx) / w, (t0 + p.t[0] * dx) / w);
            let f = |l: &[f32; 3]| l[0] + l[1] * s + l[2] * t;
            if f(&wall[0]) >= 0.0 && f(&wall[1]) >= 0.0 && f(&wall[2]) < 0.0 {
                row.squared[i] = f32::INFINITY;
            }
        }
    }
}

/// Draws a tile's triangles into the nearness.
#[allow(
    clippy::cast_precision_loss,
    reason = "sample coordinates are far below 2^24"
)]
pub(crate) fn draw_triangles(
    triangles: &[(u32, ScreenTriangle)],
    origin: [i32; 2],
    tile: &mut TileBuffers,
) {
    for (id, t) in triangles {
        let [x0, y0, x1, y1] = window(t.bounds, origin);
        for y in y0..y1 {
            let py = (origin[1] as f32) + y as f32 + 0.5;
            for x in x0..x1 {
                let px = (origin[0] as f32) + x as f32 + 0.5;
                let at = |l: &[f32; 3]| l[0] + l[1] * px + l[2] * py;
                let inside = t.edges.iter().all(|e| at(e) >= 0.0);
                let near = at(&t.near);
                let k = y * TILE + x;
                if inside && near > tile.near[k] {
                    tile.near[k] = near;
                    tile.triangle[k] = id + 1;
                }
            }
        }
    }
}

#[allow(
    clippy::needless_range_loop,
    reason = "several rows are walked in step"
)]
/// First pass: nearness of the nearest surface. Second pass: blending of what is near to it.
pub(crate) fn draw_splats(
    chunks: &[Chunk],
    tile_index: usize,
    origin: [i32; 2],
    ink: &dyn Fn(u32) -> Ink,
    tile: &mut TileBuffers,
) {
    let mut row = Row {
        squared: [0.0; TILE],
        near: [0.0; TILE],
    };
    for chunk in chunks {
        for p in chunk.in_tile(tile_index) {
            let [x0, y0, x1, y1] = window(p.bounds, origin);
            let walls = &chunk.walls[index(p.walls[0])..index(p.walls[1])];
            for y in y0..y1 {
                fragments(p, walls, origin, y, [x0, x1], &mut row);
                let near = &mut tile.near[y * TILE..(y + 1) * TILE];
                for i in x0..x1 {
                    let nearer = row.squared[i] <= 1.0 && row.near[i] > near[i];
                    near[i] = if nearer { row.near[i] } else { near[i] };
                    if nearer {
                        tile.triangle[y * TILE + i] = 0;
                    }
                }
            }
        }
    }
    let mut weight = [0.0_f32; TILE];
    for chunk in chunks {
        for p in chunk.in_tile(tile_index) {
            let [x0, y0, x1, y1] = window(p.bounds, origin);
            let walls = &chunk.walls[index(p.walls[0])..index(p.walls[1])];
            let mut loaded: Option<[f32; 11]> = None;
            for y in y0..y1 {
                fragments(p, walls, origin, y, [x0, x1], &mut row);
                let at = y * TILE;
                let mut most = 0.0_f32;
                for i in x0..x1 {
                    let fall = 1.0 - row.squared[i];
                    let seen = fall >= 0.0
                        && row.near[i] + p.tolerance >= tile.near[at + i]
                        && tile.triangle[at + i] == 0;
                    weight[i] = if seen {
                        fall * fall + LEAST_WEIGHT
                    } else {
                        0.0
                    };
                    most = most.max(weight[i]);
                }
                if most <= 0.0 {
                    continue;
                }
                let values = loaded.get_or_insert_with(|| {
                    let ink = ink(p.splat);
                    let (n, c, q) = (p.normal, ink.color, ink.point);
                    [
                        n.x,
                        n.y,
                        n.z,
                        c.x,
                        c.y,
                        c.z,
                        q.x,
                        q.y,
                        q.z,
                        ink.specular,
                        ink.relief,
                    ]
                });
                for (w, sum) in weight[x0..x1]
                    .iter()
                    .zip(&mut tile.weight[at + x0..at + x1])
                {
                    *sum += w;
                }
                for (value, sums) in values.iter().zip(&mut tile.sums) {
                    for (w, sum) in weight[x0..x1].iter().zip(&mut sums[at + x0..at + x1]) {
                        *sum += w * value;
                    }
                }
            }
        }
    }
}
