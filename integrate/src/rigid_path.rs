//! Prescribed rigid motion in time: of tools, and of supports that turn together.

use glam::{DQuat, DVec3};

use crate::path::{Ease, Path, PathError, between};
use crate::shape::Pose;

/// Rotation and displacement over time (s): `x(t) = R(t) X + u(t)`, exact between keys.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RigidPath {
    displacement: Path,
    /// Rotations, of unit length, and how they follow each other; no keys where nothing turns.
    rotations: Vec<(f64, DQuat)>,
    ease: Ease,
}

impl From<Path> for RigidPath {
    /// A path along which nothing turns.
    fn from(displacement: Path) -> Self {
        Self {
            displacement,
            rotations: Vec::new(),
            ease: Ease::Linear,
        }
    }
}

impl RigidPath {
    /// A path through `(time, pose)` keys; constant before the first and after the last. Between two keys it
    /// turns about one axis by half a turn at most: a longer one needs keys in between.
    ///
    /// # Errors
    /// [`PathError`] if there is no key, or one is not finite, without rotation (zero) or not later than the
    /// one before.
    pub fn new(keys: &[(f64, Pose)], ease: Ease) -> Result<Self, PathError> {
        let places = keys.iter().map(|(time, pose)| (*time, pose.position));
        let path = Self::from(Path::new(places.collect(), ease)?);
        let rotations = keys.iter().map(|(time, pose)| (*time, pose.rotation));
        path.turning(rotations.collect(), ease)
    }

    /// The same path turning through `(time, rotation)` keys.
    ///
    /// # Errors
    /// As [`RigidPath::new`].
    pub fn turning(self, mut keys: Vec<(f64, DQuat)>, ease: Ease) -> Result<Self, PathError> {
        if keys.is_empty() {
            return Err(PathError::Empty);
        }
        for key in 0..keys.len() {
            let (time, rotation) = keys[key];
            let rises = key == 0 || keys[key - 1].0 < time;
            let length = rotation.length();
            let sound = time.is_finite() && length.is_finite() && length > 0.0;
            if !(sound && rises) {
                return Err(PathError::BadKey { key });
            }
            keys[key].1 = rotation.normalize();
        }
        if keys
            .iter()
            .all(|(_, rotation)| *rotation == DQuat::IDENTITY)
        {
            keys.clear();
        }
        Ok(Self {
            rotations: keys,
            ease,
            ..self
        })
    }

    /// Heap bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.displacement.bytes() + size_of_val(&*self.rotations)
    }

    /// Displacement u (m) of the origin and its velocity (m/s) at a time (s).
    #[must_use]
    pub fn displacement(&self, time: f64) -> (DVec3, DVec3) {
        self.displacement.at(time)
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

    /// Place `R X + u` (m) and velocity (m/s) at a time (s) of what lies at `X` (m).
    #[must_use]
    pub fn place(&self, x: DVec3, time: f64) -> (DVec3, DVec3) {
        let (displacement, velocity) = self.displacement.at(time);
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
            position: origin.position + self.displacement.at(time).0,
            rotation: (self.rotation(time).0 * origin.rotation).normalize(),
        }
    }
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
        let path = RigidPath::new(&keys, Ease::Smooth).unwrap();
        let still = (DQuat::IDENTITY, DVec3::ZERO);
        assert_eq!(path.rotation(0.0), still, "before");
        assert!(path.rotation(9.0).0.angle_between(tilted) < 1e-12, "after");
        let half = path.rotation(1.5).0;
        assert!(
            half.angle_between(DQuat::from_rotation_z(0.6)) < 1e-12,
            "half way: {half}"
        );
        for time in [1.3, 2.4, 3.6] {
            let d = 1e-6;
            let (a, b) = (path.rotation(time - d).0, path.rotation(time + d).0);
            let rate = (b * a.inverse()).to_scaled_axis() / (2.0 * d);
            assert!(
                (rate - path.rotation(time).1).length() < 1e-6,
                "rate at {time}: {rate}"
            );
        }
    }

    /// Distances stay, to round-off, and velocities are the slopes of places: what turns together stays rigid.
    #[test]
    fn places_turn_rigidly_at_the_velocity_stated() {
        let rotation = DQuat::from_axis_angle(DVec3::new(2.0, -1.0, 2.0) / 3.0, 2.9);
        let position = DVec3::new(0.1, 0.0, 2.0);
        let end = Pose { position, rotation };
        let path = RigidPath::new(&[(1.0, Pose::IDENTITY), (3.0, end)], Ease::Linear).unwrap();
        let places = [DVec3::ZERO, DVec3::new(0.4, -1.0, 7.0), DVec3::X * 3.0];
        for time in [0.0, 1.0, 1.7, 2.9, 3.0, 4.0] {
            let now = places.map(|x| path.place(x, time));
            for k in 0..3 {
                let (a, b) = (k, (k + 1) % 3);
                let length = places[a].distance(places[b]);
                let found = now[a].0.distance(now[b].0);
                assert!(
                    (found / length - 1.0).abs() < 1e-14,
                    "{found} of {length} m"
                );
            }
            let inner = (1.1..2.95).contains(&time);
            for (x, (_, velocity)) in places.iter().zip(now).filter(|_| inner) {
                let slope = path.place(*x, time + 1e-6).0 - path.place(*x, time - 1e-6).0;
                assert!((slope / 2e-6 - velocity).length() < 1e-7, "{x} at {time}");
            }
        }
        for x in places {
            assert!((path.place(x, 5.0).0 - end.apply(x)).length() < 1e-14);
        }
    }

    #[test]
    fn refuses_what_is_no_rotation() {
        let zero = turned(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0));
        let error = RigidPath::new(&[(0.0, zero)], Ease::Linear).unwrap_err();
        assert_eq!(error, PathError::BadKey { key: 0 }, "zero");
        let none = RigidPath::new(&[], Ease::Linear);
        assert_eq!(none, Err(PathError::Empty), "empty");
        let twice = [(0.0, Pose::IDENTITY), (0.0, Pose::IDENTITY)];
        let error = RigidPath::new(&twice, Ease::Linear).unwrap_err();
        assert_eq!(error, PathError::BadKey { key: 1 }, "at one time");
    }
}
