//! The table of times and ratios.

use crate::Times;

/// The jobs that a row of the table is about, by their indices.
pub(crate) struct Jobs {
    pub(crate) name: String,
    /// Frames with the technique.
    pub(crate) frame: usize,
    /// Bare frames with the same filter, if there are any.
    pub(crate) bare: Option<usize>,
    /// Bare depth passes over the technique's own maps.
    pub(crate) bare_depth: Option<usize>,
}

const TIMES: [&str; 6] = ["plan", "depth", "filter", "lookup", "cost", "frame"];
const RATIOS: [&str; 5] = ["lookup/bare", "frame/bare", "frame/none", "depth/bare", "cost/depth"];

/// The medians of one view, milliseconds, and the ratios between them. Ratios of times that are not
/// measured, or not above 0, are `None`.
pub(crate) struct Table {
    rows: Vec<Row>,
}

struct Row {
    name: String,
    times: [f64; TIMES.len()],
    ratios: [Option<f64>; RATIOS.len()],
}

impl Table {
    /// Makes the table from the times of all frames, by frame and job. `none` is the job that draws
    /// frames without shadows.
    pub(crate) fn new(frames: &[Vec<Times>], none: usize, rows: Vec<Jobs>) -> Self {
        let median = |value: &dyn Fn(&[Times]) -> f64| {
            let mut values: Vec<f64> = frames.iter().map(|times| value(times)).collect();
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        };
        // What all frames of a turn have in common cancels in the difference.
        let lookup = |times: &[Times], job: usize| times[job].shade - times[none].shade;
        let maps = |t: Times| t.plan + t.depth + t.filter;
        let lookup_of = |job| median(&|times| lookup(times, job));
        let frame_of = |job: usize| median(&|times| maps(times[job]) + times[job].shade);
        let ratio = |a: f64, b: f64| (a > 0.0 && b > 0.0).then_some(a / b);
        let rows = rows.into_iter().map(|Jobs { name, frame: job, bare, bare_depth }| {
            let depth = median(&|times| times[job].depth);
            let cost = median(&|times| maps(times[job]) + lookup(times, job));
            let bare_depth = bare_depth.map(|job| median(&|times| times[job].depth));
            let times = [
                median(&|times| times[job].plan),
                depth,
                median(&|times| times[job].filter),
                lookup_of(job),
                cost,
                frame_of(job),
            ];
            let ratios = [
                bare.and_then(|bare| ratio(lookup_of(job), lookup_of(bare))),
                bare.and_then(|bare| ratio(frame_of(job), frame_of(bare))),
                ratio(frame_of(job), median(&|times| times[none].shade)),
                bare_depth.and_then(|bare| ratio(depth, bare)),
                bare_depth.and_then(|bare| ratio(cost, bare)),
            ];
            Row { name, times, ratios }
        });
        Self { rows: rows.collect() }
    }

    /// The table as text, without a line break at its end.
    pub(crate) fn text(&self) -> String {
        let mut text = head(&[&TIMES[..], &RATIOS[..]].concat());
        for Row { name, times, ratios } in &self.rows {
            let times = times.map(|t| format!("{t:.3}"));
            text += &line(name, times.into_iter().chain(ratios.map(cell)));
        }
        text.trim_end().to_owned()
    }
}

/// The geometric means of each technique's ratios over several views, as text. Views in which a
/// ratio has no value are left out of its mean.
pub(crate) fn means(tables: &[Table]) -> String {
    let mut text = head(&RATIOS);
    for Row { name, .. } in tables.first().map_or(&[][..], |table| &table.rows) {
        let mean = |column: usize| {
            let ratio = |table: &Table| {
                table.rows.iter().find(|row| row.name == *name)?.ratios[column].map(f64::ln)
            };
            let logarithms: Vec<f64> = tables.iter().filter_map(ratio).collect();
            let sum: f64 = logarithms.iter().sum();
            (!logarithms.is_empty()).then(|| (sum / logarithms.len() as f64).exp())
        };
        text += &line(name, (0..RATIOS.len()).map(mean).map(cell));
    }
    text.trim_end().to_owned()
}

fn head(columns: &[&str]) -> String {
    line("", columns.iter().map(|&column| column.to_owned()))
}

fn cell(ratio: Option<f64>) -> String {
    ratio.map_or("-".to_owned(), |r| format!("{r:.3}"))
}

fn line(name: &str, cells: impl Iterator<Item = String>) -> String {
    let cells: String = cells.map(|cell| format!(" {cell:>11}")).collect();
    format!("{name:<25}{cells}\n")
}
