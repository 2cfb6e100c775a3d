//! Figures 3 and 6 of the paper on convolution shadow maps (CSM; Annen et al. 2007): the Fourier
//! series of the shadow test, its trade-offs, and the shadows that it gives.

use crate::axis::Axis;
use crate::chart::{self, Curve, LineChart};
use crate::figure::{Figure, File};
use crate::rendered::{Shot, sheet};
use crate::table::{Cell, Table};
use anyhow::Result;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use umbrage::theory::{FourierStep, StepAt};
use umbrage_trace::Tracer;

const ORDERS: [u32; 5] = [1, 2, 4, 8, 16];
const PLAIN: StepAt = StepAt { offset: false, scale: false };
const OFFSET: StepAt = StepAt { offset: true, scale: false };
const SCALE: StepAt = StepAt { offset: false, scale: true };

/// The shadow test before the clamp, computed from stored basis images: sines and cosines of the
/// occluder's depth z, rounded to signed 8 bits, are multiplied by those of the receiver's depth d
/// (CSM Eqs. 13 and 14, with the sign of the step corrected).
fn from_basis_images(order: u32, attenuation: f64, receiver: f64, occluder: f64) -> f64 {
    let stored = |value: f64| (value * 127.0).round() / 127.0;
    let terms = (1..=order).map(f64::from).map(|k| {
        let c = std::f64::consts::PI * (2.0 * k - 1.0);
        let weight = 2.0 / c * (-attenuation * (k / f64::from(order)).powi(2)).exp();
        let [sine, cosine] = [(c * occluder).sin(), (c * occluder).cos()].map(stored);
        weight * (sine * (c * receiver).cos() - cosine * (c * receiver).sin())
    });
    0.5 + terms.sum::<f64>()
}

/// Depth of the occluder in Fig. 3. At this depth no sine is exact in 8 bits.
const OCCLUDER: f64 = 0.47;

/// The parameters of a Fourier step, which is computed in closed form and from basis images.
#[derive(Clone, Copy)]
struct Variant {
    order: u32,
    attenuation: f64,
    at: StepAt,
}

impl Variant {
    fn new(order: u32, attenuation: f64, at: StepAt) -> Self {
        Self { order, attenuation, at }
    }

    fn step(self) -> Result<FourierStep> {
        Ok(FourierStep::new(self.order, self.attenuation)?)
    }

    /// The offset that is added to z − d, and the factor that multiplies the sum.
    fn adjustment(self) -> Result<[f64; 2]> {
        let offset = if self.at.offset { self.step()?.offset() } else { 0.0 };
        Ok([offset, if self.at.scale { 2.0 } else { 1.0 }])
    }

    /// The closed form of the sum at z − d = `x`, before the clamp.
    fn closed(self, x: f64) -> Result<f64> {
        let [offset, scale] = self.adjustment()?;
        Ok(scale * self.step()?.series(x + offset))
    }

    /// The same sum at z − d = `x`, computed from 8-bit basis images.
    fn stored(self, x: f64) -> Result<f64> {
        let [offset, scale] = self.adjustment()?;
        Ok(scale * from_basis_images(self.order, self.attenuation, OCCLUDER - x - offset, OCCLUDER))
    }

    fn name(self) -> &'static str {
        match (self.at.offset, self.at.scale) {
            (true, _) => "offset",
            (_, true) => "scale",
            _ => "plain",
        }
    }
}

/// The five curves of a chart, each with its name in the legend.
type Variants = [(String, Variant); 5];

