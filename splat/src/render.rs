//! The renderer: tiles in parallel, bitwise identical at any thread count.

mod camera;
mod clip;
mod frame;
mod image;
mod legend;
mod merged;
mod mesh;
mod noise;
mod project;
mod raster;
mod resolve;
mod scene;
mod shade;
mod splats;
mod surfels;
mod view;

pub use camera::{Camera, Lens};
pub use clip::Clip;
pub use frame::{Animation, Frame};
use image::{BoxProjection, linear};
pub use image::{Image, linear_color};
pub use legend::{ColorScale, Overlay};
pub use merged::MergedSplats;
pub use mesh::DrawnMesh;
use noise::slope_noise;
pub(crate) use noise::{fractal_noise, gradient_noise};
use project::{Appearance, Chunk, Contribution, Facing, Projected, Raster, TILE, Wall, project};
use raster::{
    ImagePatch, SampleSums, ScreenTriangle, TileBuffers, blend_near, blend_splats, draw_triangles,
    fill_gaps, find_surface,
};
use resolve::{LitTriangle, Shader, TilePixels};
pub use scene::{
    Background, DrawMode, ImageCoat, Light, Lighting, RenderSettings, SplatView, Surface,
};
use shade::{LANES, Lights, Point, Points, Transfer, relief, sqrt, tone, tones};
pub use splats::Splat;
pub use surfels::{Surfel, TexturePlace};
pub use view::View;

use crate::cast::{count, index, single};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Cosine between the line of sight and the normal of a splat that is seen from behind, but for those near an outline.
const AWAY: f64 = 0.3;

/// Draws frames; keeps tables and buffers between frames.
///
/// # Examples
/// ```
/// use phyxel_splat::glam::{DVec3, Vec3};
/// use phyxel_splat::{Camera, RenderSettings, Renderer, Splat, SplatView, Surfel};
///
/// // A flat patch of 20 x 20 points, 1 cm apart, seen from above.
/// let points: Vec<DVec3> = (0..400)
///     .map(|i| DVec3::new(f64::from(i % 20), f64::from(i / 20), 0.0) * 0.01)
///     .collect();
/// let surfels = Surfel::covering(&points, &[DVec3::Z; 400])?;
/// let splats: Vec<Splat> = surfels.iter().map(Surfel::at_rest).collect();
/// let colors = [Vec3::new(0.5, 0.1, 0.1); 400];
/// let settings = RenderSettings { width: 160, height: 120, ..RenderSettings::default() };
/// let camera = Camera::around(&points, DVec3::NEG_Z, 160.0 / 120.0);
/// let view = SplatView::new(&splats, &surfels, &colors);
/// let frame = Renderer::new(settings).draw(&view, &[], &camera);
/// assert!(frame.depth[160 * 60 + 80].is_finite()); // the middle shows the patch
/// # Ok::<(), phyxel_splat::SurfelError>(())
/// ```
#[derive(Debug)]
pub struct Renderer {
    settings: RenderSettings,
    transfer: Transfer,
    tiles: Vec<TilePixels>,
    chunks: Vec<Chunk>,
    behind: Vec<Chunk>,
}

