//! Third pass: the sums of a tile's samples are normalised, lit, averaged and encoded.

use crate::cast::{index, single};
use crate::render::{
    Appearance, Camera, DrawMode, DrawnMesh, LANES, Lens, Lights, Point, Points, Projected,
    RenderSettings, SampleSums, TILE, TileBuffers, Transfer, relief, sqrt, tone, tones,
};
use glam::{Mat4, Vec3, Vec4};

/// Softness of tissue, see [`Point`].
const SOFT: f32 = 0.5;

/// Finished pixels of one tile.
#[derive(Debug, Clone, Default)]
pub(crate) struct TilePixels {
    pub(crate) color: Vec<[u8; 4]>,
    pub(crate) depth: Vec<f32>,
    pub(crate) normals: Vec<Vec3>,
}

/// A triangle in the camera frame, for lighting.
pub(crate) struct LitTriangle {
    /// Mean of its corners' normals, of unit length; zero where they cancel.
    pub(crate) normal: Vec3,
    pub(crate) mesh: usize,
}

/// What lights samples, the same for all tiles.
pub(crate) struct Shader<'a> {
    pub(crate) settings: &'a RenderSettings,
    pub(crate) transfer: &'a Transfer,
    pub(crate) camera: &'a Camera,
    pub(crate) lights: &'a Lights,
    pub(crate) lit: &'a [LitTriangle],
    pub(crate) meshes: &'a [DrawnMesh],
}

/// Sums that wait to be lit.
#[derive(Clone, Copy)]
struct Waiting {
    sums: SampleSums,
    gloss: f32,
    softness: f32,
    view: Vec3,
    /// Pixel of the tile, and how much of it.
    pixel: usize,
    part: f32,
}

/// As many as there are lanes, at most.
struct Queue {
    len: usize,
    waiting: [Waiting; LANES],
}

/// A pixel whose samples are to be lit.
struct Pixel<S> {
    /// Which of the tile's pixels.
    index: usize,
    samples: S,
    /// Unit vector to the viewer.
    view: Vec3,
    background: Vec3,
}

