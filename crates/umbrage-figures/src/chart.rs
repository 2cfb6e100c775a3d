//! Draws line charts as SVG, and holds the style that all drawings share. Curves have Okabe and
//! Ito's colours and heat maps have viridis; both are safe for the colour-blind. Lines show closed
//! forms, and markers show measured values.

use crate::axis::Axis;
use anyhow::Result;
use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(crate) type Context<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<Axis, Axis>>;

/// Width and height of a line chart in pixels, including the legend's column at its right.
const SIZE: (u32, u32) = (880, 480);
const LEGEND_WIDTH: u32 = 230;
/// Height of the title's strip above a drawing, pixels.
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

/// The viridis colour map, sampled at nine equidistant places.
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

/// A curve of a line chart: a line for the closed form and markers for measured values, in one
/// colour. Either may be empty.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    name: String,
    line: Vec<[f64; 2]>,
    markers: Vec<[f64; 2]>,
    dashed: bool,
    color: Option<usize>,
}

impl Curve {
    /// Creates a curve without points.
    pub(crate) fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            line: Vec::new(),
            markers: Vec::new(),
            dashed: false,
            color: None,
        }
    }

    /// Sets the points of the closed form, which a line joins.
    pub(crate) fn line(self, line: impl IntoIterator<Item = [f64; 2]>) -> Self {
        Self { line: line.into_iter().collect(), ..self }
    }

    /// Sets the measured points, which are drawn as markers.
    pub(crate) fn markers(self, markers: impl IntoIterator<Item = [f64; 2]>) -> Self {
        Self { markers: markers.into_iter().collect(), ..self }
    }

    /// Makes the line dashed.
    pub(crate) fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }

    /// Sets the i-th colour. The default colour follows from the curve's index in the chart.
    pub(crate) fn color(self, i: usize) -> Self {
        Self { color: Some(i), ..self }
    }
}

/// A chart of several curves, with a legend beside it.
#[derive(Clone, Debug)]
pub(crate) struct LineChart {
    /// Title above the chart.
    pub(crate) title: String,
    /// Horizontal axis.
    pub(crate) x: Axis,
    /// Vertical axis.
    pub(crate) y: Axis,
    /// Curves, in the order of the legend.
    pub(crate) curves: Vec<Curve>,
    /// Notes inside the chart, each with the point (x, y) at which its text is centred.
    pub(crate) notes: Vec<([f64; 2], String)>,
}

impl LineChart {
    /// Draws the chart, and returns the SVG's text.
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
            // Markers outside the plot could be drawn over the legend.
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

/// The marker of the i-th curve. Shapes alternate, so that markers can be told apart in grey.
fn marker<'a>(i: usize, color: RGBColor) -> DynElement<'static, SVGBackend<'a>, (i32, i32)> {
    match i % 3 {
        0 => Circle::new((0, 0), 4, color.filled()).into_dyn(),
        1 => TriangleMarker::new((0, 0), 6, color.filled()).into_dyn(),
        _ => Cross::new((0, 0), 4, color.stroke_width(2)).into_dyn(),
    }
}

/// The viridis colour for a value of 0 to 1. Values outside are clamped.
pub(crate) fn viridis(share: f64) -> RGBColor {
    let at = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let i = (at as usize).min(VIRIDIS.len() - 2);
    let mix = |a: u8, b: u8| {
        (f64::from(a) + (f64::from(b) - f64::from(a)) * (at - i as f64)).round() as u8
    };
    let (a, b) = (VIRIDIS[i], VIRIDIS[i + 1]);
    RGBColor(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

/// The style of black text of this size, pixels.
pub(crate) fn text(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_text_style(&(1, 1)).color(&BLACK)
}

/// Creates an SVG with a title, below which `content` draws.
pub(crate) fn draw(
    size: (u32, u32),
    title: &str,
    content: impl FnOnce(&Area<'_>) -> Result<()>,
) -> Result<String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        // The background is white, so that the drawing is legible on dark pages too.
        area.fill(&WHITE)?;
        area.draw(&Text::new(title.to_owned(), (12, 10), text(17)))?;
        content(&area.margin(TITLE_HEIGHT, 0, 0, 0))?;
        area.present()?;
    }
    Ok(svg)
}

/// Draws a frame with axes, with about `marks_x` and `marks_y` tick marks.
pub(crate) fn axes<'a, 'b>(
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
