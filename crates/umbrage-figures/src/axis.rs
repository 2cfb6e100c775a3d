//! Linear and logarithmic axes of charts and colour bars.

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use std::ops::Range;

/// How values are spread along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scale {
    Linear,
    Log,
}

/// An axis of a chart, or the scale of a colour bar.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    /// Text beside the axis.
    pub(crate) label: String,
    range: [f64; 2],
    scale: Scale,
}

impl Axis {
    /// Creates a linear axis, on which equal differences take equal lengths.
    pub(crate) fn linear(label: &str, range: [f64; 2]) -> Self {
        Self { label: label.to_owned(), range, scale: Scale::Linear }
    }

    /// Creates a logarithmic axis, on which equal ratios take equal lengths. Both ends must be > 0.
    pub(crate) fn log(label: &str, range: [f64; 2]) -> Self {
        Self { label: label.to_owned(), range, scale: Scale::Log }
    }

    /// The value at a fraction `share` of the axis's length, 0 to 1.
    pub(crate) fn at(&self, share: f64) -> f64 {
        let [a, b] = self.range.map(|v| self.place(v));
        let placed = a + (b - a) * share;
        let value = match self.scale {
            Scale::Linear => placed,
            Scale::Log => 10_f64.powf(placed),
        };
        // Rounding must not leave the range: closed forms may be undefined outside it.
        value.clamp(self.range[0], self.range[1])
    }

    /// `count` values at equal lengths along the axis, including both ends.
    pub(crate) fn samples(&self, count: usize) -> Vec<f64> {
        (0..count).map(|i| self.at(i as f64 / (count - 1) as f64)).collect()
    }

    /// The value itself on a linear axis, or its decimal logarithm on a logarithmic axis.
    fn place(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Log => value.log10(),
        }
    }

    /// The position of a value as a fraction of the axis's length.
    pub(crate) fn share(&self, value: f64) -> f64 {
        let [a, b, v] = [self.range[0], self.range[1], value].map(|v| self.place(v));
        (v - a) / (b - a)
    }

    /// About `count` round numbers at which the axis has tick marks.
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
        // Curves may leave the chart. Far outside it, their exact position makes no difference.
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
        // Tick marks of linear axes are sums, so that rounding can turn zero into a tiny number.
        let [a, b] = self.range;
        let is_zero = self.scale == Scale::Linear && value.abs() < 1e-9 * (b - a).abs();
        number(if is_zero { 0.0 } else { *value })
    }
}

/// Formats a round number briefly, with a power of ten if it is very large or very small.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e4).contains(&value.abs()) {
        // Tick marks of linear axes are sums with rounding errors in their last digits.
        return format!("{}", (value * 1e6).round() / 1e6);
    }
    let exponent = value.abs().log10().floor();
    let factor = (value / 10_f64.powf(exponent) * 100.0).round() / 100.0;
    let power: String =
        format!("10{exponent}").chars().enumerate().map(|(i, c)| superscript(i, c)).collect();
    if factor == 1.0 { power } else { format!("{factor}·{power}") }
}

/// Turns the `i`-th character of a power of ten into superscript if it belongs to the exponent.
fn superscript(i: usize, c: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    match c.to_digit(10) {
        Some(d) if i > 1 => DIGITS[d as usize],
        None => '⁻',
        _ => c,
    }
}
