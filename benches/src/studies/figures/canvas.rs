//! Pictures of fields over a square, and of triangles and lines in space.

use glam::{DVec2, DVec3};
use phyxel_splat::Frame;

const PIXELS: usize = 360;

/// Figure and name of a picture, its field, the range of its colours and the number of its levels.
pub(crate) struct Plot<'a>(
    pub(crate) (u32, &'a str),
    pub(crate) &'a dyn Fn(DVec2) -> f64,
    pub(crate) [f64; 2],
    pub(crate) u32,
);

/// A square picture, rows from the top.
pub(crate) struct Image {
    pixels: Vec<[f64; 3]>,
    depths: Vec<f64>,
}

impl Image {
    pub(crate) fn new() -> Self {
        Self {
            // Dark enough for white captions, light enough for black lines.
            pixels: vec![[126.0, 134.0, 142.0]; PIXELS * PIXELS],
            depths: vec![f64::NEG_INFINITY; PIXELS * PIXELS],
        }
    }

    /// The unit square (y up) in colours (0 to 255).
    pub(crate) fn painted(colour: impl Fn(DVec2) -> [f64; 3]) -> Self {
        let mut image = Self::new();
        for (k, pixel) in image.pixels.iter_mut().enumerate() {
            let at = |n: usize| (n as f64 + 0.5) / PIXELS as f64;
            *pixel = colour(DVec2::new(at(k % PIXELS), 1.0 - at(k / PIXELS)));
        }
        image
    }

    pub(crate) fn frame(&self) -> Frame {
        let mut frame = Frame::blank(PIXELS as u32, PIXELS as u32);
        for (pixel, colour) in frame.pixels.iter_mut().zip(&self.pixels) {
            let [r, g, b] = colour.map(|c| c as u8);
            *pixel = [r, g, b, 255];
        }
        frame
    }

    /// Sets a pixel unless something nearer is there.
    fn put(&mut self, column: f64, row: f64, depth: f64, colour: [f64; 3]) {
        let side = PIXELS as f64;
        if (0.0..side).contains(&column) && (0.0..side).contains(&row) {
            let k = row as usize * PIXELS + column as usize;
            if depth >= self.depths[k] {
                self.pixels[k] = colour;
                self.depths[k] = depth;
            }
        }
    }

    /// A field over the unit square (y up) by colour, with level lines.
    pub(crate) fn field(&mut self, field: impl Fn(DVec2) -> f64, range: [f64; 2], levels: u32) {
        let step = 1.0 / PIXELS as f64;
        let share = |p: DVec2| ((field(p) - range[0]) / (range[1] - range[0])).clamp(0.0, 1.0);
        let band = |v: f64| (v * f64::from(levels)).floor();
        for row in 0..PIXELS {
            for column in 0..PIXELS {
                let p = DVec2::new(column as f64 + 0.5, (PIXELS - row) as f64 - 0.5) * step;
                let value = share(p);
                let mut colour = hue(value);
                let next = [p + DVec2::X * step, p + DVec2::Y * step];
                let on_line = |&q: &DVec2| (band(share(q)) - band(value)).abs() > 0.5;
                if levels > 0 && next.iter().any(on_line) {
                    colour = colour.map(|c| 0.6 * c);
                }
                self.pixels[row * PIXELS + column] = colour;
            }
        }
    }

    /// A polyline over the unit square (y up).
    pub(crate) fn polyline(&mut self, line: &[DVec2], colour: [f64; 3]) {
        let place = |p: DVec2| DVec3::new(p.x, 1.0 - p.y, 1.0) * PIXELS as f64;
        for w in line.windows(2) {
            self.stroke(place(w[0]), place(w[1]), colour);
        }
    }

    /// A line in pixels, with its depth.
    fn stroke(&mut self, from: DVec3, to: DVec3, colour: [f64; 3]) {
        let steps = (2.0 * (to - from).truncate().length()).ceil().max(1.0);
        for k in 0..=steps as usize {
            let p = from.lerp(to, k as f64 / steps);
            for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                self.put(p.x + x - 0.5, p.y + y - 0.5, p.z, colour);
            }
        }
    }

    /// A polyline with an arrow head of the given size over the unit square.
    pub(crate) fn arrow(&mut self, from: DVec2, to: DVec2, colour: [f64; 3]) {
        let back = (from - to).normalize() * 0.03;
        let side = back.perp() * 0.6;
        self.polyline(&[from, to], colour);
        self.polyline(&[to + back + side, to, to + back - side], colour);
    }
}

/// Blue at 0, white at a half, red at 1.
pub(crate) fn hue(value: f64) -> [f64; 3] {
    if value < 0.5 {
        let t = 2.0 * value.max(0.0);
        [60.0 + 195.0 * t, 90.0 + 165.0 * t, 180.0 + 75.0 * t]
    } else {
        let t = 2.0 - 2.0 * value.min(1.0);
        [180.0 + 75.0 * t, 50.0 + 205.0 * t, 60.0 + 195.0 * t]
    }
}

/// A colour for each of a few regions.
pub(crate) fn region_colour(region: u32) -> [f64; 3] {
    let turn = 0.618_034 * f64::from(region);
    [0.0, 0.33, 0.66]
        .map(|shift: f64| 150.0 + 90.0 * (std::f64::consts::TAU * (turn + shift)).cos())
}