impl Shader<'_> {
    fn side(&self) -> usize {
        TILE / index(self.settings.samples)
    }

    /// A tile that shows nothing but the background.
    pub(crate) fn fill(&self, top: usize, pixels: &mut TilePixels) {
        let side = self.side();
        pixels.color.resize(side * side, [0; 4]);
        pixels.depth.clear();
        pixels.depth.resize(side * side, f32::INFINITY);
        pixels.normals.clear();
        if self.settings.keep_normals {
            pixels.normals.resize(side * side, Vec3::ZERO);
        }
        for (py, row) in pixels.color.chunks_exact_mut(side).enumerate() {
            let at = top + py * index(self.settings.samples);
            let [r, g, b] = self.transfer.encode(self.background(at));
            row.fill([r, g, b, 255]);
        }
    }

    /// The background's colour in a row of samples.
    fn background(&self, row: usize) -> Vec3 {
        let height = index(self.settings.height) * index(self.settings.samples);
        let down = single(row as f64) / single(height as f64);
        let background = &self.settings.background;
        background.top.lerp(background.bottom, down.min(1.0))
    }

    /// Finishes the tile whose first sample is at `origin`.
    ///
    /// Samples of one smooth surface are averaged before they are lit, others lit one by one.
    pub(crate) fn finish(
        &self,
        buffers: &TileBuffers,
        origin: [usize; 2],
        pixels: &mut TilePixels,
    ) {
        let ss = index(self.settings.samples);
        let side = self.side();
        self.fill(origin[1], pixels);
        if self.settings.keep_normals {
            self.keep_normals(buffers, pixels);
        }
        let mut colors = [Vec3::ZERO; TILE * TILE];
        let mut queue = Queue::new();
        let in_pixel: Vec<usize> = (0..ss * ss).map(|s| s / ss * TILE + s % ss).collect();
        for py in 0..side {
            let background = self.background(origin[1] + py * ss);
            for px in 0..side {
                let first = py * ss * TILE + px * ss;
                let samples = in_pixel.iter().map(|at| first + at);
                let near = samples.clone().map(|k| buffers.near()[k]);
                let nearest = near.fold(f32::NEG_INFINITY, f32::max);
                if nearest == f32::NEG_INFINITY {
                    continue;
                }
                let pixel = Pixel {
                    index: py * side + px,
                    samples,
                    view: self.view_direction([origin[0] + px * ss, origin[1] + py * ss]),
                    background,
                };
                pixels.depth[pixel.index] = match self.camera.lens {
                    Lens::Perspective { .. } => 1.0 / nearest,
                    Lens::Orthographic { .. } => -nearest,
                };
                self.light(buffers, pixel, &mut queue, &mut colors);
            }
        }
        self.flush(&mut queue, &mut colors);
        let seen = pixels.depth.iter().zip(&mut pixels.color).zip(&colors);
        for ((depth, pixel), &color) in seen {
            if depth.is_finite() {
                let [r, g, b] = self.transfer.encode(color);
                *pixel = [r, g, b, 255];
            }
        }
    }

    /// Queues the samples of a pixel to be lit: their mean if they are of one smooth surface.
    fn light(
        &self,
        buffers: &TileBuffers,
        pixel: Pixel<impl Iterator<Item = usize> + Clone>,
        queue: &mut Queue,
        colors: &mut [Vec3],
    ) {
        let (index, view) = (pixel.index, pixel.view);
        let part = 1.0 / single(f64::from(self.settings.samples.pow(2)));
        let (mut splatted, mut alike) = (0.0, true);
        let splat = |sums: SampleSums, gloss: f32, part: f32| Waiting {
            sums,
            gloss,
            softness: SOFT,
            view,
            pixel: index,
            part,
        };
        let mut mean = splat([Vec4::ZERO; 3], 0.0, 0.0);
        // The triangle seen last, and how much of the pixel shows it.
        let mut seen = (0, 0.0);
        let is_over = self.settings.mode == DrawMode::SinglePass;
        for k in pixel.samples.clone() {
            let (triangle, s) = (buffers.triangle()[k], &buffers.sums()[k]);
            let mut left = part;
            if is_over {
                colors[index] += s[1].truncate() * part;
                left *= 1.0 - s[1].w;
            }
            if triangle > 0 {
                if triangle != seen.0 {
                    self.push_triangle(queue, seen, (index, view), colors);
                    seen = (triangle, 0.0);
                }
                seen.1 += left;
            } else if is_over || buffers.near()[k] == f32::NEG_INFINITY {
                colors[index] += pixel.background * left;
            } else {
                let per = 1.0 / s[0].w;
                if splatted > 0.0 {
                    let cosine = s[0].truncate().dot(mean.sums[0].truncate()) * per;
                    alike &= cosine > 0.9 * splatted;
                }
                for (m, s) in mean.sums.iter_mut().zip(s) {
                    *m += *s * per;
                }
                mean.gloss += buffers.gloss()[k] * per;
                mean.part += part;
                splatted += 1.0;
            }
        }
        self.push_triangle(queue, seen, (index, view), colors);
        if splatted > 0.0 && alike {
            self.push(queue, mean, colors);
        } else if splatted > 0.0 {
            for k in pixel.samples {
                if buffers.near()[k] > f32::NEG_INFINITY && buffers.triangle()[k] == 0 {
                    let one = splat(buffers.sums()[k], buffers.gloss()[k], part);
                    self.push(queue, one, colors);
                }
            }
        }
    }

    fn keep_normals(&self, buffers: &TileBuffers, pixels: &mut TilePixels) {
        let (ss, side) = (index(self.settings.samples), self.side());
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

    /// Queues a triangle that a pixel shows, numbers from 1 on, and how much of the pixel does.
    fn push_triangle(
        &self,
        queue: &mut Queue,
        (triangle, part): (u32, f32),
        (pixel, view): (usize, Vec3),
        colors: &mut [Vec3],
    ) {
        let Some(lit) = triangle.checked_sub(1) else {
            return;
        };
        let lit = &self.lit[index(lit)];
        let mesh = &self.meshes[lit.mesh];
        let known = lit.normal != Vec3::ZERO;
        let normal = if known { lit.normal } else { view };
        let side = if normal.dot(view) < 0.0 { -1.0 } else { 1.0 };
        let color = mesh.color.extend(mesh.specular);
        let waiting = Waiting {
            sums: [(normal * side).extend(1.0), color, Vec4::ZERO],
            gloss: mesh.shininess,
            softness: 0.0,
            view,
            pixel,
            part,
        };
        self.push(queue, waiting, colors);
    }

    /// Queues what is to be lit; lights what waits where the queue is full.
    #[inline]
    fn push(&self, queue: &mut Queue, waiting: Waiting, colors: &mut [Vec3]) {
        queue.waiting[queue.len] = waiting;
        queue.len += 1;
        if queue.len == LANES {
            self.flush(queue, colors);
        }
    }

    /// Lights what is in the queue: each lane adds to its pixel.
    fn flush(&self, queue: &mut Queue, colors: &mut [Vec3]) {
        let colored = tones(self.lights.shade(&queue.points()));
        let colored = colored.map(|channel| channel.to_array());
        for (lane, one) in queue.waiting[..queue.len].iter().enumerate() {
            colors[one.pixel] += Vec3::from_array(colored.map(|channel| channel[lane])) * one.part;
        }
        queue.len = 0;
    }

    /// The one colour of a splat that is lit as a whole.
    #[allow(clippy::cast_possible_truncation, reason = "on the screen")]
    pub(crate) fn tone(&self, p: &Projected, appearance: &Appearance) -> Vec3 {
        let at = [p.x.max(0.0) as usize, p.y.max(0.0) as usize];
        tone(self.lights.shade_one(&Point {
            normal: appearance.normal.truncate(),
            view: self.view_direction(at),
            color: appearance.contribution.color.truncate(),
            specular: appearance.contribution.color.w,
            shininess: appearance.contribution.shininess,
            softness: SOFT,
        }))
    }

    /// Unit vector from a sample to the viewer, camera axes (right, up, towards the viewer).
    #[inline]
    fn view_direction(&self, at: [usize; 2]) -> Vec3 {
        match self.camera.lens {
            Lens::Orthographic { .. } => Vec3::Z,
            Lens::Perspective { focal } => {
                let ss = self.settings.samples;
                let (w, h) = (
                    single(f64::from(self.settings.width * ss)),
                    single(f64::from(self.settings.height * ss)),
                );
                let per = 1.0 / (single(focal) * h);
                let [x, y] = at.map(|v| single(v as f64) + 0.5);
                Vec3::new((0.5 * w - x) * per, (y - 0.5 * h) * per, 1.0).normalize()
            }
        }
    }
}

