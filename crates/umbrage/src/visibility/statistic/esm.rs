use super::{Channels, Encoding};
use crate::error::{Error, check};
use std::fmt;

/// Exponential shadow maps (Annen, Mertens, Seidel, Flerackers and Kautz 2008): exp(c (z − d)) in
/// place of the step function, for texel depth z and receiver depth d. This is accurate where z <
/// d, and clamped to 1 where the mean lies behind the receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Esm {
    /// The exponent c, > 0 and at most [`MAX_EXPONENT`](Self::MAX_EXPONENT); larger values give a
    /// steeper step.
    pub exponent: f32,
}

impl Esm {
    /// The largest c for which exp(−c) does not underflow in single precision.
    pub const MAX_EXPONENT: f32 = 80.0;
}

impl Default for Esm {
    fn default() -> Self {
        Self { exponent: Self::MAX_EXPONENT }
    }
}

impl Encoding for Esm {
    fn channels(&self) -> usize {
        1
    }

    fn encode(&self, depth: f32, channels: &mut Channels) {
        channels[0] = (self.exponent * (depth - 1.0)).exp();
    }

    fn visibility(&self, channels: &Channels, depth: f32) -> f32 {
        channels[0] * (self.exponent * (1.0 - depth)).exp()
    }

    fn check(&self) -> Result<(), Error> {
        check(self.exponent > 0.0 && self.exponent <= Self::MAX_EXPONENT, "filter.exponent", || {
            format!("must be above 0 and at most {}, is {}", Self::MAX_EXPONENT, self.exponent)
        })
    }
}

impl fmt::Display for Esm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("esm")
    }
}
