//! Splats on the screen: the map from pixels to disk coordinates, and which tiles a splat meets.

use crate::cast::{count, index, pixel, single};
use crate::render::{Camera, Clip, DrawMode, Lens, RenderSettings, Splat, SplatView};
use glam::{DMat3, DVec3, Vec4};
use rayon::prelude::*;

/// Side of a tile (samples).
pub(crate) const TILE: usize = 32;
/// Chunks that the splats are divided into and the fewest splats of one: each chunk is projected and
/// binned by one thread.
const CHUNKS: usize = 32;
const CHUNK: usize = 2048;
/// Splats are clipped this far beyond the edge (samples), so that the two sides of an edge leave
/// no gap between them.
const OVERHANG: f64 = 0.6;

/// A splat on the screen. With (x, y) in samples from its centre, `w = 1 + wx·x + wy·y`, a point
/// has disk coordinates `(sx·x + sy·y, tx·x + ty·y) / w` and nearness `near + nx·x + ny·y`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Projected {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) s: [f32; 2],
    pub(crate) t: [f32; 2],
    pub(crate) w: [f32; 2],
    pub(crate) near: f32,
    pub(crate) slope: [f32; 2],
    /// How much farther a fragment may lie than what is seen, and still blend (nearness).
    pub(crate) tolerance: f32,
    /// Samples covered: x0, y0, x1, y1, half-open.
    pub(crate) bounds: [i32; 4],
    pub(crate) splat: u32,
    /// Covers the whole square `|s|, |t| <= 1` instead of the disk.
    pub(crate) square: bool,
    /// Range of walls in the chunk.
    pub(crate) walls: [u32; 2],
}

/// What a splat on the screen looks like.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Appearance {
    /// Unit normal in camera axes (right, up, towards the viewer), and 1.
    pub(crate) normal: Vec4,
    /// Change of the normal along the two disk coordinates, and 0.
    pub(crate) bend: [Vec4; 2],
    pub(crate) contribution: Contribution,
}

/// What a splat adds to the sums of a sample it is blended into.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contribution {
    /// Colour and specular.
    pub(crate) color: Vec4,
    /// Texture point (in cells of the relief) and relief.
    pub(crate) point: Vec4,
    /// Change of the texture point along the two disk coordinates, and 0.
    pub(crate) along: [Vec4; 2],
    /// Exponent of the highlight.
    pub(crate) shininess: f32,
}

/// Shadow test of a wall: three linear functions of disk coordinates (constant, s, t); hidden
/// where the first two are at least 0 and the third is negative.
pub(crate) type Wall = [[f32; 3]; 3];

/// A run of splats on the screen, binned.
#[derive(Debug, Default)]
pub(crate) struct Chunk {
    splats: Vec<Projected>,
    /// One entry per splat.
    appearances: Vec<Appearance>,
    walls: Vec<Wall>,
    /// CSR over tiles: which of `splats`, in order.
    offsets: Vec<u32>,
    members: Vec<u32>,
    cursor: Vec<u32>,
}

impl Chunk {
    /// The chunk's splats that meet a tile, in order of splat.
    pub(crate) fn in_tile(&self, tile: usize) -> impl Iterator<Item = (&Projected, &Appearance)> {
        let range = index(self.offsets[tile])..index(self.offsets[tile + 1]);
        let members = self.members[range].iter().map(|&m| index(m));
        members.map(|m| (&self.splats[m], &self.appearances[m]))
    }

    pub(crate) fn is_empty_in(&self, tile: usize) -> bool {
        self.offsets[tile] == self.offsets[tile + 1]
    }

    pub(crate) fn walls_of(&self, p: &Projected) -> &[Wall] {
        &self.walls[index(p.walls[0])..index(p.walls[1])]
    }
}

/// What the projection needs to know of the image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Raster {
    /// Image size (samples).
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Tiles per row and rows of tiles.
    pub(crate) tiles: [usize; 2],
    pub(crate) mode: DrawMode,
    /// Blend tolerance in disk radii.
    pub(crate) tolerance: f64,
}

impl Raster {
    pub(crate) fn new(settings: &RenderSettings) -> Self {
        let per_pixel = index(settings.samples);
        let [width, height] = [settings.width, settings.height].map(|n| index(n) * per_pixel);
        Self {
            width,
            height,
            tiles: [width.div_ceil(TILE), height.div_ceil(TILE)],
            mode: settings.mode,
            tolerance: settings.tolerance,
        }
    }

    /// The samples of the image in a box between two corners, half-open; `None` where there are none.
    pub(crate) fn bounds(&self, [low, high]: [[f64; 2]; 2]) -> Option<[i32; 4]> {
        let clamp =
            |value: f64, end: usize| pixel(value).clamp(0, i32::try_from(end).unwrap_or(i32::MAX));
        let corner = |[x, y]: [f64; 2]| [clamp(x, self.width), clamp(y, self.height)];
        let ([x0, y0], [x1, y1]) = (corner(low), corner(high));
        (x0 < x1 && y0 < y1).then_some([x0, y0, x1, y1])
    }

