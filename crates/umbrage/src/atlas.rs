use crate::plan::Plan;
use glam::DVec2;
use guillotiere::{AllocatorOptions, DEFAULT_OPTIONS, SimpleAtlasAllocator, size2};

/// Where the maps of a [`Plan`] lie in a texture or in an array of textures.
///
/// Each map is surrounded by a gutter, which shares no texel with other maps or gutters. Render the
/// gutter together with the map (texels just outside [0, 1]² have depths like any others), so that
/// a filter at a map's border reads no texels of other maps.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Atlas {
    /// Width and height of the texture in texels; both 0 if all maps are empty.
    pub size: [u32; 2],
    /// Number of the texture's layers, which all have this size.
    pub layers: u32,
    /// Width of the gutter around each map, texels.
    pub gutter_texels: u32,
    /// The place of each map, in the order of [`Plan::maps`]; `None` for empty maps.
    pub places: Vec<Option<Place>>,
}

/// A rectangle of texels in an [`Atlas`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Index of the texture's layer.
    pub layer: u32,
    /// First texel of the map in that layer, not counting its gutter: (s, t) = (0, 0) lies at its
    /// corner.
    pub origin: [u32; 2],
    /// Resolution of the map, texels in s and t.
    pub size: [u32; 2],
}

/// Takes a map's (s, t), after [`Rows`](crate::Rows), to a position in the texture: scale · (s, t)
/// + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleOffset {
    /// Factors of s and of t.
    pub scale: DVec2,
    /// Position of (s, t) = (0, 0).
    pub offset: DVec2,
}

/// The error of maps for which one texture has no room.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "no room for {maps} shadow maps of {texels} texels, gutters included, in a texture of {max_side}x{max_side}"
)]
pub struct AtlasTooLarge {
    /// Number of maps that are not empty.
    pub maps: usize,
    /// Number of their texels, including gutters.
    pub texels: u64,
    /// The longest side that was allowed, texels.
    pub max_side: u32,
}

impl Atlas {
    /// Packs all maps side by side into one texture, which the search makes as small and as square
    /// as it can. Equal plans give equal atlases, but nearly equal plans may give very different
    /// ones.
    ///
    /// Gutters are as wide as the plan's filter [reaches](crate::visibility::Filter::reach_texels)
    /// beyond a map. Maps begin at multiples of texels that the filter
    /// [requires](crate::visibility::Filter::slot_texels). `max_side` is the longest side of a
    /// texture that the device allows, texels. Allocates memory.
    ///
    /// # Errors
    /// If the search finds no arrangement. For plans of the built-in scenes with 4 to 102 maps,
    /// maps and gutters filled 93% of the atlas on average, and 85% in the worst case.
    pub fn packed(plan: &Plan, max_side: u32) -> Result<Self, AtlasTooLarge> {
        Self::packed_sizes(&slots(plan), plan.filter.reach_texels(), max_side)
            .map(|atlas| atlas.holding(plan))
    }

    /// Like [`packed`](Self::packed), for rectangles of any sizes (texels in s and t), for example
    /// maps with room to grow. A rectangle without texels gets no place.
    ///
    /// # Errors
    /// If the search finds no arrangement.
    pub fn packed_sizes(
        sizes: &[[u32; 2]],
        gutter_texels: u32,
        max_side: u32,
    ) -> Result<Self, AtlasTooLarge> {
        let rectangles = Rectangles::new(sizes, gutter_texels, max_side)?;
        let packing = rectangles.pack().ok_or(rectangles.too_large)?;
        let mut places = vec![None; sizes.len()];
        for (&(map, _), corner) in rectangles.list.iter().zip(packing.corners) {
            let origin = corner.map(|c| c + gutter_texels);
            places[map] = Some(Place { layer: 0, origin, size: sizes[map] });
        }
        Ok(Self { size: packing.size, layers: 1, gutter_texels, places })
    }

    /// Puts each map into a layer of its own, in the order of [`Plan::maps`]. All layers are as
    /// wide and as high as the largest map needs. Empty maps keep their layers, so that no map
    /// moves when others become empty.
    ///
    /// Parameters and errors are those of [`packed`](Self::packed).
    pub fn layered(plan: &Plan, max_side: u32) -> Result<Self, AtlasTooLarge> {
        Self::layered_sizes(&slots(plan), plan.filter.reach_texels(), max_side)
            .map(|atlas| atlas.holding(plan))
    }

