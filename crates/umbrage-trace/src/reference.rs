//! Plans executed by ray tracing.

mod pages;

use crate::statistics::StatisticMap;
use crate::{Error, Progress, Ray, Sample, Tracer};
use glam::{DVec2, DVec3};
use pages::Pages;
use rayon::prelude::*;
use umbrage::visibility::statistic::Channels;
use umbrage::visibility::{
    Filter, Prefilter, Texels, shadow_coordinates, texel_coordinates, visibility,
};
use umbrage::{Plan, ShadowMap};

/// The depths of a shadow map, each found by a ray through its texel's centre.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthMap {
    resolution: [u32; 2],
    gutter: u32,
    /// Texels in s and t that were drawn: the map, its gutter, and the texels that pad the gutter's
    /// far end.
    drawn: [u32; 2],
    texels: Vec<f32>,
}

impl DepthMap {
    /// Casts a ray from the light's side along the beam of each texel of `map` and of its gutter,
    /// which is `gutter` texels wide on every side. Filters read the gutter at the map's border.
    ///
    /// A texel holds the depth of the first hit, clamped to [0, 1]: casters between the light and
    /// the receivers are flattened onto depth 0 (Lloyd et al. 2006, §6.4), and surfaces behind the
    /// receivers do not matter. A texel whose ray hits nothing holds 1. `progress` is told of each
    /// row, gutter included.
    ///
    /// # Errors
    /// [`Error::Memory`] if the map does not fit into memory.
    pub fn render(
        tracer: &Tracer<'_>,
        map: &ShadowMap,
        gutter: u32,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        let drawn = map.resolution.map(|n| n.saturating_add(2 * gutter));
        Self::render_drawn(tracer, map, gutter, drawn, progress)
    }

    /// As [`render`](Self::render), for `drawn` texels in s and t in all.
    fn render_drawn(
        tracer: &Tracer<'_>,
        map: &ShadowMap,
        gutter: u32,
        drawn: [u32; 2],
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        let resolution = map.resolution;
        if map.is_empty() {
            let texels = Vec::new();
            return Ok(Self { resolution: [0, 0], gutter: 0, drawn: [0, 0], texels });
        }
        let [width, height] = drawn.map(|n| n as usize);
        let mut texels = Vec::new();
        let count = width.checked_mul(height).ok_or(Error::Memory { resolution })?;
        texels.try_reserve_exact(count).map_err(|_| Error::Memory { resolution })?;
        texels.resize(count, 1.0);
        texels.par_chunks_mut(width).enumerate().for_each(|(row, texels)| {
            trace_row(tracer, map, gutter, row, texels);
            progress(1);
        });
        Ok(Self { resolution, gutter, drawn, texels })
    }

    /// As [`render`](Self::render), on the thread that asks. The map must be as small as a page.
    fn of_page(tracer: &Tracer<'_>, map: &ShadowMap, gutter: u32) -> Self {
        let drawn = map.resolution.map(|n| n + 2 * gutter);
        let [width, height] = drawn.map(|n| n as usize);
        let mut texels = vec![1.0; width * height];
        for (row, texels) in texels.chunks_mut(width).enumerate() {
            trace_row(tracer, map, gutter, row, texels);
        }
        Self { resolution: map.resolution, gutter, drawn, texels }
    }

    /// Number of rows that [`render`](Self::render) reports.
    pub fn rows(map: &ShadowMap, gutter: u32) -> u64 {
        if map.is_empty() { 0 } else { u64::from(map.resolution[1]) + 2 * u64::from(gutter) }
    }

    /// Resolution in s and t without the gutter, texels.
    pub fn resolution(&self) -> [u32; 2] {
        self.resolution
    }

    /// Width of the gutter, and resolution of all that is drawn, texels.
    pub(crate) fn drawn(&self) -> (u32, [u32; 2]) {
        (self.gutter, self.drawn)
    }

    /// Depth of texel (`i`, `j`), in [0, 1]. Indices beyond the drawn texels give the nearest drawn
    /// texel. A map without texels gives 1.
    pub fn texel(&self, i: i32, j: i32) -> f32 {
        if self.texels.is_empty() {
            return 1.0;
        }
        let gutter = i64::from(self.gutter);
        let clamp =
            |index: i32, n: u32| (i64::from(index) + gutter).clamp(0, i64::from(n) - 1) as usize;
        let [width, height] = self.drawn;
        self.texels[clamp(j, height) * width as usize + clamp(i, width)]
    }
}

