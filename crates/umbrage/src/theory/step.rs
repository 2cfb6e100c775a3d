use crate::error::{Error, check};
use std::f64::consts::PI;

/// The shadow test of convolution shadow maps: a truncated Fourier series of a step from 0 to 1
/// (Annen et al. 2007, Eqs. 10 to 14).
///
/// For a receiver at depth d and an occluder at depth z, both linear in 0 ..= 1, the series is f(d,
/// z) = 1/2 + 2 Σ_{k=1..M} exp(−α (k/M)²)/c_k · sin(c_k (z − d)) with c_k = π (2k − 1).
/// It is about 1, lit, where d ≤ z. The paper defines f in this way, but its Eq. 11 expands the
/// step of d − z, which exchanges light and shadow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FourierStep {
    order: u32,
    attenuation: f64,
}

/// Where the series is evaluated. At d = z its value is 1/2, with which lit surfaces would have
/// half their brightness (§3.2.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepAt {
    /// Evaluate the series at d − [`o_M`](FourierStep::offset) in place of d.
    pub offset: bool,
    /// Double the series.
    pub scale: bool,
}

impl FourierStep {
    /// The largest order M.
    pub const MAX_ORDER: u32 = 1024;

    /// A series of M terms, 1 ..= [`MAX_ORDER`](Self::MAX_ORDER), whose terms are damped against
    /// ringing with strength α ≥ 0, finite, 0 for none.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.order` or `theory.attenuation`.
    pub fn new(order: u32, attenuation: f64) -> Result<Self, Error> {
        check((1..=Self::MAX_ORDER).contains(&order), "theory.order", || {
            format!("must be 1 to {}, is {order}", Self::MAX_ORDER)
        })?;
        check(attenuation >= 0.0 && attenuation.is_finite(), "theory.attenuation", || {
            format!("must be finite and not negative, is {attenuation}")
        })?;
        Ok(Self { order, attenuation })
    }

    /// For each term, c_k and the coefficient of its sine.
    fn terms(self) -> impl Iterator<Item = (f64, f64)> {
        let order = f64::from(self.order);
        (1..=self.order).map(f64::from).map(move |k| {
            let c = PI * (2.0 * k - 1.0);
            (c, 2.0 / c * (-self.attenuation * (k / order).powi(2)).exp())
        })
    }

    /// The series at x = z − d, not clamped, including its ringing below 0 and above 1. Its
    /// period is 2, so it approximates a step for |x| < 1 only.
    pub fn series(&self, x: f64) -> f64 {
        0.5 + self.terms().map(|(c, amount)| amount * (c * x).sin()).sum::<f64>()
    }

    fn slope(&self, x: f64) -> f64 {
        self.terms().map(|(c, amount)| amount * c * (c * x).cos()).sum()
    }

    /// The offset o_M: the least x ≥ 0 at which the series reaches 1. If the terms are damped so
    /// much that it never does, the least x at which the series is within half a grey level (of
    /// 255) of its maximum. The maximum itself may lie far from the contact of occluder and
    /// receiver and would be no visible improvement.
    pub fn offset(&self) -> f64 {
        let highest = self.tops().map(|top| self.series(top[1])).fold(0.0, f64::max);
        let target = if highest >= 1.0 { 1.0 } else { highest - 1.0 / 510.0 };
        let reached = self.tops().find(|top| self.series(top[1]) >= target);
        reached.map_or(0.5, |[begin, top]| bisect(begin, top, |x| self.series(x) >= target))
    }

    /// The sampled intervals of x from 0 to 1/2, about which the series is symmetric. For each, its
    /// beginning and the x at which the series peaks, or the interval's end if the series has no
    /// peak within.
    fn tops(&self) -> impl Iterator<Item = [f64; 2]> {
        // The series' shortest wave is sampled 32 times, so that no interval has more than one
        // peak.
        let samples = 16 * self.order;
        let place = move |i: u32| 0.5 * f64::from(i) / f64::from(samples);
        (1..=samples).map(move |i| {
            let (begin, end) = (place(i - 1), place(i));
            let has_peak = self.slope(begin) > 0.0 && self.slope(end) < 0.0;
            [begin, if has_peak { bisect(begin, end, |x| self.slope(x) < 0.0) } else { end }]
        })
    }

    /// The share of the light that reaches a receiver at depth d past an occluder at depth z, both
    /// in 0 ..= 1: the series, evaluated as `at` says and clamped to 0 ..= 1.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.receiver` or `theory.occluder` for depths outside
    /// 0 ..= 1, and with `theory.receiver` if both are 1 apart, which is half the series' period.
    pub fn visibility(&self, receiver: f64, occluder: f64, at: StepAt) -> Result<f64, Error> {
        for (depth, field) in [(receiver, "theory.receiver"), (occluder, "theory.occluder")] {
            check((0.0..=1.0).contains(&depth), field, || {
                format!("must be a depth of 0 to 1, is {depth}")
            })?;
        }
        let apart = occluder - receiver;
        check(apart.abs() < 1.0, "theory.receiver", || {
            "must be less than 1 from the occluder, half the series' period".into()
        })?;
        let x = if at.offset { apart + self.offset() } else { apart };
        let scale = if at.scale { 2.0 } else { 1.0 };
        Ok((scale * self.series(x)).clamp(0.0, 1.0))
    }
}

/// The place between `lo`, where a condition does not hold, and `hi`, where it does, at which it
/// begins to hold.
fn bisect(mut lo: f64, mut hi: f64, holds: impl Fn(f64) -> bool) -> f64 {
    // 60 halvings exhaust the digits of double precision.
    for _ in 0..60 {
        let middle = lo.midpoint(hi);
        if holds(middle) {
            hi = middle;
        } else {
            lo = middle;
        }
    }
    hi
}
