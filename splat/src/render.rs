//! The renderer: tiles in parallel, same bits at any thread count.

use crate::camera::{Camera, Lens};
use crate::cast::{count, index, pixel, real, single};
use crate::frame::Frame;
use crate::image::Chart;
use crate::project::{Chunk, Ink, Paint, Projected, Raster, TILE, project};
use crate::raster::{
    Print, ScreenTriangle, Sums, TileBuffers, blend_splats, draw_splats, draw_triangles,
};
use crate::scene::{Background, DrawMode, ImageCoat, Lighting, SplatView, Surface};
use crate::shade::{Point, Rig, Transfer, relief, tone};
use crate::tool::Mesh;
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// What the image is like.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderSettings {
    /// Width (px).
    pub width: u32,
    /// Height (px).
    pub height: u32,
    /// Anti-aliasing: samples per pixel along each axis; 1, 2 or 4.
    pub samples: u32,
    /// How splats are drawn.
    pub mode: DrawMode,
    /// Splats blend with those at most this much nearer, in radii of the splat.
    pub tolerance: f64,
    /// Optical properties by material id; a splat whose id has none takes the default surface.
    pub surfaces: Vec<Surface>,
    /// Light.
    pub lighting: Lighting,
    /// Background.
    pub background: Background,
    /// Give the frame its normals too (three-pass mode).
    pub keep_normals: bool,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            samples: 2,
            mode: DrawMode::ThreePass,
            tolerance: 0.7,
            surfaces: vec![Surface::default()],
            lighting: Lighting::default(),
            background: Background::default(),
            keep_normals: false,
        }
    }
}

/// Draws frames; keeps tables and buffers between frames.
#[derive(Debug)]
pub struct Renderer {
    settings: RenderSettings,
    transfer: Transfer,
    tiles: Vec<TilePixels>,
    chunks: Vec<Chunk>,
    plain: Surface,
}

/// Finished pixels of one tile.
#[derive(Debug, Clone, Default)]
struct TilePixels {
    color: Vec<[u8; 4]>,
    depth: Vec<f32>,
    normals: Vec<Vec3>,
}

/// A triangle in the camera frame, for lighting.
struct LitTriangle {
    normals: [Vec3; 3],
    mesh: usize,
}

