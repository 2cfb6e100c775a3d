//! Figure 7 of Lloyd, Tuft, Yoon and Manocha 2006: the storage factor for every light direction
//! from above the horizon.

use crate::axis::Axis;
use crate::chart::{Curve, LineChart};
use crate::figure::{Figure, File};
use crate::heat::{HeatMaps, Panel};
use crate::measured::from_behind;
use crate::schemes::{Scheme, paper_view};
use crate::table::{Cell, Table};
use anyhow::Result;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;
use umbrage::Faces;
use umbrage::theory::{LightFrom, View};

/// Makes Fig. 7: the storage factor over the hemisphere of light directions.
pub(crate) fn fig7() -> Result<Figure> {
    let view = paper_view(1000.0)?;
    let schemes = [
        Scheme::new("No warp", 1, false, false),
        Scheme::new("W: warp (LiSPSM)", 1, true, false),
        Scheme::adaptive("W: warp (adaptive)"),
        Scheme::new("FP+W: faces, warp", 1, true, true),
        Scheme::new("ZP: 4 slices", 4, false, false),
        Scheme::new("ZP+W: 4 slices, warp", 4, true, false),
        Scheme::new("FP+ZP+W: faces, 4 slices, warp", 4, true, true),
    ];
    let (sky, worst, maps) = hemisphere(view, &schemes)?;
    let (section, chart) = section(view, &schemes)?;
    Ok(Figure {
        name: "wp-fig7",
        title: "Every light above the viewer".to_owned(),
        source: "Lloyd, Tuft, Yoon and Manocha 2006, Figure 7",
        text: "How many texels a pixel it takes to be right everywhere, for every direction that light may come from: in \
               the middle of a disc it comes from overhead, at its left rim from behind the viewer, at \
               its right from ahead. A warp saves a factor of a thousand overhead and nothing where the light looks along the \
               view and sees a square. Cut into its side faces, the view has something to warp there too, and \
               slices along the view help everywhere. The paper found that the worst light of all needs two to three times what it \
               needs from behind. The table says so too, but not of LiSPSM’s rule for λ in a single map: as light \
               and view close in on each other, it warps too much, and for an even map’s error it needs many times an even map’s \
               texels before it gives up at the very rim. The adaptive warp, which the paper does not know, never needs \
               more than an even map. The section is measured on planned maps and, where there is one, drawn from \
               the closed form: for whole views in light in the plane of the view, for faces overhead and from behind alone."
            .to_owned(),
        files: vec![
            File::svg("", "Storage factor over the hemisphere of light directions for seven schemes", maps),
            File::svg("section", "The same along the plane of the view, with closed forms", chart),
            File::csv("", "one row for each scheme and light: degrees from overhead, forwards and to the right", sky)?,
            File::csv("section", "one row for each scheme and angle", section)?,
            File::shown_csv("worst", "storage overhead, behind and from the worst of all directions, measured", worst)?,
        ],
    })
}

/// Measures all light directions. Returns a table of all, a table of the worst, and heat maps.
fn hemisphere(view: View, schemes: &[Scheme]) -> Result<(Table, Table, String)> {
    const CELLS: usize = 61;
    let mut sky = Table::new(&["scheme", "forward_deg", "right_deg", "storage_factor_measured"])?;
    let mut worst = Table::new(&["scheme", "overhead", "behind", "worst", "worst_over_behind"])?;
    let mut panels = Vec::new();
    for scheme in schemes {
        let axes = ["behind – in front, degrees", "left – right, degrees"];
        let axes = axes.map(|label| Axis::linear(label, [-90.0, 90.0]));
        let panel = Panel::new(scheme.name, axes, [CELLS; 2], |forward, right| {
            from_sky(forward, right).map_or(Ok(f64::NAN), |light| scheme.measured(view, light))
        })?;
        for (forward, right, storage) in panel.cells().filter(|(_, _, s)| s.is_finite()) {
            sky.row(&[Cell::from(scheme.name), forward.into(), right.into(), storage.into()])?;
        }
        let [overhead, behind] =
            [FRAC_PI_2, 0.0].map(|theta| scheme.measured(view, from_behind(theta)));
        let (overhead, behind) = (overhead?, behind?);
        let most = panel.cells().map(|(_, _, s)| s).fold(0.0, f64::max);
        worst.row(&[
            Cell::from(scheme.name),
            overhead.into(),
            behind.into(),
            most.into(),
            (most / behind).into(),
        ])?;
        panels.push(panel);
    }
    let maps = HeatMaps {
        title: "Storage factor over all lights above the viewer (f/n = 1000, φ = 30°)".to_owned(),
        panels,
        columns: 4,
        panel_size: [270, 264],
        color: Axis::log("S̄, texels per pixel", [10.0, 1e7]),
    };
    Ok((sky, worst, maps.svg()?))
}

