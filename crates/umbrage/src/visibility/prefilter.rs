use super::statistic::{Channels, MAX_CHANNELS, Statistic};
use crate::error::{Error, check};
use crate::plan::{Receiver, ShadowMap};
use glam::DVec2;

/// Numbers in place of depths, blurred by a Gaussian ahead of lookup.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prefilter {
    /// Which numbers.
    pub statistic: Statistic,
    /// Width of the Gaussian, texels: its standard deviation is a quarter of that. An odd number, 1 ..=
    /// [`MAX_BLUR`](Self::MAX_BLUR); 1 is no blur.
    pub blur_texels: u32,
}

/// A Gaussian's standard deviation as a share of its width.
const DEVIATION: f64 = 0.25;

impl Prefilter {
    /// The widest blur, texels.
    pub const MAX_BLUR: u32 = 63;

    /// That the parameters make sense.
    ///
    /// # Errors
    /// Names the one that does not.
    pub fn check(&self) -> Result<(), Error> {
        self.statistic.check()?;
        check(
            (1..=Self::MAX_BLUR).contains(&self.blur_texels) && self.blur_texels % 2 == 1,
            "filter.blur_texels",
            || format!("must be an odd number of 1 to {}, is {}", Self::MAX_BLUR, self.blur_texels),
        )
    }

    /// How many texels to each side the blur reaches.
    pub fn radius_texels(&self) -> u32 {
        self.blur_texels.min(Self::MAX_BLUR) / 2
    }

    /// How many texels beyond the map's border lookups of points in the map can reach: the blur's radius, and one more to interpolate.
    pub fn reach_texels(&self) -> u32 {
        self.radius_texels() + 1
    }

    /// Weights of the texels at distances 0 ..= [`radius_texels`](Self::radius_texels) to one side; with those to the other side they add up
    /// to 1.
    pub fn weights(&self) -> impl Iterator<Item = f32> + Clone + use<> {
        let radius = self.radius_texels();
        let deviation = DEVIATION * f64::from(2 * radius + 1);
        let gaussian = move |k: u32| (-0.5 * (f64::from(k) / deviation).powi(2)).exp();
        let sum = 1.0 + 2.0 * (1..=radius).map(gaussian).sum::<f64>();
        (0..=radius).map(move |k| (gaussian(k) / sum) as f32)
    }

    /// Standard deviation of all that lookup averages over, in one direction, texels: the blur and the interpolation between texels.
    pub fn deviation_texels(&self) -> f64 {
        let blur: f64 = self
            .weights()
            .zip(0u32..)
            .map(|(w, k)| 2.0 * f64::from(w) * f64::from(k).powi(2))
            .sum();
        // Of the linear weights between texels, in the mean over all places.
        (blur + 1.0 / 6.0).sqrt()
    }

    /// The numbers of one texel of this depth, before they are stored.
    pub fn encode(&self, map: &ShadowMap, i: i32, j: i32, depth: f32) -> Channels {
        let [width, height] = map.resolution.map(f64::from);
        let t = map.rows.t_from_row((f64::from(j) + 0.5) / height);
        let st = DVec2::new((f64::from(i) + 0.5) / width, t);
        self.statistic.encode(map.linear_depth(st, f64::from(depth)).clamp(0.0, 1.0) as f32)
    }

    /// What a blurred map has at a point in texel coordinates, computed there and then from the depths around, and never stored.
    pub(super) fn sample(
        &self,
        map: &ShadowMap,
        texel: DVec2,
        depth: impl Fn(i32, i32) -> f32,
    ) -> Channels {
        let mut sum = [0f64; MAX_CHANNELS];
        let radius = self.radius_texels() as i32;
        let weights: [f32; Self::MAX_BLUR as usize / 2 + 1] = {
            let mut table = [0.0; Self::MAX_BLUR as usize / 2 + 1];
            table.iter_mut().zip(self.weights()).for_each(|(t, w)| *t = w);
            table
        };
        let corner = texel - 0.5;
        let first = corner.floor();
        let fraction = corner - first;
        // Weight of a texel along one axis: two Gaussians, as far as the point is from each.
        let along = |k: i32, fraction: f64| {
            let at = |k: i32| weights.get(k.unsigned_abs() as usize).copied().unwrap_or(0.0);
            let inside = |k: i32| if k.abs() <= radius { f64::from(at(k)) } else { 0.0 };
            (1.0 - fraction) * inside(k) + fraction * inside(k - 1)
        };
        for y in -radius..=radius + 1 {
            for x in -radius..=radius + 1 {
                let weight = along(x, fraction.x) * along(y, fraction.y);
                if weight > 0.0 {
                    let [i, j] = [first.x as i32 + x, first.y as i32 + y];
                    let channels = self.encode(map, i, j, depth(i, j));
                    sum.iter_mut().zip(channels).for_each(|(s, c)| *s += weight * f64::from(c));
                }
            }
        }
        sum.map(|s| s as f32)
    }

    /// How much of the light reaches `receiver`, 0 to 1, by what a blurred map has there.
    pub fn visibility(&self, map: &ShadowMap, receiver: &Receiver, channels: &Channels) -> f32 {
        let [width, height] = map.resolution.map(f64::from);
        let slope = (receiver.slope / DVec2::new(width, height))
            .clamp(DVec2::splat(-8.0), DVec2::splat(8.0));
        let plane =
            f64::from(self.statistic.plane_deviations()) * self.deviation_texels() * slope.length();
        let expected = receiver.depth.min(1.0) - receiver.half_texel - plane;
        // An edge-on receiver has no plane to speak of; then nothing hides it.
        let depth = map.linear_depth(receiver.st, expected);
        self.statistic.visibility(channels, depth as f32)
    }
}
