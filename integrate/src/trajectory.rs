//! Prescribed rigid motion in time: of tools, and of supports that turn together.

use glam::{DQuat, DVec3};

use crate::shape::Pose;

/// Shape of the motion between two keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Ease {
    /// Constant velocity; it jumps at the keys.
    #[default]
    Linear,
    /// `3 s² − 2 s³`: at rest at every key, no jump of the velocity.
    Smooth,
}

/// Why a trajectory cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryError {
    /// No key.
    #[error("a trajectory needs at least one key")]
    Empty,
    /// A time or displacement is not finite, a rotation is zero, or a time does not come after the one
    /// before.
    #[error("key {key}: times must be finite and rise, displacements finite, rotations not zero")]
    BadKey {
        /// Index of the key.
        key: usize,
    },
}

/// Rotation and displacement over time (s): `x(t) = R(t) X + u(t)`, exact between keys, constant before
/// the first and after the last.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Trajectory {
    displacements: Vec<(f64, DVec3)>,
    /// Of unit length; no keys where nothing turns.
    rotations: Vec<(f64, DQuat)>,
    ease: Ease,
}

impl Trajectory {
    /// Through `(time, pose)` keys. Between two keys it turns about one axis by half a turn at most: a
    /// longer one needs keys in between.
    ///
    /// # Errors
    /// [`TrajectoryError`] if there is no key, or one is not finite, without rotation (zero) or not later
    /// than the one before.
    pub fn new(keys: &[(f64, Pose)], ease: Ease) -> Result<Self, TrajectoryError> {
        let places = keys.iter().map(|(time, pose)| (*time, pose.position));
        let mut trajectory = Self::translation(places.collect(), ease)?;
        for (key, (time, pose)) in keys.iter().enumerate() {
            let length = pose.rotation.length();
            if !(length.is_finite() && length > 0.0) {
                return Err(TrajectoryError::BadKey { key });
            }
            let rotation = pose.rotation.normalize();
            trajectory.rotations.push((*time, rotation));
        }
        let still = |(_, rotation): &(f64, DQuat)| *rotation == DQuat::IDENTITY;
        if trajectory.rotations.iter().all(still) {
            trajectory.rotations.clear();
        }
        Ok(trajectory)
    }

    /// Through `(time, displacement)` keys (s, m), without rotation.
    ///
    /// # Errors
    /// [`TrajectoryError`] if there is no key, or one is not finite or not later than the one before.
    pub fn translation(keys: Vec<(f64, DVec3)>, ease: Ease) -> Result<Self, TrajectoryError> {
        if keys.is_empty() {
            return Err(TrajectoryError::Empty);
        }
        for (key, (time, displacement)) in keys.iter().enumerate() {
            let rises = key == 0 || keys[key - 1].0 < *time;
            if !(time.is_finite() && displacement.is_finite() && rises) {
                return Err(TrajectoryError::BadKey { key });
            }
        }
        Ok(Self {
            displacements: keys,
            rotations: Vec::new(),
            ease,
        })
    }

    /// From rest at `start` to `displacement` at `end`, without a jump of the velocity.
    ///
    /// # Errors
    /// [`TrajectoryError::BadKey`] unless `start < end` and all is finite.
    pub fn ramp(start: f64, end: f64, displacement: DVec3) -> Result<Self, TrajectoryError> {
        let keys = vec![(start, DVec3::ZERO), (end, displacement)];
        Self::translation(keys, Ease::Smooth)
    }

    /// Heap bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.displacements) + size_of_val(&*self.rotations)
    }

    /// Displacement u (m) of the origin and its velocity (m/s) at a time (s).
    #[must_use]
    pub fn displacement(&self, time: f64) -> (DVec3, DVec3) {
        let (before, after, share, slope) = between(&self.displacements, self.ease, time);
        (before + (after - before) * share, (after - before) * slope)
    }

    /// Rotation R and angular velocity (rad/s, world axes) at a time (s).
    #[must_use]
    pub fn rotation(&self, time: f64) -> (DQuat, DVec3) {
        if self.rotations.is_empty() {
            return (DQuat::IDENTITY, DVec3::ZERO);
        }
        let (before, after, share, slope) = between(&self.rotations, self.ease, time);
        let turn = (after * before.inverse()).normalize();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let vector = turn.to_scaled_axis();
        let now = DQuat::from_scaled_axis(vector * share) * before;
        (now.normalize(), vector * slope)
    }

    /// Position `R X + u` (m) and velocity (m/s) at a time (s) of what lies at `X` (m).
    #[must_use]
    pub fn place(&self, x: DVec3, time: f64) -> (DVec3, DVec3) {
        let (displacement, velocity) = self.displacement(time);
        if self.rotations.is_empty() {
            return (x + displacement, velocity);
        }
        let (rotation, angular) = self.rotation(time);
        let arm = rotation * x;
        (arm + displacement, velocity + angular.cross(arm))
    }

    /// Pose at a time (s) of a thing that is displaced by u from `origin` and turned by R about its own origin.
    #[must_use]
    pub fn pose(&self, origin: &Pose, time: f64) -> Pose {
        Pose {
            position: origin.position + self.displacement(time).0,
            rotation: (self.rotation(time).0 * origin.rotation).normalize(),
        }
    }
}

