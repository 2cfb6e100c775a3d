//! Where to look from, and how to light, if the file does not say.

mod occupancy;

use crate::types::{Scene, SceneCamera, SceneLight};
use glam::{DQuat, DVec2, DVec3, Vec3};
use occupancy::{Occupancy, UP, is_seen};
use std::collections::HashSet;
use std::f64::consts::TAU;
use umbrage::{Aabb, Light};

/// Vertical field of view of default views, radians.
const FOV_Y_RAD: f64 = 50.0 * TAU / 360.0;
/// Width over height that default views are composed for.
const ASPECT: f64 = 16.0 / 9.0;
/// Rays of the thumbnail that a candidate view is judged by.
const THUMBNAIL: [u32; 2] = [32, 18];
/// Far over near distance at most: deeper ranges make every shadow map look bad near the viewer.
const MAX_DEPTH_RATIO: f64 = 1000.0;
/// Height of the default sun, radians.
const SUN_ELEVATION_RAD: f64 = TAU / 8.0;

impl Scene {
    /// The scene's first camera, else a view chosen to show it and its shadows: into closed rooms
    /// and wide worlds from within, a little above the ground; of single objects from outside, a
    /// little from above. Near and far distance follow from the scene's size.
    ///
    /// Takes a fraction of a second for millions of triangles; the same scene gives the same view.
    pub fn default_view(&self) -> SceneCamera {
        self.cameras
            .first()
            .cloned()
            .unwrap_or_else(|| match self.bounds() {
                b if b.is_empty() => camera(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, 0.1, 100.0),
                b => compose(&Occupancy::of(self, b), b),
            })
    }

    /// The scene's first light that casts shadows from one direction or into one cone, else an
    /// afternoon sun 45° high that suits [`default_view`](Self::default_view).
    pub fn default_light(&self) -> SceneLight {
        self.light_for_view(&self.default_view())
    }

    /// The light of [`default_light`](Self::default_light) for another view: the sun stands to the
    /// side of the viewer, where it lights much of what is seen and throws long shadows across it.
    pub fn light_for_view(&self, view: &SceneCamera) -> SceneLight {
        let own = self
            .lights
            .iter()
            .find(|l| l.light.is_some() && l.intensity > 0.0);
        own.cloned().unwrap_or_else(|| SceneLight {
            name: "sun".into(),
            light: Some(Light::Directional {
                direction: sun_direction(self, view),
            }),
            color: Vec3::new(1.0, 0.95, 0.86),
            intensity: 100_000.0,
        })
    }
}

fn camera(eye: DVec3, target: DVec3, near: f64, far: f64) -> SceneCamera {
    SceneCamera {
        name: "default".into(),
        eye,
        target,
        up: DVec3::Y,
        fov_y_rad: FOV_Y_RAD,
        near,
        far,
    }
}

/// The best of many views.
fn compose(grid: &Occupancy, bounds: Aabb) -> SceneCamera {
    let content = grid.content();
    let typical_height = content.map_or(bounds.size().y * 0.2, |(_, height)| height);
    let focus = content.map_or(bounds, |(around, _)| around);
    let width = |b: Aabb| b.size().x.max(b.size().z);
    let is_room = encloses(grid, bounds);
    // Worlds are stood in, objects are looked at.
    let is_world = grid.floor_share() > 0.8 && focus.size().y < 0.25 * width(focus);
    let candidates = if is_room || is_world {
        within(grid, bounds, typical_height, is_room)
    } else {
        around(focus, bounds)
    };
    let judged = candidates
        .into_iter()
        .map(|(eye, target)| Judged::new(grid, eye, target));
    let judged: Vec<Judged> = judged.collect();
    let most_seen = judged.iter().map(|j| j.cells_seen).max().unwrap_or(0);
    let best = judged
        .iter()
        .max_by(|a, b| a.score(most_seen).total_cmp(&b.score(most_seen)))
        .map(|j| (j.eye, j.target, j.nearest));
    // Nowhere to stand: from outside, whatever is seen.
    let (eye, target, nearest) = best.unwrap_or_else(|| {
        let (eye, target) = around(focus, bounds)[0];
        (eye, target, f64::INFINITY)
    });
    let forward = (target - eye).normalize();
    let depths = bounds.corners().map(|c| forward.dot(c - eye));
    let far = depths.into_iter().fold(0.0, f64::max) * 1.02;
    let nearest = nearest.min(far) - 2.0 * grid.cell.max_element();
    let near = (0.5 * nearest).clamp(far / MAX_DEPTH_RATIO, far / 5.0);
    camera(eye, target, near, far)
}