impl Renderer {
    /// A renderer for images as set.
    ///
    /// # Panics
    /// If the image has no pixels or more than 16,384 to a side, or `samples` is not 1, 2 or 4.
    #[must_use]
    pub fn new(settings: RenderSettings) -> Self {
        assert!(
            (1..=16_384).contains(&settings.width) && (1..=16_384).contains(&settings.height),
            "an image has 1 to 16384 pixels to a side"
        );
        assert!(
            matches!(settings.samples, 1 | 2 | 4),
            "1, 2 or 4 samples per pixel and axis"
        );
        Self {
            settings,
            transfer: Transfer::new(),
            tiles: Vec::new(),
            chunks: Vec::new(),
            plain: Surface::default(),
        }
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// Draws one frame.
    ///
    /// # Panics
    /// If the view's slices differ in length.
    pub fn draw(&mut self, view: &SplatView<'_>, meshes: &[Mesh], camera: &Camera) -> Frame {
        let n = view.splats.positions.len();
        assert!(
            view.colors.len() == n
                && view.materials.len() == n
                && view.texture_points.len() == n
                && view.radii.len() == n
                && (view.texture_normals.is_empty() || view.texture_normals.len() == n)
                && (view.clips.is_empty() || view.clips.len() == n),
            "one colour, material, texture point, radius and clip per splat"
        );
        let ss = index(self.settings.samples);
        let (w, h) = (
            index(self.settings.width) * ss,
            index(self.settings.height) * ss,
        );
        let raster = Raster {
            width: w,
            height: h,
            tiles: [w.div_ceil(TILE), h.div_ceil(TILE)],
            mode: self.settings.mode,
            tolerance: self.settings.tolerance,
        };
        let mut chunks = std::mem::take(&mut self.chunks);
        let mut tiles = std::mem::take(&mut self.tiles);
        let ink = |i: usize| {
            let s = self.surface(view.materials[i]);
            let cells = f64::from(s.relief_frequency);
            let along = view.rest_axes(i);
            let point = (view.texture_points[i] * cells).as_vec3();
            Ink {
                color: view.colors[i].extend(s.specular),
                point: point.extend(s.relief),
                along: along.map(|axis| (axis * cells).as_vec3().extend(0.0)),
                shininess: s.shininess,
            }
        };
        project(view, camera, &raster, &ink, &mut chunks);
        let (triangles, lit) = screen_triangles(meshes, camera, &raster);
        let rig = Rig::new(&self.settings.lighting);
        tiles.resize_with(raster.tiles[0] * raster.tiles[1], TilePixels::default);
        let surfaces = &self.settings.surfaces;
        let coated = surfaces.iter().any(|surface| surface.coat.is_some());
        let print = |splat: u32| {
            let i = index(splat);
            let surface = coated.then(|| self.surface(view.materials[i]))?;
            surface.coat.as_ref().map(|coat| print(view, i, coat))
        };
        tiles.par_iter_mut().enumerate().for_each_init(
            TileBuffers::new,
            |buffers, (tile, pixels)| {
                let origin = [tile % raster.tiles[0] * TILE, tile / raster.tiles[0] * TILE];
                let from = origin.map(|o| i32::try_from(o).unwrap_or(i32::MAX));
                if triangles[tile].is_empty() && chunks.iter().all(|c| c.is_empty_in(tile)) {
                    self.fill(origin[1], pixels);
                    return;
                }
                buffers.clear();
                draw_triangles(&triangles[tile], from, buffers);
                if raster.mode == DrawMode::SinglePass {
                    let tone = |p: &Projected, paint: &Paint| self.tone(p, paint, camera, &rig);
                    blend_splats(&chunks, tile, from, &tone, buffers);
                } else {
                    draw_splats(&chunks, tile, from, &print, buffers);
                }
                self.finish(buffers, &lit, meshes, camera, origin, &rig, pixels);
            },
        );
        self.chunks = chunks;
        let frame = self.assemble(&tiles, raster.tiles[0], TILE / ss);
        self.tiles = tiles;
        frame
    }

    /// The one colour of a splat that is lit as a whole.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "on the screen"
    )]
    fn tone(&self, p: &Projected, paint: &Paint, camera: &Camera, rig: &Rig) -> Vec3 {
        let at = [p.x.max(0.0) as usize, p.y.max(0.0) as usize];
        let view = view_direction(camera, at, &self.settings);
        tone(rig.shade(&Point {
            normal: paint.normal.truncate(),
            view,
            color: paint.ink.color.truncate(),
            specular: paint.ink.color.w,
            shininess: paint.ink.shininess,
            softness: 0.5,
        }))
    }

    fn surface(&self, material: u8) -> &Surface {
        let surfaces = &self.settings.surfaces;
        surfaces.get(usize::from(material)).unwrap_or(&self.plain)
    }

    /// A tile that shows nothing but the background.
    fn fill(&self, top: usize, pixels: &mut TilePixels) {
        let ss = index(self.settings.samples);
        let side = TILE / ss;
        pixels.color.resize(side * side, [0; 4]);
        pixels.depth.clear();
        pixels.depth.resize(side * side, f32::INFINITY);
        pixels.normals.clear();
        if self.settings.keep_normals {
            pixels.normals.resize(side * side, Vec3::ZERO);
        }
        for (py, row) in pixels.color.chunks_exact_mut(side).enumerate() {
            let [r, g, b] = self.transfer.encode(self.background(top + py * ss));
            row.fill([r, g, b, 255]);
        }
    }

    /// The background's colour in a row of samples.
    fn background(&self, row: usize) -> Vec3 {
        let height = index(self.settings.height) * index(self.settings.samples);
        let down = single(real(row)) / single(real(height));
        let background = &self.settings.background;
        background.top.lerp(background.bottom, down.min(1.0))
    }

    /// Third pass: normalise, light, average the samples of each pixel, encode.
    #[allow(clippy::too_many_arguments, reason = "one tile's inputs and outputs")]
    fn finish(
        &self,
        buffers: &TileBuffers,
        lit: &[LitTriangle],
        meshes: &[Mesh],
        camera: &Camera,
        origin: [usize; 2],
        rig: &Rig,
        pixels: &mut TilePixels,
    ) {
        let ss = index(self.settings.samples);
        let side = TILE / ss;
        self.fill(origin[1], pixels);
        if self.settings.keep_normals {
            for (k, normal) in pixels.normals.iter_mut().enumerate() {
                let mut sum = Vec3::ZERO;
                for sample in 0..ss * ss {
                    let (y, x) = (k / side * ss + sample / ss, k % side * ss + sample % ss);
                    let sums = buffers.sums()[y * TILE + x][0];
                    sum += sums.truncate().normalize_or_zero();
                }
                *normal = sum.normalize_or_zero();
            }
        }
        for py in 0..side {
            let background = self.background(origin[1] + py * ss);
            for px in 0..side {
                let open = (py * ss..(py + 1) * ss).all(|y| {
                    let from = y * TILE + px * ss;
                    let samples = &buffers.near()[from..from + ss];
                    samples.iter().all(|&near| near == f32::NEG_INFINITY)
                });
                if open {
                    continue;
                }
                let (sum, nearest) = self.pixel(
                    buffers,
                    [px, py],
                    origin,
                    background,
                    lit,
                    meshes,
                    camera,
                    rig,
                );
                let [r, g, b] = self.transfer.encode(sum);
                pixels.color[py * side + px] = [r, g, b, 255];
                pixels.depth[py * side + px] = match camera.lens {
                    Lens::Perspective { .. } => 1.0 / nearest,
                    Lens::Orthographic { .. } => -nearest,
                };
            }
        }
    }

    /// Colour of a pixel, averaged over its samples, and the nearest sample's nearness.
    ///
    /// Samples of one smooth surface are averaged before they are lit, others lit one by one.
    #[allow(clippy::too_many_arguments, reason = "one pixel's inputs")]
    fn pixel(
        &self,
        buffers: &TileBuffers,
        pixel: [usize; 2],
        origin: [usize; 2],
        background: Vec3,
        lit: &[LitTriangle],
        meshes: &[Mesh],
        camera: &Camera,
        rig: &Rig,
    ) -> (Vec3, f32) {
        let ss = index(self.settings.samples);
        let mut nearest = f32::NEG_INFINITY;
        let mut sum = Vec3::ZERO;
        let mut alike = true;
        let mut mean = [Vec4::ZERO; 3];
        let mut mean_gloss = 0.0;
        let mut splatted = 0.0;
        let corner = [pixel[0] * ss, pixel[1] * ss];
        let at = [origin[0] + corner[0], origin[1] + corner[1]];
        let view = view_direction(camera, at, &self.settings);
        for sample in 0..ss * ss {
            let k = (corner[1] + sample / ss) * TILE + corner[0] + sample % ss;
            let near = buffers.near()[k];
            if near == f32::NEG_INFINITY {
                sum += background;
                continue;
            }
            nearest = nearest.max(near);
            if self.settings.mode == DrawMode::SinglePass {
                let over = buffers.sums()[k][1];
                let under = match buffers.triangle()[k].checked_sub(1) {
                    Some(id) => tone(lit_triangle(&lit[index(id)], meshes, view, rig)),
                    None => background,
                };
                sum += over.truncate() + under * (1.0 - over.w);
                continue;
            }
            if let Some(id) = buffers.triangle()[k].checked_sub(1) {
                sum += tone(lit_triangle(&lit[index(id)], meshes, view, rig));
                continue;
            }
            let s = &buffers.sums()[k];
            let per = 1.0 / s[0].w;
            if splatted > 0.0 {
                alike &= s[0].truncate().dot(mean[0].truncate()) * per > 0.9 * splatted;
            }
            for (m, s) in mean.iter_mut().zip(s) {
                *m += *s * per;
            }
            mean_gloss += buffers.gloss()[k] * per;
            splatted += 1.0;
        }
        if splatted > 0.0 && alike {
            sum += tone(light(&mean, mean_gloss, view, rig)) * splatted;
        } else if splatted > 0.0 {
            for sample in 0..ss * ss {
                let k = (corner[1] + sample / ss) * TILE + corner[0] + sample % ss;
                if buffers.near()[k] > f32::NEG_INFINITY && buffers.triangle()[k] == 0 {
                    sum += tone(light(&buffers.sums()[k], buffers.gloss()[k], view, rig));
                }
            }
        }
        (sum / single(real(ss * ss)), nearest)
    }

    fn assemble(&self, tiles: &[TilePixels], tiles_per_row: usize, side: usize) -> Frame {
        let (w, h) = (index(self.settings.width), index(self.settings.height));
        let mut pixels = vec![[0_u8; 4]; w * h];
        let mut depth = vec![f32::INFINITY; w * h];
        pixels
            .par_chunks_mut(w)
            .zip(depth.par_chunks_mut(w))
            .enumerate()
            .with_min_len(16)
            .for_each(|(y, (colors, depths))| {
                let (ty, sy) = (y / side, y % side);
                for tx in 0..w.div_ceil(side) {
                    let tile = &tiles[ty * tiles_per_row + tx];
                    let (from, to) = (tx * side, ((tx + 1) * side).min(w));
                    let row = sy * side..sy * side + to - from;
                    colors[from..to].copy_from_slice(&tile.color[row.clone()]);
                    depths[from..to].copy_from_slice(&tile.depth[row]);
                }
            });
        let mut normals = Vec::new();
        if self.settings.keep_normals {
            normals.resize(w * h, Vec3::ZERO);
            for (k, normal) in normals.iter_mut().enumerate() {
                let (x, y) = (k % w, k / w);
                let tile = &tiles[y / side * tiles_per_row + x / side];
                *normal = tile.normals[y % side * side + x % side];
            }
        }
        Frame {
            width: self.settings.width,
            height: self.settings.height,
            pixels,
            depth,
            normals,
        }
    }
}

