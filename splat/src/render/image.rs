//! Images that colour a surface.

use crate::cast::{index, single};
use crate::error::ImageError;
use glam::{DVec3, Vec2, Vec3};
use std::io::{BufRead, Seek};

/// An image to be laid on surfaces: linear colours, at full size and halved again and again.
#[derive(Clone, PartialEq)]
pub struct Image {
    levels: Vec<ImageLevel>,
}

#[derive(Clone, PartialEq)]
struct ImageLevel {
    width: usize,
    height: usize,
    /// Row-major from the top.
    texels: Vec<Vec3>,
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (width, height) = self.size();
        write!(f, "Image({width} x {height})")
    }
}

impl Image {
    /// Reads a PNG of any kind: grey, palette or colour, 1 to 16 bits; alpha is dropped.
    ///
    /// # Errors
    /// [`ImageError::Decode`] if it is no PNG or is cut short, [`ImageError::Pixels`] if its decoder
    /// cannot give eight bits a channel, [`ImageError::Jpeg`] if it is one.
    pub fn read_png(mut input: impl BufRead + Seek) -> Result<Self, ImageError> {
        if input.fill_buf()?.starts_with(&[0xff, 0xd8]) {
            return Err(ImageError::Jpeg);
        }
        let mut decoder = png::Decoder::new(input);
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let mut reader = decoder.read_info()?;
        let (width, height) = reader.info().size();
        let (color, depth) = reader.output_color_type();
        let channels = color.samples();
        if depth != png::BitDepth::Eight {
            let bits = depth as u8;
            return Err(ImageError::Pixels { channels, bits });
        }
        let mut bytes = vec![0; channels * index(width) * index(height)];
        reader.next_frame(&mut bytes)?;
        let gray = channels < 3;
        let texel = |p: &[u8]| {
            let rgb = if gray { [p[0]; 3] } else { [p[0], p[1], p[2]] };
            rgb.map(|c| linear(f32::from(c) / 255.0)).into()
        };
        let texels = bytes.chunks_exact(channels).map(texel).collect();
        Ok(Self::of(index(width), index(height), texels))
    }

    fn of(width: usize, height: usize, texels: Vec<Vec3>) -> Self {
        let mut levels = vec![ImageLevel {
            width,
            height,
            texels,
        }];
        while let Some(half) = levels.last().and_then(ImageLevel::halved) {
            levels.push(half);
        }
        Self { levels }
    }

    /// Width and height (px).
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.levels[0].width, self.levels[0].height)
    }

    /// Linear colour at (u, v), the image repeated over the plane, u to the right and v down, 1 its
    /// whole width and height. Bilinear between texel centres of the level whose texels are about as
    /// large as `footprint`, the larger side of what is seen through a sample in units of the image.
    #[must_use]
    pub fn color(&self, at: Vec2, footprint: f32) -> Vec3 {
        let full = &self.levels[0];
        let texels = footprint * single(full.width.max(full.height) as f64);
        let level = texels.log2().round().max(0.0);
        #[allow(clippy::cast_possible_truncation, reason = "not negative; NaN gives 0")]
        let level = &self.levels[(level as usize).min(self.levels.len() - 1)];
        level.color(at)
    }
}

