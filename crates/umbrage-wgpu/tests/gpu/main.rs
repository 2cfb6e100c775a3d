//! Tests on a real device, or on lavapipe where there is no other.

mod caching;
mod clamping;
mod clusters;
mod cookbook;
mod device;
mod kernels;
mod partial;
mod seen;
mod statistics;
mod trouble;

use device::Bench;
use glam::DVec3;
use umbrage::{
    Aabb, Bounds, Camera, Light, LookAt, Plan, Planner, PointLight, SpotLight, Technique,
};

/// A view over a plain.
pub(crate) fn camera(eye: DVec3) -> Camera {
    Camera::look_at(LookAt {
        eye,
        target: eye + DVec3::new(0.2, -0.3, -1.0),
        up: DVec3::Y,
        fov_y_rad: 1.0,
        near: 0.1,
        far: 60.0,
        image: [640, 360],
    })
    .unwrap()
}

pub(crate) const EYE: DVec3 = DVec3::new(3.0, 2.5, 9.0);

pub(crate) fn sun() -> Light {
    Light::Directional { direction: DVec3::new(0.5, -1.0, 0.25) }
}

/// A sun, a spot light and a point light.
pub(crate) fn lights() -> [Light; 3] {
    let spot = SpotLight {
        position: DVec3::new(1.0, 8.0, 2.0),
        direction: DVec3::new(0.1, -1.0, -0.4),
        half_angle_rad: 0.8,
        near: 0.2,
        range: 30.0,
    };
    let point = PointLight { position: DVec3::new(4.0, 3.0, -2.0), near: 0.1, range: 25.0 };
    [sun(), Light::Spot(spot), Light::Point(point)]
}

pub(crate) fn scene() -> Aabb {
    Aabb::new(DVec3::new(-25.0, 0.0, -40.0), DVec3::new(25.0, 4.0, 12.0))
}

pub(crate) fn plan(camera: &Camera, lights: &[Light], technique: &Technique) -> Plan {
    let bounds = Bounds::of_scene(scene());
    Planner::new().plan(camera, lights, &bounds, technique).unwrap().clone()
}

/// The device of a test.
pub(crate) fn bench() -> Bench {
    Bench::open()
}