/// What a picture's side spans: the diagonal of the unit cube, and a margin.
const WIDTH: f64 = 1.8;

/// Looks at the unit cube from the upper front, without perspective; z is up.
pub(crate) struct View {
    right: DVec3,
    up: DVec3,
    toward: DVec3,
}

impl View {
    /// From a direction (out of the picture).
    pub(crate) fn from(toward: DVec3) -> Self {
        let toward = toward.normalize();
        let right = DVec3::Z.cross(toward).normalize();
        Self {
            right,
            up: toward.cross(right),
            toward,
        }
    }

    /// Unit vector out of the picture.
    pub(crate) fn toward(&self) -> DVec3 {
        self.toward
    }

    /// Column, row and depth (larger is nearer).
    fn place(&self, p: DVec3) -> DVec3 {
        let q = p - DVec3::splat(0.5);
        let side = PIXELS as f64;
        DVec3::new(
            side * (0.5 + q.dot(self.right) / WIDTH),
            side * (0.5 - q.dot(self.up) / WIDTH),
            q.dot(self.toward),
        )
    }

    pub(crate) fn line(&self, image: &mut Image, from: DVec3, to: DVec3, colour: [f64; 3]) {
        // A little nearer than the surface that it lies on.
        let lift = DVec3::Z * 0.004;
        image.stroke(self.place(from) + lift, self.place(to) + lift, colour);
    }

    pub(crate) fn arrow(&self, image: &mut Image, from: DVec3, to: DVec3, colour: [f64; 3]) {
        let back = (from - to) * 0.25;
        let side = self.toward.cross(back) * 0.5;
        self.line(image, from, to, colour);
        self.line(image, to + back + side, to, colour);
        self.line(image, to + back - side, to, colour);
    }

    /// The edges of the unit cube.
    pub(crate) fn frame(&self, image: &mut Image) {
        for k in 0..12 {
            let (axis, corner) = (k % 3, k / 3);
            let mut from = [0.0; 3];
            from[(axis + 1) % 3] = (corner % 2) as f64;
            from[(axis + 2) % 3] = (corner / 2) as f64;
            let mut to = from;
            to[axis] = 1.0;
            self.line(image, from.into(), to.into(), [190.0; 3]);
        }
    }

    /// A triangle, lighter where it faces the viewer.
    pub(crate) fn triangle(&self, image: &mut Image, corners: [DVec3; 3], colour: [f64; 3]) {
        let normal = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .normalize_or_zero();
        let light = 0.55 + 0.45 * normal.dot(self.toward).abs();
        let [p, q, r] = corners.map(|c| self.place(c));
        let area = (q - p).truncate().perp_dot((r - p).truncate());
        let (low, high) = (p.min(q).min(r).floor(), p.max(q).max(r).ceil());
        let mut y = low.y;
        while y <= high.y && area.abs() > 0.0 {
            let mut x = low.x;
            while x <= high.x {
                let at = DVec2::new(x + 0.5, y + 0.5);
                let share =
                    |a: DVec3, b: DVec3| (b.truncate() - a.truncate()).perp_dot(at - a.truncate());
                let (u, v) = (share(p, q) / area, share(r, p) / area);
                if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
                    let depth = p.z + v * (q.z - p.z) + u * (r.z - p.z);
                    image.put(x, y, depth, colour.map(|c| c * light));
                }
                x += 1.0;
            }
            y += 1.0;
        }
    }

    /// The surface on which a field over the unit cube has a value, found along each pixel's ray.
    pub(crate) fn level_set(
        &self,
        image: &mut Image,
        field: impl Fn(DVec3) -> f64,
        level: f64,
        colour: [f64; 3],
    ) {
        const STEPS: usize = 160;
        let inside = |p: DVec3| p.cmpge(DVec3::ZERO).all() && p.cmple(DVec3::ONE).all();
        for k in 0..PIXELS * PIXELS {
            let (x, y) = ((k % PIXELS) as f64 + 0.5, (k / PIXELS) as f64 + 0.5);
            let side = PIXELS as f64;
            let start = DVec3::splat(0.5)
                + WIDTH * ((x / side - 0.5) * self.right + (0.5 - y / side) * self.up);
            let at = |step: usize| start + self.toward * (0.9 - 1.8 * step as f64 / STEPS as f64);
            let mut before: Option<f64> = None;
            for step in 0..STEPS {
                let p = at(step);
                if !inside(p) {
                    before = None;
                    continue;
                }
                let value = field(p) - level;
                if before.is_some_and(|b| (b > 0.0) != (value > 0.0)) {
                    let d = 1e-3;
                    let slope = DVec3::from(
                        [DVec3::X, DVec3::Y, DVec3::Z].map(|e| field(p + d * e) - field(p - d * e)),
                    );
                    let light = 0.4 + 0.6 * slope.normalize_or_zero().dot(self.toward).abs();
                    let depth = self.place(p).z;
                    image.put(x, y, depth, colour.map(|c| c * light));
                    break;
                }
                before = Some(value);
            }
        }
    }
}