impl Queue {
    fn new() -> Self {
        let nothing = Waiting {
            sums: [Vec4::W; 3],
            gloss: 0.0,
            softness: 0.0,
            view: Vec3::Z,
            pixel: 0,
            part: 0.0,
        };
        Self {
            len: 0,
            waiting: [nothing; LANES],
        }
    }

    /// The queued sums, normalised.
    fn points(&self) -> Points {
        let lanes = |part: usize| {
            let [a, b, c, d] = self.waiting.each_ref().map(|one| one.sums[part]);
            Mat4::from_cols(a, b, c, d).transpose()
        };
        let [normal, color, point] = [lanes(0), lanes(1), lanes(2)];
        let per = normal.w_axis.recip();
        let of = |number: &dyn Fn(&Waiting) -> f32| {
            Vec4::from_array(self.waiting.each_ref().map(number))
        };
        let view = [0, 1, 2].map(|k| of(&|one| one.view[k]));
        let mean = [normal.x_axis, normal.y_axis, normal.z_axis].map(|n| n * per);
        let length = sqrt(mean[0] * mean[0] + mean[1] * mean[1] + mean[2] * mean[2]);
        let known = length.cmpgt(Vec4::ZERO);
        let normal = [0, 1, 2].map(|k| Vec4::select(known, mean[k] / length, view[k]));
        let (specular, shininess) = spread_highlight(
            length.min(Vec4::ONE),
            color.w_axis * per,
            of(&|one| one.gloss) * per,
        );
        let at = [point.x_axis, point.y_axis, point.z_axis].map(|p| p * per);
        Points {
            normal: relief(normal, at, point.w_axis * per),
            view,
            color: [color.x_axis, color.y_axis, color.z_axis].map(|c| c * per),
            specular,
            shininess,
            softness: of(&|one| one.softness),
        }
    }
}

/// Strength and exponent of the highlight where unit normals differ and their mean is shorter than 1
/// (Toksvig 2005): without it the two sides of an edge, blended, shine as a third face between them.
#[inline]
fn spread_highlight(length: Vec4, specular: Vec4, shininess: Vec4) -> (Vec4, Vec4) {
    let share = length / (length + shininess * (Vec4::ONE - length));
    let strength = (Vec4::ONE + share * shininess) / (Vec4::ONE + shininess);
    (specular * strength, share * shininess)
}
