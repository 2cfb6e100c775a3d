//! The uniform with camera and light for the forward shader.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec2, DVec3, Mat4, Vec3, Vec4};
use umbrage::{Camera, Light, Plane};
use umbrage_scene::daylight;

/// The struct `View` of `wgsl/forward.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ViewUniform {
    pub(crate) clip_from_render: Mat4,
    pub(crate) ray: Vec3,
    pub(crate) grid: f32,
    pub(crate) ray_x: Vec3,
    pub(crate) light_kind: u32,
    pub(crate) ray_y: Vec3,
    pub(crate) light_range: f32,
    pub(crate) forward: Vec3,
    pub(crate) light_cosine: f32,
    pub(crate) light_direction: Vec3,
    pub(crate) light_index: u32,
    pub(crate) light_position: Vec3,
    pub(crate) padding: f32,
    pub(crate) sun: Vec4,
    pub(crate) sky_light: Vec4,
    pub(crate) ground_light: Vec4,
    pub(crate) zenith: Vec4,
    pub(crate) horizon: Vec4,
    pub(crate) nadir: Vec4,
    pub(crate) glow: Vec4,
}

/// A rectangular part of a picture, in samples. There are `grid` samples along each side of a
/// pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tile {
    pub(crate) origin: [u32; 2],
    pub(crate) size: [u32; 2],
    pub(crate) grid: u32,
}

impl Tile {
    /// The whole picture, with one sample per pixel.
    pub(crate) fn whole(camera: &Camera) -> Self {
        Self { origin: [0, 0], size: camera.image(), grid: 1 }
    }

    /// Position in the picture, in pixels, of a point of the tile, which is in samples.
    fn pixel(&self, x: f64, y: f64) -> DVec2 {
        let [left, top] = self.origin.map(f64::from);
        DVec2::new(left + x, top + y) / f64::from(self.grid)
    }

    /// The ray of unit depth through the upper left corner of the tile, and its change per sample
    /// to the right and downwards.
    fn rays(&self, camera: &Camera) -> [DVec3; 3] {
        let corner = camera.ray(self.pixel(0.0, 0.0));
        let step = |x, y| (camera.ray(self.pixel(x, y)) - corner) / (x + y);
        let [width, height] = self.size.map(f64::from);
        [corner, step(width, 0.0), step(0.0, height)]
    }

    /// World-space planes around all that can be visible in the tile.
    pub(crate) fn planes(&self, camera: &Camera) -> [Plane; 5] {
        let [w, h] = self.size.map(f64::from);
        let corners = [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)];
        let rays = corners.map(|(x, y)| camera.ray(self.pixel(x, y)));
        let middle = camera.ray(self.pixel(w / 2.0, h / 2.0));
        let side = |i: usize| {
            let normal = rays[i].cross(rays[(i + 1) % 4]).normalize_or_zero();
            Plane::through(camera.eye(), if normal.dot(middle) < 0.0 { -normal } else { normal })
        };
        let near =
            Plane::through(camera.eye() + camera.forward() * camera.near(), camera.forward());
        [side(0), side(1), side(2), side(3), near]
    }
}

