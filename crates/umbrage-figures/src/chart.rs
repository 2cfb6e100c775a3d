//! Line charts and heat maps as SVG, all in one style: Okabe and Ito's colours for curves, viridis for
//! fields, both safe for the colour-blind; lines for closed forms, markers for what was measured.

use anyhow::Result;
use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use rayon::prelude::*;
use std::ops::Range;

pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Context<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<Axis, Axis>>;

/// Size of a line chart, pixels, the legend's column at its right included.
const SIZE: (u32, u32) = (880, 480);
const LEGEND_WIDTH: u32 = 230;
const COLOR_BAR_WIDTH: u32 = 110;
/// Height of the title above what is drawn, pixels.
pub(crate) const TITLE_HEIGHT: u32 = 34;

/// Okabe and Ito's palette without its yellow, which is faint on white.
pub(crate) const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// Viridis at nine even steps.
const VIRIDIS: [RGBColor; 9] = [
    RGBColor(68, 1, 84),
    RGBColor(71, 44, 122),
    RGBColor(59, 81, 139),
    RGBColor(44, 113, 142),
    RGBColor(33, 144, 141),
    RGBColor(39, 173, 129),
    RGBColor(92, 200, 99),
    RGBColor(170, 220, 50),
    RGBColor(253, 231, 37),
];

/// How numbers are laid out along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scale {
    Linear,
    Log,
}

/// An axis, or a colour bar.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    label: String,
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
    fn share(&self, value: f64) -> f64 {
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

/// One colour of a line chart: a line for the closed form, markers for what was measured, either may
/// be empty.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    name: String,
    line: Vec<[f64; 2]>,
    markers: Vec<[f64; 2]>,
    dashed: bool,
    color: Option<usize>,
}

impl Curve {
    /// Without points.
    pub(crate) fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            line: Vec::new(),
            markers: Vec::new(),
            dashed: false,
            color: None,
        }
    }

    /// With the closed form's points, joined by a line.
    pub(crate) fn line(self, line: impl IntoIterator<Item = [f64; 2]>) -> Self {
        Self { line: line.into_iter().collect(), ..self }
    }

    /// With measured points, each a marker.
    pub(crate) fn markers(self, markers: impl IntoIterator<Item = [f64; 2]>) -> Self {
        Self { markers: markers.into_iter().collect(), ..self }
    }

    /// With a dashed line.
    pub(crate) fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }

    /// In the i-th colour, not that of its place in the chart.
    pub(crate) fn color(self, i: usize) -> Self {
        Self { color: Some(i), ..self }
    }
}

/// A chart of curves with a legend beside it.
#[derive(Clone, Debug)]
pub(crate) struct LineChart {
    /// What is shown, and of what.
    pub(crate) title: String,
    /// To the right.
    pub(crate) x: Axis,
    /// Upwards.
    pub(crate) y: Axis,
    /// In the legend's order.
    pub(crate) curves: Vec<Curve>,
    /// Words in the chart, each in the middle of a place.
    pub(crate) notes: Vec<([f64; 2], String)>,
}

impl LineChart {
    /// The SVG's text.
    pub(crate) fn svg(&self) -> Result<String> {
        draw(SIZE, &self.title, |area| {
            let (plot, legend) = area.split_horizontally(SIZE.0 - LEGEND_WIDTH);
            let mut chart = axes(&plot, &self.x, &self.y, [8, 8])?;
            for (i, curve) in self.curves.iter().enumerate() {
                self.draw_curve(&mut chart, i, curve)?;
            }
            for (at, words) in &self.notes {
                let style = text(13).pos(Pos::new(HPos::Center, VPos::Center));
                chart.draw_series([Text::new(words.clone(), (at[0], at[1]), style)])?;
            }
            self.draw_legend(&legend)
        })
    }

    fn color(&self, i: usize) -> RGBColor {
        COLORS[self.curves[i].color.unwrap_or(i) % COLORS.len()]
    }

    fn draw_curve(&self, chart: &mut Context<'_, '_>, i: usize, curve: &Curve) -> Result<()> {
        let color = self.color(i);
        let points = curve.line.iter().map(|&[x, y]| (x, y));
        if curve.dashed {
            chart.draw_series(DashedLineSeries::new(points, 7, 5, color.stroke_width(2)))?;
        } else {
            chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?;
        }
        for &[x, y] in &curve.markers {
            // What lies outside would be drawn over the legend.
            if [self.x.share(x), self.y.share(y)].iter().all(|s| (-0.01..=1.01).contains(s)) {
                chart.draw_series([EmptyElement::at((x, y)) + marker(i, color)])?;
            }
        }
        Ok(())
    }