/// Whether walls close the scene off on all sides, so that outside there is nothing to see.
fn encloses(grid: &Occupancy, bounds: Aabb) -> bool {
    const RAYS: u32 = 24;
    let size = bounds.size();
    let inwards = [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z];
    let closed = inwards.into_iter().all(|inward| {
        let depth = size.dot(inward.abs());
        let across = DVec3::new(inward.z, 0.0, inward.x).abs() * size;
        let corner = DVec3::select(inward.cmplt(DVec3::ZERO), bounds.max, bounds.min);
        let corner = corner.with_y(bounds.min.y);
        let along = across
            * if inward.min_element() < 0.0 {
                -1.0
            } else {
                1.0
            };
        let hits = (0..RAYS * RAYS).filter(|k| {
            let u = (f64::from(k % RAYS) + 0.5) / f64::from(RAYS);
            let v = (f64::from(k / RAYS) + 0.5) / f64::from(RAYS);
            let from = corner + along * (0.05 + 0.9 * u) + DVec3::Y * size.y * (0.08 + 0.5 * v);
            let seen = grid.look(from - inward * depth * 0.01, inward);
            seen.is_some_and(|s| s.distance < 0.06 * depth)
        });
        hits.count() as f64 > 0.8 * f64::from(RAYS * RAYS)
    });
    let center = bounds.center();
    let reach = (0..64).map(|k| {
        let direction = DQuat::from_rotation_y(f64::from(k) / 64.0 * TAU) * DVec3::X;
        let wall = (size / 2.0 / direction.abs())
            .with_y(f64::INFINITY)
            .min_element();
        grid.look(center, direction)
            .map_or(0.0, |s| (s.distance / wall).min(1.0))
    });
    closed && reach.sum::<f64>() / 64.0 > 0.5
}

/// Views from outside onto a box, at distances where it fills the picture.
fn around(focus: Aabb, bounds: Aabb) -> Vec<(DVec3, DVec3)> {
    let center = focus.center();
    let slopes = DVec2::new(ASPECT, 1.0) * (FOV_Y_RAD / 2.0).tan() * 0.88;
    let mut views = Vec::new();
    for elevation_deg in [12.0_f64, 22.0, 32.0] {
        for k in 0..16 {
            let azimuth = (f64::from(k) + 0.5) / 16.0 * TAU;
            let (sin, cos) = elevation_deg.to_radians().sin_cos();
            let back = DVec3::new(azimuth.sin() * cos, sin, azimuth.cos() * cos);
            let right = DVec3::Y.cross(back).normalize();
            let up = back.cross(right);
            // Each corner must lie within the side planes.
            let needed = focus.corners().into_iter().map(|c| {
                let v = c - center;
                let beside = DVec2::new(v.dot(right), v.dot(up)).abs() / slopes;
                v.dot(back) + beside.max_element()
            });
            let smallest = bounds.size().max_element().max(1e-3) * 1e-3;
            let distance = needed.fold(smallest, f64::max);
            views.push((center + back * distance, center));
        }
    }
    views
}

