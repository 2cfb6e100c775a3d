//! Chooses a view and a light for scenes whose files have none.

mod candidates;
mod judge;
mod lighting;
mod nearest;
mod occupancy;

pub use nearest::side_planes;

use crate::types::{Lens, Scene, SceneCamera, SceneLight};
use candidates::{around, is_room, within};
use glam::{DVec3, Vec3};
use judge::Judged;
use lighting::{lighting, towards_sun};
use occupancy::Occupancy;
use std::cell::OnceCell;
use std::f64::consts::TAU;
use umbrage::{Aabb, Light};

/// Vertical field of view for views into rooms and landscapes, radians.
const WIDE_RAD: f64 = 50.0 * TAU / 360.0;
/// Vertical field of view for views of objects, radians. A narrow field of view keeps their shape.
const LONG_RAD: f64 = 32.0 * TAU / 360.0;
/// Aspect ratio (width over height) for which default views are composed.
const ASPECT: f64 = 16.0 / 9.0;
/// Width and height of the thumbnail, in rays, by which a candidate view is judged.
const THUMBNAIL: [u32; 2] = [32, 18];
/// Number of best views for which a light is tried.
const SHORT_LIST: usize = 40;
/// Largest ratio of far to near distance. Deeper ranges make every shadow map look bad near the
/// viewer.
const MAX_DEPTH_RATIO: f64 = 1000.0;

/// Composes views and lights of a scene, which share one grid.
struct Composer<'a> {
    scene: &'a Scene,
    bounds: Aabb,
    grid: OnceCell<Occupancy>,
}

impl Scene {
    /// The scene's first camera or, without one, a view chosen to show the scene and its shadows.
    /// Closed rooms and wide landscapes are seen from within, a little above the ground. Single
    /// objects are seen from outside, a little from above. Near and far distance follow from the
    /// scene's size.
    ///
    /// Takes a fraction of a second for millions of triangles. The same scene always gets the same
    /// view.
    pub fn default_view(&self) -> SceneCamera {
        Composer::of(self).view()
    }

    /// The scene's first light with an intensity above 0 or, without one, an afternoon sun that
    /// suits [`default_view`](Self::default_view). The sun's elevation is 45°, or less if the
    /// relief is so gentle that a sun at 45° would cast no shadows.
    pub fn default_light(&self) -> SceneLight {
        self.default_view_and_light().1
    }

    /// The [`default_view`](Self::default_view) and the [`default_light`](Self::default_light), in
    /// little more time than the view alone takes.
    pub fn default_view_and_light(&self) -> (SceneCamera, SceneLight) {
        let composer = Composer::of(self);
        let view = composer.view();
        let light = composer.light(&view);
        (view, light)
    }

    /// The light of [`default_light`](Self::default_light) for another view. The sun is at the side
    /// of the viewer, where it lights many of the visible surfaces and casts long shadows across
    /// them.
    pub fn light_for_view(&self, view: &SceneCamera) -> SceneLight {
        Composer::of(self).light(view)
    }

    /// The first light with an intensity above 0.
    pub fn own_light(&self) -> Option<&SceneLight> {
        self.lights.iter().find(|l| l.intensity > 0.0)
    }
}

impl<'a> Composer<'a> {
    fn of(scene: &'a Scene) -> Self {
        Self { scene, bounds: scene.bounds(), grid: OnceCell::new() }
    }

    /// The scene's grid, built when it is first needed; `None` if there is nothing to see.
    fn grid(&self) -> Option<&Occupancy> {
        let build = || Occupancy::of(self.scene, self.bounds);
        (!self.bounds.is_empty()).then(|| self.grid.get_or_init(build))
    }

    fn view(&self) -> SceneCamera {
        if let Some(camera) = self.scene.cameras.first() {
            return camera.clone();
        }
        match self.grid() {
            None => camera(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, WIDE_RAD, 0.1, 100.0),
            Some(grid) => compose(grid, self.bounds, self.scene.own_light().map(|l| l.light)),
        }
    }

