//! Surfaces as clients get them: whole at first, then what a cut changed.

use std::sync::Arc;

use glam::Vec3;
use phyxel_live::{ClipOf, Surfel, encode_clips, encode_skin, put_surfel, surfel_numbers};
use phyxel_splat::{CAPSULE, Clip, DrawnTissue, Tissue};

use crate::picture::Painter;

/// Surfels between two changed ones up to which they are sent in one run.
const GAP: usize = 4;

/// What clients know of the surfaces.
#[derive(Debug, Default)]
pub(super) struct Skins {
    bodies: Vec<Known>,
}

#[derive(Debug, Default)]
struct Known {
    numbers: Vec<f32>,
    clips: Vec<Option<Arc<Clip>>>,
    colors: Vec<Vec3>,
}

impl Skins {
    /// The surfaces as they are.
    pub(super) fn new(painter: &Painter) -> Self {
        let bodies = painter.skins().iter().enumerate().map(|(index, skin)| {
            let mut known = Known::default();
            let all: Vec<u32> = (0..).take(skin.tissue.surfels().len()).collect();
            known.update(0, index, skin, &all, &mut Vec::new());
            known
        });
        Self {
            bodies: bodies.collect(),
        }
    }

    /// Messages that bring clients who know what was sent before up to date, if nothing but surfels in
    /// `touched`, those of each body, is other than before.
    pub(super) fn changes(
        &mut self,
        epoch: u32,
        painter: &Painter,
        touched: &[Vec<u32>],
    ) -> Vec<Vec<u8>> {
        let mut messages = Vec::new();
        let bodies = self.bodies.iter_mut().zip(painter.skins()).zip(touched);
        for (index, ((known, skin), touched)) in bodies.enumerate() {
            known.update(epoch, index, skin, touched, &mut messages);
        }
        messages
    }

    /// Messages for a client who knows nothing, of what others know.
    pub(super) fn whole(&self, epoch: u32, painter: &Painter) -> Vec<Vec<u8>> {
        let mut messages = Vec::new();
        for (index, known) in self.bodies.iter().enumerate() {
            let stride = painter.skins()[index].tissue.binding().stride();
            messages.push(encode_skin(epoch, index, 0, stride, &known.numbers));
            let all: Vec<usize> = (0..known.clips.len()).collect();
            clips(epoch, index, &known.clips, &all, &mut messages);
        }
        messages
    }

    /// Number of surfels that clients know.
    pub(super) fn len(&self) -> usize {
        self.bodies.iter().map(|known| known.colors.len()).sum()
    }
}

impl Known {
    fn update(
        &mut self,
        epoch: u32,
        index: usize,
        skin: &DrawnTissue,
        touched: &[u32],
        to: &mut Vec<Vec<u8>>,
    ) {
        let tissue = &skin.tissue;
        let stride = tissue.binding().stride();
        let each = surfel_numbers(stride);
        // Positions and materials never change: only new ones have no colour yet.
        let surfels = tissue.surfels();
        for surfel in &surfels[self.colors.len()..] {
            let color = skin.texture.color(surfel.position, surfel.material);
            self.colors.push(color);
        }
        self.numbers.resize(each * surfels.len(), f32::NAN);
        self.clips.resize(surfels.len(), None);
        let mut touched: Vec<usize> = touched.iter().map(|&surfel| surfel as usize).collect();
        touched.sort_unstable();
        touched.dedup();
        let (mut numbers, mut changed, mut clipped) = (Vec::new(), Vec::new(), Vec::new());
        for surfel in touched {
            numbers.clear();
            put(&mut numbers, tissue, surfel, self.colors[surfel]);
            let known = &mut self.numbers[surfel * each..(surfel + 1) * each];
            let mut pairs = known.iter().zip(&numbers);
            if pairs.any(|(a, b)| a.to_bits() != b.to_bits()) {
                known.copy_from_slice(&numbers);
                changed.push(surfel);
            }
            let clip = tissue.clips()[surfel].as_ref();
            if self.clips[surfel].as_ref() != clip {
                self.clips[surfel] = clip.cloned();
                clipped.push(surfel);
            }
        }
        for (first, end) in runs(changed.into_iter()) {
            let run = &self.numbers[first * each..end * each];
            to.push(encode_skin(epoch, index, first, stride, run));
        }
        clips(epoch, index, tissue.clips(), &clipped, to);
    }
}

fn put(numbers: &mut Vec<f32>, tissue: &Tissue, surfel: usize, color: Vec3) {
    let (disk, binding) = (&tissue.surfels()[surfel], tissue.binding());
    let (nodes, weights) = binding.row(surfel);
    put_surfel(
        numbers,
        &Surfel {
            position: disk.position,
            radius: disk.radius,
            normal: disk.normal,
            // A body of its own has the two of `phyxel_splat`: capsule and parenchyma.
            material: u8::from(disk.material != CAPSULE),
            shape: disk.shape,
            color,
            nodes,
            weights,
            slopes: binding.slopes(surfel),
        },
    );
}

/// Runs of ascending numbers, small gaps included.
fn runs(numbers: impl Iterator<Item = usize>) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for number in numbers {
        match runs.last_mut() {
            Some((_, end)) if number <= *end + GAP => *end = number + 1,
            _ => runs.push((number, number + 1)),
        }
    }
    runs
}

fn clips(
    epoch: u32,
    index: usize,
    all: &[Option<Arc<Clip>>],
    which: &[usize],
    to: &mut Vec<Vec<u8>>,
) {
    let clips = which.iter().filter_map(|&surfel| {
        let clip = all[surfel].as_ref()?;
        Some(ClipOf {
            surfel,
            anchor: clip.anchor,
            edges: &clip.edges,
            walls: &clip.walls,
        })
    });
    let clips: Vec<ClipOf<'_>> = clips.collect();
    if !clips.is_empty() {
        to.push(encode_clips(epoch, index, &clips));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_join_over_small_gaps_only() {
        let found = runs([0, 1, 2 + GAP, 40].into_iter());
        assert_eq!(found, [(0, 3 + GAP), (40, 41)]);
        assert_eq!(runs(std::iter::empty()), []);
    }
}
