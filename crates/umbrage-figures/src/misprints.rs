//! Compares formulas that the papers misprint: the value as printed, corrected, and measured.

use crate::figure::{Figure, File};
use crate::planned::Planned;
use crate::table::{Cell, Table};
use crate::{chart, measured};
use anyhow::Result;
use glam::DVec2;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6, PI};
use umbrage::Warp;
use umbrage::theory::{FourierStep, Overhead, Tilted, View};

/// One misprinted formula with its values in one example.
struct Misprint {
    place: &'static str,
    quantity: &'static str,
    printed: f64,
    corrected: f64,
    measured: f64,
}

/// Makes the figure and the table of all misprints.
pub(crate) fn misprints() -> Result<Figure> {
    let found = found()?;
    let mut table = Table::new(&["place", "quantity", "value_printed", "value", "value_measured"])?;
    for m in &found {
        table.row(&[
            Cell::from(m.place),
            m.quantity.into(),
            m.printed.into(),
            m.corrected.into(),
            m.measured.into(),
        ])?;
    }
    Ok(Figure {
        name: "misprints",
        title: "What the papers print wrong".into(),
        source: "all four papers",
        text: "Every formula that cannot be taken from its paper as it stands, for one example each (n = 2 m, f = 200 m, φ = 30°; \
               n is not 1, for two of the slips vanish there). Lloyd et al. divide a pixel's width by n in Eq. 2, \
               which makes a length of what should be a ratio; the n that this takes away is missing again in Eq. 9. Zhang et al. print W's half \
               field of view for light overhead only, with which a tilted W cuts off V's far upper corners, and a factor F_p \
               that is too large on either side of θ = φ; and the smallest E_p is not always at the far plane. Annen et al. say \
               that f is 0 where d > z, and expand the step that is 1 there. Measured is what planned maps, the \
               camera's rays or a numerical integral give. The formulas put right agree with them to six digits and more."
            .into(),
        files: vec![
            File::svg("", "For each formula, printed and corrected value in proportion to the measured one", drawn(&found)?),
            File::shown_csv("", "for each formula: its value as printed, put right, and measured", table)?,
        ],
    })
}

fn found() -> Result<Vec<Misprint>> {
    let view = View::new(2.0, 200.0, FRAC_PI_6)?;
    let (n, f, tan_phi) = (view.near(), view.far(), view.tan_phi());
    let lambda = view.lambda_l();

    let z = 10.0;
    let camera = measured::camera(view)?;
    let [left, right] = [0.0, 1.0].map(|x| camera.ray(DVec2::new(x, 0.5)));
    let width = 2.0 * z * tan_phi;
    let pixel = Misprint {
        place: "Lloyd et al. 2006, Eq. 2",
        quantity: "pixel's width w_i at z = 10 m",
        printed: width / n,
        corrected: width,
        measured: left.at(z).distance(right.at(z)),
    };

    let overhead = Overhead::new(view, lambda)?;
    let planned = Planned::new(view, FRAC_PI_2, Warp::Lambda(lambda))?;
    let across = Misprint {
        place: "Lloyd et al. 2006, Eq. 9",
        quantity: "M_s with λ_L",
        printed: f * lambda / (lambda + f - n),
        corrected: overhead.max_s(),
        measured: planned.largest().q / 2.0,
    };

    let warped = Tilted::new(view, FRAC_PI_2)?.warped(lambda)?;
    // The samples give the depth of the minimum to a thousandth, and the error is flat around it.
    let depths = (0..=4000).map(|i| n * (f / n).powf(f64::from(i) / 4000.0));
    let least = Misprint {
        place: "Zhang et al. 2009, §3.1",
        quantity: "smallest E_p, θ = 90°, λ_L",
        printed: warped.errors(f * tan_phi, f)?.p,
        corrected: warped.extrema().p.least.value,
        measured: depths.map(|z| planned.errors(0.0, z).p).fold(f64::INFINITY, f64::min),
    };

    let mut all = vec![pixel, across, least];
    for (degrees, quantity) in [(60.0_f64, "F_p, θ = 60°, λ_L"), (20.0, "F_p, θ = 20°, λ_L")]
    {
        let theta_rad = degrees.to_radians();
        let tilted = Tilted::new(view, theta_rad)?;
        let warped = tilted.warped(lambda)?;
        let planned = Planned::new(view, theta_rad, Warp::Lambda(lambda))?;
        let (y, z) = (1.0, 20.0);
        let errors = planned.errors(y, z);
        let z_w = warped.z_w(y, z);
        let is_steep = theta_rad > view.half_fov_rad();
        if is_steep {
            all.push(Misprint {
                place: "Zhang et al. 2009, appendix",
                quantity: "tan φ_w, θ = 60°, λ_L",
                printed: f * tan_phi / (tilted.mu() + lambda),
                corrected: warped.tan_phi_w(),
                measured: errors.q * z * tan_phi / (2.0 * z_w),
            });
        }
        let factor = if is_steep { theta_rad.sin() } else { tan_phi * theta_rad.cos() };
        all.push(Misprint {
            place: "Zhang et al. 2009, appendix",
            quantity,
            printed: warped.f_p() / factor,
            corrected: warped.f_p(),
            measured: errors.p * z / (z + warped.g(y)).powi(2),
        });
    }

    const ORDER: u32 = 4;
    let (d, z) = (0.3, 0.5);
    let step = FourierStep::new(ORDER, 0.0)?;
    all.push(Misprint {
        place: "Annen et al. 2007, Eq. 11",
        quantity: "light at d = 0.3, z = 0.5, M = 4",
        printed: step.series(d - z),
        corrected: step.series(z - d),
        measured: integrated(ORDER, d, z),
    });
    Ok(all)
}

