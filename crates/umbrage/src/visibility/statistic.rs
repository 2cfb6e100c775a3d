//! Statistics of depth that can be filtered ahead of lookup: what they store, and what they make of it.
//!
//! A comparison cannot be filtered before the receiver is known. So each of these stores, in place of depth, numbers whose *means* over many
//! texels tell how much light a receiver at any depth gets. Depth is linear along the beam, 0 to 1 over the slab in which the map's receivers lie
//! ([`ShadowMap::slab_depth`](crate::ShadowMap::slab_depth)).
//!
//! | | stores | tells |
//! | --- | --- | --- |
//! | [`Vsm`] | z, z² | Chebyshev's bound |
//! | [`Esm`] | exp(c z) | the exponential in place of the step |
//! | [`Evsm`] | ± exp(± c z) and squares | Chebyshev's bound after a warp of depth |
//! | [`Msm`] | four moments | Hamburger's bound |
//! | [`Csm`] | sines and cosines of depth | the step's Fourier series |
//!
//! To add one: a file beside this one, a file of the same name in `umbrage-wgpu/src/wgsl/statistic`,
//! and a line in each place that has [`Statistic`]'s variants in a `match`, which the compiler names.

mod csm;
mod esm;
mod evsm;
mod msm;
mod vsm;

pub use csm::Csm;
pub use esm::Esm;
pub use evsm::Evsm;
pub use msm::Msm;
pub use vsm::Vsm;

use crate::error::Error;
use std::fmt;

/// The most numbers that a statistic has.
pub const MAX_CHANNELS: usize = 32;

/// A statistic's numbers; those beyond its own are 0.
pub type Channels = [f32; MAX_CHANNELS];

/// Which numbers are stored in place of depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Statistic {
    /// Variance shadow maps.
    Vsm(Vsm),
    /// Exponential shadow maps.
    Esm(Esm),
    /// Exponential variance shadow maps.
    Evsm(Evsm),
    /// Moment shadow maps.
    Msm(Msm),
    /// Convolution shadow maps.
    Csm(Csm),
}

/// How a statistic's numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// Single precision.
    Float32,
    /// 0 to 1 in 16 bits.
    Unorm16,
    /// −1 to 1 in 16 bits.
    Snorm16,
    /// −1 to 1 in 8 bits.
    Snorm8,
}

impl Storage {
    /// Bytes of one number.
    pub fn bytes(self) -> u32 {
        match self {
            Self::Float32 => 4,
            Self::Unorm16 | Self::Snorm16 => 2,
            Self::Snorm8 => 1,
        }
    }

    /// What is left of a number that is stored.
    pub fn stored(self, value: f32) -> f32 {
        let steps = |low: f32, n: f32| (value.clamp(low, 1.0) * n).round() / n;
        match self {
            Self::Float32 => value,
            Self::Unorm16 => steps(0.0, 65535.0),
            Self::Snorm16 => steps(-1.0, 32767.0),
            Self::Snorm8 => steps(-1.0, 127.0),
        }
    }
}

/// What every statistic can do.
pub(crate) trait Encoding: fmt::Display {
    /// How many numbers it has, 1 ..= [`MAX_CHANNELS`].
    fn channels(&self) -> usize;

    /// How they are stored.
    fn storage(&self) -> Storage {
        Storage::Float32
    }

    /// The numbers of a texel of linear depth 0 ..= 1.
    fn encode(&self, depth: f32, channels: &mut Channels);

    /// How much light reaches a receiver at a linear depth, from the means of the numbers around it: 0 ..= 1 before clamping.
    fn visibility(&self, channels: &Channels, depth: f32) -> f32;

    /// How many standard deviations of the receiver's own plane over the filter to allow for. 0 for those that tell a
    /// slanted plane from an occluder by themselves.
    fn plane_deviations(&self) -> f32 {
        0.0
    }

    /// That its parameters make sense.
    fn check(&self) -> Result<(), Error>;
}

impl Statistic {
    fn encoding(&self) -> &dyn Encoding {
        match self {
            Self::Vsm(s) => s,
            Self::Esm(s) => s,
            Self::Evsm(s) => s,
            Self::Msm(s) => s,
            Self::Csm(s) => s,
        }
    }

    /// How many numbers there are for each texel, 1 ..= [`MAX_CHANNELS`].
    pub fn channels(&self) -> usize {
        self.encoding().channels()
    }

    /// How they are stored.
    pub fn storage(&self) -> Storage {
        self.encoding().storage()
    }

    /// The numbers of a texel of linear depth 0 ..= 1, before they are stored.
    pub fn encode(&self, depth: f32) -> Channels {
        let mut channels = [0.0; MAX_CHANNELS];
        self.encoding().encode(depth, &mut channels);
        channels
    }

    /// How much light reaches a receiver at a linear depth, 0 ..= 1, from the means of the numbers around it.
    pub fn visibility(&self, channels: &Channels, depth: f32) -> f32 {
        let visibility = self.encoding().visibility(channels, depth);
        // What is no number, as of a receiver at no depth, is lit.
        if visibility.is_nan() { 1.0 } else { visibility.clamp(0.0, 1.0) }
    }

    /// How many standard deviations of the receiver's own plane, over the filter, count as lit.
    pub fn plane_deviations(&self) -> f32 {
        self.encoding().plane_deviations()
    }

    /// That its parameters make sense.
    ///
    /// # Errors
    /// Names the parameter that does not.
    pub fn check(&self) -> Result<(), Error> {
        self.encoding().check()
    }
}

/// As in a shadow specification: `vsm`, `csm8`.
impl fmt::Display for Statistic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.encoding().fmt(f)
    }
}

/// Chebyshev's one-sided bound on the share of depths that are at least `depth`, from their mean and mean square (Donnelly and Lauritzen
/// 2006, Eq. 5).
pub(crate) fn chebyshev([mean, square]: [f32; 2], least_variance: f32, depth: f32) -> f32 {
    if depth <= mean {
        return 1.0;
    }
    let variance = (square - mean * mean).max(least_variance);
    let beyond = depth - mean;
    variance / (variance + beyond * beyond)
}

/// Takes what is below `leak` for shadow, and stretches the rest (Lauritzen 2008, GPU Gems 3, §8.4.3).
pub(crate) fn without_leak(visibility: f32, leak: f32) -> f32 {
    ((visibility - leak) / (1.0 - leak)).clamp(0.0, 1.0)
}

/// That a leak reduction is one.
pub(crate) fn check_leak(leak: f32) -> Result<(), Error> {
    crate::error::check((0.0..1.0).contains(&leak), "filter.leak", || {
        format!("must be 0 to less than 1, is {leak}")
    })
}

#[cfg(test)]
mod tests;
