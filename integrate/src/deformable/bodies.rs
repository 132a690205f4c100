//! The nodes of bodies that touch.

use super::Moved;
use glam::DVec3;
use std::ops::Range;

/// Nodes of several bodies, one body after another, as the samples of [`super::DeformableContact`] number them, and what they do
/// in a step.
#[derive(Debug, Clone, Default)]
pub struct TouchingNodes {
    /// Where each body's end.
    ends: Vec<usize>,
    rest: Vec<DVec3>,
    masses: Vec<f64>,
    positions: Vec<DVec3>,
    moved: Vec<DVec3>,
    pieces: Vec<u32>,
    piece_count: u32,
}

impl TouchingNodes {
    /// Adds a body by where its nodes are at rest (m) and their masses (kg).
    ///
    /// # Panics
    /// If the lists are of different lengths.
    pub fn push(&mut self, rest: &[DVec3], masses: &[f64]) {
        assert_eq!(rest.len(), masses.len(), "a mass per node");
        self.rest.extend_from_slice(rest);
        self.masses.extend_from_slice(masses);
        self.positions.extend_from_slice(rest);
        self.moved.resize(self.rest.len(), DVec3::ZERO);
        self.pieces.resize(self.rest.len(), u32::MAX);
        self.ends.push(self.rest.len());
    }

    /// Numbers of a body's nodes.
    ///
    /// # Panics
    /// If there is no such body.
    #[must_use]
    pub fn of(&self, body: usize) -> Range<usize> {
        let begin = body.checked_sub(1).map_or(0, |before| self.ends[before]);
        begin..self.ends[body]
    }

    /// Where all are at rest (m).
    #[must_use]
    pub fn rest(&self) -> &[DVec3] {
        &self.rest
    }

    /// Masses of all (kg).
    #[must_use]
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Where all are (m).
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Puts a body's nodes (m), before a step.
    ///
    /// # Panics
    /// If there is no such body, or positions are of another number.
    pub fn place(&mut self, body: usize, positions: &[DVec3]) {
        let range = self.of(body);
        self.positions[range].copy_from_slice(positions);
    }

    /// Takes all nodes out of their free pieces.
    pub fn clear_pieces(&mut self) {
        self.pieces.fill(u32::MAX);
        self.piece_count = 0;
    }

    /// Makes some of a body's nodes, as the body numbers them, a free piece.
    ///
    /// # Panics
    /// If there is no such body or node.
    pub fn add_piece(&mut self, body: usize, nodes: &[u32]) {
        let range = self.of(body);
        for node in nodes {
            self.pieces[range.clone()][*node as usize] = self.piece_count;
        }
        self.piece_count += 1;
    }

    /// Takes where a body's nodes are (m) at the end of a step.
    ///
    /// # Panics
    /// As [`TouchingNodes::place`].
    pub fn take(&mut self, body: usize, positions: &[DVec3]) {
        let range = self.of(body);
        assert_eq!(range.len(), positions.len(), "a position per node");
        let (before, moved) = (&mut self.positions[range.clone()], &mut self.moved[range]);
        for ((moved, before), now) in moved.iter_mut().zip(before).zip(positions) {
            *moved = *now - *before;
            *before = *now;
        }
    }

    /// What all have done in a step (s), once each body's are taken.
    #[must_use]
    pub fn moved(&self, step: f64) -> Moved<'_> {
        Moved {
            positions: &self.positions,
            by: &self.moved,
            masses: &self.masses,
            pieces: &self.pieces,
            step,
        }
    }

    /// Bytes of the arrays.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let vectors = [&self.rest, &self.positions, &self.moved];
        let vectors: usize = vectors.iter().map(|list| size_of_val(&***list)).sum();
        vectors + size_of_val(&*self.masses) + size_of_val(&*self.pieces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bodies lie one after another, and pieces are numbered through them.
    #[test]
    fn nodes_of_two_bodies_move_on_their_own() {
        let mut nodes = TouchingNodes::default();
        nodes.push(&[DVec3::ZERO; 2], &[1.0; 2]);
        nodes.push(&[DVec3::X; 3], &[2.0; 3]);
        for step in 0..2 {
            let at = f64::from(step);
            nodes.place(0, &[DVec3::Y * at; 2]);
            nodes.place(1, &[DVec3::X + DVec3::Z * at; 3]);
            nodes.clear_pieces();
            nodes.add_piece(0, &[1]);
            nodes.add_piece(1, &[0, 2]);
            nodes.take(0, &[DVec3::Y * (at + 1.0); 2]);
            nodes.take(1, &[DVec3::X + DVec3::Z * (at + 3.0); 3]);
            let moved = nodes.moved(0.5);
            assert_eq!(moved.pieces, [u32::MAX, 0, 1, u32::MAX, 1]);
            let [y, z] = [DVec3::Y, DVec3::Z * 3.0];
            assert_eq!(moved.by, [y, y, z, z, z]);
            assert_eq!(nodes.of(1), 2..5);
            assert_eq!(nodes.positions()[2], DVec3::X + DVec3::Z * (at + 3.0));
        }
    }
}
