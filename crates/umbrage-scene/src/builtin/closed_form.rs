//! Built-in scenes whose shadows have a closed form, and the closed forms.
//!
//! All objects stand on the ground plane y = 0, a square of half-width [`GROUND_HALF`] around the
//! origin. Ground points are in world space, metres. `light_direction` is the way that directional
//! light travels and must point down (y < 0). On the outline of a shadow, either answer is right.

use super::mesh_builder::MeshBuilder;
use super::stage::{Lens, Stage};
use crate::types::Scene;
use glam::{DVec2, DVec3, Vec3};

/// Half the width of the ground, metres, in all three scenes.
pub const GROUND_HALF: f64 = 20.0;

/// Half the width of the square `pole`, metres. Its axis is the y axis, and its sides face x and z.
pub const POLE_HALF_WIDTH: f64 = 0.1;
/// Height of the `pole`, metres. The pole stands on the ground.
pub const POLE_HEIGHT: f64 = 4.0;

/// Half the width of the square screen of `slit`, metres. The screen is horizontal and has no
/// thickness.
pub const SCREEN_HALF: f64 = 4.0;
/// Height of the screen of `slit` above the ground, metres.
pub const SCREEN_HEIGHT: f64 = 2.0;
/// Half the width of the slit, along x, metres.
pub const SLIT_HALF_WIDTH: f64 = 0.05;
/// Half the length of the slit, along z, metres.
pub const SLIT_HALF_LENGTH: f64 = 3.0;

/// Radius of the `sphere`, metres.
pub const SPHERE_RADIUS: f64 = 1.0;
/// Centre of the `sphere`, metres.
pub const SPHERE_CENTER: DVec3 = DVec3::new(0.0, 2.0, 0.0);

/// Whether the pole's shadow covers a ground point. The shadow is the square of half-width
/// [`POLE_HALF_WIDTH`] swept along the horizontal distance that light travels while it falls by
/// [`POLE_HEIGHT`].
pub fn pole_shadows(ground_point: DVec3, light_direction: DVec3) -> bool {
    let sweep = horizontal_travel(light_direction, POLE_HEIGHT);
    let p = DVec2::new(ground_point.x, ground_point.z);
    // The interval of the sweep, in [0, 1], during which the moving square contains p (slab test).
    let mut span = (0.0_f64, 1.0_f64);
    for (p, travel) in [(p.x, sweep.x), (p.y, sweep.y)] {
        let (lo, hi) = (p - POLE_HALF_WIDTH, p + POLE_HALF_WIDTH);
        if travel == 0.0 {
            if lo > 0.0 || hi < 0.0 {
                return false;
            }
        } else {
            let (a, b) = (lo / travel, hi / travel);
            span = (span.0.max(a.min(b)), span.1.min(a.max(b)));
        }
    }
    span.0 <= span.1
}

/// Whether the screen's shadow covers a ground point: the light to the point passes the height
/// [`SCREEN_HEIGHT`] within the screen of half-width [`SCREEN_HALF`], but not through the slit.
pub fn slit_shadows(ground_point: DVec3, light_direction: DVec3) -> bool {
    let travel = horizontal_travel(light_direction, SCREEN_HEIGHT);
    let on_screen = (DVec2::new(ground_point.x, ground_point.z) - travel).abs();
    let in_slit = on_screen.x < SLIT_HALF_WIDTH && on_screen.y < SLIT_HALF_LENGTH;
    on_screen.max_element() <= SCREEN_HALF && !in_slit
}

/// Whether the ideal sphere's shadow covers a ground point: the line of light through the point
/// passes [`SPHERE_CENTER`] at a distance of at most [`SPHERE_RADIUS`]. The outline is an ellipse.
///
/// The tessellated scene of size n is inscribed in the sphere. The outline of its shadow lies
/// inside the ideal one, by less than (π/2n)²·r across the light (r is the radius) and, on the
/// ground, by that over the sine of the light's elevation.
pub fn sphere_shadows(ground_point: DVec3, light_direction: DVec3) -> bool {
    let d = light_direction.normalize();
    (SPHERE_CENTER - ground_point).cross(d).length() <= SPHERE_RADIUS
}

fn horizontal_travel(light_direction: DVec3, fall: f64) -> DVec2 {
    DVec2::new(light_direction.x, light_direction.z) * (fall / -light_direction.y)
}

/// A square pole on a plane.
pub(super) fn pole(size: u32) -> Scene {
    let mut stage = plane("pole", size);
    let paint = stage.paint("pole", [0.42, 0.12, 0.07]);
    let mut b = MeshBuilder::new();
    let half = POLE_HALF_WIDTH as f32;
    let top = Vec3::new(half, POLE_HEIGHT as f32, half);
    b.cuboid(Vec3::new(-half, 0.0, -half), top, size);
    stage.set(b, paint);
    stage.camera("side", DVec3::new(-3.0, 3.2, 8.5), DVec3::new(1.3, 0.9, 0.0), CLOSE_UP);
    stage.sun(DVec3::new(1.0, -1.0, 0.5));
    stage.finish()
}

/// A horizontal screen with a slit, over a plane.
pub(super) fn slit(size: u32) -> Scene {
    let mut stage = plane("slit", size);
    let paint = stage.paint("screen", [0.10, 0.22, 0.36]);
    let mut b = MeshBuilder::new();
    let (screen, height) = (SCREEN_HALF as f32, SCREEN_HEIGHT as f32);
    let (width, length) = (SLIT_HALF_WIDTH as f32, SLIT_HALF_LENGTH as f32);
    let mut piece = |x0: f32, x1: f32, z0: f32, z1: f32| {
        b.sheet(Vec3::new(x0, height, z0), Vec3::Z * (z1 - z0), Vec3::X * (x1 - x0), size);
    };
    piece(-screen, -width, -screen, screen);
    piece(width, screen, -screen, screen);
    piece(-width, width, -screen, -length);
    piece(-width, width, length, screen);
    stage.set(b, paint);
    stage.camera("side", DVec3::new(9.0, 3.6, 11.0), DVec3::new(1.5, 0.3, 0.0), CLOSE_UP);
    stage.sun(DVec3::new(1.0, -1.0, 0.25));
    stage.finish()
}

/// A sphere over a plane.
pub(super) fn sphere(size: u32) -> Scene {
    let mut stage = plane("sphere", 1);
    let paint = stage.paint("sphere", [0.55, 0.30, 0.06]);
    let mut b = MeshBuilder::new();
    b.ball(SPHERE_CENTER.as_vec3(), SPHERE_RADIUS as f32, size);
    stage.set(b, paint);
    stage.camera("side", DVec3::new(-2.5, 3.4, 7.5), DVec3::new(0.8, 1.0, 0.0), CLOSE_UP);
    stage.sun(DVec3::new(1.0, -1.25, 0.4));
    stage.finish()
}

const CLOSE_UP: Lens = Lens { fov_y_deg: 45.0, near: 0.5, far: 60.0 };

fn plane(name: &str, cells: u32) -> Stage {
    let mut stage = Stage::new(name);
    let ground = stage.paint("ground", [0.48, 0.46, 0.42]);
    stage.ground(Vec3::ZERO, GROUND_HALF as f32, cells, ground);
    stage
}
