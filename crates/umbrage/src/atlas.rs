use crate::plan::Plan;
use glam::DVec2;
use guillotiere::{AllocatorOptions, DEFAULT_OPTIONS, SimpleAtlasAllocator, size2};

/// Where in a texture, or in an array of them, the maps of a [`Plan`] lie.
///
/// Around each map lies a gutter, no texel of which is shared. Render it with the map (texels just
/// outside [0, 1]² have depths like any other), so that filters at a map's border see no other map.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Atlas {
    /// Width and height of the texture, texels; both 0 where all maps are empty.
    pub size: [u32; 2],
    /// Layers of the texture, all of one size.
    pub layers: u32,
    /// Width of the gutter around each map, texels.
    pub gutter_texels: u32,
    /// Where each map lies, in the order of [`Plan::maps`]; `None` for those that are empty.
    pub places: Vec<Option<Place>>,
}

/// A rectangle of texels in an [`Atlas`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Layer of the texture.
    pub layer: u32,
    /// Texel of that layer at which the map begins, inside its gutter: (s, t) = (0, 0).
    pub origin: [u32; 2],
    /// The map's resolution, texels.
    pub size: [u32; 2],
}

/// Takes a map's (s, t), after [`Rows`](crate::Rows), to where it lies: scale · (s, t) + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleOffset {
    /// Factors of s and t.
    pub scale: DVec2,
    /// Where (0, 0) lies.
    pub offset: DVec2,
}

/// The maps do not fit into one texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "no room for {maps} shadow maps of {texels} texels, gutters included, in a texture of {max_side}x{max_side}"
)]
pub struct AtlasTooLarge {
    /// Maps that are not empty.
    pub maps: usize,
    /// Their texels, gutters included.
    pub texels: u64,
    /// The longest side that was allowed, texels.
    pub max_side: u32,
}

impl Atlas {
    /// All maps side by side in one texture, as small and as square as the search finds. The same plan
    /// gives the same atlas, but a plan that differs little may give one that differs much.
    ///
    /// Gutters are as wide as the plan's filter [reaches](crate::visibility::Filter::reach_texels) beyond
    /// a map, and maps begin where it [asks](crate::visibility::Filter::slot_texels) for it. `max_side`
    /// is the longest side that the device allows a texture, texels. Allocates.
    ///
    /// # Errors
    /// Where no arrangement is found. Over plans of the built-in scenes with 4 to 102 maps, maps and
    /// gutters filled 93% of the atlas in the mean, 85% at worst.
    pub fn packed(plan: &Plan, max_side: u32) -> Result<Self, AtlasTooLarge> {
        Self::packed_sizes(&slots(plan), plan.filter.reach_texels(), max_side)
            .map(|atlas| atlas.holding(plan))
    }

    /// As [`packed`](Self::packed), for rectangles of any sizes (texels in s and t): those of a plan's maps with
    /// room to grow, say. One without texels has no place.
    ///
    /// # Errors
    /// Where no arrangement is found.
    pub fn packed_sizes(
        sizes: &[[u32; 2]],
        gutter_texels: u32,
        max_side: u32,
    ) -> Result<Self, AtlasTooLarge> {
        let boxes = Boxes::new(sizes, gutter_texels, max_side)?;
        let packing = boxes.pack().ok_or(boxes.too_large)?;
        let mut places = vec![None; sizes.len()];
        for (&(map, _), corner) in boxes.list.iter().zip(packing.corners) {
            let origin = corner.map(|c| c + gutter_texels);
            places[map] = Some(Place { layer: 0, origin, size: sizes[map] });
        }
        Ok(Self { size: packing.size, layers: 1, gutter_texels, places })
    }

    /// Each map in a layer of its own, in the order of [`Plan::maps`], all as wide and as high as the
    /// largest. Empty maps keep their layers, so that no map moves when others become empty.
    ///
    /// Parameters and errors are those of [`packed`](Self::packed).
    pub fn layered(plan: &Plan, max_side: u32) -> Result<Self, AtlasTooLarge> {
        Self::layered_sizes(&slots(plan), plan.filter.reach_texels(), max_side)
            .map(|atlas| atlas.holding(plan))
    }

    /// With places as large as a plan's maps, which may be smaller than their slots.
    fn holding(mut self, plan: &Plan) -> Self {
        for (place, map) in self.places.iter_mut().zip(&plan.maps) {
            *place = place.map(|place| Place { size: map.resolution, ..place });
        }
        self
    }