/// Evaluates the Fourier series of the step that is 1 for d ≤ z. Each coefficient is a numerical
/// integral over the step's period in z − d.
fn integrated(order: u32, d: f64, z: f64) -> f64 {
    const STEPS: u32 = 100_000;
    let width = 2.0 / f64::from(STEPS);
    let middles = || (0..STEPS).map(move |i| (f64::from(i) + 0.5) * width - 1.0);
    let is_lit = |x: f64| f64::from(u8::from(x >= 0.0));
    let waves = (1..=order).map(|k| {
        let c = PI * (2.0 * f64::from(k) - 1.0);
        let amount: f64 = middles().map(|x| is_lit(x) * (c * x).sin() * width).sum();
        amount * (c * (z - d)).sin()
    });
    let mean: f64 = middles().map(|x| is_lit(x) * width / 2.0).sum();
    mean + waves.sum::<f64>()
}

/// Draws the table, and beside it a chart of each value's ratio to the measured value.
fn drawn(found: &[Misprint]) -> Result<String> {
    const ROW: i32 = 30;
    const HEAD: i32 = 34;
    const COLUMNS: [i32; 5] = [12, 210, 500, 590, 680];
    /// The ends of the axis of ratios, first in pixels and then as exponents of 10.
    const PLOT: [i32; 2] = [710, 960];
    const POWERS: [f64; 2] = [-2.0, 1.0];
    const PRINTED: RGBColor = chart::COLORS[1];
    const CORRECTED: RGBColor = chart::COLORS[0];
    let bottom = HEAD + ROW * found.len() as i32;
    let size = (PLOT[1] as u32 + 40, bottom as u32 + 56 + chart::TITLE_HEIGHT);
    let x_of = |ratio: f64| {
        let share = (ratio.log10() - POWERS[0]) / (POWERS[1] - POWERS[0]);
        PLOT[0] + (f64::from(PLOT[1] - PLOT[0]) * share).round() as i32
    };
    chart::draw(size, "Misprints, one example each", |area| {
        let say = |words: &str, x: i32, y: i32, align: HPos, color: RGBColor| {
            let style = chart::text(13).pos(Pos::new(align, VPos::Center)).color(&color);
            area.draw(&Text::new(words.to_owned(), (x, y), style))
        };
        let headings = [("printed", PRINTED), ("corrected", CORRECTED), ("measured", BLACK)];
        for ((heading, color), x) in headings.into_iter().zip(&COLUMNS[2..]) {
            say(heading, *x, HEAD / 2, HPos::Right, color)?;
        }
        say("over measured", i32::midpoint(PLOT[0], PLOT[1]), HEAD / 2, HPos::Center, BLACK)?;
        for ratio in [0.01, 0.1, 1.0, 10.0] {
            let strength = if ratio == 1.0 { 0.6 } else { 0.15 };
            let x = x_of(ratio);
            area.draw(&PathElement::new([(x, HEAD), (x, bottom)], BLACK.mix(strength)))?;
            say(&ratio.to_string(), x, bottom + 14, HPos::Center, BLACK)?;
        }
        for (i, m) in (0..).zip(found) {
            let y = HEAD + ROW * i + ROW / 2;
            say(m.place, COLUMNS[0], y, HPos::Left, BLACK)?;
            say(m.quantity, COLUMNS[1], y, HPos::Left, BLACK)?;
            let values = [(m.printed, PRINTED), (m.corrected, CORRECTED), (m.measured, BLACK)];
            for ((value, color), x) in values.into_iter().zip(&COLUMNS[2..]) {
                say(&format!("{value:.5}"), *x, y, HPos::Right, color)?;
            }
            area.draw(&Cross::new((x_of(m.printed / m.measured), y), 5, PRINTED.stroke_width(2)))?;
            area.draw(&Circle::new((x_of(m.corrected / m.measured), y), 5, CORRECTED.filled()))?;
        }
        let y = bottom + 38;
        area.draw(&Cross::new((PLOT[0] + 6, y), 5, PRINTED.stroke_width(2)))?;
        say("printed", PLOT[0] + 18, y, HPos::Left, BLACK)?;
        area.draw(&Circle::new((PLOT[0] + 126, y), 5, CORRECTED.filled()))?;
        say("corrected", PLOT[0] + 138, y, HPos::Left, BLACK)?;
        Ok(())
    })
}
