//! Finishing: the resolutions of drafted maps and everything that depends on them.

use super::Frame;
use super::draft::Draft;
use crate::aliasing::Local;
use crate::bounds::Aabb;
use crate::error::Error;
use crate::focus::{Body, thickened};
use crate::math::range;
use crate::matrices::MARGIN_TEXELS;
use crate::plan::{MapError, ShadowMap, Slab};
use crate::resolution::enlarged;
use crate::slab::{all_distances, distances, slab};
use crate::technique::Size;
use crate::worst::{self, worst_direction, worst_in_s_and_t, worst_of_shape};
use glam::{DVec2, DVec3, Vec4Swizzles};

/// The largest distance before the receivers at which casters keep their depths, in ranges of the
/// receivers' depths. Casters beyond it are clamped, so that the receivers' depths keep enough
/// digits.
const MOST_CASTER_DEPTHS: f64 = 1000.0;

/// The largest ratio between the distance from a lamp at which the receivers' depths begin and that
/// of casters which keep their depths. Casters nearer to the lamp are clamped, because depth tends
/// to infinity there.
const CLOSEST_TO_LAMP: f64 = 16.0;

/// Buffers kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Finishing {
    worst: worst::Buffers,
    casters: Body,
    /// (s, t, depth) of a body's vertices.
    corners: Vec<DVec3>,
}

/// The width of a texel in metres, and the same length along the beam as a difference in depth.
struct Texel {
    metres: f64,
    depth: f64,
}

impl Finishing {
    /// The largest texel over the body's vertices, or an upper bound of it.
    fn texels(map: &ShadowMap, draft: &Draft) -> Texel {
        if let Some(shape) = &draft.shape {
            let [_, most_w] = draft.range_of_w(shape);
            let off_axis = draft.outline.iter().map(|&i| draft.seen[i as usize].xz.x);
            let off_axis = off_axis.map(|x| shape.off_axis(x).abs()).fold(0.0, f64::max);
            let over_w = shape.texel_over_w(most_w, off_axis, map.resolution.map(f64::from));
            // Along the beam w is constant, so depth grows by the same over w everywhere.
            let beam = map.local_from_shadow.z_axis.truncate().normalize_or_zero();
            let depth_times_w = map.shadow_from_local.row(2).truncate().dot(beam);
            let longest = over_w.longest();
            return Texel { metres: longest * most_w, depth: longest * depth_times_w };
        }
        let mut largest = Texel { metres: 0.0, depth: 0.0 };
        for local in draft.body.vertices().iter().filter_map(|&v| Local::at(map, v)) {
            let metres = local.footprint().longest();
            largest.metres = largest.metres.max(metres);
            largest.depth = largest.depth.max(metres * local.depth_per_metre);
        }
        largest
    }

    /// Distance in depth, ≥ 0, from depth 0 to the nearest caster before it that can cast into
    /// the map.
    fn nearest_caster(&mut self, map: &ShadowMap, draft: &Draft, casters: Aabb) -> f64 {
        let body = &mut self.casters;
        body.clear();
        body.push_box(thickened(casters.relative_to(map.origin), draft.body.size()));
        // The depths of a stable map must not depend on the view, as its caster planes do.
        if draft.stable.is_none() {
            body.clip(&map.caster_planes);
        }
        let depth = |&v: &DVec3| {
            let h = map.shadow_from_local * v.extend(1.0);
            if h.w > 0.0 { h.z / h.w } else { f64::NEG_INFINITY }
        };
        let (nearest, _) = range(body.vertices().iter().map(depth));
        if body.is_empty() {
            return 0.0;
        }
        let [begin, step] = map.beam_scale(DVec2::splat(0.5));
        // Distance from a lamp is inversely proportional to the fourth coordinate.
        let most = if step == 0.0 {
            MOST_CASTER_DEPTHS
        } else {
            ((CLOSEST_TO_LAMP - 1.0) * begin / -step).clamp(0.0, MOST_CASTER_DEPTHS)
        };
        (-nearest).clamp(0.0, most)
    }

    /// Gives a map its resolution and everything that depends on it.
    pub(super) fn finish(
        &mut self,
        map: &mut ShadowMap,
        draft: &Draft,
        size: [u32; 2],
        frame: &Frame<'_>,
    ) -> Result<(), Error> {
        let Frame { camera, bounds, technique, limits } = *frame;
        if draft.body.is_empty() {
            map.resolution = [0, 0];
            return Ok(());
        }
        let worst = &mut self.worst;
        let Draft { body, seen, shape, stable, .. } = draft;
        // The largest errors in s and t are inversely proportional to the resolution, unless the
        // map is stable, whose matrices depend on it.
        let unit = match (shape, stable) {
            (None, None) => {
                draft.largest_errors.unwrap_or_else(|| worst_in_s_and_t(map, body, camera, worst))
            }
            _ => [0.0; 2],
        };
        let mut margin = 0.0;
        let mut set = |map: &mut ShadowMap, size: [u32; 2]| {
            map.resolution = size;
            if let Some(stable) = stable {
                margin = stable.place(map);
            }
            map.error = match shape.or_else(|| stable.as_ref()?.shape(size)) {
                Some(shape) => worst_of_shape(&shape, size, body, seen, camera, worst),
                None => {
                    let s_and_t = match stable {
                        None => [0, 1].map(|i| unit[i] / f64::from(size[i])),
                        Some(_) => worst_in_s_and_t(map, body, camera, worst),
                    };
                    MapError::new(s_and_t, worst_direction(map, body, camera, worst))
                }
            };
        };
        set(map, size);
        if let Size::MaxError(wanted) = technique.size {
            // Sizes were computed from errors in s and t at the body's vertices, but the worst
            // direction may be another. The tolerance is for rounding alone, by which a stable
            // map's size would otherwise change with the view.
            while map.error.max > wanted * (1.0 + 1e-9) {
                let larger = enlarged(technique, limits, map.resolution, map.error.max / wanted)?;
                set(map, larger);
            }
        }
        let texel = Self::texels(map, draft);
        // Casters onto the gutter that the filter reads count as well.
        let reach = f64::from(technique.filter.reach_texels()) * texel.metres;
        map.caster_planes.iter_mut().for_each(|p| p.offset += reach);
        if draft.stable.is_none() {
            margin = MARGIN_TEXELS * texel.depth;
        }
        let earlier = match bounds.casters.filter(|_| technique.filter.keeps_casters()) {
            Some(casters) => margin.max(self.nearest_caster(map, draft, casters)),
            None => margin,
        };
        map.begin_earlier(earlier);
        let is_fixed = technique.cover.is_fixed();
        map.slab = match map.apex {
            Some(apex) if is_fixed => all_distances(map, apex),
            Some(apex) => distances(map, apex, &draft.body, texel.metres),
            None if is_fixed => Slab::default(),
            // Prefilters alone count depths in the slab.
            None if technique.filter.prefilter().is_none() => Slab::default(),
            None => {
                let shadow = |&v: &DVec3| {
                    let h = map.shadow_from_local * v.extend(1.0);
                    (h.w > 0.0).then(|| h.xyz() / h.w)
                };
                self.corners.clear();
                self.corners.extend(draft.body.vertices().iter().filter_map(shadow));
                slab(&self.corners, texel.depth / (1.0 + earlier))
            }
        };
        let height = f64::from(camera.image()[1]);
        map.storage_factor =
            map.error.max_s * map.error.max_t * map.texels() as f64 / (height * height);
        Ok(())
    }
}
