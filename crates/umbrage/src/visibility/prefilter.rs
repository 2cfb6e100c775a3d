use super::Width;
use super::statistic::{Channels, MAX_CHANNELS, Statistic};
use crate::error::{Error, check};
use crate::plan::{Receiver, ShadowMap};
use glam::DVec2;

/// Numbers in place of depths, filtered by a Gaussian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prefilter {
    /// Which numbers.
    pub statistic: Statistic,
    /// How wide the Gaussian is.
    pub blur: Blur,
}

/// How wide a Gaussian is: its standard deviation is a quarter of that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Blur {
    /// So many texels, wherever: blurred ahead of lookup. An odd number, 1 ..= [`Prefilter::MAX_BLUR`]; 1 is no blur.
    Texels(u32),
    /// A width that knows the warp: looked up in smaller and smaller copies of the map, and where texels are longer one way, at several
    /// places along it.
    Width(Width),
}

/// Standard deviation of what a level's sample averages over, as a share of its texel: the box that made it, and the interpolation
/// between texels.
const SAMPLE_DEVIATION: f64 = 0.5;

/// The most places to each side of a [`Footprint`]'s middle: 15 in all, as texture units with anisotropy of 16 take.
const MAX_SIDE: f64 = 7.0;

/// Where a filter samples: at `2 side + 1` places, `step` apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Level of detail, from 0 to [`Prefilter::LEVELS`] less one.
    pub lod: f64,
    /// From place to place, texels.
    pub step: DVec2,
    /// Places to each side of the middle.
    pub side: u32,
    /// What is averaged over, texels²: variances in s and t, and covariance.
    pub covariance: [f64; 3],
}

impl Footprint {
    /// Weights of the places at distances 0 ..= `side`, before they are divided by their sum.
    pub fn weight(side: u32, k: u32) -> f64 {
        if side == 0 { 1.0 } else { (-2.0 * (f64::from(k) / f64::from(side)).powi(2)).exp() }
    }

    /// The mean over the places around `texel`, none nearer to the ends of what is drawn than half a texel of the level.
    pub(super) fn gather(
        &self,
        texel: DVec2,
        [low, high]: [DVec2; 2],
        sample: impl Fn(DVec2, f64) -> Channels,
    ) -> Channels {
        let inset = DVec2::splat(0.5 * self.lod.ceil().exp2());
        let [low, high] = [low + inset, high - inset];
        let side = self.side as i32;
        let mut sum = [0.0; MAX_CHANNELS];
        let mut weights = 0.0;
        for k in -side..=side {
            let weight = Self::weight(self.side, k.unsigned_abs()) as f32;
            weights += weight;
            let at = (texel + self.step * f64::from(k)).clamp(low, high.max(low));
            let here = sample(at, self.lod);
            sum.iter_mut().zip(here).for_each(|(s, h)| *s += weight * h);
        }
        sum.map(|s| s / weights)
    }
}

impl Prefilter {
    /// A Gaussian's standard deviation as a share of its width.
    pub const DEVIATION: f64 = 0.25;

    /// The widest blur, texels.
    pub const MAX_BLUR: u32 = 63;

    /// Copies of a map, each of half the resolution of the one before, that [`Blur::Width`] samples.
    pub const LEVELS: u32 = 6;

    /// That the parameters make sense.
    ///
    /// # Errors
    /// Names the one that does not.
    pub fn check(&self) -> Result<(), Error> {
        self.statistic.check()?;
        match self.blur {
            Blur::Texels(n) => {
                check((1..=Self::MAX_BLUR).contains(&n) && n % 2 == 1, "filter.blur", || {
                    format!("must be an odd number of 1 to {} texels, is {n}", Self::MAX_BLUR)
                })
            }
            Blur::Width(width) => width.check(),
        }
    }

    /// How many levels there are.
    pub fn levels(&self) -> u32 {
        match self.blur {
            Blur::Texels(_) => 1,
            Blur::Width(_) => Self::LEVELS,
        }
    }

