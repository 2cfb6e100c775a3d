//! The planes of grids: where points lie on them, and the maps of windows and pages.

use super::{
    AHEAD_TEXELS, Level, MOST_BIAS, PAGE_TEXELS, Page, SLAB_TEXELS, floor_log2, page_width,
    texel_width,
};
use crate::bounds::Plane;
use crate::camera::Camera;
use crate::light::Projector;
use crate::math::perpendicular_pair;
use crate::matrices::MARGIN_TEXELS;
use crate::plan::{Rows, ShadowMap, Slab};
use crate::stable::bounding_sphere;
use glam::{DMat4, DVec2, DVec3, DVec4};
use std::ops::Range;

/// A plane across a projector's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Projection {
    x: DVec3,
    z: DVec3,
    /// Unit vector away from the light.
    along: DVec3,
    lamp: Option<Lamp>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Lamp {
    position: DVec3,
    /// The tangent of half the opening angle.
    slope: f64,
    near: f64,
    range: f64,
}

impl Lamp {
    /// The distance along the axis at which the second slab begins: as many times the near distance
    /// as the range is times this distance.
    fn middle(&self) -> f64 {
        (self.near * self.range).sqrt()
    }

    /// The distances along the axis between which a slab's depths run. Those of the second slab begin
    /// before it, so that casters ahead of it keep their distance.
    fn depths(&self, slab: i64) -> [f64; 2] {
        let middle = self.middle();
        match slab {
            0 => [self.near, middle],
            _ => [self.near.max(middle / AHEAD_OF_LAMP), self.range],
        }
    }
}

/// A point on a grid's plane.
pub(super) struct OnPlane {
    pub(super) plane: DVec2,
    /// The distance from the lamp along the axis, metres; 1 under parallel light.
    pub(super) w: f64,
}

/// The levels that a view needs.
pub(super) struct Views {
    pub(super) levels: Range<i32>,
    pub(super) slabs: usize,
}

/// The window of a level. Its side may be too large for a table.
pub(super) struct Window {
    pub(super) first_page: [i64; 2],
    pub(super) side: f64,
    pub(super) slab: i64,
}

/// How many times as far from a lamp its second slab begins as the depths of that slab do.
const AHEAD_OF_LAMP: f64 = 8.0;

/// How far outside a lamp's light points still count, as a share of its extent.
const ROUNDING: f64 = 1e-9;

impl Projection {
    pub(super) fn new(projector: &Projector) -> Self {
        let (along, position) = projector.direction_and_apex(DVec3::ZERO);
        let [_, z] = perpendicular_pair(along);
        let lamp = match *projector {
            Projector::Pyramid { slope, near, range, .. } => {
                position.map(|position| Lamp { position, slope, near, range })
            }
            Projector::Directional { .. } => None,
        };
        // As in light space, so that the light's view is not mirrored.
        Self { x: along.cross(z), z, along, lamp }
    }

    /// The place of a point; `None` outside the light of a lamp's projector and beyond its range.
    pub(super) fn project(&self, world_position: DVec3) -> Option<OnPlane> {
        let from = self.lamp.map_or(DVec3::ZERO, |lamp| lamp.position);
        let v = world_position - from;
        let plane = DVec2::new(self.x.dot(v), self.z.dot(v));
        let Some(lamp) = self.lamp else { return Some(OnPlane { plane, w: 1.0 }) };
        let w = self.along.dot(v);
        let [slope, range] = [lamp.slope, lamp.range].map(|limit| limit * (1.0 + ROUNDING));
        let is_lit = w > 0.0 && w <= range && plane.abs().max_element() <= slope * w;
        is_lit.then(|| OnPlane { plane: plane / w, w })
    }

    /// The slab of a point on a level.
    pub(super) fn slab(&self, world_position: DVec3, level: i32) -> i64 {
        match self.lamp {
            None => (self.along.dot(world_position) / slab_width(level)).floor() as i64,
            Some(lamp) => {
                let distance = self.along.dot(world_position - lamp.position);
                i64::from(distance >= lamp.middle())
            }
        }
    }

    /// The slab of a coarser level that holds a slab.
    pub(super) fn coarser_slab(&self, slab: i64, levels_coarser: i32) -> i64 {
        if self.lamp.is_some() { slab } else { slab >> levels_coarser }
    }

