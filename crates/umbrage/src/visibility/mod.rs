//! The shadow test and its filters, as pure functions over whatever holds the depths.
//!
//! # Bias
//!
//! None is set by hand. Perspective maps take planes to planes, so the depth of the receiver's plane
//! at a texel's centre is known exactly ([`Receiver::slope`]). A texel hides the receiver if its
//! depth is less than
//!
//! > min(depth of the receiver's plane at the texel's centre, the receiver's own depth) − h − 2⁻²⁵
//!
//! - The plane alone is exact for planes, but calls a receiver hidden by what lies deeper than
//!   itself, where the surface bends away within a texel; hence the minimum.
//! - h is half a texel's width, laid along the beam ([`Receiver::half_texel`]). Where a surface bends
//!   towards the light within a texel it rises over the plane. The map knows nothing finer than
//!   its texels, so it cannot tell such a rise from an occluder that close.
//! - 2⁻²⁵ is half a unit in the last place of depths stored in single precision.
//!
//! What lies before the receivers is stored as depth 0, clamped, and hides everything: the limit is never
//! less than 2⁻²⁵, unless the receiver's own plane lies before depth 0 at the texel's centre. Planned maps
//! leave so much room before the receivers that this takes a surface nearly edge-on.
//!
//! Measured as the share of wrong pixels (`hard`, one `adaptive` map of 2048², geometric mean over twelve
//! views of six real scenes at 960×540 against ray-traced truth): the plane alone 0.0173; the minimum
//! 0.0127; the minimum with h 0.0085. In place of h, the standard deviation of the plane's depth over
//! a texel (Lauritzen 2008, GPU Gems 3, §8.4.2) gives 0.0098, and lets light through where
//! surfaces are steep to it; the smaller of the two 0.0089; half of h 0.0087. Most of what is left is
//! the texels' stair-steps.
//!
//! # Filters that are applied ahead of lookup
//!
//! [`Prefilter`] stores numbers in place of depth whose means over many texels tell the lit share ([`statistic`]). A blur in texels is done once
//! a map, and a lookup is one bilinear sample; one in pixels or metres takes several, of smaller and smaller copies. The same slack applies. What cannot tell the receiver's own slanted plane from
//! occluders also allows for a multiple of that plane's deviation over the filter.

pub mod statistic;

mod disc;
mod prefilter;
mod width;

pub use prefilter::{Blur, Footprint, Prefilter};
pub use width::Width;

use crate::error::{Error, check};
use crate::plan::{Receiver, ShadowMap};
use glam::DVec2;
use statistic::Channels;
use std::fmt;

/// Half a unit in the last place of single precision below 1.
const HALF_ULP: f64 = f32::EPSILON as f64 / 4.0;

/// Gutter of filters whose width in texels has no end: what they would see beyond counts as the gutter's last texel.
const SPREAD_REACH: u32 = 16;

/// How far outside [0, 1]² shadow coordinates still count as inside.
const ROUNDING: f64 = 1e-6;

/// How the texels around a point are looked up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Filter {
    /// The nearest texel.
    #[default]
    Hard,
    /// Percentage-closer filtering (Reeves, Salesin and Cook 1987): the share of lit texels in a box
    /// of n × n texels centred at the point. The box is exact: texels count by the area of theirs
    /// that it covers, so (n + 1)² of them are compared, which is what n × n bilinear comparisons of
    /// a GPU see.
    Pcf {
        /// Width of the box, texels, even or odd; clamped to 1 ..= [`MAX_PCF`](Self::MAX_PCF).
        n: u32,
    },
    /// Percentage-closer filtering over a width that knows the warp: n × n comparisons with the nearest texels, spread evenly over a square across the
    /// light or in the picture, or over a texel where that is wider.
    Spread {
        /// Comparisons to each side, clamped to 1 ..= [`MAX_PCF`](Self::MAX_PCF), or [`MAX_DISC`](Self::MAX_DISC) in a disc.
        n: u32,
        /// Side of the square, or diameter of the disc.
        width: Width,
        /// Where they are made.
        pattern: Pattern,
    },
    /// Percentage-closer soft shadows (Fernando 2005): a search for what hides the receiver, over all that could hide some of the light from it, tells how
    /// wide the penumbra is; then as many comparisons over that width. Maps must tell how far casters lie:
    /// [`Options::keeps_casters`](crate::Options::keeps_casters).
    Pcss {
        /// n² comparisons in the search, and as many in the penumbra; clamped to 1 ..= [`MAX_DISC`](Self::MAX_DISC).
        n: u32,
        /// Diameter of the light: of a lamp in metres, of the sun per metre of distance (twice the tangent of half its angle: 0.0093 for ours).
        source: f32,
    },
    /// Numbers in place of depths, filtered ahead of lookup.
    Prefiltered(Prefilter),
}

