//! The shadow test and its filters, as pure functions that read depths from any source.
//!
//! # Bias
//!
//! No bias is set by hand. Projective maps take planes to planes, so the depth of the receiver's
//! plane is known exactly at a texel's centre ([`Receiver::slope`]; this is receiver plane depth
//! bias). A texel hides the receiver if its depth is less than
//!
//! > min(depth of that plane at the texel's centre, the receiver's own depth) − h − g − 2⁻²⁵
//!
//! - The plane's depth alone is exact for plane surfaces. Where the surface bends away from the
//!   light within a texel, however, texels deeper than the receiver would hide it; the minimum
//!   prevents this.
//! - h is half a texel's width, measured as depth along the beam ([`Receiver::half_texel`]). Where
//!   a surface bends towards the light within a texel, it rises above the receiver's plane. A map
//!   resolves nothing smaller than its texels, so it cannot distinguish such a rise from an
//!   occluder this near.
//! - g is the rise of the receiver's plane over 1/256 of a texel in s and in t. Rasterisers move
//!   the corners of triangles to a grid as fine as that. Where the light grazes a surface, all of
//!   its depths may lie within a few texels, and it would shadow itself if it is drawn beside its
//!   place. Elsewhere g is much less than h. [`slack`] is the sum of both.
//! - 2⁻²⁵ is half a unit in the last place of depths stored in single precision.
//!
//! Casters in front of the receivers are clamped to depth 0 and must hide every receiver. The limit
//! is therefore never less than 2⁻²⁵, unless the receiver's own plane lies in front of depth 0
//! at the texel's centre. Planned maps leave enough depth in front of the receivers that this
//! happens only to surfaces nearly edge-on to the light.
//!
//! Measured as the share of wrong pixels (`hard`, one `adaptive` map of 2048² texels, geometric
//! mean over twelve views of six real scenes at 960×540 pixels against ray-traced truth): the
//! plane alone gives 0.0173, the minimum 0.0127, and the minimum with h 0.0085. In place of h, the
//! standard deviation of the plane's depth over a texel (Lauritzen 2008, GPU Gems 3, §8.4.2) gives
//! 0.0098 and lets light through on surfaces steep to the light; the smaller of both gives 0.0089,
//! half of h 0.0087. Most of the remaining errors are stair-steps of the texels.
//!
//! # Prefilters
//!
//! A [`Prefilter`] is applied ahead of lookup. It stores [statistics](statistic) of depth, whose
//! means over many texels determine the lit share. A blur whose width is given in texels is done
//! once for each map, and lookup is one bilinear sample. A blur whose width is given in pixels or
//! metres takes several samples of the map's smaller mip levels. The slack h + g applies to
//! both. A statistic that cannot distinguish the receiver's own slanted plane from occluders also
//! allows for a multiple of the standard deviation of that plane's depth over the filter.

pub mod statistic;

mod blockers;
mod disc;
mod prefilter;
mod width;

pub use prefilter::{Blur, Footprint, Prefilter};
pub use width::{LightSize, Width};

use crate::error::{Error, check};
use crate::plan::{Receiver, ShadowMap};
use blockers::Blockers;
use glam::DVec2;
use statistic::Channels;

/// Half a unit in the last place of single precision for numbers just below 1.
const HALF_ULP: f64 = f32::EPSILON as f64 / 4.0;

/// The grid to which rasterisers move the corners of triangles, texels.
const RASTER_GRID: f64 = 1.0 / 256.0;

/// Gutter of filters whose width in texels is unbounded, texels. They read the gutter's last texel
/// in place of texels beyond it.
const SPREAD_REACH: u32 = 16;

/// How far outside [0, 1]² shadow coordinates still count as inside, to allow for rounding.
const ROUNDING: f64 = 1e-6;

