//! `umbrage compare` compares techniques with ray-traced truth, and writes a report.

use crate::args;
use crate::output::{aligned, command_line, note, print};
use crate::progress::Bar;
use crate::setup::{announce, open_changed, tell_detail, tell_notices};
use anyhow::Result;
use umbrage_lab::{
    Comparison, Contents, Detail, Executors, Motion, NOTHING_TO_SHADOW, PreparedScene, Progress,
    ReportFolder,
};
use umbrage_measure::{Measured, Report, TruthKind};

/// Compares the techniques, writes the report, and prints a table or the report's JSON.
pub(crate) fn run(args: &args::Compare, quiet: bool) -> Result<()> {
    let folder = ReportFolder::check(&args.output, Contents::COMPARISON)?;
    let bar = Bar::of_parts(quiet);
    let scene = open_changed(args.scene.name(), &args.scene.changes, &bar)?;
    bar.stage("preparing the scene");
    let techniques = &args.comparison.techniques;
    let executors = Executors::open(techniques.execution.backend.into(), &techniques.shadows)?;
    let detail = Detail::new(&scene, &executors, &techniques.execution.detail(), &bar)?;
    let (opaque, fit) = (args.scene.changes.opaque, techniques.fit.into());
    let prepared = PreparedScene::new(&scene, &executors, opaque, fit, &detail)?;
    let options = args.comparison.options();
    let (view, light) = (args.view.options(), args.light.options());
    bar.stage("planning");
    let comparison = Comparison::new(&prepared, &view, &light, &options)?;
    let motion = args.motion.map(Motion::from);
    if let Some(motion) = motion {
        comparison.check_motion(motion, args.frames)?;
    }
    bar.aside(|| {
        tell_notices(&scene);
        tell_detail(prepared.render());
        announce(&executors);
    });
    bar.chosen(comparison.chosen_view(), comparison.chosen_light());
    let moving = motion.map_or(0, |motion| comparison.rows_of_motion(motion, args.frames));
    bar.one_part(comparison.rows() + moving);
    let mut compared = comparison.trace(&bar)?;
    if let Some(motion) = motion {
        compared.move_on(motion, args.frames, &bar)?;
    }
    let has_shadows = compared.has_shadows();
    let report = folder.replace(|path| compared.write(path, &command_line(), &bar))?;
    drop(bar);
    if !has_shadows {
        log::warn!("{NOTHING_TO_SHADOW}");
    }

    let page = args.output.join("index.html");
    if args.json {
        note(&format!("report: {}", page.display()));
        print(&report.to_json()?)
    } else {
        print(&format!("{}\n{}\nreport: {}\n", table(&report), report.verdict(), page.display()))
    }
}

fn table(report: &Report) -> String {
    type Column = (&'static str, fn(&Measured) -> String);
    const COLUMNS: [Column; 20] = [
        ("shadows", |r| r.shadows.clone()),
        ("truth", |r| r.truth.map_or("-", TruthKind::name).to_owned()),
        ("maps", |r| r.maps.to_string()),
        ("texels", |r| r.texels.to_string()),
        ("KiB", |r| r.bytes.map_or("-".into(), |b| b.div_ceil(1024).to_string())),
        ("wrong", |r| percent(r.metrics.wrong_fraction)),
        ("false light", |r| percent(r.metrics.false_light)),
        ("mean error", |r| number(r.metrics.mean_abs_error, 4)),
        ("light error", |r| number(r.metrics.light_error, 4)),
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
        "truth" => report.truth.area.is_some(),
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
