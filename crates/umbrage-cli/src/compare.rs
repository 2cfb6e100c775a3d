//! `umbrage compare`: techniques against ray-traced truth, as a report.

use crate::args;
use crate::comparison::{Comparison, Stage};
use crate::output::{Contents, ReportFolder, aligned, command_line, note, print};
use crate::pixels::NOTHING_TO_SHADOW;
use crate::progress::Progress;
use crate::setup::{open_scene, tell_notices};
use anyhow::Result;
use umbrage_measure::Report;

/// Compares, writes the report, and prints a table or the report's JSON.
pub(crate) fn run(args: &args::Compare, quiet: bool) -> Result<()> {
    let folder = ReportFolder::check(&args.output, Contents::Comparison)?;
    let scene = open_scene(&args.scene.name)?;
    let stage = Stage::new(&scene, args.scene.opaque, args.comparison.fit)?;
    let comparison = Comparison::new(&stage, &args.view, &args.light, &args.comparison)?;
    tell_notices(&scene);
    args.comparison.execution.announce();
    let rows_in_motion = u64::from(args.frames) * u64::from(args.view.size[1]);
    let moving = args.motion.map_or(0, |_| rows_in_motion);
    let progress = Progress::new(comparison.rows() + moving, quiet);
    let mut compared = comparison.trace(&progress)?;
    if let Some(motion) = args.motion {
        compared.move_on(motion, args.frames, &progress)?;
    }
    let has_shadows = compared.has_shadows();
    let report = folder.replace(|path| compared.write(path, &command_line(), &progress))?;
    drop(progress);
    if !has_shadows {
        log::warn!("{NOTHING_TO_SHADOW}");
    }

    let page = args.output.join("index.html");
    if args.json {
        note(&format!("report: {}", page.display()));
        print(&report.to_json()?)
    } else {
        print(&format!("{}\nreport: {}\n", table(&report), page.display()))
    }
}

fn table(report: &Report) -> String {
    let head = [
        "shadows",
        "maps",
        "texels",
        "wrong",
        "false light",
        "mean error",
        "FLIP",
        "flicker",
        "px/texel 50%",
        "95%",
        "max",
        "plan ms",
        "depth ms",
        "shade ms",
    ];
    let mut rows = vec![head.map(str::to_owned)];
    rows.extend(report.results.iter().map(|r| {
        let (m, e) = (&r.metrics, &r.error_px);
        [
            r.shadows.clone(),
            r.maps.to_string(),
            r.texels.to_string(),
            percent(m.wrong_fraction),
            percent(m.false_light),
            number(m.mean_abs_error, 4),
            number(m.flip, 4),
            percent(r.flicker),
            number(e.p50, 2),
            number(e.p95, 2),
            number(e.max, 1),
            number(r.ms.plan, 3),
            number(r.ms.depth, 0),
            number(r.ms.shade, 0),
        ]
    }));
    aligned(&rows)
}

fn percent(share: Option<f64>) -> String {
    share.map_or("-".into(), |s| format!("{:.2}%", s * 100.0))
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".into(), |v| format!("{v:.digits$}"))
}