    /// Calls `f` for the tiles that samples meet.
    pub(crate) fn for_tiles(&self, bounds: [i32; 4], mut f: impl FnMut(usize)) {
        let [x0, y0, x1, y1] = bounds.map(|b| usize::try_from(b).unwrap_or(0));
        for ty in y0 / TILE..y1.div_ceil(TILE) {
            for tx in x0 / TILE..x1.div_ceil(TILE) {
                f(ty * self.tiles[0] + tx);
            }
        }
    }
}

/// Whether a splat is projected whose normal is at this cosine to the line of sight; false for NaN.
pub(crate) type Facing = fn(f64) -> bool;

/// Projects and bins the splats that face as asked, with what each adds to samples by `contribution`; `chunks` are
/// overwritten.
pub(crate) fn project(
    view: &SplatView<'_>,
    camera: &Camera,
    raster: &Raster,
    facing: Facing,
    contribution: &(impl Fn(usize) -> Contribution + Sync),
    chunks: &mut Vec<Chunk>,
) {
    let n = view.splats.len();
    let size = n.div_ceil(CHUNKS).max(CHUNK);
    let projection = Projection {
        camera,
        axes: camera.axes(),
        raster,
        aligned: matches!(raster.mode, DrawMode::Squares | DrawMode::Disks),
    };
    chunks.resize_with(n.div_ceil(size), Chunk::default);
    chunks.par_iter_mut().enumerate().for_each(|(c, chunk)| {
        chunk.splats.clear();
        chunk.appearances.clear();
        chunk.walls.clear();
        for i in c * size..((c + 1) * size).min(n) {
            let splat = &view.splats[i];
            let Some((mut out, scale)) = projection.splat(splat, facing) else {
                continue;
            };
            let first = count(chunk.walls.len());
            if let Some(Some(clip)) = view.clips.get(i)
                && !projection.aligned
            {
                add_walls(clip, view.surfels[i].radius, scale, &mut chunk.walls);
            }
            out.walls = [first, count(chunk.walls.len())];
            out.splat = count(i);
            chunk.splats.push(out);
            let appearance = projection.appearance(splat, contribution(i));
            chunk.appearances.push(appearance);
        }
        bin(chunk, raster);
    });
}

/// How splats come onto the screen.
struct Projection<'a> {
    camera: &'a Camera,
    /// World to camera axes.
    axes: DMat3,
    raster: &'a Raster,
    /// Whether all splats face the viewer.
    aligned: bool,
}

impl Projection<'_> {
    /// A splat on the screen, without its number and walls, and the samples per metre at its centre; `None` where it is not
    /// seen.
    fn splat(&self, splat: &Splat, facing: Facing) -> Option<(Projected, f64)> {
        let (camera, raster) = (self.camera, self.raster);
        let (arm, normal) = (splat.position - camera.eye, splat.normal);
        let cosine = match camera.lens {
            Lens::Perspective { .. } => normal.dot(arm) / arm.length(),
            Lens::Orthographic { .. } => normal.dot(camera.forward),
        };
        let c = self.axes * arm;
        if !facing(cosine) || c.z <= 0.0 {
            return None;
        }
        let [mut u, mut v] = splat.axes.map(|axis| self.axes * axis);
        let size = u.length().max(v.length());
        if self.aligned {
            (u, v) = (DVec3::X * size, DVec3::Y * size);
        }
        let height = raster.height as f64;
        let scale = camera.lens.scale(height, c.z);
        let mut out = map(camera, c, u, v, height)?;
        let (x, y) = (
            0.5 * raster.width as f64 + scale * c.x,
            0.5 * height + scale * c.y,
        );
        let (low, high) = extent(camera, c, u, v, scale)?;
        // Samples whose centres lie in low..high.
        out.bounds = raster.bounds([low, high].map(|end| [x + end[0] + 0.5, y + end[1] + 0.5]))?;
        (out.x, out.y) = (single(x), single(y));
        // Of splats that face the viewer nothing is blended: the nearest wins.
        out.square = raster.mode == DrawMode::Squares;
        if !self.aligned {
            out.tolerance = single(match camera.lens {
                Lens::Perspective { .. } => raster.tolerance * size / (c.z * c.z),
                Lens::Orthographic { .. } => raster.tolerance * size,
            });
        }
        Some((out, scale))
    }

    /// What a splat looks like.
    fn appearance(&self, splat: &Splat, contribution: Contribution) -> Appearance {
        let lit = |n: DVec3, w: f32| {
            let n = self.axes * n;
            Vec4::new(single(n.x), single(-n.y), single(-n.z), w)
        };
        let bend = if self.aligned {
            [Vec4::ZERO; 2]
        } else {
            splat.normal_derivatives.map(|change| lit(change, 0.0))
        };
        Appearance {
            normal: lit(splat.normal, 1.0),
            bend,
            contribution,
        }
    }
}