/// Views from places inside a box where one can stand.
fn within(
    grid: &Occupancy,
    bounds: Aabb,
    typical_height: f64,
    is_room: bool,
) -> Vec<(DVec3, DVec3)> {
    let half = bounds.size() / 2.0;
    let center = bounds.center();
    let heights = match is_room {
        true => [0.15 * bounds.size().y, 0.3 * bounds.size().y],
        false => [0.6 * typical_height, 1.4 * typical_height],
    };
    let mut views = Vec::new();
    for ring in [0.35, 0.6, 0.85] {
        for k in 0..24 {
            let azimuth = (f64::from(k) + 0.5) / 24.0 * TAU;
            let offset = DVec3::new(azimuth.sin(), 0.0, azimuth.cos()) * half * ring;
            for height in heights {
                let ground = center + offset;
                let height = height.max(3.0 * grid.cell.y);
                let eye = ground.with_y(grid.floor_at(ground) + height);
                if !grid.is_free(eye) {
                    continue;
                }
                for turn_deg in [-28.0_f64, 0.0, 28.0] {
                    for pitch_deg in [4.0_f64, 11.0] {
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

/// What a candidate view shows, as shares of its picture.
struct Judged {
    eye: DVec3,
    target: DVec3,
    /// Least depth of anything seen, metres.
    nearest: f64,
    /// Different cells seen that stand out.
    cells_seen: usize,
    /// Anything at all.
    hit: f64,
    /// Surfaces from behind.
    behind: f64,
    /// Nothing where there should be ground.
    void: f64,
    /// What stands out.
    content: f64,
    /// Surfaces that face up: they receive the shadows.
    upward: f64,
    /// Things right before the eye.
    close: f64,
    /// Standard deviation of the depth's logarithm.
    depth_spread: f64,
}

impl Judged {
    fn new(grid: &Occupancy, eye: DVec3, target: DVec3) -> Self {
        let to_target = target - eye;
        let forward = to_target.normalize();
        let right = forward.cross(DVec3::Y).normalize_or(DVec3::X);
        let up = right.cross(forward);
        let slope = (FOV_Y_RAD / 2.0).tan();
        let [width, height] = THUMBNAIL;
        let rays = f64::from(width * height);
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
        };
        let mut seen = HashSet::new();
        let mut depths = Vec::new();
        for k in 0..width * height {
            let x = (f64::from(k % width) + 0.5) / f64::from(width) * 2.0 - 1.0;
            let y = (f64::from(k / width) + 0.5) / f64::from(height) * 2.0 - 1.0;
            let direction = forward + right * (x * slope * ASPECT) + up * (y * slope);
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
            counts.close += share(sight.distance < 0.08 * to_target.length());
            counts.nearest = counts.nearest.min(sight.distance);
            if stands_out {
                seen.insert(sight.cell);
            }
            depths.push(sight.distance.max(1e-9).ln());
        }
        counts.cells_seen = seen.len();
        let n = depths.len().max(1) as f64;
        let mean = depths.iter().sum::<f64>() / n;
        counts.depth_spread = (depths.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n).sqrt();
        counts
    }

    /// Higher is better. The weights were chosen by looking at pictures.
    fn score(&self, most_seen: usize) -> f64 {
        let peak = |x: f64, best: f64| 1.0 - ((x - best) / best).abs().min(1.0);
        let seen = self.cells_seen as f64 / most_seen.max(1) as f64;
        1.0 * seen
            + 0.8 * peak(self.content, 0.4)
            + 0.6 * peak(self.upward, 0.45)
            + 0.5 * (self.depth_spread / 0.8).min(1.0)
            + 0.5 * (self.hit / 0.6).min(1.0)
            - 3.0 * self.behind
            - 1.5 * self.void
            - 2.0 * self.close
    }
}

/// Direction of travel of a sun that suits a view.
fn sun_direction(scene: &Scene, view: &SceneCamera) -> DVec3 {
    let _ = scene;
    let ahead = (view.target - view.eye)
        .with_y(0.0)
        .normalize_or(DVec3::NEG_Z);
    let towards = DQuat::from_rotation_y(100.0_f64.to_radians()) * ahead;
    let (sin, cos) = SUN_ELEVATION_RAD.sin_cos();
    -(towards * cos + DVec3::Y * sin)
}