/// Where comparisons are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pattern {
    /// On an even grid of n × n places in a square.
    #[default]
    Grid,
    /// At n² places in a disc, none near another, without an order that shows as bands.
    Poisson,
}

impl Pattern {
    /// Place k of n², where the square's side and the disc's diameter is 1.
    fn place(self, k: u32, n: u32) -> [f64; 2] {
        match self {
            Self::Grid => [k % n, k / n].map(|i| (f64::from(i) + 0.5) / f64::from(n) - 0.5),
            Self::Poisson => disc::PLACES[k as usize % disc::MAX_PLACES].map(f64::from),
        }
    }
}

/// The texels of a map, for lookups. A function from (i, j) to depth is one: it is asked for as many depths as a filter needs.
pub trait Texels {
    /// Depth of texel (i, j), also of those up to [`Filter::reach_texels`] outside the map.
    fn depth(&self, i: i32, j: i32) -> f32;

    /// What a prefiltered map has at a point in the map's texel coordinates, between texels bilinearly, at a level: at 1 of half the map's resolution, at 2
    /// of a quarter … By default computed there and then, from the depths around.
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
    /// Widest box of [`Pcf`](Self::Pcf), texels.
    pub const MAX_PCF: u32 = 15;

    /// The most comparisons to each side over a disc: n² of them.
    pub const MAX_DISC: u32 = 8;

    /// The first `count` places of [`Pattern::Poisson`] in a disc of diameter 1 around 0, at most n² for n = [`MAX_DISC`](Self::MAX_DISC).
    pub fn disc_places(count: u32) -> &'static [[f32; 2]] {
        &disc::PLACES[..(count as usize).min(disc::MAX_PLACES)]
    }

    /// Percentage-closer filtering over `n` × `n` texels.
    ///
    /// # Errors
    /// If `n` is not 1 to [`MAX_PCF`](Self::MAX_PCF).
    pub fn pcf(n: u32) -> Result<Self, Error> {
        check((1..=Self::MAX_PCF).contains(&n), "filter.n", || {
            format!("must be 1 to {} texels, is {n}", Self::MAX_PCF)
        })?;
        Ok(Self::Pcf { n })
    }

    /// How many texels beyond the map's border lookups of points in the map can reach.
    pub fn reach_texels(self) -> u32 {
        match self {
            Self::Hard => 0,
            Self::Pcf { n } => n.clamp(1, Self::MAX_PCF) / 2 + 1,
            Self::Spread { .. } | Self::Pcss { .. } => SPREAD_REACH,
            Self::Prefiltered(prefilter) => prefilter.reach_texels(),
        }
    }

    /// What the sides of a map with its gutters are rounded up to, texels. What is more lies behind the gutter's end, and is drawn like it.
    pub fn align_texels(self) -> u32 {
        match self {
            Self::Prefiltered(prefilter) => prefilter.align_texels(),
            _ => 1,
        }
    }

    /// Sides of what is drawn for a map: its resolution, the gutter around it, and what that is rounded up to. Texel coordinates in it run from
    /// −[`reach_texels`](Self::reach_texels).
    pub fn drawn_texels(self, resolution: [u32; 2]) -> [u32; 2] {
        let gutters = 2 * self.reach_texels();
        resolution.map(|n| n.saturating_add(gutters).next_multiple_of(self.align_texels()))
    }

    /// Sides of what a map takes in an atlas, between gutters of [`reach_texels`](Self::reach_texels): its resolution, and what that is rounded up to
    /// ([`drawn_texels`](Self::drawn_texels)). In an atlas of such rectangles maps begin where smaller copies ask for it. Empty maps take nothing.
    pub fn slot_texels(self, resolution: [u32; 2]) -> [u32; 2] {
        if resolution.contains(&0) {
            return resolution;
        }
        let gutters = 2 * self.reach_texels();
        self.drawn_texels(resolution).map(|n| n - gutters)
    }

    /// That the parameters make sense.
    ///
    /// # Errors
    /// Names the one that does not.
    pub fn check(&self) -> Result<(), Error> {
        match self {
            Self::Hard => Ok(()),
            Self::Pcf { n } => Self::pcf(*n).map(drop),
            Self::Spread { n, width, pattern } => {
                if *pattern == Pattern::Poisson {
                    check_disc(*n)?;
                }
                Self::pcf(*n).and_then(|_| width.check())
            }
            Self::Pcss { n, source } => {
                check(*source > 0.0 && *source <= 1e6, "filter.source", || {
                    format!("must be above 0 and at most 1e6, is {source}")
                })?;
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

/// As in a shadow specification: `hard`, `pcf5`, `csm8`.
impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hard => f.write_str("hard"),
            Self::Pcf { n } => write!(f, "pcf{n}"),
            Self::Spread { n, width, pattern: Pattern::Grid } => write!(f, "pcf{n}(blur={width})"),
            Self::Spread { n, width, pattern: Pattern::Poisson } => {
                write!(f, "pcf{n}(blur={width},poisson)")
            }
            Self::Pcss { .. } => f.write_str("pcss"),
            Self::Prefiltered(prefilter) => prefilter.statistic.fmt(f),
        }
    }
}