    /// How many texels to each side the blur ahead of lookup reaches.
    pub fn radius_texels(&self) -> u32 {
        match self.blur {
            Blur::Texels(n) => n.min(Self::MAX_BLUR) / 2,
            Blur::Width(_) => 0,
        }
    }

    pub(super) fn align_texels(&self) -> u32 {
        1 << (self.levels() - 1)
    }

    /// How many texels beyond the map's border lookups of points in the map can reach: the blur's radius, and one more to interpolate; or
    /// the largest texel there is.
    pub(super) fn reach_texels(&self) -> u32 {
        match self.blur {
            Blur::Texels(_) => self.radius_texels() + 1,
            Blur::Width(_) => self.align_texels(),
        }
    }

    /// Weights of the texels at distances 0 ..= [`radius_texels`](Self::radius_texels) to one side; with those to the other side they add up
    /// to 1.
    pub fn weights(&self) -> impl Iterator<Item = f32> + Clone + use<> {
        let radius = self.radius_texels();
        let deviation = Self::DEVIATION * f64::from(2 * radius + 1);
        let gaussian = move |k: u32| (-0.5 * (f64::from(k) / deviation).powi(2)).exp();
        let sum = 1.0 + 2.0 * (1..=radius).map(gaussian).sum::<f64>();
        (0..=radius).map(move |k| (gaussian(k) / sum) as f32)
    }

    /// Variance of all that lookup in a map that was blurred averages over, in one direction, texels²: the blur and the interpolation
    /// between texels.
    pub fn variance_texels(&self) -> f64 {
        let blur: f64 = self
            .weights()
            .zip(0u32..)
            .map(|(w, k)| 2.0 * f64::from(w) * f64::from(k).powi(2))
            .sum();
        // Of the linear weights between texels, in the mean over all places.
        blur + 1.0 / 6.0
    }

    /// Where to sample for a receiver.
    pub fn footprint(&self, receiver: &Receiver) -> Footprint {
        let Blur::Width(width) = self.blur else {
            let variance = self.variance_texels();
            return Footprint {
                lod: 0.0,
                step: DVec2::ZERO,
                side: 0,
                covariance: [variance, variance, 0.0],
            };
        };
        let deviation = Self::DEVIATION * width.metres(receiver);
        let [ss, tt, st] = receiver.texel_metric.map(|m| m * deviation * deviation);
        let mean = 0.5 * (ss + tt);
        let spread = (0.5 * (ss - tt)).hypot(st);
        let [major, minor] = [(mean + spread).sqrt(), (mean - spread).max(0.0).sqrt()];
        // Samples as wide as the narrow side, or so wide that they reach along the long one.
        let largest = f64::from(Self::LEVELS - 1);
        let sample = minor.max(major / MAX_SIDE);
        let sample = sample.clamp(SAMPLE_DEVIATION, SAMPLE_DEVIATION * largest.exp2());
        let size = sample / SAMPLE_DEVIATION;
        // Between two levels it is variances that mix linearly, of which the larger is four times the smaller.
        let level = size.log2().floor().min(largest);
        let fraction = ((size * size / level.exp2().powi(2) - 1.0) / 3.0).clamp(0.0, 1.0);
        let lod = (level + fraction).min(largest);
        let rest = (major * major - sample * sample).max(0.0).sqrt();
        let side = (2.0 * rest / size).ceil().min(MAX_SIDE);
        // An eigenvector, by the row of the matrix that has more digits.
        let axis = if ss > tt {
            DVec2::new(0.5 * (ss - tt) + spread, st)
        } else {
            DVec2::new(st, 0.5 * (tt - ss) + spread)
        };
        let step = axis.normalize_or_zero() * (2.0 * rest / side.max(1.0));
        let least = sample * sample;
        Footprint { lod, step, side: side as u32, covariance: [ss.max(least), tt.max(least), st] }
    }