    fn draw_legend(&self, area: &Area<'_>) -> Result<()> {
        let mut y = 24;
        for (i, curve) in self.curves.iter().enumerate() {
            let color = self.color(i);
            let sample = [(4, y), (32, y)];
            if curve.dashed {
                area.draw(&PathElement::new([(4, y), (14, y)], color.stroke_width(2)))?;
                area.draw(&PathElement::new([(22, y), (32, y)], color.stroke_width(2)))?;
            } else if !curve.line.is_empty() {
                area.draw(&PathElement::new(sample, color.stroke_width(2)))?;
            }
            if !curve.markers.is_empty() {
                area.draw(&(EmptyElement::at((18, y)) + marker(i, color)))?;
            }
            let style = text(14).pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(curve.name.clone(), (40, y), style))?;
            y += 24;
        }
        let has =
            |points: fn(&Curve) -> &[[f64; 2]]| self.curves.iter().any(|c| !points(c).is_empty());
        if has(|c| &c.line) && has(|c| &c.markers) {
            for words in ["lines: closed form", "markers: measured"] {
                y += 6;
                let style = text(12).pos(Pos::new(HPos::Left, VPos::Center));
                area.draw(&Text::new(words, (4, y), style))?;
                y += 12;
            }
        }
        Ok(())
    }
}

/// The i-th curve's marker; shapes differ, so that they can be told apart in grey.
fn marker<'a>(i: usize, color: RGBColor) -> DynElement<'static, SVGBackend<'a>, (i32, i32)> {
    match i % 3 {
        0 => Circle::new((0, 0), 4, color.filled()).into_dyn(),
        1 => TriangleMarker::new((0, 0), 6, color.filled()).into_dyn(),
        _ => Cross::new((0, 0), 4, color.stroke_width(2)).into_dyn(),
    }
}

/// One field of a picture of heat maps.
#[derive(Clone, Debug)]
pub(crate) struct Panel {
    /// What is shown.
    pub(crate) title: String,
    /// To the right.
    pub(crate) x: Axis,
    /// Upwards.
    pub(crate) y: Axis,
    /// Cells along x.
    pub(crate) columns: usize,
    /// Of the cells, row by row from the lowest x and y; NaN where there is nothing.
    pub(crate) values: Vec<f64>,
}

impl Panel {
    /// A field at the middles of `columns` × `rows` cells.
    pub(crate) fn new(
        title: impl Into<String>,
        [x, y]: [Axis; 2],
        [columns, rows]: [usize; 2],
        value: impl Fn(f64, f64) -> Result<f64> + Sync,
    ) -> Result<Self> {
        let places = (0..rows * columns).into_par_iter();
        let mut panel = Self { title: title.into(), x, y, columns, values: Vec::new() };
        let value = |i| {
            let [x, y] = panel.middle(i, rows);
            value(x, y)
        };
        panel.values = places.map(value).collect::<Result<_>>()?;
        Ok(panel)
    }

    /// The middle of the i-th cell.
    fn middle(&self, i: usize, rows: usize) -> [f64; 2] {
        let middle = |axis: &Axis, i: usize, n: usize| axis.at((i as f64 + 0.5) / n as f64);
        [middle(&self.x, i % self.columns, self.columns), middle(&self.y, i / self.columns, rows)]
    }

    /// x, y and value of every cell, row by row.
    pub(crate) fn cells(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let rows = self.values.len() / self.columns;
        self.values.iter().enumerate().map(move |(i, &value)| {
            let [x, y] = self.middle(i, rows);
            (x, y, value)
        })
    }

    fn draw(&self, area: &Area<'_>, color: &Axis) -> Result<()> {
        let title = text(15).pos(Pos::new(HPos::Center, VPos::Top));
        let (width, _) = area.dim_in_pixel();
        area.draw(&Text::new(self.title.clone(), (width as i32 / 2 + 20, 2), title))?;
        let area = area.margin(18, 0, 0, 0);
        let mut chart = axes(&area, &self.x, &self.y, [5, 5])?;
        let rows = self.values.len() / self.columns;
        let edge = |axis: &Axis, i: usize, n: usize| axis.at(i as f64 / n as f64);
        let cells = self.values.iter().enumerate().filter(|(_, v)| !v.is_nan()).map(|(i, &v)| {
            let [column, row] = [i % self.columns, i / self.columns];
            let corner = |i: usize, j: usize| {
                (edge(&self.x, column + i, self.columns), edge(&self.y, row + j, rows))
            };
            Rectangle::new([corner(0, 1), corner(1, 0)], viridis(color.share(v)).filled())
        });
        chart.draw_series(cells)?;
        Ok(())
    }
}