/// Sets the depths of a map's row of this index, counted from the begin of its gutter.
fn trace_row(tracer: &Tracer<'_>, map: &ShadowMap, gutter: u32, row: usize, texels: &mut [f32]) {
    for (column, texel) in texels.iter_mut().enumerate() {
        let center = DVec2::new(column as f64, row as f64) + 0.5 - f64::from(gutter);
        *texel = depth_at(tracer, map, center).unwrap_or(1.0);
    }
}

/// Bytes of each texel that lookups read.
fn bytes_per_texel(filter: Filter) -> u32 {
    match filter {
        Filter::Prefiltered(Prefilter { statistic, .. }) => {
            statistic.channels() as u32 * statistic.storage().bytes()
        }
        _ => 4,
    }
}

/// Depth of the first hit along the beam through a point in texel coordinates; `None` if nothing is
/// hit.
fn depth_at(tracer: &Tracer<'_>, map: &ShadowMap, texel: DVec2) -> Option<f32> {
    let beam = map.beam(shadow_coordinates(map, texel))?;
    let ray = Ray { origin: beam.origin, direction: beam.direction };
    let range = [-beam.reach_back, f64::INFINITY];
    let hit = match map.apex {
        Some(apex) => tracer.closest_from_lamp(apex + map.origin, ray, range),
        None => tracer.closest_caster(ray, range),
    }?;
    let depth = map.project(tracer.position(&hit)).map_or(1.0, |p| p.z);
    Some(depth.clamp(0.0, 1.0) as f32)
}

/// A plan executed by ray tracing: the depths of its maps, and lookups into them. If the plan has
/// [pages](umbrage::paged), each of them is traced when it is first looked up.
#[derive(Debug)]
pub struct Reference<'a> {
    plan: &'a Plan,
    /// The pages, if the plan has pages in place of maps.
    pages: Option<Pages<'a>>,
    /// Empty if there are pages.
    maps: Vec<DepthMap>,
    /// One for each map if the plan's filter is a prefilter, else empty.
    statistics: Vec<StatisticMap>,
}

/// A map's depths, with the prefiltered map made from them if the filter is a prefilter.
struct Filtered<'a> {
    depths: &'a DepthMap,
    statistics: Option<&'a StatisticMap>,
}

impl Texels for Filtered<'_> {
    fn depth(&self, i: i32, j: i32) -> f32 {
        self.depths.texel(i, j)
    }

    fn statistics(
        &self,
        map: &ShadowMap,
        prefilter: &Prefilter,
        texel: DVec2,
        level: u32,
    ) -> Channels {
        match self.statistics {
            Some(statistics) => statistics.sample(texel, level),
            None => (|i, j| self.depths.texel(i, j)).statistics(map, prefilter, texel, level),
        }
    }
}

/// A position in one of a plan's maps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapTexel {
    /// Index into [`Plan::maps`].
    pub map: usize,
    /// Texel coordinates: texel (i, j) spans [i, i+1] × [j, j+1].
    pub texel: DVec2,
}

