//! Axes and colour bars, even or logarithmic.

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use std::ops::Range;

/// How numbers are laid out along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scale {
    Linear,
    Log,
}

/// An axis, or a colour bar.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    /// Words beside it.
    pub(crate) label: String,
    range: [f64; 2],
    scale: Scale,
}

impl Axis {
    /// Even steps are even lengths.
    pub(crate) fn linear(label: &str, range: [f64; 2]) -> Self {
        Self { label: label.to_owned(), range, scale: Scale::Linear }
    }

    /// Even ratios are even lengths; both ends must be positive.
    pub(crate) fn log(label: &str, range: [f64; 2]) -> Self {
        Self { label: label.to_owned(), range, scale: Scale::Log }
    }

    /// The value a share of 0 to 1 along the axis.
    pub(crate) fn at(&self, share: f64) -> f64 {
        let [a, b] = self.range.map(|v| self.place(v));
        let placed = a + (b - a) * share;
        let value = match self.scale {
            Scale::Linear => placed,
            Scale::Log => 10_f64.powf(placed),
        };
        // Rounding must not leave the axis, where there may be no formula.
        value.clamp(self.range[0], self.range[1])
    }

    /// `count` values along the axis, both ends among them.
    pub(crate) fn samples(&self, count: usize) -> Vec<f64> {
        (0..count).map(|i| self.at(i as f64 / (count - 1) as f64)).collect()
    }

    /// Where a value lies before the axis is stretched to its length.
    fn place(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Log => value.log10(),
        }
    }

    /// Where a value lies, as a share of the axis.
    pub(crate) fn share(&self, value: f64) -> f64 {
        let [a, b, v] = [self.range[0], self.range[1], value].map(|v| self.place(v));
        (v - a) / (b - a)
    }

    /// Round numbers, about `count`.
    fn marks(&self, count: usize) -> Vec<f64> {
        let [a, b] = self.range;
        if self.scale == Scale::Linear {
            return RangedCoordf64::from(a..b).key_points(count);
        }
        let inside = |v: &f64| (-1e-9..=1.0 + 1e-9).contains(&self.share(*v));
        let decades = a.log10().floor() as i32..=b.log10().ceil() as i32;
        let powers: Vec<i32> = decades.filter(|&e| inside(&10_f64.powi(e))).collect();
        if powers.len() > 2 {
            let step = powers.len().div_ceil(count.max(2));
            return powers.into_iter().step_by(step).map(|e| 10_f64.powi(e)).collect();
        }
        let from = a.log10().floor() as i32;
        (from..=from + 3)
            .flat_map(|e| [1.0, 2.0, 5.0].map(|m| m * 10_f64.powi(e)))
            .filter(inside)
            .collect()
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        // A curve may leave the chart; far outside is all alike.
        let share = self.share(*value).clamp(-10.0, 10.0);
        limit.0 + (f64::from(limit.1 - limit.0) * share).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.marks(hint.bold_points()) }
    }

    fn range(&self) -> Range<f64> {
        self.range[0]..self.range[1]
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        // Marks of linear axes are sums: rounding makes something tiny of their zero.
        let [a, b] = self.range;
        let is_zero = self.scale == Scale::Linear && value.abs() < 1e-9 * (b - a).abs();
        number(if is_zero { 0.0 } else { *value })
    }
}

/// A round number in few letters: powers of ten where it is long.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e4).contains(&value.abs()) {
        // Marks of even axes are sums, with rounding at their ends.
        return format!("{}", (value * 1e6).round() / 1e6);
    }
    let exponent = value.abs().log10().floor();
    let factor = (value / 10_f64.powf(exponent) * 100.0).round() / 100.0;
    let power: String =
        format!("10{exponent}").chars().enumerate().map(|(i, c)| superscript(i, c)).collect();
    if factor == 1.0 { power } else { format!("{factor}·{power}") }
}

/// What follows the 10 of a power of ten, raised.
fn superscript(i: usize, c: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    match c.to_digit(10) {
        Some(d) if i > 1 => DIGITS[d as usize],
        None => '⁻',
        _ => c,
    }
}