/// Fields side by side that share a colour bar.
#[derive(Clone, Debug)]
pub(crate) struct HeatMaps {
    /// What is shown, and of what.
    pub(crate) title: String,
    /// Row by row from the upper left.
    pub(crate) panels: Vec<Panel>,
    /// Panels in a row.
    pub(crate) columns: usize,
    /// Size of a panel with its axes, pixels.
    pub(crate) panel_size: [u32; 2],
    /// What the colours mean; values beyond have the colour of the nearer end.
    pub(crate) color: Axis,
}

impl HeatMaps {
    /// The SVG's text.
    pub(crate) fn svg(&self) -> Result<String> {
        let [width, height] = self.panel_size;
        let rows = self.panels.len().div_ceil(self.columns);
        let size =
            (width * self.columns as u32 + COLOR_BAR_WIDTH, height * rows as u32 + TITLE_HEIGHT);
        draw(size, &self.title, |area| {
            let (fields, bar) = area.split_horizontally(size.0 - COLOR_BAR_WIDTH);
            for (panel, area) in self.panels.iter().zip(fields.split_evenly((rows, self.columns))) {
                panel.draw(&area, &self.color)?;
            }
            let (bar, _) = bar.split_vertically(height.max(240).min(size.1 - TITLE_HEIGHT));
            self.draw_bar(&bar)
        })
    }

    fn draw_bar(&self, area: &Area<'_>) -> Result<()> {
        const STEPS: usize = 64;
        let bar = Axis::linear("", [0.0, 1.0]);
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .margin_right(30)
            .margin_top(22)
            .set_label_area_size(LabelAreaPosition::Left, 56)
            .build_cartesian_2d(bar, self.color.clone())?;
        chart.draw_series((0..STEPS).map(|i| {
            let [from, to] = [i, i + 1].map(|i| i as f64 / STEPS as f64);
            let cell = [(0.0, self.color.at(to)), (1.0, self.color.at(from))];
            Rectangle::new(cell, viridis((from + to) / 2.0).filled())
        }))?;
        chart
            .configure_mesh()
            .disable_mesh()
            .x_labels(0)
            .y_labels(8)
            .y_desc(self.color.label.clone())
            .y_label_style(text(12))
            .axis_desc_style(text(13))
            .set_all_tick_mark_size(5)
            .draw()?;
        Ok(())
    }
}

/// The colour of a share of 0 to 1.
pub(crate) fn viridis(share: f64) -> RGBColor {
    let at = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let i = (at as usize).min(VIRIDIS.len() - 2);
    let mix = |a: u8, b: u8| {
        (f64::from(a) + (f64::from(b) - f64::from(a)) * (at - i as f64)).round() as u8
    };
    let (a, b) = (VIRIDIS[i], VIRIDIS[i + 1]);
    RGBColor(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

/// Black words of this size, pixels.
pub(crate) fn text(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_text_style(&(1, 1)).color(&BLACK)
}

/// An SVG with a title, drawn below it.
pub(crate) fn draw(
    size: (u32, u32),
    title: &str,
    content: impl FnOnce(&Area<'_>) -> Result<()>,
) -> Result<String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        // Dark pages show pictures too.
        area.fill(&WHITE)?;
        area.draw(&Text::new(title.to_owned(), (12, 10), text(17)))?;
        content(&area.margin(TITLE_HEIGHT, 0, 0, 0))?;
        area.present()?;
    }
    Ok(svg)
}

/// A frame with axes, about so many marks on each.
fn axes<'a, 'b>(
    area: &Area<'a>,
    x: &Axis,
    y: &Axis,
    [marks_x, marks_y]: [usize; 2],
) -> Result<Context<'a, 'b>> {
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(16)
        .set_label_area_size(LabelAreaPosition::Left, 58)
        .set_label_area_size(LabelAreaPosition::Bottom, 42)
        .build_cartesian_2d(x.clone(), y.clone())?;
    chart
        .configure_mesh()
        .x_labels(marks_x)
        .y_labels(marks_y)
        .x_desc(x.label.clone())
        .y_desc(y.label.clone())
        .bold_line_style(BLACK.mix(0.15))
        .light_line_style(TRANSPARENT)
        .label_style(text(13))
        .axis_desc_style(text(14))
        .draw()?;
    Ok(chart)
}
