use super::{Channels, Encoding, Storage, check_leak};
use crate::error::{Error, check};
use crate::theory::FourierStep;
use std::f32::consts::PI;
use std::fmt;

/// Convolution shadow maps (Annen, Mertens, Bekaert, Seidel and Kautz 2007): M terms of the step's Fourier series, of which sin(c_k z) and cos(c_k z) are stored
/// (their Eqs. 10 to 14, with the step the right way round; [`FourierStep`] has the series itself).
///
/// The series has a period: depths 2 apart are one. So depth is shrunk until the step, its offset and its ringing stay away from the next one, at any
/// difference of depths that a map has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Csm {
    order: u32,
    attenuation: f32,
    offset: bool,
    scale: bool,
    leak: f32,
    storage: Storage,
    /// Follow from these: how much depth is shrunk, and the depth by which the series is evaluated nearer the light.
    shrink: f32,
    shift: f32,
}

/// What is left of depth at least.
const LEAST_SHRINK: f32 = 0.4;

impl Csm {
    /// The largest order: M sines and M cosines.
    pub const MAX_ORDER: u32 = 16;

    /// M terms, 1 ..= [`MAX_ORDER`](Self::MAX_ORDER), damped against ringing by exp(−α (k/M)²) with α = `attenuation` ≥ 0 (0 for none).
    ///
    /// `offset`: evaluate the series nearer the light by o_M, where it reaches 1 first, so that lit surfaces are bright. `scale`: double it instead. With
    /// neither they are half as bright.
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
            // Damped so much that it hardly is a step, the series would leave nothing.
            shrink: (1.0 - 2.0 * o).max(LEAST_SHRINK),
            shift: if offset { o } else { 0.0 },
        })
    }

    /// Stored in 16 bits in place of 8, for comparison.
    #[must_use]
    pub fn in_16_bits(self) -> Self {
        Self { storage: Storage::Snorm16, ..self }
    }

    /// What visibility is taken for shadow, 0 to less than 1: it hides the series' ringing.
    #[must_use]
    pub fn with_leak(self, leak: f32) -> Self {
        Self { leak, ..self }
    }

    /// What visibility is taken for shadow.
    pub fn leak(&self) -> f32 {
        self.leak
    }

    /// How much the higher terms are damped: α.
    pub fn attenuation(&self) -> f32 {
        self.attenuation
    }

    /// Whether lit surfaces are made bright by an offset, and whether by doubling.
    pub(crate) fn brightening(&self) -> [bool; 2] {
        [self.offset, self.scale]
    }

    /// M.
    pub fn order(&self) -> u32 {
        self.order
    }

    /// By how much depth is shrunk before it is encoded, 0 to 1.
    pub fn shrink(&self) -> f32 {
        self.shrink
    }

    /// How much nearer the light the series is evaluated, in shrunk depth.
    pub fn shift(&self) -> f32 {
        self.shift
    }

    /// What the series is multiplied with.
    pub fn gain(&self) -> f32 {
        if self.scale { 2.0 } else { 1.0 }
    }

    /// Of each term: c_k times the shrinking of depth, and its amount 2/c_k, damped.
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
