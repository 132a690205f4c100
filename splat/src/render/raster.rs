//! One tile: visibility and blending of splats and triangles.
#![allow(
    clippy::needless_range_loop,
    reason = "places in a tile are counted and converted by one table"
)]

use crate::render::{Appearance, Chunk, Image, Projected, TILE, Wall};
use glam::{Vec2, Vec3, Vec4};

/// Samples of a row that are worked on at a time; they fill a [`Vec4`].
const LANES: usize = 4;
/// Runs of [`LANES`] samples in a row of a tile, and in a tile.
const RUNS: usize = TILE / LANES;
const AREA: usize = TILE * RUNS;
/// Weight that even the border of a disk has, so that any covered sample gets a colour.
const LEAST_WEIGHT: f32 = 1e-4;
/// 0, 1, 2, ...
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
pub(crate) type SampleSums = [Vec4; 3];

/// One tile in the making, in runs of samples.
#[derive(Debug)]
pub(crate) struct TileBuffers {
    /// Nearness of what is seen; minus infinity: nothing.
    near: Vec<[f32; LANES]>,
    /// Nearness that splats must reach to blend; infinite where a triangle is seen.
    limit: Vec<[f32; LANES]>,
    sums: Vec<[SampleSums; LANES]>,
    /// Weighted sum of the highlights' exponents.
    gloss: Vec<[f32; LANES]>,
    /// Triangle seen, plus 1; 0: none.
    triangle: Vec<[u32; LANES]>,
}

impl TileBuffers {
    pub(crate) fn new() -> Self {
        Self {
            near: vec![[f32::NEG_INFINITY; LANES]; AREA],
            limit: vec![[f32::NEG_INFINITY; LANES]; AREA],
            sums: vec![[[Vec4::ZERO; 3]; LANES]; AREA],
            gloss: vec![[0.0; LANES]; AREA],
            triangle: vec![[0; LANES]; AREA],
        }
    }

    pub(crate) fn clear(&mut self) {
        self.near.fill([f32::NEG_INFINITY; LANES]);
        self.triangle.fill([0; LANES]);
        self.sums.fill([[Vec4::ZERO; 3]; LANES]);
        self.gloss.fill([0.0; LANES]);
    }

    /// Nearness of what each sample sees, row by row; minus infinity: nothing.
    pub(crate) fn near(&self) -> &[f32] {
        self.near.as_flattened()
    }

    pub(crate) fn sums(&self) -> &[SampleSums] {
        self.sums.as_flattened()
    }

    /// Weighted sums of the highlights' exponents.
    pub(crate) fn gloss(&self) -> &[f32] {
        self.gloss.as_flattened()
    }

    /// Triangles seen, plus 1; 0: none.
    pub(crate) fn triangle(&self) -> &[u32] {
        self.triangle.as_flattened()
    }
}

/// An image on a splat.
#[derive(Clone, Copy)]
pub(crate) struct ImagePatch<'a> {
    pub(crate) image: &'a Image,
    /// Image coordinates of the centre, and their change along the two disk coordinates.
    pub(crate) at: Vec2,
    pub(crate) along: [Vec2; 2],
}

impl ImagePatch<'_> {
    /// The part of the image that a sample of a splat sees, its larger side in units of the image.
    fn footprint(&self, p: &Projected) -> f32 {
        let step = |k: usize| (self.along[0] * p.s[k] + self.along[1] * p.t[k]).length();
        step(0).max(step(1))
    }
}

