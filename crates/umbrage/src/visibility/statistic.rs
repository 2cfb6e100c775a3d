//! Statistics of depth for prefilters: what each stores and how it reconstructs visibility.
//!
//! A comparison of depths cannot be filtered before the receiver is known. Each statistic therefore
//! stores, in place of depth, functions of depth whose *means* over many texels determine how much
//! light reaches a receiver at any depth. Depth is linear along the beam, from 0 to 1 over the slab
//! that holds the map's receivers ([`ShadowMap::slab_depth`](crate::ShadowMap::slab_depth)).
//!
//! | | stores | reconstructs visibility by |
//! | --- | --- | --- |
//! | [`Vsm`] | z, z² | Chebyshev's bound |
//! | [`Esm`] | exp(c z) | an exponential in place of the step function |
//! | [`Evsm`] | ± exp(± c z) and their squares | Chebyshev's bound after a warp of depth |
//! | [`Msm`] | z, z², z³, z⁴ | Hamburger's bound |
//! | [`Csm`] | sines and cosines of depth | the Fourier series of the step function |
//!
//! A new statistic needs a file beside this one, a file of the same name in
//! `umbrage-wgpu/src/wgsl/statistic`, and a line in each `match` over the variants of
//! [`Statistic`], which the compiler reports.

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

/// The largest number of channels that a statistic has.
pub const MAX_CHANNELS: usize = 32;

/// The values of a statistic, one for each channel; channels that the statistic does not have are
/// 0.
pub type Channels = [f32; MAX_CHANNELS];

/// Which statistic of depth is stored.
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

/// The format in which a statistic's channels are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// Floating point in single precision.
    Float32,
    /// 16 bits for values from 0 to 1.
    Unorm16,
    /// 16 bits for values from −1 to 1.
    Snorm16,
    /// 8 bits for values from −1 to 1.
    Snorm8,
}

impl Storage {
    /// Bytes of one channel.
    pub fn bytes(self) -> u32 {
        match self {
            Self::Float32 => 4,
            Self::Unorm16 | Self::Snorm16 => 2,
            Self::Snorm8 => 1,
        }
    }

    /// The value after storing, clamped and rounded as the format requires.
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

/// The functions that each statistic implements.
pub(crate) trait Encoding: fmt::Display {
    /// Number of channels, 1 ..= [`MAX_CHANNELS`].
    fn channels(&self) -> usize;

    /// The format in which the channels are stored.
    fn storage(&self) -> Storage {
        Storage::Float32
    }

    /// The channels of a texel of linear depth 0 ..= 1.
    fn encode(&self, depth: f32, channels: &mut Channels);

    /// The share of the light that reaches a receiver at a linear depth, from the channels' means
    /// around it. It may lie outside 0 ..= 1, to which the caller clamps it.
    fn visibility(&self, channels: &Channels, depth: f32) -> f32;

    /// Allowance for the receiver's own plane, in standard deviations of its depth over the filter.
    /// 0 for statistics that can distinguish a slanted plane from an occluder.
    fn plane_deviations(&self) -> f32 {
        0.0
    }

    /// Checks that all parameters are in their ranges.
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

    /// Number of channels of each texel, 1 ..= [`MAX_CHANNELS`].
    pub fn channels(&self) -> usize {
        self.encoding().channels()
    }

    /// The format in which the channels are stored.
    pub fn storage(&self) -> Storage {
        self.encoding().storage()
    }

    /// The channels of a texel of linear depth 0 ..= 1, before they are rounded to be stored.
    pub fn encode(&self, depth: f32) -> Channels {
        let mut channels = [0.0; MAX_CHANNELS];
        self.encoding().encode(depth, &mut channels);
        channels
    }

    /// The share of the light that reaches a receiver at a linear depth, 0 ..= 1, from the
    /// channels' means around it.
    pub fn visibility(&self, channels: &Channels, depth: f32) -> f32 {
        let visibility = self.encoding().visibility(channels, depth);
        // The result is NaN where the receiver's depth is; such receivers are lit.
        if visibility.is_nan() { 1.0 } else { visibility.clamp(0.0, 1.0) }
    }

    /// By how many standard deviations of the depth of its own plane over the filter the receiver
    /// is moved towards the light before its visibility is reconstructed.
    pub fn plane_deviations(&self) -> f32 {
        self.encoding().plane_deviations()
    }

    /// Checks that all parameters are in their ranges.
    ///
    /// # Errors
    /// Names the parameter that is out of its range.
    pub fn check(&self) -> Result<(), Error> {
        self.encoding().check()
    }
}

/// The form of a technique's text: `vsm`, `csm8`.
impl fmt::Display for Statistic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.encoding().fmt(f)
    }
}

/// Chebyshev's one-sided bound: the largest possible share of depths of at least `depth`, given
/// their mean and mean square (Donnelly and Lauritzen 2006, Eq. 5).
pub(crate) fn chebyshev([mean, square]: [f32; 2], least_variance: f32, depth: f32) -> f32 {
    if depth <= mean {
        return 1.0;
    }
    let variance = (square - mean * mean).max(least_variance);
    let beyond = depth - mean;
    variance / (variance + beyond * beyond)
}

/// Counts visibilities below `leak` as shadow and stretches the others to 0 ..= 1 (Lauritzen 2008,
/// GPU Gems 3, §8.4.3).
pub(crate) fn without_leak(visibility: f32, leak: f32) -> f32 {
    ((visibility - leak) / (1.0 - leak)).clamp(0.0, 1.0)
}

/// Checks that a threshold for light leaking is in its range.
pub(crate) fn check_leak(leak: f32) -> Result<(), Error> {
    crate::error::check((0.0..1.0).contains(&leak), "filter.leak", || {
        format!("must be 0 to less than 1, is {leak}")
    })
}

#[cfg(test)]
mod tests;
