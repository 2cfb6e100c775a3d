use super::statistic::{Channels, MAX_CHANNELS, Statistic};
use super::{Width, shadow_coordinates};
use crate::error::{Error, check};
use crate::plan::{Receiver, ShadowMap, Slab};
use glam::DVec2;

/// Numbers in place of depths, filtered by a Gaussian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prefilter {
    /// Which numbers.
    pub statistic: Statistic,
    /// How wide the Gaussian is.
    pub blur: Blur,
    /// Stored at half the resolution of the map, each number the mean over four of the map's texels: a quarter of the memory and of the blur's work.
    pub half: bool,
}

/// How wide a Gaussian is: its standard deviation is a quarter of that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Blur {
    /// So many of the texels that are stored, wherever: blurred ahead of lookup. An odd number, 1 ..= [`Prefilter::MAX_BLUR`]; 1 is no blur.
    Texels(u32),
    /// A width that knows the warp: looked up in smaller and smaller copies of the map, at several places along and across it.
    Width(Width),
}

/// Where a filter samples: at `samples[0]` by `samples[1]` places around a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Level of detail: texels there are two to the power of this wide.
    pub level: u32,
    /// Places along the footprint and across it, ≥ 1.
    pub samples: [u32; 2],
    /// From place to place along and across, texels.
    pub steps: [DVec2; 2],
    /// What is averaged over, texels²: variances in s and t, and covariance.
    pub covariance: [f64; 3],
}

/// `n` places along one axis of a Gaussian, from end to end of ±2 deviations: how many steps from the middle, and how heavy.
fn places(n: u32) -> impl Iterator<Item = (f64, f64)> + Clone {
    let (middle, deviation) = (0.5 * (f64::from(n) - 1.0), f64::from(n) / 4.0);
    (0..n).map(move |i| {
        let steps = f64::from(i) - middle;
        (steps, (-0.5 * (steps / deviation).powi(2)).exp())
    })
}

/// How many places an axis of variance `rest` (beyond that of a sample) takes, and how far apart they are, both in units of the level's texels.
fn spread(rest: f64) -> (u32, f64) {
    if rest <= 1e-6 {
        return (1, 0.0);
    }
    let n = ((1.5 * rest.sqrt()).ceil() as u32).clamp(2, Footprint::MAX_SAMPLES);
    // Places that are cut off at two deviations have less variance than what they stand for; two have the same.
    let kept = if n == 2 { 1.0 } else { Footprint::KEPT_VARIANCE };
    (n, (rest / kept).sqrt() * 4.0 / f64::from(n))
}

impl Footprint {
    /// Variance of what one sample averages over, in squares of the level's texel: the box that made it, and the interpolation between texels.
    pub const SAMPLE_VARIANCE: f64 = 0.25;

    /// The least variance across a filter, in the same unit, for which a level is taken. With one sample only what is averaged over depends on where
    /// between texels it falls; with two it hardly does.
    pub const LEAST_VARIANCE: f64 = 0.5;

    /// How many times longer than across a filter may be; what is longer still gets wider, as with a texture unit's anisotropy of 16.
    pub const ANISOTROPY: f64 = 16.0;

    /// The variance of three or more places along an axis, as a share of that of the Gaussian whose ends are cut off: 0.77 to 0.80.
    pub const KEPT_VARIANCE: f64 = 0.78;

    /// Samples along one side at most, for those that are wider than the coarsest level is meant for.
    pub const MAX_SAMPLES: u32 = 36;

    /// The mean over the places around `texel`, none nearer to the ends of what is drawn than half a texel of the level.
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

    /// How many of the texels that are stored to each side the blur ahead of lookup reaches.
    pub fn radius_texels(&self) -> u32 {
        match self.blur {
            Blur::Texels(n) => n.min(Self::MAX_BLUR) / 2,
            Blur::Width(_) => 0,
        }
    }

    /// Level of detail of what is stored: 1 if at half the resolution.
    pub fn first_level(&self) -> u32 {
        u32::from(self.half)
    }

    pub(super) fn align_texels(&self) -> u32 {
        1 << (self.levels() - 1 + self.first_level())
    }

    /// How many texels beyond the map's border lookups of points in the map can reach: the blur's radius, and one more to interpolate; or
    /// the largest texel there is.
    pub(super) fn reach_texels(&self) -> u32 {
        match self.blur {
            Blur::Texels(_) => (self.radius_texels() + 1) << self.first_level(),
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
        // Of the linear weights between texels, in the mean over all places, and of the four texels that one stands for.
        if self.half { 4.0 * (blur + 1.0 / 6.0) + 0.25 } else { blur + 1.0 / 6.0 }
    }

    /// Where to sample for a receiver.
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
        // Squares of the level's texels.
        let texel = (2.0 * level).exp2();
        let beyond = |variance: f64| spread(variance / texel - Footprint::SAMPLE_VARIANCE);
        let [(along, step), (across, step_across)] = [beyond(major), beyond(minor)];
        // An eigenvector, by the row of the matrix that has more digits.
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

    /// The numbers of one texel of this depth, before they are stored.
    pub fn encode(&self, map: &ShadowMap, i: i32, j: i32, depth: f32) -> Channels {
        let st = shadow_coordinates(map, DVec2::new(f64::from(i), f64::from(j)) + 0.5);
        self.statistic.encode(map.slab_depth(st, f64::from(depth)).clamp(0.0, 1.0) as f32)
    }

    /// What a filtered map has at a point in texel coordinates, computed there and then from the depths around, and never stored.
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
        let texels = DVec2::new(width, height * map.rows.row_derivative(receiver.st.y));
        let steepest = 8.0 * texels;
        // Over the slab's own planes.
        let lean = match map.slab {
            Slab::Leaning { slope, .. } => slope,
            Slab::Distances { .. } => DVec2::ZERO,
        };
        let slope = (receiver.slope.clamp(-steepest, steepest) - lean) / texels;
        let [ss, tt, st] = footprint.covariance;
        let variance =
            ss * slope.x * slope.x + tt * slope.y * slope.y + 2.0 * st * slope.x * slope.y;
        let plane = f64::from(self.statistic.plane_deviations()) * variance.max(0.0).sqrt();
        // What is stored lies between 0 and 1, and periods end there.
        let depth = map.slab_depth(receiver.st, expected - plane).clamp(0.0, 1.0);
        self.statistic.visibility(channels, depth as f32)
    }
}