/// Adds the fragment of a splat at disk coordinates `at` to the sums; `patch` is its image and how
/// much of it a sample sees.
#[inline]
fn blend(
    appearance: &Appearance,
    patch: Option<&(ImagePatch<'_>, f32)>,
    at: [f32; 2],
    weight: f32,
    sums: &mut SampleSums,
) {
    let [s, t] = at;
    let contribution = &appearance.contribution;
    let color = match patch {
        Some((patch, footprint)) => {
            let aside = patch.along[0] * s + patch.along[1] * t;
            let texel = patch.image.color(patch.at + aside, *footprint);
            texel.extend(contribution.color.w)
        }
        None => contribution.color,
    };
    sums[0] += (appearance.normal + appearance.bend[0] * s + appearance.bend[1] * t) * weight;
    sums[1] += color * weight;
    sums[2] +=
        (contribution.point + contribution.along[0] * s + contribution.along[1] * t) * weight;
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

impl ScreenTriangle {
    /// Whether it may cover a sample of a tile (column, row): not if all of that lies beyond one edge.
    pub(crate) fn meets(&self, tile: [usize; 2]) -> bool {
        let [x, y] = tile.map(|at| (at * TILE) as f32);
        let side = TILE as f32;
        let most = |[constant, along, down]: &[f32; 3]| {
            constant + (along * x).max(along * (x + side)) + (down * y).max(down * (y + side))
        };
        self.edges.iter().all(|edge| most(edge) >= 0.0)
    }
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

/// A run of fragments of one splat. With `w` the quotient of the map to the disk, which is positive
/// on the disk, `s` and `t` are disk coordinates times `w` and `squared` is their squared length.
struct Fragments {
    s: Vec4,
    t: Vec4,
    w: Vec4,
    squared: Vec4,
    near: Vec4,
}

/// Functions of a splat on one row of samples: value at the splat's centre, and slope.
struct Row {
    s: [Vec4; 2],
    t: [Vec4; 2],
    w: [Vec4; 2],
    near: [Vec4; 2],
    square: bool,
}

impl Row {
    /// The row `dy` samples below the centre.
    #[inline]
    fn new(p: &Projected, dy: f32) -> Self {
        let line = |first: f32, slope: [f32; 2]| {
            [Vec4::splat(first + slope[1] * dy), Vec4::splat(slope[0])]
        };
        Self {
            s: line(0.0, p.s),
            t: line(0.0, p.t),
            w: line(1.0, p.w),
            near: line(p.near, p.slope),
            square: p.square,
        }
    }

    /// The fragments `dx` samples to the right of the centre. What lies outside of the disk or is
    /// hidden by a wall has an infinite `squared`.
    #[inline]
    fn fragments(&self, dx: Vec4, walls: &[Wall]) -> Fragments {
        let at = |line: &[Vec4; 2]| line[0] + line[1] * dx;
        let (s, t, w) = (at(&self.s), at(&self.t), at(&self.w));
        let mut squared = if self.square {
            (s * s).max(t * t)
        } else {
            s * s + t * t
        };
        let outside = Vec4::INFINITY;
        for wall in walls {
            let f = |l: &[f32; 3]| w * l[0] + s * l[1] + t * l[2];
            let hidden = f(&wall[0]).cmpge(Vec4::ZERO)
                & f(&wall[1]).cmpge(Vec4::ZERO)
                & f(&wall[2]).cmplt(Vec4::ZERO);
            squared = Vec4::select(hidden, outside, squared);
        }
        Fragments {
            s,
            t,
            w,
            squared: Vec4::select(squared.cmple(w * w), squared, outside),
            near: at(&self.near),
        }
    }
}

/// Draws a tile's triangles into the nearness.
pub(crate) fn draw_triangles(
    triangles: &[(u32, ScreenTriangle)],
    origin: [i32; 2],
    tile: &mut TileBuffers,
) {
    let [left, top] = origin.map(|from| from as f32);
    for (id, t) in triangles {
        let [x0, y0, x1, y1] = window(t.bounds, origin);
        for y in y0..y1 {
            let py = top + RAMP[y] + 0.5;
            for run in x0 / LANES..x1.div_ceil(LANES) {
                let column = Vec4::new(0.0, 1.0, 2.0, 3.0) + RAMP[run * LANES];
                let px = column + left + 0.5;
                let at = |l: &[f32; 3]| px * l[1] + l[0] + l[2] * py;
                let within =
                    column.cmpge(Vec4::splat(x0 as f32)) & column.cmplt(Vec4::splat(x1 as f32));
                let k = y * RUNS + run;
                let (near, nearest) = (at(&t.near), Vec4::from_array(tile.near[k]));
                let mut seen = within & near.cmpgt(nearest);
                for edge in &t.edges {
                    seen &= at(edge).cmpge(Vec4::ZERO);
                }
                tile.near[k] = Vec4::select(seen, near, nearest).to_array();
                for (lane, triangle) in tile.triangle[k].iter_mut().enumerate() {
                    if seen.test(lane) {
                        *triangle = id + 1;
                    }
                }
            }
        }
    }
}

/// First pass: nearness of the nearest surface.
pub(crate) fn find_surface(
    chunks: &[Chunk],
    tile_index: usize,
    origin: [i32; 2],
    tile: &mut TileBuffers,
) {
    let has_triangles = tile.triangle().iter().any(|&t| t != 0);
    if has_triangles {
        tile.limit.copy_from_slice(&tile.near);
    }
    for chunk in chunks {
        for (p, _) in chunk.in_tile(tile_index) {
            for_runs(p, chunk.walls_of(p), origin, |k, found| {
                let seen = &mut tile.near[k];
                let inside = found.squared.cmplt(Vec4::INFINITY);
                let near = Vec4::select(inside, found.near, Vec4::NEG_INFINITY);
                *seen = near.max(Vec4::from_array(*seen)).to_array();
            });
        }
    }
    if has_triangles {
        for ((limit, &near), triangle) in tile
            .limit
            .as_flattened_mut()
            .iter_mut()
            .zip(tile.near.as_flattened())
            .zip(tile.triangle.as_flattened_mut())
        {
            if near > *limit {
                *triangle = 0;
            }
            *limit = if *triangle == 0 { near } else { f32::INFINITY };
        }
    } else {
        tile.limit.copy_from_slice(&tile.near);
    }
}

/// Second pass: blending of what is near to the surface found, with the image that `patch` lays on
/// a splat.
pub(crate) fn blend_near<'a>(
    chunks: &[Chunk],
    tile_index: usize,
    origin: [i32; 2],
    patch: &dyn Fn(u32) -> Option<ImagePatch<'a>>,
    tile: &mut TileBuffers,
) {
    for chunk in chunks {
        for (p, appearance) in chunk.in_tile(tile_index) {
            let mut loaded = None;
            for_runs(p, chunk.walls_of(p), origin, |k, found| {
                let limit = Vec4::from_array(tile.limit[k]);
                let seen =
                    found.squared.cmplt(Vec4::INFINITY) & (found.near + p.tolerance).cmpge(limit);
                let mut left = seen.bitmask();
                if left == 0 {
                    return;
                }
                let patch = loaded
                    .get_or_insert_with(|| patch(p.splat).map(|patch| (patch, patch.footprint(p))))
                    .as_ref();
                let per = found.w.recip();
                let fall = Vec4::ONE - found.squared * per * per;
                let weight = (fall * fall + LEAST_WEIGHT).to_array();
                let (s, t) = ((found.s * per).to_array(), (found.t * per).to_array());
                while left != 0 {
                    let lane = left.trailing_zeros() as usize % LANES;
                    left &= left - 1;
                    let sums = &mut tile.sums[k][lane];
                    blend(appearance, patch, [s[lane], t[lane]], weight[lane], sums);
                    tile.gloss[k][lane] += appearance.contribution.shininess * weight[lane];
                }
            });
        }
    }
}

/// Gives what no splat covers, where a tile's splats seen from behind do, the one colour `inside`.
pub(crate) fn fill_gaps(
    chunks: &[Chunk],
    tile_index: usize,
    origin: [i32; 2],
    inside: Vec3,
    tile: &mut TileBuffers,
) {
    let open = |near: &[f32; LANES]| near.contains(&f32::NEG_INFINITY);
    if !tile.near.iter().any(open) {
        return;
    }
    tile.limit.copy_from_slice(&tile.near);
    for chunk in chunks {
        for (p, _) in chunk.in_tile(tile_index) {
            for_runs(p, chunk.walls_of(p), origin, |k, found| {
                let covered = found.squared.cmplt(Vec4::INFINITY);
                let gap = Vec4::from_array(tile.limit[k]).cmpeq(Vec4::NEG_INFINITY);
                let mut left = (covered & gap).bitmask();
                let near = found.near.to_array();
                while left != 0 {
                    let lane = left.trailing_zeros() as usize % LANES;
                    left &= left - 1;
                    tile.near[k][lane] = tile.near[k][lane].max(near[lane]);
                    tile.sums[k][lane] = [
                        Vec4::new(0.0, 0.0, 1.0, 1.0),
                        inside.extend(0.0),
                        Vec4::ZERO,
                    ];
                    tile.gloss[k][lane] = 1.0;
                }
            });
        }
    }
}

/// Single pass: splats over each other from back to front, opacity by eq. (50) of Aras 2014, each
/// splat in the one colour `tone` gives it. The sums hold colour times opacity and opacity.
pub(crate) fn blend_splats(
    chunks: &[Chunk],
    tile_index: usize,
    origin: [i32; 2],
    tone: &dyn Fn(&Projected, &Appearance) -> Vec3,
    tile: &mut TileBuffers,
) {
    let mut order: Vec<(&Projected, &Appearance, &[Wall])> = Vec::new();
    for chunk in chunks {
        let members = chunk.in_tile(tile_index);
        order.extend(members.map(|(p, appearance)| (p, appearance, chunk.walls_of(p))));
    }
    order.sort_by(|a, b| a.0.near.total_cmp(&b.0.near));
    tile.limit.copy_from_slice(&tile.near);
    for (p, appearance, walls) in order {
        let color = tone(p, appearance).extend(1.0);
        for_runs(p, walls, origin, |k, found| {
            let radius = (found.squared / (found.w * found.w)).to_array();
            let near = found.near.to_array();
            for lane in 0..LANES {
                if radius[lane] < 1.0 && near[lane] > tile.limit[k][lane] {
                    let opacity = (std::f32::consts::FRAC_PI_2 * radius[lane].sqrt()).cos();
                    let sum = &mut tile.sums[k][lane][1];
                    *sum = color * opacity + *sum * (1.0 - opacity);
                    tile.near[k][lane] = tile.near[k][lane].max(near[lane]);
                }
            }
        });
    }
}

/// Calls `f(run of the tile, fragments)` for all runs of a tile that a splat may meet.
#[inline]
fn for_runs(p: &Projected, walls: &[Wall], origin: [i32; 2], mut f: impl FnMut(usize, &Fragments)) {
    let [x0, y0, x1, y1] = window(p.bounds, origin);
    if x0 >= x1 {
        return;
    }
    // Samples beside the window that belong to a run of its border are outside of the disk.
    let runs = x0 / LANES..x1.div_ceil(LANES);
    let left = origin[0] as f32 - p.x + 0.5;
    let top = origin[1] as f32 - p.y + 0.5;
    for y in y0..y1 {
        let row = Row::new(p, top + RAMP[y]);
        for run in runs.clone() {
            let dx = Vec4::new(0.0, 1.0, 2.0, 3.0) + (left + RAMP[run * LANES]);
            f(y * RUNS + run, &row.fragments(dx, walls));
        }
    }
}