impl<'a> Reference<'a> {
    /// Renders the depths of all maps, with the gutter that the plan's filter needs, and the
    /// prefiltered maps if the filter is a prefilter. `progress` is told of each of the
    /// [`rows`](Self::rows) of texels. For plans with pages nothing is rendered yet.
    ///
    /// # Errors
    /// [`Error::Memory`] if a map does not fit into memory.
    pub fn render(
        tracer: &'a Tracer<'a>,
        plan: &'a Plan,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        if plan.paging.is_some() {
            let pages = Some(Pages::new(tracer));
            return Ok(Self { plan, pages, maps: Vec::new(), statistics: Vec::new() });
        }
        let filter = plan.filter;
        let render = |map: &ShadowMap| {
            let drawn = filter.drawn_texels(map.resolution);
            DepthMap::render_drawn(tracer, map, filter.reach_texels(), drawn, progress)
        };
        let maps = plan.maps.iter().map(render).collect::<Result<Vec<_>, _>>()?;
        let statistics = match &filter {
            Filter::Prefiltered(prefilter) => {
                let filtered = plan.maps.iter().zip(&maps);
                filtered
                    .map(|(m, d)| StatisticMap::new(m, d, prefilter))
                    .collect::<Result<_, _>>()?
            }
            _ => Vec::new(),
        };
        Ok(Self { plan, pages: None, maps, statistics })
    }

    /// Number of rows of texels that [`render`](Self::render) reports; 0 for plans with pages.
    pub fn rows(plan: &Plan) -> u64 {
        if plan.paging.is_some() {
            return 0;
        }
        let full = plan.maps.iter().filter(|m| !m.is_empty());
        full.map(|m| u64::from(plan.filter.drawn_texels(m.resolution)[1])).sum()
    }

    /// Memory that the maps, or the pages so far, which lookups read would take on a GPU, gutters
    /// and mip levels included, bytes.
    pub fn bytes(&self) -> u64 {
        let stored = |m: &DepthMap| m.texels.len() as u64;
        let of_pages = self.pages.as_ref().map_or(0, |pages| pages.drawn_texels(self.plan));
        let texels = (self.maps.iter().map(stored).sum::<u64>() + of_pages)
            * u64::from(bytes_per_texel(self.plan.filter));
        // Each mip level has a quarter of the texels of the level before it.
        let levels = match self.plan.filter {
            Filter::Prefiltered(prefilter) => {
                let first = prefilter.first_level();
                first..first + prefilter.levels()
            }
            _ => 0..1,
        };
        levels.map(|level| texels >> (2 * level)).sum()
    }

    /// Number of pages that have been looked up so far; 0 if the plan has none.
    pub fn pages(&self) -> usize {
        self.pages.as_ref().map_or(0, Pages::len)
    }

    /// The depths of the maps, in the order of [`Plan::maps`]; empty if the plan has pages.
    pub fn depth_maps(&self) -> &[DepthMap] {
        &self.maps
    }

    /// Visibility of a sample under one of the plan's lights, in [0, 1], as the shadow maps have
    /// it: 0 for surfaces that face away from the light, 1 for samples that no map serves. Where
    /// slices overlap, the visibilities of their maps are blended. Shadows fade out as the plan has
    /// it.
    pub fn visibility(&self, light: usize, sample: &Sample) -> f32 {
        if !sample.is_facing {
            return 0.0;
        }
        let surface = &sample.surface;
        let (position, normal) = (surface.position, surface.geometric_normal);
        if let Some(pages) = &self.pages {
            let place = self.plan.page_place(light, position);
            let lit = place.and_then(|place| pages.visibility(self.plan, &place, position, normal));
            return self.plan.faded(position, lit.map_or(1.0, f64::from)) as f32;
        }
        let (mut sum, mut shares) = (0.0, 0.0);
        for (index, share) in self.plan.lookup(light, position) {
            let value = self.plan.receiver(index, position, normal).map_or(1.0, |r| {
                let depths = &self.maps[index];
                let statistics = self.statistics.get(index);
                let map = &self.plan.maps[index];
                visibility(map, self.plan.filter, &r, Filtered { depths, statistics })
            });
            sum += share * f64::from(value);
            shares += share;
        }
        let visibility = if shares > 0.0 { sum / shares } else { 1.0 };
        self.plan.faded(position, visibility) as f32
    }

    /// The map with the largest share in a point's visibility under one of the plan's lights, and
    /// the point's position in that map; `None` if no map serves the point. In plans with pages,
    /// the map is the window of the point's level.
    pub fn texel(&self, light: usize, world_position: DVec3) -> Option<MapTexel> {
        if self.pages.is_some() {
            let place = self.plan.page_place(light, world_position)?;
            let texel = pages::texel_in_window(self.plan, &place)?;
            return Some(MapTexel { map: place.map, texel });
        }
        let maps = self.plan.lookup(light, world_position);
        let (index, _) = maps.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let map = &self.plan.maps[index];
        let st = map.project(world_position)?.truncate();
        Some(MapTexel { map: index, texel: texel_coordinates(map, st) })
    }
}
