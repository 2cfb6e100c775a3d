//! Numbers that a control offers for a value of the language.

use super::language::Short;

/// Numbers that a control offers for a value, in one unit. All of them are valid, but a text may
/// have others, too: a slider up to infinity would be of no use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The unit, which follows the number without a space: `px`. Empty for numbers without one.
    pub unit: &'static str,
    /// The smallest number.
    pub min: f64,
    /// The largest number.
    pub max: f64,
    /// The numbers are this far apart, from `min` on; 0 if there are others between any two.
    pub step: f64,
    /// Whether equal ways along a slider are equal ratios, not equal differences.
    pub is_logarithmic: bool,
}

impl Scale {
    pub(super) const fn even(min: f64, max: f64) -> Self {
        Self { unit: "", min, max, step: 0.0, is_logarithmic: false }
    }

    pub(super) const fn whole(min: f64, max: f64) -> Self {
        Self { step: 1.0, ..Self::even(min, max) }
    }

    pub(super) const fn ratios(unit: &'static str, min: f64, max: f64) -> Self {
        Self { unit, is_logarithmic: true, ..Self::even(min, max) }
    }

    /// The number as a text has it, with its unit: moved into the scale and onto its steps, or to
    /// four digits where there are none. What is not a number becomes the smallest one.
    pub fn text(&self, number: f64) -> String {
        let inside = number.max(self.min).min(self.max);
        let digits = match self.step {
            // Whole numbers are not valid with an exponent.
            step if step > 0.0 => {
                (self.min + ((inside - self.min) / step).round() * step).to_string()
            }
            _ => {
                let rounded: f64 = format!("{inside:.3e}").parse().unwrap_or(inside);
                Short(rounded.clamp(self.min, self.max)).to_string()
            }
        };
        digits + self.unit
    }

    /// The number that a text gives in this unit; `None` if it has another one.
    pub fn number(&self, text: &str) -> Option<f64> {
        let digits = text.strip_suffix(self.unit)?;
        digits.parse().ok().filter(|n: &f64| n.is_finite())
    }
}
