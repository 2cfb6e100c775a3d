use super::occupancy::{Occupancy, UP, is_seen};
use super::{THUMBNAIL, thumbnail};
use crate::types::Lens;
use glam::DVec3;
use std::collections::HashSet;

/// Measures of what a candidate view shows. Shares are of its picture.
pub(super) struct Judged {
    pub(super) eye: DVec3,
    pub(super) target: DVec3,
    /// Least depth of any visible surface, metres.
    pub(super) nearest: f64,
    /// Number of different visible cells that stand out from the ground.
    pub(super) cells_seen: usize,
    /// Share that shows any surface.
    hit: f64,
    /// Share that shows the back of a surface.
    behind: f64,
    /// Share that shows the sky below the horizon, where there should be ground.
    void: f64,
    /// Share that shows cells which stand out from the ground.
    content: f64,
    /// Share that shows surfaces facing up, which receive the shadows.
    upward: f64,
    /// Share that shows surfaces close to the eye.
    close: f64,
    /// Standard deviation of the logarithm of depth.
    depth_spread: f64,
    /// Geometric mean of depth over the longest edge of the scene's box.
    mean_depth: f64,
    /// The lesser of two shares: of surfaces that face along x, and of surfaces that face along z.
    sides: f64,
}

impl Judged {
    pub(super) fn new(grid: &Occupancy, eye: DVec3, target: DVec3, fov_y_rad: f64) -> Self {
        let rays = f64::from(THUMBNAIL[0] * THUMBNAIL[1]);
        let mut counts = Self {
            eye,
            target,
            nearest: f64::INFINITY,
            cells_seen: 0,
            hit: 0.0,
            behind: 0.0,
            void: 0.0,
            content: 0.0,
            upward: 0.0,
            close: 0.0,
            depth_spread: 0.0,
            mean_depth: 0.0,
            sides: 0.0,
        };
        let mut facing_along = [0.0; 2];
        let mut seen = HashSet::new();
        let mut depths = Vec::new();
        for [_, direction] in thumbnail(eye, target, Lens::Perspective { fov_y_rad }) {
            let Some(sight) = grid.look(eye, direction) else {
                counts.void += f64::from(u8::from(direction.y < 0.0)) / rays;
                continue;
            };
            let share = |yes: bool| if yes { 1.0 / rays } else { 0.0 };
            let stands_out = grid.stands_out(sight.cell);
            counts.hit += 1.0 / rays;
            counts.behind += share(!is_seen(sight.facing, direction));
            counts.content += share(stands_out);
            counts.upward += share(sight.facing & UP != 0);
            counts.close += share(sight.distance < 0.15 * eye.distance(target));
            counts.nearest = counts.nearest.min(sight.distance);
            for (share_along, axis) in facing_along.iter_mut().zip([DVec3::X, DVec3::Z]) {
                let towards_eye = axis * direction.dot(axis).signum();
                *share_along += share(is_seen(sight.facing, towards_eye));
            }
            if stands_out {
                seen.insert(sight.cell);
            }
            depths.push(sight.distance.max(1e-9).ln());
        }
        counts.cells_seen = seen.len();
        counts.sides = facing_along[0].min(facing_along[1]);
        let n = depths.len().max(1) as f64;
        let mean = depths.iter().sum::<f64>() / n;
        counts.mean_depth = mean.exp() / grid.longest();
        counts.depth_spread = (depths.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n).sqrt();
        counts
    }

    /// Score of the view; higher is better. The weights were chosen by comparing pictures.
    pub(super) fn score(&self, most_seen: usize, is_room: bool) -> f64 {
        let peak = |x: f64, best: f64| 1.0 - ((x - best) / best).abs().min(1.0);
        let seen = self.cells_seen as f64 / most_seen.max(1) as f64;
        // In a room, everything fills the picture, so views along the room are preferred.
        let far = if is_room { 4.0 * self.mean_depth.min(0.5) } else { 0.0 };
        far + 1.0 * seen
            + 0.8 * peak(self.content, 0.4)
            + 0.6 * peak(self.upward, 0.45)
            + 0.5 * (self.depth_spread / 0.8).min(1.0)
            + 2.0 * (self.hit / 0.8).min(1.0)
            + 0.6 * (self.sides / self.hit.max(0.01) / 0.3).min(1.0)
            - 3.0 * self.behind
            - 5.0 * self.void
            - 4.0 * self.close
    }
}