    /// Shrinks each place to the resolution of its map, which may be smaller than its slot.
    fn holding(mut self, plan: &Plan) -> Self {
        for (place, map) in self.places.iter_mut().zip(&plan.maps) {
            *place = place.map(|place| Place { size: map.resolution, ..place });
        }
        self
    }

    /// Like [`layered`](Self::layered), for rectangles of any sizes (texels in s and t).
    ///
    /// # Errors
    /// If one rectangle with its gutters is larger than a texture may be.
    pub fn layered_sizes(
        sizes: &[[u32; 2]],
        gutter_texels: u32,
        max_side: u32,
    ) -> Result<Self, AtlasTooLarge> {
        let rectangles = Rectangles::new(sizes, gutter_texels, max_side)?;
        let places = sizes.iter().zip(0..).map(|(&size, layer)| {
            let is_there = !size.contains(&0);
            is_there.then_some(Place { layer, origin: [gutter_texels; 2], size })
        });
        Ok(Self {
            size: rectangles.largest(),
            layers: sizes.len() as u32,
            gutter_texels,
            places: places.collect(),
        })
    }

    /// The transform from a map's (s, t) to texels of its layer. `None` for maps that are empty or
    /// do not exist.
    pub fn texels_from_shadow(&self, map: usize) -> Option<ScaleOffset> {
        let Place { origin, size, .. } = (*self.places.get(map)?)?;
        let [scale, offset] = [size, origin].map(|[x, y]: [u32; 2]| DVec2::new(x.into(), y.into()));
        Some(ScaleOffset { scale, offset })
    }

    /// The transform from a map's (s, t) to texture coordinates in [0, 1]² of its layer. `None` as
    /// for [`texels_from_shadow`](Self::texels_from_shadow).
    pub fn atlas_from_shadow(&self, map: usize) -> Option<ScaleOffset> {
        let ScaleOffset { scale, offset } = self.texels_from_shadow(map)?;
        let size = DVec2::new(self.size[0].into(), self.size[1].into());
        Some(ScaleOffset { scale: scale / size, offset: offset / size })
    }
}

impl ScaleOffset {
    /// The position of `st`.
    pub fn apply(self, st: DVec2) -> DVec2 {
        self.scale * st + self.offset
    }
}

/// The size of each map's slot without gutters, texels.
fn slots(plan: &Plan) -> Vec<[u32; 2]> {
    plan.maps.iter().map(|m| plan.filter.slot_texels(m.resolution)).collect()
}

/// Rectangles to be packed.
struct Rectangles {
    /// Index of each map that is not empty, and its size including gutters.
    list: Vec<(usize, [u32; 2])>,
    max_side: u32,
    /// The error to return where there is no room.
    too_large: AtlasTooLarge,
}

/// An arrangement of rectangles side by side.
struct Packing {
    size: [u32; 2],
    /// Each rectangle's corner with the smallest coordinates.
    corners: Vec<[u32; 2]>,
}

impl Packing {
    /// The quantity to minimise: the area, increased by a small penalty for shapes far from a
    /// square, because long strips reach a device's limits first.
    fn cost(&self) -> f64 {
        let [w, h] = self.size.map(f64::from);
        w * h * (1.0 + STRIP_COST * (w.max(h) / w.min(h) - 1.0))
    }
}

impl Rectangles {
    /// The maps with their gutters, or an error if one of them alone is too large.
    fn new(sizes: &[[u32; 2]], gutter_texels: u32, max_side: u32) -> Result<Self, AtlasTooLarge> {
        let with_gutters = |size: [u32; 2]| {
            size.map(|n| u64::from(n).saturating_add(2 * u64::from(gutter_texels)))
        };
        let full = || sizes.iter().copied().enumerate().filter(|(_, size)| !size.contains(&0));
        let texels = full().map(|(_, m)| with_gutters(m).into_iter().fold(1, u64::saturating_mul));
        let too_large = AtlasTooLarge {
            maps: full().count(),
            texels: texels.fold(0, u64::saturating_add),
            max_side,
        };
        let fitting = |(i, map)| {
            let [w, h] =
                with_gutters(map).map(|n| u32::try_from(n).ok().filter(|&n| n <= max_side));
            Some((i, [w?, h?]))
        };
        let list = full().map(fitting).collect::<Option<_>>().ok_or(too_large)?;
        Ok(Self { list, max_side, too_large })
    }

