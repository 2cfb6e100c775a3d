use super::statistic::{Channels, MAX_CHANNELS, Statistic};
use super::{Width, shadow_coordinates, slack};
use crate::error::{Error, check};
use crate::plan::{Receiver, ShadowMap, Slab};
use glam::DVec2;

/// A filter that is applied ahead of lookup: a Gaussian over statistics of depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prefilter {
    /// Which statistic of depth is stored.
    pub statistic: Statistic,
    /// The width of the Gaussian.
    pub blur: Blur,
    /// Whether the prefiltered map has half the resolution of the map, each texel the mean of four
    /// of the map's texels. This takes a quarter of the memory and a quarter of the blur's work.
    pub half: bool,
}

/// Width of a Gaussian, which is four times its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Blur {
    /// An odd number of the prefiltered map's texels, 1 ..= [`Prefilter::MAX_BLUR`], all over the
    /// map. The blur is done ahead of lookup; 1 is no blur.
    Texels(u32),
    /// A width that does not depend on warp or resolution. Lookup takes samples of the prefiltered
    /// map's mip levels at several places along and across the filter's footprint.
    Width(Width),
}

/// The samples that lookup takes around a receiver: a grid of `samples[0]` × `samples[1]` places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Mip level of the samples. A texel of level l is 2^l texels of the map wide.
    pub level: u32,
    /// Number of places along and across the footprint, each ≥ 1.
    pub samples: [u32; 2],
    /// Steps from place to place along and across the footprint, in texels of the map.
    pub steps: [DVec2; 2],
    /// Variance in s, variance in t and covariance of the region that the samples average over,
    /// texels².
    pub covariance: [f64; 3],
}

/// `n` places along one axis of a Gaussian, at equal steps over ±2 standard deviations: the number
/// of steps from the middle and the weight of each.
fn places(n: u32) -> impl Iterator<Item = (f64, f64)> + Clone {
    let (middle, deviation) = (0.5 * (f64::from(n) - 1.0), f64::from(n) / 4.0);
    (0..n).map(move |i| {
        let steps = f64::from(i) - middle;
        (steps, (-0.5 * (steps / deviation).powi(2)).exp())
    })
}

/// The number of places along an axis and the step between them, in texels of the mip level. `rest`
/// is the variance to be reached beyond that of one sample, in squares of that texel.
fn spread(rest: f64) -> (u32, f64) {
    if rest <= 1e-6 {
        return (1, 0.0);
    }
    let n = ((1.5 * rest.sqrt()).ceil() as u32).clamp(2, Footprint::MAX_SAMPLES);
    // The weights are cut off at two standard deviations, which reduces the variance of three or
    // more places but not of two.
    let kept = if n == 2 { 1.0 } else { Footprint::KEPT_VARIANCE };
    (n, (rest / kept).sqrt() * 4.0 / f64::from(n))
}

impl Footprint {
    /// Variance of the region that one sample averages over, in squares of the mip level's texel:
    /// that of the texel's own box and of the interpolation between texels.
    pub const SAMPLE_VARIANCE: f64 = 0.25;

    /// Least variance of the filter across its footprint, in squares of a mip level's texel, for
    /// which that level is used. On a coarser level one sample would do, but the region it averages
    /// over depends on where between the texels it falls; the region of two samples hardly does.
    pub const LEAST_VARIANCE: f64 = 0.5;

    /// The largest ratio of a footprint's length to its width, like a texture unit's anisotropy of
    /// 16. Longer footprints are widened.
    pub const ANISOTROPY: f64 = 16.0;

    /// Variance of three or more places along an axis as a share of the full Gaussian's. Because
    /// its ends are cut off, the share is 0.77 to 0.80.
    pub const KEPT_VARIANCE: f64 = 0.78;

    /// The most samples along one axis, which only filters wider than the coarsest level is meant
    /// for reach.
    pub const MAX_SAMPLES: u32 = 36;

