//! The data that shaders read. Each struct has the layout of the struct in `wgsl/` that its comment
//! names.

use crate::wgsl::{MAX_LIGHTS, MAX_MAPS, MAX_PLANES};
use crate::{Bias, Error, LookupBuffers};
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec2, DVec3, DVec4, Mat4, Vec4};
use umbrage::visibility::Filter;
use umbrage::{Fade, Place, Plan, ShadowMap, Slab};

/// `ShadowSettings`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Settings {
    pub(crate) texture_scale: [f32; 2],
    pub(crate) light_count: u32,
    pub(crate) pages_across: u32,
    pub(crate) pixel_gradient: Vec4,
    pub(crate) eye: Vec4,
    pub(crate) fade: Vec4,
}

/// `ShadowLight`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Light {
    pub(crate) first_map: u32,
    pub(crate) map_count: u32,
    pub(crate) choice: u32,
    pub(crate) padding: u32,
    pub(crate) axis: Vec4,
    pub(crate) ends: [f32; MAX_SLICES],
}

/// The most slices that lookup finds by their distance along the view.
const MAX_SLICES: usize = 16;

/// `ShadowMap`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Map {
    pub(crate) s: Vec4,
    pub(crate) t: Vec4,
    pub(crate) depth: Vec4,
    pub(crate) w: Vec4,
    pub(crate) along_s: Vec4,
    pub(crate) along_t: Vec4,
    pub(crate) along_depth: Vec4,
    pub(crate) footprint_x: Vec4,
    pub(crate) footprint_y: Vec4,
    pub(crate) footprint_s: f32,
    pub(crate) rounding: f32,
    pub(crate) kind: u32,
    pub(crate) layer: u32,
    pub(crate) size: [f32; 2],
    pub(crate) origin: [f32; 2],
    pub(crate) fade_from: Vec4,
    pub(crate) beam_scale: Vec4,
    pub(crate) slab: Vec4,
    pub(crate) first_plane: u32,
    pub(crate) plane_count: u32,
    pub(crate) index: u32,
    pub(crate) margin: f32,
}

/// `ShadowCasterMap`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct CasterMap {
    pub(crate) clip_from_render: Mat4,
}

/// `ShadowMask`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Mask {
    pub(crate) factor: f32,
    pub(crate) cutoff: f32,
}

/// All data that lookup reads from buffers. Empty maps are left out.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Lookup {
    pub(crate) settings: Settings,
    pub(crate) lights: Vec<Light>,
    pub(crate) maps: Vec<Map>,
    pub(crate) planes: Vec<Vec4>,
}

/// The places of the maps, the size of the texture that holds them, and the origin of render space.
pub(crate) struct Placed<'a> {
    pub(crate) places: &'a [Option<Place>],
    pub(crate) texture_size: [u32; 2],
    pub(crate) render_origin: DVec3,
    pub(crate) bias: Bias,
    /// Places of pages across the texture; 0 without pages.
    pub(crate) pages_across: u32,
}

impl Lookup {
    /// Fills the buffers with a plan's maps; their previous contents are dropped, their memory is
    /// reused.
    pub(crate) fn fill(&mut self, plan: &Plan, placed: &Placed<'_>) {
        let Self { settings, lights, maps, planes } = self;
        lights.clear();
        maps.clear();
        planes.clear();
        for light in &plan.lights {
            let first_map = maps.len() as u32;
            for index in light.maps.clone() {
                if let Some(place) = placed.places[index] {
                    let map = &plan.maps[index];
                    maps.push(Map::new(map, index, &place, planes, placed));
                }
            }
            let lit = light.maps.clone().filter(|&i| placed.places[i].is_some());
            let slices = Slices::of(lit.map(|i| &plan.maps[i]));
            let map_count = maps.len() as u32 - first_map;
            lights.push(Light::new(first_map, map_count, slices, placed.render_origin));
        }
        *settings = Settings {
            light_count: lights.len() as u32,
            pages_across: placed.pages_across,
            texture_scale: placed.texture_size.map(|n| 1.0 / n.max(1) as f32),
            pixel_gradient: {
                let local_from_render = placed.render_origin - plan.origin;
                let gradient = plan.pixel_gradient;
                (gradient + DVec4::W * gradient.dot(local_from_render.extend(0.0))).as_vec4()
            },
            eye: {
                let render_from_local = plan.origin - placed.render_origin;
                (plan.viewer + (render_from_local * plan.viewer.w).extend(0.0)).as_vec4()
            },
            // The plane at infinity leaves all of the shadows.
            fade: plan.fade.map_or(Vec4::W, |Fade { end, length }| {
                let render_origin = placed.render_origin - plan.origin;
                (end.normal.extend(end.distance(render_origin)) / length).as_vec4()
            }),
        };
    }

