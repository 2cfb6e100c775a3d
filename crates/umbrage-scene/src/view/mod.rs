//! Where to look from, and how to light, if the file does not say.

mod occupancy;

use crate::types::{Scene, SceneCamera, SceneLight};
use glam::{DQuat, DVec2, DVec3, Vec3};
use occupancy::{Occupancy, UP, is_seen};
use std::collections::HashSet;
use std::f64::consts::TAU;
use umbrage::{Aabb, Light};

/// Vertical field of view of views into rooms and worlds, radians.
const WIDE_RAD: f64 = 50.0 * TAU / 360.0;
/// Vertical field of view of views onto objects, radians: long lenses keep their shape.
const LONG_RAD: f64 = 32.0 * TAU / 360.0;
/// Width over height that default views are composed for.
const ASPECT: f64 = 16.0 / 9.0;
/// Rays of the thumbnail that a candidate view is judged by.
const THUMBNAIL: [u32; 2] = [32, 18];
/// Views whose light is tried out.
const SHORT_LIST: usize = 40;
/// Far over near distance at most: deeper ranges make every shadow map look bad near the viewer.
const MAX_DEPTH_RATIO: f64 = 1000.0;

impl Scene {
    /// The scene's first camera, else a view chosen to show it and its shadows: into closed rooms
    /// and wide worlds from within, a little above the ground; of single objects from outside, a
    /// little from above. Near and far distance follow from the scene's size.
    ///
    /// Takes a fraction of a second for millions of triangles; the same scene gives the same view.
    pub fn default_view(&self) -> SceneCamera {
        self.cameras.first().cloned().unwrap_or_else(|| match self.bounds() {
            b if b.is_empty() => {
                camera(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, WIDE_RAD, 0.1, 100.0)
            }
            b => compose(&Occupancy::of(self, b), b, self.own_light().and_then(|l| l.light)),
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
        self.own_light().cloned().unwrap_or_else(|| {
            let light = match self.bounds() {
                b if b.is_empty() => Light::Directional {
                    direction: -towards_sun(view.target - view.eye, 100.0, 45.0),
                },
                b => {
                    let grid = Occupancy::of(self, b);
                    lighting(&grid, None, view.eye, view.target, view.fov_y_rad).light
                }
            };
            SceneLight {
                name: "sun".into(),
                light: Some(light),
                color: Vec3::new(1.0, 0.95, 0.86),
                intensity: 100_000.0,
            }
        })
    }

    fn own_light(&self) -> Option<&SceneLight> {
        self.lights.iter().find(|l| l.light.is_some() && l.intensity > 0.0)
    }
}

fn camera(eye: DVec3, target: DVec3, fov_y_rad: f64, near: f64, far: f64) -> SceneCamera {
    SceneCamera { name: "default".into(), eye, target, up: DVec3::Y, fov_y_rad, near, far }
}

/// The best of many views.
fn compose(grid: &Occupancy, bounds: Aabb, light: Option<Light>) -> SceneCamera {
    let content = grid.content();
    let typical_height = content.map_or(bounds.size().y * 0.2, |(_, height)| height);
    let has_ground = grid.floor_share() > 0.8;
    let focus = content.filter(|_| has_ground).map_or(bounds, |(around, _)| around);
    let flatness = focus.size().y / focus.size().x.max(focus.size().z);
    let is_room = is_room(grid, bounds);
    // Worlds are stood in, objects are looked at.
    let is_world = flatness < 0.12 || flatness < 0.25 && has_ground;
    let mut candidates = match is_room || is_world {
        true => within(grid, focus, typical_height, is_room),
        false => Vec::new(),
    };
    // Where there is nowhere to stand, too, the view is from outside.
    let from_outside = candidates.is_empty();
    if from_outside {
        candidates = around(&grid.points_in(focus), bounds);
    }
    let fov_y_rad = if from_outside { LONG_RAD } else { WIDE_RAD };
    // Objects without ground only shade themselves.
    let light_weight = if from_outside && !has_ground { 0.7 } else { 2.0 };
    let judge = |(eye, target)| Judged::new(grid, eye, target, fov_y_rad);
    let mut judged: Vec<Judged> = candidates.into_iter().map(judge).collect();
    let most_seen = judged.iter().map(|j| j.cells_seen).max().unwrap_or(0);
    let score = |j: &Judged| j.score(most_seen, is_room);
    judged.sort_by(|a, b| score(b).total_cmp(&score(a)));
    judged.truncate(SHORT_LIST);
    // Among the best, that with the most to see in the light that it will have.
    let lit_score = |j: &Judged| {
        let lit = lighting(grid, light, j.eye, j.target, fov_y_rad);
        score(j) + light_weight * lit.score
    };
    let scores: Vec<f64> = judged.iter().map(lit_score).collect();
    let best = (0..judged.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]));
    let Some(best) = best.map(|i| &judged[i]) else {
        unreachable!("there is always a view from outside")
    };
    let forward = (best.target - best.eye).normalize();
    let depths = bounds.corners().map(|c| forward.dot(c - best.eye));
    let far = depths.into_iter().fold(0.0, f64::max) * 1.02;
    let nearest = best.nearest.min(far) - 2.0 * grid.cell.max_element();
    let near = (0.5 * nearest).clamp(far / MAX_DEPTH_RATIO, far / 5.0);
    camera(best.eye, best.target, fov_y_rad, near, far)
}

