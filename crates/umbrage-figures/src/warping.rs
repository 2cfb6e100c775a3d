//! Figures 5, 6, 10, 12 and 13 of Lloyd, Tuft, Yoon and Manocha 2006, and a table of storage.

use crate::axis::Axis;
use crate::chart::{Curve, LineChart};
use crate::figure::{Figure, File};
use crate::measured::{error_at, from_behind, plan};
use crate::schemes::{Scheme, paper_view};
use crate::table::{Cell, Table};
use anyhow::Result;
use std::f64::consts::FRAC_PI_2;
use umbrage::theory::{LightFrom, Overhead, View};
use umbrage::{Faces, Partition, Warp};

/// The name of a λ in a legend.
fn lambda_name(view: View, lambda: f64) -> String {
    if lambda == f64::INFINITY {
        "∞ (no warp)".to_owned()
    } else if lambda == view.lambda_l() {
        format!("{lambda:.2} (LiSPSM)")
    } else if lambda == view.near() {
        format!("{lambda} (PSM)")
    } else {
        format!("{lambda}")
    }
}

/// Makes Fig. 5: errors over the distance z for several λ, with the light overhead.
pub(crate) fn fig5() -> Result<Figure> {
    let view = paper_view(20.0)?;
    let lambdas = [f64::INFINITY, 20.0, view.lambda_l(), 2.0, view.near()];
    let depths = Axis::log("", [view.near(), view.far()]).samples(121);
    let mut table = Table::new(&["lambda", "z", "m_s", "m_s_measured", "m_t", "m_t_measured"])?;
    let mut curves = [Vec::new(), Vec::new()];
    for lambda in lambdas {
        let overhead = Overhead::new(view, lambda)?;
        let plan = plan(view, from_behind(FRAC_PI_2), Warp::Lambda(lambda), 1, Faces::Whole)?;
        let mut points = Vec::new();
        for &z in &depths {
            let formula = [overhead.m_s(z)?, overhead.m_t(z)?];
            let found = error_at(&plan, view, z)?;
            let found = [found.s, found.t];
            let name = if lambda.is_finite() { lambda.to_string() } else { "inf".to_owned() };
            let [cells_s, cells_t] = [0, 1].map(|i| [formula[i].into(), found[i].into()]);
            let [s, s_measured] = cells_s;
            let [t, t_measured] = cells_t;
            table.row(&[Cell::from(&*name), z.into(), s, s_measured, t, t_measured])?;
            points.push((z, formula, found));
        }
        for (i, curves) in curves.iter_mut().enumerate() {
            let line = points.iter().map(|(z, formula, _)| [*z, formula[i]]);
            let markers = points.iter().step_by(6).map(|(z, _, found)| [*z, found[i]]);
            let name = format!("λ = {}", lambda_name(view, lambda));
            curves.push(Curve::new(name).line(line).markers(markers));
        }
    }
    let chart = |which: &str, label: &str, range, curves| {
        LineChart {
            title: format!("Error {which}, light overhead (n = 1, f = 20, φ = 30°)"),
            x: Axis::linear("z, metres", [0.0, 20.0]),
            y: Axis::log(label, range),
            curves,
            notes: Vec::new(),
        }
        .svg()
    };
    let [across, along] = curves;
    Ok(Figure {
        name: "wp-fig5",
        title: "How a warp spreads its error".to_owned(),
        source: "Lloyd, Tuft, Yoon and Manocha 2006, Figure 5 (Eqs. 7, 8)",
        text: "Pixels per texel along the view, across the map and along it, for an image of one pixel and a \
               map of one texel. A stronger warp (smaller λ) takes error away near the viewer and puts it far \
               off. Across the map every bit of warp helps, down to λ = n, where the error is the same \
               everywhere. Along the map it helps only until both ends are equally bad, at LiSPSM’s λ = n + √(n f). The least \
               error along the map lies at z = λ − n. The paper plots the factors that depend on z; here they are whole, and \
               without the division by n that its Eq. 2 has too much."
            .to_owned(),
        files: vec![
            File::svg("s", "Error across the map", chart("across the map", "m_s, pixels per texel", [0.5, 30.0], across)?),
            File::svg("t", "Error along the map", chart("along the map", "m_t, pixels per texel", [0.5, 30.0], along)?),
            File::csv("", "one row for each λ and distance", table)?,
        ],
    })
}

