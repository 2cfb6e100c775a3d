use super::{Channels, Encoding, chebyshev, check_leak, without_leak};
use crate::error::Error;
use std::fmt;

/// Variance shadow maps (Donnelly and Lauritzen 2006): the mean and the mean square of depth bound
/// the lit share from above.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vsm {
    /// Visibilities up to this value, at least 0 and less than 1, count as shadow. This hides light
    /// leaking and darkens penumbrae.
    pub leak: f32,
}

/// Variance below which rounding of squares near 1 to single precision dominates.
const LEAST_VARIANCE: f32 = 2.5e-7;

impl Encoding for Vsm {
    fn channels(&self) -> usize {
        2
    }

    fn encode(&self, depth: f32, channels: &mut Channels) {
        channels[0] = depth;
        channels[1] = depth * depth;
    }

    fn visibility(&self, channels: &Channels, depth: f32) -> f32 {
        without_leak(chebyshev([channels[0], channels[1]], LEAST_VARIANCE, depth), self.leak)
    }

    fn check(&self) -> Result<(), Error> {
        check_leak(self.leak)
    }
}

impl fmt::Display for Vsm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("vsm")
    }
}
