//! What cuts leave: retained gradients, bonds, control of touched nodes and of fronts.

pub(crate) mod bond;
pub(crate) mod front;

use bond::Bonds;
use front::Fronts;

/// What cuts leave beside rows and retained gradients; empty before the first.
#[derive(Debug, Clone, Default)]
pub(crate) struct CutState {
    /// Deficient nodes.
    pub(crate) bonds: Bonds,
    /// Nodes beside the front of a cut.
    pub(crate) fronts: Fronts,
    /// Rows as they were before cuts, of nodes that cuts have touched, ascending.
    pub(crate) uncut: Vec<Uncut>,
    /// What the last decay did.
    pub(crate) works: Works,
}

impl CutState {
    /// Heap bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.bonds.bytes()
            + self.fronts.bytes()
            + self.works.bytes()
            + self.uncut.capacity() * size_of::<Uncut>()
    }
}

/// A row before the first cut that touched it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Uncut {
    pub(crate) node: u32,
    pub(crate) neighbors: usize,
    pub(crate) condition: f64,
}

/// Halves of the works (J) of a decay; positive where it adds energy.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Works {
    /// Of retained gradients, nodes ascending.
    pub offsets: Vec<(u32, f64)>,
    /// Of bonds, by their deficient nodes, ascending.
    pub bonds: Vec<(u32, f64)>,
}

impl Works {
    /// Sums (J) over gradients and over bonds.
    #[must_use]
    pub fn sums(&self) -> [f64; 2] {
        [&self.offsets, &self.bonds]
            .map(|works| works.iter().fold(0.0, |sum, (_, work)| sum + work))
    }

    pub(crate) fn bytes(&self) -> usize {
        (self.offsets.capacity() + self.bonds.capacity()) * size_of::<(u32, f64)>()
    }
}