/// Computes closed forms and measurements for light directions in the plane x = 0, which contains
/// the view direction and the zenith. Returns a table and a chart.
fn section(view: View, schemes: &[Scheme]) -> Result<(Table, String)> {
    let mut section =
        Table::new(&["scheme", "forward_deg", "storage_factor", "storage_factor_measured"])?;
    let mut curves = Vec::new();
    for scheme in schemes {
        let along: Vec<f64> = (-90..=90).map(f64::from).collect();
        let rows: Vec<[f64; 3]> = along
            .par_iter()
            .map(|&forward| {
                let theta = (90.0 + forward).to_radians().clamp(0.0, std::f64::consts::PI);
                let light = match forward {
                    0.0 => LightFrom::Overhead,
                    _ if forward.abs() == 90.0 => LightFrom::Behind,
                    _ => LightFrom::Angle(theta),
                };
                let formula = match scheme.has_formula(view, light) {
                    true => scheme.formula(view, light)?,
                    false => f64::NAN,
                };
                let direction = from_sky(forward, 0.0).unwrap_or(DVec3::NEG_Y);
                Ok([forward, formula, scheme.measured(view, direction)?])
            })
            .collect::<Result<_>>()?;
        for &[forward, formula, found] in &rows {
            section.row(&[
                Cell::from(scheme.name),
                forward.into(),
                formula.into(),
                found.into(),
            ])?;
        }
        // Faces have formulas only for light from overhead and from behind. A line between these
        // would not be a closed form, so none is drawn.
        let line = rows
            .iter()
            .map(|&[x, formula, _]| [x, formula])
            .filter(|[_, y]| y.is_finite() && scheme.faces == Faces::Whole);
        let markers = rows.iter().step_by(6).map(|&[x, _, found]| [x, found]);
        curves.push(Curve::new(scheme.name).line(line).markers(markers));
    }
    let chart = LineChart {
        title: "Its section from behind over the zenith to the front".to_owned(),
        x: Axis::linear(
            "light’s angle from overhead, degrees: −90 behind the viewer, 90 in front",
            [-90.0, 90.0],
        ),
        y: Axis::log("S̄, texels per pixel", [10.0, 3e7]),
        curves,
        notes: Vec::new(),
    };
    Ok((section, chart.svg()?))
}

/// The light direction for a light that stands `forward_deg` to the front and `right_deg` to the
/// right of the zenith; `None` below the horizon.
fn from_sky(forward_deg: f64, right_deg: f64) -> Option<DVec3> {
    let from_zenith = forward_deg.hypot(right_deg);
    // The tolerance keeps directions on the horizon, which rounding may put below it.
    if from_zenith > 90.0 + 1e-9 {
        return None;
    }
    if from_zenith == 0.0 {
        return Some(DVec3::NEG_Y);
    }
    let (sin, cos) = from_zenith.to_radians().sin_cos();
    let side = sin / from_zenith;
    let height = if from_zenith == 90.0 { 0.0 } else { cos };
    Some(-DVec3::new(right_deg * side, height, -forward_deg * side))
}