/// How the texels around a receiver are looked up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Filter {
    /// No shadows: everything is lit. Plans for this filter have no maps. What shadows cost is the
    /// difference to a frame with this filter.
    None,
    /// One comparison with the nearest texel.
    #[default]
    Hard,
    /// Percentage-closer filtering (Reeves, Salesin and Cook 1987): the share of lit texels in a
    /// box of n × n texels, centred at the receiver. Each texel is weighted by the area of it that
    /// the box covers. So (n + 1)² texels are compared, which are the texels that n × n bilinear
    /// comparisons of a GPU read.
    Pcf {
        /// Width of the box, texels, even or odd; clamped to 1 ..= [`MAX_PCF`](Self::MAX_PCF).
        n: u32,
    },
    /// Percentage-closer filtering over a width that does not depend on warp or resolution:
    /// comparisons with the nearest texels at n × n places of a square or disc. The width is at
    /// least one texel.
    Spread {
        /// There are n² comparisons. n is clamped to 1 ..= [`MAX_PCF`](Self::MAX_PCF), or in a
        /// disc to 1 ..= [`MAX_DISC`](Self::MAX_DISC).
        n: u32,
        /// Side of the square or diameter of the disc.
        width: Width,
        /// Where the comparisons are made.
        pattern: Pattern,
    },
    /// Percentage-closer soft shadows (Fernando 2005). First, a search among the texels that can
    /// hide some of the light from the receiver finds the mean width of the penumbra; then
    /// comparisons over that width give the lit share. The search itself has two steps: how far
    /// away a caster can lie and still hide some of the light depends on the casters around, so a
    /// first step finds the widest penumbra, and the second step searches as far as that. Plans for
    /// this filter [keep the depths of casters](Self::keeps_casters).
    Pcss {
        /// There are n² comparisons in each step of the search and as many over the penumbra. n is
        /// clamped to 1 ..= [`MAX_DISC`](Self::MAX_DISC).
        n: u32,
        /// Size of the light: an angle for directional lights, a length for spot and point lights.
        light: LightSize,
    },
    /// A filter that is applied ahead of lookup to statistics of depth.
    Prefiltered(Prefilter),
}

/// Where comparisons are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pattern {
    /// On a regular grid of n × n places in a square.
    #[default]
    Grid,
    /// At n² places in a disc, none close to another and without a regularity that would show as
    /// bands.
    Poisson,
}

impl Pattern {
    /// Place k of n² around 0; the square's side or the disc's diameter is 1.
    fn place(self, k: u32, n: u32) -> [f64; 2] {
        match self {
            Self::Grid => [k % n, k / n].map(|i| (f64::from(i) + 0.5) / f64::from(n) - 0.5),
            Self::Poisson => disc::PLACES[k as usize % disc::MAX_PLACES].map(f64::from),
        }
    }
}

/// The texels of a map, for lookups. Functions from (i, j) to depth implement this trait; lookup
/// calls them once for each depth that a filter needs.
pub trait Texels {
    /// Depth of texel (i, j), which may lie up to [`Filter::reach_texels`] outside the map.
    fn depth(&self, i: i32, j: i32) -> f32;

    /// The prefiltered map's statistics at a point in the map's texel coordinates, bilinearly
    /// interpolated on mip level `level` (level 1 has half the map's resolution, level 2 a quarter,
    /// and so on). By default they are computed from the surrounding depths.
    fn statistics(
        &self,
        map: &ShadowMap,
        prefilter: &Prefilter,
        texel: DVec2,
        level: u32,
    ) -> Channels {
        prefilter.sample(map, texel, level, |i, j| self.depth(i, j))
    }
}

impl<F: Fn(i32, i32) -> f32> Texels for F {
    fn depth(&self, i: i32, j: i32) -> f32 {
        self(i, j)
    }
}

impl Filter {
    /// The widest box of [`Pcf`](Self::Pcf), texels.
    pub const MAX_PCF: u32 = 15;

    /// The largest n of filters with n² comparisons in a disc.
    pub const MAX_DISC: u32 = 8;

