//! Frames as PNG files and one animation of them.

use std::fs::File;
use std::io::{BufReader, Write};
use std::panic::resume_unwind;
use std::sync::Arc;
use std::thread::{Builder, JoinHandle};

use phyxel_splat::{Animation, Frame, ImageError};
use serde::{Deserialize, Serialize};

use super::RunError;
use crate::output::{OutputError, OutputFolder};
use phyxel::World;
use phyxel::scene::Pictures;

/// Name of the animation.
pub(super) const ANIMATION: &str = "animation.png";
/// Frames kept for the animation at most; beyond that every second one is dropped, again and again.
const KEPT: usize = 400;

/// The frames of a run.
#[derive(Debug)]
pub(super) struct Movie {
    folder: Arc<OutputFolder>,
    rate: f64,
    settling: bool,
    /// Frames at half the size, for the animation; `None` if none is wanted.
    small: Option<Vec<Frame>>,
    place: MoviePlace,
    /// Writes the last frame beside the next steps.
    writing: Option<JoinHandle<Result<(), RunError>>>,
}

impl Drop for Movie {
    fn drop(&mut self) {
        let _ = self.wait();
    }
}

/// How far a movie has come.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct MoviePlace {
    /// One of this many frames goes into the animation.
    stride: usize,
    count: usize,
    /// Index of the next frame since the start of settling, then of the scene.
    next: f64,
    in_scene: bool,
}

impl Movie {
    /// A movie from its first frame, or from where it was: then the animation takes the frames that
    /// are there, and only later ones are removed.
    pub(super) fn new(
        folder: &OutputFolder,
        pictures: &Pictures,
        place: Option<MoviePlace>,
    ) -> Result<Self, RunError> {
        let place = place.unwrap_or(MoviePlace {
            stride: 1,
            count: 0,
            next: 0.0,
            in_scene: false,
        });
        let kept: Vec<String> = (0..place.count).map(frame_name).collect();
        let folder = folder.fresh_subfolder("frames", "frame-", ".png", &kept)?;
        let small = pictures.animation.then(|| {
            let wanted = kept.iter().step_by(place.stride);
            let read = wanted.map(|name| File::open(folder.path().join(name)));
            read.flatten()
                .filter_map(|file| Frame::read_png(BufReader::new(file)).ok())
                .map(|frame| frame.halved())
                .collect()
        });
        Ok(Self {
            folder: Arc::new(folder),
            writing: None,
            rate: pictures.rate,
            settling: pictures.settling,
            small,
            place,
        })
    }

    /// How far it has come.
    pub(super) fn place(&self) -> MoviePlace {
        self.place
    }

    /// Whether the next frame's time has come.
    pub(super) fn is_due(&mut self, world: &World) -> bool {
        let time = match world.scene_time() {
            Some(time) => {
                if !self.place.in_scene {
                    self.place.in_scene = true;
                    self.place.next = 0.0;
                }
                time
            }
            None if self.settling => world.time(),
            None => return false,
        };
        if time < self.place.next / self.rate {
            return false;
        }
        self.place.next += 1.0;
        true
    }

    /// Waits until the frames so far are written.
    pub(super) fn wait(&mut self) -> Result<(), RunError> {
        let written = self.writing.take().map(JoinHandle::join);
        written.map_or(Ok(()), |frame| {
            frame.unwrap_or_else(|panic| resume_unwind(panic))
        })
    }

    /// Begins to write a frame, once the one before is written.
    pub(super) fn add(&mut self, frame: Frame) -> Result<(), RunError> {
        self.wait()?;
        let name = frame_name(self.place.count);
        let file = self.folder.path().join(&name);
        if let Some(small) = &mut self.small
            && self.place.count.is_multiple_of(self.place.stride)
        {
            small.push(frame.halved());
            if small.len() > KEPT {
                *small = std::mem::take(small).into_iter().step_by(2).collect();
                self.place.stride *= 2;
            }
        }
        self.place.count += 1;
        let folder = self.folder.clone();
        let write = move || {
            folder.fill(&name, |file| {
                let failed = |source| image_error(&name, source);
                frame.write_png(file).map_err(failed)
            })
        };
        let failed = |source| OutputError::File { file, source };
        self.writing = Some(Builder::new().spawn(write).map_err(failed)?);
        Ok(())
    }

    /// Writes the animation; the names of what was written.
    pub(super) fn finish(mut self, folder: &OutputFolder) -> Result<Vec<String>, RunError> {
        self.wait()?;
        let mut names = vec![format!("frames/ ({} frames)", self.place.count)];
        let Some(small) = self.small.take().filter(|small| !small.is_empty()) else {
            return Ok(names);
        };
        folder.fill(ANIMATION, |file| {
            let drawn = animate(file, &small, self.rate, self.place.stride);
            drawn.map_err(|source| image_error(ANIMATION, source))
        })?;
        names.push(ANIMATION.to_owned());
        Ok(names)
    }
}

fn image_error(file: &str, source: ImageError) -> RunError {
    let file = file.to_owned();
    RunError::Image { file, source }
}

fn frame_name(count: usize) -> String {
    format!("frame-{count:05}.png")
}

fn animate(
    out: &mut dyn Write,
    frames: &[Frame],
    rate: f64,
    stride: usize,
) -> Result<(), ImageError> {
    #[allow(clippy::cast_possible_truncation, reason = "clamped to 1..=60")]
    let speed = (rate / stride as f64).round().clamp(1.0, 60.0) as u16;
    let count = u32::try_from(frames.len()).unwrap_or(u32::MAX);
    let mut animation = Animation::new(out, frames[0].width, frames[0].height, count, speed)?;
    for frame in frames {
        animation.add(frame)?;
    }
    animation.finish()
}
