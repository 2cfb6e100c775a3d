//! The data that shaders read. Each struct has the layout of the struct in `wgsl/` that its comment
//! names.

use crate::wgsl::{MAX_LIGHTS, MAX_MAPS, MAX_PLANES};
use crate::{Bias, Error, Support};
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, DVec4, Mat4, Vec4};
use umbrage::visibility::Filter;
use umbrage::{Place, Plan, ShadowMap, Slab};

/// `ShadowSettings`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Settings {
    pub(crate) bias_texels: f32,
    pub(crate) bias_metres: f32,
    pub(crate) light_count: u32,
    pub(crate) padding: u32,
    pub(crate) texture_scale: [f32; 2],
    pub(crate) padding_too: [f32; 2],
    pub(crate) pixel_gradient: Vec4,
    pub(crate) eye: Vec4,
}

/// `ShadowLight`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Light {
    pub(crate) first_map: u32,
    pub(crate) map_count: u32,
    pub(crate) padding: [u32; 2],
}

/// `ShadowMap`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Map {
    pub(crate) s: Vec4,
    pub(crate) t: Vec4,
    pub(crate) depth: Vec4,
    pub(crate) w: Vec4,
    pub(crate) fade_from: Vec4,
    pub(crate) beam_scale: Vec4,
    pub(crate) slab: Vec4,
    pub(crate) size: [f32; 2],
    pub(crate) origin: [f32; 2],
    pub(crate) layer: u32,
    pub(crate) first_plane: u32,
    pub(crate) plane_count: u32,
    pub(crate) index: u32,
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
                    maps.push(Map::new(map, index, &place, planes, placed.render_origin));
                }
            }
            let map_count = maps.len() as u32 - first_map;
            lights.push(Light { first_map, map_count, padding: [0; 2] });
        }
        *settings = Settings {
            bias_texels: placed.bias.texels,
            bias_metres: placed.bias.metres,
            light_count: lights.len() as u32,
            padding: 0,
            texture_scale: placed.texture_size.map(|n| 1.0 / n.max(1) as f32),
            padding_too: [0.0; 2],
            pixel_gradient: {
                let local_from_render = placed.render_origin - plan.origin;
                let gradient = plan.pixel_gradient;
                gradient.extend(gradient.dot(local_from_render)).as_vec4()
            },
            eye: (plan.origin - placed.render_origin).extend(1.0).as_vec4(),
        };
    }

    /// Checks that a device without storage buffers has room for as many lights, maps and planes.
    pub(crate) fn check(&self, support: &Support) -> Result<(), Error> {
        let counts = [
            ("lights", self.lights.len(), MAX_LIGHTS),
            ("maps", self.maps.len(), MAX_MAPS),
            ("planes around what maps serve", self.planes.len(), MAX_PLANES),
        ];
        match counts.into_iter().find(|&(_, given, max)| given > max) {
            Some((what, given, max)) if !support.storage_buffers => {
                Err(Error::TooMany { what, given, max })
            }
            _ => Ok(()),
        }
    }
}

impl Map {
    fn new(
        map: &ShadowMap,
        index: usize,
        place: &Place,
        planes: &mut Vec<Vec4>,
        render_origin: DVec3,
    ) -> Self {
        let local_from_render = local_from_render(map, render_origin);
        let m = map.shadow_from_local * local_from_render;
        let size = place.size.map(f64::from);
        let plane = |p: umbrage::Plane| {
            p.normal.extend(p.offset + p.normal.dot(local_from_render.w_axis.truncate())).as_vec4()
        };
        let first_plane = planes.len() as u32;
        planes.extend(map.cell.iter().map(|&p| plane(p)));
        Self {
            s: (m.row(0) * size[0]).as_vec4(),
            t: (m.row(1) * size[1]).as_vec4(),
            depth: m.row(2).as_vec4(),
            w: m.row(3).as_vec4(),
            // The plane at infinity has no point on its negative side, so the map never fades.
            fade_from: map.fade_from.map_or(Vec4::W, plane),
            beam_scale: beam_scale(map),
            slab: slab(map),
            size: place.size.map(|n| n as f32),
            origin: place.origin.map(|n| n as f32),
            layer: place.layer,
            first_plane,
            plane_count: map.cell.len() as u32,
            index: index as u32,
        }
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