impl ImageLevel {
    /// Half the size, an odd last row or column joined with its neighbours; `None` for a single
    /// texel.
    fn halved(&self) -> Option<Self> {
        if self.width * self.height <= 1 {
            return None;
        }
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let rows = y * self.height / height..(y + 1) * self.height / height;
                let columns = x * self.width / width..(x + 1) * self.width / width;
                let count = single((rows.len() * columns.len()) as f64);
                let sum: Vec3 = rows
                    .flat_map(|row| columns.clone().map(move |column| (row, column)))
                    .map(|(row, column)| self.texels[row * self.width + column])
                    .sum();
                texels.push(sum / count);
            }
        }
        Some(Self {
            width,
            height,
            texels,
        })
    }

    fn color(&self, at: Vec2) -> Vec3 {
        let place = |at: f32, n: usize| {
            let size = single(n as f64);
            let x = (at - at.floor()) * size - 0.5;
            let low = x.floor();
            #[allow(clippy::cast_possible_truncation, reason = "within -1..n; NaN gives 0")]
            let wrapped = (low as isize).rem_euclid(n.cast_signed()).cast_unsigned();
            (wrapped, (wrapped + 1) % n, x - low)
        };
        let (x0, x1, fx) = place(at.x, self.width);
        let (y0, y1, fy) = place(at.y, self.height);
        let texel = |x: usize, y: usize| self.texels[y * self.width + x];
        let top = texel(x0, y0).lerp(texel(x1, y0), fx);
        let bottom = texel(x0, y1).lerp(texel(x1, y1), fx);
        top.lerp(bottom, fy)
    }
}

/// Linear light of an sRGB colour, channels from 0 to 1 (IEC 61966-2-1).
#[must_use]
pub fn linear_color(srgb: [f64; 3]) -> Vec3 {
    let channel = |c: f64| {
        if c <= 0.040_45 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    };
    DVec3::from_array(srgb.map(channel)).as_vec3()
}

/// Linear light of an sRGB channel in 0..=1 (IEC 61966-2-1).
pub(crate) fn linear(c: f32) -> f32 {
    if c <= 0.040_45 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

/// The projection of a box projection: the two rest coordinates across the axis that the rest normal is
/// nearest to, in repeats of an image `size` (m) wide; seen from outside, u runs to the right and v
/// down where z is up. Splats of different charts blend where they meet, so no seam is seen.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoxProjection {
    right: DVec3,
    down: DVec3,
}

impl BoxProjection {
    pub(crate) fn new(normal: DVec3, size: f64, aspect: f64) -> Self {
        let a = normal.abs();
        let (right, down) = if a.z >= a.x && a.z >= a.y {
            (DVec3::X, DVec3::NEG_Y * normal.z.signum())
        } else if a.x >= a.y {
            (DVec3::Y * normal.x.signum(), DVec3::NEG_Z)
        } else {
            (DVec3::NEG_X * normal.y.signum(), DVec3::NEG_Z)
        };
        Self {
            right: right / size,
            down: down * (aspect / size),
        }
    }

    pub(crate) fn at(&self, p: DVec3) -> Vec2 {
        Vec2::new(single(self.right.dot(p)), single(self.down.dot(p)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_met_at_their_centres_and_means_far_away() {
        let corners = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
        let image = Image::of(2, 2, corners.to_vec());
        for (k, &texel) in corners.iter().enumerate() {
            let at = Vec2::new([0.25, 0.75][k % 2], [0.25, 0.75][k / 2]);
            assert_eq!(image.color(at, 0.0), texel);
            let repeated = image.color(at + Vec2::new(3.0, -5.0), 0.0);
            assert_eq!(repeated, texel);
        }
        assert_eq!(image.color(Vec2::splat(0.5), 0.0), Vec3::splat(0.5));
        assert_eq!(image.color(Vec2::splat(0.1), 1.0), Vec3::splat(0.5));
        assert!(image.color(Vec2::NAN, f32::NAN).is_nan());
    }

    #[test]
    fn a_jpeg_is_told_by_its_name() {
        let error = Image::read_png(std::io::Cursor::new([0xff, 0xd8, 0xff, 0xe0]));
        let error = error.expect_err("it is no PNG").to_string();
        assert!(error.contains("JPEG"), "{error}");
    }

    #[test]
    fn halved_images_keep_their_mean() {
        let texels: Vec<Vec3> = (0..12).map(|k| Vec3::splat(k as f32)).collect();
        let image = Image::of(6, 2, texels);
        let sizes: Vec<_> = image.levels.iter().map(|l| (l.width, l.height)).collect();
        assert_eq!(sizes, [(6, 2), (3, 1), (1, 1)]);
        assert_eq!(image.color(Vec2::splat(0.4), 9.0), Vec3::splat(5.5));
    }
}