    /// The weighted mean of the samples around `texel`. Samples keep half a texel of the mip level
    /// from the ends of what is drawn.
    pub(super) fn gather(
        &self,
        texel: DVec2,
        [low, high]: [DVec2; 2],
        sample: impl Fn(DVec2, u32) -> Channels,
    ) -> Channels {
        let inset = DVec2::splat(0.5 * f64::from(1u32 << self.level));
        let [low, high] = [low + inset, high - inset];
        let mut sum = [0.0; MAX_CHANNELS];
        let mut weights = 0.0;
        let [along, across] = self.samples;
        for (v, weight_across) in places(across) {
            for (u, weight_along) in places(along) {
                let offset = self.steps[0] * u + self.steps[1] * v;
                let weight = (weight_along * weight_across) as f32;
                weights += weight;
                let here = sample((texel + offset).clamp(low, high.max(low)), self.level);
                sum.iter_mut().zip(here).for_each(|(s, h)| *s += weight * h);
            }
        }
        sum.map(|s| s / weights)
    }
}

impl Prefilter {
    /// Standard deviation of the Gaussian as a share of its width.
    pub const DEVIATION: f64 = 0.25;

    /// The widest blur in texels.
    pub const MAX_BLUR: u32 = 63;

    /// Number of mip levels of a prefiltered map whose blur is a [`Blur::Width`], each of half the
    /// resolution of the one before.
    pub const LEVELS: u32 = 6;

    /// Checks that all parameters are in their ranges.
    ///
    /// # Errors
    /// Names the parameter that is out of its range.
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

    /// Number of the prefiltered map's mip levels.
    pub fn levels(&self) -> u32 {
        match self.blur {
            Blur::Texels(_) => 1,
            Blur::Width(_) => Self::LEVELS,
        }
    }

    /// Reach of the blur ahead of lookup to each side, in texels of the prefiltered map.
    pub fn radius_texels(&self) -> u32 {
        match self.blur {
            Blur::Texels(n) => n.min(Self::MAX_BLUR) / 2,
            Blur::Width(_) => 0,
        }
    }

    /// Mip level of the prefiltered map itself: 1 if it has half the map's resolution, otherwise 0.
    pub fn first_level(&self) -> u32 {
        u32::from(self.half)
    }

    pub(super) fn align_texels(&self) -> u32 {
        1 << (self.levels() - 1 + self.first_level())
    }

    /// How many texels beyond the map's border lookups of receivers within the map can read: the
    /// blur's radius and one more for interpolation, or one texel of the coarsest mip level.
    pub(super) fn reach_texels(&self) -> u32 {
        match self.blur {
            Blur::Texels(_) => (self.radius_texels() + 1) << self.first_level(),
            Blur::Width(_) => self.align_texels(),
        }
    }

    /// Weights of the texels at distances 0 ..= [`radius_texels`](Self::radius_texels). Together
    /// with those of the other side they add up to 1.
    pub fn weights(&self) -> impl Iterator<Item = f32> + Clone + use<> {
        let radius = self.radius_texels();
        let deviation = Self::DEVIATION * f64::from(2 * radius + 1);
        let gaussian = move |k: u32| (-0.5 * (f64::from(k) / deviation).powi(2)).exp();
        let sum = 1.0 + 2.0 * (1..=radius).map(gaussian).sum::<f64>();
        (0..=radius).map(move |k| (gaussian(k) / sum) as f32)
    }

    /// Variance along one axis of the region that a lookup in a blurred map averages over,
    /// texels². It includes the blur and the interpolation between texels.
    pub fn variance_texels(&self) -> f64 {
        let blur: f64 = self
            .weights()
            .zip(0u32..)
            .map(|(w, k)| 2.0 * f64::from(w) * f64::from(k).powi(2))
            .sum();
        // 1/6 is the variance of linear interpolation, averaged over all positions between two
        // texels; 0.25 is that of the two texels of a side that one texel of half resolution stands
        // for.
        if self.half { 4.0 * (blur + 1.0 / 6.0) + 0.25 } else { blur + 1.0 / 6.0 }
    }