/// Whether walls close the scene off at its sides, so that from outside there is little to see.
fn is_room(grid: &Occupancy, bounds: Aabb) -> bool {
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
    // In a room, unlike in a car or a rock, one can see far.
    let reach = (0..64).map(|k| {
        let direction = DQuat::from_rotation_y(f64::from(k) / 64.0 * TAU) * DVec3::X;
        let wall = (size / 2.0 / direction.abs()).with_y(f64::INFINITY).min_element();
        let sight = grid.look(bounds.center(), direction);
        sight.map_or(0.0, |s| (s.distance / wall).min(1.0))
    });
    reach.sum::<f64>() > 0.5 * 64.0
        && [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z].into_iter().all(is_wall)
}

/// Views from outside onto some points, at distances where they fill the picture.
fn around(points: &[DVec3], bounds: Aabb) -> Vec<(DVec3, DVec3)> {
    let center = Aabb::around(points.iter().copied()).center();
    let slopes = DVec2::new(ASPECT, 1.0) * (LONG_RAD / 2.0).tan() * 0.86;
    let closest = bounds.size().max_element().max(1e-6) * 1e-3;
    let mut views = Vec::new();
    for elevation_deg in [12.0_f64, 22.0, 32.0] {
        for k in 0..16 {
            let azimuth = (f64::from(k) + 0.5) / 16.0 * TAU;
            let (sin, cos) = elevation_deg.to_radians().sin_cos();
            let back = DVec3::new(azimuth.sin() * cos, sin, azimuth.cos() * cos);
            let right = DVec3::Y.cross(back).normalize();
            let up = back.cross(right);
            // The side planes (left, right, bottom, top) that touch the points from outside meet at
            // the eye: two and two give its place across, whichever pair is wider its distance.
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

/// Views from places inside a box where one can stand.
fn within(
    grid: &Occupancy,
    focus: Aabb,
    typical_height: f64,
    is_room: bool,
) -> Vec<(DVec3, DVec3)> {
    let half = focus.size() / 2.0;
    let heights = match is_room {
        true => [0.12, 0.25].map(|share| share * focus.size().y),
        false => [0.6, 1.4].map(|times| times * typical_height),
    };
    let mut views = Vec::new();
    for ring in [0.35, 0.6, 0.85] {
        for k in 0..24 {
            let azimuth = (f64::from(k) + 0.5) / 24.0 * TAU;
            let offset = DVec3::new(azimuth.sin(), 0.0, azimuth.cos()) * half * ring;
            for height in heights {
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

/// The eye's directions through the pixels of a thumbnail, row by row from below, of unit depth.
fn thumbnail(eye: DVec3, target: DVec3, fov_y_rad: f64) -> impl Iterator<Item = DVec3> {
    let forward = (target - eye).normalize();
    let right = forward.cross(DVec3::Y).normalize_or(DVec3::X);
    let up = right.cross(forward);
    let slope = (fov_y_rad / 2.0).tan();
    let [width, height] = THUMBNAIL;
    (0..width * height).map(move |k| {
        let x = (f64::from(k % width) + 0.5) / f64::from(width) * 2.0 - 1.0;
        let y = (f64::from(k / width) + 0.5) / f64::from(height) * 2.0 - 1.0;
        forward + right * (x * slope * ASPECT) + up * (y * slope)
    })
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
    /// Mean depth over the scene's longest edge.
    mean_depth: f64,
    /// The lesser of the shares that show surfaces facing along x and along z.
    sides: f64,
}

impl Judged {
    fn new(grid: &Occupancy, eye: DVec3, target: DVec3, fov_y_rad: f64) -> Self {
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
        for direction in thumbnail(eye, target, fov_y_rad) {
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
            counts.close += share(sight.distance < 0.08 * eye.distance(target));
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
        counts.mean_depth = mean.exp() / (grid.longest());
        counts.depth_spread = (depths.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n).sqrt();
        counts
    }

    /// Higher is better. The weights were chosen by looking at pictures.
    fn score(&self, most_seen: usize, is_room: bool) -> f64 {
        let peak = |x: f64, best: f64| 1.0 - ((x - best) / best).abs().min(1.0);
        let seen = self.cells_seen as f64 / most_seen.max(1) as f64;
        // In a room everything fills the picture: what counts is to look along it.
        let far = if is_room { 4.0 * self.mean_depth.min(0.5) } else { 0.0 };
        far + 1.0 * seen
            + 0.8 * peak(self.content, 0.4)
            + 0.6 * peak(self.upward, 0.45)
            + 0.5 * (self.depth_spread / 0.8).min(1.0)
            + 0.5 * (self.hit / 0.6).min(1.0)
            + 0.6 * (self.sides / self.hit.max(0.01) / 0.3).min(1.0)
            - 3.0 * self.behind
            - 1.5 * self.void
            - 2.0 * self.close
    }
}

/// A light for a view, and how good it is there.
struct Lighting {
    light: Light,
    /// Higher is better; at most about 1.
    score: f64,
}

/// `own`, or else the sun that suits a view: it stands to the side of the viewer, where it lights
/// most of what is seen and many edges of shadows show. Its elevation is 45°, lower only over land
/// so gentle that no shadows would fall.
fn lighting(
    grid: &Occupancy,
    own: Option<Light>,
    eye: DVec3,
    target: DVec3,
    fov_y_rad: f64,
) -> Lighting {
    let seen: Vec<Option<DVec3>> = thumbnail(eye, target, fov_y_rad)
        .map(|direction| {
            let sight = grid.look(eye, direction)?;
            // A little before the surface, so that its own cells do not shade it.
            let back = 1.5 * grid.cell.max_element() / direction.length();
            Some(eye + direction * (sight.distance - back).max(0.0))
        })
        .collect();
    // How good a light is, and the share of what is seen that it leaves dark.
    let judge = |light: &Light| {
        let is_lit = |p: DVec3| grid.look(p, light.direction_to_light(p)).is_none();
        let lit: Vec<Option<bool>> = seen.iter().map(|p| p.map(is_lit)).collect();
        let count = lit.iter().flatten().count().max(1) as f64;
        let dark = lit.iter().flatten().filter(|&&l| !l).count() as f64 / count;
        let neighbours = lit.chunks(THUMBNAIL[0] as usize).flat_map(|row| row.windows(2));
        let edges = neighbours.filter(|w| w[0].zip(w[1]).is_some_and(|(a, b)| a != b));
        (2.0 * edges.count() as f64 / count - (dark - 0.4).abs(), dark)
    };
    if let Some(light) = own {
        return Lighting { light, score: judge(&light).0 };
    }
    let forward = target - eye;
    let mut best: Option<Lighting> = None;
    for elevation_deg in [45.0, 25.0, 12.0] {
        let mut most_dark: f64 = 0.0;
        for azimuth_deg in [60.0_f64, 80.0, 100.0, 120.0, 140.0] {
            for side in [1.0, -1.0] {
                let to_sun = towards_sun(forward, azimuth_deg * side, elevation_deg);
                let light = Light::Directional { direction: -to_sun };
                let (score, dark) = judge(&light);
                let score = score - 0.003 * (azimuth_deg - 100.0).abs();
                most_dark = most_dark.max(dark);
                if best.as_ref().is_none_or(|b| score > b.score) {
                    best = Some(Lighting { light, score });
                }
            }
        }
        if most_dark > 0.02 {
            break;
        }
    }
    best.unwrap_or_else(|| unreachable!("suns were tried"))
}

/// Unit vector towards a sun to the left of someone looking `forward`.
fn towards_sun(forward: DVec3, azimuth_deg: f64, elevation_deg: f64) -> DVec3 {
    let (sin, cos) = elevation_deg.to_radians().sin_cos();
    let ahead = forward.with_y(0.0).normalize_or(DVec3::NEG_Z);
    DQuat::from_rotation_y(azimuth_deg.to_radians()) * ahead * cos + DVec3::Y * sin
}