    fn light(&self, view: &SceneCamera) -> SceneLight {
        self.scene.own_light().cloned().unwrap_or_else(|| {
            let light = match self.grid() {
                None => Light::Directional {
                    direction: -towards_sun(view.target - view.eye, 100.0, 45.0),
                },
                Some(grid) => lighting(grid, None, view.eye, view.target, view.lens).light,
            };
            SceneLight {
                name: "sun".into(),
                light,
                color: Vec3::new(1.0, 0.95, 0.86),
                intensity: 100_000.0,
            }
        })
    }
}

fn camera(eye: DVec3, target: DVec3, fov_y_rad: f64, near: f64, far: f64) -> SceneCamera {
    let lens = Lens::Perspective { fov_y_rad };
    SceneCamera { name: "default".into(), eye, target, up: DVec3::Y, lens, near, far }
}

/// Chooses the best of many candidate views.
fn compose(grid: &Occupancy, bounds: Aabb, light: Option<Light>) -> SceneCamera {
    let content = grid.content();
    let typical_height = content.map_or(bounds.size().y * 0.2, |(_, height)| height);
    let has_ground = grid.floor_share() > 0.8;
    let focus = content.filter(|_| has_ground).map_or(bounds, |(around, _)| around);
    let flatness = focus.size().y / focus.size().x.max(focus.size().z);
    let is_room = is_room(grid, bounds);
    // A flat scene is a landscape and seen from within; others are objects and seen from outside.
    let is_world = flatness < 0.12 || flatness < 0.25 && has_ground;
    let mut candidates = match is_room || is_world {
        true => within(grid, focus, typical_height, is_room),
        false => Vec::new(),
    };
    // A scene without free places inside is seen from outside too.
    let from_outside = candidates.is_empty();
    if from_outside {
        candidates = around(&grid.points_in(focus), bounds);
    }
    let fov_y_rad = if from_outside { LONG_RAD } else { WIDE_RAD };
    // The light matters less for objects without ground, because they only cast shadows on
    // themselves.
    let light_weight = if from_outside && !has_ground { 0.7 } else { 2.0 };
    let judge = |(eye, target)| Judged::new(grid, eye, target, fov_y_rad);
    let mut judged: Vec<Judged> = candidates.into_iter().map(judge).collect();
    let most_seen = judged.iter().map(|j| j.cells_seen).max().unwrap_or(0);
    let score = |j: &Judged| j.score(most_seen, is_room);
    judged.sort_by(|a, b| score(b).total_cmp(&score(a)));
    judged.truncate(SHORT_LIST);
    // Among the best views, the one with the best score in its light is chosen.
    let lit_score = |j: &Judged| {
        let lit = lighting(grid, light, j.eye, j.target, Lens::Perspective { fov_y_rad });
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

/// Lines of sight through the pixels of a thumbnail, row by row from below: where they begin, and
/// their directions, of unit depth.
fn thumbnail(eye: DVec3, target: DVec3, lens: Lens) -> impl Iterator<Item = [DVec3; 2]> {
    let forward = (target - eye).normalize();
    let right = forward.cross(DVec3::Y).normalize_or(DVec3::X);
    let up = right.cross(forward);
    let [width, height] = THUMBNAIL;
    (0..width * height).map(move |k| {
        let x = (f64::from(k % width) + 0.5) / f64::from(width) * 2.0 - 1.0;
        let y = (f64::from(k / width) + 0.5) / f64::from(height) * 2.0 - 1.0;
        let aside = right * (x * ASPECT) + up * y;
        match lens {
            Lens::Perspective { fov_y_rad } => [eye, forward + aside * (fov_y_rad / 2.0).tan()],
            Lens::Orthographic { height } => [eye + aside * (height / 2.0), forward],
        }
    })
}
