//! Figures that the papers do not have: the largest errors of every warp at every light angle, and
//! the texels that the adaptive warp saves.

use crate::axis::Axis;
use crate::chart::{Curve, LineChart};
use crate::figure::{Figure, File};
use crate::heat::{HeatMaps, Panel};
use crate::planned::{self, Planned};
use crate::table::{Cell, Table};
use anyhow::Result;
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_6;
use umbrage::Objective;
use umbrage::theory::{Rule, Tilted, View};

const STORAGE: Rule = Rule::Adaptive(Objective::Storage);
const LISPSM: Rule = Rule::LispsmInRange;

/// Every warp that one parameter λ describes, in the order of the curves.
const RULES: [(&str, Rule); 7] = [
    ("uniform", Rule::Uniform),
    ("PSM", Rule::Psm),
    ("LiSPSM as published", Rule::Lispsm),
    ("LiSPSM, tilt's range", LISPSM),
    ("TSM", Rule::Tsm { focus: None }),
    ("adaptive (storage)", STORAGE),
    ("adaptive (area)", Rule::Adaptive(Objective::Area)),
];

/// The results of one warp in one view under one light. Each pair holds the closed form's value and
/// the planned map's.
struct Worst {
    rule: usize,
    x: f64,
    lambda: [f64; 2],
    /// M_q·M_p, the product of the largest errors.
    storage: [f64; 2],
    /// The largest E_q·E_p at any one point.
    product: [f64; 2],
    /// M_q and M_p, the largest E_q and the largest E_p.
    largest: [[f64; 2]; 2],
}

impl Worst {
    fn new(view: View, theta_rad: f64, rule: usize, x: f64) -> Result<Self> {
        let tilted = Tilted::new(view, theta_rad)?;
        let lambda = tilted.lambda(RULES[rule].1)?;
        let extrema = tilted.warped(lambda)?.extrema();
        let planned = Planned::new(view, theta_rad, planned::warp(RULES[rule].1, lambda))?;
        let measured = planned.largest();
        Ok(Self {
            rule,
            x,
            lambda: [lambda, planned.lambda()],
            storage: [4.0 * extrema.storage_factor(), measured.product()],
            product: [extrema.product.largest.value, planned.largest_product(view)],
            largest: [[extrema.q.largest.value, extrema.p.largest.value], [measured.q, measured.p]],
        })
    }
}

/// One curve for each warp: a line for the closed form, and markers at every `every`-th measured
/// value.
fn curves(found: &[Worst], value: fn(&Worst) -> [f64; 2], every: usize) -> Vec<Curve> {
    let of_rule = |i: usize| found.iter().filter(move |w| w.rule == i);
    (0..RULES.len())
        .filter(|&i| of_rule(i).next().is_some())
        .map(|i| {
            Curve::new(RULES[i].0)
                .line(of_rule(i).map(|w| [w.x, value(w)[0]]))
                // The offset keeps the markers of warps with equal values from hiding each other.
                .markers(of_rule(i).skip(i % every).step_by(every).map(|w| [w.x, value(w)[1]]))
                .color(i)
        })
        .collect()
}

