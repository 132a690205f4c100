//! What cuts did to the energy.

/// What cuts did to the energy of a body.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    pub fn record(&mut self, jump: f64, stored: f64, round_off: f64) {
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

    /// Whether all of it are numbers.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let numbers = [self.released, self.added, self.largest_addition, self.decay];
        numbers.iter().all(|number| number.is_finite())
    }
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