    /// The numbers of one texel of this depth, before they are stored.
    pub fn encode(&self, map: &ShadowMap, i: i32, j: i32, depth: f32) -> Channels {
        let [width, height] = map.resolution.map(f64::from);
        let t = map.rows.t_from_row((f64::from(j) + 0.5) / height);
        let st = DVec2::new((f64::from(i) + 0.5) / width, t);
        self.statistic.encode(map.slab_depth(st, f64::from(depth)).clamp(0.0, 1.0) as f32)
    }

    /// What a filtered map has at a point in texel coordinates, computed there and then from the depths around, and never stored.
    pub(super) fn sample(
        &self,
        map: &ShadowMap,
        texel: DVec2,
        lod: f64,
        depth: impl Fn(i32, i32) -> f32,
    ) -> Channels {
        let lower = lod.floor();
        let at = |level: f64| self.sample_level(map, texel, level.exp2() as i32, &depth);
        let fraction = (lod - lower) as f32;
        let mut sum = at(lower);
        if fraction > 0.0 {
            let upper = at(lower + 1.0);
            sum.iter_mut().zip(upper).for_each(|(s, u)| *s += fraction * (u - *s));
        }
        sum
    }

    /// The same between texels of `size` texels.
    fn sample_level(
        &self,
        map: &ShadowMap,
        texel: DVec2,
        size: i32,
        depth: impl Fn(i32, i32) -> f32,
    ) -> Channels {
        let mut sum = [0f64; MAX_CHANNELS];
        let radius = self.radius_texels() as i32;
        let mut weights = [0.0; Self::MAX_BLUR as usize / 2 + 1];
        weights.iter_mut().zip(self.weights()).for_each(|(t, w)| *t = f64::from(w));
        let corner = texel / f64::from(size) - 0.5;
        let first = corner.floor();
        let fraction = corner - first;
        // Weight of a texel along one axis: two Gaussians, as far as the point is from each.
        let along = |k: i32, fraction: f64| {
            let at = |k: i32| {
                let weight = weights.get(k.unsigned_abs() as usize).copied().unwrap_or(0.0);
                if k.abs() <= radius { weight } else { 0.0 }
            };
            (1.0 - fraction) * at(k) + fraction * at(k - 1)
        };
        let share = 1.0 / f64::from(size * size);
        for y in -radius..=radius + 1 {
            for x in -radius..=radius + 1 {
                let weight = share * along(x, fraction.x) * along(y, fraction.y);
                if weight > 0.0 {
                    let [i, j] = [first.x as i32 + x, first.y as i32 + y].map(|k| k * size);
                    for (i, j) in (0..size * size).map(|k| (i + k % size, j + k / size)) {
                        let channels = self.encode(map, i, j, depth(i, j));
                        sum.iter_mut().zip(channels).for_each(|(s, c)| *s += weight * f64::from(c));
                    }
                }
            }
        }
        sum.map(|s| s as f32)
    }

    /// How much of the light reaches `receiver`, 0 to 1, by the mean over its footprint.
    pub fn visibility(
        &self,
        map: &ShadowMap,
        receiver: &Receiver,
        footprint: &Footprint,
        channels: &Channels,
    ) -> f32 {
        let [width, height] = map.resolution.map(f64::from);
        let expected = receiver.depth.min(1.0) - receiver.half_texel;
        // Edge-on to the light the slope has no end: 8 in a texel is as good as infinite where all of depth is 1.
        let texels = DVec2::new(width, height);
        let steepest = 8.0 * texels;
        let slope = receiver.slope.clamp(-steepest, steepest);
        let slope = map.slab_slope(receiver.st, expected, slope) / texels;
        let [ss, tt, st] = footprint.covariance;
        let variance =
            ss * slope.x * slope.x + tt * slope.y * slope.y + 2.0 * st * slope.x * slope.y;
        let plane = f64::from(self.statistic.plane_deviations()) * variance.max(0.0).sqrt();
        let depth = map.slab_depth(receiver.st, expected) - plane;
        self.statistic.visibility(channels, depth as f32)
    }
}