/// Makes Fig. 6: the largest errors and the storage factor over η, with the light overhead.
pub(crate) fn fig6() -> Result<Figure> {
    let view = paper_view(100.0)?;
    let mut table = Table::new(&[
        "eta",
        "lambda",
        "max_s",
        "max_s_measured",
        "max_t",
        "max_t_measured",
        "storage_factor",
        "storage_factor_measured",
    ])?;
    let eta = Axis::linear("η:  −1 no warp,  0 LiSPSM,  1 PSM", [-1.0, 1.0]);
    let mut rows = Vec::new();
    for eta in eta.samples(81) {
        let overhead = Overhead::new(view, view.lambda_from_eta(eta)?)?;
        let plan =
            plan(view, from_behind(FRAC_PI_2), Warp::Lambda(overhead.lambda()), 1, Faces::Whole)?;
        let map = &plan.maps[0];
        let formula = [overhead.max_s(), overhead.max_t(), overhead.storage_factor()];
        let found = [map.error.max_s, map.error.max_t, map.storage_factor];
        let mut cells = vec![Cell::from(eta), overhead.lambda().into()];
        cells.extend(formula.iter().zip(found).flat_map(|(a, b)| [Cell::from(*a), b.into()]));
        table.row(&cells)?;
        rows.push((eta, formula, found));
    }
    let names = ["M_s", "M_t", "S̄ = M_s·M_t"];
    let curves = names.iter().enumerate().map(|(i, name)| {
        let largest = rows.iter().map(|(_, formula, _)| formula[i]).fold(0.0, f64::max);
        Curve::new(format!("{name} / {largest:.0}"))
            .line(rows.iter().map(|(eta, formula, _)| [*eta, formula[i] / largest]))
            .markers(rows.iter().step_by(4).map(|(eta, _, found)| [*eta, found[i] / largest]))
    });
    let chart = LineChart {
        title: "Largest errors and storage over the warp (n = 1, f = 100, φ = 30°)".to_owned(),
        curves: curves.collect(),
        x: eta,
        y: Axis::linear("share of the largest", [0.0, 1.05]),
        notes: Vec::new(),
    };
    Ok(Figure {
        name: "wp-fig6",
        title: "From no warp to PSM".to_owned(),
        source: "Lloyd, Tuft, Yoon and Manocha 2006, Figure 6 (Eqs. 9 to 12)",
        text: "The largest errors over the whole view, light overhead, as the warp grows from none (η = −1) over LiSPSM \
               (0) to PSM (1), each as a share of its own largest value. From LiSPSM on the one falls as the other rises, \
               and their product, the texels needed, stays the same: PSM, LiSPSM and all between cost alike and differ \
               only in where they err and in the shape of their maps. The planner’s maps say so too."
            .to_owned(),
        files: vec![
            File::svg("", "Largest errors across and along the map, and storage, over η", chart.svg()?),
            File::csv("", "one row for each η", table)?,
        ],
    })
}

/// Makes Fig. 10: the storage factor over the number of slices, with the light overhead.
pub(crate) fn fig10() -> Result<Figure> {
    let view = paper_view(1000.0)?;
    let mut table = Table::new(&["scheme", "maps", "storage_factor", "storage_factor_measured"])?;
    let schemes = [("ZP: slices", false), ("ZP+W: slices, warp", true)];
    let mut curves = Vec::new();
    for (name, is_warped) in schemes {
        let scheme = |k| Scheme::new(name, k, is_warped, false);
        curves.push(over_maps(&mut table, view, LightFrom::Overhead, 1..=16, scheme)?);
    }
    // The logarithmic map's error is the same everywhere, so slices would change nothing.
    let best = view.log_error();
    let log = plan(view, from_behind(FRAC_PI_2), Warp::Log, 1, Faces::Whole)?.storage_factor();
    table.row(&[Cell::from("logarithmic"), 1_u32.into(), best.into(), log.into()])?;
    curves.push(
        Curve::new("logarithmic: the optimum")
            .dashed()
            .line([[0.0, best], [17.0, best]])
            .markers([[1.0, log]]),
    );
    let chart = LineChart {
        title: "Storage factor over the number of maps, light overhead (f/n = 1000, φ = 30°)"
            .to_owned(),
        x: Axis::linear("shadow maps", [0.0, 17.0]),
        y: Axis::log("S̄, texels per pixel", [3.0, 1e6]),
        curves,
        notes: Vec::new(),
    };
    Ok(Figure {
        name: "wp-fig10",
        title: "Slices on the way to the optimum".to_owned(),
        source: "Lloyd, Tuft, Yoon and Manocha 2006, Figure 10 (Eqs. 17, 18)",
        text: "With the view cut into slices that are alike, each with a map of its own, storage falls towards the \
               logarithmic optimum that no single perspective reaches. Warped slices come close with few: eight need \
               1.6 times the optimum, where eight without a warp need nearly four times. The second slice \
               is worth most by far."
            .to_owned(),
        files: vec![
            File::svg("", "Storage factor over the number of slices", chart.svg()?),
            File::csv("", "one row for each scheme and number of maps", table)?,
        ],
    })
}

