//! Prefiltered maps: what filters that are applied ahead of lookup make of a map's depths.

use crate::{DepthMap, Error};
use glam::DVec2;
use rayon::prelude::*;
use umbrage::ShadowMap;
use umbrage::visibility::Prefilter;
use umbrage::visibility::statistic::{Channels, MAX_CHANNELS, Storage};

/// A prefiltered map: statistics of the map's depths, blurred, and rounded as they are stored.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StatisticMap {
    channels: usize,
    gutter: u32,
    /// The mip level that `levels[0]` holds.
    first_level: u32,
    /// Mip levels, each at half the resolution of the one before.
    levels: Vec<Level>,
}

/// A mip level of a prefiltered map.
#[derive(Clone, Debug, PartialEq)]
struct Level {
    size: [usize; 2],
    texels: Vec<f32>,
}

impl StatisticMap {
    /// Encodes the depths as statistics and then blurs them, first along rows and then along
    /// columns, or makes mip levels of them. Every step rounds its results to the stored format.
    /// Texels beyond what is drawn have the values of the nearest drawn texel.
    pub(crate) fn new(
        map: &ShadowMap,
        depths: &DepthMap,
        prefilter: &Prefilter,
    ) -> Result<Self, Error> {
        let channels = prefilter.statistic.channels();
        let resolution = depths.resolution();
        let (gutter, drawn) = depths.drawn();
        let first_level = prefilter.first_level();
        if resolution.contains(&0) {
            return Ok(Self { channels, gutter, first_level, levels: Vec::new() });
        }
        // Texels of the map along each side of a stored texel.
        let step = 1 << first_level;
        let size = drawn.map(|n| (n >> first_level) as usize);
        let row = size[0] * channels;
        let storage = prefilter.statistic.storage();
        let first = -(gutter as i32);
        let share = 1.0 / (step * step) as f32;
        let mut texels = buffer(row, size[1], resolution)?;
        texels.par_chunks_mut(row).enumerate().for_each(|(y, row)| {
            let j = first + step * y as i32;
            for (texel, i) in row.chunks_exact_mut(channels).zip((first..).step_by(step as usize)) {
                for (i, j) in (0..step * step).map(|k| (i + k % step, j + k / step)) {
                    let encoded = prefilter.encode(map, i, j, depths.texel(i, j));
                    texel.iter_mut().zip(encoded).for_each(|(t, e)| *t += share * e);
                }
                texel.iter_mut().for_each(|t| *t = storage.stored(*t));
            }
        });
        let weights: Vec<f32> = prefilter.weights().collect();
        if weights.len() > 1 {
            let mut blurred = buffer(row, size[1], resolution)?;
            blurred.par_chunks_mut(row).zip(texels.par_chunks(row)).for_each(|(to, from)| {
                let at = |x: usize, k: isize| {
                    let x = x.saturating_add_signed(k).min(size[0] - 1) * channels;
                    &from[x..x + channels]
                };
                for (x, to) in to.chunks_exact_mut(channels).enumerate() {
                    blur(to, &weights, storage, |k| at(x, k));
                }
            });
            texels.par_chunks_mut(row).enumerate().for_each(|(y, to)| {
                let at = |k: isize| {
                    let y = y.saturating_add_signed(k).min(size[1] - 1) * row;
                    &blurred[y..y + row]
                };
                blur(to, &weights, storage, at);
            });
        }
        let mut levels = vec![Level { size, texels }];
        for _ in 1..prefilter.levels() {
            let next = levels[levels.len() - 1].halved(channels, storage, resolution)?;
            levels.push(next);
        }
        Ok(Self { channels, gutter, first_level, levels })
    }

    /// The statistics at a point given in the map's texel coordinates, interpolated bilinearly
    /// between the texels of a mip level.
    pub(crate) fn sample(&self, texel: DVec2, level: u32) -> Channels {
        let place = (texel + f64::from(self.gutter)) / f64::from(1u32 << level);
        let level = self.levels.get((level - self.first_level) as usize).or(self.levels.last());
        level.map_or([0.0; MAX_CHANNELS], |l| l.sample(place, self.channels))
    }
}

impl Level {
    /// The next mip level, half as wide and half as high. Width and height of this level are even.
    fn halved(
        &self,
        channels: usize,
        storage: Storage,
        resolution: [u32; 2],
    ) -> Result<Self, Error> {
        let size = self.size.map(|n| n / 2);
        let row = size[0] * channels;
        let mut texels = buffer(row, size[1], resolution)?;
        texels.par_chunks_mut(row).enumerate().for_each(|(y, to)| {
            for (i, to) in to.iter_mut().enumerate() {
                let [x, c] = [i / channels, i % channels];
                let at = |dx: usize, dy: usize| {
                    self.texels[((2 * y + dy) * self.size[0] + 2 * x + dx) * channels + c]
                };
                *to = storage.stored(0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)));
            }
        });
        Ok(Self { size, texels })
    }

    /// The statistics at `place`, interpolated bilinearly between texels. `place` is in texels of
    /// this level, from the corner of its first drawn texel.
    fn sample(&self, place: DVec2, channels: usize) -> Channels {
        let mut sum = [0.0; MAX_CHANNELS];
        let corner = place - 0.5;
        let first = corner.floor();
        let fraction = (corner - first).as_vec2();
        let clamp = |at: f64, n: usize| (at.max(0.0) as usize).min(n - 1);
        for (y, v) in [(0.0, 1.0 - fraction.y), (1.0, fraction.y)] {
            for (x, u) in [(0.0, 1.0 - fraction.x), (1.0, fraction.x)] {
                let at = clamp(first.y + y, self.size[1]) * self.size[0]
                    + clamp(first.x + x, self.size[0]);
                let texel = &self.texels[at * channels..][..channels];
                sum.iter_mut().zip(texel).for_each(|(s, t)| *s += u * v * t);
            }
        }
        sum
    }
}

/// One pass of a separable blur over a run of channels. `at(k)` is the run that lies k texels away
/// along the direction of the blur.
fn blur<'a>(to: &mut [f32], weights: &[f32], storage: Storage, at: impl Fn(isize) -> &'a [f32]) {
    to.fill(0.0);
    for (k, weight) in (0isize..).zip(weights) {
        let sides = if k == 0 { &[0][..] } else { &[-k, k] };
        for &k in sides {
            to.iter_mut().zip(at(k)).for_each(|(t, f)| *t += weight * f);
        }
    }
    to.iter_mut().for_each(|t| *t = storage.stored(*t));
}

fn buffer(row: usize, rows: usize, resolution: [u32; 2]) -> Result<Vec<f32>, Error> {
    let mut buffer = Vec::new();
    let count = row.checked_mul(rows).ok_or(Error::Memory { resolution })?;
    buffer.try_reserve_exact(count).map_err(|_| Error::Memory { resolution })?;
    buffer.resize(count, 0.0);
    Ok(buffer)
}
