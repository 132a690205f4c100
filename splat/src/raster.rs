//! One tile: visibility and blending of splats and triangles.
#![allow(
    clippy::needless_range_loop,
    reason = "rows of several arrays are walked in step"
)]

use crate::cast::index;
use crate::image::Image;
use crate::project::{Chunk, Projected, TILE, Wall};
use glam::{Vec2, Vec3, Vec4};

/// Samples of a tile.
const AREA: usize = TILE * TILE;
/// Weight that even the border of a disk has, so that any covered sample gets a colour.
const LEAST_WEIGHT: f32 = 1e-4;
/// 0, 1, 2, ...
#[allow(clippy::cast_precision_loss, reason = "32 values")]
const RAMP: [f32; TILE] = {
    let mut ramp = [0.0; TILE];
    let mut i = 0;
    while i < TILE {
        ramp[i] = i as f32;
        i += 1;
    }
    ramp
};

/// Weighted sums of one sample: normal and weight, colour and specular, texture point and relief.
pub(crate) type Sums = [Vec4; 3];

/// One tile in the making, per sample.
#[derive(Debug)]
pub(crate) struct TileBuffers {
    /// Nearness of what is seen; minus infinity: nothing.
    pub(crate) near: Vec<f32>,
    /// Nearness that splats must reach to blend; infinite where a triangle is seen.
    limit: Vec<f32>,
    pub(crate) sums: Vec<Sums>,
    /// Weighted sum of the highlights' exponents.
    pub(crate) gloss: Vec<f32>,
    /// Triangle seen, plus 1; 0: none.
    pub(crate) triangle: Vec<u32>,
}

impl TileBuffers {
    pub(crate) fn new() -> Self {
        Self {
            near: vec![f32::NEG_INFINITY; AREA],
            limit: vec![f32::NEG_INFINITY; AREA],
            sums: vec![[Vec4::ZERO; 3]; AREA],
            gloss: vec![0.0; AREA],
            triangle: vec![0; AREA],
        }
    }

    pub(crate) fn clear(&mut self) {
        self.near.fill(f32::NEG_INFINITY);
        self.triangle.fill(0);
        self.sums.fill([Vec4::ZERO; 3]);
        self.gloss.fill(0.0);
    }
}

/// An image on a splat.
#[derive(Clone, Copy)]
pub(crate) struct Print<'a> {
    pub(crate) image: &'a Image,
    /// Image coordinates of the centre, and their change along the two disk coordinates.
    pub(crate) at: Vec2,
    pub(crate) along: [Vec2; 2],
}

impl Print<'_> {
    /// The part of the image that a sample of a splat sees, its larger side in units of the image.
    fn footprint(&self, p: &Projected) -> f32 {
        let step = |k: usize| (self.along[0] * p.s[k] + self.along[1] * p.t[k]).length();
        step(0).max(step(1))
    }
}

/// A splat's ink as it is blended: colour, texture point and its change along the two disk
/// coordinates; exponent of the highlight; image and what a sample sees of it.
type Loaded<'a> = ([Vec4; 4], f32, Option<(Print<'a>, f32)>);

/// What a splat adds to the sums of a sample it is blended into.
pub(crate) struct Ink<'a> {
    /// Takes the place of the colour.
    pub(crate) print: Option<Print<'a>>,
    pub(crate) color: Vec3,
    pub(crate) point: Vec3,
    /// Change of the texture point along the two disk coordinates.
    pub(crate) along: [Vec3; 2],
    pub(crate) specular: f32,
    pub(crate) shininess: f32,
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

/// A row of fragments of one splat: disk coordinates, their squared length (over 1: outside) and
/// nearness.
struct Row {
    s: [f32; TILE],
    t: [f32; TILE],
    squared: [f32; TILE],
    near: [f32; TILE],
    weight: [f32; TILE],
}

impl Row {
    const EMPTY: Self = Self {
        s: [0.0; TILE],
        t: [0.0; TILE],
        squared: [0.0; TILE],
        near: [0.0; TILE],
        weight: [0.0; TILE],
    };

