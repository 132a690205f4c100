//! Prescribed rotation in time.

use crate::path::{Ease, PathError, between};
use glam::{DQuat, DVec3};

/// Rotation over time (s) by keys; constant before the first and after the last.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Turn {
    keys: Vec<(f64, DQuat)>,
    ease: Ease,
}

impl Turn {
    /// A rotation through `(time, rotation)` keys, between two of them about one axis and by less than
    /// half a turn: a longer one needs keys in between.
    ///
    /// # Errors
    /// [`PathError`] if there is no key, or one is not a rotation (finite, not zero) or not later than
    /// the one before.
    pub fn new(keys: Vec<(f64, DQuat)>, ease: Ease) -> Result<Self, PathError> {
        if keys.is_empty() {
            return Err(PathError::Empty);
        }
        let mut unit = Vec::with_capacity(keys.len());
        for (key, &(time, rotation)) in keys.iter().enumerate() {
            let rises = key == 0 || keys[key - 1].0 < time;
            let length = rotation.length();
            let sound = time.is_finite() && length.is_finite() && length > 0.0;
            if !(sound && rises) {
                return Err(PathError::BadKey { key });
            }
            unit.push((time, rotation.normalize()));
        }
        Ok(Self { keys: unit, ease })
    }

    /// Rotation and angular velocity (rad/s, world axes) at a time (s).
    #[must_use]
    pub fn at(&self, time: f64) -> (DQuat, DVec3) {
        let (before, after, share, slope) = between(&self.keys, self.ease, time);
        let turn = (after * before.inverse()).normalize();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let vector = turn.to_scaled_axis();
        let now = DQuat::from_scaled_axis(vector * share) * before;
        (now.normalize(), vector * slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_about_one_axis_at_the_rate_it_states() {
        let quarter = DQuat::from_rotation_z(1.2);
        let tilted = DQuat::from_rotation_x(0.8) * quarter;
        let keys = vec![(1.0, DQuat::IDENTITY), (2.0, quarter), (4.0, tilted)];
        let turn = Turn::new(keys, Ease::Smooth).unwrap();
        assert_eq!(turn.at(0.0), (DQuat::IDENTITY, DVec3::ZERO), "before");
        assert!(turn.at(9.0).0.angle_between(tilted) < 1e-12, "after");
        let half = turn.at(1.5).0;
        assert!(
            half.angle_between(DQuat::from_rotation_z(0.6)) < 1e-12,
            "half way: {half}"
        );
        for time in [1.3, 2.4, 3.6] {
            let d = 1e-6;
            let (a, b) = (turn.at(time - d).0, turn.at(time + d).0);
            let rate = (b * a.inverse()).to_scaled_axis() / (2.0 * d);
            assert!(
                (rate - turn.at(time).1).length() < 1e-6,
                "rate at {time}: {rate}"
            );
        }
    }

    #[test]
    fn refuses_what_is_no_rotation() {
        let zero = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        let error = Turn::new(vec![(0.0, zero)], Ease::Linear).unwrap_err();
        assert_eq!(error, PathError::BadKey { key: 0 }, "zero");
        assert_eq!(
            Turn::new(vec![], Ease::Linear),
            Err(PathError::Empty),
            "empty"
        );
    }
}