    /// The levels that receivers of a camera need, up to the largest bias.
    pub(super) fn views(&self, camera: &Camera, error: f64) -> Views {
        let allowed = [camera.near(), camera.far()].map(|z| error * camera.pixel_width(z));
        // A receiver whose texels are exactly as wide as allowed may be found on either level.
        let level = |x: f64| floor_log2(x.clamp(1e-30, 1e30));
        let finest = level(allowed[0] * (1.0 - 1e-6) / self.lamp.map_or(1.0, |lamp| lamp.range));
        let coarsest = match self.lamp {
            None => level(allowed[1] * (1.0 + 1e-6)) + MOST_BIAS as i32,
            // A page of this level covers a quarter of the plane or more.
            Some(lamp) => level(lamp.slope / f64::from(PAGE_TEXELS)) + 1,
        };
        Views { levels: finest.min(coarsest)..coarsest + 1, slabs: 2 }
    }

    /// The least window with all receivers of a level: see the module's documentation.
    pub(super) fn window(&self, camera: &Camera, error: f64, level: i32) -> Window {
        let width = page_width(level);
        let (center, radius) = if camera.is_orthographic() {
            let (center, radius) = bounding_sphere(camera, [camera.near(), camera.far()]);
            (camera.eye() + center, radius)
        } else {
            let corners = camera.corner_slopes();
            let corner = corners.iter().map(|s| s.extend(1.0).length()).fold(1.0, f64::max);
            let focal = camera.pixel_width(1.0).recip();
            (camera.eye(), 2.0 * texel_width(level) * focal * corner / error)
        };
        let around = |middle: DVec2, radius: f64, most: f64| {
            let side = power_of_two((2.0 * radius / width + 2.0).min(most));
            let first = |x: f64| (x / width).floor() as i64 - (side / 2.0) as i64;
            (first(middle.x), first(middle.y), side)
        };
        let Some(lamp) = self.lamp else {
            let middle = DVec2::new(self.x.dot(center), self.z.dot(center));
            let (i, j, side) = around(middle, radius, f64::INFINITY);
            let nearest = self.along.dot(center) - radius;
            let slab = (nearest / slab_width(level)).floor() as i64;
            return Window { first_page: [i, j], side, slab };
        };
        let v = center - lamp.position;
        let depth = self.along.dot(v);
        let seen = DVec2::new(self.x.dot(v), self.z.dot(v));
        let whole = 2.0 * lamp.slope / width + 2.0;
        let (i, j, side) = if camera.is_orthographic() {
            around(DVec2::ZERO, lamp.slope, whole)
        } else {
            // `radius` is that at distance 1 from the lamp.
            let off = radius * (1.0 + (lamp.slope + radius) / (1.0 - radius));
            let is_part = radius < 0.5 && off < lamp.slope;
            if !is_part {
                around(DVec2::ZERO, lamp.slope, whole)
            } else if depth > 0.0 {
                let limit = DVec2::splat(lamp.slope);
                around((seen / depth).clamp(-limit, limit), off, whole)
            } else {
                // All receivers of this level are near the eye, and the eye is behind the lamp.
                around(DVec2::ZERO, off, whole)
            }
        };
        Window { first_page: [i, j], side, slab: 0 }
    }

    /// The distances along the view at which receivers have a level, as far as they are known.
    pub(super) fn split(&self, camera: &Camera, error: f64, level: i32) -> [f64; 2] {
        let whole = [camera.near(), camera.far()];
        if self.lamp.is_some() || camera.is_orthographic() {
            return whole;
        }
        let begin = texel_width(level) / (error * camera.pixel_width(1.0));
        [begin, 2.0 * begin].map(|z| z.clamp(whole[0], whole[1]))
    }

    /// Sets the half-spaces that hold all receivers of a grid, relative to the camera's eye.
    pub(super) fn set_cell(&self, map: &mut ShadowMap, camera: &Camera) {
        let far = camera.far() * (1.0 + ROUNDING);
        map.cell.clear();
        map.cell.push(Plane { normal: -camera.forward(), offset: far });
        let Some(lamp) = self.lamp else { return };
        let apex = lamp.position - camera.eye();
        let slack = ROUNDING * lamp.range;
        for axis in [self.x, -self.x, self.z, -self.z] {
            let plane = Plane::through(apex, (self.along * lamp.slope + axis).normalize());
            map.cell.push(Plane { offset: plane.offset + slack, ..plane });
        }
        let end = apex + self.along * (lamp.range + slack);
        map.cell.push(Plane::through(end, -self.along));
    }

    /// The world position that a page's own map is relative to.
    pub(super) fn page_origin(&self, page: &Page) -> DVec3 {
        if let Some(lamp) = self.lamp {
            return lamp.position;
        }
        let middle = |index: i64| (index as f64 + 0.5) * page_width(page.level);
        self.x * middle(page.i)
            + self.z * middle(page.j)
            + self.along * (page.slab as f64 * slab_width(page.level))
    }