/// How an image lies on a splat.
fn print<'a>(view: &SplatView<'_>, splat: usize, coat: &'a ImageCoat) -> Print<'a> {
    let [u, v] = view.rest_axes(splat);
    let normal = view.texture_normals.get(splat);
    let normal = *normal.unwrap_or(&view.splats.normals[splat]);
    let (width, height) = coat.image.size();
    let chart = Chart::new(normal, coat.size, real(width) / real(height));
    Print {
        image: &coat.image,
        at: chart.at(view.texture_points[splat]),
        along: [chart.at(u), chart.at(v)],
    }
}

/// Strength and exponent of the highlight where unit normals differ and their mean is shorter than 1
/// (Toksvig 2005): without it the two sides of an edge, blended, shine as a third face between them.
#[inline]
fn spread_highlight(length: f32, specular: f32, shininess: f32) -> (f32, f32) {
    let share = length / (length + shininess * (1.0 - length));
    let strength = (1.0 + share * shininess) / (1.0 + shininess);
    (specular * strength, share * shininess)
}

/// Normalises sums and lights them.
#[inline]
fn light(sums: &Sums, gloss: f32, view: Vec3, rig: &Rig) -> Vec3 {
    let per = 1.0 / sums[0].w;
    let (color, point) = (sums[1] * per, sums[2] * per);
    let mean = sums[0].truncate() * per;
    let length = mean.length();
    let normal = if length > 0.0 { mean / length } else { view };
    let (specular, shininess) = spread_highlight(length.min(1.0), color.w, gloss * per);
    rig.shade(&Point {
        normal: relief(normal, point.truncate(), point.w),
        view,
        color: color.truncate(),
        specular,
        shininess,
        softness: 0.5,
    })
}