impl Renderer {
    /// A renderer for images as set.
    ///
    /// # Panics
    /// If the image has no pixels or more than 16,384 to a side, or `samples` is not 1, 2 or 4.
    #[must_use]
    pub fn new(settings: RenderSettings) -> Self {
        let sides = [settings.width, settings.height];
        let fits = sides.iter().all(|side| (1..=16_384).contains(side));
        assert!(fits, "an image has 1 to 16384 pixels to a side");
        let samples = matches!(settings.samples, 1 | 2 | 4);
        assert!(samples, "1, 2 or 4 samples per pixel and axis");
        Self {
            settings,
            transfer: Transfer::new(),
            tiles: Vec::new(),
            chunks: Vec::new(),
            behind: Vec::new(),
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
    pub fn draw(&mut self, view: &SplatView<'_>, meshes: &[DrawnMesh], camera: &Camera) -> Frame {
        assert!(view.is_whole(), "one surfel, colour and clip per splat");
        let Self {
            settings,
            transfer,
            tiles,
            chunks,
            behind,
        } = self;
        let raster = Raster::new(settings);
        let contribution = |i: usize| contribution(settings, view, i);
        let project = |facing: Facing, chunks: &mut Vec<Chunk>| {
            project(view, camera, &raster, facing, &contribution, chunks);
        };
        project(|cosine| cosine < 0.0, chunks);
        let inside = view.inside.filter(|_| raster.mode == DrawMode::ThreePass);
        match inside {
            Some(_) => project(|cosine| cosine > AWAY, behind),
            None => behind.clear(),
        }
        let (triangles, lit) = screen_triangles(meshes, camera, &raster);
        let shader = Shader {
            settings,
            transfer,
            camera,
            lights: &Lights::new(&settings.lighting),
            lit: &lit,
            meshes,
        };
        tiles.resize_with(raster.tiles[0] * raster.tiles[1], TilePixels::default);
        let coated = settings.surfaces.iter().any(|s| s.coat.is_some());
        let patch = |splat: u32| patch(settings, &view.surfels[index(splat)], coated);
        tiles.par_iter_mut().enumerate().for_each_init(
            TileBuffers::new,
            |buffers, (tile, pixels)| {
                let origin = [tile % raster.tiles[0] * TILE, tile / raster.tiles[0] * TILE];
                let from = origin.map(|o| i32::try_from(o).unwrap_or(i32::MAX));
                let mut all = chunks.iter().chain(&*behind);
                if triangles[tile].is_empty() && all.all(|c| c.is_empty_in(tile)) {
                    shader.fill(origin[1], pixels);
                    return;
                }
                buffers.clear();
                draw_triangles(&triangles[tile], from, buffers);
                if raster.mode == DrawMode::SinglePass {
                    let tone = |p: &Projected, appearance: &Appearance| shader.tone(p, appearance);
                    blend_splats(chunks, tile, from, &tone, buffers);
                } else {
                    find_surface(chunks, tile, from, buffers);
                    blend_near(chunks, tile, from, &patch, buffers);
                }
                if let Some(inside) = inside {
                    fill_gaps(behind, tile, from, inside, buffers);
                }
                shader.finish(buffers, origin, pixels);
            },
        );
        assemble(settings, tiles, raster.tiles[0])
    }
}

/// What a splat adds to the samples it is blended into.
fn contribution(settings: &RenderSettings, view: &SplatView<'_>, splat: usize) -> Contribution {
    let surfel = &view.surfels[splat];
    let s = settings.surface(surfel.material);
    let cells = f64::from(s.relief_frequency);
    let point = (surfel.position * cells).as_vec3();
    Contribution {
        color: view.colors[splat].extend(s.specular),
        point: point.extend(s.relief),
        along: (surfel.axes()).map(|axis| (axis * cells).as_vec3().extend(0.0)),
        shininess: s.shininess,
    }
}

/// The image on a splat, if any.
fn patch<'a>(
    settings: &'a RenderSettings,
    surfel: &Surfel,
    coated: bool,
) -> Option<ImagePatch<'a>> {
    if let Some(place) = surfel.place
        && let Some(image) = settings.images.get(usize::from(place.image))
    {
        let radius = single(surfel.radius);
        return Some(ImagePatch {
            image,
            at: place.at,
            along: place.along.map(|along| along * radius),
        });
    }
    let surface = coated.then(|| settings.surface(surfel.material))?;
    let coat = surface.coat.as_ref()?;
    let (width, height) = coat.image.size();
    let aspect = width as f64 / height as f64;
    let projection = BoxProjection::new(surfel.normal, coat.size, aspect);
    Some(ImagePatch {
        image: &coat.image,
        at: projection.at(surfel.position),
        along: surfel.axes().map(|axis| projection.at(axis)),
    })
}

fn assemble(settings: &RenderSettings, tiles: &[TilePixels], tiles_per_row: usize) -> Frame {
    let side = TILE / index(settings.samples);
    let (w, h) = (index(settings.width), index(settings.height));
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
    if settings.keep_normals {
        normals.resize(w * h, Vec3::ZERO);
        for (k, normal) in normals.iter_mut().enumerate() {
            let (x, y) = (k % w, k / w);
            let tile = &tiles[y / side * tiles_per_row + x / side];
            *normal = tile.normals[y % side * side + x % side];
        }
    }
    Frame {
        width: settings.width,
        height: settings.height,
        pixels,
        depth,
        normals,
    }
}

/// Triangles of all meshes on the screen by tile, and what lights them.
fn screen_triangles(
    meshes: &[DrawnMesh],
    camera: &Camera,
    raster: &Raster,
) -> (Vec<Vec<(u32, ScreenTriangle)>>, Vec<LitTriangle>) {
    let mut tiles = vec![Vec::new(); raster.tiles[0] * raster.tiles[1]];
    let mut lit = Vec::new();
    let axes = camera.axes();
    for (m, mesh) in meshes.iter().enumerate() {
        let seen = |&v: &DVec3| axes * (v - camera.eye);
        let points: Vec<DVec3> = mesh.vertices.iter().map(seen).collect();
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
            let [a, b, c] = t.map(|i| {
                let n = if mesh.smooth {
                    smooth[index(i)]
                } else {
                    face(t)
                };
                let n = n.normalize_or_zero().as_vec3();
                Vec3::new(n.x, -n.y, -n.z)
            });
            let id = count(lit.len());
            let normal = (a + b + c).normalize_or_zero();
            lit.push(LitTriangle { normal, mesh: m });
            raster.for_tiles(screen.bounds, |tile| {
                if screen.meets([tile % raster.tiles[0], tile / raster.tiles[0]]) {
                    tiles[tile].push((id, screen));
                }
            });
        }
    }
    (tiles, lit)
}

fn screen_triangle(p: [DVec3; 3], camera: &Camera, raster: &Raster) -> Option<ScreenTriangle> {
    let (w, h) = (raster.width as f64, raster.height as f64);
    if p.iter().any(|p| p.z <= 0.0 || p.z.is_nan()) {
        return None;
    }
    let q = p.map(|p| {
        let near = match camera.lens {
            Lens::Perspective { .. } => 1.0 / p.z,
            Lens::Orthographic { .. } => -p.z,
        };
        let scale = camera.lens.scale(h, p.z);
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
    Some(ScreenTriangle {
        edges,
        near: near.map(single),
        bounds: raster.bounds([[low.x, low.y], [high.x + 1.0, high.y + 1.0]])?,
    })
}