/// Makes the figure of the largest errors over the light angle θ.
pub(crate) fn theta() -> Result<Figure> {
    let view = View::new(1.0, 100.0, FRAC_PI_6)?;
    let found: Vec<Worst> = (0..RULES.len())
        .into_par_iter()
        .flat_map(|rule| (0..=90_u32).into_par_iter().map(move |degrees| (rule, degrees)))
        .map(|(rule, degrees)| {
            let degrees = f64::from(degrees);
            Worst::new(view, degrees.to_radians(), rule, degrees)
        })
        .collect::<Result<_>>()?;
    let mut table = Table::new(&[
        "theta_deg",
        "warp",
        "lambda_m",
        "lambda_m_measured",
        "storage",
        "storage_measured",
        "product",
        "product_measured",
    ])?;
    for w in &found {
        table.row(&[
            Cell::from(w.x),
            RULES[w.rule].0.into(),
            w.lambda[0].into(),
            w.lambda[1].into(),
            w.storage[0].into(),
            w.storage[1].into(),
            w.product[0].into(),
            w.product[1].into(),
        ])?;
    }
    let chart = |title: &str, label, range, value| {
        LineChart {
            title: format!("{title}, n = 1 m, f = 100 m, φ = 30°"),
            x: Axis::linear("angle θ between view and light, degrees", [0.0, 90.0]),
            y: Axis::log(label, range),
            curves: curves(&found, value, 6),
            notes: Vec::new(),
        }
        .svg()
    };
    let storage = chart("Texels for a guaranteed error", "M_q · M_p", [2e2, 1e6], |w| w.storage)?;
    let product =
        chart("The worst texel at any one point", "largest E_q · E_p", [5e1, 1e6], |w| w.product)?;
    Ok(Figure {
        name: "ours-theta",
        title: "The worst error at every angle of light".into(),
        source: "Zhang, Zhao and Sun 2009, §3.1 and the conclusion, worked out",
        text: "Theory shows the errors of three warps at three angles and names a warp that adapts to the angle as \
               future work. Here is every warp at every angle, judged in two ways. The first chart has the product of the \
               largest error across the map and the largest along it, wherever each may be: in proportion to it are the \
               texels that a map needs if no error is to exceed a given one. The second has the largest product at \
               any one point, the area of the worst texel. Light overhead is at the right end, where LiSPSM and \
               the adaptive warp for storage are one and need a hundredth of an even map. As the light tilts towards the view, LiSPSM's λ \
               grows with 1/sin θ and its gain is lost sooner than it need be; the adaptive warp follows the larger of the errors at V's \
               lower near and far corners instead and keeps both equal. The smallest texel \
               area asks for a shorter λ, at some cost of storage. Below θ = φ = 30° no warp gains much, and \
               LiSPSM and TSM need more than an even map; just above it PSM's warp is so strong (λ = 0.1 m) that it does \
               more harm than good. Markers leave their lines in two places on purpose: the \
               planner fades the adaptive warps out where sin θ < sin φ/4, where the map is about to turn around, and never \
               lets TSM's warp be stronger than λ = n/sin θ."
            .into(),
        files: vec![
            File::svg("storage", "M_q·M_p over θ, a curve for each warp", storage),
            File::svg("product", "Largest E_q·E_p over θ, a curve for each warp", product),
            File::csv("", "for each whole degree and warp: λ, M_q·M_p and the largest E_q·E_p", table)?,
        ],
    })
}

/// Makes the figure of the critical resolution over the depth ratio f/n.
pub(crate) fn critical() -> Result<Figure> {
    const SHOWN: [usize; 4] = [0, 1, 3, 5];
    let ratio = Axis::log("depth ratio f/n", [2.0, 1e4]);
    let mut table = Table::new(&[
        "theta_deg",
        "far_over_near",
        "warp",
        "critical_s",
        "critical_s_measured",
        "critical_t",
        "critical_t_measured",
    ])?;
    let mut files = Vec::new();
    for (degrees, part) in [(90.0_f64, "90"), (45.0, "45")] {
        let cases: Vec<(usize, f64)> = SHOWN
            .iter()
            .flat_map(|&rule| ratio.samples(38).into_iter().map(move |r| (rule, r)))
            .collect();
        let found: Vec<Worst> = cases
            .par_iter()
            .map(|&(rule, r)| {
                Worst::new(View::new(1.0, r, FRAC_PI_6)?, degrees.to_radians(), rule, r)
            })
            .collect::<Result<_>>()?;
        for w in &found {
            // E/2 is the error for an image of one pixel and a map of one texel.
            let [closed, measured] = w.largest.map(|m| m.map(|e| e / 2.0));
            table.row(&[
                Cell::from(degrees),
                w.x.into(),
                RULES[w.rule].0.into(),
                closed[0].into(),
                measured[0].into(),
                closed[1].into(),
                measured[1].into(),
            ])?;
        }
        let mut curves = curves(&found, |w| w.storage.map(|m| m / 4.0), 4);
        if degrees == 90.0 {
            let log = ratio
                .samples(80)
                .into_iter()
                .map(|r| Ok([r, View::new(1.0, r, FRAC_PI_6)?.log_error()]));
            let log = log.collect::<Result<Vec<_>>>()?;
            curves.push(Curve::new("logarithmic").line(log).dashed().color(4));
        }
        let svg = LineChart {
            title: format!("Texels per pixel for an error of at most 1, θ = {part}°, φ = 30°"),
            x: ratio.clone(),
            y: Axis::log("storage factor S̄ = res*_s · res*_t / res_i²", [0.3, 1e8]),
            curves,
            notes: Vec::new(),
        }
        .svg()?;
        files.push(File::svg(part, format!("Storage factor over f/n at θ = {part}°"), svg));
    }
    files.push(File::csv(
        "",
        "for each angle, depth ratio and warp: the critical resolution across (s) and along (t), texels per pixel of \
         the image's side",
        table,
    )?);
    Ok(Figure {
        name: "ours-critical",
        title: "The critical resolution over the depth ratio".into(),
        source: "Lloyd, Tuft, Yoon and Manocha 2006, Eqs. 9, 10 and 12, for any angle of light",
        text: "The critical resolution is the smallest with which no texel shows larger than a pixel anywhere in the view; the charts \
               have its product over both directions, in texels per pixel of the image. Under \
               light overhead an even map needs texels with the square of the depth ratio f/n, a perspective warp \
               with its first power (where PSM, LiSPSM and the adaptive warp need the same storage and only share it out \
               differently between the directions), and the logarithmic map, which no GPU draws, with its logarithm. \
               At 45° the perspective's gain is smaller and the warps part: PSM spends too much on \
               what is near, LiSPSM as a rule too little. Slopes tell the order of growth, for both axes are \
               logarithmic."
            .into(),
        files,
    })
}

