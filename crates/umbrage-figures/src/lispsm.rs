//! Figure 6 of Wimmer, Scherzer and Purgathofer 2004.

use crate::axis::Axis;
use crate::chart::{Curve, LineChart};
use crate::figure::{Figure, File};
use crate::measured::{error_at, from_behind, plan};
use crate::table::{Cell, Table};
use anyhow::Result;
use std::f64::consts::FRAC_PI_2;
use umbrage::theory::{Overhead, Rule, Tilted, View};
use umbrage::{Faces, Warp};

/// Makes Fig. 6: the errors of four parameterizations over the distance z, with the light overhead.
pub(crate) fn fig6() -> Result<Figure> {
    // The paper leaves out the factor 2 tan φ, which is 1 for this φ.
    let view = View::new(1.0, 100.0, 0.5_f64.atan())?;
    let techniques = [
        ("Uniform", Rule::Uniform, Warp::Uniform),
        ("PSM", Rule::Psm, Warp::Psm),
        ("LiSPSM", Rule::Lispsm, Warp::Lispsm),
        ("Logarithmic", Rule::Log, Warp::Log),
    ];
    let z = Axis::linear("z, metres", [0.0, 100.0]);
    let depths = Axis::log("", [view.near(), view.far()]).samples(121);
    let mut table = Table::new(&["technique", "z", "dp_ds", "dp_ds_measured"])?;
    let mut curves = Vec::new();
    for (name, rule, warp) in techniques {
        let closed = |z: f64| -> Result<f64> {
            if rule == Rule::Log {
                return Ok(view.log_error());
            }
            let lambda = Tilted::new(view, FRAC_PI_2)?.lambda(rule)?;
            Ok(Overhead::new(view, lambda)?.m_t(z)?)
        };
        let plan = plan(view, from_behind(FRAC_PI_2), warp, 1, Faces::Whole)?;
        let (mut line, mut markers) = (Vec::new(), Vec::new());
        for (i, &z) in depths.iter().enumerate() {
            let (formula, measured) = (closed(z)?, error_at(&plan, view, z)?.t);
            table.row(&[Cell::from(name), z.into(), formula.into(), measured.into()])?;
            line.push([z, formula]);
            if i % 6 == 0 {
                markers.push([z, measured]);
            }
        }
        curves.push(Curve::new(name).line(line).markers(markers));
    }
    let chart = LineChart {
        title: "Error along the view, light overhead (n = 1, f = 100)".to_owned(),
        x: z,
        y: Axis::linear("dp/ds", [0.0, 100.0]),
        curves,
        notes: Vec::new(),
    };
    Ok(Figure {
        name: "lispsm-fig6",
        title: "Where four parameterizations err".to_owned(),
        source: "Wimmer, Scherzer and Purgathofer 2004, Figure 6",
        text: "How many of the image’s units one unit of the map covers along the view, with the light overhead. An \
               even map is as good far away as it is bad near the viewer. Perspective shadow maps turn this \
               around: all is well up close, and the error grows in proportion to the distance until it is as large at the \
               far end as the even map’s at the near one. LiSPSM moves the warp’s centre back to where \
               both ends are equally bad, with an error of about the root of f/n; in between, at z = √(n f), there is a \
               minimum. No perspective can do what the logarithm does: the same small error everywhere."
            .to_owned(),
        files: vec![
            File::svg("", "Error over distance for four parameterizations", chart.svg()?),
            File::csv("", "one row for each technique and distance", table)?,
        ],
    })
}