    /// Fills the first `n` fragments; (dx, dy) is the first sample's offset from the centre.
    #[inline]
    fn fill(&mut self, p: &Projected, walls: &[Wall], dx: f32, dy: f32, n: usize) {
        let (s0, t0) = (p.s[0] * dx + p.s[1] * dy, p.t[0] * dx + p.t[1] * dy);
        let w0 = 1.0 + p.w[0] * dx + p.w[1] * dy;
        let n0 = p.near + p.slope[0] * dx + p.slope[1] * dy;
        let (ss, ts) = (&mut self.s[..n], &mut self.t[..n]);
        let (squares, nears) = (&mut self.squared[..n], &mut self.near[..n]);
        for i in 0..n {
            let x = RAMP[i];
            let inverse = 1.0 / (w0 + p.w[0] * x);
            let (s, t) = ((s0 + p.s[0] * x) * inverse, (t0 + p.t[0] * x) * inverse);
            ss[i] = s;
            ts[i] = t;
            squares[i] = s * s + t * t;
            nears[i] = n0 + p.slope[0] * x;
        }
        if p.square {
            for i in 0..n {
                squares[i] = (ss[i] * ss[i]).max(ts[i] * ts[i]);
            }
        }
        for wall in walls {
            for i in 0..n {
                let f = |l: &[f32; 3]| l[0] + l[1] * ss[i] + l[2] * ts[i];
                if f(&wall[0]) >= 0.0 && f(&wall[1]) >= 0.0 && f(&wall[2]) < 0.0 {
                    squares[i] = f32::INFINITY;
                }
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
            let py = (origin[1] as f32) + RAMP[y] + 0.5;
            for x in x0..x1 {
                let px = (origin[0] as f32) + RAMP[x] + 0.5;
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

/// First pass: nearness of the nearest surface. Second pass: blending of what is near to it.
pub(crate) fn draw_splats<'a>(
    chunks: &[Chunk],
    tile_index: usize,
    origin: [i32; 2],
    ink: &dyn Fn(u32) -> Ink<'a>,
    tile: &mut TileBuffers,
) {
    let mut row = Row::EMPTY;
    let has_triangles = tile.triangle.iter().any(|&t| t != 0);
    if has_triangles {
        tile.limit.copy_from_slice(&tile.near);
    }
    for chunk in chunks {
        for p in chunk.in_tile(tile_index) {
            let walls = &chunk.walls[index(p.walls[0])..index(p.walls[1])];
            for_rows(p, origin, |from, n, dx, dy| {
                row.fill(p, walls, dx, dy, n);
                let seen = &mut tile.near[from..from + n];
                for ((z, &q), &near) in seen.iter_mut().zip(&row.squared).zip(&row.near) {
                    *z = if q <= 1.0 && near > *z { near } else { *z };
                }
            });
        }
    }
    if has_triangles {
        for ((limit, &near), triangle) in tile
            .limit
            .iter_mut()
            .zip(&tile.near)
            .zip(&mut tile.triangle)
        {
            if near > *limit {
                *triangle = 0;
            }
            *limit = if *triangle == 0 { near } else { f32::INFINITY };
        }
    } else {
        tile.limit.copy_from_slice(&tile.near);
    }
    for chunk in chunks {
        for p in chunk.in_tile(tile_index) {
            let walls = &chunk.walls[index(p.walls[0])..index(p.walls[1])];
            let mut loaded: Option<Loaded<'_>> = None;
            for_rows(p, origin, |from, n, dx, dy| {
                row.fill(p, walls, dx, dy, n);
                if !weigh(&mut row, &tile.limit[from..from + n], p.tolerance) {
                    return;
                }
                let ([color, point, along_s, along_t], gloss, print) =
                    *loaded.get_or_insert_with(|| {
                        let ink = ink(p.splat);
                        let vectors = [
                            ink.color.extend(ink.specular),
                            ink.point.extend(ink.relief),
                            ink.along[0].extend(0.0),
                            ink.along[1].extend(0.0),
                        ];
                        let print = ink.print.map(|print| (print, print.footprint(p)));
                        (vectors, ink.shininess, print)
                    });
                let exponents = &mut tile.gloss[from..from + n];
                for (i, sums) in tile.sums[from..from + n].iter_mut().enumerate() {
                    let w = row.weight[i];
                    if w > 0.0 {
                        let normal = p.normal + p.bend[0] * row.s[i] + p.bend[1] * row.t[i];
                        sums[0] += normal * w;
                        let color = match &print {
                            Some((print, footprint)) => {
                                let aside = print.along[0] * row.s[i] + print.along[1] * row.t[i];
                                let texel = print.image.color(print.at + aside, *footprint);
                                texel.extend(color.w)
                            }
                            None => color,
                        };
                        sums[1] += color * w;
                        exponents[i] += gloss * w;
                        sums[2] += (point + along_s * row.s[i] + along_t * row.t[i]) * w;
                    }
                }
            });
        }
    }
}

/// Single pass: splats over each other from back to front, opacity by eq. (50) of Aras 2014, each
/// splat in the one colour `paint` gives it. The sums hold colour times opacity and opacity.
pub(crate) fn blend_splats(
    chunks: &[Chunk],
    tile_index: usize,
    origin: [i32; 2],
    paint: &dyn Fn(&Projected) -> Vec3,
    tile: &mut TileBuffers,
) {
    let mut row = Row::EMPTY;
    let mut order: Vec<(&Projected, &[Wall])> = Vec::new();
    for chunk in chunks {
        order.extend(
            chunk
                .in_tile(tile_index)
                .map(|p| (p, &chunk.walls[index(p.walls[0])..index(p.walls[1])])),
        );
    }
    order.sort_by(|a, b| a.0.near.total_cmp(&b.0.near));
    tile.limit.copy_from_slice(&tile.near);
    for (p, walls) in order {
        let color = paint(p).extend(1.0);
        for_rows(p, origin, |from, n, dx, dy| {
            row.fill(p, walls, dx, dy, n);
            for i in 0..n {
                let k = from + i;
                if row.squared[i] < 1.0 && row.near[i] > tile.limit[k] {
                    let opacity = (std::f32::consts::FRAC_PI_2 * row.squared[i].sqrt()).cos();
                    let sum = &mut tile.sums[k][1];
                    *sum = color * opacity + *sum * (1.0 - opacity);
                    tile.near[k] = tile.near[k].max(row.near[i]);
                }
            }
        });
    }
}

/// Blend weights of a row; false if all are zero.
#[inline]
fn weigh(row: &mut Row, limit: &[f32], tolerance: f32) -> bool {
    let mut any = false;
    let fragments = row.weight.iter_mut().zip(&row.squared).zip(&row.near);
    for (((w, &q), &near), &limit) in fragments.zip(limit) {
        let seen = q <= 1.0 && near + tolerance >= limit;
        let fall = 1.0 - q;
        *w = if seen {
            fall * fall + LEAST_WEIGHT
        } else {
            0.0
        };
        any |= seen;
    }
    any
}

/// Calls `f(first sample of the tile, samples, dx, dy)` for every row of a splat in the tile.
#[allow(
    clippy::cast_precision_loss,
    reason = "sample coordinates are far below 2^24"
)]
#[inline]
fn for_rows(p: &Projected, origin: [i32; 2], mut f: impl FnMut(usize, usize, f32, f32)) {
    let [x0, y0, x1, y1] = window(p.bounds, origin);
    if x0 >= x1 {
        return;
    }
    let dx = origin[0] as f32 - p.x + (RAMP[x0] + 0.5);
    for y in y0..y1 {
        let dy = origin[1] as f32 - p.y + (RAMP[y] + 0.5);
        f(y * TILE + x0, x1 - x0, dx, dy);
    }
}
