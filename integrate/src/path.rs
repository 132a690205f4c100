//! Prescribed displacement in time.

use glam::DVec3;

/// Shape of the motion between two keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Ease {
    /// Constant velocity; it jumps at the keys.
    #[default]
    Linear,
    /// `3 s² − 2 s³`: at rest at every key, no jump of the velocity.
    Smooth,
}

/// Why a path cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// No key.
    #[error("a path needs at least one key")]
    Empty,
    /// A time or displacement is not finite, or a time does not come after the one before.
    #[error("key {key}: times must be finite and rise, displacements finite")]
    BadKey {
        /// Index of the key.
        key: usize,
    },
}

/// Displacement (m) over time (s) by keys; constant before the first and after the last.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Path {
    keys: Vec<(f64, DVec3)>,
    ease: Ease,
}

impl Path {
    /// A path through `(time, displacement)` keys.
    ///
    /// # Errors
    /// [`PathError`] if there is no key, or one is not finite or not later than the one before.
    pub fn new(keys: Vec<(f64, DVec3)>, ease: Ease) -> Result<Self, PathError> {
        if keys.is_empty() {
            return Err(PathError::Empty);
        }
        for (key, (time, displacement)) in keys.iter().enumerate() {
            let rises = key == 0 || keys[key - 1].0 < *time;
            if !(time.is_finite() && displacement.is_finite() && rises) {
                return Err(PathError::BadKey { key });
            }
        }
        Ok(Self { keys, ease })
    }

    /// Heap bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.keys)
    }

    /// From rest at `start` to `displacement` at `end`, without a jump of the velocity.
    ///
    /// # Errors
    /// [`PathError::BadKey`] unless `start < end` and all is finite.
    pub fn ramp(start: f64, end: f64, displacement: DVec3) -> Result<Self, PathError> {
        Self::new(
            vec![(start, DVec3::ZERO), (end, displacement)],
            Ease::Smooth,
        )
    }

    /// Displacement (m) and velocity (m/s) at a time (s).
    #[must_use]
    pub fn at(&self, time: f64) -> (DVec3, DVec3) {
        let (before, after, share, slope) = between(&self.keys, self.ease, time);
        (before + (after - before) * share, (after - before) * slope)
    }
}

/// The keys around a time, the share of the way between them, and its rate (1/s).
pub(crate) fn between<T: Copy>(keys: &[(f64, T)], ease: Ease, time: f64) -> (T, T, f64, f64) {
    let after = keys.partition_point(|key| key.0 <= time);
    let (t0, before) = keys[after.saturating_sub(1)];
    let Some(&(t1, next)) = keys.get(after).filter(|_| after > 0) else {
        return (before, before, 0.0, 0.0);
    };
    let span = t1 - t0;
    let s = (time - t0) / span;
    let (value, slope) = match ease {
        Ease::Linear => (s, 1.0),
        Ease::Smooth => (s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s)),
    };
    (before, next, value, slope / span)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_outside_and_moves_between() {
        let path = Path::ramp(1.0, 3.0, DVec3::X).unwrap();
        assert_eq!(path.at(0.0), (DVec3::ZERO, DVec3::ZERO), "before");
        assert_eq!(path.at(3.0), (DVec3::X, DVec3::ZERO), "after");
        assert_eq!(path.at(2.0).0, DVec3::X * 0.5, "half way");
        let line = Path::new(vec![(0.0, DVec3::ZERO), (2.0, DVec3::Y)], Ease::Linear).unwrap();
        assert_eq!(line.at(0.5), (DVec3::Y * 0.25, DVec3::Y * 0.5), "line");
    }

    #[test]
    fn velocity_is_the_slope_of_the_displacement() {
        let path = Path::ramp(0.0, 2.0, DVec3::new(1.0, -2.0, 0.5)).unwrap();
        for time in [0.3, 0.9, 1.7] {
            let slope = (path.at(time + 1e-6).0 - path.at(time - 1e-6).0) / 2e-6;
            assert!((slope - path.at(time).1).length() < 1e-8, "at {time}");
        }
    }

    #[test]
    fn refuses_bad_keys() {
        assert_eq!(
            Path::new(vec![], Ease::Linear),
            Err(PathError::Empty),
            "empty"
        );
        let keys = vec![(0.0, DVec3::ZERO), (0.0, DVec3::X)];
        let error = Path::new(keys, Ease::Linear).unwrap_err();
        assert_eq!(error, PathError::BadKey { key: 1 }, "equal times");
        let error = Path::ramp(0.0, 1.0, DVec3::NAN).unwrap_err();
        assert_eq!(error, PathError::BadKey { key: 1 }, "not finite");
    }
}