    /// The smallest size that can hold any one of the rectangles.
    fn largest(&self) -> [u32; 2] {
        self.list.iter().fold([0, 0], |[w, h], &(_, size)| [w.max(size[0]), h.max(size[1])])
    }

    /// The best packing found over several orders and widths, with the lowest height found for each
    /// of these.
    fn pack(&self) -> Option<Packing> {
        let texels = self.too_large.texels;
        let [widest, highest] = self.largest();
        if texels == 0 {
            return Some(Packing { size: [0, 0], corners: Vec::new() });
        }
        // Widths range from half to twice the side of a square without gaps. With few maps more
        // widths are tried, because the shapes of few maps matter most.
        let side = (texels as f64).sqrt();
        let steps = (SEARCH_EFFORT / self.list.len()).clamp(2, 24) as i32;
        let widths = (-steps..=steps).map(|i| {
            let ratio = (f64::from(i) / f64::from(steps)).exp2();
            ((side * ratio).ceil() as u32).clamp(widest, self.max_side)
        });
        let mut widths: Vec<u32> = widths.collect();
        widths.dedup();
        let mut best: Option<Packing> = None;
        for order in ORDERS {
            let mut sorted: Vec<usize> = (0..self.list.len()).collect();
            sorted.sort_by_key(|&i| std::cmp::Reverse(order(self.list[i].1)));
            for &width in &widths {
                let mut low = highest.max(texels.div_ceil(width.into()).try_into().ok()?);
                // A packing much higher than this costs no less than the best one so far. (The
                // factor 1.1 is because a packing need not use all of the width.)
                let bound = best.as_ref().map_or(f64::MAX, |b| 1.1 * b.cost() / f64::from(width));
                let mut high = self.max_side.min(bound as u32);
                while low <= high {
                    let height = low.midpoint(high.min(low.saturating_mul(2)));
                    match self.pack_into([width, height], &sorted) {
                        Some(packing) => {
                            high = packing.size[1] - 1;
                            if best.as_ref().is_none_or(|b| packing.cost() < b.cost()) {
                                best = Some(packing);
                            }
                        }
                        None => low = (height + 1).max(high.min(height + height / FINENESS)),
                    }
                }
            }
        }
        best
    }

    /// Packs the rectangles into a texture of this size in this order; `None` if there is no room.
    fn pack_into(&self, size: [u32; 2], order: &[usize]) -> Option<Packing> {
        let int = |n: u32| i32::try_from(n).unwrap_or(i32::MAX);
        let mut allocator =
            SimpleAtlasAllocator::with_options(size2(int(size[0]), int(size[1])), &BEST_FIT);
        let mut packing = Packing { size: [0, 0], corners: vec![[0, 0]; order.len()] };
        for &i in order {
            let [w, h] = self.list[i].1;
            let place = allocator.allocate(size2(int(w), int(h)))?;
            packing.corners[i] = place.min.to_array().map(|texel| texel as u32);
            let end = place.max.to_array().map(|texel| texel as u32);
            packing.size = [packing.size[0].max(end[0]), packing.size[1].max(end[1])];
        }
        Some(packing)
    }
}

/// The share by which the area of a 2 : 1 rectangle must be smaller than that of a square to cost
/// the same.
const STRIP_COST: f64 = 0.02;
/// Number of widths tried to each side of the square's, times the number of maps; the former is
/// kept within 2 to 24.
const SEARCH_EFFORT: usize = 1024;
/// The search distinguishes heights that differ by at least one part in this number.
const FINENESS: u32 = 64;

/// Sort keys for the order of packing, largest first. None of these orders is best for all plans.
const ORDERS: [fn([u32; 2]) -> [u32; 2]; 3] =
    [|[w, h]| [h, w], |[w, h]| [w, h], |[w, h]| [w.max(h), w.min(h)]];

/// One list of free rectangles, of which the smallest that suffices is taken. The crate's default
/// thresholds place large rectangles where most room is left, which keeps a long-lived atlas from
/// fragmenting, but in an atlas that is filled once they waste three times as much.
const BEST_FIT: AllocatorOptions = AllocatorOptions {
    small_size_threshold: i32::MAX,
    large_size_threshold: i32::MAX,
    ..DEFAULT_OPTIONS
};