    /// Checks that buffers of this kind have room for as many lights, maps and planes.
    pub(crate) fn check(&self, buffers: LookupBuffers) -> Result<(), Error> {
        let counts = [
            ("lights", self.lights.len(), MAX_LIGHTS),
            ("maps", self.maps.len(), MAX_MAPS),
            ("planes around what maps serve", self.planes.len(), MAX_PLANES),
        ];
        match counts.into_iter().find(|&(_, given, max)| given > max) {
            Some((what, given, max)) if buffers == LookupBuffers::Uniform => {
                Err(Error::TooMany { what, given, max })
            }
            _ => Ok(()),
        }
    }
}

/// Slices that follow one another along the view.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slices {
    /// World position from which distances count, metres.
    origin: DVec3,
    /// Unit vector.
    axis: DVec3,
    /// The distances at which the slices end, ascending, metres.
    ends: [f64; MAX_SLICES],
}

impl Slices {
    /// The slices whose maps these are; `None` if there are too many, if one does not begin where
    /// the one before it ends, or if other planes bound what one of them serves.
    fn of<'a>(maps: impl Iterator<Item = &'a ShadowMap>) -> Option<Self> {
        let mut slices: Option<Self> = None;
        let mut last_end = f64::NEG_INFINITY;
        for (i, map) in maps.enumerate() {
            let slices = slices.get_or_insert(Self {
                origin: map.origin,
                axis: -map.cell.last()?.normal,
                ends: [f64::from(f32::MAX); MAX_SLICES],
            });
            let (mut begin, mut end) = (f64::NEG_INFINITY, f64::INFINITY);
            for plane in &map.cell {
                if plane.normal == slices.axis {
                    begin = begin.max(-plane.offset);
                } else if plane.normal == -slices.axis {
                    end = end.min(plane.offset);
                } else {
                    return None;
                }
            }
            if map.fade_from.is_some() || begin != last_end || map.origin != slices.origin {
                return None;
            }
            *slices.ends.get_mut(i)? = end;
            last_end = end;
        }
        slices
    }
}

/// How the maps that serve a point are found, as in `wgsl/choice.wesl`. The default is by planes.
const BY_DISTANCE: u32 = 1;
const ONE: u32 = 2;

impl Light {
    fn new(first_map: u32, map_count: u32, slices: Option<Slices>, render_origin: DVec3) -> Self {
        let counted = Self { first_map, map_count, ..Self::default() };
        slices.map_or(counted, |Slices { origin, axis, ends }| Self {
            choice: if map_count == 1 { ONE } else { BY_DISTANCE },
            axis: axis.extend(axis.dot(render_origin - origin)).as_vec4(),
            ends: ends.map(|end| end as f32),
            ..counted
        })
    }
}

/// The kinds of maps, as in `wgsl/receiver.wesl`.
const AFFINE: u32 = 0;
const ONE_POINT: u32 = 1;
const GENERAL: u32 = 2;

/// `SHADOW_ROUNDING` of that file.
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;