/// Where shadow coordinates lie in the map's texels: texel (i, j) spans [i, i+1] × [j, j+1].
pub fn texel_coordinates(map: &ShadowMap, st: DVec2) -> DVec2 {
    let [width, height] = map.resolution.map(f64::from);
    DVec2::new(st.x * width, map.rows.row_from_t(st.y) * height)
}

/// The shadow coordinates of a place in the map's texels: the inverse of [`texel_coordinates`].
pub fn shadow_coordinates(map: &ShadowMap, texel: DVec2) -> DVec2 {
    let [width, height] = map.resolution.map(f64::from);
    DVec2::new(texel.x / width, map.rows.t_from_row(texel.y / height))
}

/// How much of the light reaches `receiver`, from 0 to 1, by `map`'s texels: a function from (i, j) to depth, also of those up to
/// [`Filter::reach_texels`] outside the map, or what holds more than depths. Receivers outside the map, or before its
/// depths, are lit.
#[expect(clippy::needless_pass_by_value, reason = "functions are handed over as they are written")]
pub fn visibility(
    map: &ShadowMap,
    filter: Filter,
    receiver: &Receiver,
    texels: impl Texels,
) -> f32 {
    let st = receiver.st;
    // What is served lies in the map up to rounding, at the border of its part as well.
    let is_inside =
        st.cmpge(DVec2::splat(-ROUNDING)).all() && st.cmple(DVec2::splat(1.0 + ROUNDING)).all();
    if map.is_empty() || !is_inside || receiver.depth < 0.0 {
        return 1.0;
    }
    let texel = texel_coordinates(map, st);
    let test = Test::new(map, receiver);
    let is_lit = |i, j| f64::from(texels.depth(i, j)) >= test.nearest_lit(i, j);
    // Of the texels around, those that a pattern over a width falls on.
    let spread = |metric, pattern, n| {
        let ends = drawn(map, filter);
        offsets(metric, pattern, n).map(move |offset| nearest(texel + offset, ends))
    };
    let lit_share = |metric, pattern, n| {
        let lit = spread(metric, pattern, n).filter(|&[i, j]| is_lit(i, j)).count();
        (lit as f64 / f64::from(n * n)) as f32
    };
    match filter {
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
        Filter::Pcss { n, source } => {
            let n = n.clamp(1, Filter::MAX_DISC);
            let across = |width: f64| receiver.texel_metric.map(|m| m * width * width);
            let penumbra = |st, depth| f64::from(source) * map.penumbra(receiver, st, depth);
            // What hides some of the light lies between here and it, where the map's depths begin at the latest.
            let (mut widths, mut hidden) = (0.0, 0u32);
            for [i, j] in spread(across(penumbra(st, 0.0)), Pattern::Poisson, n) {
                if !is_lit(i, j) {
                    widths += penumbra(test.center(i, j), f64::from(texels.depth(i, j)));
                    hidden += 1;
                }
            }
            if hidden == 0 {
                return 1.0;
            }
            lit_share(across(widths / f64::from(hidden)), Pattern::Poisson, n)
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

/// Where what is drawn for a map begins and ends, in texel coordinates; the end is just inside.
fn drawn(map: &ShadowMap, filter: Filter) -> [DVec2; 2] {
    let low = DVec2::splat(-f64::from(filter.reach_texels()));
    let [width, height] = filter.drawn_texels(map.resolution).map(f64::from);
    [low, low + DVec2::new(width, height) - 1e-3]
}

/// The texel around a place, of those that are drawn.
fn nearest(place: DVec2, [low, high]: [DVec2; 2]) -> [i32; 2] {
    place.clamp(low, high).floor().to_array().map(|i| i as i32)
}

/// Places of a pattern over a width of this metric (squares of the texels in s and t, and their product), or over a texel where that is wider.
fn offsets([ss, tt, st]: [f64; 3], pattern: Pattern, n: u32) -> impl Iterator<Item = DVec2> {
    // The sides of the square, as they lie in the map.
    let across = ss.max(1.0).sqrt();
    let shear = st / across;
    let along = (tt - shear * shear).max(1.0).sqrt();
    (0..n * n).map(move |k| {
        let [u, v] = pattern.place(k, n);
        DVec2::new(across * u, shear * u + along * v)
    })
}

/// A receiver against the texels of a map.
struct Test<'a> {
    map: &'a ShadowMap,
    receiver: &'a Receiver,
    /// How much nearer than expected a texel's depth may be.
    slack: f64,
}

impl<'a> Test<'a> {
    fn new(map: &'a ShadowMap, receiver: &'a Receiver) -> Self {
        Self { map, receiver, slack: receiver.half_texel + HALF_ULP }
    }

    /// The middle of texel (i, j), (s, t).
    fn center(&self, i: i32, j: i32) -> DVec2 {
        shadow_coordinates(self.map, DVec2::new(f64::from(i), f64::from(j)) + 0.5)
    }

    /// The depth from which on texel (i, j) does not hide the receiver.
    fn nearest_lit(&self, i: i32, j: i32) -> f64 {
        let center = self.center(i, j);
        let depth = self.receiver.depth;
        // An edge-on receiver's infinite slope makes the rise infinite or NaN. `min` ignores NaN.
        let rise = self.receiver.slope.dot(center - self.receiver.st);
        // Depths end at 1: what is stored as 1 may lie anywhere behind.
        let expected = depth.min(depth + rise).min(1.0);
        let limit = expected - self.slack;
        // What is stored as 0 is a caster that was clamped, however much is allowed for; unless the surface
        // itself would be.
        if expected > 2.0 * HALF_ULP { limit.max(HALF_ULP) } else { limit }
    }
}

/// One side of a box filter: the texels it covers, the first and the last in part.
struct Span {
    first: i32,
    n: u32,
    /// How much of the first texel is left out, and of the last one covered, in [0, 1).
    fraction: f64,
}

impl Span {
    fn new(center: f64, n: u32) -> Self {
        let start = center - f64::from(n) / 2.0;
        let first = start.floor();
        Self { first: first as i32, n, fraction: start - first }
    }

    /// Sum of `value` over the texels, weighted by how much of each is covered; in all n.
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