    /// The samples to take for a receiver.
    pub fn footprint(&self, receiver: &Receiver) -> Footprint {
        let Blur::Width(width) = self.blur else {
            let variance = self.variance_texels();
            return Footprint {
                level: self.first_level(),
                samples: [1, 1],
                steps: [DVec2::ZERO; 2],
                covariance: [variance, variance, 0.0],
            };
        };
        let variance = Self::DEVIATION * Self::DEVIATION;
        let [ss, tt, st] = width.metric(receiver).map(|m| m * variance);
        let (mean, half_difference) = (0.5 * (ss + tt), 0.5 * (ss - tt));
        let spread_of = half_difference.hypot(st);
        let [first, last] = [self.first_level(), self.first_level() + Self::LEVELS - 1];
        let major = (mean + spread_of).min(1e12);
        let minor = (mean - spread_of).max(major / (Footprint::ANISOTROPY * Footprint::ANISOTROPY));
        let level = 0.5 * (minor / Footprint::LEAST_VARIANCE).log2();
        let level = level.floor().clamp(f64::from(first), f64::from(last));
        // Square of the width of the level's texel.
        let texel = (2.0 * level).exp2();
        let beyond = |variance: f64| spread(variance / texel - Footprint::SAMPLE_VARIANCE);
        let [(along, step), (across, step_across)] = [beyond(major), beyond(minor)];
        // Eigenvector of the covariance, from the row of the matrix that loses fewer digits to
        // cancellation.
        let axis = if half_difference > 0.0 {
            DVec2::new(half_difference + spread_of, st)
        } else {
            DVec2::new(st, spread_of - half_difference)
        };
        let axis = axis.try_normalize().unwrap_or(DVec2::X);
        let size = level.exp2();
        let least = (Footprint::SAMPLE_VARIANCE * texel).max(minor);
        let longer = (major - least).max(0.0);
        Footprint {
            level: level as u32,
            samples: [along, across],
            steps: [axis * (step * size), axis.perp() * (step_across * size)],
            covariance: [
                least + longer * axis.x * axis.x,
                least + longer * axis.y * axis.y,
                longer * axis.x * axis.y,
            ],
        }
    }

    /// The statistics of texel (i, j) of this depth, before they are rounded to be stored.
    pub fn encode(&self, map: &ShadowMap, i: i32, j: i32, depth: f32) -> Channels {
        let st = shadow_coordinates(map, DVec2::new(f64::from(i), f64::from(j)) + 0.5);
        self.statistic.encode(map.slab_depth(st, f64::from(depth)).clamp(0.0, 1.0) as f32)
    }

    /// The prefiltered map's statistics at a point in texel coordinates, computed from the
    /// surrounding depths without rounding.
    pub(super) fn sample(
        &self,
        map: &ShadowMap,
        texel: DVec2,
        level: u32,
        depth: impl Fn(i32, i32) -> f32,
    ) -> Channels {
        let size = 1 << level;
        let mut sum = [0f64; MAX_CHANNELS];
        let radius = self.radius_texels() as i32;
        let mut weights = [0.0; Self::MAX_BLUR as usize / 2 + 1];
        weights.iter_mut().zip(self.weights()).for_each(|(t, w)| *t = f64::from(w));
        let corner = texel / f64::from(size) - 0.5;
        let first = corner.floor();
        let fraction = corner - first;
        // Weight of a texel along one axis: the blur's weights around the two texels between which
        // the point lies, interpolated.
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

    /// The share of the light that reaches `receiver`, 0 ..= 1, from the mean statistics over its
    /// footprint.
    pub fn visibility(
        &self,
        map: &ShadowMap,
        receiver: &Receiver,
        footprint: &Footprint,
        channels: &Channels,
    ) -> f32 {
        let [width, height] = map.resolution.map(f64::from);
        let expected = receiver.depth.min(1.0) - slack(map, receiver);
        // Where the receiver is edge-on to the light its slope is infinite. Since all depths lie
        // within 1, a slope of 8 per texel has the same effect.
        let texels = DVec2::new(width, height * map.rows.row_derivative(receiver.st.y));
        let steepest = 8.0 * texels;
        // The receiver's slope counts relative to the slab's planes.
        let lean = match map.slab {
            Slab::Leaning { slope, .. } => slope,
            Slab::Distances { .. } => DVec2::ZERO,
        };
        let slope = (receiver.slope.clamp(-steepest, steepest) - lean) / texels;
        let [ss, tt, st] = footprint.covariance;
        let variance =
            ss * slope.x * slope.x + tt * slope.y * slope.y + 2.0 * st * slope.x * slope.y;
        let plane = f64::from(self.statistic.plane_deviations()) * variance.max(0.0).sqrt();
        // Stored depths are clamped to 0 ..= 1, and the series of convolution shadow maps are valid
        // there only.
        let depth = map.slab_depth(receiver.st, expected - plane).clamp(0.0, 1.0);
        self.statistic.visibility(channels, depth as f32)
    }
}
