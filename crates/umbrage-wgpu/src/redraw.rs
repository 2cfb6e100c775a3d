//! What of a map is drawn again: all of it, or the parts in which casters have moved.

use crate::culling::{FourPlanes, LocalBox};
use crate::shadows::Record;
use glam::Vec4;
use umbrage::visibility::Filter;
use umbrage::{Aabb, Place, Plane, ShadowMap};

/// How far the texels that a device covers may lie from where a triangle is in double precision.
/// A vertex stage in single precision and the rasteriser's grid move triangles by small parts of a
/// texel.
const ROUNDING_TEXELS: f64 = 1.0;

/// The most parts of a map that are drawn apart.
const MAX_PARTS: usize = 8;

/// What [`Prepared::encode`](crate::Prepared::encode) draws at a time: a map, or a part of a map in
/// which casters have moved.
#[derive(Clone, Copy, Debug)]
pub struct Redraw<'a> {
    /// The planned map.
    pub shadow_map: &'a ShadowMap,
    /// The index of the map in the plan.
    pub index: usize,
    /// The texels of the depth texture that are drawn. They include the map's gutter.
    pub rectangle: Place,
    /// If only a part is drawn, the half-spaces around the beams through it.
    beams: Option<FourPlanes>,
    /// The half-spaces around all that casts into the map.
    caster_planes: &'a [FourPlanes],
}

impl<'a> Redraw<'a> {
    pub(crate) fn new(
        shadow_map: &'a ShadowMap,
        index: usize,
        record: &'a Record,
        place: Place,
        filter: &Filter,
        texels: Texels,
    ) -> Self {
        let gutter = filter.reach_texels();
        let is_whole = texels == Texels::whole(filter, &place);
        Self {
            shadow_map,
            index,
            rectangle: Place {
                origin: [0, 1].map(|i| place.origin[i] - gutter + texels.first[i]),
                size: texels.size(),
                ..place
            },
            beams: (!is_whole).then(|| beams(shadow_map, filter, texels)),
            caster_planes: &record.four_planes,
        }
    }

    /// Whether anything in `aabb` (world space) can cast a shadow into what is drawn. The result is
    /// conservative: it is never `false` for a box that can cast, but may be `true` for one that
    /// cannot.
    pub fn may_cast(&self, aabb: Aabb) -> bool {
        let local = LocalBox::new(aabb, self.shadow_map.origin);
        !local.is_empty()
            && self.beams.iter().chain(self.caster_planes).all(|planes| planes.may_touch(&local))
    }

    /// Half-spaces around all that casts into what is drawn, relative to the map's origin.
    pub(crate) fn local_planes(&self) -> impl Iterator<Item = Vec4> + '_ {
        self.beams.iter().chain(self.caster_planes).flat_map(FourPlanes::planes)
    }
}

/// The half-spaces around the beams through some texels of a map.
fn beams(map: &ShadowMap, filter: &Filter, texels: Texels) -> FourPlanes {
    let m = map.shadow_from_local;
    let gutter = f64::from(filter.reach_texels());
    // Where w is positive, s is at least s₀ if the row of s less s₀ times that of w is.
    let side = |axis: usize, texel: f64, sign: f64| {
        let at = (texel - gutter) / f64::from(map.resolution[axis]);
        let plane = (m.row(axis) - m.row(3) * at) * sign;
        let plane = plane / plane.truncate().length();
        Plane { normal: plane.truncate(), offset: plane.w }
    };
    let [first, end] = [texels.first, texels.end].map(|t| t.map(f64::from));
    FourPlanes::new(&[
        side(0, first[0] - ROUNDING_TEXELS, 1.0),
        side(0, end[0] + ROUNDING_TEXELS, -1.0),
        side(1, first[1] - ROUNDING_TEXELS, 1.0),
        side(1, end[1] + ROUNDING_TEXELS, -1.0),
    ])
}

/// A rectangle among the texels that are drawn for a map. Texel 0 is the first of the gutter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Texels {
    pub(crate) first: [u32; 2],
    /// One beyond the last texel.
    pub(crate) end: [u32; 2],
}

impl Texels {
    /// All texels that are drawn for a map.
    pub(crate) fn whole(filter: &Filter, place: &Place) -> Self {
        Self { first: [0; 2], end: filter.drawn_texels(place.size) }
    }

    /// The texels of a map whose depths may depend on what lies in `aabb` (world space, finite);
    /// `None` if there are none.
    pub(crate) fn shadowed_by(map: &ShadowMap, filter: &Filter, aabb: Aabb) -> Option<Self> {
        if !map.may_cast(aabb) {
            return None;
        }
        let drawn = filter.drawn_texels(map.resolution);
        let gutter = f64::from(filter.reach_texels());
        let points = aabb.corners().map(|p| map.shadow_from_local * (p - map.origin).extend(1.0));
        if points.iter().all(|h| h.w <= 0.0) {
            // Everything lies behind the light.
            return None;
        }
        if points.iter().any(|h| h.w <= 0.0) {
            return Some(Self { first: [0; 2], end: drawn });
        }
        let [mut low, mut high] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for h in points {
            for i in [0, 1] {
                let texel = h[i] / h.w * f64::from(map.resolution[i]) + gutter;
                low[i] = low[i].min(texel);
                high[i] = high[i].max(texel);
            }
        }
        // Converting to whole numbers clamps at 0.
        let first = low.map(|n| (n - ROUNDING_TEXELS).floor() as u32);
        let end = high.map(|n| (n + ROUNDING_TEXELS).ceil() as u32);
        Self { first, end }.within(Self { first: [0; 2], end: drawn })
    }

