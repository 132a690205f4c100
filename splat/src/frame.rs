//! Finished images, PNG and animated PNG.

use crate::error::ImageError;
use glam::Vec3;
use std::io::Write;

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
pub struct Animation<W: Write> {
    writer: png::Writer<W>,
    size: (u32, u32),
    announced: u32,
    added: u32,
}

impl<W: Write> std::fmt::Debug for Animation<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Animation")
            .field("size", &self.size)
            .field("announced", &self.announced)
            .field("added", &self.added)
            .finish_non_exhaustive()
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
        encoder.set_animated(frames, 0)?;
        encoder.set_frame_delay(1, frames_per_second)?;
        Ok(Self {
            writer: encoder.write_header()?,
            size: (width, height),
            announced: frames,
            added: 0,
        })
    }

    /// Adds the next frame.
    ///
    /// # Errors
    /// [`ImageError::FrameSize`] and [`ImageError::FrameCount`] if the frame does not fit the
    /// animation, [`ImageError::Encode`] if the writer fails.
    pub fn add(&mut self, frame: &Frame) -> Result<(), ImageError> {
        if (frame.width, frame.height) != self.size {
            return Err(ImageError::FrameSize {
                frame: self.added,
                width: frame.width,
                height: frame.height,
                first_width: self.size.0,
                first_height: self.size.1,
            });
        }
        if self.added == self.announced {
            return Err(ImageError::FrameCount {
                added: self.added + 1,
                announced: self.announced,
            });
        }
        self.writer.write_image_data(frame.pixels.as_flattened())?;
        self.added += 1;
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// [`ImageError::FrameCount`] if frames are missing, [`ImageError::Encode`] if the writer
    /// fails.
    pub fn finish(self) -> Result<(), ImageError> {
        if self.added != self.announced {
            return Err(ImageError::FrameCount {
                added: self.added,
                announced: self.announced,
            });
        }
        self.writer.finish()?;
        Ok(())
    }
}