/// Computes a scheme's storage factor over its number of maps. Returns it as a curve, and adds rows
/// to `table`.
fn over_maps(
    table: &mut Table,
    view: View,
    light: LightFrom,
    slices: std::ops::RangeInclusive<u32>,
    scheme: impl Fn(u32) -> Scheme,
) -> Result<Curve> {
    let (mut line, mut markers) = (Vec::new(), Vec::new());
    let name = scheme(1).name;
    for k in slices {
        let scheme = scheme(k);
        let maps = if scheme.faces == Faces::Whole { k } else { 4 * k + 1 };
        let [formula, found] = scheme.both(view, light)?;
        table.row(&[Cell::from(name), maps.into(), formula.into(), found.into()])?;
        line.push([f64::from(maps), formula]);
        markers.push([f64::from(maps), found]);
    }
    Ok(Curve::new(name).line(line).markers(markers))
}

/// Makes Fig. 12: the storage factor over the number of maps, with the light overhead and behind.
pub(crate) fn fig12() -> Result<Figure> {
    let view = paper_view(1000.0)?;
    let chart = |light, what: &str| -> Result<_> {
        let mut table =
            Table::new(&["scheme", "maps", "storage_factor", "storage_factor_measured"])?;
        let zp = over_maps(&mut table, view, light, 1..=16, |k| {
            Scheme::new("ZP: slices", k, false, false)
        })?;
        let zp_w = over_maps(&mut table, view, light, 1..=16, |k| {
            Scheme::new("ZP+W: slices, warp", k, true, false)
        })?;
        let fp = over_maps(&mut table, view, light, 1..=8, |k| {
            Scheme::new("FP+ZP+W: with faces", k, true, true)
        })?;
        let svg = LineChart {
            title: format!(
                "Storage factor over the number of maps, light {what} (f/n = 1000, φ = 30°)"
            ),
            x: Axis::linear("shadow maps", [0.0, 34.0]),
            y: Axis::log("S̄, texels per pixel", [3.0, 2e6]),
            curves: vec![zp, zp_w, fp],
            notes: Vec::new(),
        }
        .svg()?;
        Ok((svg, table))
    };
    let (overhead, overhead_table) = chart(LightFrom::Overhead, "overhead")?;
    let (behind, behind_table) = chart(LightFrom::Behind, "behind")?;
    Ok(Figure {
        name: "wp-fig12",
        title: "What a map more is worth".to_owned(),
        source: "Lloyd, Tuft, Yoon and Manocha 2006, Figure 12 (Eqs. 17 to 21)",
        text: "Storage over the number of shadow maps, which is what rendering time goes by. Faces take four maps for \
               every slice and one for the near face. With the light overhead it meets one side only, all other \
               maps are empty, and slices alone are better. With the light behind, faces are all that can be warped, \
               so that slices need as much with a warp as without; and they soon overlap so much that more of \
               them cost more again, least at 14 maps, while faces go on falling."
            .to_owned(),
        files: vec![
            File::svg("overhead", "Storage factor over the number of maps, light overhead", overhead),
            File::svg("behind", "Storage factor over the number of maps, light behind", behind),
            File::csv("overhead", "one row for each scheme and number of maps", overhead_table)?,
            File::csv("behind", "the same with the light behind", behind_table)?,
        ],
    })
}