/// Makes Fig. 3 of CSM.
pub(crate) fn fig3() -> Result<Figure> {
    let of_order =
        |attenuation, at| ORDERS.map(|m| (format!("M = {m}"), Variant::new(m, attenuation, at)));
    let attenuated = [0.0, 0.5, 1.0, 2.0, 4.0]
        .map(|alpha| (format!("M = 8, α = {alpha}"), Variant::new(8, alpha, PLAIN)));
    let parts: [(&str, &str, Variants); 4] = [
        ("orders", "(a) More terms: steeper, with ringing", of_order(0.0, PLAIN)),
        ("attenuation", "(b) Attenuation: less ringing, less steep", attenuated),
        ("offset", "(c) Offset: lit where d = z", of_order(0.0, OFFSET)),
        ("scale", "(d) Scaling by 2: lit where d = z, and steeper", of_order(0.0, SCALE)),
    ];
    let mut table = Table::new(&[
        "part",
        "order",
        "attenuation",
        "adjustment",
        "d_minus_z",
        "light",
        "light_measured",
    ])?;
    let mut files = Vec::new();
    let x = Axis::linear("receiver's depth less occluder's, d − z", [-0.45, 0.45]);
    for (part, title, variants) in parts {
        let mut curves = Vec::new();
        for (i, (name, variant)) in variants.into_iter().enumerate() {
            let mut points = Vec::new();
            for x in x.samples(181) {
                let (closed, measured) = (variant.closed(-x)?, variant.stored(-x)?);
                table.row(&[
                    Cell::from(part),
                    variant.order.into(),
                    variant.attenuation.into(),
                    variant.name().into(),
                    x.into(),
                    closed.into(),
                    measured.into(),
                ])?;
                points.push((x, closed, measured));
            }
            curves.push(
                Curve::new(name)
                    .line(points.iter().map(|p| [p.0, p.1]))
                    .markers(points.iter().skip(2 * i).step_by(10).map(|p| [p.0, p.2])),
            );
        }
        let range = if part == "scale" { [-0.4, 2.4] } else { [-0.2, 1.2] };
        let chart = LineChart {
            title: title.to_owned(),
            x: x.clone(),
            y: Axis::linear("light that passes, before the clamp to 0 … 1", range),
            curves,
            notes: Vec::new(),
        };
        files.push(File::svg(part, title, chart.svg()?));
    }
    files.push(File::csv(
        "",
        "all curves, point by point; measured: from 8-bit basis images",
        table,
    )?);
    Ok(Figure {
        name: "csm-fig3",
        title: "A shadow test made of waves".into(),
        source: "Annen, Mertens, Bekaert, Seidel and Kautz 2007, Figure 3",
        text: "A shadow test is a step: light where the receiver's depth d is at most the stored depth z, dark beyond. \
               Convolution shadow maps replace the step by the first M waves of its Fourier series, which can be \
               blurred like any picture. (a) With more terms the step is steeper, but it keeps swinging about 0 and 1; the first \
               swing does not get lower (9% with M = 16). (b) Damping term k by exp(−α (k/M)²) calms the swings and \
               flattens the step. At d = z all these curves are at one half, which would leave every lit \
               surface half dark. (c) Shifting d by a fixed offset lets the curve be 1 there, and darkness begins the later the \
               smaller M is: light leaks in near contacts. (d) Doubling the sum instead keeps the shadow side where it was and \
               makes the step twice as steep, at the price of harder edges. Markers are the same sum \
               from what a map stores, sines and cosines in 8 bits each. The paper expands the step of d − z, which \
               swaps light and shadow; here is the right sign."
            .into(),
        files,
    })
}

/// The scene of Fig. 6: the depth of the ground, then the heights above it of the low square, the
/// high square and the upper end of the slanted polygon. The depth range is 1.
const GROUND: f64 = 0.9;
const LOW: f64 = 0.15;
const HIGH: f64 = 0.45;
const SLANT: f64 = 0.5;

/// Makes Fig. 6 of CSM.
pub(crate) fn fig6() -> Result<Figure> {
    let mut table = Table::new(&["order", "adjustment", "gap", "light", "light_measured"])?;
    let gaps = Axis::linear("height of the occluder over the receiver, z-range = 1", [0.0, SLANT]);
    let mut curves = Vec::new();
    for (i, m) in ORDERS.into_iter().enumerate() {
        let mut points = Vec::new();
        for gap in gaps.samples(101) {
            let closed = shadow(m, OFFSET, gap)?;
            let offset = FourierStep::new(m, 0.0)?.offset();
            let measured = from_basis_images(m, 0.0, GROUND - offset, GROUND - gap).clamp(0.0, 1.0);
            table.row(&[
                Cell::from(m),
                "offset".into(),
                gap.into(),
                closed.into(),
                measured.into(),
            ])?;
            points.push((gap, closed, measured));
        }
        curves.push(
            Curve::new(format!("M = {m}"))
                .line(points.iter().map(|p| [p.0, p.1]))
                .markers(points.iter().skip(i).step_by(5).map(|p| [p.0, p.2])),
        );
    }
    let chart = LineChart {
        title: "Light in the slanted polygon's shadow".into(),
        x: gaps,
        y: Axis::linear("light that passes", [0.0, 1.05]),
        curves,
        notes: Vec::new(),
    };
    Ok(Figure {
        name: "csm-fig6",
        title: "How many terms a shadow needs".into(),
        source: "Annen, Mertens, Bekaert, Seidel and Kautz 2007, Figure 6",
        text: "First the built-in scene `contacts`, really rendered, with 8-bit basis images of 512² texels, no blur and no leak reduction; then the same from the \
               closed form: the ground as the light sees it, with the shadows of two squares and of a polygon that rises from where \
               it touches the ground. One square hangs at a height of 0.45 of the depth range, the one below it at 0.15, \
               which is within the step's slope for small M, so light passes where there should be none. The \
               slanted polygon shows the whole slope at once, bright at its contact and dark beyond; the curves are a \
               cut along it. In the upper row d is shifted by the offset, as in the paper's pictures, the \
               lower row scales by 2 instead: both leave lit ground fully lit, and scaling darkens contacts sooner. With four \
               terms both squares are dark, with sixteen the contact too. Uneven darkness is the series' \
               ringing, which nothing dampens here. Markers come from 8-bit basis images."
            .into(),
        files: vec![
            File::svg("rendered", "The scene rendered with five orders and two ways to put lit surfaces right", rendered()?),
            File::svg("pictures", "Shadows of two squares and a slanted polygon for five orders", pictures()?),
            File::svg("cut", "Light over the height of the occluder for five orders", chart.svg()?),
            File::csv("", "the curves, point by point", table)?,
        ],
    })
}