impl ViewUniform {
    /// The uniform for a tile. Render space is relative to the eye.
    pub(crate) fn new(camera: &Camera, light: &Light, light_index: u32, tile: &Tile) -> Self {
        let [ray, ray_x, ray_y] = tile.rays(camera);
        let forward = camera.forward();
        let [width, height] = tile.size.map(f64::from);
        // A point p is depth · (ray + x ray_x + y ray_y), which is solved here for x and y. The
        // steps are perpendicular to each other.
        let across = |step: DVec3, n: f64, sign: f64| {
            let per_depth = step / step.length_squared();
            let sample = per_depth - forward * per_depth.dot(ray);
            (sample * (2.0 / n) - forward) * sign
        };
        // Depth is reversed and the far plane infinitely far. Surfaces nearer than the near
        // distance are clipped.
        let rows = [
            across(ray_x, width, 1.0).extend(0.0),
            across(ray_y, height, -1.0).extend(0.0),
            DVec3::ZERO.extend(camera.near()),
            forward.extend(0.0),
        ];
        let clip_from_render = DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose();
        let (light_kind, direction, position, light_range, cosine) = match light {
            Light::Directional { direction } => {
                (0, direction.normalize_or_zero(), DVec3::ZERO, f64::MAX, -1.0)
            }
            Light::Spot(spot) => {
                let axis = spot.direction.normalize_or_zero();
                let position = spot.position - camera.eye();
                // A wide spot light is a part of a point light.
                let kind = if spot.is_wide() { 2 } else { 1 };
                (kind, axis, position, spot.range, spot.half_angle_rad.cos())
            }
            Light::Point(point) => {
                (2, DVec3::ZERO, point.position - camera.eye(), point.range, -1.0)
            }
        };
        let color = |c: Vec3| c.extend(0.0);
        Self {
            clip_from_render: clip_from_render.as_mat4(),
            ray: ray.as_vec3(),
            grid: tile.grid as f32,
            ray_x: ray_x.as_vec3(),
            light_kind,
            ray_y: ray_y.as_vec3(),
            light_range: light_range.min(f64::from(f32::MAX)) as f32,
            forward: forward.as_vec3(),
            light_cosine: cosine as f32,
            light_direction: direction.as_vec3(),
            light_index,
            light_position: position.as_vec3(),
            padding: 0.0,
            sun: color(daylight::SUN),
            sky_light: color(daylight::SKY_LIGHT),
            ground_light: color(daylight::GROUND_LIGHT),
            zenith: color(daylight::ZENITH),
            horizon: color(daylight::HORIZON),
            nadir: color(daylight::NADIR),
            glow: color(daylight::GLOW),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::offset_of;
    use umbrage::LookAt;

    #[test]
    fn the_shader_reads_what_is_written() {
        let text = include_str!("wgsl/forward.wgsl");
        let end = text.find("const DIRECTIONAL").expect("the struct ends before it");
        let module = naga::front::wgsl::parse_str(&text[..end]).unwrap();
        let (_, view) =
            module.types.iter().find(|(_, t)| t.name.as_deref() == Some("View")).unwrap();
        let naga::TypeInner::Struct { members, span } = &view.inner else { panic!("a struct") };
        macro_rules! offsets {
            ($($field:ident)*) => {
                vec![$((stringify!($field), offset_of!(ViewUniform, $field))),*]
            };
        }
        let ours = offsets![
            clip_from_render ray grid ray_x light_kind ray_y light_range forward light_cosine
            light_direction light_index light_position padding sun sky_light ground_light zenith
            horizon nadir glow
        ];
        let theirs: Vec<_> =
            members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
        assert_eq!(theirs, ours);
        assert_eq!(*span as usize, size_of::<ViewUniform>());
    }

    #[test]
    fn points_land_on_their_samples() {
        let camera = Camera::look_at(LookAt {
            eye: DVec3::new(100.0, 5.0, -30.0),
            target: DVec3::new(90.0, 4.0, -33.0),
            up: DVec3::Y,
            fov_y_rad: 1.1,
            near: 0.5,
            far: 90.0,
            image: [320, 200],
        })
        .unwrap();
        let sun = Light::Directional { direction: -DVec3::Y };
        let tile = Tile { origin: [64, 100], size: [128, 50], grid: 3 };
        let view = ViewUniform::new(&camera, &sun, 0, &tile);
        for (x, y, depth) in [(0.0, 0.0, 0.5), (128.0, 50.0, 7.0), (31.5, 20.5, 80.0)] {
            let pixel = DVec2::new((64.0 + x) / 3.0, (100.0 + y) / 3.0);
            let local = (camera.ray(pixel) * depth).as_vec3();
            let clip = view.clip_from_render * local.extend(1.0);
            let ndc = clip / clip.w;
            let at = DVec2::new(
                f64::from(0.5 + 0.5 * ndc.x) * 128.0,
                f64::from(0.5 - 0.5 * ndc.y) * 50.0,
            );
            assert!((at - DVec2::new(x, y)).length() < 1e-3, "{at}");
            assert!((f64::from(ndc.z) - 0.5 / depth).abs() < 1e-6);
            for plane in tile.planes(&camera) {
                assert!(plane.distance(camera.eye() + local.as_dvec3()) > -1e-5);
            }
        }
    }
}