    /// The first `count` places of [`Pattern::Poisson`], in a disc of diameter 1 around 0; there
    /// are n² places for n = [`MAX_DISC`](Self::MAX_DISC).
    pub fn disc_places(count: u32) -> &'static [[f32; 2]] {
        &disc::PLACES[..(count as usize).min(disc::MAX_PLACES)]
    }

    /// In the first step of the search of [`Pcss`](Self::Pcss), a texel counts whose penumbra
    /// reaches this share of the way to it, because each place stands for those around it.
    pub const NEAR_ENOUGH: f32 = 0.3;

    /// The directions of the places of the first step of the search of [`Pcss`](Self::Pcss), from
    /// the outermost place to the innermost. The golden angle between them spreads the directions
    /// of successive places evenly.
    pub fn spiral_directions(count: u32) -> impl Iterator<Item = [f32; 2]> {
        let golden_angle = std::f64::consts::PI * (3.0 - 5f64.sqrt());
        (0..count).map(move |k| {
            let (sin, cos) = (f64::from(k) * golden_angle).sin_cos();
            [cos as f32, sin as f32]
        })
    }

    /// The prefilter, if the filter is one.
    pub fn prefilter(&self) -> Option<&Prefilter> {
        match self {
            Self::Prefiltered(prefilter) => Some(prefilter),
            Self::None
            | Self::Hard
            | Self::Pcf { .. }
            | Self::Spread { .. }
            | Self::Pcss { .. } => None,
        }
    }

    /// Whether lookup reads maps, without which a plan has none.
    pub fn has_maps(self) -> bool {
        self != Self::None
    }

    /// Percentage-closer filtering over `n` × `n` texels.
    ///
    /// # Errors
    /// If `n` is not in 1 ..= [`MAX_PCF`](Self::MAX_PCF).
    pub fn pcf(n: u32) -> Result<Self, Error> {
        check((1..=Self::MAX_PCF).contains(&n), "filter.n", || {
            format!("must be 1 to {} texels, is {n}", Self::MAX_PCF)
        })?;
        Ok(Self::Pcf { n })
    }

    /// How many texels beyond the map's border lookups of receivers within the map can read.
    pub fn reach_texels(self) -> u32 {
        match self {
            Self::None | Self::Hard => 0,
            Self::Pcf { n } => n.clamp(1, Self::MAX_PCF) / 2 + 1,
            Self::Spread { .. } | Self::Pcss { .. } => SPREAD_REACH,
            Self::Prefiltered(prefilter) => prefilter.reach_texels(),
        }
    }

    /// Whether lookup needs the depths of casters. If so, a plan's range of depths begins at the
    /// casters and not at the receivers. Otherwise casters nearer the light are clamped to depth 0,
    /// which plain shadow tests allow.
    ///
    /// The longer range costs precision of depth, so it is limited to 1000 times the receivers' own
    /// range, and under a lamp it begins at no less than a sixteenth of the receivers' distance
    /// from the lamp. It changes nothing if the [casters'](crate::Bounds::casters) bounds are
    /// unknown.
    pub fn keeps_casters(self) -> bool {
        matches!(self, Self::Pcss { .. })
    }

    /// The sides of a map including its gutters are rounded up to multiples of this number of
    /// texels. The additional texels lie beyond the far gutter and are drawn like it.
    pub fn align_texels(self) -> u32 {
        match self {
            Self::Prefiltered(prefilter) => prefilter.align_texels(),
            _ => 1,
        }
    }

    /// Sides of the rectangle that is drawn for a map, texels: its resolution and its gutters,
    /// rounded up to [`align_texels`](Self::align_texels). Texel coordinates in it begin at
    /// −[`reach_texels`](Self::reach_texels).
    pub fn drawn_texels(self, resolution: [u32; 2]) -> [u32; 2] {
        let gutters = 2 * self.reach_texels();
        resolution.map(|n| n.saturating_add(gutters).next_multiple_of(self.align_texels()))
    }

    /// Sides of a map's slot in an atlas, texels, without the gutters of
    /// [`reach_texels`](Self::reach_texels): those of the [drawn](Self::drawn_texels) rectangle
    /// less both gutters. In an atlas of such slots all maps begin at multiples of the largest mip
    /// level's texel. The slot of an empty map has no texels.
    pub fn slot_texels(self, resolution: [u32; 2]) -> [u32; 2] {
        if resolution.contains(&0) {
            return resolution;
        }
        let gutters = 2 * self.reach_texels();
        self.drawn_texels(resolution).map(|n| n - gutters)
    }

    /// Checks that all parameters are in their ranges.
    ///
    /// # Errors
    /// Names the parameter that is out of its range.
    pub fn check(&self) -> Result<(), Error> {
        match self {
            Self::None | Self::Hard => Ok(()),
            Self::Pcf { n } => Self::pcf(*n).map(drop),
            Self::Spread { n, width, pattern } => {
                if *pattern == Pattern::Poisson {
                    check_disc(*n)?;
                }
                Self::pcf(*n).and_then(|_| width.check())
            }
            Self::Pcss { n, light } => {
                light.check()?;
                check_disc(*n)
            }
            Self::Prefiltered(prefilter) => prefilter.check(),
        }
    }
}

fn check_disc(n: u32) -> Result<(), Error> {
    check((1..=Filter::MAX_DISC).contains(&n), "filter.n", || {
        format!("must be 1 to {} where comparisons lie in a disc, is {n}", Filter::MAX_DISC)
    })
}