    /// Sets the matrices, the resolution and the planes of a window's map, relative to `origin`
    /// (world space). Casters count up to `reach` texels beyond its border.
    pub(super) fn set_map(&self, map: &mut ShadowMap, origin: DVec3, level: &Level, reach: u32) {
        let width = page_width(level.level) * f64::from(level.side);
        let first = level.first_page.map(|i| i as f64 * page_width(level.level));
        // Maps of another plan may be used again.
        map.rows = Rows::Even;
        map.fade_from = None;
        map.lambda = None;
        map.storage_factor = 0.0;
        map.origin = origin;
        map.resolution = [PAGE_TEXELS * level.side; 2];
        map.cell.clear();
        map.caster_planes.clear();
        let reach = f64::from(reach) * texel_width(level.level);
        let [low, high] = [0.0, width].map(|end| first.map(|first| first + end));
        let ends = [(self.x, low[0], high[0]), (self.z, low[1], high[1])];
        match self.lamp {
            None => {
                let ahead = AHEAD_TEXELS * texel_width(level.level);
                let thickness = ahead + slab_width(level.level);
                // Distances from the planes s = 0, t = 0 and depth = 0 at the origin.
                let begin = [
                    self.x.dot(origin) - first[0],
                    self.z.dot(origin) - first[1],
                    self.along.dot(origin) + ahead - level.slab as f64 * slab_width(level.level),
                ];
                let axes = [(self.x, width), (self.z, width), (self.along, thickness)];
                let row = |i: usize| (axes[i].0 / axes[i].1).extend(begin[i] / axes[i].1);
                let rows = [row(0), row(1), row(2)];
                map.shadow_from_local =
                    DMat4::from_cols(rows[0], rows[1], rows[2], DVec4::W).transpose();
                let [s, t, depth] = axes.map(|(axis, length)| (axis * length).extend(0.0));
                let corner = -(self.x * begin[0] + self.z * begin[1] + self.along * begin[2]);
                map.local_from_shadow = DMat4::from_cols(s, t, depth, corner.extend(1.0));
                map.apex = None;
                map.slab = Slab::default();
                for (axis, low, high) in ends {
                    let at = axis.dot(origin);
                    map.caster_planes.push(Plane { normal: axis, offset: at - low + reach });
                    map.caster_planes.push(Plane { normal: -axis, offset: high + reach - at });
                }
                let end = thickness - begin[2];
                map.caster_planes.push(Plane { normal: -self.along, offset: end });
            }
            Some(lamp) => {
                let apex = lamp.position - origin;
                let d = self.along.extend(-self.along.dot(apex));
                let row =
                    |axis: DVec3, first: f64| ((axis.extend(-axis.dot(apex))) - d * first) / width;
                // Depth is α − β/d at the distance d from the lamp: 0 where the slab's depths begin,
                // and 1 where it ends.
                let [near, far] = lamp.depths(level.slab);
                let span = near.recip() - far.recip();
                let [alpha, beta] = [(near * span).recip(), span.recip()];
                let rows = [row(self.x, first[0]), row(self.z, first[1]), d * alpha];
                let depth = rows[2] - DVec4::W * beta;
                map.shadow_from_local = DMat4::from_cols(rows[0], rows[1], depth, d).transpose();
                let [s, t] = [self.x, self.z].map(|axis| (axis * width).extend(0.0));
                let toward = self.x * first[0] + self.z * first[1] + self.along;
                map.local_from_shadow = DMat4::from_cols(
                    s,
                    t,
                    -apex.extend(1.0) / beta,
                    apex.extend(1.0) * (alpha / beta) + toward.extend(0.0),
                );
                map.apex = Some(apex);
                map.slab = Slab::Distances { axis: self.along, near, far };
                map.begin_earlier(MARGIN_TEXELS * texel_width(level.level) / (near * span));
                for (axis, low, high) in ends {
                    for normal in
                        [axis - self.along * (low - reach), self.along * (high + reach) - axis]
                    {
                        map.caster_planes.push(Plane::through(apex, normal.normalize()));
                    }
                }
                let end = apex + self.along * far;
                map.caster_planes.push(Plane::through(end, -self.along));
            }
        }
    }
}

/// The thickness of a slab, metres.
fn slab_width(level: i32) -> f64 {
    SLAB_TEXELS * texel_width(level)
}

/// The least power of two that is no less than `x`.
fn power_of_two(x: f64) -> f64 {
    let below = f64::from(floor_log2(x.max(1.0))).exp2();
    if below < x { 2.0 * below } else { below }
}