impl Map {
    fn new(
        map: &ShadowMap,
        index: usize,
        place: &Place,
        planes: &mut Vec<Vec4>,
        placed: &Placed<'_>,
    ) -> Self {
        let local_from_render = local_from_render(map, placed.render_origin);
        let m = map.shadow_from_local * local_from_render;
        let [width, height] = place.size.map(f64::from);
        let plane = |p: umbrage::Plane| {
            p.normal.extend(p.offset + p.normal.dot(local_from_render.w_axis.truncate())).as_vec4()
        };
        let first_plane = planes.len() as u32;
        planes.extend(map.cell.iter().map(|&p| plane(p)));
        let render_from_local = DMat4::from_translation(map.origin - placed.render_origin);
        let inverse = render_from_local * map.local_from_shadow;
        let [s, t, depth] = [inverse.x_axis / width, inverse.y_axis / height, inverse.z_axis];
        let with_plane = Self {
            s: (m.row(0) * width).as_vec4(),
            t: (m.row(1) * height).as_vec4(),
            depth: m.row(2).as_vec4(),
            w: m.row(3).as_vec4(),
            along_s: s.as_vec4(),
            along_t: t.as_vec4(),
            along_depth: depth.as_vec4(),
            layer: place.layer,
            size: place.size.map(|n| (n as f32).next_down()),
            origin: [0, 1].map(|i| {
                (f64::from(place.origin[i]) / f64::from(placed.texture_size[i].max(1))) as f32
            }),
            // Points that the map serves lie inside the map up to rounding, even at the border of
            // its part of the view.
            rounding: (1e-4 * width.max(height)) as f32,
            // The plane at infinity has no point on its negative side, so the map never fades.
            fade_from: map.fade_from.map_or(Vec4::W, plane),
            beam_scale: beam_scale(map),
            slab: slab(map),
            first_plane,
            plane_count: map.cell.len() as u32,
            index: index as u32,
            ..Self::default()
        };
        with_plane.with_bias([s, t, depth], m.row(3), placed.bias)
    }

    /// Adds what `shadow_slack` needs: `along` are the columns of the inverse matrix, and `w` is
    /// the matrix's last row.
    fn with_bias(self, along: [DVec4; 3], w: DVec4, bias: Bias) -> Self {
        let [s, t, depth] = along;
        // Without a margin of the user's, the slack is half a diameter.
        let share = 0.5 + f64::from(bias.texels);
        let metres = f64::from(bias.metres);
        let is_one_point = s.w == 0.0 && depth.w == 0.0;
        if !is_one_point {
            return Self {
                footprint_s: share as f32,
                margin: metres as f32,
                kind: GENERAL,
                ..self
            };
        }
        // The steps in units of the step in depth, in an orthonormal basis across the beam whose x
        // axis lies along the step in s.
        let length = depth.truncate().length();
        let beam = depth.truncate() / length;
        let across = s.truncate().reject_from_normalized(beam);
        let x = across.normalize();
        let y = beam.cross(x);
        let scale = share / length;
        let row = |axis: DVec3| (axis * -t.w).extend(axis.dot(t.truncate())) * scale;
        let footprint_s = across.length() * scale;
        let margin = (metres / length) as f32;
        if w != DVec4::W {
            return Self {
                footprint_x: row(x).as_vec4(),
                footprint_y: row(y).as_vec4(),
                footprint_s: footprint_s as f32,
                margin,
                kind: ONE_POINT,
                ..self
            };
        }
        // The step in t is the same everywhere.
        let step = DVec2::new(row(x).w, row(y).w);
        let [ss, tt, st] = [footprint_s * footprint_s, step.length_squared(), footprint_s * step.x];
        let longest = (0.5 * (ss + tt) + (0.5 * (ss - tt)).hypot(st)).sqrt();
        let slack = longest + metres / length + ROUNDING;
        Self { footprint_s: slack as f32, kind: AFFINE, ..self }
    }
}

/// `ShadowPrefilterMap`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PrefilterMap {
    pub(crate) beam_scale: Vec4,
    pub(crate) slab: Vec4,
    pub(crate) origin: [f32; 2],
    pub(crate) first_layer: u32,
    pub(crate) padding: u32,
}

