//! Finished images, PNG and animated PNG.

use crate::cast::index;
use crate::error::ImageError;
use glam::Vec3;
use std::io::{BufRead, Seek, Write};

/// An image: 8-bit sRGB with alpha, rows from top to bottom, and the depth it was drawn with.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Width (px).
    pub width: u32,
    /// Height (px).
    pub height: u32,
    /// Pixels, row-major; alpha 255 where something was drawn or the background is opaque.
    pub pixels: Vec<[u8; 4]>,
    /// Distance along the view (m) of what is seen, infinite on the background; row-major. The
    /// nearest of a pixel's samples.
    pub depth: Vec<f32>,
    /// Unit normals that the splats were lit with, relief left out, camera axes (right, up, towards
    /// the viewer); zero elsewhere. Empty unless [`crate::RenderSettings::keep_normals`] is set.
    pub normals: Vec<Vec3>,
}

impl Frame {
    /// A black image, nothing in it.
    #[must_use]
    pub fn blank(width: u32, height: u32) -> Self {
        let area = index(width) * index(height);
        Self {
            width,
            height,
            pixels: vec![[0, 0, 0, 255]; area],
            depth: vec![f32::INFINITY; area],
            normals: Vec::new(),
        }
    }

    /// The image at half the size, each pixel the mean of four (of the encoded values; the nearest
    /// depth, no normals). An odd last row or column is dropped.
    #[must_use]
    pub fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let stride = index(self.width);
        let mut pixels = Vec::with_capacity(index(width) * index(height));
        let mut depth = Vec::with_capacity(index(width) * index(height));
        for y in 0..index(height) {
            for x in 0..index(width) {
                let corner = 2 * y * stride + 2 * x;
                let four = [corner, corner + 1, corner + stride, corner + stride + 1];
                pixels.push([0, 1, 2, 3].map(|channel| {
                    let sum: u16 = four.map(|at| self.pixels[at][channel].into()).iter().sum();
                    u8::try_from((sum + 2) / 4).unwrap_or(u8::MAX)
                }));
                let depths = four.map(|at| self.depth[at]).into_iter();
                depth.push(depths.fold(f32::INFINITY, f32::min));
            }
        }
        Self {
            width,
            height,
            pixels,
            depth,
            normals: Vec::new(),
        }
    }

    /// Reads an image that [`Frame::write_png`] wrote; it has no depth (infinite) and no normals.
    ///
    /// # Errors
    /// [`ImageError::Decode`] if it is no PNG or is cut short, [`ImageError::Pixels`] if it is not
    /// 8-bit RGBA.
    pub fn read_png(input: impl BufRead + Seek) -> Result<Self, ImageError> {
        let mut reader = png::Decoder::new(input).read_info()?;
        let (width, height) = reader.info().size();
        let (color, depth) = reader.output_color_type();
        if (color, depth) != (png::ColorType::Rgba, png::BitDepth::Eight) {
            let (channels, bits) = (color.samples(), depth as u8);
            return Err(ImageError::Pixels { channels, bits });
        }
        let mut bytes = vec![0; 4 * index(width) * index(height)];
        reader.next_frame(&mut bytes)?;
        let (pixels, _) = bytes.as_chunks::<4>();
        let pixels = pixels.to_vec();
        Ok(Self {
            pixels,
            ..Self::blank(width, height)
        })
    }

    /// Writes the image as PNG.
    ///
    /// # Errors
    /// [`ImageError::Encode`] if the writer fails.
    pub fn write_png(&self, out: impl Write) -> Result<(), ImageError> {
        let mut encoder = png::Encoder::new(out, self.width, self.height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(())
    }
}

/// An animated PNG in the making; frames are written as they come, none is kept.
pub struct Animation<W: Write>(png::Writer<W>);

impl<W: Write> std::fmt::Debug for Animation<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Animation").finish_non_exhaustive()
    }
}

impl<W: Write> Animation<W> {
    /// Starts an animation of exactly `frames` frames that loops for ever.
    ///
    /// # Errors
    /// [`ImageError::Encode`] if the writer fails or a size or the count is zero.
    pub fn new(
        out: W,
        width: u32,
        height: u32,
        frames: u32,
        frames_per_second: u16,
    ) -> Result<Self, ImageError> {
        let mut encoder = png::Encoder::new(out, width, height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        encoder.set_animated(frames, 0)?;
        encoder.set_frame_delay(1, frames_per_second)?;
        encoder.validate_sequence(true);
        Ok(Self(encoder.write_header()?))
    }

    /// Adds the next frame.
    ///
    /// # Errors
    /// [`ImageError::Encode`] if the frame has another number of pixels, there are more frames than announced, or the
    /// writer fails.
    pub fn add(&mut self, frame: &Frame) -> Result<(), ImageError> {
        Ok(self.0.write_image_data(frame.pixels.as_flattened())?)
    }

    /// Ends the file.
    ///
    /// # Errors
    /// [`ImageError::Encode`] if frames are missing or the writer fails.
    pub fn finish(self) -> Result<(), ImageError> {
        Ok(self.0.finish()?)
    }
}