/// Texel coordinates of shadow coordinates in a map: texel (i, j) covers [i, i+1] × [j, j+1].
pub fn texel_coordinates(map: &ShadowMap, st: DVec2) -> DVec2 {
    let [width, height] = map.resolution.map(f64::from);
    DVec2::new(st.x * width, map.rows.row_from_t(st.y) * height)
}

/// Shadow coordinates of texel coordinates in a map: the inverse of [`texel_coordinates`].
pub fn shadow_coordinates(map: &ShadowMap, texel: DVec2) -> DVec2 {
    let [width, height] = map.resolution.map(f64::from);
    DVec2::new(texel.x / width, map.rows.t_from_row(texel.y / height))
}

/// How much less than on the receiver's plane the depth of a texel must be to hide the receiver,
/// but for rounding: h + g as in the [module's documentation](self).
pub fn slack(map: &ShadowMap, receiver: &Receiver) -> f64 {
    let [width, height] = map.resolution.map(f64::from);
    let texels = DVec2::new(width, height * map.rows.row_derivative(receiver.st.y));
    let rise = RASTER_GRID * (receiver.slope / texels).abs().element_sum();
    // All depths lie within 1. `min` ignores NaN.
    receiver.half_texel + rise.min(1.0)
}

/// The share of the light that reaches `receiver`, 0 ..= 1, from the texels of `map`. `texels` is a
/// function from (i, j) to depth, or a type that also stores prefiltered statistics; it is asked
/// for texels up to [`Filter::reach_texels`] outside the map. Receivers outside the map or in front
/// of its range of depths are lit.
#[expect(clippy::needless_pass_by_value, reason = "functions are handed over as they are written")]
pub fn visibility(
    map: &ShadowMap,
    filter: Filter,
    receiver: &Receiver,
    texels: impl Texels,
) -> f32 {
    let st = receiver.st;
    // Because of rounding, receivers at the border of a map's part may lie slightly outside the
    // map.
    let is_inside =
        st.cmpge(DVec2::splat(-ROUNDING)).all() && st.cmple(DVec2::splat(1.0 + ROUNDING)).all();
    if map.is_empty() || !is_inside || receiver.depth < 0.0 {
        return 1.0;
    }
    let texel = texel_coordinates(map, st);
    let test = Test::new(map, receiver);
    let is_lit = |i, j| f64::from(texels.depth(i, j)) >= test.nearest_lit(i, j);
    let lit_share = |metric, pattern: Pattern, n| {
        let (square, ends) = (Square::new(metric), drawn(map, filter));
        let places = (0..n * n).map(|k| square.offset(pattern.place(k, n)));
        let texels = places.map(|offset| nearest(texel + offset, ends));
        let lit = texels.filter(|&[i, j]| is_lit(i, j)).count();
        (lit as f64 / f64::from(n * n)) as f32
    };
    match filter {
        Filter::None => 1.0,
        Filter::Hard => {
            let last = |n: u32| f64::from(n - 1);
            let i = texel.x.floor().clamp(0.0, last(map.resolution[0]));
            let j = texel.y.floor().clamp(0.0, last(map.resolution[1]));
            f32::from(u8::from(is_lit(i as i32, j as i32)))
        }
        Filter::Pcf { n } => {
            let n = n.clamp(1, Filter::MAX_PCF);
            let columns = Span::new(texel.x, n);
            let rows = Span::new(texel.y, n);
            let row_sum = |j| columns.sum(|i| f64::from(u8::from(is_lit(i, j))));
            (rows.sum(row_sum) / f64::from(n * n)) as f32
        }
        Filter::Spread { n, width, pattern } => {
            let max = if pattern == Pattern::Grid { Filter::MAX_PCF } else { Filter::MAX_DISC };
            lit_share(width.metric(receiver), pattern, n.clamp(1, max))
        }
        Filter::Pcss { n, light } => {
            let n = n.clamp(1, Filter::MAX_DISC);
            let (ends, diameter) = (drawn(map, filter), f64::from(light.diameter()));
            let blockers = Blockers { test: &test, texels: &texels, texel, ends, n, diameter };
            blockers
                .mean_width()
                .map_or(1.0, |width| lit_share(across(receiver, width), Pattern::Poisson, n))
        }
        Filter::Prefiltered(prefilter) => {
            let [low, high] = drawn(map, filter);
            let footprint = prefilter.footprint(receiver);
            let channels = footprint.gather(texel, [low, high], |texel, level| {
                texels.statistics(map, &prefilter, texel, level)
            });
            prefilter.visibility(map, receiver, &footprint, &channels)
        }
    }
}

