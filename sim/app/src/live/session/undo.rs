//! Places to go back to.

use std::collections::VecDeque;

/// Strokes that can be undone, and what they may take together: as many strokes of 3 cm on a liver of 6,000 nodes and
/// 30,000 surfels fit. The newest is kept whatever it takes.
const MOST: usize = 24;
const MOST_BYTES: usize = 512 << 20;

/// The start, and the state before each of the last strokes: going back takes as long after a hundred strokes as
/// after one.
#[derive(Debug)]
pub(super) struct Ring<T> {
    start: Option<T>,
    /// With the bytes of each.
    strokes: VecDeque<(T, usize)>,
}

impl<T> Default for Ring<T> {
    fn default() -> Self {
        Self {
            start: None,
            strokes: VecDeque::new(),
        }
    }
}

impl<T: Clone> Ring<T> {
    /// Sets the state that a reset brings back.
    pub(super) fn set_start(&mut self, start: T) {
        self.start = Some(start);
    }

    /// Adds the state before a stroke, which takes so many bytes; the oldest give way.
    pub(super) fn push(&mut self, before: T, bytes: usize) {
        self.strokes.push_back((before, bytes));
        let mut sum: usize = self.strokes.iter().map(|(_, bytes)| bytes).sum();
        while self.strokes.len() > MOST || (self.strokes.len() > 1 && sum > MOST_BYTES) {
            let oldest = self.strokes.pop_front();
            sum -= oldest.map_or(0, |(_, bytes)| bytes);
        }
    }

    /// The newest state before a stroke, and what it takes, to be changed.
    pub(super) fn newest(&mut self) -> Option<&mut (T, usize)> {
        self.strokes.back_mut()
    }

    /// How many strokes can be undone.
    pub(super) fn len(&self) -> usize {
        self.strokes.len()
    }

    /// Takes the newest state before a stroke.
    pub(super) fn pop(&mut self) -> Option<T> {
        self.strokes.pop_back().map(|(before, _)| before)
    }

    /// The start; no stroke can be undone from there.
    pub(super) fn reset(&mut self) -> Option<T> {
        self.strokes.clear();
        self.start.clone()
    }

    /// The start.
    pub(super) fn start(&self) -> Option<T> {
        self.start.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_stay() {
        let mut ring = Ring::default();
        assert_eq!([ring.pop(), ring.reset(), ring.start()], [None::<u32>; 3]);
        ring.set_start(0);
        for k in 1..=30 {
            ring.push(k, 1 << 20);
        }
        assert_eq!((ring.len(), ring.pop()), (MOST, Some(30)));
        assert_eq!(
            (ring.newest().copied(), ring.start()),
            (Some((29, 1 << 20)), Some(0))
        );
        ring.push(31, MOST_BYTES);
        assert_eq!(ring.len(), 1, "those before are too large");
        assert_eq!(ring.pop(), Some(31));
        ring.push(32, MOST_BYTES + 1);
        assert_eq!((ring.len(), ring.reset(), ring.len()), (1, Some(0), 0));
    }
}
