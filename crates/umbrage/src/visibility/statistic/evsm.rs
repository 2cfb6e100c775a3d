use super::{Channels, Encoding, chebyshev, check_leak, without_leak};
use crate::error::{Error, check};
use std::fmt;

/// Exponential variance shadow maps (Lauritzen and McCool 2008): Chebyshev's bound on depth warped
/// by exp(c z). With four channels, depth is also warped by −exp(−c z), and the smaller of both
/// bounds is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evsm {
    /// Number of channels, 2 or 4.
    pub components: u32,
    /// The exponent c, > 0 and at most [`MAX_EXPONENT`](Self::MAX_EXPONENT).
    pub exponent: f32,
    /// Visibilities up to this value, at least 0 and less than 1, count as shadow.
    pub leak: f32,
}

impl Evsm {
    /// The largest c for which the square of exp(c) does not overflow in single precision.
    pub const MAX_EXPONENT: f32 = 42.0;
}

impl Default for Evsm {
    /// Four channels, c = 42.
    fn default() -> Self {
        Self { components: 4, exponent: Self::MAX_EXPONENT, leak: 0.0 }
    }
}

/// Standard deviation of depth below which rounding to single precision dominates after the warp.
const LEAST_DEVIATION: f32 = 1e-4;

impl Evsm {
    /// Chebyshev's bound from the moments of depth warped with an exponent of this sign.
    fn bound(&self, moments: [f32; 2], sign: f32, depth: f32) -> f32 {
        let warped = sign * (sign * self.exponent * depth).exp();
        let deviation = LEAST_DEVIATION * self.exponent * warped;
        chebyshev(moments, deviation * deviation, warped)
    }
}

impl Encoding for Evsm {
    fn channels(&self) -> usize {
        self.components as usize
    }

    fn encode(&self, depth: f32, channels: &mut Channels) {
        let positive = (self.exponent * depth).exp();
        let negative = -(-self.exponent * depth).exp();
        channels[0] = positive;
        channels[1] = positive * positive;
        if self.components == 4 {
            channels[2] = negative;
            channels[3] = negative * negative;
        }
    }

    fn visibility(&self, channels: &Channels, depth: f32) -> f32 {
        let mut bound = self.bound([channels[0], channels[1]], 1.0, depth);
        if self.components == 4 {
            bound = bound.min(self.bound([channels[2], channels[3]], -1.0, depth));
        }
        without_leak(bound, self.leak)
    }

    fn check(&self) -> Result<(), Error> {
        check(matches!(self.components, 2 | 4), "filter.components", || {
            format!("must be 2 or 4, is {}", self.components)
        })?;
        check(
            self.exponent > 0.0 && self.exponent <= Self::MAX_EXPONENT,
            "filter.exponent",
            || format!("must be above 0 and at most {}, is {}", Self::MAX_EXPONENT, self.exponent),
        )?;
        check_leak(self.leak)
    }
}

impl fmt::Display for Evsm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.components == 2 { "evsm2" } else { "evsm" })
    }
}
