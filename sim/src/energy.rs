//! What cuts did to the energy, in all and stroke by stroke.

use serde::{Deserialize, Serialize};

/// What cuts did to the energy.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CutEnergy {
    /// Sum of what updates took (J).
    pub released: f64,
    /// Sum of what updates added (J).
    pub added: f64,
    /// Largest addition of one update, over the elastic energy before it.
    pub largest_addition: f64,
    /// Work (J) of the decay of the retained gradients; positive if it added energy.
    pub decay: f64,
}

impl CutEnergy {
    /// Books what an update changed (J) where `stored` (J) was elastic energy before; below `round_off` (J) nothing
    /// is distinguished from none.
    pub(crate) fn record(&mut self, jump: f64, stored: f64, round_off: f64) {
        if jump <= 0.0 {
            self.released -= jump;
            return;
        }
        self.added += jump;
        if jump > round_off {
            let share = jump / stored.max(round_off);
            self.largest_addition = self.largest_addition.max(share);
        }
    }
}

/// What one stroke of a blade did to a body.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct StrokeEnergy {
    /// Index of the scene's cut that it is of.
    pub cut: usize,
    /// Captured edges of blades.
    pub captures: usize,
    /// Those of them that changed the connectivity.
    pub updates: usize,
    /// What it did to the energy. The work of the retained gradients' decay
    /// counts with the stroke that changed something last.
    pub energy: CutEnergy,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jumps_are_booked_by_their_sign() {
        let mut energy = CutEnergy::default();
        for (jump, stored) in [(-2.0, 8.0), (1.0, 4.0), (0.5, 4.0), (-0.25, 0.0)] {
            energy.record(jump, stored, 1e-12);
        }
        assert_eq!((energy.released, energy.added), (2.25, 1.5));
        assert!((energy.largest_addition - 0.25).abs() < 1e-15, "{energy:?}");
        energy.record(1e-13, 0.0, 1e-12);
        assert!(energy.largest_addition < 1.0, "round-off");
        energy.record(1e-9, 0.0, 1e-12);
        assert!(energy.largest_addition > 999.0, "out of nothing");
        assert!(energy.largest_addition.is_finite(), "a number");
    }
}