    /// As [`layered`](Self::layered), for rectangles of any sizes (texels in s and t).
    ///
    /// # Errors
    /// One that does not fit.
    pub fn layered_sizes(
        sizes: &[[u32; 2]],
        gutter_texels: u32,
        max_side: u32,
    ) -> Result<Self, AtlasTooLarge> {
        let boxes = Boxes::new(sizes, gutter_texels, max_side)?;
        let places = sizes.iter().zip(0..).map(|(&size, layer)| {
            let is_there = !size.contains(&0);
            is_there.then_some(Place { layer, origin: [gutter_texels; 2], size })
        });
        Ok(Self {
            size: boxes.largest(),
            layers: sizes.len() as u32,
            gutter_texels,
            places: places.collect(),
        })
    }

    /// From a map's (s, t) to texels of its layer. `None` for empty maps and those that the plan does
    /// not have.
    pub fn texels_from_shadow(&self, map: usize) -> Option<ScaleOffset> {
        let Place { origin, size, .. } = (*self.places.get(map)?)?;
        let [scale, offset] = [size, origin].map(|[x, y]: [u32; 2]| DVec2::new(x.into(), y.into()));
        Some(ScaleOffset { scale, offset })
    }

    /// From a map's (s, t) to texture coordinates in [0, 1]² of its layer; otherwise as
    /// [`texels_from_shadow`](Self::texels_from_shadow).
    pub fn atlas_from_shadow(&self, map: usize) -> Option<ScaleOffset> {
        let ScaleOffset { scale, offset } = self.texels_from_shadow(map)?;
        let size = DVec2::new(self.size[0].into(), self.size[1].into());
        Some(ScaleOffset { scale: scale / size, offset: offset / size })
    }
}

impl ScaleOffset {
    /// Where `st` lies.
    pub fn apply(self, st: DVec2) -> DVec2 {
        self.scale * st + self.offset
    }
}

/// What each of a plan's maps takes between its gutters, texels.
fn slots(plan: &Plan) -> Vec<[u32; 2]> {
    plan.maps.iter().map(|m| plan.filter.slot_texels(m.resolution)).collect()
}

/// Rectangles to be packed.
struct Boxes {
    /// Index of the map, and its size with gutters.
    list: Vec<(usize, [u32; 2])>,
    max_side: u32,
    /// What to say where there is no room.
    too_large: AtlasTooLarge,
}

/// Rectangles side by side.
struct Packing {
    size: [u32; 2],
    /// Of each rectangle, the one with the smallest coordinates.
    corners: Vec<[u32; 2]>,
}

impl Packing {
    /// What to make small: the area, times a little more for every step away from a square. Long
    /// strips reach a device's limits first.
    fn cost(&self) -> f64 {
        let [w, h] = self.size.map(f64::from);
        w * h * (1.0 + STRIP_COST * (w.max(h) / w.min(h) - 1.0))
    }
}

impl Boxes {
    /// The maps with their gutters, if each of them fits.
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

    /// The size that holds any one of them.
    fn largest(&self) -> [u32; 2] {
        self.list.iter().fold([0, 0], |[w, h], &(_, size)| [w.max(size[0]), h.max(size[1])])
    }

    /// The best packing over several orders and widths, and for each of these the lowest height.
    fn pack(&self) -> Option<Packing> {
        let texels = self.too_large.texels;
        let [widest, highest] = self.largest();
        if texels == 0 {
            return Some(Packing { size: [0, 0], corners: Vec::new() });
        }
        // From half as wide as the side of a square that had no gaps to twice as wide; more of these for
        // few maps, whose shapes matter most.
        let side = (texels as f64).sqrt();
        let steps = (PATIENCE / self.list.len()).clamp(2, 24) as i32;
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
                // Much higher than this is no better than the best so far. (As not all of the width
                // need be used, a little higher may be.)
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

    /// Packs into one rectangle, in this order.
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

/// What a strip of 2 : 1 may be larger than a square, as a share.
const STRIP_COST: f64 = 0.02;
/// The search is coarser for more maps than this.
const PATIENCE: usize = 1024;
/// Heights closer than one part in this many are not told apart.
const FINENESS: u32 = 64;

/// What comes first, by decreasing size: none of these is best for all plans.
const ORDERS: [fn([u32; 2]) -> [u32; 2]; 3] =
    [|[w, h]| [h, w], |[w, h]| [w, h], |[w, h]| [w.max(h), w.min(h)]];

/// One list of free rectangles, of which the one that fits closest is taken. With the crate's own
/// thresholds large rectangles go where most room is left, which keeps a long-lived atlas from
/// crumbling; filled once, it wastes three times as much.
const BEST_FIT: AllocatorOptions = AllocatorOptions {
    small_size_threshold: i32::MAX,
    large_size_threshold: i32::MAX,
    ..DEFAULT_OPTIONS
};