    pub(crate) fn size(self) -> [u32; 2] {
        [0, 1].map(|i| self.end[i] - self.first[i])
    }

    fn area(self) -> u64 {
        let [width, height] = self.size();
        u64::from(width) * u64::from(height)
    }

    fn union(self, other: Self) -> Self {
        Self {
            first: [0, 1].map(|i| self.first[i].min(other.first[i])),
            end: [0, 1].map(|i| self.end[i].max(other.end[i])),
        }
    }

    /// The texels that both have; `None` if there are none.
    pub(crate) fn within(self, other: Self) -> Option<Self> {
        let first = [0, 1].map(|i| self.first[i].max(other.first[i]));
        let end = [0, 1].map(|i| self.end[i].min(other.end[i]));
        (first[0] < end[0] && first[1] < end[1]).then_some(Self { first, end })
    }

    /// The texels of mip level `level` that depend on these, and those that lie up to `reach` of
    /// that level's texels beside them.
    pub(crate) fn at_level(self, level: u32, reach: [u32; 2]) -> Self {
        Self {
            first: [0, 1].map(|i| (self.first[i] >> level).saturating_sub(reach[i])),
            end: [0, 1].map(|i| self.end[i].div_ceil(1 << level) + reach[i]),
        }
    }
}

/// The parts of a map that must still be drawn.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stale {
    parts: [Option<Texels>; MAX_PARTS],
}

impl Stale {
    /// These texels and no others.
    pub(crate) fn only(texels: Texels) -> Self {
        let mut stale = Self::default();
        stale.parts[0] = Some(texels);
        stale
    }

    pub(crate) fn parts(&self) -> impl Iterator<Item = Texels> + Clone + '_ {
        self.parts.iter().copied().flatten()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.parts().next().is_none()
    }

    /// Adds texels. Parts are joined where this adds no texels to them, and where there are too
    /// many parts.
    pub(crate) fn add(&mut self, mut texels: Texels) {
        loop {
            let others = self.parts.iter().enumerate().filter_map(|(i, part)| Some((i, (*part)?)));
            let growth = |part: Texels| {
                part.union(texels).area() as i64 - (part.area() + texels.area()) as i64
            };
            let best = others.min_by_key(|&(_, part)| growth(part));
            let free = self.parts.iter().position(Option::is_none);
            match (best, free) {
                (Some((i, part)), free) if free.is_none() || growth(part) <= 0 => {
                    texels = part.union(texels);
                    self.parts[i] = None;
                }
                (_, Some(free)) => {
                    self.parts[free] = Some(texels);
                    return;
                }
                // Without a free place there are parts to join.
                (_, None) => return,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texels(first: [u32; 2], end: [u32; 2]) -> Texels {
        Texels { first, end }
    }

    #[test]
    fn parts_cover_what_was_added_and_stay_apart_where_they_can() {
        let mut seed = 1u32;
        let mut random = |n: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) % n
        };
        for count in [1, 3, 8, 9, 40] {
            let mut stale = Stale::default();
            let added: Vec<Texels> = (0..count)
                .map(|_| {
                    let first = [random(1000), random(1000)];
                    texels(first, [first[0] + 1 + random(50), first[1] + 1 + random(50)])
                })
                .collect();
            added.iter().for_each(|&t| stale.add(t));
            assert!(stale.parts().count() <= MAX_PARTS && !stale.is_empty());
            for t in added {
                assert!(stale.parts().any(|part| part.union(t) == part), "{t:?} in {stale:?}");
            }
        }
        let mut stale = Stale::only(texels([0, 0], [10, 10]));
        stale.add(texels([90, 90], [99, 99]));
        assert_eq!(stale.parts().count(), 2, "far apart");
        stale.add(texels([10, 0], [20, 10]));
        assert_eq!(stale.parts().count(), 2, "side by side");
        stale.add(texels([0, 0], [200, 200]));
        assert_eq!(stale.parts().collect::<Vec<_>>(), [texels([0, 0], [200, 200])]);
    }

    #[test]
    fn levels_round_outwards() {
        let t = texels([5, 8], [6, 16]);
        assert_eq!(t.at_level(0, [1, 9]), texels([4, 0], [7, 25]));
        assert_eq!(t.at_level(2, [0; 2]), texels([1, 2], [2, 4]));
        assert_eq!(t.within(texels([6, 0], [9, 9])), None);
        assert_eq!(t.within(texels([0, 10], [9, 99])), Some(texels([5, 10], [6, 16])));
    }
}
