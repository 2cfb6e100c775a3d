//! Draws heat maps as SVG, in the same style as [charts](crate::chart).

use crate::axis::Axis;
use crate::chart::{Area, TITLE_HEIGHT, axes, draw, text, viridis};
use anyhow::Result;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use rayon::prelude::*;

/// Width of the column for the colour bar, pixels.
const COLOR_BAR_WIDTH: u32 = 110;

/// One heat map in a drawing of several.
#[derive(Clone, Debug)]
pub(crate) struct Panel {
    /// Text above the panel.
    pub(crate) title: String,
    /// Horizontal axis.
    pub(crate) x: Axis,
    /// Vertical axis.
    pub(crate) y: Axis,
    /// Number of cells along x.
    pub(crate) columns: usize,
    /// Values of the cells, row by row from the lowest x and y. Cells with NaN stay blank.
    pub(crate) values: Vec<f64>,
}

impl Panel {
    /// Evaluates `value` at the centres of `columns` × `rows` cells.
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

    /// The centre (x, y) of the i-th cell.
    fn middle(&self, i: usize, rows: usize) -> [f64; 2] {
        let middle = |axis: &Axis, i: usize, n: usize| axis.at((i as f64 + 0.5) / n as f64);
        [middle(&self.x, i % self.columns, self.columns), middle(&self.y, i / self.columns, rows)]
    }

    /// The centre (x, y) and the value of every cell, row by row.
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

/// Panels side by side that share one colour bar.
#[derive(Clone, Debug)]
pub(crate) struct HeatMaps {
    /// Title of the whole drawing.
    pub(crate) title: String,
    /// Panels, row by row from the upper left.
    pub(crate) panels: Vec<Panel>,
    /// Number of panels in a row.
    pub(crate) columns: usize,
    /// Width and height of a panel with its axes, pixels.
    pub(crate) panel_size: [u32; 2],
    /// Scale of the colours. Values outside its range take the colour of the nearer end.
    pub(crate) color: Axis,
}

impl HeatMaps {
    /// Draws the panels and the colour bar, and returns the SVG's text.
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
