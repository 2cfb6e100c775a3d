//! The table of figures.

use super::numbers::{UNKNOWN, count, percent, significant};
use crate::Measured;

/// A column of the table: which figure of a result it shows, and how.
pub(super) struct Column {
    pub(super) heading: &'static str,
    pub(super) unit: &'static str,
    /// Explanation of the figure, shown as a tooltip.
    pub(super) meaning: &'static str,
    /// Whether a smaller figure is better. If not, no figure of the column is highlighted as the
    /// best.
    smaller_is_better: bool,
    /// Whether the column is shown even if no result has the figure.
    always: bool,
    value: fn(&Measured) -> Option<f64>,
    text: fn(f64) -> String,
}

/// A figure in the table.
pub(super) struct Cell {
    pub(super) text: String,
    /// Text by which the table is sorted; empty if the figure is unknown.
    pub(super) key: String,
    pub(super) best: bool,
}

const fn column(
    heading: &'static str,
    unit: &'static str,
    meaning: &'static str,
    value: fn(&Measured) -> Option<f64>,
) -> Column {
    Column {
        heading,
        unit,
        meaning,
        smaller_is_better: true,
        always: true,
        value,
        text: significant,
    }
}

/// The columns for which at least one of these results has a figure, and those that are always
/// shown.
pub(super) fn columns(results: &[&Measured]) -> Vec<Column> {
    // No time is highlighted as the best, because times differ more from run to run than from
    // technique to technique.
    let rare = |c: Column| Column { always: false, ..c };
    let unjudged = |c: Column| Column { smaller_is_better: false, ..c };
    let time = |c: Column| rare(unjudged(c));
    let whole = |c: Column| unjudged(Column { text: |v| count(v as u64), ..c });
    let share = |c: Column| Column { text: percent, ..c };
    let columns = [
        column(
            "Light error",
            "0–1",
            "Mean absolute difference between visibility and truth, weighted by the cosine towards the light",
            |r| r.metrics.light_error,
        ),
        share(column(
            "Wrong",
            "%",
            "Share of counted pixels whose visibility differs from the truth by more than half",
            |r| r.metrics.wrong_fraction,
        )),
        share(column(
            "False light",
            "%",
            "Share of counted pixels that are lit but should be dark",
            |r| r.metrics.false_light,
        )),
        share(column(
            "False shadow",
            "%",
            "Share of counted pixels that are dark but should be lit",
            |r| r.metrics.false_shadow,
        )),
        column(
            "Mean error",
            "0–1",
            "Mean absolute difference between visibility and truth",
            |r| r.metrics.mean_abs_error,
        ),
        column(
            "ꟻLIP",
            "0–1",
            "Difference that a person who flips between both pictures would notice",
            |r| r.metrics.flip,
        ),
        column("p50", "px/texel", "Median of pixels per texel", |r| r.error_px.p50),
        column("p95", "px/texel", "95th percentile of pixels per texel", |r| r.error_px.p95),
        column("max", "px/texel", "Largest number of pixels per texel", |r| r.error_px.max),
        column(
            "Storage",
            "factor",
            "Texels needed per pixel for an error of one pixel per texel",
            |r| r.storage_factor,
        ),
        rare(unjudged(share(column(
            "Culled",
            "%",
            "Share of triangles that need not be drawn into a map",
            |r| r.casters_culled,
        )))),
        rare(share(column(
            "Flicker",
            "%",
            "Mean change of visibility between frames where the truth does not change",
            |r| r.flicker,
        ))),
        rare(column(
            "Noise",
            "0–1",
            "Mean change of a pixel's error between frames, against supersampled truth",
            |r| r.noise,
        )),
        whole(column("Maps", "", "Number of shadow maps, or of pages in use", |r| {
            Some(f64::from(r.maps))
        })),
        unjudged(column("Texels", "million", "Texels of all maps or pages together", |r| {
            Some(r.texels as f64 / 1e6)
        })),
        rare(unjudged(column(
            "Texels used",
            "texels/px",
            "Texels of the pages in use over the pixels counted",
            |r| r.texels_per_pixel,
        ))),
        rare(column(
            "Bound",
            "px/texel",
            "The greatest width of a texel across the light that the pages allowed",
            |r| r.bound_px,
        )),
        rare(unjudged(column("Memory", "MiB", "Memory that lookups read", |r| {
            r.bytes.map(|b| b as f64 / (1024.0 * 1024.0))
        }))),
        time(column("Plan", "ms", "Time to plan the maps", |r| r.ms.plan)),
        time(column("Depth", "ms", "Time to render the maps", |r| r.ms.depth)),
        time(column("Filter", "ms", "Time to filter the maps ahead of lookup", |r| r.ms.filter)),
        time(column("Shade", "ms", "Time to look the maps up for the picture", |r| r.ms.shade)),
        time(column("Total", "ms", "Time of all stages together", |r| r.ms.total())),
    ];
    let has_figures = |c: &Column| c.always || results.iter().any(|r| (c.value)(r).is_some());
    columns.into_iter().filter(has_figures).collect()
}

/// The table's rows. In each column, the best cells are marked.
pub(super) fn rows(columns: &[Column], results: &[Measured]) -> Vec<Vec<Cell>> {
    let mut rows: Vec<Vec<Cell>> = results.iter().map(|_| Vec::new()).collect();
    for column in columns {
        for (row, cell) in rows.iter_mut().zip(column.cells(results)) {
            row.push(cell);
        }
    }
    rows
}

impl Column {
    /// The cells of this column, in the order of the results.
    pub(super) fn cells(&self, results: &[Measured]) -> Vec<Cell> {
        let values: Vec<_> = results.iter().map(self.value).collect();
        cells(&values, self.text, self.smaller_is_better)
    }
}

/// The cells of figures that are compared with each other.
pub(super) fn cells(
    values: &[Option<f64>],
    text: fn(f64) -> String,
    smaller_is_better: bool,
) -> Vec<Cell> {
    let known = || values.iter().flatten().copied().filter(|v| v.is_finite());
    let smallest = known().fold(f64::INFINITY, f64::min);
    let largest = known().fold(f64::NEG_INFINITY, f64::max);
    let ranked = smaller_is_better && smallest < largest;
    let cell = |value: &Option<f64>| match value.filter(|v| v.is_finite()) {
        Some(v) => Cell { text: text(v), key: v.to_string(), best: ranked && v == smallest },
        None => Cell { text: UNKNOWN.to_owned(), key: String::new(), best: false },
    };
    values.iter().map(cell).collect()
}
