use super::{Channels, Encoding, Storage, check_leak};
use crate::error::{Error, check};
use crate::theory::FourierStep;
use std::f32::consts::PI;
use std::fmt;

/// Convolution shadow maps (Annen, Mertens, Bekaert, Seidel and Kautz 2007): M terms of the step
/// function's Fourier series, of which sin(c_k z) and cos(c_k z) are stored (their Eqs. 10 to 14,
/// where the step's direction is reversed as printed; [`FourierStep`] is the series itself).
///
/// The series is periodic: it does not distinguish depths 2 apart. Depth is therefore multiplied by
/// a factor below 1, so that even the largest difference of depths within a map keeps clear of the
/// next period's step, its offset and its ringing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Csm {
    order: u32,
    attenuation: f32,
    offset: bool,
    scale: bool,
    leak: f32,
    storage: Storage,
    /// Values derived from the parameters: the factor of depth, and the offset of the series
    /// towards the light.
    shrink: f32,
    shift: f32,
}

/// The smallest factor of depth.
const LEAST_SHRINK: f32 = 0.4;

impl Csm {
    /// The largest order M; there are M sines and M cosines.
    pub const MAX_ORDER: u32 = 16;

    /// A series of M = `order` terms, 1 ..= [`MAX_ORDER`](Self::MAX_ORDER). The terms are damped
    /// against ringing by exp(−α (k/M)²) with α = `attenuation` ≥ 0 (0 for none).
    ///
    /// With `offset` the series is evaluated nearer the light by o_M, where it first reaches 1, so
    /// that lit surfaces are bright. With `scale` it is doubled, to the same end. With neither, lit
    /// surfaces are half as bright.
    ///
    /// # Errors
    /// Names the parameter that is out of its range.
    pub fn new(order: u32, attenuation: f32, offset: bool, scale: bool) -> Result<Self, Error> {
        check((1..=Self::MAX_ORDER).contains(&order), "filter.order", || {
            format!("must be 1 to {}, is {order}", Self::MAX_ORDER)
        })?;
        let step = FourierStep::new(order, f64::from(attenuation))
            .map_err(|_| Error::invalid("filter.attenuation", "must be finite and not negative"))?;
        let o = step.offset() as f32;
        Ok(Self {
            order,
            attenuation,
            offset,
            scale,
            leak: 0.0,
            storage: Storage::Snorm8,
            // With extreme damping the offset approaches half a period, and 1 − 2 o would
            // approach 0.
            shrink: (1.0 - 2.0 * o).max(LEAST_SHRINK),
            shift: if offset { o } else { 0.0 },
        })
    }

    /// The same series stored in 16 bits instead of 8, for comparison.
    #[must_use]
    pub fn in_16_bits(self) -> Self {
        Self { storage: Storage::Snorm16, ..self }
    }

    /// The same series with visibilities up to `leak`, at least 0 and less than 1, counting as
    /// shadow, which hides ringing.
    #[must_use]
    pub fn with_leak(self, leak: f32) -> Self {
        Self { leak, ..self }
    }

    /// The largest visibility that counts as shadow.
    pub fn leak(&self) -> f32 {
        self.leak
    }

    /// Strength α of the damping of higher terms.
    pub fn attenuation(&self) -> f32 {
        self.attenuation
    }

    /// Whether lit surfaces are made bright by the offset, and whether by doubling.
    pub(crate) fn brightening(&self) -> [bool; 2] {
        [self.offset, self.scale]
    }

    /// The number of terms M.
    pub fn order(&self) -> u32 {
        self.order
    }

    /// The factor with which depth is multiplied before it is encoded, in (0, 1].
    pub fn shrink(&self) -> f32 {
        self.shrink
    }

    /// How much nearer the light the series is evaluated, in depths after the multiplication.
    pub fn shift(&self) -> f32 {
        self.shift
    }

    /// The factor of the series: 2 if it is doubled, otherwise 1.
    pub fn gain(&self) -> f32 {
        if self.scale { 2.0 } else { 1.0 }
    }

    /// For each term k its frequency, c_k times the factor of depth, and its amplitude 2/c_k,
    /// damped.
    pub fn terms(&self) -> impl Iterator<Item = [f32; 2]> + use<> {
        let Self { order, attenuation, shrink, .. } = *self;
        (1..=order).map(move |k| {
            let c = PI * (2.0 * k as f32 - 1.0);
            let relative = k as f32 / order as f32;
            [c * shrink, 2.0 / c * (-attenuation * relative * relative).exp()]
        })
    }
}

impl Encoding for Csm {
    fn channels(&self) -> usize {
        2 * self.order as usize
    }

    fn storage(&self) -> Storage {
        self.storage
    }

    fn encode(&self, depth: f32, channels: &mut Channels) {
        for ([rate, _], pair) in self.terms().zip(channels.chunks_exact_mut(2)) {
            let (sin, cos) = (rate * depth).sin_cos();
            pair.copy_from_slice(&[sin, cos]);
        }
    }

    fn visibility(&self, channels: &Channels, depth: f32) -> f32 {
        let depth = depth - self.shift / self.shrink;
        let terms = self.terms().zip(channels.chunks_exact(2));
        let sum: f32 = terms
            .map(|([rate, amount], pair)| {
                let (sin, cos) = (rate * depth).sin_cos();
                amount * (pair[0] * cos - pair[1] * sin)
            })
            .sum();
        (self.gain() * (0.5 + sum) - self.leak) / (1.0 - self.leak)
    }

    fn plane_deviations(&self) -> f32 {
        1.0
    }

    fn check(&self) -> Result<(), Error> {
        check_leak(self.leak)
    }
}

impl fmt::Display for Csm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "csm{}", self.order)
    }
}