impl PrefilterMap {
    /// A map whose statistics take `textures` layers.
    pub(crate) fn new(map: &ShadowMap, place: &Place, textures: u32) -> Self {
        Self {
            beam_scale: beam_scale(map),
            slab: slab(map),
            origin: place.origin.map(|n| n as f32),
            first_layer: place.layer * textures,
            padding: 0,
        }
    }
}

/// The fourth coordinate of the points of a map's beams: its growth per texel in s, per texel in t
/// and from depth 0 to depth 1, and its value at texel 0 and depth 0.
fn beam_scale(map: &ShadowMap) -> Vec4 {
    let w = map.local_from_shadow.row(3);
    let [width, height] = map.resolution.map(|n| f64::from(n.max(1)));
    DVec4::new(w.x / width, w.y / height, w.z, w.w).as_vec4()
}

/// The argument `slab` of `shadow_slab_depth` in `wgsl/slab.wesl`, which explains it.
fn slab(map: &ShadowMap) -> Vec4 {
    let [width, height] = map.resolution.map(|n| f64::from(n.max(1)));
    match map.slab {
        Slab::Leaning { slope, begin, thickness } => {
            DVec4::new(slope.x / width, slope.y / height, begin, 1.0 / thickness)
        }
        Slab::Distances { axis, near, far } => {
            let m = map.local_from_shadow;
            // The distance times the fourth coordinate does not depend on depth, because the lamp
            // is the point at which depth is infinite.
            let apex = axis.dot(map.apex.unwrap_or(DVec3::ZERO));
            let row = |c: DVec4| (axis.dot(c.truncate()) - apex * c.w) / (far - near);
            let [s, t, zero] = [row(m.x_axis), row(m.y_axis), row(m.w_axis)];
            DVec4::new(s / width, t / height, zero, near / (far - near))
        }
    }
    .as_vec4()
}

/// The matrix from render space to a map's local space.
pub(crate) fn local_from_render(map: &ShadowMap, render_origin: DVec3) -> DMat4 {
    DMat4::from_translation(render_origin - map.origin)
}

