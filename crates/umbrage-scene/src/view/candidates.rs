use super::occupancy::Occupancy;
use super::{ASPECT, LONG_RAD};
use glam::{DQuat, DVec2, DVec3};
use std::f64::consts::TAU;
use umbrage::Aabb;

/// Whether walls enclose the scene at its sides, so that little of it can be seen from outside.
pub(super) fn is_room(grid: &Occupancy, bounds: Aabb) -> bool {
    const RAYS: u32 = 24;
    let size = bounds.size();
    let is_wall = |inward: DVec3| {
        let depth = size.dot(inward.abs());
        let along = DVec3::new(inward.z, 0.0, inward.x).abs() * size;
        let corner = DVec3::select(inward.cmplt(DVec3::ZERO), bounds.max, bounds.min);
        let corner = corner.with_y(bounds.min.y) - inward * depth * 0.01;
        let hits = (0..RAYS * RAYS).filter(|k| {
            let u = (f64::from(k % RAYS) + 0.5) / f64::from(RAYS);
            let v = (f64::from(k / RAYS) + 0.5) / f64::from(RAYS);
            let from = corner + along * (0.05 + 0.9 * u) + DVec3::Y * size.y * (0.08 + 0.5 * v);
            grid.look(from, inward).is_some_and(|s| s.distance < 0.06 * depth)
        });
        hits.count() as f64 > 0.85 * f64::from(RAYS * RAYS)
    };
    // Inside a room one can see far, unlike inside a car or a rock.
    let reach = (0..64).map(|k| {
        let direction = DQuat::from_rotation_y(f64::from(k) / 64.0 * TAU) * DVec3::X;
        let wall = (size / 2.0 / direction.abs()).with_y(f64::INFINITY).min_element();
        let sight = grid.look(bounds.center(), direction);
        sight.map_or(0.0, |s| (s.distance / wall).min(1.0))
    });
    reach.sum::<f64>() > 0.5 * 64.0
        && [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z].into_iter().all(is_wall)
}

/// Views of `points` from outside, as (eye, target), at distances where the points fill the
/// picture.
pub(super) fn around(points: &[DVec3], bounds: Aabb) -> Vec<(DVec3, DVec3)> {
    let center = Aabb::around(points.iter().copied()).center();
    let slopes = DVec2::new(ASPECT, 1.0) * (LONG_RAD / 2.0).tan() * 0.86;
    let closest = bounds.size().max_element().max(1e-6) * 1e-3;
    let mut views = Vec::new();
    for elevation_deg in [12.0_f64, 22.0, 32.0] {
        // Most models are aligned with the axes. Views from directions between the axes show two of
        // their sides.
        for azimuth_deg in (0..4).flat_map(|quarter| [35, 55].map(|turn| quarter * 90 + turn)) {
            let azimuth = f64::from(azimuth_deg).to_radians();
            let (sin, cos) = elevation_deg.to_radians().sin_cos();
            let back = DVec3::new(azimuth.sin() * cos, sin, azimuth.cos() * cos);
            let right = DVec3::Y.cross(back).normalize();
            let up = back.cross(right);
            // The four side planes (left, right, bottom, top) that enclose the points meet at the
            // eye. Each pair gives the eye's position across the view direction, and the wider pair
            // its distance.
            let mut planes = [f64::NEG_INFINITY; 4];
            for p in points {
                let v = *p - center;
                let (x, y, z) = (v.dot(right), v.dot(up), v.dot(back));
                let reach =
                    [z * slopes.x - x, z * slopes.x + x, z * slopes.y - y, z * slopes.y + y];
                planes = std::array::from_fn(|i| planes[i].max(reach[i]));
            }
            let [left, right_most, bottom, top] = planes;
            let distance = ((left + right_most) / (2.0 * slopes.x))
                .max((bottom + top) / (2.0 * slopes.y))
                .max(closest);
            let target = center + right * (right_most - left) / 2.0 + up * (top - bottom) / 2.0;
            views.push((target + back * distance, target));
        }
    }
    views
}

/// Views from free places inside the box `focus`, as (eye, target).
pub(super) fn within(
    grid: &Occupancy,
    focus: Aabb,
    typical_height: f64,
    is_room: bool,
) -> Vec<(DVec3, DVec3)> {
    let half = focus.size() / 2.0;
    let heights: &[f64] = match is_room {
        true => &[0.12 * focus.size().y, 0.25 * focus.size().y],
        false => &[0.6, 1.4, 2.2].map(|times| times * typical_height),
    };
    let mut views = Vec::new();
    for ring in [0.35, 0.6, 0.85] {
        for k in 0..24 {
            let azimuth = (f64::from(k) + 0.5) / 24.0 * TAU;
            let offset = DVec3::new(azimuth.sin(), 0.0, azimuth.cos()) * half * ring;
            for &height in heights {
                let ground = focus.center() + offset;
                let height = height.max(3.0 * grid.cell.y);
                let eye = ground.with_y(grid.floor_at(ground) + height);
                if !grid.is_free(eye) {
                    continue;
                }
                for turn_deg in [-28.0_f64, 0.0, 28.0] {
                    for pitch_deg in [4.0_f64, 11.0, 18.0] {
                        let ahead = DQuat::from_rotation_y(turn_deg.to_radians()) * -offset;
                        let drop = ahead.length() * pitch_deg.to_radians().tan();
                        views.push((eye, eye + ahead - DVec3::Y * drop));
                    }
                }
            }
        }
    }
    views
}