/// Linear colour of a point on a tool.
fn lit_triangle(t: &LitTriangle, meshes: &[Mesh], view: Vec3, rig: &Rig) -> Vec3 {
    let mesh = &meshes[t.mesh];
    let normal = (t.normals[0] + t.normals[1] + t.normals[2]).normalize_or(view);
    rig.shade(&Point {
        normal: if normal.dot(view) < 0.0 {
            -normal
        } else {
            normal
        },
        view,
        color: mesh.color,
        specular: mesh.specular,
        shininess: mesh.shininess,
        softness: 0.0,
    })
}

/// Unit vector from a sample to the viewer, camera axes (right, up, towards the viewer).
#[inline]
fn view_direction(camera: &Camera, at: [usize; 2], settings: &RenderSettings) -> Vec3 {
    match camera.lens {
        Lens::Orthographic { .. } => Vec3::Z,
        Lens::Perspective { focal } => {
            let ss = settings.samples;
            let (w, h) = (
                single(f64::from(settings.width * ss)),
                single(f64::from(settings.height * ss)),
            );
            let per = 1.0 / (single(focal) * h);
            let [x, y] = at.map(|v| single(real(v)) + 0.5);
            Vec3::new((0.5 * w - x) * per, (y - 0.5 * h) * per, 1.0).normalize()
        }
    }
}

