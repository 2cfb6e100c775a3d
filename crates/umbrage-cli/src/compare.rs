//! `umbrage compare`: techniques against ray-traced truth, as a report.

use crate::args;
use crate::comparison::{Comparison, Stage};
use crate::execute::Execution;
use crate::motion::Motion;
use crate::output::{Contents, ReportFolder, aligned, command_line, note, print};
use crate::pixels::NOTHING_TO_SHADOW;
use crate::progress::Progress;
use crate::setup::{open_scene, tell_notices};
use anyhow::Result;
use umbrage_measure::{Measured, Report};

/// Compares, writes the report, and prints a table or the report's JSON.
pub(crate) fn run(args: &args::Compare, quiet: bool) -> Result<()> {
    let folder = ReportFolder::check(&args.output, Contents::Comparison)?;
    let scene = open_scene(&args.scene.name)?;
    let execution = Execution::open(
        &args.comparison.techniques.execution,
        &args.comparison.techniques.shadows,
    )?;
    let stage = Stage::new(&scene, &execution, args.scene.opaque, args.comparison.techniques.fit)?;
    let comparison = Comparison::new(&stage, &args.view, &args.light, &args.comparison)?;
    if let Some(motion) = args.motion {
        comparison.check_motion(motion, args.frames)?;
    }
    tell_notices(&scene);
    execution.announce();
    let rows_in_motion = u64::from(args.frames) * u64::from(args.view.size[1]);
    let moving = match args.motion {
        None => 0,
        Some(Motion::Away) => 2 * rows_in_motion,
        Some(_) => rows_in_motion,
    };
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
    type Column = (&'static str, fn(&Measured) -> String);
    const COLUMNS: [Column; 18] = [
        ("shadows", |r| r.shadows.clone()),
        ("maps", |r| r.maps.to_string()),
        ("texels", |r| r.texels.to_string()),
        ("KiB", |r| r.bytes.map_or("-".into(), |b| b.div_ceil(1024).to_string())),
        ("wrong", |r| percent(r.metrics.wrong_fraction)),
        ("false light", |r| percent(r.metrics.false_light)),
        ("mean error", |r| number(r.metrics.mean_abs_error, 4)),
        ("FLIP", |r| number(r.metrics.flip, 4)),
        ("flicker", |r| percent(r.flicker)),
        ("noise", |r| number(r.noise, 4)),
        ("px/texel 50%", |r| number(r.error_px.p50, 2)),
        ("95%", |r| number(r.error_px.p95, 2)),
        ("max", |r| number(r.error_px.max, 1)),
        ("culled", |r| percent(r.casters_culled)),
        ("plan ms", |r| number(r.ms.plan, 3)),
        ("depth ms", |r| number(r.ms.depth, 0)),
        ("filter ms", |r| number(r.ms.filter, 0)),
        ("shade ms", |r| number(r.ms.shade, 0)),
    ];
    let is_measured = |name: &str| match name {
        "flicker" => report.motion.is_some(),
        "noise" => report.results.iter().any(|r| r.noise.is_some()),
        "filter ms" => report.results.iter().any(|r| r.ms.filter.is_some()),
        _ => true,
    };
    let columns = || COLUMNS.iter().filter(|(name, _)| is_measured(name));
    let mut rows: Vec<Vec<String>> = vec![columns().map(|(name, _)| (*name).to_owned()).collect()];
    rows.extend(report.results.iter().map(|r| columns().map(|(_, text)| text(r)).collect()));
    aligned(&rows)
}

fn percent(share: Option<f64>) -> String {
    share.map_or("-".into(), |s| format!("{:.2}%", s * 100.0))
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".into(), |v| format!("{v:.digits$}"))
}