/// The keys around a time, the fraction of the span between them that is done, and its rate (1/s).
fn between<T: Copy>(keys: &[(f64, T)], ease: Ease, time: f64) -> (T, T, f64, f64) {
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

    fn turned(rotation: DQuat) -> Pose {
        Pose {
            rotation,
            ..Pose::IDENTITY
        }
    }

    #[test]
    fn turns_about_one_axis_at_the_rate_it_states() {
        let quarter = DQuat::from_rotation_z(1.2);
        let tilted = DQuat::from_rotation_x(0.8) * quarter;
        let keys = [(1.0, DQuat::IDENTITY), (2.0, quarter), (4.0, tilted)];
        let keys = keys.map(|(time, rotation)| (time, turned(rotation)));
        let path = Trajectory::new(&keys, Ease::Smooth).unwrap();
        let still = (DQuat::IDENTITY, DVec3::ZERO);
        assert_eq!(path.rotation(0.0), still, "before");
        assert!(path.rotation(9.0).0.angle_between(tilted) < 1e-12, "after");
        let half = path.rotation(1.5).0;
        let off = half.angle_between(DQuat::from_rotation_z(0.6));
        assert!(off < 1e-12, "half way: {half}");
        for time in [1.3, 2.4, 3.6] {
            let d = 1e-6;
            let (a, b) = (path.rotation(time - d).0, path.rotation(time + d).0);
            let rate = (b * a.inverse()).to_scaled_axis() / (2.0 * d);
            let off = rate - path.rotation(time).1;
            assert!(off.length() < 1e-6, "rate at {time}: {rate}");
        }
    }

    /// Distances stay, to round-off, and velocities are the slopes of positions: what turns together stays rigid.
    #[test]
    fn places_turn_rigidly_at_the_velocity_stated() {
        let rotation = DQuat::from_axis_angle(DVec3::new(2.0, -1.0, 2.0) / 3.0, 2.9);
        let position = DVec3::new(0.1, 0.0, 2.0);
        let end = Pose { position, rotation };
        let keys = [(1.0, Pose::IDENTITY), (3.0, end)];
        let paths = [Ease::Linear, Ease::Smooth].map(|ease| Trajectory::new(&keys, ease).unwrap());
        let places = [DVec3::ZERO, DVec3::new(0.4, -1.0, 7.0), DVec3::X * 3.0];
        let times = [0.0, 1.0, 1.7, 2.9, 3.0, 4.0].into_iter();
        for (time, path) in times.flat_map(|time| paths.iter().map(move |path| (time, path))) {
            let now = places.map(|x| path.place(x, time));
            for k in 0..3 {
                let (a, b) = (k, (k + 1) % 3);
                let length = places[a].distance(places[b]);
                let found = now[a].0.distance(now[b].0);
                assert!((found / length - 1.0).abs() < 1e-14, "{found}, {length}");
            }
            let inner = (1.1..2.95).contains(&time);
            for (x, (_, velocity)) in places.iter().zip(now).filter(|_| inner) {
                let slope = path.place(*x, time + 1e-6).0 - path.place(*x, time - 1e-6).0;
                assert!((slope / 2e-6 - velocity).length() < 1e-7, "{x} at {time}");
            }
        }
        for x in places {
            assert!((paths[0].place(x, 5.0).0 - end.apply(x)).length() < 1e-14);
        }
    }

    #[test]
    fn refuses_what_is_no_rotation() {
        let zero = turned(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0));
        let error = Trajectory::new(&[(0.0, zero)], Ease::Linear).unwrap_err();
        assert_eq!(error, TrajectoryError::BadKey { key: 0 }, "zero");
        let none = Trajectory::new(&[], Ease::Linear);
        assert_eq!(none, Err(TrajectoryError::Empty), "empty");
        let twice = [(0.0, Pose::IDENTITY), (0.0, Pose::IDENTITY)];
        let error = Trajectory::new(&twice, Ease::Linear).unwrap_err();
        assert_eq!(error, TrajectoryError::BadKey { key: 1 }, "at one time");
        let error = Trajectory::ramp(0.0, 1.0, DVec3::NAN).unwrap_err();
        assert_eq!(error, TrajectoryError::BadKey { key: 1 }, "not finite");
    }

    #[test]
    fn holds_outside_and_moves_between() {
        let path = Trajectory::ramp(1.0, 3.0, DVec3::X).unwrap();
        let at = |time| path.displacement(time);
        assert_eq!(at(0.0), (DVec3::ZERO, DVec3::ZERO), "before");
        assert_eq!(at(3.0), (DVec3::X, DVec3::ZERO), "after");
        assert_eq!(at(2.0).0, DVec3::X * 0.5, "half way");
        let keys = vec![(0.0, DVec3::ZERO), (2.0, DVec3::Y)];
        let line = Trajectory::translation(keys, Ease::Linear).unwrap();
        let (half, velocity) = (DVec3::Y * 0.25, DVec3::Y * 0.5);
        assert_eq!(line.displacement(0.5), (half, velocity), "line");
    }
}