/// Triangles of all meshes on the screen by tile, and what lights them.
fn screen_triangles(
    meshes: &[Mesh],
    camera: &Camera,
    raster: &Raster,
) -> (Vec<Vec<(u32, ScreenTriangle)>>, Vec<LitTriangle>) {
    let mut tiles = vec![Vec::new(); raster.tiles[0] * raster.tiles[1]];
    let mut lit = Vec::new();
    let axes = camera.axes();
    for (m, mesh) in meshes.iter().enumerate() {
        let points: Vec<DVec3> = mesh
            .vertices
            .iter()
            .map(|&v| axes * (v - camera.eye))
            .collect();
        let face = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| points[index(i)]);
            (b - a).cross(c - a)
        };
        let mut smooth = vec![DVec3::ZERO; points.len()];
        if mesh.smooth {
            for t in &mesh.triangles {
                for &i in t {
                    smooth[index(i)] += face(t);
                }
            }
        }
        for t in &mesh.triangles {
            let Some(screen) = screen_triangle(t.map(|i| points[index(i)]), camera, raster) else {
                continue;
            };
            let flip = |n: DVec3| {
                let n = n.normalize_or_zero().as_vec3();
                Vec3::new(n.x, -n.y, -n.z)
            };
            let normals = t.map(|i| {
                flip(if mesh.smooth {
                    smooth[index(i)]
                } else {
                    face(t)
                })
            });
            let id = count(lit.len());
            lit.push(LitTriangle { normals, mesh: m });
            let [x0, y0, x1, y1] = screen.bounds.map(|b| usize::try_from(b).unwrap_or(0));
            for ty in y0 / TILE..y1.div_ceil(TILE) {
                for tx in x0 / TILE..x1.div_ceil(TILE) {
                    tiles[ty * raster.tiles[0] + tx].push((id, screen));
                }
            }
        }
    }
    (tiles, lit)
}

fn screen_triangle(p: [DVec3; 3], camera: &Camera, raster: &Raster) -> Option<ScreenTriangle> {
    let (w, h) = (real(raster.width), real(raster.height));
    if p.iter().any(|p| p.z <= 0.0 || p.z.is_nan()) {
        return None;
    }
    let q = p.map(|p| {
        let (scale, near) = match camera.lens {
            Lens::Perspective { focal } => (focal * h / p.z, 1.0 / p.z),
            Lens::Orthographic { height } => (h / height, -p.z),
        };
        DVec3::new(0.5 * w + scale * p.x, 0.5 * h + scale * p.y, near)
    });
    let area = (q[1] - q[0]).truncate().perp_dot((q[2] - q[0]).truncate());
    if area.abs() <= 1e-9 || area.is_nan() {
        return None;
    }
    let mut edges = [[0.0; 3]; 3];
    let mut near = [0.0; 3];
    for k in 0..3 {
        // Barycentric coordinate of vertex k, a linear function of the sample.
        let (a, b) = (q[(k + 1) % 3], q[(k + 2) % 3]);
        let e = [
            (a.x * b.y - a.y * b.x) / area,
            (a.y - b.y) / area,
            (b.x - a.x) / area,
        ];
        edges[k] = e.map(single);
        for (sum, value) in near.iter_mut().zip(e) {
            *sum += value * q[k].z;
        }
    }
    let low = q[0].min(q[1]).min(q[2]);
    let high = q[0].max(q[1]).max(q[2]);
    let clamp = |v: f64, end: usize| pixel(v).clamp(0, i32::try_from(end).unwrap_or(i32::MAX));
    let bounds = [
        clamp(low.x, raster.width),
        clamp(low.y, raster.height),
        clamp(high.x + 1.0, raster.width),
        clamp(high.y + 1.0, raster.height),
    ];
    (bounds[0] < bounds[2] && bounds[1] < bounds[3]).then_some(ScreenTriangle {
        edges,
        near: near.map(single),
        bounds,
    })
}