/// Renders the built-in scene `contacts` with each order, once with the offset and once with
/// scaling by 2.
fn rendered() -> Result<String> {
    let scene = umbrage_scene::builtin("contacts", None)?;
    let tracer = Tracer::new(&scene)?;
    let shot = Shot::new(&scene, &tracer, scene.default_light().light, |_| {})?;
    let specs = ["offset", "scale"].into_iter().flat_map(|at| ORDERS.map(|m| (m, at)));
    let pictures = specs.map(|(m, at)| {
        let picture = shot.picture(&format!("uniform:csm{m}({at},leak=0)@512"))?;
        Ok((format!("M = {m}, {at}"), picture))
    });
    sheet("How many terms a shadow needs", ORDERS.len(), &pictures.collect::<Result<Vec<_>>>()?)
}

/// The visibility of the ground under an occluder that is nearer to the light by `gap`.
fn shadow(order: u32, at: StepAt, gap: f64) -> Result<f64> {
    Ok(FourierStep::new(order, 0.0)?.visibility(GROUND, GROUND - gap, at)?)
}

/// Draws the ground as seen along the light direction. Each column has one order, and the two rows
/// have the offset and the scaling.
fn pictures() -> Result<String> {
    const SIDE: i32 = 150;
    const STEP: i32 = 164;
    const LEFT: i32 = 70;
    const TOP: i32 = 28;
    /// Height of one strip of the slanted polygon, pixels.
    const STRIP: i32 = 2;
    /// Left edge, top edge, width and height of each object, pixels.
    const UPPER: [i32; 4] = [12, 12, 50, 50];
    const LOWER: [i32; 4] = [12, 88, 50, 50];
    const POLYGON: [i32; 4] = [86, 12, 50, 126];
    let size = ((LEFT + 5 * STEP) as u32, (TOP + 2 * STEP) as u32 + chart::TITLE_HEIGHT);
    chart::draw(
        size,
        "Shadows of two squares and a slanted polygon, seen along the light",
        |area| {
            for (row, (at, name)) in (0..).zip([(OFFSET, "offset"), (SCALE, "scale")]) {
                let y = TOP + STEP * row;
                let style = chart::text(14).pos(Pos::new(HPos::Left, VPos::Center));
                area.draw(&Text::new(name, (12, y + SIDE / 2), style))?;
                for (column, m) in (0..).zip(ORDERS) {
                    let x = LEFT + STEP * column;
                    if row == 0 {
                        let style = chart::text(14).pos(Pos::new(HPos::Center, VPos::Bottom));
                        area.draw(&Text::new(format!("M = {m}"), (x + SIDE / 2, y - 6), style))?;
                    }
                    let rectangle = |[left, top, width, height]: [i32; 4], gap| -> Result<()> {
                        // Lit ground must be a bit darker than the page.
                        let grey = (30.0 + 205.0 * shadow(m, at, gap)?).round() as u8;
                        let corner = (x + left, y + top);
                        let corners = [corner, (corner.0 + width, corner.1 + height)];
                        let color = RGBColor(grey, grey, grey);
                        Ok(area.draw(&Rectangle::new(corners, color.filled()))?)
                    };
                    rectangle([0, 0, SIDE, SIDE], 0.0)?;
                    rectangle(UPPER, HIGH)?;
                    rectangle(LOWER, LOW)?;
                    let [left, top, width, height] = POLYGON;
                    for i in 0..height / STRIP {
                        // The polygon touches the ground at the lower edge of the drawing.
                        let gap = SLANT
                            * (1.0 - (f64::from(i) + 0.5) * f64::from(STRIP) / f64::from(height));
                        rectangle([left, top + i * STRIP, width, STRIP], gap)?;
                    }
                }
            }
            Ok(())
        },
    )
}
