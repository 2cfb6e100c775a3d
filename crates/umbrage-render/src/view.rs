//! The uniform with camera and light for the forward shader.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec2, DVec3, DVec4, Mat4, Vec3, Vec4};
use umbrage::{Camera, Light, Plane, ViewRay};
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
    pub(crate) is_orthographic: u32,
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

    /// The line of sight through the upper left corner of the tile, and its change per sample to
    /// the right and downwards.
    fn rays(&self, camera: &Camera) -> [ViewRay; 3] {
        let corner = camera.ray(self.pixel(0.0, 0.0));
        let step = |x, y| {
            let ray = camera.ray(self.pixel(x, y));
            let change = |to: DVec3, from: DVec3| (to - from) / (x + y);
            ViewRay {
                start: change(ray.start, corner.start),
                direction: change(ray.direction, corner.direction),
            }
        };
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
            let [a, b] = [rays[i], rays[(i + 1) % 4]];
            let normal = (b.at(1.0) - a.at(1.0)).cross(a.direction).normalize_or_zero();
            let is_inwards = normal.dot(middle.at(1.0) - a.at(1.0)) >= 0.0;
            Plane::through(camera.eye() + a.start, if is_inwards { normal } else { -normal })
        };
        let near =
            Plane::through(camera.eye() + camera.forward() * camera.near(), camera.forward());
        [side(0), side(1), side(2), side(3), near]
    }
}

impl ViewUniform {
    /// The uniform for a tile. Render space is relative to the eye. Nothing lies beyond `farthest`,
    /// metres along the view.
    pub(crate) fn new(
        camera: &Camera,
        light: &Light,
        light_index: u32,
        tile: &Tile,
        farthest: f64,
    ) -> Self {
        let [ray, ray_x, ray_y] = tile.rays(camera);
        let is_orthographic = camera.is_orthographic();
        let forward = camera.forward();
        let [width, height] = tile.size.map(f64::from);
        // A point of depth z is (ray + x ray_x + y ray_y).at(z), which is solved here for x and y.
        // The steps are perpendicular to each other. Either the lines' directions change from
        // sample to sample, or their starts.
        let across = |step: ViewRay, n: f64, sign: f64| {
            let step = step.start + step.direction;
            let per_step = step * (2.0 / (n * step.length_squared()));
            if is_orthographic {
                return per_step.extend(-per_step.dot(ray.start) - 1.0) * sign;
            }
            ((per_step - forward * per_step.dot(ray.direction)) - forward).extend(0.0) * sign
        };
        // Depth is reversed. In perspective views the far plane is infinitely far. Surfaces nearer
        // than the near distance are clipped.
        let (depth, w) = if is_orthographic {
            let length = farthest - camera.near();
            (-forward.extend(-farthest) / length, DVec4::W)
        } else {
            (DVec4::W * camera.near(), forward.extend(0.0))
        };
        let rows = [across(ray_x, width, 1.0), across(ray_y, height, -1.0), depth, w];
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
            ray: ray.direction.as_vec3(),
            grid: tile.grid as f32,
            ray_x: (ray_x.start + ray_x.direction).as_vec3(),
            light_kind,
            ray_y: (ray_y.start + ray_y.direction).as_vec3(),
            light_range: light_range.min(f64::from(f32::MAX)) as f32,
            forward: forward.as_vec3(),
            light_cosine: cosine as f32,
            light_direction: direction.as_vec3(),
            light_index,
            light_position: position.as_vec3(),
            is_orthographic: is_orthographic.into(),
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
    use umbrage::{LookAt, Orthographic};

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
            light_direction light_index light_position is_orthographic sun sky_light ground_light zenith
            horizon nadir glow
        ];
        let theirs: Vec<_> =
            members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
        assert_eq!(theirs, ours);
        assert_eq!(*span as usize, size_of::<ViewUniform>());
    }

    #[test]
    fn points_land_on_their_samples() {
        let (eye, target, up) =
            (DVec3::new(100.0, 5.0, -30.0), DVec3::new(90.0, 4.0, -33.0), DVec3::Y);
        let (near, far, image) = (0.5, 90.0, [320, 200]);
        let (fov_y_rad, height) = (1.1, 17.0);
        let perspective = LookAt { eye, target, up, fov_y_rad, near, far, image };
        let orthographic = Orthographic { eye, target, up, height, near, far, image };
        let perspective = Camera::look_at(perspective).unwrap();
        let orthographic = Camera::orthographic(orthographic).unwrap();
        let depth_at = |depth: f64| [0.5 / depth, (100.0 - depth) / 99.5];
        for (camera, kind) in [(perspective, 0), (orthographic, 1)] {
            land_on_samples(&camera, |depth| depth_at(depth)[kind]);
        }
    }

    fn land_on_samples(camera: &Camera, depth_at: impl Fn(f64) -> f64) {
        let sun = Light::Directional { direction: -DVec3::Y };
        let tile = Tile { origin: [64, 100], size: [128, 50], grid: 3 };
        let view = ViewUniform::new(camera, &sun, 0, &tile, 100.0);
        for (x, y, depth) in [(0.0, 0.0, 0.5), (128.0, 50.0, 7.0), (31.5, 20.5, 80.0)] {
            let pixel = DVec2::new((64.0 + x) / 3.0, (100.0 + y) / 3.0);
            let local = camera.ray(pixel).at(depth).as_vec3();
            let clip = view.clip_from_render * local.extend(1.0);
            let ndc = clip / clip.w;
            let at = DVec2::new(
                f64::from(0.5 + 0.5 * ndc.x) * 128.0,
                f64::from(0.5 - 0.5 * ndc.y) * 50.0,
            );
            assert!((at - DVec2::new(x, y)).length() < 1e-3, "{at}");
            assert!((f64::from(ndc.z) - depth_at(depth)).abs() < 1e-6);
            for plane in tile.planes(camera) {
                assert!(plane.distance(camera.eye() + local.as_dvec3()) > -1e-5);
            }
        }
    }
}