/// The matrix from render space to the clip space of a viewport that covers all texels drawn for a
/// map, its gutter included.
pub(crate) fn clip_from_render(map: &ShadowMap, filter: &Filter, render_origin: DVec3) -> DMat4 {
    let m = map.shadow_from_local * local_from_render(map, render_origin);
    let w = m.row(3);
    let gutter = f64::from(filter.reach_texels());
    let drawn = filter.drawn_texels(map.resolution);
    let across = |i: usize| {
        let [map, drawn] = [map.resolution[i], drawn[i]].map(f64::from);
        (m.row(i) * map + w * gutter) * (2.0 / drawn) - w
    };
    // The first row of texels is the uppermost row of a viewport, where y = 1 in clip space.
    let [x, y] = [across(0), -across(1)];
    DMat4::from_cols(x, y, m.row(2), w).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbrage::{Bounds, Camera, LookAt, Planner, PointLight, SpotLight};

    /// The data for one light and a technique, in render space around the origin of the world.
    fn filled(light: umbrage::Light, technique: &str) -> (Lookup, Plan) {
        let camera = Camera::look_at(LookAt {
            eye: DVec3::new(3.0, 2.0, 1.0),
            target: DVec3::new(9.0, 1.0, -4.0),
            up: DVec3::Y,
            fov_y_rad: 1.0,
            image: [640, 360],
            near: 0.1,
            far: 80.0,
        });
        let scene =
            umbrage::Aabb { min: DVec3::new(-50.0, 0.0, -50.0), max: DVec3::new(50.0, 9.0, 50.0) };
        let technique = technique.parse().unwrap();
        let plan = Planner::new()
            .plan(&camera.unwrap(), &[light], &Bounds::of_scene(scene), &technique)
            .unwrap()
            .clone();
        let place = |map: &ShadowMap| {
            (!map.is_empty()).then_some(Place { layer: 0, origin: [8, 24], size: map.resolution })
        };
        let places: Vec<_> = plan.maps.iter().map(place).collect();
        let placed = Placed {
            places: &places,
            texture_size: [4096, 1024],
            render_origin: DVec3::ZERO,
            bias: Bias::default(),
            pages_across: 0,
        };
        let mut lookup = Lookup::default();
        lookup.fill(&plan, &placed);
        (lookup, plan)
    }

    fn sun() -> umbrage::Light {
        umbrage::Light::Directional { direction: DVec3::new(0.5, -1.0, 0.25) }
    }

    fn spot() -> umbrage::Light {
        umbrage::Light::Spot(SpotLight {
            position: DVec3::new(8.0, 7.0, -2.0),
            direction: -DVec3::Y,
            half_angle_rad: 0.9,
            near: 0.1,
            range: 30.0,
        })
    }

    /// A light into a half-space, which has six maps.
    fn wide_spot() -> umbrage::Light {
        let umbrage::Light::Spot(spot) = spot() else { unreachable!("a spot light") };
        let half_angle_rad = std::f64::consts::FRAC_PI_2;
        umbrage::Light::Spot(SpotLight { half_angle_rad, ..spot })
    }

    fn bulb() -> umbrage::Light {
        let position = DVec3::new(8.0, 5.0, -2.0);
        umbrage::Light::Point(PointLight { position, near: 0.1, range: 30.0 })
    }

    /// The quick ways to find a map are taken exactly where nothing else bounds what it serves.
    #[test]
    fn maps_are_found_in_the_quickest_way() {
        for (light, technique, choice) in [
            (sun(), "adaptive", ONE),
            (sun(), "unfocused", ONE),
            (sun(), "adaptive+z4", BY_DISTANCE),
            (sun(), "uniform(stable)+z16", BY_DISTANCE),
            (sun(), "adaptive+z3(fitted,overlap=0.2)", 0),
            (sun(), "lispsm+face", 0),
            (spot(), "adaptive+z2", 0),
            (wide_spot(), "adaptive", 0),
            (bulb(), "adaptive", 0),
        ] {
            let (lookup, _) = filled(light, technique);
            assert_eq!(lookup.lights[0].choice, choice, "{technique}");
        }
    }

    #[test]
    fn every_map_is_of_the_simplest_kind() {
        for (light, technique, kind) in [
            (sun(), "uniform", AFFINE),
            (sun(), "uniform(stable)+z2", AFFINE),
            (sun(), "lispsm", ONE_POINT),
            (sun(), "adaptive+face", ONE_POINT),
            (sun(), "psm", ONE_POINT),
            (spot(), "uniform", GENERAL),
        ] {
            let (lookup, _) = filled(light, technique);
            let most_general = lookup.maps.iter().map(|map| map.kind).max();
            assert_eq!(most_general, Some(kind), "{technique}");
        }
    }

    /// The slice that the distance alone finds is the one whose planes hold the point.
    #[test]
    fn slices_by_distance_are_those_by_planes() {
        let (lookup, plan) = filled(sun(), "adaptive+z6");
        let light = lookup.lights[0];
        let mut found = [0; 6];
        for k in 0..1000 {
            let point = DVec3::new(3.0, 2.0, 1.0)
                + DVec3::new(6.0, -1.0, -5.0) * (0.02 + 0.02 * f64::from(k));
            let distance = light.axis.dot(point.extend(1.0).as_vec4());
            let slice = light.ends.iter().filter(|&&end| distance > end).count();
            let map = (slice < light.map_count as usize)
                .then(|| lookup.maps[light.first_map as usize + slice].index as usize);
            assert_eq!(map, plan.lookup(0, point).next().map(|(map, _)| map), "{point}");
            map.into_iter().for_each(|_| found[slice] += 1);
        }
        assert!(found.iter().all(|&n| n > 0), "{found:?}");
    }
}