/// The map from samples to disk coordinates and nearness.
fn map(camera: &Camera, c: DVec3, u: DVec3, v: DVec3, height: f64) -> Option<Projected> {
    let g = u.cross(v);
    match camera.lens {
        Lens::Perspective { focal } => {
            // c + s u + t v = d / nearness with d = (x, y, 1): Cramer's rule gives s, t and the
            // nearness 1/z as quotients of linear functions of d.
            let g_centre = g.dot(c) / c.z;
            if g_centre.abs() <= 1e-4 * g.length() * c.length() / c.z {
                return None;
            }
            let per = 1.0 / (focal * height * g_centre);
            let (a, b) = (v.cross(c) * per, c.cross(u) * per);
            let w = g * per;
            let near = 1.0 / c.z;
            Some(Projected {
                s: [single(a.x), single(a.y)],
                t: [single(b.x), single(b.y)],
                w: [single(w.x), single(w.y)],
                near: single(near),
                slope: [single(w.x * near), single(w.y * near)],
                ..Projected::default()
            })
        }
        Lens::Orthographic { height: shown } => {
            if g.z.abs() <= 1e-4 * g.length() {
                return None;
            }
            let per = shown / (height * g.z);
            let (s, t) = ([v.y * per, -v.x * per], [-u.y * per, u.x * per]);
            Some(Projected {
                s: s.map(single),
                t: t.map(single),
                near: single(-c.z),
                slope: [0, 1].map(|k| single(-(u.z * s[k] + v.z * t[k]))),
                ..Projected::default()
            })
        }
    }
}

/// Bounds of a disk on the screen, relative to its centre (samples). `None` for a disk that reaches behind the eye.
fn extent(
    camera: &Camera,
    c: DVec3,
    u: DVec3,
    v: DVec3,
    scale: f64,
) -> Option<([f64; 2], [f64; 2])> {
    let mut low = [0.0; 2];
    let mut high = [0.0; 2];
    match camera.lens {
        Lens::Perspective { .. } => {
            // Dual conic of the projected circle; its tangents x = const bound it.
            let f = scale * c.z;
            let ww = u.z * u.z + v.z * v.z - c.z * c.z;
            if ww >= -0.04 * c.z * c.z {
                return None;
            }
            for k in 0..2 {
                let (a, b, d) = (f * u[k], f * v[k], f * c[k]);
                let xw = a * u.z + b * v.z - d * c.z;
                let xx = a * a + b * b - d * d;
                let root = (xw * xw - xx * ww).max(0.0).sqrt();
                low[k] = (xw + root) / ww - scale * c[k];
                high[k] = (xw - root) / ww - scale * c[k];
            }
        }
        Lens::Orthographic { .. } => {
            for k in 0..2 {
                high[k] = scale * u[k].hypot(v[k]);
                low[k] = -high[k];
            }
        }
    }
    Some((low, high))
}

fn add_walls(clip: &Clip, radius: f64, scale: f64, walls: &mut Vec<Wall>) {
    let overhang = OVERHANG / scale;
    // The first two functions of an edge are 0: it hides all that is beyond.
    walls.extend(clip.edges.iter().map(|&(direction, offset)| {
        let beyond = [
            single(offset + overhang),
            single(-direction.x * radius),
            single(-direction.y * radius),
        ];
        [[0.0; 3], [0.0; 3], beyond]
    }));
    for &[a, b] in &clip.walls {
        let (mut a, mut b) = (a - clip.anchor, b - clip.anchor);
        if a.perp_dot(b) < 0.0 {
            std::mem::swap(&mut a, &mut b);
        }
        let Some(along) = (b - a).try_normalize() else {
            continue;
        };
        // Functions of p = q radius - anchor, with q the disk coordinates.
        let o = clip.anchor;
        let linear = |c: f64, x: f64, y: f64| {
            [
                single(c - x * o.x - y * o.y),
                single(x * radius),
                single(y * radius),
            ]
        };
        walls.push([
            linear(0.0, -a.y, a.x),
            linear(0.0, b.y, -b.x),
            linear(overhang + along.y * a.x - along.x * a.y, -along.y, along.x),
        ]);
    }
}

/// Sorts the chunk's splats into tiles, keeping their order.
fn bin(chunk: &mut Chunk, raster: &Raster) {
    let Chunk {
        splats,
        offsets,
        members,
        cursor,
        ..
    } = chunk;
    offsets.clear();
    offsets.resize(raster.tiles[0] * raster.tiles[1] + 1, 0);
    for p in &*splats {
        raster.for_tiles(p.bounds, |tile| offsets[tile + 1] += 1);
    }
    for k in 1..offsets.len() {
        offsets[k] += offsets[k - 1];
    }
    cursor.clone_from(offsets);
    members.resize(index(*offsets.last().unwrap_or(&0)), 0);
    for (i, p) in splats.iter().enumerate() {
        raster.for_tiles(p.bounds, |tile| {
            members[index(cursor[tile])] = count(i);
            cursor[tile] += 1;
        });
    }
}