/// Makes the figure of the adaptive warp's gain over LiSPSM.
pub(crate) fn gain() -> Result<Figure> {
    let phi = FRAC_PI_6;
    let angle = Axis::linear("angle θ between view and light, degrees", [30.0, 90.0]);
    let ratio = Axis::log("depth ratio f/n", [2.0, 1e4]);
    let closed = |degrees: f64, ratio: f64, over| -> Result<f64> {
        let tilted = Tilted::new(View::new(1.0, ratio, phi)?, degrees.to_radians())?;
        Ok(tilted.adaptive_gain(over)?)
    };
    let measured = |degrees: f64, ratio: f64, over: Rule| -> Result<f64> {
        let view = View::new(1.0, ratio, phi)?;
        let theta_rad = degrees.to_radians();
        let lambda = Tilted::new(view, theta_rad)?.lambda(over)?;
        let storage = |warp| Planned::new(view, theta_rad, warp).map(|p| p.largest().product());
        Ok(storage(planned::warp(over, lambda))? / storage(planned::warp(STORAGE, lambda))?)
    };
    let field = |title: &str, over| {
        Panel::new(title, [angle.clone(), ratio.clone()], [40, 30], |d, r| measured(d, r, over))
    };
    let map = HeatMaps {
        title: "Times fewer texels with adaptive than with LiSPSM, measured, φ = 30°".into(),
        panels: vec![
            field("over LiSPSM as published", Rule::Lispsm)?,
            field("over LiSPSM, tilt's range", LISPSM)?,
        ],
        columns: 2,
        panel_size: [400, 360],
        color: Axis::linear("gain, ratio of M_q·M_p", [1.0, 3.0]),
    };
    let mut table = Table::new(&["over", "far_over_near", "theta_deg", "gain", "gain_measured"])?;
    let mut curves = Vec::new();
    for (i, r) in [10.0, 100.0, 1000.0, 10_000.0].into_iter().enumerate() {
        for over in [2, 3] {
            let (name, rule) = RULES[over];
            let rows = (30..=90_u32)
                .into_par_iter()
                .map(|d| {
                    Ok((
                        f64::from(d),
                        closed(f64::from(d), r, rule)?,
                        measured(f64::from(d), r, rule)?,
                    ))
                })
                .collect::<Result<Vec<_>>>()?;
            for &(d, closed, measured) in &rows {
                table.row(&[
                    Cell::from(name),
                    r.into(),
                    d.into(),
                    closed.into(),
                    measured.into(),
                ])?;
            }
            if rule == Rule::Lispsm {
                let curve = Curve::new(format!("f/n = {r}"))
                    .line(rows.iter().map(|r| [r.0, r.1]))
                    .markers(rows.iter().skip(i).step_by(5).map(|r| [r.0, r.2]));
                curves.push(curve);
            }
        }
    }
    let lines = LineChart {
        title: "Gain of adaptive over LiSPSM as published, φ = 30°".into(),
        x: angle.clone(),
        y: Axis::linear("gain, ratio of M_q·M_p", [1.0, 3.0]),
        curves,
        notes: Vec::new(),
    };
    Ok(Figure {
        name: "ours-gain",
        title: "What adapting the warp to the light's angle gains".into(),
        source: "Zhang, Zhao and Sun 2009, conclusion: the direction-adaptive warp that they name as future work",
        text: "How many times the texels LiSPSM needs that the adaptive warp needs for the same guaranteed error. \
               Overhead (θ = 90°) the two are the same. It grows as light and view close in on each other, towards θ = φ the more the deeper the view: \
               LiSPSM's rule is derived for light overhead and carried over by 1/sin θ, which weakens the \
               warp just where V's lower near corner needs it. The advice in LiSPSM's §4.4, to take the tilt's shorter \
               range for f, gives back part of it (right-hand map). Below θ = φ, not shown, both tend to no warp. \
               The gain comes free: the maps differ in one number, λ."
            .into(),
        files: vec![
            File::svg("lines", "Gain over θ for four depth ratios", lines.svg()?),
            File::svg("map", "Gain over θ and f/n as colours", map.svg()?),
            File::csv("", "for each rule of LiSPSM, depth ratio and whole degree: the gain", table)?,
        ],
    })
}
