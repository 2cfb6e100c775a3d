//! Where the viewer is and looks, moved by mouse and keys.

use glam::{DQuat, DVec3};

/// The steepest that a view can look up or down, degrees.
const STEEPEST_DEG: f64 = 89.0;

/// The eye, the point that it looks at, and the direction that stays up while the view turns. The
/// target is also the point that an orbit is around.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    /// Position of the eye, world space, metres.
    pub(crate) eye: DVec3,
    /// The point in the middle of the picture, world space, metres.
    pub(crate) target: DVec3,
    /// Unit vector.
    pub(crate) up: DVec3,
}

impl Pose {
    /// A pose whose `up` is the world's wherever that gives the same picture as the camera's own,
    /// so that turning to the side keeps the horizon level.
    pub(crate) fn new(eye: DVec3, target: DVec3, up: DVec3) -> Self {
        let forward = target - eye;
        let is_level = forward.cross(up).normalize_or_zero().y.abs() < 1e-6 && up.y > 0.0;
        let is_vertical = forward.cross(DVec3::Y).length() < 1e-6 * forward.length();
        let up = if is_level && !is_vertical { DVec3::Y } else { up.normalize_or(DVec3::Y) };
        Self { eye, target, up }
    }

    /// Distance from the eye to the target, metres.
    pub(crate) fn distance(&self) -> f64 {
        self.eye.distance(self.target)
    }

    /// The view direction, a unit vector.
    pub(crate) fn forward(&self) -> DVec3 {
        (self.target - self.eye).normalize_or(DVec3::NEG_Z)
    }

    /// The direction to the right in the picture, a unit vector.
    pub(crate) fn right(&self) -> DVec3 {
        self.forward()
            .cross(self.up)
            .try_normalize()
            .unwrap_or_else(|| self.up.any_orthonormal_vector())
    }

    /// Turns the head: to the right and upwards, radians.
    pub(crate) fn look(&mut self, right_rad: f64, up_rad: f64) {
        let distance = self.distance();
        self.target = self.eye + self.turned(right_rad, up_rad) * distance;
    }

    /// Moves the eye around the target: to the right and upwards, radians.
    pub(crate) fn orbit(&mut self, right_rad: f64, up_rad: f64) {
        let distance = self.distance();
        self.eye = self.target - self.turned(-right_rad, -up_rad) * distance;
    }

    /// Moves the viewer to the right, upwards and forward, metres.
    pub(crate) fn walk(&mut self, step: DVec3) {
        let right = self.right();
        let forward = self.forward();
        let moved = right * step.x + right.cross(forward) * step.y + forward * step.z;
        self.eye += moved;
        self.target += moved;
    }

    /// Brings the eye nearer to the target, to this share of its distance.
    pub(crate) fn approach(&mut self, share: f64) {
        let distance = (self.distance() * share).clamp(1e-6, 1e11);
        self.eye = self.target - self.forward() * distance;
    }

    /// The view direction after a turn to the right and upwards, radians. It never becomes
    /// vertical, where the picture would turn over.
    fn turned(&self, right_rad: f64, up_rad: f64) -> DVec3 {
        let forward = self.forward();
        let height = forward.dot(self.up).clamp(-1.0, 1.0);
        let level = (forward - self.up * height)
            .try_normalize()
            .unwrap_or_else(|| self.up.any_orthonormal_vector());
        let level = DQuat::from_axis_angle(self.up, -right_rad) * level;
        let most = STEEPEST_DEG.to_radians();
        let (sin, cos) = (height.asin() + up_rad).clamp(-most, most).sin_cos();
        level * cos + self.up * sin
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn pose() -> Pose {
        Pose::new(DVec3::new(0.0, 1.0, 5.0), DVec3::new(0.0, 1.0, 0.0), DVec3::Y)
    }

    #[test]
    fn looking_keeps_the_eye_and_orbiting_the_target() {
        let mut looked = pose();
        looked.look(FRAC_PI_2, 0.0);
        assert_eq!(looked.eye, pose().eye);
        assert!(looked.forward().distance(DVec3::X) < 1e-12, "to the right");
        let mut orbited = pose();
        orbited.orbit(FRAC_PI_2, 0.0);
        assert_eq!(orbited.target, pose().target);
        assert!(orbited.eye.distance(DVec3::new(5.0, 1.0, 0.0)) < 1e-12, "{}", orbited.eye);
        orbited.orbit(0.0, 0.5);
        assert!(orbited.eye.y > 1.0 && (orbited.distance() - 5.0).abs() < 1e-12);
    }

    #[test]
    fn the_picture_never_turns_over() {
        let mut pose = pose();
        for _ in 0..100 {
            pose.look(0.1, 0.3);
            pose.orbit(0.2, 0.3);
            assert!(pose.right().y.abs() < 1e-9 && pose.forward().y.abs() < 1.0);
            assert!(pose.right().cross(pose.forward()).y > 0.0, "up stays up");
        }
        // A camera that looks straight down has an up of its own.
        let mut down = Pose::new(DVec3::Y, DVec3::ZERO, DVec3::NEG_Z);
        assert_eq!(down.up, DVec3::NEG_Z);
        down.look(0.1, 0.1);
        assert!(down.forward().is_finite());
    }

    #[test]
    fn steps_are_along_the_picture() {
        let mut pose = pose();
        pose.walk(DVec3::new(1.0, 2.0, 3.0));
        assert!(pose.eye.distance(DVec3::new(1.0, 3.0, 2.0)) < 1e-12, "{}", pose.eye);
        assert!((pose.distance() - 5.0).abs() < 1e-12);
        pose.approach(0.5);
        assert!((pose.distance() - 2.5).abs() < 1e-12);
        for _ in 0..100 {
            pose.approach(0.0);
        }
        assert!(pose.distance() > 0.0 && pose.forward().is_finite());
    }
}