/// Makes Fig. 13: whether slices or faces need fewer texels, with the light behind the viewer.
pub(crate) fn fig13() -> Result<Figure> {
    let maps = 5..=Partition::MAX_SLICES as u32;
    let mut table =
        Table::new(&["maps", "face_slices", "tie_far_over_near", "tie_far_over_near_measured"])?;
    let mut ties = Vec::new();
    for maps in maps {
        let slices = (maps - 1) / 4;
        let zp = Scheme::new("ZP", maps, false, false);
        let fp = Scheme::new("FP+ZP+W", slices, true, true);
        let formula = tie(|view| {
            Ok(zp.formula(view, LightFrom::Behind)? / fp.formula(view, LightFrom::Behind)?)
        })?;
        let behind = from_behind(0.0);
        let found = tie(|view| Ok(zp.measured(view, behind)? / fp.measured(view, behind)?))?;
        table.row(&[Cell::from(maps), slices.into(), formula.into(), found.into()])?;
        ties.push((f64::from(maps), formula, found));
    }
    // The curve has steps, because the number of face slices changes between whole numbers of maps.
    let line =
        ties.iter().flat_map(|&(maps, formula, _)| [[maps - 0.5, formula], [maps + 0.5, formula]]);
    let tie = Curve::new("as many texels")
        .line(line)
        .markers(ties.iter().map(|&(x, _, found)| [x, found]));
    let chart = LineChart {
        title: "Fewest texels with the light behind the viewer".to_owned(),
        x: Axis::linear("shadow maps", [1.0, 17.0]),
        y: Axis::log("f/n", [1.0, 1e4]),
        curves: vec![tie],
        notes: vec![
            ([5.5, 600.0], "slices are better (ZP, ZP+W)".to_owned()),
            ([13.2, 6.0], "faces are better (FP+ZP+W)".to_owned()),
        ],
    };
    Ok(Figure {
        name: "wp-fig13",
        title: "Faces or slices".to_owned(),
        source: "Lloyd, Tuft, Yoon and Manocha 2006, Figure 13 (Eqs. 20, 21)",
        text: "With the light behind the viewer, and so many maps to be had: which way to use them needs fewer texels? \
               Below five maps there are no faces with their near face. The line is where both need as many; \
               it jumps at 9 and 13 maps, which is where the faces get a slice more. A deep view with few maps wants \
               slices, a shallow one or many maps want faces."
            .to_owned(),
        files: vec![
            File::svg("", "The depth ratio at which both schemes tie, over the number of maps", chart.svg()?),
            File::csv("", "one row for each number of maps", table)?,
        ],
    })
}

/// Finds the f/n at which `ratio`, which falls as f/n grows, is 1.
fn tie(ratio: impl Fn(View) -> Result<f64>) -> Result<f64> {
    let [mut low, mut high] = [1.01_f64, 1e6].map(f64::ln);
    for _ in 0..45 {
        let middle = (low + high) / 2.0;
        if ratio(paper_view(middle.exp())?)? > 1.0 { low = middle } else { high = middle }
    }
    Ok(low.exp())
}

/// Makes a table of the storage factors of partitions.
pub(crate) fn storage() -> Result<Figure> {
    let view = paper_view(1000.0)?;
    let mut table = Table::new(&[
        "slices",
        "zp_overhead",
        "zp_overhead_measured",
        "zp_w_overhead",
        "zp_w_overhead_measured",
        "zp_behind",
        "zp_behind_measured",
        "fp_zp_w_behind",
        "fp_zp_w_behind_measured",
    ])?;
    for slices in [1, 2, 4, 8, 16] {
        let columns = [
            (false, false, LightFrom::Overhead),
            (true, false, LightFrom::Overhead),
            (false, false, LightFrom::Behind),
            (true, true, LightFrom::Behind),
        ];
        let mut cells = vec![Cell::from(slices)];
        for (is_warped, has_faces, light) in columns {
            cells.extend(
                Scheme::new("", slices, is_warped, has_faces).both(view, light)?.map(Cell::from),
            );
        }
        table.row(&cells)?;
    }
    Ok(Figure {
        name: "wp-storage",
        title: "Storage of partitions".to_owned(),
        source: "Lloyd, Tuft, Yoon and Manocha 2006, Eqs. 17 to 21",
        text: "Texels per pixel of the image for an error of at most one pixel per texel (f/n = 1000, φ = 30°), each by \
               formula and by the planner. The optimum overhead is ln(f/n)/(2 tan φ) = 5.982. FP+ZP+W has \
               four maps a slice and one more."
            .to_owned(),
        files: vec![File::shown_csv("", "one row for each number of slices", table)?],
    })
}