/// The lowest and the highest texel coordinates of what is drawn for a map; the highest are those
/// of a place just inside the last texel.
fn drawn(map: &ShadowMap, filter: Filter) -> [DVec2; 2] {
    let low = DVec2::splat(-f64::from(filter.reach_texels()));
    let [width, height] = filter.drawn_texels(map.resolution).map(f64::from);
    [low, low + DVec2::new(width, height) - 1e-3]
}

/// The texel at a place, or the nearest to it of the texels that are drawn.
fn nearest(place: DVec2, [low, high]: [DVec2; 2]) -> [i32; 2] {
    place.clamp(low, high).floor().to_array().map(|i| i as i32)
}

/// The squared extents in s and t, and their product, texels², of a width in metres across a
/// receiver's beam.
fn across(receiver: &Receiver, width: f64) -> [f64; 3] {
    receiver.texel_metric.map(|m| m * width * width)
}

/// The parallelogram of texels that a square across a receiver's beam becomes in the map.
struct Square {
    across: f64,
    shear: f64,
    along: f64,
}

impl Square {
    /// The square with this metric (texels²: squared extents in s and t, and their product),
    /// which is enlarged to at least one texel each way.
    fn new([ss, tt, st]: [f64; 3]) -> Self {
        let across = ss.max(1.0).sqrt();
        let shear = st / across;
        Self { across, shear, along: (tt - shear * shear).max(1.0).sqrt() }
    }

    /// Offset in texels of a place in the square of side 1 around 0.
    fn offset(&self, [u, v]: [f64; 2]) -> DVec2 {
        DVec2::new(self.across * u, self.shear * u + self.along * v)
    }

    /// The longest that a texel is as a share of the square's side, at most 1.
    fn texel(&self) -> f64 {
        1.0 / self.across.min(self.along)
    }
}

/// The comparison of one receiver with the texels of a map.
struct Test<'a> {
    map: &'a ShadowMap,
    receiver: &'a Receiver,
    /// How much less than the expected depth a lit texel's depth may be.
    slack: f64,
}

impl<'a> Test<'a> {
    fn new(map: &'a ShadowMap, receiver: &'a Receiver) -> Self {
        Self { map, receiver, slack: slack(map, receiver) + HALF_ULP }
    }

    /// Shadow coordinates of texel (i, j)'s centre.
    fn center(&self, i: i32, j: i32) -> DVec2 {
        shadow_coordinates(self.map, DVec2::new(f64::from(i), f64::from(j)) + 0.5)
    }

    /// The smallest depth with which texel (i, j) does not hide the receiver.
    fn nearest_lit(&self, i: i32, j: i32) -> f64 {
        let center = self.center(i, j);
        let depth = self.receiver.depth;
        // Where the receiver is edge-on to the light its slope is infinite, and the rise is
        // infinite or NaN. `min` ignores NaN.
        let rise = self.receiver.slope.dot(center - self.receiver.st);
        // Depths end at 1: a surface stored as 1 may lie anywhere behind.
        let expected = depth.min(depth + rise).min(1.0);
        let limit = expected - self.slack;
        // Depth 0 is that of a clamped caster, which hides the receiver however large the slack is,
        // unless the receiver's own plane lies in front of depth 0.
        if expected > 2.0 * HALF_ULP { limit.max(HALF_ULP) } else { limit }
    }
}

/// One axis of a box filter: the range of texels it covers, the first and the last in part.
struct Span {
    first: i32,
    n: u32,
    /// The share of the first texel that is not covered, which is the share of the last one that
    /// is, in [0, 1).
    fraction: f64,
}

impl Span {
    fn new(center: f64, n: u32) -> Self {
        let start = center - f64::from(n) / 2.0;
        let first = start.floor();
        Self { first: first as i32, n, fraction: start - first }
    }

    /// Sum of `value` over the texels, weighted by the covered share of each. The weights add up to
    /// n.
    fn sum(&self, value: impl Fn(i32) -> f64) -> f64 {
        let last = self.first + self.n as i32;
        let inner: f64 = (self.first + 1..last).map(&value).sum();
        let start = (1.0 - self.fraction) * value(self.first);
        let end = if self.fraction > 0.0 { self.fraction * value(last) } else { 0.0 };
        start + inner + end
    }
}

#[cfg(test)]
mod tests;
