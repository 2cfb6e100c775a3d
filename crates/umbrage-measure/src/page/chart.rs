//! The overview chart, and the legend of the error maps, which is the chart's axis.

use super::numbers::{percent, power_of_two, significant};
use crate::color::color_at;
use crate::{ErrorScale, Measured, Report};
use std::fmt::Write;

/// A tick of the scale of pixels per texel.
pub(crate) struct Tick {
    /// Distance from the left end, percent of the scale.
    pub(crate) at: f32,
    pub(crate) label: String,
    /// Whether this tick marks 1 pixel per texel.
    pub(crate) one: bool,
}

/// The line of one technique in the chart.
pub(super) struct Line {
    /// Widths of the two bars, percent of the track.
    pub(super) false_light: f64,
    pub(super) false_shadow: f64,
    /// The text beside the bars.
    pub(super) wrong_text: String,
    pub(super) range: Option<Range>,
}

/// Median, 95th percentile and maximum of pixels per texel: distances from the left end of the
/// scale, in percent.
pub(super) struct Range {
    pub(super) p50: f32,
    pub(super) p95: f32,
    pub(super) max: f32,
    /// Whether the maximum lies beyond the end of the scale.
    pub(super) beyond: bool,
    pub(super) text: String,
}

/// The colours of the scale from left to right, as the stops of a CSS gradient.
pub(super) fn gradient() -> String {
    let mut css = "linear-gradient(to right".to_owned();
    for i in 0..=32 {
        let [r, g, b] = color_at(i as f32 / 16.0 - 1.0);
        // Writing to a string cannot fail.
        let _ = write!(css, ",#{r:02x}{g:02x}{b:02x}");
    }
    css + ")"
}

/// About seven powers of two. 1 is one of them, and so are the ends of the scale if they are
/// powers.
pub(crate) fn ticks(scale: ErrorScale) -> Vec<Tick> {
    let largest = scale.max().log2().floor() as i32;
    let step = (largest + 1) / 3;
    let outer = (0..).map(|i| largest - i * step.max(1)).take_while(|&e| e > 0);
    let mut exponents: Vec<i32> = outer.flat_map(|e| [e, -e]).chain([0]).collect();
    exponents.sort_unstable();
    let tick = |&e: &i32| Tick {
        at: percent_from_left(scale, 2_f64.powi(e)),
        label: power_of_two(e),
        one: e == 0,
    };
    exponents.iter().map(tick).collect()
}

/// The lines of the results, in the order of the results.
pub(super) fn lines(report: &Report, scale: ErrorScale) -> Vec<Line> {
    let wrong = report.results.iter().filter_map(|r| r.metrics.wrong_fraction);
    let widest = wrong.fold(0.0, f64::max);
    report.results.iter().map(|r| line(r, widest, scale)).collect()
}

fn line(result: &Measured, widest: f64, scale: ErrorScale) -> Line {
    let m = &result.metrics;
    let width = |share: Option<f64>| match share {
        Some(share) if widest > 0.0 => share / widest * 100.0,
        _ => 0.0,
    };
    let e = &result.error_px;
    let range = match (e.p50, e.p95, e.max) {
        (Some(p50), Some(p95), Some(max)) => Some(Range {
            p50: percent_from_left(scale, p50),
            p95: percent_from_left(scale, p95),
            max: percent_from_left(scale, max),
            beyond: max > f64::from(scale.max()),
            text: format!(
                "median {}, 95 % below {}, largest {} pixels per texel",
                significant(p50),
                significant(p95),
                significant(max)
            ),
        }),
        _ => None,
    };
    Line {
        false_light: width(m.false_light),
        false_shadow: width(m.false_shadow),
        wrong_text: m.wrong_fraction.map_or("nothing to measure".to_owned(), |w| percent(w) + " %"),
        range,
    }
}

fn percent_from_left(scale: ErrorScale, error_px: f64) -> f32 {
    // The error is never NaN, because the figures of a report come from finite errors. If it were,
    // the mark would stand in the middle of the scale.
    50.0 + 50.0 * scale.position(error_px as f32).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_mark_one_and_both_ends() {
        let labels = |max| -> Vec<String> {
            ticks(ErrorScale::new(max).unwrap()).into_iter().map(|t| t.label).collect()
        };
        assert_eq!(labels(32.0), ["1/32", "1/8", "1/2", "1", "2", "8", "32"]);
        assert_eq!(labels(1.5), ["1"]);
        assert_eq!(labels(2.0), ["1/2", "1", "2"]);
        for max in [3.0, 64.0, 1000.0, 1e6] {
            let ticks = ticks(ErrorScale::new(max).unwrap());
            assert!(ticks.len() <= 9, "{max}: {}", ticks.len());
            assert!(ticks.windows(2).all(|w| w[0].at < w[1].at));
            assert!(ticks.iter().all(|t| (0.0..=100.0).contains(&t.at)));
            assert!(ticks.iter().all(|t| t.one == (t.at == 50.0)));
        }
    }
}
