//! What blades have left in a body: the surface of its cut, factors on its pairs, strokes and what they did to the energy.

use phyxel_enrich::{Blade, Cuts, Factors, Sweep};
use phyxel_integrate::CutEnergy;
use phyxel_mls::MaterialMap;
use serde::{Deserialize, Serialize};

use crate::input::StrokePhase;

/// What one body needs once a blade has touched it; a body that no blade touches has none.
#[derive(Debug, Clone)]
pub struct Cutting {
    /// The cut surface, in material coordinates.
    pub cuts: Cuts,
    /// Factors on the pairs.
    pub factors: Factors,
    /// Pairs between whose nodes blades passed in the world while no surface of a cut crosses them: what
    /// blades cut in tissue that the map does not resolve.
    pub missed_pairs: usize,
    /// Largest estimate of the largest eigenvalue so far, relative to the uncut body's.
    pub growth: f64,
    /// What cuts did to the energy.
    pub energy: CutEnergy,
    /// The same, stroke by stroke, in the order in which they began.
    pub by_stroke: Vec<StrokeEnergy>,
    pub(crate) map: MaterialMap,
    /// Piece of each node; empty before the first cut.
    pub(crate) pieces: Vec<u32>,
    /// Open strokes.
    pub(crate) strokes: Vec<OpenStroke>,
}

/// An open stroke.
#[derive(Debug, Clone)]
pub(crate) struct OpenStroke {
    pub(crate) cut: usize,
    /// Place among all strokes so far.
    number: usize,
    /// `None` in a stroke that is being replayed.
    pub(crate) blade: Option<Blade>,
}

/// What edges that are captured again do not say, kept; of a body that no blade has touched nothing.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct KeptCut {
    growth: Option<f64>,
    energy: Option<CutEnergy>,
    by_stroke: Vec<CutEnergy>,
    /// Cuts and blades of open strokes.
    strokes: Vec<(usize, Blade)>,
}

impl KeptCut {
    /// Whether its strokes can be resumed in a body of so many nodes.
    pub(crate) fn is_sound(&self, nodes: usize) -> bool {
        self.strokes.iter().all(|(_, blade)| blade.is_sound(nodes))
    }

    /// Whether growth and energies in all are numbers.
    pub(crate) fn is_finite(&self) -> bool {
        self.growth.unwrap_or(1.0).is_finite() && self.energy.unwrap_or_default().is_finite()
    }
}

/// A captured edge of a blade, kept: all that a cut grows from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct CapturedEdge {
    /// Steps that had been taken.
    pub(crate) steps: u64,
    /// Index of the body.
    pub(crate) body: usize,
    /// Index of the scene's cut.
    pub(crate) cut: usize,
    pub(crate) phase: StrokePhase,
    /// What it added to the cut.
    pub(crate) sweep: Sweep,
}

/// What one stroke of a blade did to a body.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct StrokeEnergy {
    /// Index of the scene's cut that it is of.
    pub cut: usize,
    /// Captured edges of blades, and tears ahead of them.
    pub captures: usize,
    /// Those of them that changed the connectivity.
    pub updates: usize,
    /// What it did to the energy. The work of the retained gradients' decay
    /// counts with the stroke that changed something last.
    pub energy: CutEnergy,
}

impl Cutting {
    /// Heap bytes of all that a cut needs.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.cuts.bytes() + self.factors.bytes() + self.map.bytes() + size_of_val(&*self.pieces)
    }

    /// Captured edges of blades, and how many of them changed the connectivity.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        let strokes = self.by_stroke.iter();
        strokes.fold((0, 0), |(captures, updates), stroke| {
            (captures + stroke.captures, updates + stroke.updates)
        })
    }

    /// Number of undirected pairs whose factor is 0.
    #[must_use]
    pub fn severed_pairs(&self) -> usize {
        self.factors.severed_count()
    }

    /// What is kept.
    pub(crate) fn state(&self) -> KeptCut {
        let open = self.strokes.iter();
        KeptCut {
            growth: Some(self.growth),
            energy: Some(self.energy),
            by_stroke: self.by_stroke.iter().map(|stroke| stroke.energy).collect(),
            strokes: open
                .filter_map(|stroke| Some((stroke.cut, stroke.blade.clone()?)))
                .collect(),
        }
    }

    /// Takes it back once its edges are captured again; replayed strokes get their blades.
    pub(crate) fn set_state(&mut self, state: KeptCut) {
        self.growth = state.growth.unwrap_or(self.growth);
        if let Some(energy) = state.energy {
            self.energy = energy;
            // Strokes that have begun since have changed nothing.
            for (stroke, energy) in self.by_stroke.iter_mut().zip(state.by_stroke) {
                stroke.energy = energy;
            }
        }
        for (cut, blade) in state.strokes {
            let open = self.strokes.iter_mut().find(|stroke| stroke.cut == cut);
            if let Some(stroke) = open {
                stroke.blade.get_or_insert(blade);
            }
        }
    }

    pub(crate) fn add_decay(&mut self, work: f64) {
        self.energy.decay += work;
        let mut strokes = self.by_stroke.iter_mut().rev();
        if let Some(last) = strokes.find(|stroke| stroke.updates > 0) {
            last.energy.decay += work;
        }
    }

    /// Takes a blade to where its edge is now, in a new stroke if it begins one; the stroke's number.
    pub(crate) fn lead(&mut self, cut: usize, phase: StrokePhase, blade: Option<Blade>) -> usize {
        if phase == StrokePhase::Start {
            self.strokes.retain(|stroke| stroke.cut != cut);
        }
        let number = match self.strokes.iter_mut().find(|stroke| stroke.cut == cut) {
            Some(open) => {
                open.blade = blade;
                open.number
            }
            None => {
                let number = self.by_stroke.len();
                self.by_stroke.push(StrokeEnergy {
                    cut,
                    ..StrokeEnergy::default()
                });
                self.strokes.push(OpenStroke { cut, number, blade });
                number
            }
        };
        self.by_stroke[number].captures += 1;
        number
    }
}
